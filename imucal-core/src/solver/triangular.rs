//! Streamed triangularisation: the Jacobian and residual of any number of rows, in P×P memory.
//!
//! Each row is rotated into an upper triangular R and a vector q (Givens), so that at any time
//! `|J δ + r|² = |R δ + q|² + rest²`. Nothing is squared: in `f32` JᵀJ would lose half of the digits.
//! Source: Golub & Van Loan, *Matrix Computations*, 5.1.8 and 6.5.3. Indices run over the const size P, so no bounds
//! check is left in an image (its link fails otherwise).

use nalgebra::{SMatrix, SVector};

use crate::{model::RowSink, scalar::Scalar};

/// The factor of the rows streamed so far.
#[derive(Clone, Copy, Debug)]
pub struct Triangular<T: Scalar, const P: usize> {
    r: SMatrix<T, P, P>,
    q: SVector<T, P>,
    squared_sum: T,
}

impl<T: Scalar, const P: usize> Default for Triangular<T, P> {
    fn default() -> Self {
        Self { r: SMatrix::zeros(), q: SVector::zeros(), squared_sum: T::zero() }
    }
}

impl<T: Scalar, const P: usize> Triangular<T, P> {
    /// Rotates one row into the factor.
    pub fn push(&mut self, residual: T, jacobian: &SVector<T, P>) {
        let mut row = *jacobian;
        self.squared_sum += residual * residual;
        rotate_in(self.r.as_mut_slice(), self.q.as_mut_slice(), row.as_mut_slice(), residual);
    }

    /// As many rows as there are parameters and one more, of the same least squares as all those that were streamed.
    pub fn stream(&self, sink: &mut impl RowSink<T, P>) {
        for (k, q) in self.q.iter().enumerate() {
            let mut row = SVector::<T, P>::zeros();
            let entries = self.r.iter().skip(k).step_by(P.max(1));
            row.iter_mut().zip(entries).for_each(|(slot, entry)| *slot = *entry);
            sink.row(*q, &row);
        }
        let rest = self.squared_sum - dot(self.q.as_slice(), self.q.as_slice());
        // Rounding may leave it below zero.
        let rest = if rest > T::zero() { rest } else { T::zero() };
        sink.row(rest.root(), &SVector::zeros());
    }

    /// R by columns, q, and Σ r², for whoever takes in many rows at a time.
    pub(super) fn parts(&mut self) -> (&mut [T], &mut [T], &mut T) {
        (self.r.as_mut_slice(), self.q.as_mut_slice(), &mut self.squared_sum)
    }

    /// Σ r² of the rows.
    pub fn squared_sum(&self) -> T {
        self.squared_sum
    }

    /// The upper triangular factor R.
    pub fn r(&self) -> &SMatrix<T, P, P> {
        &self.r
    }

    /// Jᵀr.
    pub fn gradient(&self) -> SVector<T, P> {
        let mut gradient = SVector::<T, P>::zeros();
        multiply_transposed(self.r.as_slice(), self.q.as_slice(), gradient.as_mut_slice());
        gradient
    }

    /// Lengths of the Jacobian's columns.
    pub fn column_norms(&self) -> SVector<T, P> {
        let mut norms = SVector::<T, P>::zeros();
        column_lengths(self.r.as_slice(), norms.as_mut_slice());
        norms
    }

    /// |R x|: how far `x` moves the residual.
    pub fn length_of(&self, x: &SVector<T, P>) -> T {
        length_of_image(self.r.as_slice(), x.as_slice())
    }

    /// The δ that minimises `|J δ + r|² + μ Σ (d_k δ_k)²`; `None` where that is singular.
    pub fn damped_step(&self, mu: T, scale: &SVector<T, P>) -> Option<SVector<T, P>> {
        let (mut r, mut q, mut row) = (self.r, self.q, SVector::<T, P>::zeros());
        damp(r.as_mut_slice(), q.as_mut_slice(), row.as_mut_slice(), mu.root(), scale.as_slice());
        back_substitute(&r, &-q)
    }

    /// R⁻¹; `None` where R is singular.
    pub fn inverse(&self) -> Option<SMatrix<T, P, P>> {
        let mut inverse = SMatrix::<T, P, P>::zeros();
        invert(self.r.as_slice(), inverse.as_mut_slice(), P).then_some(inverse)
    }

    /// `variance · (JᵀJ)⁻¹`, from R alone; `None` where it is singular.
    #[inline(never)]
    pub fn covariance(&self, variance: T) -> Option<SMatrix<T, P, P>> {
        let inverse = self.inverse()?;
        let mut covariance = SMatrix::<T, P, P>::zeros();
        square(inverse.as_slice(), covariance.as_mut_slice(), P, variance);
        Some(covariance)
    }
}

// What follows works on slices, matrices by columns, and stands out of line: one body serves every number of
// parameters, which halves the flash of a device with several fits.

/// x · y.
#[inline(never)]
pub(crate) fn dot<T: Scalar>(x: &[T], y: &[T]) -> T {
    x.iter().zip(y).fold(T::zero(), |sum, (a, b)| sum + *a * *b)
}

/// Σ (x_k w_k)².
#[inline(never)]
pub(crate) fn weighted_square<T: Scalar>(x: &[T], weights: &[T]) -> T {
    x.iter().zip(weights).fold(T::zero(), |sum, (a, w)| {
        let weighted = *a * *w;
        sum + weighted * weighted
    })
}

/// y = Rᵀ x.
#[inline(never)]
fn multiply_transposed<T: Scalar>(r: &[T], x: &[T], y: &mut [T]) {
    for (column, slot) in r.chunks_exact(x.len().max(1)).zip(y) {
        *slot = dot(column, x);
    }
}

/// Lengths of the columns.
#[inline(never)]
fn column_lengths<T: Scalar>(r: &[T], lengths: &mut [T]) {
    for (column, slot) in r.chunks_exact(lengths.len().max(1)).zip(lengths) {
        *slot = dot(column, column).root();
    }
}

/// |R x|.
#[inline(never)]
fn length_of_image<T: Scalar>(r: &[T], x: &[T]) -> T {
    let size = x.len();
    let rows = (0..size).map(|k| {
        let row = r.iter().skip(k).step_by(size);
        row.zip(x).fold(T::zero(), |sum, (a, b)| sum + *a * *b)
    });
    rows.fold(T::zero(), |sum, entry| sum + entry * entry).root()
}

/// Rotates in a row for each parameter, `root · scale_k` in its place.
#[inline(never)]
fn damp<T: Scalar>(r: &mut [T], q: &mut [T], row: &mut [T], root: T, scale: &[T]) {
    for (k, length) in scale.iter().enumerate() {
        row.fill(T::zero());
        if let Some(entry) = row.get_mut(k) {
            *entry = root * *length;
        }
        rotate_in(r, q, row, T::zero());
    }
}

/// R⁻¹, column by column; false where R is singular.
#[inline(never)]
fn invert<T: Scalar>(r: &[T], inverse: &mut [T], size: usize) -> bool {
    inverse.chunks_exact_mut(size.max(1)).enumerate().all(|(k, column)| {
        column.fill(T::zero());
        if let Some(entry) = column.get_mut(k) {
            *entry = T::one();
        }
        substitute_back(r, column)
    })
}

/// `factor · A Aᵀ`.
#[inline(never)]
fn square<T: Scalar>(a: &[T], out: &mut [T], size: usize, factor: T) {
    for (j, column) in out.chunks_exact_mut(size.max(1)).enumerate() {
        for (i, slot) in column.iter_mut().enumerate() {
            let (left, right) = (a.iter().skip(i).step_by(size), a.iter().skip(j).step_by(size));
            *slot = left.zip(right).fold(T::zero(), |sum, (x, y)| sum + *x * *y) * factor;
        }
    }
}

/// Rotates a row and its residual into a factor R, by columns, and q.
///
/// Over slices, out of line: one body serves every number of parameters.
#[inline(never)]
fn rotate_in<T: Scalar>(r: &mut [T], q: &mut [T], row: &mut [T], residual: T) {
    let size = q.len();
    let mut rest = residual;
    for (k, q_k) in q.iter_mut().enumerate() {
        // Row k of R from its diagonal on.
        let above = r.iter_mut().skip(k * size + k).step_by(size);
        let mut pairs = above.zip(row.iter_mut().skip(k));
        let Some((d, x)) = pairs.next() else { return };
        let length = (*d * *d + *x * *x).root();
        // Nothing to rotate, or both squares underflowed: below every rounding here.
        if *x == T::zero() || length == T::zero() {
            continue;
        }
        let (cos, sin) = (*d / length, *x / length);
        for (above, below) in core::iter::once((d, x)).chain(pairs) {
            (*above, *below) = (cos * *above + sin * *below, cos * *below - sin * *above);
        }
        (*q_k, rest) = (cos * *q_k + sin * rest, cos * rest - sin * *q_k);
    }
}

/// x with R x = y, R upper triangular; `None` where a pivot vanishes or the answer is not finite.
fn back_substitute<T: Scalar, const P: usize>(
    r: &SMatrix<T, P, P>,
    y: &SVector<T, P>,
) -> Option<SVector<T, P>> {
    let mut x = *y;
    substitute_back(r.as_slice(), x.as_mut_slice()).then_some(x)
}

/// The same over slices, R by columns, in place; false where there is no answer.
#[inline(never)]
pub(super) fn substitute_back<T: Scalar>(r: &[T], x: &mut [T]) -> bool {
    let size = x.len();
    for k in (0..size).rev() {
        let row = r.iter().skip(k).step_by(size);
        let known: T = row.zip(x.iter()).skip(k + 1).fold(T::zero(), |sum, (a, b)| sum + *a * *b);
        let pivot = r.get(k * size + k).copied().filter(|pivot| *pivot != T::zero());
        let (Some(entry), Some(pivot)) = (x.get_mut(k), pivot) else { return false };
        *entry = (*entry - known) / pivot;
    }
    x.iter().all(|value| value.finite())
}

/// x with Rᵀ x = y, R upper triangular, in place; false as above.
#[inline(never)]
pub(super) fn substitute_transposed<T: Scalar>(r: &[T], x: &mut [T]) -> bool {
    let size = x.len();
    for k in 0..size {
        let column = r.iter().skip(k * size);
        let known: T = column.zip(x.iter()).take(k).fold(T::zero(), |sum, (a, b)| sum + *a * *b);
        let pivot = r.get(k * size + k).copied().filter(|pivot| *pivot != T::zero());
        let (Some(entry), Some(pivot)) = (x.get_mut(k), pivot) else { return false };
        *entry = (*entry - known) / pivot;
    }
    x.iter().all(|value| value.finite())
}

impl<T: Scalar, const P: usize> RowSink<T, P> for Triangular<T, P> {
    const JACOBIAN: bool = true;

    #[inline]
    fn row(&mut self, residual: T, jacobian: &SVector<T, P>) {
        self.push(residual, jacobian);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix4, SMatrix, Vector4};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_factor_of_streamed_rows_is_the_normal_equations_root(
            entries in prop::collection::vec(-5.0f64..5.0, 50),
        ) {
            let mut t = Triangular::<f64, 4>::default();
            let (mut normal, mut image, mut sum) = (Matrix4::zeros(), Vector4::zeros(), 0.0);
            for row in entries.chunks_exact(5) {
                let jacobian = Vector4::from_column_slice(&row[..4]);
                t.push(row[4], &jacobian);
                normal += jacobian * jacobian.transpose();
                image += jacobian * row[4];
                sum += row[4] * row[4];
            }
            prop_assert!((t.r().transpose() * t.r() - normal).norm() < 1e-10);
            prop_assert!((t.gradient() - image).norm() < 1e-10);
            prop_assert!((t.squared_sum() - sum).abs() < 1e-10);
            // Its own few rows stand for all of them.
            let mut again = Triangular::default();
            t.stream(&mut again);
            prop_assert!((again.r().transpose() * again.r() - normal).norm() < 1e-10);
            prop_assert!((again.gradient() - image).norm() < 1e-10);
            prop_assert!((again.squared_sum() - sum).abs() < 1e-10);
        }

        #[test]
        fn inverse_covariance_and_lengths_are_those_of_their_definitions(
            entries in prop::collection::vec(-5.0f64..5.0, 40), x in prop::array::uniform4(-3.0f64..3.0),
        ) {
            let mut t = Triangular::<f64, 4>::default();
            for row in entries.chunks_exact(5) {
                t.push(row[4], &Vector4::from_column_slice(&row[..4]));
            }
            let (r, x) = (*t.r(), Vector4::from(x));
            prop_assume!(r.diagonal().amin() > 0.1);
            let inverse = r.try_inverse().unwrap();
            prop_assert!((t.inverse().unwrap() - inverse).amax() < 1e-9 * inverse.amax());
            let covariance = inverse * inverse.transpose() * 0.7;
            prop_assert!((t.covariance(0.7).unwrap() - covariance).amax() < 1e-9 * covariance.amax());
            prop_assert!((t.length_of(&x) - (r * x).norm()).abs() < 1e-10);
            let mut solved = x;
            prop_assert!(substitute_transposed(r.as_slice(), solved.as_mut_slice()));
            prop_assert!((r.transpose() * solved - x).amax() < 1e-8 * (1.0 + solved.amax()));
        }

        #[test]
        fn the_damped_step_solves_the_damped_normal_equations(
            entries in prop::collection::vec(-5.0f64..5.0, 40), mu in 1e-3f64..10.0,
        ) {
            let mut t = Triangular::<f64, 4>::default();
            for row in entries.chunks_exact(5) {
                t.push(row[4], &Vector4::from_column_slice(&row[..4]));
            }
            let scale = t.column_norms();
            let step = t.damped_step(mu, &scale).unwrap();
            let damping: SMatrix<f64, 4, 4> = Matrix4::from_diagonal(&scale.component_mul(&scale)) * mu;
            let left = t.r().transpose() * t.r() + damping;
            prop_assert!((left * step + t.gradient()).norm() < 1e-9 * left.norm());
        }
    }

    #[test]
    fn a_row_whose_squares_vanish_leaves_the_factor_finite() {
        let mut t = Triangular::<f64, 2>::default();
        t.push(0.0, &SVector::from([1e-200, 1e-200]));
        t.push(1.0, &SVector::from([3.0, 4.0]));
        t.push(0.0, &SVector::from([0.0, 2.0]));
        assert!((t.r().transpose() * t.r() - SMatrix::from([[9.0, 12.0], [12.0, 20.0]])).amax() < 1e-12);
    }

    #[test]
    fn a_pivot_that_vanishes_has_no_solution() {
        let r = [2.0, 0.0, 1.0, 0.0];
        assert!(!substitute_transposed(&r, &mut [1.0, 1.0]) && !substitute_back(&r, &mut [1.0, 1.0]));
    }

    #[test]
    fn a_column_never_seen_leaves_the_factor_singular() {
        let mut t = Triangular::<f32, 2>::default();
        t.push(1.0, &SVector::from([1.0, 0.0]));
        assert!(t.covariance(1.0).is_none());
    }
}
