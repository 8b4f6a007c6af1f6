//! Condition number by one-sided Jacobi: small matrices, no allocation, no panic, nothing squared.
//!
//! Source: Hestenes 1958; Golub & Van Loan, *Matrix Computations*, 8.6.3. Columns are rotated in pairs until they
//! are orthogonal; their lengths are then the singular values.

use nalgebra::{SMatrix, SVector};

use super::triangular::{back_substitute, solve_transposed};
use crate::scalar::Scalar;

/// Sweeps over all pairs; nine parameters need five or six.
const SWEEPS: usize = 12;
/// Rounds of inverse iteration.
const ROUNDS: usize = 12;

/// Largest over smallest singular value of `a` once its columns have unit length; the largest number there is
/// where `a` is singular.
pub fn normalised_condition<T: Scalar, const P: usize>(a: &SMatrix<T, P, P>) -> T {
    let mut w = *a;
    for mut column in w.column_iter_mut() {
        let length = column.norm_squared().root();
        if length <= T::zero() || !length.finite() {
            return T::LARGEST;
        }
        column /= length;
    }
    let values = singular_values(w);
    let (mut least, mut most) = (T::LARGEST, T::zero());
    for value in values.iter() {
        least = if *value < least { *value } else { least };
        most = if *value > most { *value } else { most };
    }
    if least > T::zero() && most.finite() { most / least } else { T::LARGEST }
}

/// The unit vector along which `|R x|` with columns at unit length is least: the combination of parameters that
/// the rows tell worst, scaled back to the parameters; `None` where R is singular.
///
/// Inverse iteration: the other directions die out with the square of the singular values' ratio.
pub fn weakest_direction<T: Scalar, const P: usize>(r: &SMatrix<T, P, P>) -> Option<SVector<T, P>> {
    let mut unit = *r;
    let mut lengths = SVector::<T, P>::zeros();
    for (mut column, length) in unit.column_iter_mut().zip(lengths.iter_mut()) {
        *length = column.norm_squared().root();
        column /= *length;
    }
    let mut direction = SVector::<T, P>::repeat(T::one());
    for _ in 0..ROUNDS {
        let image = solve_transposed(&unit, &direction)?;
        direction = back_substitute(&unit, &image)?;
        direction /= direction.norm_squared().root();
    }
    Some(direction.component_div(&lengths))
}

/// Singular values of `w`, in no order.
fn singular_values<T: Scalar, const P: usize>(mut w: SMatrix<T, P, P>) -> SVector<T, P> {
    for _ in 0..SWEEPS {
        let mut turned = false;
        for i in 0..P {
            for j in (i + 1)..P {
                if let Ok([first, second]) = w.data.0.get_disjoint_mut([i, j]) {
                    turned |= orthogonalise(first, second);
                }
            }
        }
        if !turned {
            break;
        }
    }
    let mut values = SVector::<T, P>::zeros();
    for (value, column) in values.iter_mut().zip(w.column_iter()) {
        *value = column.norm_squared().root();
    }
    values
}

/// Rotates two columns so that they are orthogonal; false where they were.
fn orthogonalise<T: Scalar, const P: usize>(first: &mut [T; P], second: &mut [T; P]) -> bool {
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
    use nalgebra::{Matrix5, SMatrix};
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
    fn a_singular_matrix_has_the_largest_condition() {
        assert_eq!(normalised_condition(&SMatrix::<f32, 3, 3>::zeros()), f32::MAX);
    }
}
