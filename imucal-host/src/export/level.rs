//! One number for the three axes of a sensor, as targets have it.

use std::ops::RangeInclusive;

use super::{ExportError, Inputs};
use crate::{
    recording::{SensorKind, Unit},
    store::noise_file::{Figure, NoiseOfAxis, NoiseOfSensor},
};

/// Samples a second that a target may have.
const RATES: RangeInclusive<f64> = 0.01..=1e6;

/// A coefficient of a sensor or an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Level {
    /// Its value, or the most that it may be.
    pub value: f64,
    /// It is the most that it may be: the recording does not show it.
    pub bound: bool,
}

impl Level {
    /// Of an axis.
    pub fn of(figure: &Figure) -> Option<Self> {
        let known = figure.value.map(|value| Self { value, bound: false });
        known.or(figure.at_most.map(|value| Self { value, bound: true }))
    }

    /// Of a sensor.
    pub fn of_sensor(sensor: &NoiseOfSensor, of: fn(&NoiseOfAxis) -> &Figure) -> Option<Self> {
        Self::root_mean_square(sensor.known_axes().map(|axis| Self::of(of(axis))))
    }

    /// Root mean square over the axes; a bound where one of them is.
    pub fn root_mean_square(levels: impl Iterator<Item = Option<Self>>) -> Option<Self> {
        let levels: Option<Vec<Self>> = levels.collect();
        let levels = levels.filter(|levels| !levels.is_empty())?;
        let square = levels.iter().map(|level| level.value * level.value).sum::<f64>() / levels.len() as f64;
        Some(Self { value: square.sqrt(), bound: levels.iter().any(|level| level.bound) })
    }

    /// A remark for the number's comment.
    pub fn remark(self) -> &'static str {
        if self.bound { "; not seen in the recording: the most that it may be" } else { "" }
    }
}

/// The noise of a sensor that was estimated.
pub(super) fn sensor<'a>(
    inputs: &Inputs<'a>,
    kind: SensorKind,
    target: &'static str,
) -> Result<&'a NoiseOfSensor, ExportError> {
    let noise = inputs.noise.ok_or(ExportError::NoNoise { target })?;
    let missing = |why: String| ExportError::NotKnown { target, sensor: kind, what: "noise", why };
    let found = noise.sensor(kind).ok_or_else(|| missing("the recording has no such sensor".into()))?;
    match &found.detail {
        Some(detail) => Err(missing(detail.clone())),
        None if found.unit == Unit::Arbitrary.to_string() => Err(ExportError::NoiseUnit {
            target,
            sensor: kind,
            found: found.unit.clone(),
            expected: Unit::si(kind),
        }),
        None if found.known_axes().next().is_none() => Err(missing("no axis shows any".into())),
        None => Ok(found),
    }
}

/// A sentence for each axis whose noise is not known, with what that means for the target.
pub(super) fn hidden(kind: SensorKind, sensor: &NoiseOfSensor, so: &str) -> Vec<String> {
    let axes = ["x", "y", "z"].into_iter().zip(&sensor.axes).filter(|(_, axis)| axis.is_none());
    axes.map(|(name, _)| format!("{kind}, axis {name}: rounding hides its noise; {so}")).collect()
}

/// Samples a second of the target: as given, or as recorded.
pub(super) fn rate(inputs: &Inputs<'_>, sensor: &NoiseOfSensor) -> Result<f64, ExportError> {
    let rate = inputs.rate.or(sensor.rate).unwrap_or(f64::NAN);
    if RATES.contains(&rate) { Ok(rate) } else { Err(ExportError::Rate { found: rate }) }
}

/// Density of the steps of a Gauss–Markov bias, for a standard deviation in the long run: σ = d·√(T/2).
pub(super) fn step_density(std: f64, correlation_time: f64) -> f64 {
    std * (2.0 / correlation_time).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(value: Option<f64>, at_most: Option<f64>) -> Figure {
        Figure { value, interval: None, edf: None, unit: String::new(), reason: None, at_most }
    }

    #[test]
    fn an_axis_that_is_not_seen_counts_with_the_most_that_it_may_be() {
        assert_eq!(Level::of(&figure(Some(2.0), None)), Some(Level { value: 2.0, bound: false }));
        assert_eq!(Level::of(&figure(None, Some(3.0))), Some(Level { value: 3.0, bound: true }));
        assert_eq!(Level::of(&figure(None, None)), None);
    }
}
