//! Which parameters the observations cannot distinguish from the others: found from the rows, not written down beforehand.
//!
//! Columns of the Jacobian are taken class by class, and within a class the one that has most of its own left, seen
//! against the span of those taken before. A column that is left with less than a tolerance is determined by the others;
//! its parameter is to be held. The classes are the order of preference: what a sensor's record needs comes first,
//! what belongs to the rig or the room last. Only the triangular factor is looked at: |R e_k| and its part across a
//! span are those of the Jacobian itself. Source: column-pivoted orthogonalisation, Golub & Van Loan 5.4.2.

use nalgebra::{SMatrix, SVector};

use crate::scalar::Scalar;

/// Of a class, the first column is taken whose share is at least this part of the largest: ties go by order.
const NEARLY_LARGEST: f64 = 0.5;

/// Parameters that the rows cannot determine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gauge<T: Scalar, const P: usize> {
    /// Bit k set: parameter k is determined by the others.
    pub held: u32,
    /// For each parameter, the share of its column that was left when it was taken: 1 for a column of its own, 0 for
    /// one that is determined.
    pub own_share: SVector<T, P>,
    /// For each held parameter, another that is most like it.
    pub like: [Option<u8>; P],
}

impl<T: Scalar, const P: usize> Gauge<T, P> {
    /// From a triangular factor; a column that is left with less than `tolerance` of itself is determined by the others.
    /// `class` says the order in which parameters are taken, lowest first.
    pub fn of(r: &SMatrix<T, P, P>, tolerance: T, class: impl Fn(usize) -> u8) -> Self {
        let mut gauge = Self { held: 0, own_share: SVector::zeros(), like: [None; P] };
        let mut rest = *r;
        let mut pending = u32::MAX;
        for _ in 0..P {
            let Some((k, share)) = next(r, &rest, pending, &class) else { break };
            pending &= !bit(k);
            if let Some(slot) = gauge.own_share.get_mut(k) {
                *slot = share;
            }
            if share > tolerance {
                take(&mut rest, k, pending);
            } else {
                gauge.held |= bit(k);
                if let Some(like) = gauge.like.get_mut(k) {
                    *like = most_alike(r, k);
                }
            }
        }
        gauge
    }

    /// Parameter `k` is determined by the others.
    pub fn is_held(&self, k: usize) -> bool {
        self.held & bit(k) != 0
    }
}

/// Bit of a parameter; none beyond 31.
pub fn bit(k: usize) -> u32 {
    u32::try_from(k).ok().and_then(|k| 1u32.checked_shl(k)).unwrap_or(0)
}

/// The columns, copied: a view of one keeps its assertion on the bounds in an image.
fn columns<T: Scalar, const P: usize>(r: &SMatrix<T, P, P>) -> impl Iterator<Item = SVector<T, P>> + Clone {
    r.data.0.iter().map(|column| SVector::from(*column))
}

/// The column to take next, and its share.
fn next<T: Scalar, const P: usize>(
    r: &SMatrix<T, P, P>,
    rest: &SMatrix<T, P, P>,
    pending: u32,
    class: &impl Fn(usize) -> u8,
) -> Option<(usize, T)> {
    let lowest = (0..P).filter(|k| pending & bit(*k) != 0).map(class).min()?;
    let shares = columns(r).zip(columns(rest)).map(|(whole, left)| {
        let length = whole.norm_squared().root();
        if length > T::zero() { left.norm_squared().root() / length } else { T::zero() }
    });
    let mut candidates = shares.enumerate().filter(|(k, _)| pending & bit(*k) != 0 && class(*k) == lowest);
    let largest =
        candidates.clone().map(|(_, share)| share).fold(T::zero(), |a, b| if b > a { b } else { a });
    candidates.find(|(_, share)| *share >= largest * T::of(NEARLY_LARGEST))
}

/// Takes the part along column `k` out of the pending columns. Twice, since once leaves rounding along it.
fn take<T: Scalar, const P: usize>(rest: &mut SMatrix<T, P, P>, k: usize, pending: u32) {
    let Some(column) = columns(rest).nth(k) else { return };
    let direction = column / column.norm_squared().root();
    for (index, other) in rest.data.0.iter_mut().enumerate() {
        if pending & bit(index) != 0 {
            let mut left = SVector::from(*other);
            for _ in 0..2 {
                let part = direction.dot(&left);
                left -= direction * part;
            }
            *other = left.into();
        }
    }
}

/// The other column with the largest cosine against column `k`.
fn most_alike<T: Scalar, const P: usize>(r: &SMatrix<T, P, P>, k: usize) -> Option<u8> {
    let mut best = (T::zero(), None);
    let own = columns(r).nth(k)?;
    for (index, other) in columns(r).enumerate().filter(|(index, _)| *index != k) {
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

    /// K, b, d_o, d_m.
    const SOURCES: Terms<18> = Terms::new([0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 17, 18, 19, 20, 21, 22]);
    /// And the field.
    const ALL: Terms<21> =
        Terms::new([0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 17, 18, 19, 20, 21, 22, 14, 15, 16]);
    /// Any order of three axes that a rig has.
    const RIGS: [[Axis; 3]; 3] =
        [[Axis::Z, Axis::Y, Axis::X], [Axis::Z, Axis::X, Axis::Y], [Axis::X, Axis::Y, Axis::Z]];

    fn poses() -> Vec<GimbalPose<f64>> {
        (0..60)
            .map(|k| {
                let k = f64::from(k);
                GimbalPose::new(Vector3::zeros(), &Vector3::new(1.7 * k, 2.3 * k + 0.5, 3.1 * k * k))
            })
            .collect()
    }

    fn held<const P: usize>(axes: [Axis; 3], terms: Terms<P>) -> u32 {
        let poses = poses();
        let mut base = UnifiedParameters::nominal(Vector3::new(25.0, 3.0, 40.0));
        base.sensitivity.m12 = 0.05;
        base.sensitivity.m31 = -0.03;
        base.outer_source = Vector3::new(0.5, -0.3, 0.8);
        base.middle_source = Vector3::new(-0.4, 0.6, 0.2);
        let model = UnifiedModel { poses: &poses, axes: RigAxes(axes), base, terms, held: 0 };
        let mut factor = Triangular::default();
        model.rows(&terms.theta(&base), &mut factor);
        Gauge::of(factor.r(), 1e-9, |k| terms.class(k)).held
    }

    #[test]
    fn with_a_known_field_two_of_eighteen_are_held_whatever_the_axes() {
        for axes in RIGS {
            let found = held(axes, SOURCES);
            assert_eq!(found.count_ones(), 2, "{axes:?}: {found:b}");
            // Along the inner axis the middle gimbal's source is bias; along its own, the outer gimbal's source.
            let [_, own, inner] = axes.map(|axis| axis as u32);
            let (as_bias, as_outer) = (1 << (15 + inner), [1 << (12 + own), 1 << (15 + own)]);
            assert!(
                found & as_bias != 0 && as_outer.iter().any(|bit| found & bit != 0),
                "{axes:?}: {found:b}"
            );
        }
    }

    #[test]
    fn with_an_unknown_field_four_of_twenty_one_are_fixed() {
        for axes in RIGS {
            let found = held(axes, ALL);
            assert_eq!(found.count_ones(), 4, "{axes:?}: {found:b}");
            assert_eq!((found >> 18).count_ones(), 2, "{axes:?}: {found:b}");
        }
    }
}
