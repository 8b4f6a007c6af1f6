//! Models as streams of residual and Jacobian rows: no model stores a residual, no solver asks for a matrix.
//!
//! | model | residual | unit |
//! | --- | --- | --- |
//! | [`dip`] | cosine between gravity and field, against one value for all poses | – |
//! | [`norm`] | distance of a point from the shell that calibration maps to a sphere | raw (nominal SI) |
//! | [`attitude`] | attitude that the gyroscope integrates, against a rig's encoders | rad |
//! | [`thermal`] | that of any of these, at the triad of each observation's temperature | its own |
//! | [`turn`] | gravity's direction carried through a turn by the gyroscope, against the accelerometer's | rad |
//! | [`unified`] | output of a triad on a rig, against what it put out | raw (nominal SI) |
//!
//! [`alignment`] turns a triad as a dip's rotation says, with its errors.
//!
//! Values are run-time data, shapes are types: the number of parameters `P` is const, the number of observations
//! is whatever the caller's slice holds.

use nalgebra::SVector;

use crate::scalar::Scalar;

pub mod attitude;
mod block;
pub mod dip;
// Of a dip's rotation.
pub mod alignment;
pub mod norm;
pub mod parameterisation;
pub mod rig;
pub mod thermal;
pub mod turn;
pub mod unified;

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

/// A cost that is worked out block by block, so that a search can be laid aside within one evaluation.
pub trait Cost<T: Scalar, const P: usize> {
    /// An evaluation under way.
    type State;

    /// Starts an evaluation at `theta`.
    fn begin(&self, theta: &SVector<T, P>) -> Self::State;

    /// Works off at most `budget` blocks and counts them down; the cost, once it is known.
    ///
    /// The answer must not depend on how often this was called. `theta` is the one given to [`begin`](Self::begin).
    /// A cost of NaN or infinity is never the best. Only a used-up budget may leave the cost unknown.
    fn advance(&self, theta: &SVector<T, P>, state: &mut Self::State, budget: &mut usize) -> Option<T>;

    /// The cost at `theta`, in one go; NaN where it does not keep to the rule above.
    fn cost(&self, theta: &SVector<T, P>) -> T {
        let mut budget = usize::MAX;
        self.advance(theta, &mut self.begin(theta), &mut budget).unwrap_or_else(|| T::of(f64::NAN))
    }
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
