//! Models as streams of residual and Jacobian rows: no model stores a residual, no solver asks for a matrix.
//!
//! | model | residual | unit |
//! | --- | --- | --- |
//! | [`norm`] | distance of a point from the shell that calibration maps to a sphere | raw (nominal SI) |
//! | [`turn`] | gravity's direction carried through a turn by the gyroscope, against the accelerometer's | rad |
//!
//! Values are run-time data, shapes are types: the number of parameters `P` is const, the number of observations
//! is whatever the caller's slice holds.

use nalgebra::SVector;

use crate::scalar::Scalar;

mod block;
pub mod norm;
pub mod parameterisation;
pub mod turn;

pub use parameterisation::Parameterisation;

/// Takes the rows of a model as they are made.
pub trait RowSink<T: Scalar, const P: usize> {
    /// Whether the Jacobian is looked at; a model may pass zeros where it is not.
    const JACOBIAN: bool;

    /// One residual and its derivative by each parameter.
    fn row(&mut self, residual: T, jacobian: &SVector<T, P>);
}

/// A least-squares problem in `P` parameters.
pub trait Model<T: Scalar, const P: usize> {
    /// Streams every row at `theta`, always in the same order.
    fn rows<S: RowSink<T, P>>(&self, theta: &SVector<T, P>, sink: &mut S);

    /// Independent residuals among the rows: what the degrees of freedom are counted from.
    fn independent_rows(&self) -> usize;
}

/// Sum of squared residuals.
#[derive(Clone, Copy, Debug)]
pub struct SquaredSum<T>(pub T);

impl<T: Scalar, const P: usize> RowSink<T, P> for SquaredSum<T> {
    const JACOBIAN: bool = false;

    #[inline]
    fn row(&mut self, residual: T, _: &SVector<T, P>) {
        self.0 += residual * residual;
    }
}
