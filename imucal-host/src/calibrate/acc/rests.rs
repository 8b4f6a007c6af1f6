//! The accelerometer from its rests: T9 (upper triangular gain and bias) or T6 (diagonal), |gain · (raw − bias)| = g.

use imucal_core::{
    accept::{Limits, Refusal},
    model::{
        Parameterisation,
        parameterisation::{DIAGONAL, UPPER_TRIANGULAR},
    },
    observation::{Rest, ShellPoint},
    triad::Triad,
};
use nalgebra::Vector3;

use crate::{
    calibrate::{
        fit::{
            compare,
            compare::{Comparison, Step},
            norm_fit::{NormFit, NormProblem, raw_coverage},
            report::FitReport,
            rest_noise::RestNoise,
            shell_errors::ShellErrors,
        },
        outcome::{Estimates, Evidence, FitSummary, Refused, SensorOutcome},
        temperature::{
            TemperatureFinding, Thermometry,
            rests::{self, Kept, WarmRests},
        },
    },
    noise::Noise,
    recording::{SensorKind, Triple, Unit},
};

/// Forms of the accelerometer's model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AccModel {
    /// Bias, scale and non-orthogonality (9).
    #[default]
    T9,
    /// Bias and scale (6): what six faces can determine.
    T6,
}

impl AccModel {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::T9 => "T9",
            Self::T6 => "T6",
        }
    }

    /// Distinct directions that determine and check it. Six faces determine six parameters axis by axis, which is
    /// the classic six-position test; nine need a tenth to be checked.
    fn directions(self) -> usize {
        match self {
            Self::T9 => 10,
            Self::T6 => 6,
        }
    }
}

/// An accelerometer's outcome, and the calibration for the sensors that lean on it.
#[derive(Clone, Debug)]
pub struct AccResult {
    /// For the report.
    pub outcome: SensorOutcome,
    /// Indices of the rests that were used.
    pub used: Vec<usize>,
    /// Noise of the rests' means, nominal SI, where the fit gives it.
    pub noise: Option<Noise>,
}

fn points(rests: &[Rest<f64>]) -> Vec<ShellPoint<f64>> {
    rests.iter().map(|rest| ShellPoint::new(rest.acc.mean())).collect()
}

/// Fit of T9 at one segmentation, for comparing segmentations; `None` where there is too little to fit.
pub fn trial(rests: &[Rest<f64>], gravity: f64) -> Option<(Triad<f64>, f64)> {
    let points = points(rests);
    (points.len() > 9).then(|| {
        let problem = NormProblem { points: &points, norm: gravity, form: UPPER_TRIANGULAR, serial: false };
        let fit = problem.fit(&Triad::identity());
        (UPPER_TRIANGULAR.triad(fit.solver.theta()), fit.rms())
    })
}

/// The ladder of the field form, T6 and T9; `None` where there are too few rests for either.
pub fn compare(rests: &[Rest<f64>], gravity: f64) -> Option<Comparison> {
    let points = points(rests);
    let mut steps = Vec::new();
    if points.len() > 7 {
        steps.push(step("T6", "bias and scale", &points, gravity, DIAGONAL));
    }
    if points.len() > 10 {
        steps.push(step("T9", "non-orthogonality", &points, gravity, UPPER_TRIANGULAR));
    }
    compare::climb(SensorKind::Acc, steps)
}

fn step<const P: usize>(
    name: &'static str,
    adds: &'static str,
    points: &[ShellPoint<f64>],
    gravity: f64,
    form: Parameterisation<P>,
) -> Step {
    let problem = NormProblem { points, norm: gravity, form, serial: false };
    let fit = problem.fit(&Triad::identity());
    let held_out_rms = problem.leave_one_out_rms(&fit);
    FitReport { held_out_rms, ..fit.report() }.step(name, adds, form.entries())
}

/// The outcome where the sensor lay still from beginning to end.
pub fn never_moved(model: AccModel) -> AccResult {
    refused(Refusal::NoMotion, None, model)
}

fn refused(refusal: Refusal, fit: Option<FitSummary>, model: AccModel) -> AccResult {
    AccResult {
        outcome: SensorOutcome {
            suspicions: Vec::new(),
            kind: SensorKind::Acc,
            model: model.name(),
            verdict: Err(Refused { advice: advice(&refusal, model), refusal }),
            fit,
            evidence: None,
        },
        used: Vec::new(),
        noise: None,
    }
}

/// What an accelerometer is calibrated from.
#[derive(Clone, Copy, Debug)]
pub struct AccInput<'a> {
    /// The rests.
    pub rests: &'a [Rest<f64>],
    /// What they show of the noise of their means.
    pub noise: &'a RestNoise,
    /// The accelerometer.
    pub sensor: &'a Triple,
    /// Local gravity, m/s².
    pub gravity: f64,
    /// The thermometer, where terms of temperature are asked for.
    pub thermometry: Option<&'a Thermometry<'a>>,
}

/// Calibrates from rests.
pub fn calibrate(input: &AccInput<'_>, model: AccModel) -> AccResult {
    match model {
        AccModel::T9 => with_form(input, model, UPPER_TRIANGULAR),
        AccModel::T6 => with_form(input, model, DIAGONAL),
    }
}

fn with_form<const P: usize>(input: &AccInput<'_>, model: AccModel, form: Parameterisation<P>) -> AccResult {
    let gravity = input.gravity;
    let points = points(input.rests);
    let limits = Limits::for_norm(P, model.directions());
    let refuse = |refusal: Refusal, fit: Option<FitSummary>| refused(refusal, fit, model);
    if points.is_empty() {
        return refuse(Refusal::NoRest, None);
    }
    if points.len() <= P {
        let seen = raw_coverage(&points, &Vector3::zeros());
        return refuse(
            Refusal::TooFewObservations { have: seen.observations, need: limits.observations },
            None,
        );
    }
    let problem = NormProblem { points: &points, norm: gravity, form, serial: false };
    let fit = problem.fit(&Triad::identity());
    let (finding, kept) = warm(input, &points, &form.triad(fit.solver.theta()), model);
    let summary =
        |(summary, verdict): (FitSummary, _)| (FitSummary { temperature: finding, ..summary }, verdict);
    let Some(kept) = kept else {
        let errors = ShellErrors::of_rests(&problem, &fit, input.noise);
        let (summary, verdict) = summary(judged(&problem, &fit, input, &errors, None, &limits));
        return result(model, gravity, fit, summary, verdict, errors.noise);
    };
    let reduced = kept.reduced(input, &points, &form);
    let problem = NormProblem { points: &reduced, ..problem };
    let mut fit = problem.fit(&kept.triad(&form));
    let errors = ShellErrors::of_rests(&problem, &fit, &input.noise.of_those(&kept.fit.used));
    let errors = errors.with_covariance(kept.fit.first::<P>());
    fit.used = fit.used.iter().map(|k| kept.fit.used[*k]).collect();
    fit.left_out = fit.left_out.iter().map(|(k, size)| (kept.fit.used[*k], *size)).collect();
    fit.left_out.extend(&kept.left_out);
    let (summary, verdict) = summary(judged(&problem, &fit, input, &errors, Some(&kept), &limits));
    result(model, gravity, fit, summary, verdict, errors.noise)
}

/// What the rests say of temperature, where that is asked for.
fn warm(
    input: &AccInput<'_>,
    points: &[ShellPoint<f64>],
    near: &Triad<f64>,
    model: AccModel,
) -> (Option<TemperatureFinding>, Option<Kept>) {
    let Some(thermometry) = input.thermometry else { return (None, None) };
    let of = |value: fn(&Rest<f64>) -> f64| -> Vec<f64> { input.rests.iter().map(value).collect() };
    let rests = WarmRests {
        points,
        times: &of(|rest| rest.time),
        temperatures: &of(|rest| rest.temperature),
        gravity: input.gravity,
        noise: input.noise,
        diagonal: model == AccModel::T6,
    };
    let (finding, kept) = rests::estimate(&rests, thermometry, near);
    (Some(finding), kept)
}

impl Kept {
    /// The triad at the reference temperature, of a form whose entries come first.
    fn triad<const P: usize>(&self, form: &Parameterisation<P>) -> Triad<f64> {
        form.triad(&nalgebra::SVector::from_fn(|k, _| self.fit.fitted.theta[k]))
    }

    /// The points used, as they would be at the reference temperature.
    fn reduced<const P: usize>(
        &self,
        input: &AccInput<'_>,
        points: &[ShellPoint<f64>],
        form: &Parameterisation<P>,
    ) -> Vec<ShellPoint<f64>> {
        let triad = self.triad(form);
        let at = |k: &usize| self.terms.reduced(&triad, &points[*k].value, input.rests[*k].temperature);
        self.fit.used.iter().map(|k| ShellPoint::new(at(k))).collect()
    }
}

/// A fit's figures and whether it is accepted.
fn judged<const P: usize>(
    problem: &NormProblem<'_, P>,
    fit: &NormFit<P>,
    input: &AccInput<'_>,
    errors: &ShellErrors<P>,
    kept: Option<&Kept>,
    limits: &Limits,
) -> (FitSummary, Result<(), Refusal>) {
    let coverage = problem.coverage(fit);
    let (bend, verdict) = problem.judge(fit, &coverage, &errors.stated(&problem.form, fit), true, limits);
    (summary(problem, fit, input, errors, (coverage.share, bend), kept), verdict)
}

fn result<const P: usize>(
    model: AccModel,
    gravity: f64,
    fit: NormFit<P>,
    summary: FitSummary,
    verdict: Result<(), Refusal>,
    noise: Option<Noise>,
) -> AccResult {
    if let Err(refusal) = verdict {
        return refused(refusal, Some(summary), model);
    }
    AccResult {
        outcome: SensorOutcome {
            suspicions: Vec::new(),
            kind: SensorKind::Acc,
            model: model.name(),
            verdict: Ok(()),
            evidence: Some(Evidence::Shell {
                points: fit.points,
                places: fit.used.clone(),
                norm: gravity,
                diagonal: model == AccModel::T6,
                triad: summary.triad,
                std: Box::new(Triad { gain: summary.gain_std, bias: summary.bias_std }),
            }),
            fit: Some(summary),
        },
        used: fit.used,
        noise,
    }
}

fn summary<const P: usize>(
    problem: &NormProblem<'_, P>,
    fit: &NormFit<P>,
    input: &AccInput<'_>,
    errors: &ShellErrors<P>,
    (coverage, nonlinearity): (f64, f64),
    kept: Option<&Kept>,
) -> FitSummary {
    let report = match kept {
        None => FitReport { held_out_rms: problem.leave_one_out_rms(fit), ..fit.report() },
        Some(kept) => kept.fit.report(&fit.report(), 1),
    };
    let report = FitReport { nonlinearity, inflation: errors.inflation.max(), ..report };
    let estimates = Estimates::of(&problem.form, fit.solver.theta(), &errors.covariance);
    FitSummary {
        left_out: fit
            .left_out
            .iter()
            .map(|(k, size)| {
                format!(
                    "rest {} at {:.1} s: {size:.1} robust standard deviations",
                    k + 1,
                    input.rests[*k].time
                )
            })
            .collect(),
        ..FitSummary::new(&report, estimates, input.sensor, Unit::MetrePerSecondSquared, coverage)
    }
}

fn advice(refusal: &Refusal, model: AccModel) -> String {
    match refusal {
        Refusal::NoRest => "begin with 10 s or more of rest, and lay the sensor still for 2 s in each pose".into(),
        Refusal::NotRedundant { .. } if model == AccModel::T9 => {
            "record at least ten poses that differ by 15° or more, oblique ones among them; six faces support the \
             six parameters of --model acc=T6"
                .into()
        }
        Refusal::NoMotion => {
            "lay the sensor still for 2 s in each of ten poses or more, turned by 15° or more from each other".into()
        }
        Refusal::TooFewObservations { .. } | Refusal::NotRedundant { .. } => {
            "record more poses at rest, each turned by 15° or more from the others".into()
        }
        Refusal::PoorCoverage { .. } => "turn the sensor about all of its axes, face down as well as face up".into(),
        Refusal::IllConditioned { .. } | Refusal::Imprecise { .. } | Refusal::TooNonlinear { .. } => {
            "add oblique poses between the faces, and poses upside down".into()
        }
        Refusal::Implausible { .. } => "check [units], [counts] and [site] gravity of the recording's TOML".into(),
        _ => "check the recording for motion during rests, clipping and wrong units".into(),
    }
}
