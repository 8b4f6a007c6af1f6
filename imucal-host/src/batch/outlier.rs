//! Units that are unlike the others of their kind.
//!
//! ```text
//! z = (p − m) / √(s² + σ²)        s = n / (n − 0.8) · median |p − m| / 0.6745
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | p, σ | a parameter of [`parameter`](super::parameter) of one unit and its standard error |
//! | m | its median over the n units of the same kind: model, unit and nominal conversion, axes, a known field or not |
//! | s | their spread by the median deviation, for normal numbers; the factor of n corrects few of them (Croux and Rousseeuw 1992) |
//!
//! A unit is an outlier where |z| of a parameter is beyond what one of all those tested exceeds once in a hundred batches without an
//! outlier (Bonferroni: 0.01 over their number), by Student's t with 0.37 n degrees of freedom. A median deviation is known as well as
//! a standard deviation of 0.37 n (its efficiency, Rousseeuw and Croux 1993), and the ratio's tail is that of n/2 degrees of freedom or
//! fewer: half of the n values must be close together for s to be small. Of fewer than eight units of a kind none is judged.
//!
//! σ is in s too, since measured values spread by it; a unit that is measured worse than most is judged the milder. Not modelled:
//! populations that are not normal, such as two batches of a factory, whose spread hides what is between them.

use std::collections::BTreeMap;

use imucal_core::accept::outlier::MEDIAN_SIZE;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::{
    entry::{Entry, Sensor},
    parameter::OF_SENSOR,
};
use crate::recording::{SensorKind, median};

/// How often a batch without an outlier has one.
const FALSE_ALARMS: f64 = 0.01;
/// Units of a kind without which none is judged.
pub const LEAST_UNITS: usize = 8;
/// Efficiency of the median deviation for normal numbers.
const EFFICIENCY: f64 = 0.37;
/// Of the correction for few numbers.
const FEW: f64 = 0.8;

/// The units of a batch among one another.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Outliers {
    /// Units that are compared, by kind.
    pub populations: Vec<Population>,
    /// What is unlike the others, in the order of names.
    pub outliers: Vec<Outlier>,
}

/// Sensors of one kind.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Population {
    /// Which sensor.
    pub sensor: SensorKind,
    /// Its model.
    pub model: String,
    /// Unit of raw values.
    pub unit_in: String,
    /// How many.
    pub units: usize,
    /// |z| beyond which a parameter is unlike the others; `None` where they are too few.
    pub limit: Option<f64>,
    /// Each parameter of theirs; none where they are too few.
    #[serde(skip)]
    pub spreads: Vec<Spread>,
}

/// One parameter over the units of a kind.
#[derive(Clone, Debug, PartialEq)]
pub struct Spread {
    /// Its name.
    pub parameter: &'static str,
    /// z of each unit, ascending.
    pub z: Vec<f64>,
    /// |z| beyond which a unit is unlike the others.
    pub limit: f64,
}

/// A parameter of a unit that is unlike the others.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outlier {
    /// The unit's recording.
    pub name: String,
    /// Which sensor.
    pub sensor: SensorKind,
    /// Name of the parameter.
    pub parameter: &'static str,
    /// p.
    pub value: f64,
    /// σ.
    pub std_error: f64,
    /// m.
    pub median: f64,
    /// s.
    pub spread: f64,
    /// z.
    pub z: f64,
    /// |z| beyond which it is unlike them.
    pub limit: f64,
}

/// The units of one kind, each with its sensor.
type Kind<'a> = Vec<(&'a Entry, &'a Sensor)>;

/// A parameter over the units that have it.
struct Values<'a> {
    of: Kind<'a>,
    parameter: &'static str,
    /// p, σ.
    measured: Vec<(f64, f64)>,
}

/// Compares the sensors that have passed.
#[must_use]
pub fn outliers(entries: &[Entry]) -> Outliers {
    let mut kinds: BTreeMap<(SensorKind, &str), Kind<'_>> = BTreeMap::new();
    for entry in entries {
        for sensor in entry.sensors.iter().filter(|sensor| sensor.passed) {
            if let Some(kind) = &sensor.kind {
                kinds.entry((sensor.sensor, kind)).or_default().push((entry, sensor));
            }
        }
    }
    let values: Vec<(&Kind<'_>, Vec<Values<'_>>)> = kinds.values().map(|kind| (kind, values(kind))).collect();
    let tested: usize =
        values.iter().flat_map(|(_, values)| values).map(|values| values.measured.len()).sum();
    let (mut populations, mut outliers) = (Vec::new(), Vec::new());
    for (kind, values) in &values {
        let judged: Vec<Vec<Outlier>> = values.iter().map(|values| values.judged(tested)).collect();
        populations.extend(population(
            kind,
            tested,
            judged.iter().filter_map(|judged| spread_of(judged)).collect(),
        ));
        outliers.extend(judged.into_iter().flatten().filter(|judged| judged.z.abs() > judged.limit));
    }
    outliers.sort_by(|a, b| (&a.name, a.sensor).cmp(&(&b.name, b.sensor)));
    Outliers { populations, outliers }
}

fn population(kind: &Kind<'_>, tested: usize, spreads: Vec<Spread>) -> Option<Population> {
    let (_, sensor) = kind.first()?;
    Some(Population {
        sensor: sensor.sensor,
        model: sensor.model.clone(),
        unit_in: sensor.unit_in.clone().unwrap_or_default(),
        units: kind.len(),
        limit: (kind.len() >= LEAST_UNITS).then(|| limit(kind.len(), tested)),
        spreads,
    })
}

fn spread_of(judged: &[Outlier]) -> Option<Spread> {
    let first = judged.first()?;
    let mut z: Vec<f64> = judged.iter().map(|judged| judged.z).collect();
    z.sort_by(f64::total_cmp);
    Some(Spread { parameter: first.parameter, z, limit: first.limit })
}

/// Each parameter of a kind with units enough.
fn values<'a>(kind: &Kind<'a>) -> Vec<Values<'a>> {
    let of_name = |parameter: &'static str| {
        let mut values = Values { of: Vec::new(), parameter, measured: Vec::new() };
        for (entry, sensor) in kind {
            let found = sensor.of_sensor.iter().find(|found| found.name == parameter);
            if let Some(measured) = found.and_then(|found| found.value.zip(found.std_error)) {
                values.of.push((entry, sensor));
                values.measured.push(measured);
            }
        }
        values
    };
    OF_SENSOR.into_iter().map(of_name).filter(|values| values.measured.len() >= LEAST_UNITS).collect()
}

impl Values<'_> {
    /// Each unit's value as if it were unlike the others.
    fn judged(&self, tested: usize) -> Vec<Outlier> {
        let limit = limit(self.measured.len(), tested);
        let (median, spread) = spread(self.measured.iter().map(|(value, _)| *value).collect());
        let judged = self.of.iter().zip(&self.measured).map(|((entry, sensor), (value, std_error))| {
            // Equal units without an error do not differ.
            let z = if *value == median { 0.0 } else { (value - median) / spread.hypot(*std_error) };
            Outlier {
                name: entry.name.clone(),
                sensor: sensor.sensor,
                parameter: self.parameter,
                value: *value,
                std_error: *std_error,
                median,
                spread,
                z,
                limit,
            }
        });
        judged.collect()
    }
}

/// m and s.
fn spread(values: Vec<f64>) -> (f64, f64) {
    let count = values.len() as f64;
    let middle = median(values.clone()).unwrap_or_default();
    let deviation = median(values.iter().map(|value| (value - middle).abs()).collect()).unwrap_or_default();
    (middle, count / (count - FEW) * deviation / MEDIAN_SIZE)
}

/// |z| that one of so many tests exceeds seldom enough, against so many units.
fn limit(units: usize, tested: usize) -> f64 {
    let chance = 0.5 * FALSE_ALARMS / tested.max(1) as f64;
    StudentsT::new(0.0, 1.0, EFFICIENCY * units as f64).map_or(f64::INFINITY, |t| -t.inverse_cdf(chance))
}

#[cfg(test)]
pub(super) mod tests;
