//! A tremble without pattern that depends on the time alone: what a reference's noise does to the truth.

use nalgebra::Vector3;

/// Three independent numbers of mean zero and variance one at a time, s; the same at the same time.
pub(super) fn tremble(time: f64) -> Vector3<f64> {
    let mut state = time.to_bits();
    Vector3::from_fn(|_, _| {
        // The sum of four uniform numbers has a variance of a third.
        let sum: f64 = (0..4).map(|_| uniform(&mut state)).sum();
        (sum - 2.0) * 3.0f64.sqrt()
    })
}

/// From 0 to 1; splitmix64.
fn uniform(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mixed = (*state ^ (*state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_has_no_mean_a_variance_of_one_and_no_memory() {
        let rows: Vec<Vector3<f64>> = (0..20_000).map(|k| tremble(0.01 * f64::from(k))).collect();
        for axis in 0..3 {
            let mean = rows.iter().map(|row| row[axis]).sum::<f64>() / 20_000.0;
            let square = rows.iter().map(|row| row[axis].powi(2)).sum::<f64>() / 20_000.0;
            let next = rows.windows(2).map(|pair| pair[0][axis] * pair[1][axis]).sum::<f64>() / 20_000.0;
            assert!(
                mean.abs() < 0.03 && (square - 1.0).abs() < 0.05 && next.abs() < 0.03,
                "{mean} {square} {next}"
            );
        }
    }
}
