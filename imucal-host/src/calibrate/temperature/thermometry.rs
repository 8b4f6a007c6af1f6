//! A recording's temperatures, where terms may be estimated from them.

use std::ops::Range;

use super::{course, refusal::TemperatureRefusal, thermometer};
use crate::recording::Recording;

/// The thermometer of a recording, judged once.
#[derive(Clone, Debug)]
pub struct Thermometry<'a> {
    time: &'a [f64],
    readings: &'a [f64],
    fault: Option<TemperatureRefusal>,
}

impl<'a> Thermometry<'a> {
    /// `None` where the recording has no temperature.
    pub fn of(recording: &'a Recording) -> Option<Self> {
        let readings = recording.temperature.as_deref()?;
        readings.iter().any(|value| value.is_finite()).then_some(())?;
        let fault = thermometer::check(&recording.time, readings).err();
        Some(Self { time: &recording.time, readings, fault })
    }

    /// Mean temperature of some rows, °C; NaN where none has one.
    pub fn mean(&self, rows: &Range<usize>) -> f64 {
        let measured = || self.readings[rows.clone()].iter().filter(|value| value.is_finite());
        measured().sum::<f64>() / measured().count() as f64
    }

    /// Of rows between two times, s.
    pub fn between(&self, span: &Range<f64>) -> f64 {
        let row = |at: f64| self.time.partition_point(|t| *t < at);
        let from = row(span.start).min(self.time.len().saturating_sub(1));
        self.mean(&(from..row(span.end).clamp(from + 1, self.time.len())))
    }

    /// Whether terms may be estimated from observations at these temperatures, °C, in the order of time.
    ///
    /// # Errors
    /// Why not. A span that is too narrow comes first: it says most of a constant temperature.
    pub fn check(&self, temperatures: &[f64]) -> Result<(), TemperatureRefusal> {
        match (course::check(temperatures), self.fault) {
            (Err(narrow @ TemperatureRefusal::Narrow { .. }), None) => Err(narrow),
            (_, Some(fault)) => Err(fault),
            (found, None) => found,
        }
    }
}
