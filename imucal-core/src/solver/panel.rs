//! Triangularisation by panels: many rows at a time, reflected into the factor (Householder).
//!
//! ```text
//! v = (1, a/(d − β)),   β = −√(d² + |a|²),   τ = (β − d)/β
//! (r_j, a_j) ← (r_j, a_j) − τ (r_j + v·a_j) v        for each further column j, and for the residual
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | d, r_j | row k of the factor, its diagonal first |
//! | a, a_j | columns k and j of the panel |
//!
//! The factor is that of [`Triangular`] but for rounding, its diagonal not negative either. A panel takes (P + 1) · 32 numbers; its
//! loops run over neighbours in memory, so that a processor with vector registers does several rows at once. Sums are in a fixed order.
//! A device has few rows, and little memory: there, and wherever the host computes as the device does, [`Scalar::PANELS`] is false and
//! rows are rotated in one by one. Source: Golub & Van Loan, *Matrix Computations*, 5.1 and 5.2.

use nalgebra::SVector;

use super::triangular::Triangular;
use crate::{
    model::{Model, RowSink},
    scalar::Scalar,
};

/// Triangularises the rows of a model at `theta` into `factor`, whatever that held: in panels where [`Scalar::PANELS`] says so.
#[inline]
pub fn triangularise<T: Scalar, const P: usize>(
    model: &impl Model<T, P>,
    theta: &SVector<T, P>,
    factor: &mut Triangular<T, P>,
) {
    *factor = Triangular::default();
    if T::PANELS {
        let mut panel = Panel::new(factor);
        model.rows(theta, &mut panel);
        panel.end();
    } else {
        model.rows(theta, factor);
    }
}

/// Rows that are added up next to each other, and how many times as many a panel has.
const LANES: usize = 8;
const PARTS: usize = 4;

type Column<T> = [[T; LANES]; PARTS];

/// Gathers rows, and takes them into a factor whenever a panel is full and at its end.
#[derive(Debug)]
pub(super) struct Panel<'a, T: Scalar, const P: usize> {
    factor: &'a mut Triangular<T, P>,
    columns: [Column<T>; P],
    residuals: Column<T>,
    filled: usize,
}

impl<'a, T: Scalar, const P: usize> Panel<'a, T, P> {
    /// An empty panel on top of a factor.
    pub(super) fn new(factor: &'a mut Triangular<T, P>) -> Self {
        let empty = [[T::zero(); LANES]; PARTS];
        Self { factor, columns: [empty; P], residuals: empty, filled: 0 }
    }

    /// Takes in what is left.
    pub(super) fn end(mut self) {
        for column in self.columns.iter_mut().chain(core::iter::once(&mut self.residuals)) {
            column.as_flattened_mut().iter_mut().skip(self.filled).for_each(|entry| *entry = T::zero());
        }
        self.reflect();
    }

    fn reflect(&mut self) {
        // Parts that no row is in say nothing.
        let parts = self.filled.div_ceil(LANES);
        let (r, q, squared_sum) = self.factor.parts();
        for residual in self.residuals.as_flattened() {
            *squared_sum += *residual * *residual;
        }
        let mut columns = self.columns.as_mut_slice();
        for (k, q_k) in q.iter_mut().enumerate() {
            let Some((column, others)) = columns.split_first_mut() else { return };
            reflect_column(r, k, (column, others), (q_k, &mut self.residuals), parts);
            columns = others;
        }
        self.filled = 0;
    }
}

impl<T: Scalar, const P: usize> RowSink<T, P> for Panel<'_, T, P> {
    const JACOBIAN: bool = true;

    #[inline]
    fn row(&mut self, residual: T, jacobian: &SVector<T, P>) {
        let (part, lane) = (self.filled / LANES, self.filled % LANES);
        let entry = |column: &mut Column<T>, value: T| {
            if let Some(entry) = column.get_mut(part).and_then(|part| part.get_mut(lane)) {
                *entry = value;
            }
        };
        self.columns.iter_mut().zip(jacobian.iter()).for_each(|(column, value)| entry(column, *value));
        entry(&mut self.residuals, residual);
        self.filled += 1;
        if self.filled == LANES * PARTS {
            self.reflect();
        }
    }
}

/// Eliminates a column of the panel, so many parts of it, against row k of the factor.
#[inline]
fn reflect_column<T: Scalar>(
    r: &mut [T],
    k: usize,
    (column, others): (&Column<T>, &mut [Column<T>]),
    (q_k, residuals): (&mut T, &mut Column<T>),
    parts: usize,
) {
    let size = k + 1 + others.len();
    // Row k of R from its diagonal on.
    let mut above = r.iter_mut().skip(k * size + k).step_by(size);
    let Some(diagonal) = above.next() else { return };
    let square = product(column, column, parts);
    let length = (*diagonal * *diagonal + square).root();
    // Nothing to eliminate, or all squares underflowed: below every rounding here.
    if square == T::zero() || length == T::zero() {
        return;
    }
    let beta = -length;
    let per_head = T::one() / (*diagonal - beta);
    let tau = (beta - *diagonal) / beta;
    // A copy: nothing that is written below can be in it, so that loops take several rows at once.
    let mut v = [[T::zero(); LANES]; PARTS];
    for (v, column) in v.iter_mut().zip(column).take(parts) {
        v.iter_mut().zip(column).for_each(|(v, entry)| *v = *entry * per_head);
    }
    // With the row's sign changed, so that its diagonal stays positive.
    *diagonal = length;
    let below = others.iter_mut().chain(core::iter::once(residuals));
    for (above, below) in above.chain(core::iter::once(q_k)).zip(below) {
        let share = tau * (*above + product(&v, below, parts));
        *above = share - *above;
        for (below, v) in below.iter_mut().zip(&v).take(parts) {
            below.iter_mut().zip(v).for_each(|(entry, v)| *entry -= share * *v);
        }
    }
}

/// x · y over so many parts, summed by lanes.
#[inline]
fn product<T: Scalar>(x: &Column<T>, y: &Column<T>, parts: usize) -> T {
    let mut sums = [T::zero(); LANES];
    for (x, y) in x.iter().zip(y).take(parts) {
        for ((sum, x), y) in sums.iter_mut().zip(x).zip(y) {
            *sum += *x * *y;
        }
    }
    sums.iter().fold(T::zero(), |sum, part| sum + *part)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::SMatrix;
    use proptest::prelude::*;

    /// Both factors of the same rows.
    fn both<const P: usize>(entries: &[f64]) -> [Triangular<f64, P>; 2] {
        let (mut rotated, mut reflected) = (Triangular::default(), Triangular::default());
        let mut panel = Panel::new(&mut reflected);
        for row in entries.chunks_exact(P + 1) {
            let jacobian = SVector::from_column_slice(&row[1..]);
            rotated.push(row[0], &jacobian);
            panel.row(row[0], &jacobian);
        }
        panel.end();
        [rotated, reflected]
    }

    proptest! {
        #[test]
        fn rows_reflected_in_give_the_factor_of_rows_rotated_in(
            entries in prop::collection::vec(-5.0f64..5.0, 5..5 * 100),
        ) {
            let [rotated, reflected] = both::<4>(&entries);
            let rank_is_full = rotated.r().diagonal().amin() > 0.1;
            prop_assert!((rotated.r().tr_mul(rotated.r()) - reflected.r().tr_mul(reflected.r())).amax() < 1e-10);
            prop_assert!((rotated.gradient() - reflected.gradient()).amax() < 1e-10);
            prop_assert!(reflected.r().diagonal().min() >= 0.0);
            prop_assert_eq!(rotated.squared_sum(), reflected.squared_sum());
            if rank_is_full {
                prop_assert!((rotated.r() - reflected.r()).amax() < 1e-9);
            }
        }
    }

    #[test]
    fn no_rows_and_rows_whose_squares_vanish_leave_the_factor_as_it_was() {
        let [_, none] = both::<3>(&[]);
        assert_eq!(none.r(), &SMatrix::<f64, 3, 3>::zeros());
        let [_, tiny] = both::<2>(&[0.0, 1e-200, 1e-200, 1.0, 3.0, 4.0]);
        assert!((tiny.r() - SMatrix::<f64, 2, 2>::new(3.0, 4.0, 0.0, 0.0)).amax() < 1e-12);
    }

    #[test]
    fn a_row_alone_keeps_the_sign_of_the_diagonal() {
        let [rotated, reflected] = both::<2>(&[1.0, -3.0, 4.0]);
        assert!((rotated.r() - reflected.r()).amax() < 1e-15);
        assert!((rotated.gradient() - reflected.gradient()).amax() < 1e-15);
    }
}
