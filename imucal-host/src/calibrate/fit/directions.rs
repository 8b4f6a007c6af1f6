//! Directions of gravity that an accelerometer gives at rest, and how they err.
//!
//! ```text
//! y = G (m − b),   u = y/|y|,   δu = (1 − u uᵀ)(G e + δG x − G δb) / |y|,   x = m − b
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | m, e | mean of a rest, nominal SI, and its noise: white, and drift that rests share |
//! | G, b | the accelerometer's gain and bias, with the errors of its calibration |
//! | u | direction, calibrated axes |
//!
//! A norm fit uses the part of e along u and a direction the part across it, so both errors are taken as independent.

use imucal_core::triad::Triad;
use nalgebra::{DMatrix, DVector, Matrix3, Matrix3xX, Vector3};

use crate::noise::{
    Noise, Span,
    state_space::{Row, StateSpace},
};

/// The accelerometer at every rest.
#[derive(Clone, Debug)]
pub struct Directions {
    /// Its calibration, nominal SI in.
    pub triad: Triad<f64>,
    /// Covariance of the estimated entries.
    pub covariance: DMatrix<f64>,
    /// Entries (gain by rows 0 to 8, bias 9 to 11) that are estimated.
    pub covariance_of: Vec<u8>,
    /// Mean output at each rest, nominal SI.
    pub means: Vec<Vector3<f64>>,
    /// When they rested.
    pub spans: Vec<Span>,
    /// Noise of the means.
    pub noise: Noise,
}

impl Directions {
    /// Calibrated specific force at a rest.
    pub fn calibrated(&self, rest: usize) -> Vector3<f64> {
        self.triad.correct(&self.means[rest])
    }

    /// What is left of a vector across a rest's direction, over the length of what was measured.
    fn across(&self, rest: usize) -> Matrix3<f64> {
        let y = self.calibrated(rest);
        let u = y.normalize();
        (Matrix3::identity() - u * u.transpose()) / y.norm()
    }

    /// How a rest's direction moves with its mean.
    pub fn by_mean(&self, rest: usize) -> Matrix3<f64> {
        self.across(rest) * self.triad.gain
    }

    /// How it moves with the estimated entries, a column for each.
    pub fn by_entries(&self, rest: usize) -> Matrix3xX<f64> {
        let (across, x) = (self.across(rest), self.means[rest] - self.triad.bias);
        let columns: Vec<Vector3<f64>> = self
            .covariance_of
            .iter()
            .map(|entry| match usize::from(*entry) {
                k @ 0..9 => across.column(k / 3) * x[k % 3],
                k => -(across * self.triad.gain.column(k - 9)),
            })
            .collect();
        Matrix3xX::from_columns(&columns)
    }

    /// How so many rows that follow from directions err: with the rests' means, and with the calibration, which all share.
    pub fn rows(&self, rows: usize, moves: &[Move]) -> Vec<Row> {
        let root = self.noise.density.map(f64::sqrt);
        let count = self.covariance_of.len();
        let none = || Row { shared: [DVector::zeros(count), DVector::zeros(0)], ..Row::default() };
        let mut followed: Vec<Row> = (0..rows).map(|_| none()).collect();
        for one in moves {
            let row = &mut followed[one.row];
            row.shared[0] += self.by_entries(one.rest).tr_mul(&one.by);
            let by_mean = self.by_mean(one.rest).tr_mul(&one.by);
            row.means.push((one.rest, by_mean.component_mul(&root)));
        }
        followed
    }

    /// Noise of such rows, and of what else they follow from: errors of a covariance that all share.
    pub fn noise_of(&self, rows: Vec<Row>, shared: DMatrix<f64>) -> StateSpace {
        StateSpace::new(rows, self.spans.clone(), self.noise.clone(), [self.covariance.clone(), shared])
    }
}

/// How a row moves with the direction at a rest.
#[derive(Clone, Copy, Debug)]
pub struct Move {
    /// The row.
    pub row: usize,
    /// The rest.
    pub rest: usize,
    /// Its derivative by the direction.
    pub by: Vector3<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::interval::Whitening;

    fn directions(triad: Triad<f64>, means: Vec<Vector3<f64>>) -> Directions {
        Directions {
            triad,
            covariance: DMatrix::zeros(12, 12),
            covariance_of: (0..12).collect(),
            spans: (0..means.len()).map(|k| 6.0 * k as f64).map(|from| from..from + 4.0).collect(),
            means,
            noise: Noise { density: Vector3::repeat(4e-4), white: 1.0, drift: 0.0 },
        }
    }

    #[test]
    fn derivatives_of_a_direction_are_the_numerical_ones() {
        let gain = Matrix3::new(1.02, 0.03, -0.01, 0.0, 0.97, 0.02, 0.0, 0.0, 1.01);
        let (triad, mean) =
            (Triad { gain, bias: Vector3::new(0.3, -0.2, 0.1) }, Vector3::new(4.0, -5.0, 7.0));
        let at = |triad: &Triad<f64>, mean: &Vector3<f64>| triad.correct(mean).normalize();
        let found = directions(triad, vec![mean]);
        let h = 1e-6;
        for axis in 0..3 {
            let step = Vector3::ith(axis, h);
            let numeric = (at(&triad, &(mean + step)) - at(&triad, &(mean - step))) / (2.0 * h);
            assert!((found.by_mean(0).column(axis) - numeric).norm() < 1e-8);
        }
        for entry in 0..12 {
            let moved = |h: f64| {
                let mut moved = triad;
                match entry {
                    0..9 => moved.gain[(entry / 3, entry % 3)] += h,
                    _ => moved.bias[entry - 9] += h,
                }
                at(&moved, &mean)
            };
            let numeric = (moved(h) - moved(-h)) / (2.0 * h);
            assert!((found.by_entries(0).column(entry) - numeric).norm() < 1e-8, "{entry}");
        }
    }

    #[test]
    fn rows_that_share_a_rest_vary_together() {
        let means = vec![Vector3::new(0.0, 0.0, 10.0), Vector3::new(10.0, 0.0, 0.0)];
        let found = directions(Triad::identity(), means);
        // Two rows see the x of the first rest's direction, the second with its sign reversed; one the other rest's.
        let moves = [
            Move { row: 0, rest: 0, by: Vector3::x() },
            Move { row: 1, rest: 0, by: -Vector3::x() },
            Move { row: 0, rest: 1, by: Vector3::y() },
        ];
        let noise = found.noise_of(found.rows(2, &moves), DMatrix::zeros(0, 0));
        let [covariance, _] = noise.carried(&DMatrix::identity(2, 2));
        // 4e-4 over 4 s, over ten squared.
        let each = 4e-4 / 4.0 / 100.0;
        let expected = DMatrix::from_row_slice(2, 2, &[2.0 * each, -each, -each, each]);
        assert!((covariance - expected).norm() < 1e-12);
    }
}
