//! Clouds: the distinct, usable samples of a magnetometer.

use imucal_core::observation::ShellPoint;
use nalgebra::Vector3;

/// Points of a cloud and the rows they come from, in time order.
#[derive(Clone, Debug, Default)]
pub struct Cloud {
    /// Points, nominal unit.
    pub points: Vec<ShellPoint<f64>>,
    /// Row of each.
    pub rows: Vec<usize>,
}

/// The usable samples, without those that only repeat the one before: a sensor slower than the recording would
/// otherwise count each of its samples several times.
pub fn cloud(values: &[Vector3<f64>], usable: &[bool]) -> Cloud {
    let mut cloud =
        Cloud { points: Vec::with_capacity(values.len()), rows: Vec::with_capacity(values.len()) };
    for (row, (value, good)) in values.iter().zip(usable).enumerate() {
        let repeats = cloud.points.last().is_some_and(|last| last.value == *value);
        if *good && !repeats {
            cloud.points.push(ShellPoint::new(*value));
            cloud.rows.push(row);
        }
    }
    cloud
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_that_repeats_the_one_before_counts_once() {
        let values = [Vector3::x(), Vector3::x(), Vector3::y(), Vector3::repeat(f64::NAN), Vector3::x()];
        let cloud = cloud(&values, &[true, true, true, false, true]);
        assert_eq!(cloud.rows, [0, 2, 4]);
    }
}
