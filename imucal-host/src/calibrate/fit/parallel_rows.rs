//! Rows of very many observations, reduced on all cores to a few rows of the same least squares.
//!
//! ```text
//! |J δ + r|² = Σ_k |R_k δ + q_k|² + rest_k²      of parts k of the observations
//! ```
//!
//! Each part is triangularised on its own ([`imucal_core::solver::panel`]), and its factor streamed in its place: cost,
//! gradient and JᵀJ are those of all rows, but for rounding. Parts do not depend on how many cores there are, nor does the
//! answer. For a solver alone: whoever wants a residual of each observation asks the model itself.

use imucal_core::{
    model::{Model, RowSink, SquaredSum},
    solver::{panel::triangularise, triangular::Triangular},
};
use nalgebra::SVector;
use rayon::prelude::*;

/// Parts of the observations as models of their own.
pub struct ParallelRows<M>(pub Vec<M>);

impl<M: Sync> ParallelRows<M> {
    /// The factor of each part.
    pub fn factors<const P: usize>(&self, theta: &SVector<f64, P>) -> Vec<Triangular<f64, P>>
    where
        M: Model<f64, P>,
    {
        let factor = |part: &M| {
            let mut factor = Triangular::default();
            triangularise(part, theta, &mut factor);
            factor
        };
        self.0.par_iter().map(factor).collect()
    }

    fn squared_sums<const P: usize>(&self, theta: &SVector<f64, P>) -> Vec<f64>
    where
        M: Model<f64, P>,
    {
        let sum = |part: &M| {
            let mut sum = SquaredSum(0.0);
            part.rows(theta, &mut sum);
            sum.0
        };
        self.0.par_iter().map(sum).collect()
    }
}

impl<M: Model<f64, P> + Sync, const P: usize> Model<f64, P> for ParallelRows<M> {
    fn rows<S: RowSink<f64, P>>(&self, theta: &SVector<f64, P>, sink: &mut S) {
        if S::JACOBIAN {
            self.factors(theta).iter().for_each(|factor| factor.stream(sink));
        } else {
            let sums = self.squared_sums(theta);
            sums.iter().for_each(|sum| sink.row(sum.sqrt(), &SVector::zeros()));
        }
    }

    fn independent_rows(&self) -> usize {
        self.0.iter().map(Model::independent_rows).sum()
    }
}

#[cfg(test)]
mod tests {
    use imucal_core::{
        model::{norm::NormModel, parameterisation::UPPER_TRIANGULAR},
        observation::ShellPoint,
        triad::Triad,
    };

    use super::*;
    use crate::{
        calibrate::fit::least_squares::solve,
        simulator::random::{Purpose, Random},
    };

    #[test]
    fn a_fit_by_parts_is_that_of_all_rows() {
        let mut random = Random::new(1, Purpose::Noise);
        let points: Vec<_> = (0..500)
            .map(|_| ShellPoint::new(random.normals().normalize() * 48.0 + random.normals() * 0.3))
            .collect();
        let model = |points| NormModel { points, norm: 47.0, form: UPPER_TRIANGULAR };
        let start = UPPER_TRIANGULAR.theta(&Triad::identity());
        let whole = solve(&model(&points), start);
        // One part has fewer points than there are parameters.
        let parts = solve(&ParallelRows(points.chunks(99).map(model).collect()), start);
        assert!((whole.theta() - parts.theta()).amax() < 1e-9);
        let (of_whole, of_parts) = (whole.covariance().unwrap(), parts.covariance().unwrap());
        assert!((of_whole - of_parts).amax() < 1e-9 * of_whole.amax());
        assert_eq!(whole.report().independent_rows, parts.report().independent_rows);
    }
}
