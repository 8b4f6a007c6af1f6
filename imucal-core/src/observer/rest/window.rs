//! What is asked of the last second: four quarters together.

use nalgebra::Vector3;

use super::Stretch;
use crate::{observation::Moments, scalar::Scalar};

/// Four quarters together.
pub(super) struct Window<T: Scalar> {
    /// Variance of the specific force, sum of the axes, (m/s²)².
    pub(super) variance: T,
    /// Mean rate, rad/s; zero without a gyroscope.
    pub(super) rate: Vector3<T>,
    /// Variance of the rate, sum of the axes, (rad/s)²; not above zero without a gyroscope.
    pub(super) swing: T,
}

/// Four quarters together; `None` where one is broken. Only what is asked for: [`Stretch::join`] of all costs several times as much.
pub(super) fn window<T: Scalar>(quarters: [&Stretch<T>; 4]) -> Option<Window<T>> {
    if quarters.iter().any(|quarter| quarter.is_broken()) {
        return None;
    }
    let (_, variance) = together(quarters.map(|quarter| &quarter.acc));
    let (rate, swing) = together(quarters.map(|quarter| &quarter.gyr));
    Some(Window { variance, rate, swing })
}

/// Mean and variance, sum of the axes, of four quarters.
#[inline(never)]
fn together<T: Scalar>(quarters: [&Moments<T>; 4]) -> (Vector3<T>, T) {
    let weights = quarters.map(|quarter| T::whole(quarter.count()));
    let mean = weighted(quarters.map(|quarter| quarter.mean()), weights);
    let mut squares = T::zero();
    for (quarter, weight) in quarters.into_iter().zip(weights) {
        let (off, own) = (quarter.mean() - mean, quarter.squares());
        squares += weight * (off.x * off.x + off.y * off.y + off.z * off.z) + (own.x + own.y + own.z);
    }
    let [a, b, c, d] = weights;
    (mean, squares / (a + b + c + d - T::one()))
}

/// Mean by weights; zero where all are. By components, as in [`crate::observation::Moments::push`].
fn weighted<T: Scalar>(means: [Vector3<T>; 4], weights: [T; 4]) -> Vector3<T> {
    let (mut sum, mut total) = (Vector3::zeros(), T::zero());
    for (mean, weight) in means.into_iter().zip(weights) {
        sum = Vector3::new(sum.x + weight * mean.x, sum.y + weight * mean.y, sum.z + weight * mean.z);
        total += weight;
    }
    if total > T::zero() { Vector3::new(sum.x / total, sum.y / total, sum.z / total) } else { sum }
}
