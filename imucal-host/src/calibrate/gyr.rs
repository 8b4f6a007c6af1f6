//! The gyroscope from turns between rests: full gain in the accelerometer's axes, bias from the rests.

use imucal_core::{
    accept::{self, Limits, Refusal},
    coverage::Coverage,
    model::{parameterisation::FULL_GAIN, turn::TurnModel},
    observation::{Rest, Turn},
    solver::LevenbergMarquardt,
    triad::Triad,
};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use std::ops::Range;

use super::{
    norm_fit::dynamic,
    outcome::{BiasWander, Evidence, FitSummary, KnownTurn, Refused, SensorOutcome},
    outlier::outliers,
    rows::{Residuals, Rows},
    search::{SWARM_OBSERVATIONS, Search, Searched},
};
use crate::{
    observe::turn::{BiasPath, TurnData, compress},
    recording::{SensorKind, Triple, Unit},
};

/// Name of the model in files: K, nine entries.
pub const MODEL: &str = "K9";
/// Turns at least: nine parameters from two residuals a turn, and some to check them.
const LEAST_TURNS: usize = 8;
/// A turn tells something once a direction moves by this much, rad (15°).
const LEAST_ANGLE: f64 = 0.26;
/// The bias wanders where the rests' means spread this many times wider than their own noise explains.
const WANDER: f64 = 1.5;
/// Largest rms error of a turn, rad (5.7°): beyond it axes are swapped or a unit is wrong.
const LARGEST_RMS: f64 = 0.1;
/// How far a swarm looks, each entry of the gain to either side of nominal: as far as a gain is plausible below it.
const REACH: f64 = 0.5;

/// What the gyroscope is calibrated from.
#[derive(Clone, Copy, Debug)]
pub struct GyrInput<'a> {
    /// Time, s.
    pub time: &'a [f64],
    /// The gyroscope.
    pub sensor: &'a Triple,
    /// Rows in which it is usable.
    pub usable: &'a [bool],
    /// Usual interval, s.
    pub interval: f64,
    /// Rows of the rests, with what was observed in each.
    pub rows: &'a [Range<usize>],
    /// The rests.
    pub rests: &'a [Rest<f64>],
    /// Rests whose direction is to be trusted.
    pub used: &'a [usize],
    /// The accelerometer's calibration, nominal SI in.
    pub acc: &'a Triad<f64>,
}

/// Turns and the bias they are counted from.
struct Turns {
    data: Vec<TurnData>,
    bias: Vector3<f64>,
    bias_std: Vector3<f64>,
    wander: BiasWander,
    left_out: Vec<String>,
}

impl GyrInput<'_> {
    fn turns(&self) -> Turns {
        let (bias, bias_std, wander) = rest_bias(self.rests);
        let mut turns = Turns { data: Vec::new(), bias, bias_std, wander, left_out: Vec::new() };
        for pair in self.used.windows(2) {
            let (i, j) = (pair[0], pair[1]);
            let mean = |k: usize| {
                if wander.interpolated { self.rests[k].gyr.mean() } else { bias }
            };
            let path =
                BiasPath { before: (self.rests[i].time, mean(i)), after: (self.rests[j].time, mean(j)) };
            let ends = (i, &self.rows[i], j, &self.rows[j]);
            match compress(self.time, &self.sensor.values, self.usable, self.interval, ends, &path) {
                Ok(data) => turns.data.push(data),
                Err(gap) => turns.left_out.push(format!("turn from rest {} to {}: {gap}", i + 1, j + 1)),
            }
        }
        turns
    }

    fn direction(&self, rest: usize) -> Vector3<f64> {
        self.acc.correct(&self.rests[rest].acc.mean()).normalize()
    }

    fn with_directions<'a>(&self, data: &'a [TurnData]) -> Vec<Turn<'a, f64>> {
        data.iter()
            .map(|turn| turn.between(self.direction(turn.rest_before), self.direction(turn.rest_after)))
            .collect()
    }
}

/// Mean rate at rest, its standard error, and how it moved from rest to rest.
fn rest_bias(rests: &[Rest<f64>]) -> (Vector3<f64>, Vector3<f64>, BiasWander) {
    let total: f64 = rests.iter().map(|r| f64::from(r.gyr.count())).sum();
    let bias = rests.iter().map(|r| r.gyr.mean() * f64::from(r.gyr.count())).sum::<Vector3<f64>>() / total;
    let count = rests.len().max(2) as f64;
    let spread =
        rests.iter().map(|r| (r.gyr.mean() - bias).map(|d| d * d)).sum::<Vector3<f64>>() / (count - 1.0);
    let noise =
        rests.iter().map(|r| r.gyr.variance() / f64::from(r.gyr.count().max(1))).sum::<Vector3<f64>>()
            / count;
    let (spread, expected) = (spread.map(f64::sqrt), noise.map(f64::sqrt));
    let interpolated = (0..3).any(|axis| spread[axis] > WANDER * expected[axis]);
    (bias, spread / count.sqrt(), BiasWander { spread, expected, interpolated })
}

/// From the nominal gain; a swarm looks at the shortest turns.
fn solve(turns: &[Turn<'_, f64>]) -> (LevenbergMarquardt<f64, 9>, Search) {
    let mut shortest = turns.to_vec();
    shortest.sort_by_key(|turn| turn.blocks.len());
    shortest.truncate(SWARM_OBSERVATIONS);
    let searched = Searched {
        model: &TurnModel { turns, form: FULL_GAIN },
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
    Residuals::of(&TurnModel { turns, form: FULL_GAIN }, theta)
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
    let turns = input.turns();
    if turns.data.len() < LEAST_TURNS {
        return None;
    }
    let near = FULL_GAIN.theta(&Triad { gain: *near, bias: Vector3::zeros() });
    let known = input.with_directions(&turns.data);
    let step = Rows::of(&TurnModel { turns: &known, form: FULL_GAIN }, &near).step_without(0..0)?;
    Some(FULL_GAIN.triad(&(near + step)).gain.diagonal())
}

/// The outcome of a gyroscope whose accelerometer gives no directions.
pub fn without_accelerometer(refusal: Refusal) -> SensorOutcome {
    let advice =
        "a gyroscope without a rig is calibrated from the directions that an accepted accelerometer gives \
                  at rest; see the accelerometer's reason"
            .into();
    SensorOutcome {
        suspicions: Vec::new(),
        kind: SensorKind::Gyr,
        model: MODEL,
        verdict: Err(Refused { refusal, advice }),
        fit: None,
        evidence: None,
    }
}

/// Calibrates from turns between rests.
pub fn calibrate(input: &GyrInput<'_>) -> SensorOutcome {
    let mut turns = input.turns();
    if let Err(refusal) = check_turns(input, &turns) {
        return refuse(refusal, None);
    }
    let (mut solver, mut search) = solve(&input.with_directions(&turns.data));
    let gross = outliers(&turn_errors(&input.with_directions(&turns.data), solver.theta()));
    for (index, size) in gross.iter().rev() {
        let turn = turns.data.remove(*index);
        turns.left_out.push(format!(
            "turn from rest {} to {}: {size:.1} robust standard deviations",
            turn.rest_before + 1,
            turn.rest_after + 1
        ));
    }
    let known = input.with_directions(&turns.data);
    if !gross.is_empty() {
        (solver, search) = solve(&known);
    }
    let summary = summarise(input, &turns, &known, (&solver, search));
    match judge(&solver, &summary) {
        Ok(()) => SensorOutcome {
            suspicions: Vec::new(),
            kind: SensorKind::Gyr,
            model: MODEL,
            verdict: Ok(()),
            fit: Some(summary),
            evidence: Some(Evidence::Turns(
                known
                    .iter()
                    .zip(&turns.data)
                    .map(|(turn, data)| KnownTurn {
                        data: data.clone(),
                        before: turn.before,
                        after: turn.after,
                    })
                    .collect(),
            )),
        },
        Err(refusal) => refuse(refusal, Some(summary)),
    }
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

fn judge(solver: &LevenbergMarquardt<f64, 9>, summary: &FitSummary) -> Result<(), Refusal> {
    let limits = Limits { rms: LARGEST_RMS, ..Limits::for_norm(9, LEAST_TURNS) };
    accept::check_report(&solver.report(), &limits)?;
    accept::check_nonlinearity(summary.nonlinearity, &limits)?;
    accept::check_plausibility(&summary.triad, true, summary.rms, &limits)
}

fn refuse(refusal: Refusal, fit: Option<FitSummary>) -> SensorOutcome {
    let advice = match refusal {
        Refusal::NoMotion | Refusal::TooFewObservations { .. } => {
            "turn the sensor by 30° or more between rests, ten times or more, each time about another axis"
        }
        Refusal::IllConditioned { .. } | Refusal::TooNonlinear { .. } => {
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
    let rows = Rows::of(&TurnModel { turns: known, form: FULL_GAIN }, theta);
    let errors: Option<Vec<f64>> = (0..known.len())
        .map(|left| {
            let step = rows.step_without(3 * left..3 * left + 3)?;
            turn_errors(&known[left..=left], &(theta + step)).first().copied()
        })
        .collect();
    Some(rms(&errors?))
}

fn summarise(
    input: &GyrInput<'_>,
    turns: &Turns,
    known: &[Turn<'_, f64>],
    (solver, search): (&LevenbergMarquardt<f64, 9>, Search),
) -> FitSummary {
    let report = solver.report();
    let gain = FULL_GAIN.triad(solver.theta()).gain;
    let covariance = solver.covariance().unwrap_or_else(|| SMatrix::repeat(f64::INFINITY));
    let gain_std = FULL_GAIN.triad(&covariance.diagonal().map(f64::sqrt)).gain;
    FitSummary {
        triad: Triad { gain, bias: turns.bias },
        gain_std,
        bias_std: turns.bias_std,
        covariance: dynamic(&covariance),
        covariance_of: FULL_GAIN.entries().to_vec(),
        unit_in: input.sensor.unit,
        unit_out: Unit::RadianPerSecond,
        nominal: input.sensor.nominal,
        rms: rms(&turn_errors(known, solver.theta())),
        held_out_rms: held_out_rms(known, solver.theta()),
        observations: known.len(),
        parameters: 9,
        condition: report.condition,
        coverage: Coverage::of(known.iter().flat_map(|t| turn_axis(t))).share,
        nonlinearity: accept::nonlinearity(solver, &TurnModel { turns: known, form: FULL_GAIN }, 1.0),
        inflation: 1.0,
        iterations: report.iterations,
        termination: report.termination,
        field_norm: None,
        left_out: turns.left_out.clone(),
        gain_spread: None,
        bias_wander: Some(turns.wander),
        rig: None,
        alignment: None,
        search: Some(search),
    }
}

/// The axis that carries one direction of gravity to the next, both senses: a turn and its reverse tell the same.
fn turn_axis(turn: &Turn<'_, f64>) -> impl Iterator<Item = Vector3<f64>> + Clone + use<> {
    let axis = turn.before.cross(&turn.after).try_normalize(1e-6);
    axis.into_iter().flat_map(|a| [a, -a])
}
