//! Where a triad's output bends: quadratic and cubic terms of each axis, and products of two axes.
//!
//! ```text
//! n(x)   = q ∘ x² + c ∘ x³ + P · (x_x x_y, x_y x_z, x_z x_x)       x held to ±range, axis by axis
//! output = x + n(x)                                               respond, in the simulator
//! x      = output − n(x), by a few rounds from x = output          sense, on the device
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | x | what each axis senses: `gain⁻¹ · calibrated`, raw unit, sensor axes, without bias |
//! | output | what it puts out, without bias |
//! | q, c | [`quadratic`](NonlinearTerms::quadratic), [`cubic`](NonlinearTerms::cubic) |
//! | P | [`cross`](NonlinearTerms::cross) |
//!
//! Beyond the range that the terms were found in, n keeps its value at the edge: a polynomial says nothing there, and
//! grows without bound.
//!
//! # The inverse
//!
//! With L = max over the rows of `2|q| r + 3|c| r² + 2(|P₁| + |P₂| + |P₃|) r`, r the range, n has no slope steeper than
//! L in the largest component, anywhere, since holding x to the range shortens no distance to more than it was. For
//! L < 1 there is one x for each output, and a round takes the error to L times what it was. The first error is
//! n(x), at most L/2 of the range, so that k rounds leave `L^(k+1)/2` of the range. [`Linearizer`] takes as many rounds
//! as bring that below [`TOLERANCE`] of the range, and refuses terms with L above [`STEEPEST`]. The rounding of the
//! arithmetic comes on top.
//!
//! Source: the second- and third-order terms and the cross-product terms of the accelerometer's model equation in IEEE
//! Std 1293; the fixed point is Banach's. Not modelled: another scale for each sign, hysteresis, terms of the fourth
//! order, cubic terms across axes (x² y), and a dependence of the terms on temperature.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::scalar::Scalar;

/// Steepest slope of n that is taken, of raw unit a raw unit. Sensors are linear to 1 % of their range and better.
pub const STEEPEST: f64 = 0.1;
/// What the inverse may miss, of the range: half a unit in the last place of `f32`.
pub const TOLERANCE: f64 = 1.0 / 16_777_216.0;
/// Rounds that terms of slope [`STEEPEST`] take.
const MOST_ROUNDS: u8 = 6;

/// Coefficients of a triad's nonlinear terms, or their standard errors. Plain arrays, since a record stores them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct NonlinearTerms<T> {
    /// q, per raw unit, one a sensor axis.
    pub quadratic: [T; 3],
    /// c, per raw unit².
    pub cubic: [T; 3],
    /// P, per raw unit: one row a sensor axis; its columns multiply xy, yz, zx.
    pub cross: [[T; 3]; 3],
}

impl<T: Scalar> NonlinearTerms<T> {
    /// A sensor that is linear.
    pub fn none() -> Self {
        let zero = [T::zero(); 3];
        Self { quadratic: zero, cubic: zero, cross: [zero; 3] }
    }

    /// A bound of the slope of n over ±`range`: L.
    pub fn slope(&self, range: T) -> T {
        let two = T::whole(2);
        let of_axis = |(quadratic, cubic): (T, T), [a, b, c]: [T; 3]| {
            let crossed = a.abs() + b.abs() + c.abs();
            (two * (quadratic.abs() + crossed) + T::whole(3) * cubic.abs() * range) * range
        };
        let ([p, q, r], [u, v, w], [i, j, k]) = (self.quadratic, self.cubic, self.cross);
        let larger = |a: T, b: T| if a > b || !a.finite() { a } else { b };
        larger(larger(of_axis((p, u), i), of_axis((q, v), j)), of_axis((r, w), k))
    }

    /// The same in another precision.
    pub fn cast<U: Scalar>(&self) -> NonlinearTerms<U> {
        let of = |x: T| U::of(x.wide());
        NonlinearTerms {
            quadratic: self.quadratic.map(of),
            cubic: self.cubic.map(of),
            cross: self.cross.map(|row| row.map(of)),
        }
    }
}

/// `q ∘ x²`.
#[inline]
pub fn quadratic<T: Scalar>([a, b, c]: &[T; 3], x: &Vector3<T>) -> Vector3<T> {
    Vector3::new(*a * (x.x * x.x), *b * (x.y * x.y), *c * (x.z * x.z))
}

/// `c ∘ x³`.
#[inline]
pub fn cubic<T: Scalar>([a, b, c]: &[T; 3], x: &Vector3<T>) -> Vector3<T> {
    Vector3::new(*a * (x.x * (x.x * x.x)), *b * (x.y * (x.y * x.y)), *c * (x.z * (x.z * x.z)))
}

/// `P · (xy, yz, zx)`.
#[inline]
pub fn cross<T: Scalar>([i, j, k]: &[[T; 3]; 3], x: &Vector3<T>) -> Vector3<T> {
    let (xy, yz, zx) = (x.x * x.y, x.y * x.z, x.z * x.x);
    let row = |[a, b, c]: &[T; 3]| *a * xy + *b * yz + *c * zx;
    Vector3::new(row(i), row(j), row(k))
}

/// The nonlinear terms of a triad and the range that they hold in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nonlinearity<T> {
    /// The coefficients.
    pub terms: NonlinearTerms<T>,
    /// Largest |x| of an axis that they hold for, raw unit; infinite where they hold everywhere.
    pub range: T,
}

impl<T: Scalar> Nonlinearity<T> {
    /// n(x), raw unit.
    #[inline]
    pub fn excess(&self, sensed: &Vector3<T>) -> Vector3<T> {
        let held = self.held(sensed);
        let (axial, crossed) = (self.axial(&held), cross(&self.terms.cross, &held));
        Vector3::new(axial.x + crossed.x, axial.y + crossed.y, axial.z + crossed.z)
    }

    /// What each axis adds by itself.
    #[inline]
    fn axial(&self, held: &Vector3<T>) -> Vector3<T> {
        let (two, three) = (quadratic(&self.terms.quadratic, held), cubic(&self.terms.cubic, held));
        Vector3::new(two.x + three.x, two.y + three.y, two.z + three.z)
    }

    /// `x + n(x)`: what the axes put out for what they sense, both without bias.
    #[inline]
    pub fn respond(&self, sensed: &Vector3<T>) -> Vector3<T> {
        let excess = self.excess(sensed);
        Vector3::new(sensed.x + excess.x, sensed.y + excess.y, sensed.z + excess.z)
    }

    /// The same in another precision.
    pub fn cast<U: Scalar>(&self) -> Nonlinearity<U> {
        Nonlinearity { terms: self.terms.cast(), range: U::of(self.range.wide()) }
    }

    #[inline]
    fn held(&self, x: &Vector3<T>) -> Vector3<T> {
        let (most, least) = (self.range, -self.range);
        let held = |x: T| {
            if x > most {
                most
            } else if x < least {
                least
            } else {
                x
            }
        };
        Vector3::new(held(x.x), held(x.y), held(x.z))
    }
}

/// Terms that nothing can undo: their slope over their range is above [`STEEPEST`], or not a number.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TooSteep {
    /// Their slope.
    pub slope: f32,
}

impl core::fmt::Display for TooSteep {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "the nonlinear terms reach a slope of {:.3}, expected at most {STEEPEST}", self.slope)
    }
}

impl core::error::Error for TooSteep {}

/// A nonlinearity that can be undone, and the rounds that it takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linearizer<T> {
    nonlinearity: Nonlinearity<T>,
    rounds: u8,
    /// A device pays for products of axes only where there are any.
    crossed: bool,
}

impl<T: Scalar> Linearizer<T> {
    /// Of terms over a finite range.
    ///
    /// # Errors
    ///
    /// [`TooSteep`].
    pub fn new(nonlinearity: Nonlinearity<T>) -> Result<Self, TooSteep> {
        let slope = nonlinearity.terms.slope(nonlinearity.range);
        // What passes in one precision passes in the other.
        let contracts = slope.finite() && slope <= T::of(STEEPEST * (1.0 + 1e-6));
        if !contracts {
            return Err(TooSteep { slope: slope.wide() as f32 });
        }
        let (mut left, mut rounds) = (slope / T::whole(2), 0);
        while left > T::of(TOLERANCE) && rounds < MOST_ROUNDS {
            left *= slope;
            rounds += 1;
        }
        let crossed = nonlinearity.terms.cross.as_flattened().iter().any(|entry| *entry != T::zero());
        Ok(Self { nonlinearity, rounds, crossed })
    }

    /// Rounds that a sample takes, 0 to 6: 3 for terms of 1 % slope.
    pub fn rounds(&self) -> u8 {
        self.rounds
    }

    /// What is undone.
    pub fn nonlinearity(&self) -> &Nonlinearity<T> {
        &self.nonlinearity
    }

    /// What the axes sense, of what they put out; both without bias, raw unit.
    #[inline]
    pub fn sense(&self, output: &Vector3<T>) -> Vector3<T> {
        let mut sensed = *output;
        for _ in 0..self.rounds {
            let excess = self.excess(&sensed);
            sensed = Vector3::new(output.x - excess.x, output.y - excess.y, output.z - excess.z);
        }
        sensed
    }

    #[inline]
    fn excess(&self, sensed: &Vector3<T>) -> Vector3<T> {
        match self.crossed {
            true => self.nonlinearity.excess(sensed),
            false => self.nonlinearity.axial(&self.nonlinearity.held(sensed)),
        }
    }
}

#[cfg(test)]
mod tests;
