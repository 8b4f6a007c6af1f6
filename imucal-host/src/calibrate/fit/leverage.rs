//! Gauss–Newton steps without some of the rows, from one factor of all of them.
//!
//! ```text
//! δ_S = δ + C J_Sᵀ (1 − H)⁻¹ (r_S + J_S δ)        C = (JᵀJ)⁻¹        H = J_S C J_Sᵀ
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | J, r | derivatives and residuals of all rows |
//! | J_S, r_S | those of the rows that are left out |
//! | δ, δ_S | the step that minimises \|J δ + r\|² over all rows, and over the others |
//! | H | leverages of the rows that are left out |
//!
//! It follows from the formula of Sherman, Morrison and Woodbury. The cost is O(P²) for each row instead of that of a factor of all
//! others. Rows that nearly all of a parameter depends on have a leverage near 1, and the difference 1 − H loses its digits: there
//! the others are factored. Source: Belsley, Kuh and Welsch, *Regression Diagnostics*, 1980, 2.1.

use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector, SMatrix, SVector};

use super::rows::Rows;

/// A pivot of 1 − H below this leaves fewer than nine digits.
const LEAST_REST: f64 = 1e-6;

/// Rows, with what all of them say.
pub struct Leverage<'a, const P: usize> {
    rows: &'a Rows<P>,
    /// R⁻¹, of which C is the square.
    inverse: SMatrix<f64, P, P>,
    /// δ.
    step: SVector<f64, P>,
}

impl<'a, const P: usize> Leverage<'a, P> {
    /// Of all rows; `None` where they do not determine the parameters.
    pub fn of(rows: &'a Rows<P>) -> Option<Self> {
        let factor = rows.factor(0..0);
        let (inverse, step) = (factor.inverse()?, factor.damped_step(0.0, &SVector::repeat(0.0))?);
        Some(Self { rows, inverse, step })
    }

    /// The Gauss–Newton step to the optimum without some rows: exact for a linear model, and to second order in the step for
    /// another. `None` where the others do not determine it.
    pub fn step_without(&self, left_out: Range<usize>) -> Option<SVector<f64, P>> {
        let jacobian = &self.rows.jacobian[left_out.clone()];
        // u = R⁻ᵀ j, so that H is their products.
        let whitened: Vec<SVector<f64, P>> = jacobian.iter().map(|j| self.inverse.tr_mul(j)).collect();
        let count = whitened.len();
        let rest = DMatrix::from_fn(count, count, |i, j| f64::from(i == j) - whitened[i].dot(&whitened[j]));
        let well_determined = |cholesky: &Cholesky<f64, nalgebra::Dyn>| {
            cholesky.l_dirty().diagonal().iter().all(|pivot| pivot * pivot > LEAST_REST)
        };
        let Some(cholesky) = Cholesky::new(rest).filter(well_determined) else {
            return self.rows.factor(left_out).damped_step(0.0, &SVector::repeat(0.0));
        };
        let residuals = self.rows.residuals[left_out].iter().zip(jacobian);
        let after = DVector::from_iterator(count, residuals.map(|(r, j)| r + j.dot(&self.step)));
        let weights = cholesky.solve(&after);
        let moved =
            whitened.iter().zip(&weights).fold(SVector::zeros(), |sum, (u, weight)| sum + u * *weight);
        Some(self.step + self.inverse * moved)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn rows(entries: &[f64]) -> Rows<4> {
        let all = entries.chunks_exact(5);
        Rows {
            residuals: all.clone().map(|row| row[0]).collect(),
            jacobian: all.map(|row| SVector::from_column_slice(&row[1..])).collect(),
        }
    }

    /// The step by a factor of the others.
    fn factored(rows: &Rows<4>, left_out: Range<usize>) -> Option<SVector<f64, 4>> {
        rows.factor(left_out).damped_step(0.0, &SVector::repeat(0.0))
    }

    proptest! {
        #[test]
        fn a_step_by_leverages_is_the_one_of_the_other_rows(
            entries in prop::collection::vec(-5.0f64..5.0, 5 * 24), each in 1usize..=3,
        ) {
            let rows = rows(&entries);
            prop_assume!(rows.factor(0..0).r().diagonal().amin() > 0.5);
            let leverage = Leverage::of(&rows).unwrap();
            for first in (0..24 / each).map(|k| k * each) {
                let left_out = first..first + each;
                let (fast, slow) = (leverage.step_without(left_out.clone()), factored(&rows, left_out));
                prop_assert!((fast.unwrap() - slow.unwrap()).amax() < 1e-9);
            }
        }
    }

    #[test]
    fn a_row_that_alone_determines_a_parameter_leaves_none() {
        let mut rows = rows(&[0.5; 5 * 6]);
        for (k, jacobian) in rows.jacobian.iter_mut().enumerate() {
            *jacobian = SVector::from_fn(|i, _| if i == k.min(3) { 1.0 + k as f64 } else { 0.0 });
        }
        let leverage = Leverage::of(&rows).unwrap();
        assert!(leverage.step_without(0..1).is_none());
        assert!(leverage.step_without(4..5).is_some());
    }

    #[test]
    fn a_row_with_a_leverage_near_one_keeps_its_digits() {
        let mut rows = rows(&(0..5 * 12).map(|k| f64::from(k * k % 17) - 8.0).collect::<Vec<_>>());
        rows.jacobian[3] *= 1e7;
        let (fast, slow) =
            (Leverage::of(&rows).unwrap().step_without(3..4).unwrap(), factored(&rows, 3..4).unwrap());
        assert!((fast - slow).amax() < 1e-9 * slow.amax(), "{fast} {slow}");
    }
}
