//! The gyroscope against known attitudes: a rig's encoders at rests, or an optical reference on the way.
//!
//! | attitudes | a motion goes | and starts |
//! | --- | --- | --- |
//! | encoders | from inside one still stretch to inside the next | from the encoders' mean |
//! | optical reference | over [`OPTICAL`](super::motions::OPTICAL) s | from the reference |
//!
//! No motion starts from where another ended, so drift does not accumulate. The gain is full, in the table's axes: any
//! constant rotation between the sensor and the table, or the optical body, is part of it. Source: models.md 3, a
//! reconstruction; the model is [`imucal_core::model::attitude`].

use imucal_core::{
    accept::Refusal,
    coverage::Coverage,
    model::parameterisation::{FULL, FULL_WITH_SENSITIVITY},
    triad::Triad,
};
use nalgebra::{DMatrix, Matrix3, Vector3};

use super::{
    acceptance::judge,
    motions::{Observations, lagging, on_encoders},
};
use crate::{
    calibrate::{
        Options,
        fit::{gyr_rig_fit, gyr_rig_fit::MotionFit, report::FitReport},
        outcome::{Calibration, Estimates, Evidence, FitSummary, Refused, RigFindings, SensorOutcome},
        temperature::{Thermometry, motions as warm_motions},
    },
    noise::Span,
    observe::{
        motion::{self, MotionData},
        pose,
    },
    recording::{Recording, SensorKind, Triple, Unit},
};

/// Gain and bias.
pub const G12: &str = "G12";
/// And g-sensitivity.
pub const G21: &str = "G21";
/// Models of a gyroscope against known attitudes, with what each adds.
pub const MODELS: [(&str, &str); 2] = [(G12, "gain and bias"), (G21, "g-sensitivity")];

/// Motions at least, per nine parameters of the gain.
const LEAST_MOTIONS: usize = 8;
/// A motion counts for the gain once it turns by this much, rad (5°).
const LEAST_ANGLE: f64 = 0.087;

/// Calibrates against attitudes, and gives what it is calibrated from; `None` where the recording has none, or the field form is asked for.
pub fn gyroscope(
    recording: &Recording,
    sensor: &Triple,
    usable: &[bool],
    options: &Options,
    (calibration, thermometry): (&mut Calibration, Option<&Thermometry<'_>>),
) -> Option<(SensorOutcome, Option<Observations>)> {
    let name = options.rig_gyr?;
    let mut observations = if recording.gimbal.is_some() {
        match pose::axes_and_encoders(recording) {
            Ok((axes, gimbal)) => {
                let attitudes = motion::of_encoders(gimbal, &axes);
                on_encoders(recording, sensor, usable, gimbal, &attitudes, &axes, thermometry)
            }
            Err(why) => {
                let warning = format!("the rig is not used: {why}");
                if !calibration.warnings.contains(&warning) {
                    calibration.warnings.push(warning);
                }
                return None;
            }
        }
    } else {
        lagging(recording, sensor, usable, &motion::along_reference(recording, &mut calibration.warnings)?)
    };
    if recording.manifest.site.latitude_deg.is_none() {
        calibration.warnings.push(
            "gyr: no [site] latitude_deg: Earth's rotation is left in the bias, where it does not belong"
                .into(),
        );
    }
    if let Err(refusal) = check(&observations, name) {
        return Some((refused(name, refusal, None), None));
    }
    Some((outcome(name, sensor, &mut observations, thermometry), Some(observations)))
}

/// Motions that turn, and enough of them.
pub(crate) fn check(observations: &Observations, name: &str) -> Result<(), Refusal> {
    let need = if name == G21 { 2 * LEAST_MOTIONS } else { LEAST_MOTIONS };
    let telling = observations.data.iter().filter(|d| d.turned().norm() > LEAST_ANGLE).count();
    match telling {
        0 if observations.data.len() >= need => Err(Refusal::NoMotion),
        have if have < need => Err(Refusal::TooFewObservations { have, need }),
        _ => Ok(()),
    }
}

pub(crate) fn fit(name: &str, observations: &Observations) -> MotionFit {
    let (data, bias) = (&observations.data, observations.bias);
    if name == G21 {
        gyr_rig_fit::fit(data, FULL_WITH_SENSITIVITY, bias)
    } else {
        gyr_rig_fit::fit(data, FULL, bias)
    }
}

fn outcome(
    name: &'static str,
    sensor: &Triple,
    observations: &mut Observations,
    thermometry: Option<&Thermometry<'_>>,
) -> SensorOutcome {
    let mut fit = fit(name, observations);
    if let Some(thermometry) = thermometry.filter(|_| name == G12)
        && let Some(warm) = warm(&fit, observations, thermometry)
    {
        fit = warm;
    }
    let summary = summarise(&fit, sensor, observations);
    let summary = FitSummary { temperature: observations.temperature.clone(), ..summary };
    match judge(&fit.report.solver, &summary, LEAST_MOTIONS) {
        Ok(()) => SensorOutcome {
            suspicions: Vec::new(),
            kind: SensorKind::Gyr,
            model: name,
            verdict: Ok(()),
            fit: Some(summary),
            evidence: Some(Evidence::Motions {
                data: fit.kept.iter().map(|k| observations.data[*k].clone()).collect(),
                fit: Box::new(fit),
            }),
        },
        Err(refusal) => refused(name, refusal, Some(summary)),
    }
}

fn refused(model: &'static str, refusal: Refusal, fit: Option<FitSummary>) -> SensorOutcome {
    let advice = match refusal {
        Refusal::NoMotion | Refusal::TooFewObservations { .. } => {
            "record more: on a rig, slews by 30° or more about all three axes with rests of 2 s between them; with an \
             optical reference, half a minute of turning about all axes in view of the cameras; or --model gyr=K9 for \
             the field form"
        }
        Refusal::IllConditioned { .. } | Refusal::Imprecise { .. } | Refusal::TooNonlinear { .. } => {
            "turn the table about all three of its axes, by large angles and in both senses; with G21, in many \
             attitudes"
        }
        Refusal::Implausible { .. } => {
            "check the gyroscope's unit, axes and signs, [rig] axes, and the encoders' or the reference's unit and \
             direction (table to n)"
        }
        _ => "check the recording for clipping and wrong units",
    };
    let verdict = Err(Refused { refusal, advice: advice.into() });
    SensorOutcome { suspicions: Vec::new(), kind: SensorKind::Gyr, model, verdict, fit, evidence: None }
}

/// Where the motions bear out that the scale follows the temperature: the fit to motions as they would be at the reference
/// temperature, with the errors of the fit of all parameters together. The motions are then these.
fn warm(
    cold: &MotionFit,
    observations: &mut Observations,
    thermometry: &Thermometry<'_>,
) -> Option<MotionFit> {
    let finding = observations.temperature.as_mut().filter(|finding| finding.refusal.is_none())?;
    let used: Vec<&MotionData> = observations.data.iter().collect();
    let temperatures: Vec<f64> = used.iter().map(|data| thermometry.mean(&data.rows)).collect();
    let kept = warm_motions::estimate(&used, &temperatures, &cold.triad, finding)?;
    let at = |k: usize| kept.fit.fitted.theta[k];
    let (gain, bias) = (Matrix3::from_fn(|i, j| at(3 * i + j)), Vector3::from_fn(|axis, _| at(9 + axis)));
    let reduced = |k: &usize| {
        let stretch = kept.terms.stretch(&gain, temperatures[*k]);
        observations.data[*k].clone().stretched(&stretch, &bias)
    };
    observations.data = kept.fit.used.iter().map(reduced).collect();
    let fit = gyr_rig_fit::fit(&observations.data, FULL, bias);
    let size = kept.fit.model;
    let covariance = kept.fit.covariance.view((0, 0), (size, size)).into_owned();
    let parameters = fit.report.parameters + kept.fit.free.len() - size;
    Some(MotionFit { covariance, report: FitReport { parameters, ..fit.report }, ..fit })
}

/// Of a fit to motions whose errors are independent, and of the bias's drift: that from one motion to the next is a
/// part of those errors, and a bias is not known better than the mean of its drift is.
fn covariance(fit: &MotionFit, observations: &Observations) -> DMatrix<f64> {
    let Some(noise) = &observations.noise else { return fit.covariance.clone() };
    let drift = noise.without_white();
    let spans: Vec<Span> = fit.kept.iter().map(|k| observations.data[*k].span.clone()).collect();
    &fit.covariance + drift.propagated(&spans, &fit.bias_influence)
}

fn summarise(fit: &MotionFit, sensor: &Triple, observations: &Observations) -> FitSummary {
    let covariance = covariance(fit, observations);
    let std = |k: usize| covariance[(k, k)].sqrt();
    let used = || fit.kept.iter().map(|k| &observations.data[*k]);
    let axes = used().filter_map(|d| d.turned().try_normalize(1e-6)).flat_map(|a| [a, -a]);
    let axes: Vec<Vector3<f64>> = axes.collect();
    let mut left_out = observations.left_out.clone();
    left_out.extend(fit.gross.iter().map(|(k, size)| {
        let from = observations.data[*k].rows.start;
        format!("motion from row {from}: {size:.1} robust standard deviations")
    }));
    let notes = observations.notes.clone();
    let sensitivity = (fit.entries.len() == 21).then(|| {
        let at = |of: &dyn Fn(usize) -> f64| Matrix3::from_fn(|i, j| of(12 + 3 * i + j));
        (at(&|k| fit.parameters[k]), at(&std))
    });
    let estimates = Estimates {
        triad: fit.triad,
        std: Triad {
            gain: Matrix3::from_fn(|i, j| std(3 * i + j)),
            bias: Vector3::from_fn(|i, _| std(9 + i)),
        },
        covariance: covariance.view((0, 0), (12, 12)).into_owned(),
        covariance_of: fit.entries[..12].to_vec(),
    };
    let coverage = Coverage::of(axes.iter().copied()).share;
    FitSummary {
        left_out,
        bias_wander: observations.wander,
        rig: Some(RigFindings { notes, g_sensitivity: sensitivity, ..RigFindings::default() }),
        search: Some(fit.search),
        ..FitSummary::new(&fit.report, estimates, sensor, Unit::RadianPerSecond, coverage)
    }
}

#[cfg(test)]
mod tests;
