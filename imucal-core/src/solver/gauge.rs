//! Which parameters the observations cannot tell from the others: found from the rows, not written down beforehand.
//!
//! Columns of the Jacobian are taken in order and compared with the span of those before them. A column that leaves
//! nothing beyond a tolerance is told by its predecessors; its parameter is to be held. So the order of parameters
//! is the order of preference: what a sensor's record needs comes first, what belongs to the rig last. Only the
//! triangular factor is looked at: |R e_k| and its part across the span are those of the Jacobian itself.

use nalgebra::{SMatrix, SVector};

use crate::scalar::Scalar;

/// Parameters that the rows cannot tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gauge<T: Scalar, const P: usize> {
    /// Bit k set: parameter k is told by those before it.
    pub held: u32,
    /// For each parameter, the share of its column that those before it leave: 1 for a column of its own, 0 for one
    /// that is told.
    pub own_share: SVector<T, P>,
    /// For each held parameter, the earlier one that is most like it.
    pub like: [Option<u8>; P],
}

impl<T: Scalar, const P: usize> Gauge<T, P> {
    /// From a triangular factor; a column that leaves less than `tolerance` of itself is told by the others.
    pub fn of(r: &SMatrix<T, P, P>, tolerance: T) -> Self {
        let mut basis = SMatrix::<T, P, P>::zeros();
        let mut gauge = Self { held: 0, own_share: SVector::zeros(), like: [None; P] };
        for (k, (column, like)) in r.column_iter().zip(gauge.like.iter_mut()).enumerate() {
            let length = column.norm_squared().root();
            let mut rest = column.into_owned();
            // Twice is enough (Kahan): one pass leaves rounding along the span.
            for _ in 0..2 {
                for direction in basis.column_iter() {
                    let part = direction.dot(&rest);
                    rest -= direction * part;
                }
            }
            let left = rest.norm_squared().root();
            let share = if length > T::zero() { left / length } else { T::zero() };
            if let Some(slot) = gauge.own_share.get_mut(k) {
                *slot = share;
            }
            if share > tolerance {
                basis.set_column(k, &(rest / left));
            } else {
                gauge.held |= u32::try_from(k).ok().and_then(|k| 1u32.checked_shl(k)).unwrap_or(0);
                *like = most_alike(r, k);
            }
        }
        gauge
    }
}

/// The earlier column with the largest cosine against column `k`.
fn most_alike<T: Scalar, const P: usize>(r: &SMatrix<T, P, P>, k: usize) -> Option<u8> {
    let mut best = (T::zero(), None);
    let own = r.column_iter().nth(k)?;
    for (index, other) in r.column_iter().enumerate().take(k) {
        let reach = (own.norm_squared() * other.norm_squared()).root();
        if reach > T::zero() {
            let cosine = (own.dot(&other) / reach).abs();
            if cosine > best.0 {
                best = (cosine, u8::try_from(index).ok());
            }
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        model::{
            Model,
            rig::{Axis, GimbalPose, RigAxes},
            unified::{Terms, UnifiedModel, UnifiedParameters},
        },
        solver::triangular::Triangular,
    };
    use nalgebra::Vector3;
    use std::vec::Vec;

    /// K, b, d_o, d_m, and the field: 21 entries.
    const EXTENDED: Terms<21> =
        Terms::new([0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 17, 18, 19, 20, 21, 22, 14, 15, 16]);

    fn poses() -> Vec<GimbalPose<f64>> {
        (0..60)
            .map(|k| {
                let k = f64::from(k);
                GimbalPose::new(Vector3::zeros(), &Vector3::new(1.7 * k, 2.3 * k + 0.5, 3.1 * k * k))
            })
            .collect()
    }

    fn held(axes: [Axis; 3], terms: Terms<21>, field: bool) -> u32 {
        let poses = poses();
        let mut base = UnifiedParameters::nominal(Vector3::new(25.0, 3.0, 40.0));
        base.sensitivity.m12 = 0.05;
        base.sensitivity.m31 = -0.03;
        base.outer_source = Vector3::new(0.5, -0.3, 0.8);
        base.middle_source = Vector3::new(-0.4, 0.6, 0.2);
        let model = UnifiedModel { poses: &poses, axes: RigAxes(axes), base, terms, held: 0 };
        let mut factor = Triangular::default();
        model.rows(&terms.theta(&base), &mut factor);
        let all = Gauge::of(factor.r(), 1e-9).held;
        if field { all & 0x3_FFFF } else { all }
    }

    #[test]
    fn with_a_known_field_two_of_eighteen_are_held_whatever_the_axes() {
        for axes in [[Axis::Z, Axis::Y, Axis::X], [Axis::Z, Axis::X, Axis::Y], [Axis::X, Axis::Y, Axis::Z]] {
            let found = held(axes, EXTENDED, true);
            assert_eq!(found.count_ones(), 2, "{axes:?}: {found:b}");
            // Both lie on the middle gimbal: along the inner axis (as bias) and along its own (as the outer's).
            let expected = axes.iter().skip(1).map(|axis| 1u32 << (15 + *axis as u32)).sum::<u32>();
            assert_eq!(found, expected, "{axes:?}");
        }
    }

    #[test]
    fn with_an_unknown_field_four_of_twenty_one_are_held() {
        for axes in [[Axis::Z, Axis::Y, Axis::X], [Axis::Z, Axis::X, Axis::Y], [Axis::X, Axis::Y, Axis::Z]] {
            let found = held(axes, EXTENDED, false);
            assert_eq!(found.count_ones(), 4, "{axes:?}: {found:b}");
        }
    }
}
