//! Equivalence: what the device computes in `f32` against a floating-point reference in `f64`.
//!
//! Two questions, sensor by sensor: does the core correct samples alike, and does it fit the same parameters from
//! the same observations? The reference shares no code with the core's models. [`board`] asks a third one of a real or
//! emulated device: does it compute the bits that the core computes here?

pub mod board;
pub mod fit_equivalence;
pub mod fits;
mod known_attitudes;
pub mod reference;
pub mod rounding;
pub mod samples;

pub use fit_equivalence::{FitEquivalence, ParameterDifference};
pub use samples::SampleEquivalence;

/// Distance from `a` to `b` in units of the last place of `b` as `f32`.
pub fn ulp(a: f64, b: f64) -> f64 {
    let near = (b as f32).abs().max(f32::MIN_POSITIVE);
    let spacing = f64::from(near.next_up()) - f64::from(near);
    (a - b).abs() / spacing
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_one_ulp_apart() {
        let x = 1.5f32;
        assert_eq!(ulp(f64::from(x.next_up()), f64::from(x)), 1.0);
        assert_eq!(ulp(2.0, 2.0), 0.0);
    }
}
