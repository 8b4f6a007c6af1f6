//! Temperature of a unit in a room: air that warms and cools, a unit that follows late and heats itself.
//!
//! ```text
//! air:  A(t) = T₀ + a sin(2πt/P + φ)
//! unit: τ Ṫ = A + h − T,  T(0) = A(0)
//! T(t) = T₀ + h (1 − e) + a r sin(2πt/P + φ − δ) + a (sin φ − r sin(φ − δ)) e
//!        e = exp(−t/τ),  δ = atan(2πτ/P),  r = cos δ
//! ```

use std::f64::consts::TAU;

/// A course of temperature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Climate {
    /// T₀, °C.
    pub mean: f64,
    /// a, K.
    pub swing: f64,
    /// P, s.
    pub period: f64,
    /// φ, rad.
    pub phase: f64,
    /// τ, s.
    pub lag: f64,
    /// h, K.
    pub self_heating: f64,
}

impl Climate {
    /// Temperature of the unit, °C, at a time, s; before 0 as at 0.
    pub fn temperature(&self, time: f64) -> f64 {
        let time = time.max(0.0);
        let behind = libm::atan(TAU * self.lag / self.period);
        let share = libm::cos(behind);
        let fading = libm::exp(-time / self.lag);
        let late = self.phase - behind;
        self.mean
            + self.self_heating * (1.0 - fading)
            + self.swing * share * libm::sin(TAU * time / self.period + late)
            + self.swing * (libm::sin(self.phase) - share * libm::sin(late)) * fading
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLIMATE: Climate =
        Climate { mean: 24.0, swing: 6.0, period: 400.0, phase: 0.7, lag: 60.0, self_heating: 3.0 };

    #[test]
    fn the_unit_follows_the_air_with_its_lag() {
        let h = 1e-3;
        for k in 1..60 {
            let t = 10.0 * f64::from(k);
            let air = 24.0 + 6.0 * (TAU * t / 400.0 + 0.7).sin();
            let slope = (CLIMATE.temperature(t + h) - CLIMATE.temperature(t - h)) / (2.0 * h);
            assert!((60.0 * slope - (air + 3.0 - CLIMATE.temperature(t))).abs() < 1e-6, "{t}");
        }
        assert!((CLIMATE.temperature(0.0) - (24.0 + 6.0 * 0.7f64.sin())).abs() < 1e-12);
    }
}
