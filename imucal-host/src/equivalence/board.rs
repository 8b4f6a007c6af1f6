//! Bit by bit: a device against the core on this machine, in the same precision.

use imucal_core::{
    corrector::Corrector,
    record::{CalibrationRecord, Date},
};
use nalgebra::Vector3;

use crate::{
    calibrate::{Calibration, outcome::SensorOutcome},
    device::{DeviceError, Session, fit::BoardFit},
    recording::{Recording, SensorKind},
};

/// How many of a sensor's samples a device corrected otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoardSamples {
    /// Which sensor.
    pub kind: SensorKind,
    /// Samples compared.
    pub samples: usize,
    /// Those of them that differ in a bit.
    pub different: usize,
    /// The first of these, counted from 0.
    pub first: Option<usize>,
}

impl BoardSamples {
    /// All bits are the same.
    pub fn passes(&self) -> bool {
        self.samples > 0 && self.different == 0
    }
}

/// Replays every sensor that the record holds through a device that uses this record.
///
/// # Errors
/// [`DeviceError`].
pub fn samples(
    session: &mut Session,
    recording: &Recording,
    record: &CalibrationRecord,
) -> Result<Vec<BoardSamples>, DeviceError> {
    let mut all = Vec::new();
    for kind in SensorKind::ALL {
        let (Some(triple), Some(triad)) = (recording.sensor(kind), record.triad(kind.into())) else {
            continue;
        };
        let raw: Vec<Vector3<f32>> =
            triple.raw_samples().filter(|sample| sample.iter().all(|x| x.is_finite())).collect();
        let corrector = Corrector::<f32>::from(triad);
        let answers = session.correct(kind.into(), f32::NAN, &raw)?;
        all.push(compare(kind, &corrector, &raw, &answers));
    }
    Ok(all)
}

/// Compares a device's answers with a corrector's.
pub fn compare(
    kind: SensorKind,
    corrector: &Corrector<f32>,
    raw: &[Vector3<f32>],
    answers: &[Vector3<f32>],
) -> BoardSamples {
    let bits = |v: &Vector3<f32>| v.map(f32::to_bits);
    let differs = |(raw, answer): (&Vector3<f32>, &Vector3<f32>)| bits(&corrector.apply(raw)) != bits(answer);
    let pairs = || raw.iter().zip(answers);
    let missing = raw.len().abs_diff(answers.len());
    BoardSamples {
        kind,
        samples: raw.len(),
        different: pairs().filter(|pair| differs(*pair)).count() + missing,
        first: pairs().position(differs).or((missing > 0).then_some(raw.len().min(answers.len()))),
    }
}

/// One sensor's fit, on a device and here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoardFitEquivalence {
    /// Which sensor.
    pub kind: SensorKind,
    /// Parameters and covariance are the same, bit for bit.
    pub equal: bool,
}

/// Makes every fit of a calibration that devices have once more, on a device and here. The device uses what it
/// accepts, until a record is put.
///
/// # Errors
/// [`DeviceError`].
pub fn fits(
    session: &mut Session,
    calibration: &Calibration,
) -> Result<Vec<BoardFitEquivalence>, DeviceError> {
    let capacity = session.identity().capacity;
    let mut all = Vec::new();
    let board = |outcome: &SensorOutcome| Some((outcome.kind, BoardFit::of(outcome, &capacity)?));
    for (kind, fit) in calibration.sensors.iter().filter_map(board) {
        let report = session.fit(&fit, Date::from_days(0))?;
        if let Some(equal) = fit.is_here(&report) {
            all.push(BoardFitEquivalence { kind, equal });
        }
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use imucal_core::triad::Triad;
    use nalgebra::Matrix3;

    #[test]
    fn one_ulp_of_one_axis_of_one_sample_is_found() {
        let gain = Matrix3::new(1.01f32, 0.02, 0.03, 0.0, 0.99, 0.01, 0.0, 0.0, 1.02);
        let corrector = Corrector::new(Triad { gain, bias: Vector3::new(0.1, 0.2, 0.3) }, None);
        let raw: Vec<_> = (0..100).map(|k| Vector3::new(k as f32, 0.5 * k as f32, 9.8)).collect();
        let mut answers: Vec<_> = raw.iter().map(|sample| corrector.apply(sample)).collect();
        assert!(compare(SensorKind::Acc, &corrector, &raw, &answers).passes());
        answers[57].y = answers[57].y.next_up();
        let found = compare(SensorKind::Acc, &corrector, &raw, &answers);
        assert_eq!((found.different, found.first, found.passes()), (1, Some(57), false));
        answers.truncate(57);
        assert_eq!(compare(SensorKind::Acc, &corrector, &raw, &answers).first, Some(57));
    }
}
