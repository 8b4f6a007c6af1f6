//! The rows of a model, kept: for residuals by observation, influence and held-out errors.

use imucal_core::model::{Model, RowSink};
use nalgebra::SVector;

/// Residuals and derivatives in the model's order.
#[derive(Clone, Debug)]
pub struct Rows<const P: usize> {
    /// Residuals.
    pub residuals: Vec<f64>,
    /// Their derivatives by the parameters.
    pub jacobian: Vec<SVector<f64, P>>,
}

impl<const P: usize> Rows<P> {
    /// All rows of a model.
    pub fn of(model: &impl Model<f64, P>, theta: &SVector<f64, P>) -> Self {
        let mut rows = Self {
            residuals: Vec::new(),
            jacobian: Vec::new(),
        };
        model.rows(theta, &mut rows);
        rows
    }
}

impl<const P: usize> RowSink<f64, P> for Rows<P> {
    const JACOBIAN: bool = true;

    fn row(&mut self, residual: f64, jacobian: &SVector<f64, P>) {
        self.residuals.push(residual);
        self.jacobian.push(*jacobian);
    }
}

/// Residuals of a model without derivatives.
#[derive(Clone, Debug, Default)]
pub struct Residuals(pub Vec<f64>);

impl Residuals {
    /// All residuals of a model.
    pub fn of<const P: usize>(model: &impl Model<f64, P>, theta: &SVector<f64, P>) -> Vec<f64> {
        let mut residuals = Self::default();
        model.rows(theta, &mut residuals);
        residuals.0
    }
}

impl<const P: usize> RowSink<f64, P> for Residuals {
    const JACOBIAN: bool = false;

    fn row(&mut self, residual: f64, _: &SVector<f64, P>) {
        self.0.push(residual);
    }
}
