//! The gyroscope from turns between rests: full gain in the accelerometer's axes, bias from the rests.

use imucal_core::{
    accept::{self, Refusal},
    coverage::Coverage,
    model::{parameterisation::FULL_GAIN, turn::TurnModel},
    observation::{Rest, Turn},
    solver::LevenbergMarquardt,
    triad::Triad,
};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::{
    acceptance::judge,
    observed_turns::{GyrInput, Turns},
    turn_errors,
    turn_errors::{Between, RateNoise},
};
use crate::{
    calibrate::{
        fit::{
            gyr_rig_fit::LARGEST_RMS,
            held_out::{by_steps, root_mean},
            least_squares,
            least_squares::dynamic,
            outlier::{Kept, leaving_out},
            parallel_turns::ParallelTurns,
            report::FitReport,
            rest_bias,
            rest_bias::BiasErrors,
            rows::{Residuals, Rows, weakest_inflation},
            search::{SWARM_OBSERVATIONS, Search, Searched},
        },
        outcome::{Estimates, Evidence, FitSummary, Refused, SensorOutcome},
        temperature::{
            TemperatureFinding,
            rest_rates::{self, WarmRates},
            rests,
            turns::{self as warm_turns, WarmTurns},
        },
    },
    observe::turn::TurnData,
    recording::{SensorKind, Unit},
};

/// Name of the model in files: K, nine entries.
pub const MODEL: &str = "K9";
/// Turns at least: nine parameters from two residuals a turn, and some to check them.
const LEAST_TURNS: usize = 8;
/// A turn counts once a direction moves by this much, rad (15°).
const LEAST_ANGLE: f64 = 0.26;
/// How far a swarm looks, each entry of the gain to either side of nominal: as far as a gain is plausible below it.
const REACH: f64 = 0.5;

/// From the nominal gain; a swarm looks at the shortest turns.
fn solve(turns: &[Turn<'_, f64>]) -> (LevenbergMarquardt<f64, 9>, Search) {
    let mut shortest = turns.to_vec();
    shortest.sort_by_key(|turn| turn.blocks.len());
    shortest.truncate(SWARM_OBSERVATIONS);
    let searched = Searched {
        model: &ParallelTurns(TurnModel { turns, form: FULL_GAIN }),
        cost: &TurnModel { turns: &shortest, form: FULL_GAIN },
        start: FULL_GAIN.theta(&Triad::identity()),
        reach: SVector::repeat(REACH),
        rms: &|theta| rms(&turn_errors(turns, theta)),
        limit: LARGEST_RMS,
    };
    searched.solve()
}

/// Chord between the carried and the measured direction of each turn, rad.
fn turn_errors(turns: &[Turn<'_, f64>], theta: &SVector<f64, 9>) -> Vec<f64> {
    Residuals::of(&ParallelTurns(TurnModel { turns, form: FULL_GAIN }), theta)
        .chunks_exact(3)
        .map(|r| r.iter().map(|x| x * x).sum::<f64>().sqrt())
        .collect()
}

fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
}

/// Gain's diagonal at one segmentation, for comparing segmentations; `None` where there are too few turns.
///
/// One Gauss–Newton step from `near`, the gain at the chosen segmentation: segmentations differ by parts in a
/// thousand, so what a second step would add is a part in a million.
pub fn trial(input: &GyrInput<'_>, near: &Matrix3<f64>) -> Option<Vector3<f64>> {
    let turns = input.turns(None);
    if turns.data.len() < LEAST_TURNS {
        return None;
    }
    let near = FULL_GAIN.theta(&Triad { gain: *near, bias: Vector3::zeros() });
    let known = input.with_directions(&turns.data);
    let step = Rows::of(&TurnModel { turns: &known, form: FULL_GAIN }, &near).step()?;
    Some(FULL_GAIN.triad(&(near + step)).gain.diagonal())
}

/// The outcome of a gyroscope whose accelerometer gives no directions.
pub fn without_accelerometer(refusal: Refusal) -> SensorOutcome {
    not_fitted(
        refusal,
        "a gyroscope without a rig is calibrated from the directions that an accepted accelerometer gives at rest; see the \
         accelerometer's reason",
    )
}

/// The outcome of a gyroscope that was recorded without an accelerometer, an encoder and a reference.
pub fn alone() -> SensorOutcome {
    not_fitted(
        Refusal::TooFewObservations { have: 0, need: LEAST_TURNS },
        "nothing in the recording says how far the gyroscope turned; record the accelerometer as well, or a rig's encoders, or a \
         reference attitude",
    )
}

/// A gyroscope whose samples at rest are stuck or clipped, so that its bias is not known.
pub fn unknown_at_rest() -> SensorOutcome {
    not_fitted(
        Refusal::NoRest,
        "the gyroscope's values do not change at rest, so that its bias is not known; switch off the dead band or filter \
         that holds them",
    )
}

fn not_fitted(refusal: Refusal, advice: &str) -> SensorOutcome {
    SensorOutcome {
        suspicions: Vec::new(),
        kind: SensorKind::Gyr,
        model: MODEL,
        verdict: Err(Refused { refusal, advice: advice.into() }),
        fit: None,
        evidence: None,
    }
}

/// Calibrates from turns between rests.
pub fn calibrate(input: &GyrInput<'_>) -> SensorOutcome {
    let (mut finding, of_bias) = warm_bias(input);
    let mut turns = input.turns(of_bias.as_ref());
    if let Err(refusal) = check_turns(input, &turns) {
        return refuse(refusal, None);
    }
    let (mut fitted, bias) =
        rayon::join(|| fit(&input.with_directions(&turns.data)), || bias_errors(input, of_bias.as_ref()));
    let of_scale = finding.as_mut().and_then(|finding| {
        warm_scale(input, &turns, &FULL_GAIN.triad(fitted.fit.0.theta()).gain, &bias, finding)
    });
    if let Some(kept) = &of_scale {
        turns.reduce(kept);
        turns.left_out.extend(kept.left_out.iter().map(|(k, size)| turns.data[*k].left_out(*size)));
        turns.keep(&kept.fit.used);
        fitted = fit(&input.with_directions(&turns.data));
    }
    let Kept { fit: (solver, search), used, left_out } = fitted;
    turns.left_out.extend(left_out.iter().map(|(index, size)| turns.data[*index].left_out(*size)));
    turns.keep(&used);
    let known = input.with_directions(&turns.data);
    let summary = summarise(input, &turns, &known, (&solver, search), (&bias, of_scale.as_ref()));
    let summary = FitSummary { temperature: finding, ..summary };
    match judge(&solver.report(), &summary, LEAST_TURNS) {
        Ok(()) => SensorOutcome {
            suspicions: Vec::new(),
            kind: SensorKind::Gyr,
            model: MODEL,
            verdict: Ok(()),
            fit: Some(summary),
            evidence: Some(Evidence::Turns(turns.known(&known))),
        },
        Err(refusal) => refuse(refusal, Some(summary)),
    }
}

/// A fit to turns, without gross outliers.
fn fit(known: &[Turn<'_, f64>]) -> Kept<(LevenbergMarquardt<f64, 9>, Search)> {
    leaving_out(known.len(), 1, &mut |used, _| {
        let known: Vec<_> = used.iter().map(|k| known[*k]).collect();
        let (solver, search) = solve(&known);
        let errors = turn_errors(&known, solver.theta());
        ((solver, search), errors)
    })
}

/// What the rests say of the bias' temperature, where that is asked for.
fn warm_bias(input: &GyrInput<'_>) -> (Option<TemperatureFinding>, Option<rests::Kept>) {
    let Some(thermometry) = input.thermometry else { return (None, None) };
    let of = |value: fn(&Rest<f64>) -> f64| -> Vec<f64> { input.rests.iter().map(value).collect() };
    let temperatures = of(|rest| rest.temperature);
    let mut finding = TemperatureFinding::new(&temperatures);
    if let Err(refusal) = thermometry.check(&temperatures) {
        return (Some(finding.refused(refusal)), None);
    }
    let rates = WarmRates {
        means: &input.rest_means(),
        times: &of(|rest| rest.time),
        temperatures: &temperatures,
        noise: &input.at_rest().noise(),
    };
    let kept = rest_rates::estimate(&rates, &mut finding);
    (Some(finding), kept)
}

/// The bias' error, of the fit with its terms of temperature where there is one.
fn bias_errors(input: &GyrInput<'_>, warm: Option<&rests::Kept>) -> BiasErrors {
    let bias = rest_bias::errors(input.rests, &input.rest_means(), &input.at_rest());
    let Some(kept) = warm else { return bias };
    let variance = kept.fit.first::<3>().diagonal();
    BiasErrors { std: (variance + bias.steps).map(f64::sqrt), ..bias }
}

/// What the turns say of the scale's temperature; nothing where that of the rests says nothing.
fn warm_scale(
    input: &GyrInput<'_>,
    turns: &Turns,
    near: &Matrix3<f64>,
    bias: &BiasErrors,
    finding: &mut TemperatureFinding,
) -> Option<rests::Kept> {
    if finding.refusal.is_some() {
        return None;
    }
    let (thermometry, directions) = (input.thermometry?, input.directions?);
    let known = input.with_directions(&turns.data);
    let middle =
        |turn: &TurnData| 0.5 * (input.rests[turn.rest_before].time + input.rests[turn.rest_after].time);
    let warm = WarmTurns {
        turns: &between(&turns.data, &known),
        times: &turns.data.iter().map(middle).collect::<Vec<_>>(),
        temperatures: &turns.data.iter().map(|turn| thermometry.mean(&turn.rows)).collect::<Vec<_>>(),
        directions,
        rates: &rate_noise(input, turns, bias),
    };
    warm_turns::estimate(&warm, near, finding)
}

/// Turns that move a direction, and enough of them.
fn check_turns(input: &GyrInput<'_>, turns: &Turns) -> Result<(), Refusal> {
    let telling = turns
        .data
        .iter()
        .filter(|t| input.direction(t.rest_before).angle(&input.direction(t.rest_after)) > LEAST_ANGLE)
        .count();
    match telling {
        0 if turns.left_out.is_empty() => Err(Refusal::NoMotion),
        have if have < LEAST_TURNS => Err(Refusal::TooFewObservations { have, need: LEAST_TURNS }),
        _ => Ok(()),
    }
}

fn refuse(refusal: Refusal, fit: Option<FitSummary>) -> SensorOutcome {
    let advice = match refusal {
        Refusal::NoMotion | Refusal::TooFewObservations { .. } => {
            "turn the sensor by 30° or more between rests, ten times or more, each time about another axis"
        }
        Refusal::IllConditioned { .. } | Refusal::Imprecise { .. } | Refusal::TooNonlinear { .. } => {
            "turn the sensor about all three of its axes between rests, by large angles and in both senses"
        }
        Refusal::Implausible { .. } => {
            "check the gyroscope's unit, axes and signs against the accelerometer's"
        }
        _ => "check the recording for clipping and wrong units",
    };
    SensorOutcome {
        suspicions: Vec::new(),
        kind: SensorKind::Gyr,
        model: MODEL,
        verdict: Err(Refused { refusal, advice: advice.into() }),
        fit,
        evidence: None,
    }
}

/// Rms error of turns left out of the fit, one at a time. Each time the fit takes one Gauss–Newton step from the
/// optimum of all; the held turn is then integrated afresh.
fn held_out_rms(known: &[Turn<'_, f64>], theta: &SVector<f64, 9>) -> Option<f64> {
    let (rows, count) =
        (Rows::of(&ParallelTurns(TurnModel { turns: known, form: FULL_GAIN }), theta), known.len());
    let sum = by_steps(&rows, theta, (count, 3), |k, theta| {
        turn_errors(&known[k..=k], theta).iter().map(|e| e * e).sum()
    });
    Some(root_mean(sum?, count))
}

fn summarise(
    input: &GyrInput<'_>,
    turns: &Turns,
    known: &[Turn<'_, f64>],
    (solver, search): (&LevenbergMarquardt<f64, 9>, Search),
    (bias, of_scale): (&BiasErrors, Option<&rests::Kept>),
) -> FitSummary {
    let gain = FULL_GAIN.triad(solver.theta()).gain;
    let classical = least_squares::covariance(solver);
    let (covariance, (rms, held_out_rms)) = rayon::join(
        || {
            let covariance = of_scale.map(|kept| kept.fit.first::<9>());
            covariance.or_else(|| gain_covariance(input, turns, known, &gain, bias)).unwrap_or(classical)
        },
        || (rms(&turn_errors(known, solver.theta())), held_out_rms(known, solver.theta())),
    );
    let report = FitReport {
        rms,
        held_out_rms,
        nonlinearity: accept::nonlinearity(
            solver,
            &ParallelTurns(TurnModel { turns: known, form: FULL_GAIN }),
            weakest_inflation(solver, &covariance),
        ),
        inflation: covariance.diagonal().component_div(&classical.diagonal()).map(f64::sqrt).max(),
        ..FitReport::of(solver, known.len(), 3)
    };
    let terms = of_scale.map_or(0, |kept| kept.fit.free.len() - kept.fit.model);
    let report = FitReport { parameters: report.parameters + terms, ..report };
    let estimates = Estimates {
        triad: Triad { gain, bias: turns.bias },
        std: Triad { gain: FULL_GAIN.triad(&covariance.diagonal().map(f64::sqrt)).gain, bias: bias.std },
        covariance: dynamic(&covariance),
        covariance_of: FULL_GAIN.entries().to_vec(),
    };
    let coverage = Coverage::of(known.iter().flat_map(|t| turn_axis(t))).share;
    FitSummary {
        left_out: turns.left_out.clone(),
        bias_wander: Some(turns.wander),
        search: Some(search),
        ..FitSummary::new(&report, estimates, input.sensor, Unit::RadianPerSecond, coverage)
    }
}

/// Covariance of the gain; `None` where it is not known how directions err.
fn gain_covariance(
    input: &GyrInput<'_>,
    turns: &Turns,
    known: &[Turn<'_, f64>],
    gain: &Matrix3<f64>,
    bias: &BiasErrors,
) -> Option<SMatrix<f64, 9, 9>> {
    let (between, rates) = (between(&turns.data, known), rate_noise(input, turns, bias));
    turn_errors::errors(&between, gain, input.directions?, &rates).map(|errors| turn_errors::fixed(&errors))
}

fn between<'a>(data: &[TurnData], known: &[Turn<'a, f64>]) -> Vec<Between<'a>> {
    let one = |(turn, data): (&Turn<'a, f64>, &TurnData)| Between {
        turn: *turn,
        rests: (data.rest_before, data.rest_after),
    };
    known.iter().zip(data).map(one).collect()
}

fn rate_noise(input: &GyrInput<'_>, turns: &Turns, bias: &BiasErrors) -> RateNoise {
    // In motion the steps of the converter are noise, whatever they are at rest.
    let rounding = input.step.map(|step| step * step / 12.0) * input.rates.interval;
    let interpolated = turns.wander.interpolated;
    RateNoise {
        density: bias.density.zip_map(&rounding, f64::max).mean(),
        bias: if interpolated { bias.steps } else { bias.std.map(|std| std * std) },
        interpolated,
    }
}

/// The axis that carries one direction of gravity to the next, both senses: a turn and its reverse say the same.
fn turn_axis(turn: &Turn<'_, f64>) -> impl Iterator<Item = Vector3<f64>> + Clone + use<> {
    let axis = turn.before.cross(&turn.after).try_normalize(1e-6);
    axis.into_iter().flat_map(|a| [a, -a])
}
