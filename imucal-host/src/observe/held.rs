//! Samples that are held: rows that repeat the row before, as a sensor slower than the recording has them.

use std::ops::Range;

use nalgebra::Vector3;

/// Whether a row repeats the row before in all axes.
fn repeats(values: &[Vector3<f64>], row: usize) -> bool {
    row > 0 && values[row] == values[row - 1]
}

/// Share of the usable rows outside of the rests that repeat the row before; 0 where there are none. At rest coarse steps
/// repeat a value as well.
pub fn share(values: &[Vector3<f64>], usable: &[bool], rests: &[Range<usize>]) -> f64 {
    let mut moving = usable.to_vec();
    rests.iter().for_each(|rest| moving[rest.clone()].fill(false));
    let rows = || (0..values.len()).filter(|row| moving[*row]);
    let count = rows().count().max(1);
    rows().filter(|row| repeats(values, *row)).count() as f64 / count as f64
}

/// The usable rows without those that repeat the row before.
pub fn once(values: &[Vector3<f64>], usable: &[bool]) -> Vec<bool> {
    (0..values.len()).map(|row| usable[row] && !repeats(values, row)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_samples_held_for_three_rows_two_thirds_repeat_in_motion() {
        let values: Vec<_> = (0..300).map(|row| Vector3::repeat(f64::from(row / 3))).collect();
        let usable = [true; 300];
        assert!((share(&values, &usable, &[]) - 2.0 / 3.0).abs() < 1e-12);
        assert_eq!(once(&values, &usable).iter().filter(|row| **row).count(), 100);
        // At rest a value may repeat.
        let still: Vec<_> = (0..300).map(|row| Vector3::repeat(f64::from(row.max(200)))).collect();
        assert_eq!(share(&still, &usable, std::slice::from_ref(&(0..202))), 0.0);
    }
}
