//! Corrupt: what a unit would have read of an ideal stream, the inverse of [`mod@crate::apply`].
//!
//! ```text
//! raw = respond(gain⁻¹ · ((ideal + noise) ⊘ f)) + b        as imucal_core::corrector::FullCorrector::predict_at has it
//! ```
//!
//! The constants are those of the device's record, the arithmetic is in `f64`: corrected by the core in `f32` the stream is
//! the ideal one again but for rounding. Noise is drawn by the coefficients that were seen: N, and a Gauss–Markov bias where its
//! correlation time is known, B and K otherwise. Not modelled: quantisation, saturation, bandwidth.

use imucal_core::{
    corrector::FullCorrector,
    nonlinearity::TooSteep,
    record::{CalibrationRecord, HigherOrder},
};
use nalgebra::Vector3;

use crate::{
    allan::{
        drawn::{Drawn, Source},
        process::per_sample,
    },
    recording::{Manifest, Nominal, Recording, SensorKind, Triple, Unit, manifest::Counts},
    store::{
        StoredCalibration, StoredTriad,
        noise_file::{NoiseFile, NoiseOfAxis},
    },
};

/// Why a stream was not corrupted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CorruptError {
    /// Nothing in the stream is calibrated.
    #[error(
        "{recording}: holds none of the sensors that the calibration is for, nor a simulator's columns of them; check that \
         both belong together"
    )]
    Nothing {
        /// The stream.
        recording: String,
    },
    /// What the unit itself has read.
    #[error(
        "{recording}: {sensor} is in counts, which a sensor gives; expected what an ideal sensor would give, in m/s^2, rad/s or uT, as \
         `imucal apply` makes of this recording"
    )]
    Raw {
        /// The recording.
        recording: String,
        /// Which sensor.
        sensor: SensorKind,
    },
    /// Calibrated values are in a unit of no known size, or the stream is.
    #[error(
        "{recording}: the calibration of {sensor} gives {found}, and how much of the stream's unit that is is not known; calibrate a \
         recording in a unit of the field whose manifest states the site"
    )]
    NoSize {
        /// The stream.
        recording: String,
        /// Which sensor.
        sensor: SensorKind,
        /// Unit of calibrated values.
        found: Unit,
    },
    /// The calibration cannot be inverted.
    #[error("the calibration of {sensor} has no inverse at {temperature} degC; calibrate again")]
    Singular {
        /// Which sensor.
        sensor: SensorKind,
        /// Where, °C.
        temperature: f64,
    },
    /// Nonlinear terms that cannot be undone, which no record that was read holds.
    #[error(transparent)]
    TooSteep(#[from] TooSteep),
    /// The stream is too short for a rate.
    #[error("{recording}: found {rows} rows, expected at least 2 for the interval of the noise; add rows")]
    NoInterval {
        /// The stream.
        recording: String,
        /// Its rows.
        rows: usize,
    },
}

/// Noise to be drawn, by a seed.
#[derive(Clone, Copy, Debug)]
pub struct Drawing<'a> {
    /// The coefficients.
    pub noise: &'a NoiseFile,
    /// The seed.
    pub seed: u64,
}

/// What the unit would have read: every sensor that is calibrated, in the raw units of the calibration. Ideal values are
/// a simulator's columns, or else the sensors' own.
///
/// # Errors
///
/// [`CorruptError`].
pub fn corrupt(
    ideal: &Recording,
    stored: &StoredCalibration,
    record: &CalibrationRecord<HigherOrder>,
    drawing: Option<Drawing<'_>>,
) -> Result<Recording, CorruptError> {
    let interval = ideal
        .median_interval()
        .ok_or_else(|| CorruptError::NoInterval { recording: ideal.name.clone(), rows: ideal.rows() })?;
    let mut read = ideal.clone();
    let warmth = temperatures(ideal);
    let mut any = false;
    for kind in SensorKind::ALL {
        let (Some(triad), Some(own)) = (stored.triad(kind), record.triad(kind.into())) else { continue };
        let Some(mut values) = ideal_values(ideal, kind, triad.unit_out)? else { continue };
        any = true;
        if let Some(drawing) = drawing {
            add_noise(&mut values, kind, drawing, interval);
        }
        let unit = FullCorrector::<f64>::try_from(own)?;
        let nominal = nominal(triad);
        let out = triad.unit_out.per_si().unwrap_or(1.0);
        for (value, temperature) in values.iter_mut().zip(&warmth) {
            let raw = unit.predict_at(&(*value * out), *temperature);
            let raw = raw.ok_or(CorruptError::Singular { sensor: kind, temperature: *temperature })?;
            *value = raw.map(|component| nominal.to_si(component));
        }
        set_unit(&mut read.manifest, kind, triad.unit_in, nominal);
        *read.manifest.calibrated.of_mut(kind) = None;
        let triple = Triple { values, unit: triad.unit_in, nominal, full_scale: None, single: false };
        match kind {
            SensorKind::Acc => read.acc = Some(triple),
            SensorKind::Gyr => read.gyr = Some(triple),
            SensorKind::Mag => read.mag = Some(triple),
        }
    }
    if !any {
        return Err(CorruptError::Nothing { recording: ideal.name.clone() });
    }
    let text = |text: &str| Some(text.to_owned()).filter(|text| !text.is_empty());
    read.manifest.sensor.name = text(&stored.sensor.name);
    read.manifest.sensor.serial = text(&stored.sensor.serial);
    Ok(read)
}

/// Of each row, °C; NaN where nothing says so, which counts as the calibration's reference.
fn temperatures(ideal: &Recording) -> Vec<f64> {
    let simulated = ideal.simulated.as_ref().and_then(|simulated| simulated.temperature.as_ref());
    simulated.or(ideal.temperature.as_ref()).cloned().unwrap_or_else(|| vec![f64::NAN; ideal.rows()])
}

/// `expected`: the unit of calibrated values.
fn ideal_values(
    ideal: &Recording,
    kind: SensorKind,
    expected: Unit,
) -> Result<Option<Vec<Vector3<f64>>>, CorruptError> {
    let of_no_size = || CorruptError::NoSize { recording: ideal.name.clone(), sensor: kind, found: expected };
    if let Some(simulated) = ideal.simulated.as_ref().and_then(|simulated| simulated.sensor(kind)) {
        return if expected.per_known_si().is_some() {
            Ok(Some(simulated.to_vec()))
        } else {
            Err(of_no_size())
        };
    }
    let arbitrary = |unit: Unit| unit == Unit::Arbitrary;
    match ideal.sensor(kind) {
        Some(triple) if arbitrary(triple.unit) != arbitrary(expected) => Err(of_no_size()),
        Some(triple) if triple.unit == Unit::Counts && expected != Unit::Counts => {
            Err(CorruptError::Raw { recording: ideal.name.clone(), sensor: kind })
        }
        sensor => Ok(sensor.map(|triple| triple.values.clone())),
    }
}

/// How raw values are written: by their unit, or for counts by the calibration itself.
fn nominal(triad: &StoredTriad) -> Nominal {
    match triad.unit_in.per_si() {
        Some(per_unit) => Nominal { offset: 0.0, per_unit },
        None => {
            let mean = |of: &dyn Fn(usize) -> f64| (0..3).map(of).sum::<f64>() / 3.0;
            Nominal { offset: mean(&|at| triad.bias[at]), per_unit: 1.0 / mean(&|at| triad.gain[at][at]) }
        }
    }
}

fn set_unit(manifest: &mut Manifest, kind: SensorKind, unit: Unit, nominal: Nominal) {
    let counts =
        (unit == Unit::Counts).then_some(Counts { offset: nominal.offset, per_unit: nominal.per_unit });
    let (units, all, ranges) = (&mut manifest.units, &mut manifest.counts, &mut manifest.ranges);
    // The range of an ideal stream is none of the unit's.
    match kind {
        SensorKind::Acc => (units.acc, all.acc, ranges.acc) = (unit, counts, None),
        SensorKind::Gyr => (units.gyr, all.gyr, ranges.gyr) = (unit, counts, None),
        SensorKind::Mag => (units.mag, all.mag, ranges.mag) = (unit, counts, None),
    }
}

fn add_noise(values: &mut [Vector3<f64>], kind: SensorKind, drawing: Drawing<'_>, interval: f64) {
    let Some(sensor) = drawing.noise.sensor(kind) else { return };
    for (at, axis) in sensor.axes.iter().enumerate() {
        let Some(axis) = axis else { continue };
        // Each axis of each sensor has a stream of its own.
        let seed = drawing.seed.wrapping_mul(9).wrapping_add(3 * kind as u64 + at as u64);
        let mut source = Source::new(drawn(axis, interval), seed);
        values.iter_mut().for_each(|value| value[at] += source.sample()[at]);
    }
}

/// Coefficients in samples.
fn drawn(axis: &NoiseOfAxis, interval: f64) -> Drawn {
    let white = per_sample(axis.white.value.unwrap_or(0.0), 1.0 / interval);
    match axis.bias_std.value.zip(axis.correlation_time.value) {
        Some((std, time)) => Drawn { white, markov: Some((std, time / interval)), ..Drawn::default() },
        None => Drawn {
            white,
            flicker: axis.bias_instability.value.unwrap_or(0.0),
            walk: axis.random_walk.value.unwrap_or(0.0) * interval.sqrt(),
            ..Drawn::default()
        },
    }
}
