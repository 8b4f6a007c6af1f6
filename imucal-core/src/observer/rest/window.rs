//! What is asked of the last second: four quarters together.

use nalgebra::Vector3;

use super::Stretch;
use crate::scalar::Scalar;

/// Four quarters together.
pub(super) struct Window<T: Scalar> {
    /// Variance of the specific force, sum of the axes, (m/s²)².
    pub(super) variance: T,
    /// Mean rate, rad/s; zero without a gyroscope.
    pub(super) rate: Vector3<T>,
}

/// Four quarters together; `None` where one is broken. Only what is asked for: [`Stretch::join`] of all costs several times as much.
pub(super) fn window<T: Scalar>(quarters: [&Stretch<T>; 4]) -> Option<Window<T>> {
    if quarters.iter().any(|quarter| quarter.is_broken()) {
        return None;
    }
    let weights = |of: fn(&Stretch<T>) -> u32| quarters.map(|quarter| T::whole(of(quarter)));
    let (acc, gyr) = (weights(|quarter| quarter.acc.count()), weights(|quarter| quarter.gyr.count()));
    let force = weighted(quarters.map(|quarter| quarter.acc.mean()), acc);
    let mut squares = T::zero();
    for (quarter, weight) in quarters.into_iter().zip(acc) {
        let (off, own) = (quarter.acc.mean() - force, quarter.acc.squares());
        squares += weight * (off.x * off.x + off.y * off.y + off.z * off.z) + (own.x + own.y + own.z);
    }
    let [a, b, c, d] = acc;
    let rate = weighted(quarters.map(|quarter| quarter.gyr.mean()), gyr);
    Some(Window { variance: squares / (a + b + c + d - T::one()), rate })
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
