//! Sample by sample: the core's corrector in `f32` against the reference in `f64`.
//!
//! Two questions. Does the record hold what was stored, each figure as the nearest `f32`? And does the core compute
//! what these figures say, each axis of each sample to [`LIMIT`] times the bound of its own roundings
//! ([`super::rounding`])? Both together hold a device to the calibration: what `f32` itself costs is in neither.

use imucal_core::{
    corrector::{Compensator, FullCorrector},
    record::{HigherOrder, TriadRecord},
};
use nalgebra::Vector3;

use super::{reference, rounding, ulp};
use crate::{
    recording::{Recording, SensorKind, Triple, Unit},
    store::StoredTriad,
};

/// Largest difference allowed, in bounds of the sample's own roundings: the bound holds for every sample, and the
/// largest of a recording comes near it (`tests/verify_simulated.rs`). A margin would hide what is looked for: four
/// times as much, and a gain that is wrong by a millionth passes where the raw values stand far from zero.
pub const LIMIT: f64 = 1.0;

/// How the corrected samples of one sensor differ.
#[derive(Clone, Copy, Debug)]
pub struct SampleEquivalence {
    /// Which sensor.
    pub kind: SensorKind,
    /// Samples compared.
    pub samples: usize,
    /// Those of them that were corrected for a temperature.
    pub warm: usize,
    /// Largest difference of an axis from the calibration as it was stored, `unit`.
    pub max: f64,
    /// Rms of that difference, `unit`.
    pub rms: f64,
    /// The largest in units of the last place of the reference as `f32`. Near zero these are many, though the
    /// difference is small.
    pub max_ulp: f64,
    /// Largest difference of an axis from what the record's figures say, in bounds of that sample's roundings.
    pub of_bound: f64,
    /// Every figure of the record is the nearest to the one stored.
    pub record_is_nearest: bool,
    /// Full scale of the calibrated output, `unit`; the largest calibrated value where no range is given.
    pub full_scale: f64,
    /// Unit of the calibrated output.
    pub unit: Unit,
}

impl SampleEquivalence {
    /// There are samples, the record holds what was stored, and no difference is beyond [`LIMIT`] bounds.
    pub fn passes(&self) -> bool {
        self.samples > 0 && self.record_is_nearest && self.of_bound <= LIMIT
    }
}

/// Samples of one sensor with the temperature of each, °C; none where it was not recorded.
#[derive(Clone, Copy, Debug)]
pub struct Samples<'a> {
    /// Which sensor.
    pub kind: SensorKind,
    /// Its samples.
    pub triple: &'a Triple,
    /// As many readings.
    pub temperature: Option<&'a [f64]>,
}

impl<'a> Samples<'a> {
    /// Those of a recording; `None` where it has not this sensor.
    pub fn of(recording: &'a Recording, kind: SensorKind) -> Option<Self> {
        let triple = recording.sensor(kind)?;
        Some(Self { kind, triple, temperature: recording.temperature.as_deref() })
    }
}

/// Compares one sensor's corrections over a recording. `stored` is what was asked for, `record` what the device
/// holds of it.
pub fn compare(
    samples: Samples<'_>,
    stored: &StoredTriad,
    record: &TriadRecord<HigherOrder>,
) -> SampleEquivalence {
    let mut core = FullCorrector::<f32>::try_from(record).map(Compensator::new);
    // A record that cannot be applied makes no number, and no comparison passes.
    compare_by(samples, stored, record, |raw, temperature| match &mut core {
        Ok(core) => core.apply_at(raw, temperature),
        Err(_) => Vector3::repeat(f32::NAN),
    })
}

/// The same with samples corrected by whoever is called: with a raw sample and its temperature, °C or NaN.
pub fn compare_by(
    samples: Samples<'_>,
    stored: &StoredTriad,
    record: &TriadRecord<HigherOrder>,
    mut device: impl FnMut(&Vector3<f32>, f32) -> Vector3<f32>,
) -> SampleEquivalence {
    let Samples { kind, triple, temperature } = samples;
    let held = StoredTriad::from_record(record);
    let mut found = SampleEquivalence {
        kind,
        samples: 0,
        warm: 0,
        max: 0.0,
        rms: 0.0,
        max_ulp: 0.0,
        of_bound: 0.0,
        record_is_nearest: is_nearest(&held, stored),
        full_scale: 0.0,
        unit: stored.unit_out,
    };
    let (mut sum, mut largest) = (0.0, 0.0f64);
    for (row, value) in triple.values.iter().enumerate().filter(|(_, v)| v.iter().all(|x| x.is_finite())) {
        let raw = value.map(|x| triple.nominal.to_raw(x));
        let warmth = temperature.and_then(|all| all.get(row).copied()).unwrap_or(f64::NAN);
        let (narrow, narrow_warmth) = (raw.cast::<f32>(), warmth as f32);
        let corrected = device(&narrow, narrow_warmth).cast::<f64>();
        let asked = reference::correct_at(stored, raw.into(), warmth);
        let bounds = rounding::correct(&held, narrow.cast::<f64>().into(), narrow_warmth.into());
        found.samples += 1;
        found.warm += usize::from(held.temperature.is_some() && warmth.is_finite());
        for ((device, asked), bound) in corrected.iter().zip(asked).zip(bounds) {
            let difference = (device - asked).abs();
            found.max = found.max.max(difference);
            sum += difference * difference;
            found.max_ulp = found.max_ulp.max(ulp(*device, asked));
            found.of_bound = found.of_bound.max(of_bound(*device, bound));
            largest = largest.max(asked.abs());
        }
    }
    found.rms = (sum / (3.0 * found.samples.max(1) as f64)).sqrt();
    found.full_scale = full_scale(triple, stored).unwrap_or(largest);
    found
}

/// Distance in bounds; infinite where it is not a number, which no maximum would keep.
fn of_bound(device: f64, exact: rounding::Bounded) -> f64 {
    let share = (device - exact.value).abs() / exact.error;
    if share.is_nan() { f64::INFINITY } else { share }
}

/// Every figure that the correction takes is the nearest `f32`.
fn is_nearest(held: &StoredTriad, stored: &StoredTriad) -> bool {
    let figures = |triad: &StoredTriad| -> Vec<f32> {
        let terms = triad.temperature.map(|t| [[t.reference; 3], t.bias_slope, t.scale_slope]);
        let curvature = triad.temperature.and_then(|t| t.curvature).map(|c| [c.bias, c.scale]);
        let bent = triad.nonlinearity.map(|n| {
            let [i, j, k] = n.cross;
            [[n.range; 3], n.quadratic, n.cubic, i, j, k]
        });
        let all = triad.gain.into_iter().chain([triad.bias]).chain(terms.into_iter().flatten());
        let all = all.chain(curvature.into_iter().flatten()).chain(bent.into_iter().flatten());
        all.flatten().map(|figure| figure as f32).collect()
    };
    figures(held) == figures(stored)
}

/// The recording's range in calibrated units.
fn full_scale(triple: &Triple, stored: &StoredTriad) -> Option<f64> {
    let gain = (stored.gain[0][0].abs() + stored.gain[1][1].abs() + stored.gain[2][2].abs()) / 3.0;
    Some(triple.full_scale? * gain)
}
