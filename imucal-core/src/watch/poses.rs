//! Poses that agree with the record after a shift: whether they prove that it is over.
//!
//! ```text
//! b · d_i = 0,  i = 1 … 3,   |d_1 · (d_2 × d_3)| ≥ ½   ⇒   b = 0
//! ```
//!
//! A constant b that a triad has taken on shows in a pose as its part along d, the direction in which the statistic reads the triad:
//! across d it is not seen. One pose that agrees proves nothing, therefore, nor do several about one axis. Three whose directions span
//! all axes do.
//!
//! Not modelled: gains that moved, which could vanish in three directions and be there in others.

use nalgebra::Vector3;

/// |d_1 × d_2| of two directions, and the triple product of three, that count as spanning.
const SPANS: [f32; 2] = [core::f32::consts::FRAC_1_SQRT_2, 0.5];

/// Directions of poses in a row that agree with the record.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Agreement {
    first: Option<Vector3<f32>>,
    second: Option<Vector3<f32>>,
}

impl Agreement {
    /// A pose agrees; true once the poses span all axes.
    pub(super) fn push(&mut self, direction: &Vector3<f32>) -> bool {
        let first = *self.first.get_or_insert(*direction);
        let [plane, space] = SPANS;
        let Some(second) = self.second else {
            let across = first.cross(direction);
            self.second = (across.dot(&across) >= plane * plane).then_some(*direction);
            return false;
        };
        first.cross(&second).dot(direction).abs() >= space
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_directions_that_span_all_axes_prove_it_and_any_number_about_one_axis_does_not() {
        let mut agreement = Agreement::default();
        for step in 0..50_u8 {
            let (sin, cos) = libm::sincosf(f32::from(step));
            let tilted = Vector3::new(cos, sin, 0.2).normalize();
            assert!(!agreement.push(&tilted), "{step}");
        }
        assert!(agreement.push(&-Vector3::z()));
    }
}
