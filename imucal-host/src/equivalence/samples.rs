//! Sample by sample: the core's corrector in `f32` against the reference in `f64`.

use imucal_core::{corrector::Corrector, record::TriadRecord};
use nalgebra::Vector3;

use super::{reference, ulp};
use crate::{
    recording::{SensorKind, Triple, Unit},
    store::StoredTriad,
};

/// Largest difference allowed, as a share of full scale.
pub const LIMIT: f64 = 2e-6;

/// How the corrected samples of one sensor differ.
#[derive(Clone, Copy, Debug)]
pub struct SampleEquivalence {
    /// Which sensor.
    pub kind: SensorKind,
    /// Samples compared.
    pub samples: usize,
    /// Largest difference of an axis, `unit`.
    pub max: f64,
    /// Rms difference of an axis, `unit`.
    pub rms: f64,
    /// Largest difference in units of the last place of the reference as `f32`. Near zero these are many, though
    /// the difference is small.
    pub max_ulp: f64,
    /// Full scale of the calibrated output, `unit`; the largest calibrated value where no range is given.
    pub full_scale: f64,
    /// Unit of the calibrated output.
    pub unit: Unit,
}

impl SampleEquivalence {
    /// The differences are within [`LIMIT`] of full scale.
    pub fn passes(&self) -> bool {
        self.max <= LIMIT * self.full_scale
    }
}

/// Compares one sensor's corrections over a recording. `stored` is what was asked for, `record` what the device
/// holds of it.
pub fn compare(
    kind: SensorKind,
    triple: &Triple,
    stored: &StoredTriad,
    record: &TriadRecord,
) -> SampleEquivalence {
    let corrector = Corrector::<f32>::from(record);
    let (mut samples, mut max, mut sum, mut max_ulp, mut largest) = (0usize, 0.0f64, 0.0f64, 0.0f64, 0.0f64);
    for value in triple.values.iter().filter(|v| v.iter().all(|x| x.is_finite())) {
        let raw = value.map(|x| triple.nominal.to_raw(x));
        let device: Vector3<f32> = corrector.apply(&raw.cast::<f32>());
        let expected = reference::correct(&stored.gain, &stored.bias, raw.into());
        samples += 1;
        for (a, b) in device.iter().zip(expected) {
            let difference = (f64::from(*a) - b).abs();
            max = max.max(difference);
            sum += difference * difference;
            max_ulp = max_ulp.max(ulp(f64::from(*a), b));
            largest = largest.max(b.abs());
        }
    }
    SampleEquivalence {
        kind,
        samples,
        max,
        rms: (sum / (3.0 * samples.max(1) as f64)).sqrt(),
        max_ulp,
        full_scale: full_scale(triple, stored).unwrap_or(largest),
        unit: stored.unit_out,
    }
}

/// The recording's range in calibrated units.
fn full_scale(triple: &Triple, stored: &StoredTriad) -> Option<f64> {
    let gain = (stored.gain[0][0].abs() + stored.gain[1][1].abs() + stored.gain[2][2].abs()) / 3.0;
    Some(triple.full_scale? * gain)
}
