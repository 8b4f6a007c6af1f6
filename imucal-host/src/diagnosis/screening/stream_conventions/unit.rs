//! A stream in another unit than m/s², rad/s and µT.
//!
//! Every accelerometer senses gravity and every magnetometer Earth's field, so that the median size alone shows the unit.
//! Rates have no usual size: they are compared with those that were recorded. Of two that differ by a unit's factor the
//! stream is in degrees where it is the larger one; where it is the smaller one, the recording is, which `gyr.unit_error`
//! names.

use nalgebra::Vector3;

use crate::recording::{Recording, SensorKind, Stream, Unit, median};

/// What a sensor reads in the median, and between which a stream in the right unit lies.
struct Usual {
    goal: (f64, f64),
    bounds: (f64, f64),
    expected: &'static str,
}

/// Sizes whose deviation from the median is above this share of it are not those of a constant field.
const CONSTANT: f64 = 0.25;
/// A factor between rates is that of a unit within this ratio.
const NEAR: f64 = 1.5;

/// Which sensor's stream is in another unit, for a reader; `None` where each is in its own.
pub fn wrong(recording: &Recording, stream: &Stream) -> Option<String> {
    SensorKind::ALL.into_iter().find_map(|kind| {
        let ideal = stream.values.sensor(kind)?;
        let real = &recording.sensor(kind)?.values;
        let (found, is, expected) = match kind {
            SensorKind::Gyr => by_rate(real, ideal)?,
            SensorKind::Acc | SensorKind::Mag => by_field(kind, real, ideal)?,
        };
        let said = Unit::of(kind).first()?;
        let remedy = match is {
            Some(is) => format!(
                "it looks like {is} instead of {said}; write sim_{kind}_* in {said}, or name the columns {kind}_* and give \
                 {kind} = \"{is}\" below [units] in the stream's manifest"
            ),
            None => format!("no unit explains it; check what the simulator writes into sim_{kind}_*"),
        };
        Some(format!("{}: the simulated {kind} reads {found}, expected {expected}: {remedy}", stream.name))
    })
}

/// What was found, the unit that it is in, if any explains it, and what was expected.
type Odd = (String, Option<Unit>, String);

/// Median size of a stream in another unit, and that unit.
fn by_field(kind: SensorKind, real: &[Vector3<f64>], ideal: &[Vector3<f64>]) -> Option<Odd> {
    let usual = match kind {
        SensorKind::Acc => Usual { goal: (8.0, 12.0), bounds: (4.0, 25.0), expected: "about 9.8" },
        _ => Usual { goal: (18.0, 75.0), bounds: (8.0, 300.0), expected: "20 to 70" },
    };
    let size = middle(ideal.iter().map(Vector3::norm))?;
    let scatter = middle(ideal.iter().map(|value| (value.norm() - size).abs()))?;
    let within = |value: f64, (low, high): (f64, f64)| (low..=high).contains(&value);
    if within(size, usual.bounds) || scatter > CONSTANT * size {
        return None;
    }
    let fits = |unit: &&Unit| unit.per_si().is_some_and(|per_si| within(size / per_si, usual.goal));
    let unit = Unit::of(kind).iter().filter(|unit| **unit != Unit::Arbitrary).find(fits).copied();
    // A centrifuge is not at 1 g, nor a magnet's neighbour in Earth's field: then the sensor says so too.
    let recorded = middle(real.iter().map(Vector3::norm))?;
    let differs = (size / recorded).ln().abs() > f64::ln(2.0);
    (unit.is_some() || differs).then(|| (format!("{size:.4} in the median"), unit, usual.expected.to_owned()))
}

/// How many times the recorded rate that of a stream in degrees is.
fn by_rate(real: &[Vector3<f64>], ideal: &[Vector3<f64>]) -> Option<Odd> {
    let ratio = spread(ideal)? / spread(real)?;
    let factor = Unit::DegreePerSecond.per_si()?;
    ((ratio / factor).ln().abs() < NEAR.ln()).then(|| {
        let found = format!("{ratio:.1} times the recorded rate");
        (found, Some(Unit::DegreePerSecond), "about 1".to_owned())
    })
}

/// Root mean square about the median, axis by axis, which a bias does not change; `None` where nothing moves.
fn spread(values: &[Vector3<f64>]) -> Option<f64> {
    let bias = [0, 1, 2].map(|axis| middle(values.iter().map(|value| value[axis])).unwrap_or(0.0));
    let squares = values.iter().map(|value| (value - Vector3::from(bias)).norm_squared());
    let squares: Vec<f64> = squares.filter(|square| square.is_finite()).collect();
    let mean = squares.iter().sum::<f64>() / squares.len().max(1) as f64;
    (mean > 0.0).then(|| mean.sqrt())
}

/// The median of those that were given.
fn middle(values: impl Iterator<Item = f64>) -> Option<f64> {
    median(values.filter(|value| value.is_finite()).collect())
}
