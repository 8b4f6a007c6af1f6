//! Axes in another order or of another sign: the 48 signed permutations, each by a code.
//!
//! ```text
//! code = 8 · order + signs      bit k of the signs: axis k is negated
//! ```
//!
//! Axis k as it is recorded is the axis `ORDERS[order][k]` as it is. Code 0 is as it ought to be; those of a negative determinant
//! are mirror images.

use nalgebra::Matrix3;

use crate::scalar::Scalar;

/// Which axis each of the recorded ones holds.
pub const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
/// How many codes there are.
pub const CODES: usize = 8 * ORDERS.len();

/// The signed permutation of a code: from the axes as they are to the axes as they are recorded. `None` from [`CODES`].
#[inline]
pub fn signed_permutation<T: Scalar>(code: usize) -> Option<Matrix3<T>> {
    let order = ORDERS.get(code / 8)?;
    let mut matrix = Matrix3::zeros();
    for (axis, from) in order.iter().enumerate() {
        let sign = if (code % 8) >> axis & 1 == 1 { -T::one() } else { T::one() };
        if let Some(entry) = matrix.get_mut((axis, *from)) {
            *entry = sign;
        }
    }
    Some(matrix)
}

/// The signed permutation nearest to a matrix, by its code, and the sum of the entries along it: of a rotation 1 + 2 cos of the
/// angle to it.
#[inline]
pub fn nearest<T: Scalar>(matrix: &Matrix3<T>) -> (usize, T) {
    let mut best = (0, T::of(f64::NEG_INFINITY));
    for code in 0..CODES {
        let along = signed_permutation::<T>(code).map_or(T::zero(), |p| p.component_mul(matrix).sum());
        if along >= best.1 {
            best = (code, along);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rotation::exp;
    use nalgebra::Vector3;

    #[test]
    fn every_code_is_the_nearest_to_its_own_permutation() {
        for code in 0..CODES {
            assert_eq!(nearest(&signed_permutation::<f64>(code).expect("a code")), (code, 3.0));
        }
        assert!(signed_permutation::<f64>(CODES).is_none());
    }

    #[test]
    fn a_rotation_near_an_order_is_at_its_angle_from_it() {
        for code in 0..CODES {
            let near = signed_permutation::<f64>(code).expect("a code") * exp(&Vector3::new(0.2, -0.1, 0.3));
            let (found, along) = nearest(&near);
            let angle = f64::acos((along - 1.0) / 2.0);
            assert_eq!(found, code);
            assert!((angle - 0.14_f64.sqrt()).abs() < 1e-9, "{angle}");
        }
    }
}
