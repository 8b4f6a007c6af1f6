//! Whether the gyroscope turns as gravity does in the accelerometer: neither has its axes in another order, nor of another sign.
//!
//! ```text
//! r = Cᵀ Pᵀ u_before − Pᵀ u_after      C = Π exp([± (ω − b) Δt]×), the sign that of det P
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | u | direction of the specific force at the rests before and after a turn |
//! | P | one of the 48 signed permutations ([`crate::rotation::axis_order`]): axes of the gyroscope to those of the accelerometer |
//! | C | what the nominal rates make of the turn |
//!
//! The P counts for which the mean of |r|, at most [`NEAR`] for each turn, is least. A gain of nine parameters would take such a P up in
//! silence, and the three sensors of a record would agree on axes that are a mirror image. Where P is one, the gyroscope is mirrored;
//! else it is turned, or the accelerometer is mirrored or turned, and neither is accepted.
//!
//! Not seen: all axes of the accelerometer reversed, and two sensors turned alike. Where the rates are in another unit no P carries
//! gravity.

use nalgebra::{Matrix3, Vector3};

use super::Session;
use crate::{
    accept::{Quantity, Refusal},
    model::turn,
    record::Sensor,
    rotation::{
        axis_order::{CODES, nearest, signed_permutation},
        image,
    },
    triad::Triad,
};

/// A raw gyroscope carries a direction as near as this, rad (23°): a gain wrong by a fifth over a long turn.
pub const NEAR: f64 = 0.4;
/// As they are, rates that carry directions as near as this in the mean, rad (3°), turn as gravity does, whatever else might.
const CARRIED: f32 = 0.05;
/// Another order of the axes is as good within this factor.
pub const ALIKE: f64 = 2.0;
/// A turn counts once a direction moves by this much, rad (15°).
pub const LEAST_ANGLE: f64 = 0.26;
/// Its cosine.
const LEAST_COSINE: f64 = 0.966_389_978;

impl<const N: usize, const B: usize, const M: usize> Session<N, B, M> {
    /// Looks at a gyroscope that was judged: one that is accepted tells the observer what turns come to.
    pub(super) fn end_gyroscope(&mut self) {
        self.check_sense();
        if let Some(estimate) = self.estimate(Sensor::Gyroscope).filter(|estimate| estimate.verdict.is_ok()) {
            let gain = estimate.triad.gain;
            self.observer.set_gain(&gain);
        }
    }

    /// Refuses the gyroscope where it does not turn as gravity does, and the accelerometer where it may be that.
    #[inline(never)]
    fn check_sense(&mut self) {
        let Some(a) = self.sense().filter(|code| *code != 0).and_then(signed_permutation::<f32>) else {
            return;
        };
        let refusal = |axes: Matrix3<f32>| {
            Err(Refusal::Implausible { what: Quantity::Axes, value: nearest(&axes).0 as f64, limit: 0.0 })
        };
        let is_mirror = a.determinant() < 0.0;
        let [acc, gyr, _] = &mut self.estimates;
        if let Some(gyr) = gyr {
            gyr.verdict = refusal(a.transpose());
        }
        // Mirrored alike, both sensors have each the other's axes and the sense of no turn.
        if let Some(acc) = acc.as_mut().filter(|_| !is_mirror || a == -Matrix3::identity()) {
            acc.verdict = refusal(if is_mirror { a } else { -a });
        }
    }

    /// Code of P; `None` where no order of the axes carries gravity, or no turn moves it.
    fn sense(&self) -> Option<usize> {
        let (acc, near) = (self.estimate(Sensor::Accelerometer)?.triad, NEAR as f32);
        let (mut sums, mut turns) = ([0.0; CODES], 0.0);
        for pose in self.poses.list() {
            let Some([before, after]) =
                pose.ends(&acc).filter(|[before, after]| before.dot(after) < LEAST_COSINE as f32)
            else {
                continue;
            };
            let carried = [1.0, -1.0].map(|sign| {
                let triad = Triad { gain: Matrix3::from_diagonal_element(sign), bias: Vector3::zeros() };
                pose.with_turn(&acc, None, |turn| turn::attitude(&triad, turn).transpose())
            });
            let [Some(as_is), Some(reversed)] = carried else { continue };
            turns += 1.0;
            for (code, sum) in sums.iter_mut().enumerate() {
                let p = signed_permutation::<f32>(code).unwrap_or_else(Matrix3::zeros).transpose();
                let c = if p.determinant() < 0.0 { &reversed } else { &as_is };
                let off = image(c, &image(&p, &before)) - image(&p, &after);
                let size = libm::sqrtf(off.norm_squared());
                *sum += if size < near { size } else { near };
            }
        }
        let first = *sums.first()?;
        let least = sums.iter().fold(f32::INFINITY, |least, sum| if *sum < least { *sum } else { least });
        if first <= ALIKE as f32 * least || first < CARRIED * turns {
            return Some(0);
        }
        // Half of the turns at least are carried.
        let place = sums.iter().position(|sum| *sum <= least)?;
        (least < 0.5 * near * turns).then_some(place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cosine_is_that_of_the_angle() {
        assert!((LEAST_COSINE - LEAST_ANGLE.cos()).abs() < 1e-9, "{}", LEAST_ANGLE.cos());
    }
}
