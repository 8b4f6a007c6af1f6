//! One triad over a run, on its way from input to output.

use nalgebra::Vector3;

use super::{truth::Input, user::History};

/// A triad's output before noise, over the whole run: for effects that look at other rows than their own.
#[derive(Debug)]
pub struct SensorRun<'a> {
    /// What the unit is given, row by row.
    pub input: &'a [Input],
    /// What each axis itself senses: output of the baseline less its bias, SI units.
    pub sensed: &'a [Vector3<f64>],
    /// Output so far, SI units.
    pub output: &'a mut [Vector3<f64>],
}

/// A triad's output before noise, of which an effect sees one row at a time.
#[derive(Debug)]
pub struct SensorRows<'a>(SensorRun<'a>);

impl SensorRows<'_> {
    /// Adds to each row's output a function of its input and of what the axes sense, SI units.
    pub fn add(&mut self, term: impl Fn(&Input, &Vector3<f64>) -> Vector3<f64>) {
        let Self(SensorRun { input, sensed, output }) = self;
        for ((output, input), sensed) in output.iter_mut().zip(*input).zip(*sensed) {
            *output += term(input, sensed);
        }
    }
}

impl SensorRun<'_> {
    /// The same, row by row.
    pub fn rows(&mut self) -> SensorRows<'_> {
        SensorRows(SensorRun { input: self.input, sensed: self.sensed, output: self.output })
    }

    /// Time since the row before, s; 0 for the first. Rows need not be evenly apart.
    pub fn since_before(&self, row: usize) -> f64 {
        match (row.checked_sub(1).and_then(|before| self.input.get(before)), self.input.get(row)) {
            (Some(before), Some(input)) => input.time - before.time,
            _ => 0.0,
        }
    }

    /// Square of the rate of turn at each row, (rad/s)², as what it heats or shakes follows it within `tau`, s.
    pub fn squared_rate_within(&self, tau: f64) -> Vec<f64> {
        let times: Vec<f64> = self.input.iter().map(|row| row.time).collect();
        let squares: Vec<f64> = self.input.iter().map(|row| row.w_iq_q.norm_squared()).collect();
        History::Lag.of(&times, &squares, tau)
    }
}

/// A triad's noise and limit on the way to the converter.
#[derive(Debug)]
pub struct SignalRun<'a> {
    /// Times of the rows, s.
    pub time: &'a [f64],
    /// White noise still to be added, SI units.
    pub noise: &'a mut [Vector3<f64>],
    /// Largest output, SI units, both signs.
    pub limit: &'a mut f64,
}

/// A triad's samples as they leave the converter, SI units.
#[derive(Debug)]
pub struct DataRun<'a> {
    /// One vector a row.
    pub samples: &'a mut [Vector3<f64>],
}
