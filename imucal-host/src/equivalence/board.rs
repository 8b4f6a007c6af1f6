//! Bit by bit: a device against the core on this machine, in the same precision.

use imucal_core::{
    corrector::FullCorrector,
    record::{CalibrationRecord, Date, HigherOrder},
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

/// Replays every sensor that the record holds through a device that uses this record, at the recording's temperatures
/// where it has terms of them.
///
/// # Errors
/// [`DeviceError`].
pub fn samples(
    session: &mut Session,
    recording: &Recording,
    record: &CalibrationRecord<HigherOrder>,
) -> Result<Vec<BoardSamples>, DeviceError> {
    let mut all = Vec::new();
    for kind in SensorKind::ALL {
        let (Some(triple), Some(triad)) = (recording.sensor(kind), record.triad(kind.into())) else {
            continue;
        };
        let warmth = |row: usize| match (&recording.temperature, &triad.temperature) {
            (Some(all), Some(_)) => all.get(row).map_or(f32::NAN, |temperature| *temperature as f32),
            _ => f32::NAN,
        };
        let measured =
            triple.raw_samples().enumerate().filter(|(_, sample)| sample.iter().all(|x| x.is_finite()));
        let (raw, temperature): (Vec<Vector3<f32>>, Vec<f32>) =
            measured.map(|(row, sample)| (sample, warmth(row))).unzip();
        let answers = session.correct_at(kind, &raw, &temperature)?;
        all.push(match FullCorrector::try_from(triad) {
            Ok(corrector) => compare(kind, &corrector, (&raw, &temperature), &answers),
            // Nothing can be said of it here, so nothing passes.
            Err(_) => BoardSamples { kind, samples: raw.len(), different: raw.len(), first: Some(0) },
        });
    }
    Ok(all)
}

/// Compares a device's answers with a corrector's, for raw samples with the temperature of each, °C or NaN.
pub fn compare(
    kind: SensorKind,
    corrector: &FullCorrector<f32>,
    (raw, temperature): (&[Vector3<f32>], &[f32]),
    answers: &[Vector3<f32>],
) -> BoardSamples {
    let bits = |v: &Vector3<f32>| v.map(f32::to_bits);
    let differs = |((raw, temperature), answer): ((&Vector3<f32>, &f32), &Vector3<f32>)| {
        bits(&corrector.apply_at(raw, *temperature)) != bits(answer)
    };
    let pairs = || raw.iter().zip(temperature).zip(answers);
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
    use imucal_core::{corrector::Corrector, temperature::TemperatureTerms, triad::Triad};
    use nalgebra::Matrix3;

    use super::*;

    #[test]
    fn one_ulp_of_one_axis_of_one_sample_is_found() {
        let gain = Matrix3::new(1.01f32, 0.02, 0.03, 0.0, 0.99, 0.01, 0.0, 0.0, 1.02);
        let terms = TemperatureTerms { reference: 20.0, bias_slope: [0.1; 3], scale_slope: [1e-3; 3] };
        let first = Corrector::new(Triad { gain, bias: Vector3::new(0.1, 0.2, 0.3) }, Some(terms));
        let corrector = FullCorrector::from(first);
        let raw: Vec<_> = (0..100).map(|k| Vector3::new(k as f32, 0.5 * k as f32, 9.8)).collect();
        let warmth: Vec<_> =
            (0..100).map(|k| if k % 3 == 0 { f32::NAN } else { 0.4 * k as f32 + 0.1 }).collect();
        let mut answers: Vec<_> =
            raw.iter().zip(&warmth).map(|(raw, t)| corrector.apply_at(raw, *t)).collect();
        let compare =
            |answers: &[Vector3<f32>]| compare(SensorKind::Acc, &corrector, (&raw, &warmth), answers);
        assert!(compare(&answers).passes());
        // Of the 34 without a reading none differs.
        let cold: Vec<_> = raw.iter().map(|raw| corrector.apply(raw)).collect();
        assert_eq!(compare(&cold).different, 66);
        answers[57].y = answers[57].y.next_up();
        let found = compare(&answers);
        assert_eq!((found.different, found.first, found.passes()), (1, Some(57), false));
        answers.truncate(57);
        assert_eq!(compare(&answers).first, Some(57));
    }
}
