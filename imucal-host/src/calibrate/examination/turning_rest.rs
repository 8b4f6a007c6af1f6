//! Rests that turn: what is taken for a rest is a slow turn.
//!
//! ```text
//! Δ₂ = m₂ − m₁ of a rest's halves,   Δ₄ = the same of the halves' own halves
//! E|Δ₂|² / E|Δ₄|² = ½ of white noise, 1 of 1/f noise, 4 of a turn
//! Δ′ = Δ − s ΔT,   s = Σ Δ₂ ΔT₂ / Σ ΔT₂²
//! ```
//!
//! s is by how much the accelerometer follows the temperature T while it rests: a unit that warms drifts within each rest, and Δ′ is
//! what is taken for a turn.
//!
//! A mean over an arc is shorter than its radius by |Δ₂|²/(6 r), which an accelerometer's gain takes up; and the rate,
//! 2 |Δ₂|/(r T) for a rest of duration T, is taken for the gyroscope's bias. Source: ours. Not seen: a turn about the
//! vertical. Not modelled: a drift with temperature that is not linear.

use nalgebra::Vector3;

use crate::calibrate::suspicion::{Follows, Suspicion};

/// Of halves over that of quarters from which it is no noise: half-way between 1/f noise and a turn, as a factor.
const TURNS: f64 = 2.0;
/// Standard errors by which a gain or a bias is wrong for it.
const MATERIAL: f64 = 1.0;

/// Differences of the accelerometer's means within rests, nominal m/s².
#[derive(Clone, Debug)]
pub struct Turning {
    /// Between halves.
    pub halves: Vec<Vector3<f64>>,
    /// Between the halves of halves.
    pub quarters: Vec<Vector3<f64>>,
    /// Mean duration of a rest, s.
    pub duration: f64,
    /// Gravity, m/s².
    pub gravity: f64,
}

fn mean_square(differences: &[Vector3<f64>]) -> f64 {
    differences.iter().map(Vector3::norm_squared).sum::<f64>() / differences.len() as f64
}

impl Turning {
    /// Without what follows the temperature, whose differences between halves and between quarters, K, are given.
    pub fn without_temperature(mut self, [halves, quarters]: [&[f64]; 2]) -> Self {
        let square: f64 = halves.iter().map(|of| of * of).sum();
        let along: Vector3<f64> = self.halves.iter().zip(halves).map(|(value, of)| value * *of).sum();
        let slope = along / square;
        if slope.iter().all(|x| x.is_finite()) {
            self.halves.iter_mut().zip(halves).for_each(|(value, of)| *value -= slope * *of);
            self.quarters.iter_mut().zip(quarters).for_each(|(value, of)| *value -= slope * *of);
        }
        self
    }

    /// The accelerometer's suspicion: by how much means are too short, against the standard error of its best gain.
    pub fn of_accelerometer(&self, gain_std: f64) -> Option<Suspicion> {
        let square = mean_square(&self.halves);
        let errors = square / (6.0 * self.gravity) / (self.gravity * gain_std);
        (errors.is_finite() && errors > MATERIAL).then(|| Suspicion {
            follows: Follows::Rate,
            detail: format!(
                "its rests turn: {:.1e} m/s² from their first to their second halves, which shortens their means by \
                 {errors:.1} standard errors of the gain",
                square.sqrt()
            ),
        })
    }

    /// The gyroscope's: the rate at which rests turn, against the standard error of its best bias, rad/s.
    pub fn of_gyroscope(&self, bias_std: f64) -> Option<Suspicion> {
        let (halves, quarters) = (mean_square(&self.halves), mean_square(&self.quarters));
        let rate = 2.0 * halves.sqrt() / (self.gravity * self.duration);
        let errors = rate / bias_std;
        (halves > TURNS * quarters && errors.is_finite() && errors > MATERIAL).then(|| Suspicion {
            follows: Follows::Rate,
            detail: format!(
                "its rests turn: by {:.2} °/s as gravity has it, {errors:.1} standard errors of the bias that is taken \
                 from them",
                rate.to_degrees()
            ),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turning(halves: f64, quarters: f64) -> Turning {
        let of = |size: f64| vec![Vector3::x() * size; 20];
        Turning { halves: of(halves), quarters: of(quarters), duration: 2.0, gravity: 10.0 }
    }

    #[test]
    fn a_turn_at_rest_is_named_with_its_rate_and_noise_is_not() {
        // Half of a turn is twice its quarter; 0.1 m/s² of 10 in one second, 0.01 rad/s.
        let found = turning(0.1, 0.05).of_gyroscope(1e-3).unwrap();
        assert!(found.detail.contains("0.57 °/s") && found.detail.contains("10.0"), "{found:?}");
        assert!(turning(0.1, 0.05).of_gyroscope(0.02).is_none());
        // 1/f noise has all halves alike.
        assert!(turning(0.1, 0.1).of_gyroscope(1e-3).is_none());
    }

    #[test]
    fn what_follows_the_temperature_is_no_turn_and_what_does_not_is() {
        let warming: Vec<f64> = (0..20).map(|k| 0.1 * f64::from(k % 3)).collect();
        let drift = |of: &[f64]| of.iter().map(|t| Vector3::new(0.2, -0.1, 0.3) * *t).collect::<Vec<_>>();
        let halved: Vec<f64> = warming.iter().map(|t| 0.5 * t).collect();
        let drifting = Turning { halves: drift(&warming), quarters: drift(&halved), ..turning(0.0, 0.0) };
        assert!(drifting.of_gyroscope(1e-3).is_some());
        assert!(drifting.without_temperature([&warming, &halved]).of_gyroscope(1e-9).is_none());
        // A turn whose axis changes from rest to rest, as poses do.
        let sign = |k: usize| if k.is_multiple_of(2) { 0.1 } else { -0.1 };
        let mut turned = turning(0.1, 0.05);
        turned.halves.iter_mut().enumerate().for_each(|(k, half)| half.x = sign(k));
        assert!(turned.without_temperature([&warming, &halved]).of_gyroscope(1e-3).is_some());
        // One temperature throughout says nothing.
        let still = turning(0.1, 0.05).without_temperature([&[0.0; 20], &[0.0; 20]]);
        assert!(still.of_gyroscope(1e-3).is_some());
    }

    #[test]
    fn an_arc_s_mean_is_short_by_a_sixth_of_the_square_over_its_radius() {
        // 1 m/s² of 10: 1/60 m/s², 1/600 of the gain.
        let at = |std: f64| turning(1.0, 0.5).of_accelerometer(std);
        assert!(at(0.99 / 600.0).is_some() && at(1.01 / 600.0).is_none());
    }
}
