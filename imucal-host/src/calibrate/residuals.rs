//! What a fit leaves of each observation, for whoever shows it.
//!
//! | observation | residual |
//! | --- | --- |
//! | rest, point of a cloud | length of the calibrated vector less the norm, calibrated unit |
//! | pose on a rig or along a reference | length of the calibrated vector less the median of all, calibrated unit |
//! | turn | chord from the direction that the rates carry it to, to the one that is there, rad |
//!
//! Not given: motions between known attitudes, of which a fit keeps no residuals.

use imucal_core::{model::parameterisation::FULL_GAIN, triad::Triad};
use nalgebra::Vector3;

use super::{
    examination::gyr_residual,
    outcome::{Evidence, FitSummary, KnownTurn, SensorOutcome},
};
use crate::{
    observe::motion::MotionData,
    recording::{Recording, order_statistics::median},
};

/// An observation and what the fit leaves of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObservationResidual {
    /// Middle of the observation, s; its number where no time of it is kept.
    pub at: f64,
    /// Calibrated direction, or the axis of a turn, sensor's axes; length is of no meaning.
    pub direction: Vector3<f64>,
    /// The residual; `None` where a fit keeps none.
    pub residual: Option<f64>,
}

/// All observations of an outcome; none without a fit.
#[must_use]
pub fn of(
    outcome: &SensorOutcome,
    recording: &Recording,
    calibration: &super::Calibration,
) -> Vec<ObservationResidual> {
    let (Some(fit), Some(evidence)) = (&outcome.fit, &outcome.evidence) else { return Vec::new() };
    let time = |row: usize| recording.time.get(row).copied().unwrap_or(f64::NAN);
    match evidence {
        Evidence::Shell { points, places, norm, triad, .. } => {
            let rests = calibration.segmentation.as_ref().map_or(&[][..], |found| &found.rests);
            // An accelerometer's places are rests, those of a cloud are rows.
            let at = |place: usize| match (outcome.kind, rests.get(place)) {
                (crate::recording::SensorKind::Mag, _) => time(place),
                (_, Some(rows)) => time(rows.start.midpoint(rows.end)),
                (_, None) => f64::NAN,
            };
            let one = |(point, place): (&imucal_core::observation::ShellPoint<f64>, &usize)| {
                let direction = triad.correct(&point.value);
                let residual = Some(direction.norm() - point.excess - norm);
                ObservationResidual { at: at(*place), direction, residual }
            };
            points.iter().zip(places).map(one).collect()
        }
        Evidence::Turns(turns) => of_turns(turns, fit, &time),
        Evidence::Motions { data, .. } => {
            let one = |motion: &MotionData| ObservationResidual {
                at: time(motion.rows.start.midpoint(motion.rows.end)),
                direction: motion.turned(),
                residual: None,
            };
            data.iter().map(one).collect()
        }
        Evidence::Gimbals(poses, _) => {
            let values = poses.poses.iter().map(|pose| pose.value);
            let at = poses.spans.iter().map(|span| 0.5 * (span.start + span.end));
            of_lengths(values, at, &fit.triad)
        }
        Evidence::Reference { poses, rows, .. } => {
            of_lengths(poses.iter().map(|pose| pose.value), rows.iter().map(|row| time(*row)), &fit.triad)
        }
    }
}

fn of_turns(turns: &[KnownTurn], fit: &FitSummary, time: &dyn Fn(usize) -> f64) -> Vec<ObservationResidual> {
    let theta = FULL_GAIN.theta(&Triad { gain: fit.triad.gain, bias: Vector3::zeros() });
    let rows = gyr_residual::rows(turns, &theta);
    let one = |(turn, chord): (&KnownTurn, &[f64])| ObservationResidual {
        at: time(turn.data.rows.start.midpoint(turn.data.rows.end)),
        direction: turn.data.angle(),
        residual: Some(chord.iter().map(|part| part * part).sum::<f64>().sqrt()),
    };
    turns.iter().zip(rows.residuals.chunks(3)).map(one).collect()
}

fn of_lengths(
    values: impl Iterator<Item = Vector3<f64>>,
    at: impl Iterator<Item = f64>,
    triad: &Triad<f64>,
) -> Vec<ObservationResidual> {
    let calibrated: Vec<Vector3<f64>> = values.map(|value| triad.correct(&value)).collect();
    let norm = median(calibrated.iter().map(Vector3::norm).collect()).unwrap_or(f64::NAN);
    let one = |(direction, at): (Vector3<f64>, f64)| ObservationResidual {
        at,
        direction,
        residual: Some(direction.norm() - norm),
    };
    calibrated.into_iter().zip(at).map(one).collect()
}
