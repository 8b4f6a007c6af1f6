//! The magnetometer against an attitude reference: vectors and not lengths, so that its gain has the reference body's
//! axes, as the gyroscope's has.
//!
//! | model | estimated | of the field |
//! | --- | --- | --- |
//! | M12 | K and bias | taken from the site: the reference's frame is n |
//! | M15 | K and bias | its direction too, in the reference's frame, however that stands; its length is the site's, or else such that the gain has determinant 1 |
//!
//! The model is that of a rig ([`imucal_core::model::unified`]) without gimbals; [`crate::calibrate::fit::reference_fit`] fits it.

use imucal_core::{
    accept::{self, Refusal},
    coverage::Coverage,
    model::{rig::ReferencePose, unified::UnifiedParameters},
};
use nalgebra::{Matrix3, Vector3};

use super::{
    ladder::{M15, MAGNETOMETER, T12},
    rig,
};
use crate::{
    calibrate::{
        Options,
        fit::{
            compare,
            compare::Step,
            lag::Lag,
            reference_fit,
            reference_fit::{ReferenceFit, Tracked},
        },
        mag::samples,
        outcome::{Calibration, Evidence, FitSummary, Refused, SensorOutcome},
    },
    observe::{
        cloud::cloud,
        motion::{self, Attitudes},
        pose,
    },
    recording::{Recording, SensorKind, Triple, Unit},
};

/// To either side of the lag, s, where attitudes are looked at for how they turn with it.
const ASIDE: f64 = 0.004;
/// Samples that the search for a lag looks at: a thousand determine it as well as all.
const FOR_LAG: usize = 1500;

/// What a magnetometer is calibrated from.
struct Samples {
    tracked: Tracked,
    /// The row of each.
    rows: Vec<usize>,
    /// Distinct usable samples, with or without a reference.
    all: usize,
    notes: Vec<String>,
}

/// Calibrates against the reference attitude; `None` where there is none, or the field form is asked for.
pub fn magnetometer(
    recording: &Recording,
    sensor: &Triple,
    usable: &[bool],
    options: &Options,
    calibration: &mut Calibration,
) -> Option<SensorOutcome> {
    let asked = options.rig_mag?;
    let attitudes = motion::along_reference(recording, &mut calibration.warnings)?;
    let field = recording.manifest.site.field_ned_ut.map(Vector3::from);
    let samples = samples(recording, sensor, usable, &attitudes);
    // Without gimbals, a rung that has sources on them is the one below it.
    let known = field.filter(|_| matches!(asked, "M12" | "X18"));
    let name = if known.is_some() { "M12" } else { "M15" };
    let need = rig::limits().observations;
    let Some(base) = reference_fit::start(&samples.tracked.poses) else {
        return Some(refused(
            name,
            Refusal::TooFewObservations { have: samples.tracked.poses.len(), need },
            None,
        ));
    };
    let base = field.map_or(base, |field| of_length(&base, field.norm()));
    let basic = field.filter(|_| known.is_some() || options.compare);
    let basic = basic
        .map(|field| reference_fit::fit::<12>(&samples.tracked, &UnifiedParameters::nominal(field), T12));
    let turned =
        (known.is_none() || options.compare).then(|| reference_fit::fit(&samples.tracked, &base, M15));
    if options.compare {
        let fits = [&basic, &turned].into_iter().zip(MAGNETOMETER);
        let steps = fits.filter_map(|(found, rung)| Some(step(rung, found.as_ref()?)));
        calibration.comparisons.extend(compare::climb(SensorKind::Mag, steps.collect()));
    }
    let found = if known.is_some() { basic? } else { turned? };
    Some(outcome(name, &found, &samples, sensor, field))
}

/// The fit as a rung of a comparison, with as many residuals as are independent of each other.
fn step((name, adds): (&'static str, &'static str), found: &ReferenceFit) -> Step {
    let alike = found.fit.report.inflation * found.fit.report.inflation;
    let step = found.fit.step(name, adds);
    let residuals = (step.residuals as f64 / alike) as usize;
    Step { residuals, squared_sum: step.squared_sum / alike, ..step }
}

/// The same outputs, from a field of this length.
fn of_length(parameters: &UnifiedParameters<f64>, length: f64) -> UnifiedParameters<f64> {
    let factor = length / parameters.vector_n.norm();
    UnifiedParameters {
        vector_n: parameters.vector_n * factor,
        sensitivity: parameters.sensitivity / factor,
        ..*parameters
    }
}

/// Samples with the attitude they were taken at: the sensor may be behind the reference.
fn samples(recording: &Recording, sensor: &Triple, usable: &[bool], attitudes: &Attitudes) -> Samples {
    let later = |lag: f64| motion::later(&recording.time, attitudes, lag);
    let at = |lag: f64| pose::along_reference(&sensor.values, usable, &later(lag)).0;
    let (plain, rows) = pose::along_reference(&sensor.values, usable, attitudes);
    let all = cloud(&sensor.values, usable).rows.len();
    let rms = |poses: &[ReferencePose<f64>]| {
        reference_fit::start(poses).map_or(f64::NAN, |base| reference_fit::rms(poses, &base, M15))
    };
    let step = (rows.len() / FOR_LAG).max(1);
    let some = |lag: f64| at(lag).into_iter().step_by(step).collect::<Vec<_>>();
    let lag = Lag::of(|lag| rms(&some(lag)), |lag| rms(&at(lag)));
    let (tracked, rows) = match lag {
        Lag::Found(lag) => {
            let [before, now, after] = [-ASIDE, 0.0, ASIDE].map(|aside| later(lag + aside));
            let (found, rows) = pose::along_reference(&sensor.values, usable, &now);
            let c_p_t = |attitudes: &Attitudes, row: usize| attitudes[row].map(|c| c.transpose());
            let slope = |row: &usize| {
                let moved = c_p_t(&after, *row).zip(c_p_t(&before, *row));
                moved.map_or_else(Matrix3::zeros, |(after, before)| (after - before) / (2.0 * ASIDE))
            };
            (Tracked { poses: found, by_lag: rows.iter().map(slope).collect() }, rows)
        }
        Lag::OutOfReach => (Tracked { poses: plain, by_lag: Vec::new() }, rows),
    };
    Samples { tracked, rows, all, notes: vec![lag.note()] }
}

fn outcome(
    name: &'static str,
    found: &ReferenceFit,
    samples: &Samples,
    sensor: &Triple,
    field: Option<Vector3<f64>>,
) -> SensorOutcome {
    let Some((triad, covariance)) = found.fit.triad() else {
        return refused(name, Refusal::NotFinite, None);
    };
    let coverage = Coverage::of(found.kept.iter().map(|pose| triad.correct(&pose.value).normalize()));
    let unit = Unit::of(SensorKind::Mag)[0];
    let mut summary = rig::summarise(&found.fit, sensor, unit, triad, covariance, coverage.share);
    summary.left_out = samples::stretches(&found.left_out);
    let verdict = judge(found, &summary, &coverage, field.is_some());
    if field.is_none() {
        samples::to_unit_determinant(&mut summary, found.fit.parameters.vector_n.norm());
    }
    note(&mut summary, samples, found, field.is_some());
    match verdict {
        Ok(()) => SensorOutcome {
            suspicions: Vec::new(),
            kind: SensorKind::Mag,
            model: name,
            verdict: Ok(()),
            fit: Some(summary),
            evidence: Some(Evidence::Reference {
                poses: found.kept.clone(),
                rows: found.used.iter().map(|k| samples.rows[*k]).collect(),
                fit: Box::new(found.fit.clone()),
            }),
        },
        Err(refusal) => refused(name, refusal, Some(summary)),
    }
}

/// What the fit is made of and what it does not determine, in words.
fn note(summary: &mut FitSummary, samples: &Samples, found: &ReferenceFit, known: bool) {
    let direction = found.fit.parameters.vector_n.normalize();
    let Some(rig) = &mut summary.rig else { return };
    rig.notes.push(format!(
        "against the reference attitude at {} of {} samples; the others have none",
        samples.tracked.poses.len(),
        samples.all
    ));
    rig.notes.extend(samples.notes.iter().cloned());
    if rig.field_n.is_some() {
        rig.field_n = known.then_some(found.fit.parameters.vector_n);
        let [x, y, z] = [direction.x, direction.y, direction.z];
        rig.notes.push(format!("the field points along {x:.3}, {y:.3}, {z:.3} in the reference's frame"));
        // One component of the field is what K takes of its length.
        rig.unobservable.retain(|name| !name.starts_with("field_"));
        rig.unobservable.push(if known {
            "the field's length (like K's size): taken from [site] field_ned_ut".into()
        } else {
            "the field's length (like K's size): gain of determinant 1".into()
        });
    }
}

fn judge(
    found: &ReferenceFit,
    summary: &FitSummary,
    coverage: &Coverage<f64>,
    nominal: bool,
) -> Result<(), Refusal> {
    let limits = rig::limits();
    accept::check_observations(coverage, found.fit.free(), &limits)?;
    let relative = summary.rms / found.fit.parameters.vector_n.norm();
    // Before what depends on the noise: a residual that is no noise would be blamed on the poses.
    if found.fit.report.solver.termination.was_successful() {
        accept::check_residual(relative, &limits)?;
    }
    accept::check_report(&found.fit.report.solver)?;
    let error = summary.relative_error(found.fit.parameters.vector_n.norm());
    accept::check_precision(error, &limits)?;
    accept::check_nonlinearity(summary.nonlinearity, error, &limits)?;
    accept::check_plausibility(&summary.triad, nominal, relative, &limits)
}

fn refused(model: &'static str, refusal: Refusal, fit: Option<FitSummary>) -> SensorOutcome {
    let advice = match refusal {
        Refusal::TooFewObservations { .. }
        | Refusal::PoorCoverage { .. }
        | Refusal::NotRedundant { .. }
        | Refusal::IllConditioned { .. }
        | Refusal::Imprecise { .. }
        | Refusal::TooNonlinear { .. } => {
            "turn the body about all of its axes, upside down as well, in view of the cameras; or --model mag=E9 for \
             the field form"
        }
        Refusal::Implausible { .. } => {
            "keep away from iron and currents; check the unit, and that ref_q* takes the body's axes to the room's, \
             scalar first; or --model mag=E9 for the field form"
        }
        _ => "check the recording for clipping, for iron that moved, and for a reference that lost its body",
    };
    let verdict = Err(Refused { refusal, advice: advice.into() });
    SensorOutcome { suspicions: Vec::new(), kind: SensorKind::Mag, model, verdict, fit, evidence: None }
}
