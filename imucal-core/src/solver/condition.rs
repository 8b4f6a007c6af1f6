//! Condition number by one-sided Jacobi: small matrices, no allocation, no panic, nothing squared.
//!
//! Source: Hestenes 1958; Golub & Van Loan, *Matrix Computations*, 8.6.3. Columns are rotated in pairs until they
//! are orthogonal; their lengths are then the singular values.

use nalgebra::{SMatrix, SVector};

use super::triangular::{dot, substitute_back, substitute_transposed};
use crate::scalar::Scalar;

/// Sweeps over all pairs; nine parameters need five or six.
const SWEEPS: usize = 12;
/// Rounds of inverse iteration.
const ROUNDS: usize = 12;

/// Largest over smallest singular value of `a` once its columns have unit length; the largest number there is
/// where `a` is singular.
pub fn normalised_condition<T: Scalar, const P: usize>(a: &SMatrix<T, P, P>) -> T {
    let mut columns = *a;
    condition_of(columns.as_mut_slice(), P)
}

/// The same over a slice, by columns of a size, which it uses up: one body serves every size.
#[inline(never)]
fn condition_of<T: Scalar>(columns: &mut [T], size: usize) -> T {
    for column in columns.chunks_exact_mut(size.max(1)) {
        let length = dot(column, column).root();
        if length <= T::zero() || !length.finite() {
            return T::LARGEST;
        }
        column.iter_mut().for_each(|entry| *entry /= length);
    }
    orthogonalise_all(columns, size);
    let (mut least, mut most) = (T::LARGEST, T::zero());
    for column in columns.chunks_exact(size.max(1)) {
        let value = dot(column, column).root();
        least = if value < least { value } else { least };
        most = if value > most { value } else { most };
    }
    if least > T::zero() && most.finite() { most / least } else { T::LARGEST }
}

/// The unit vector along which `|R x|` with columns at unit length is least: the combination of parameters that
/// the rows determine worst, scaled back to the parameters; `None` where R is singular.
///
/// Inverse iteration: the other directions die out with the square of the singular values' ratio.
pub fn weakest_direction<T: Scalar, const P: usize>(r: &SMatrix<T, P, P>) -> Option<SVector<T, P>> {
    let mut unit = *r;
    let mut lengths = SVector::<T, P>::zeros();
    let mut direction = SVector::<T, P>::repeat(T::one());
    weaken(unit.as_mut_slice(), lengths.as_mut_slice(), direction.as_mut_slice()).then_some(direction)
}

/// The same over slices, R by columns, which it uses up; false where R is singular.
#[inline(never)]
fn weaken<T: Scalar>(unit: &mut [T], lengths: &mut [T], direction: &mut [T]) -> bool {
    let size = direction.len().max(1);
    for (column, length) in unit.chunks_exact_mut(size).zip(lengths.iter_mut()) {
        *length = dot(column, column).root();
        column.iter_mut().for_each(|entry| *entry /= *length);
    }
    for _ in 0..ROUNDS {
        if !substitute_transposed(unit, direction) || !substitute_back(unit, direction) {
            return false;
        }
        let length = dot(direction, direction).root();
        direction.iter_mut().for_each(|entry| *entry /= length);
    }
    direction.iter_mut().zip(lengths).for_each(|(entry, length)| *entry /= *length);
    true
}

/// Turns columns until their lengths are the singular values.
fn orthogonalise_all<T: Scalar>(columns: &mut [T], size: usize) {
    for _ in 0..SWEEPS {
        let mut turned = false;
        for i in 0..size {
            // Those before i + 1, of which the last is turned with each of those after.
            let Some((head, tail)) = columns.split_at_mut_checked((i + 1) * size) else { return };
            let Some((_, first)) = head.split_at_mut_checked(i * size) else { return };
            for second in tail.chunks_exact_mut(size.max(1)) {
                turned |= orthogonalise(first, second);
            }
        }
        if !turned {
            return;
        }
    }
}

/// Rotates two columns so that they are orthogonal; false where they were.
fn orthogonalise<T: Scalar>(first: &mut [T], second: &mut [T]) -> bool {
    let (mut a, mut b, mut c) = (T::zero(), T::zero(), T::zero());
    for (x, y) in first.iter().zip(second.iter()) {
        a += *x * *x;
        b += *y * *y;
        c += *x * *y;
    }
    let limit = T::EPSILON * (a * b).root();
    let magnitude = if c < T::zero() { -c } else { c };
    if magnitude <= limit || !magnitude.finite() {
        return false;
    }
    let zeta = (b - a) / (c + c);
    let size = if zeta < T::zero() { -zeta } else { zeta };
    let tangent = T::one() / (size + (T::one() + zeta * zeta).root());
    let tangent = if zeta < T::zero() { -tangent } else { tangent };
    let cos = T::one() / (T::one() + tangent * tangent).root();
    let sin = cos * tangent;
    for (x, y) in first.iter_mut().zip(second.iter_mut()) {
        (*x, *y) = (*x * cos - *y * sin, *x * sin + *y * cos);
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, Matrix5, SMatrix, Vector3};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_condition_agrees_with_an_independent_svd(entries in prop::collection::vec(-3.0f64..3.0, 25)) {
            let a = Matrix5::from_column_slice(&entries);
            let mut unit = a;
            unit.column_iter_mut().for_each(|mut c| { c.normalize_mut(); });
            let values = unit.singular_values();
            let expected = values.max() / values.min();
            prop_assert!((normalised_condition(&a) / expected - 1.0).abs() < 1e-9 * expected);
        }
    }

    #[test]
    fn the_weakest_direction_is_that_of_an_independent_svd() {
        // Upper triangular, with columns of very different lengths.
        let r = Matrix3::new(2.0, 30.0, 0.1, 0.0, 5.0, 0.4, 0.0, 0.0, 0.05);
        let lengths = Vector3::from_fn(|k, _| r.column(k).norm());
        let unit = r * Matrix3::from_diagonal(&lengths.map(f64::recip));
        let svd = unit.svd(false, true);
        let least = svd.singular_values.imin();
        let expected = svd.v_t.unwrap().row(least).transpose().component_div(&lengths);
        let found = weakest_direction(&r).unwrap();
        let sign = found.dot(&expected).signum();
        assert!((found * sign - expected).amax() < 1e-6 * expected.amax(), "{found} {expected}");
        assert!(weakest_direction(&Matrix3::<f64>::zeros()).is_none());
    }

    #[test]
    fn a_singular_matrix_has_the_largest_condition() {
        assert_eq!(normalised_condition(&SMatrix::<f32, 3, 3>::zeros()), f32::MAX);
    }
}
