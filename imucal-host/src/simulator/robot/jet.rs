//! A quantity with its first two derivatives by time, and arithmetic that keeps them exact: forward-mode differentiation.
//!
//! ```text
//! (f g)'' = f'' g + 2 f' g' + f g''        h(f)'' = h'(f) f'' + h''(f) f'²
//! ```

use std::ops::{Add, Mul, Neg, Sub};

use crate::effect::Swing;

/// A quantity at an instant and how it changes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Jet {
    /// The quantity.
    pub value: f64,
    /// Its first derivative, per s.
    pub first: f64,
    /// Its second derivative, per s².
    pub second: f64,
}

impl Jet {
    /// One that does not change.
    pub const fn constant(value: f64) -> Self {
        Self { value, first: 0.0, second: 0.0 }
    }

    /// Time itself, s.
    pub const fn time(time: f64) -> Self {
        Self { value: time, first: 1.0, second: 0.0 }
    }

    /// A function of it, from the function and its first two derivatives there.
    #[must_use]
    pub fn through(self, value: f64, first: f64, second: f64) -> Self {
        Self {
            value,
            first: first * self.first,
            second: first * self.second + second * self.first * self.first,
        }
    }

    /// Sine and cosine.
    pub fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = libm::sincos(self.value);
        (self.through(sin, cos, -sin), self.through(cos, -sin, -cos))
    }

    /// Sine.
    #[must_use]
    pub fn sin(self) -> Self {
        self.sin_cos().0
    }

    /// Cosine.
    #[must_use]
    pub fn cos(self) -> Self {
        self.sin_cos().1
    }

    /// Inverse tangent.
    #[must_use]
    pub fn atan(self) -> Self {
        let slope = 1.0 / (1.0 + self.value * self.value);
        self.through(libm::atan(self.value), slope, -2.0 * self.value * slope * slope)
    }

    /// One over it.
    #[must_use]
    pub fn inverse(self) -> Self {
        let one_over = 1.0 / self.value;
        let square = one_over * one_over;
        self.through(one_over, -square, 2.0 * square * one_over)
    }

    /// Its square.
    #[must_use]
    pub fn square(self) -> Self {
        self.through(self.value * self.value, 2.0 * self.value, 2.0)
    }

    /// 0 to 1 while it goes from 0 to 1, with three vanishing derivatives at both ends.
    #[must_use]
    pub fn step(self) -> Self {
        let u = self.value.clamp(0.0, 1.0);
        let v = 1.0 - u;
        let value = u * u * u * u * (35.0 + u * (-84.0 + u * (70.0 - 20.0 * u)));
        let uv = u * v;
        self.through(value, 140.0 * uv * uv * uv, 420.0 * uv * uv * (v - u))
    }

    /// Derivative of [`Self::step`] by it, with its own derivatives.
    #[must_use]
    pub fn step_slope(self) -> Self {
        let u = self.value.clamp(0.0, 1.0);
        let v = 1.0 - u;
        let uv = u * v;
        let second = 840.0 * uv * ((v - u) * (v - u) - uv);
        self.through(140.0 * uv * uv * uv, 420.0 * uv * uv * (v - u), second)
    }

    /// 1 at 0 and 0 from −1 down and from 1 up, smooth: (1 − u²)⁵.
    #[must_use]
    pub fn pulse(self) -> Self {
        let u = self.value;
        let w = (1.0 - u * u).max(0.0);
        let w3 = w * w * w;
        self.through(w3 * w * w, -10.0 * u * w3 * w, 10.0 * w3 * (9.0 * u * u - 1.0))
    }

    /// As an angle.
    pub fn swing(self) -> Swing {
        Swing { angle: self.value, rate: self.first, acceleration: self.second }
    }
}

impl Add for Jet {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            first: self.first + other.first,
            second: self.second + other.second,
        }
    }
}

impl Sub for Jet {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Neg for Jet {
    type Output = Self;

    fn neg(self) -> Self {
        self * -1.0
    }
}

impl Mul<f64> for Jet {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        Self { value: self.value * factor, first: self.first * factor, second: self.second * factor }
    }
}

impl Add<f64> for Jet {
    type Output = Self;

    fn add(self, offset: f64) -> Self {
        Self { value: self.value + offset, ..self }
    }
}

impl Mul for Jet {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            first: self.first * other.value + self.value * other.first,
            second: self.second * other.value + 2.0 * self.first * other.first + self.value * other.second,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_those_of_the_value() {
        let h = 1e-4;
        let functions: [fn(f64) -> Jet; 8] = [
            |t| Jet::time(t).sin() * Jet::time(t).square().cos(),
            |t| (Jet::time(t) * 3.0).atan() - Jet::time(t),
            |t| (Jet::time(t) + 1.5).inverse(),
            |t| Jet::time(t).step(),
            |t| Jet::time(t).step_slope(),
            |t| Jet::time(t).pulse(),
            |t| (Jet::time(t) * Jet::time(t).sin()).step(),
            |t| -(Jet::time(t) * 0.5 + -0.2).pulse().square(),
        ];
        for (which, of) in functions.iter().enumerate() {
            for k in 0..60 {
                let t = -0.2 + 0.023 * f64::from(k);
                let (before, here, after) = (of(t - h), of(t), of(t + h));
                let first = (after.value - before.value) / (2.0 * h);
                let second = (after.first - before.first) / (2.0 * h);
                assert!((first - here.first).abs() < 1e-5, "{which} at {t}: {first} {here:?}");
                assert!((second - here.second).abs() < 1e-3, "{which} at {t}: {second} {here:?}");
            }
        }
    }
}
