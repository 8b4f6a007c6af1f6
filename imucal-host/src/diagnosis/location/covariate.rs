//! A covariate of the residual: a handful of functions of the block, each of which every axis of a sensor may follow.

use crate::recording::SensorKind;

/// A driver and its functions, by block.
#[derive(Clone, Debug)]
pub struct Covariate {
    /// Its name in the report.
    pub name: String,
    /// Its functions.
    pub functions: Vec<Function>,
}

/// A function of the block.
#[derive(Clone, Debug)]
pub struct Function {
    /// What it is.
    pub detail: String,
    /// Its values.
    pub values: Vec<f64>,
    /// The one axis of a sensor that may follow it; `None` for any.
    pub of: Option<(SensorKind, usize)>,
}

impl Function {
    /// That any axis of any sensor may follow.
    pub fn new(detail: impl Into<String>, values: Vec<f64>) -> Self {
        Self { detail: detail.into(), values, of: None }
    }
}

impl Covariate {
    /// Places of its columns for a sensor: function and axis.
    pub fn columns(&self, kind: SensorKind) -> Vec<(usize, usize)> {
        let axes = (0..self.functions.len()).flat_map(|function| (0..3).map(move |axis| (function, axis)));
        let wanted = |(function, axis): &(usize, usize)| {
            self.functions[*function].of.is_none_or(|of| of == (kind, *axis))
        };
        axes.filter(wanted).collect()
    }
}
