//! How far `f32` may carry a corrected sample from its exact value: a running error analysis of the corrector.
//!
//! A step of the corrector rounds once, to the nearest number: `|fl(a ∘ b) − a ∘ b| ≤ h(a ∘ b)`, with `h(x)` half of
//! the spacing of `f32` at `x`. What enters a step with an error takes it along, so that for values known to `e_a`
//! and `e_b`
//!
//! ```text
//! sum, difference   e = e_a + e_b + h
//! product           e = |a| e_b + |b| e_a + e_a e_b + h
//! ```
//!
//! and h is taken at the largest magnitude that the result may have. Through the corrector, for one sample x with its
//! temperature θ, axis by axis and in the order of [`imucal_core::temperature`] and [`imucal_core::triad`]:
//!
//! | step | error of the step, with those above put in |
//! | --- | --- |
//! | Δ = θ − θ₀ | h(Δ) |
//! | b′ = b + βΔ | \|β\| e_Δ + h(βΔ) + h(b′) |
//! | d = x − b′ | e_b′ + h(d) |
//! | y = (g₁d₁ + g₂d₂) + g₃d₃ | Σ (\|g_j\| e_d,j + h(g_j d_j)) + h(first sum) + h(y) |
//! | f = 1 + sΔ | \|s\| e_Δ + h(sΔ) + h(f) |
//! | z = y f | \|f\| e_y + \|y\| e_f + e_y e_f + h(z) |
//!
//! Terms of temperature to second order add γ(ΔΔ) to b′ and to f. Nonlinear terms take d to the x of as many rounds
//! `x ← d − (axial(x) + cross(x))` as the core takes, each step rounded as above; holding x to the range rounds nothing.
//! Without terms of temperature it ends at y, with b′ = b. Sample, temperature and figures are taken as the `f32` that
//! the device holds. What their conversion has cost before is h of each, and is no part of this bound: a sample in
//! counts is exact, and a record's figures are compared one by one (`samples`).
//!
//! Of a diagonal gain that is 4 roundings at the most, 2.4e-7 of the value; of full scale, or of the largest sample,
//! nothing is said. Source: Wilkinson 1986 (*Error analysis revisited*); Higham 2002, *Accuracy and Stability of
//! Numerical Algorithms*, 3.3. The exact values are those of `f64`, whose own rounding is 2⁻²⁹ of this.

use imucal_core::nonlinearity::Linearizer;

use crate::store::{StoredNonlinearity, StoredTriad};

/// An exact value, and how far the device's may be from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounded {
    /// Without any rounding of `f32`.
    pub value: f64,
    /// Largest distance from it, same unit.
    pub error: f64,
}

/// Half of the spacing of `f32` at a magnitude: the largest error of a rounding to the nearest.
fn half_spacing(magnitude: f64) -> f64 {
    let near = (magnitude.abs() as f32).max(f32::MIN_POSITIVE);
    0.5 * (f64::from(near.next_up()) - f64::from(near))
}

impl Bounded {
    /// A number that `f32` holds as it is.
    fn exact(value: f64) -> Self {
        Self { value, error: 0.0 }
    }

    /// The result of a step, with the rounding of the step itself.
    fn rounded(value: f64, carried: f64) -> Self {
        Self { value, error: carried + half_spacing(value.abs() + carried) }
    }

    fn plus(self, other: Self) -> Self {
        Self::rounded(self.value + other.value, self.error + other.error)
    }

    fn minus(self, other: Self) -> Self {
        Self::rounded(self.value - other.value, self.error + other.error)
    }

    fn times(self, other: Self) -> Self {
        let carried =
            self.value.abs() * other.error + other.value.abs() * self.error + self.error * other.error;
        Self::rounded(self.value * other.value, carried)
    }
}

/// A corrected sample and its bounds, axis by axis, of figures that `f32` holds: `raw` in the calibration's unit, its
/// temperature in °C.
///
/// As on the device, a temperature that is not finite counts as the reference, and where the calibration has no terms
/// of temperature none is looked at. Of nonlinear terms the value is that of the device's rounds without rounding.
pub fn correct(figures: &StoredTriad, raw: [f64; 3], temperature: f64) -> [Bounded; 3] {
    let [x, y, z] = raw.map(Bounded::exact);
    let sensed = |bias: [Bounded; 3]| {
        let output = [x.minus(bias[0]), y.minus(bias[1]), z.minus(bias[2])];
        figures.nonlinearity.map_or(output, |terms| sense(&terms, output))
    };
    let Some(terms) = &figures.temperature else {
        return product(&figures.gain, sensed(figures.bias.map(Bounded::exact)));
    };
    let change = if temperature.is_finite() {
        Bounded::exact(temperature).minus(Bounded::exact(terms.reference))
    } else {
        Bounded::exact(0.0)
    };
    let drifted = |at: [f64; 3], slope: [f64; 3], second: Option<[f64; 3]>| {
        [0, 1, 2].map(|axis| {
            let first = Bounded::exact(at[axis]).plus(Bounded::exact(slope[axis]).times(change));
            second.map_or(first, |of| first.plus(Bounded::exact(of[axis]).times(change.times(change))))
        })
    };
    let curvature = terms.curvature;
    let bias = drifted(figures.bias, terms.bias_slope, curvature.map(|second| second.bias));
    let corrected = product(&figures.gain, sensed(bias));
    let factor = drifted([1.0; 3], terms.scale_slope, curvature.map(|second| second.scale));
    [0, 1, 2].map(|axis| corrected[axis].times(factor[axis]))
}

/// `gain · x`.
fn product(gain: &[[f64; 3]; 3], [x, y, z]: [Bounded; 3]) -> [Bounded; 3] {
    gain.map(|row| {
        let [a, b, c] = row.map(Bounded::exact);
        a.times(x).plus(b.times(y)).plus(c.times(z))
    })
}

/// The rounds of [`imucal_core::nonlinearity::Linearizer::sense`]; not a number where the core refuses the terms.
fn sense(terms: &StoredNonlinearity, output: [Bounded; 3]) -> [Bounded; 3] {
    let Ok(core) = Linearizer::new(terms.nonlinearity()) else {
        return [Bounded::exact(f64::NAN); 3];
    };
    let crossed = terms.cross.as_flattened().iter().any(|entry| *entry != 0.0);
    let mut x = output;
    for _ in 0..core.rounds() {
        // Holding to the range takes two numbers no further apart.
        let held =
            x.map(|axis| Bounded { value: axis.value.clamp(-terms.range, terms.range), error: axis.error });
        let [u, v, w] = held;
        let (uv, vw, wu) = (u.times(v), v.times(w), w.times(u));
        x = [0, 1, 2].map(|axis| {
            let square = held[axis].times(held[axis]);
            let two = Bounded::exact(terms.quadratic[axis]).times(square);
            let three = Bounded::exact(terms.cubic[axis]).times(held[axis].times(square));
            let axial = two.plus(three);
            let [a, b, c] = terms.cross[axis].map(Bounded::exact);
            let excess = match crossed {
                true => axial.plus(a.times(uv).plus(b.times(vw)).plus(c.times(wu))),
                false => axial,
            };
            output[axis].minus(excess)
        });
    }
    x
}

#[cfg(test)]
mod tests {
    use imucal_core::{
        corrector::{Corrector, FullCorrector},
        nonlinearity::{NonlinearTerms, Nonlinearity, TOLERANCE},
        temperature::{TemperatureCurvature, TemperatureTerms},
        triad::Triad,
    };
    use nalgebra::{Matrix3, Vector3};
    use proptest::{
        array::{uniform3, uniform9},
        prelude::*,
    };

    use super::*;
    use crate::{
        equivalence::reference,
        recording::Unit,
        store::{StoredCurvature, StoredTemperature},
    };

    fn figures(gain: [[f64; 3]; 3], bias: [f64; 3], temperature: Option<StoredTemperature>) -> StoredTriad {
        StoredTriad {
            model: "T9".into(),
            unit_in: Unit::Counts,
            unit_out: Unit::MetrePerSecondSquared,
            gain,
            bias,
            gain_std: [[0.0; 3]; 3],
            bias_std: [0.0; 3],
            rms: 0.0,
            held_out_rms: None,
            observations: 12,
            parameters: 9,
            condition: 1.0,
            coverage: 1.0,
            field_norm: None,
            provenance: None,
            nonlinearity: None,
            temperature,
        }
    }

    #[test]
    fn a_spacing_is_that_of_the_binade_and_never_none() {
        let unit = f64::from(f32::EPSILON);
        assert_eq!(half_spacing(1.0), 0.5 * unit);
        assert_eq!(half_spacing(-1.999), 0.5 * unit);
        assert_eq!(half_spacing(2.0), unit);
        assert_eq!(half_spacing(0.0), 2f64.powi(-150));
    }

    /// By hand: 3 is exact, each other step of one axis rounds once at the spacing of its result.
    #[test]
    fn one_axis_has_four_roundings_without_warmth_and_ten_with_it() {
        let gain = [[2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let u = 0.5 * f64::from(f32::EPSILON);
        let tiny = 1e-40;
        let [x, ..] = correct(&figures(gain, [1.0, 0.0, 0.0], None), [4.0, 0.0, 0.0], 50.0);
        // d = 3 (spacing of 2), doubled; 6, and two sums of it (spacing of 4).
        assert_eq!(x.value, 6.0);
        assert!((x.error - (2.0 * 2.0 * u + 3.0 * 4.0 * u)).abs() < tiny, "{x:?}");
        let terms = StoredTemperature {
            reference: 20.0,
            bias_slope: [0.25, 0.0, 0.0],
            scale_slope: [0.5, 0.0, 0.0],
            quality: None,
            curvature: None,
        };
        let [x, ..] = correct(&figures(gain, [1.0, 0.0, 0.0], Some(terms)), [4.5, 0.0, 0.0], 22.0);
        // Δ = 2: 2u. βΔ = 0.5: 0.25·2u + 0.5u. b' = 1.5: + 1u. d = 3: + 2u. y: 2e_d + 3·4u. sΔ = 1, f = 2, z = 12.
        let bias = (0.25 * 2.0 + 0.5 + 1.0) * u;
        let value = 2.0 * (bias + 2.0 * u) + 12.0 * u;
        let factor = (0.5 * 2.0 + 1.0 + 2.0) * u;
        let expected = 2.0 * value + 6.0 * factor + value * factor + 8.0 * u;
        assert_eq!(x.value, 12.0);
        assert!((x.error / expected - 1.0).abs() < 1e-12, "{x:?} {expected:e}");
    }

    proptest! {
        #[test]
        fn no_rounding_of_the_core_goes_beyond_the_bound(
            raw in uniform3(-4e4f32..4e4), gain in uniform9(-2f32..2.0), bias in uniform3(-4e4f32..4e4),
            reference in 0f32..50.0, bias_slope in uniform3(-9f32..9.0), scale_slope in uniform3(-0.01f32..0.01),
            temperature in prop::option::of(-40f32..85.0), with in any::<bool>(),
        ) {
            let triad = Triad { gain: Matrix3::from_row_slice(&gain), bias: Vector3::from(bias) };
            let terms = with.then_some(TemperatureTerms { reference, bias_slope, scale_slope });
            let temperature = temperature.unwrap_or(f32::NAN);
            let device = Corrector::new(triad, terms).apply_at(&Vector3::from(raw), temperature);
            let wide = terms.map(|t| StoredTemperature {
                reference: t.reference.into(),
                bias_slope: t.bias_slope.map(f64::from),
                scale_slope: t.scale_slope.map(f64::from),
                quality: None,
                curvature: None,
            });
            let rows = [0, 3, 6].map(|from| [0, 1, 2].map(|column| f64::from(gain[from + column])));
            let bounds = correct(
                &figures(rows, bias.map(f64::from), wide),
                raw.map(f64::from),
                temperature.into(),
            );
            for (device, bound) in device.iter().zip(bounds) {
                prop_assert!((f64::from(*device) - bound.value).abs() <= bound.error * (1.0 + 1e-6), "{device} {bound:?}");
            }
        }

        #[test]
        fn no_rounding_of_the_full_corrector_goes_beyond_the_bound(
            raw in uniform3(-6e4f32..6e4), bias in uniform3(-3e3f32..3e3), second in uniform3(-0.2f32..0.2),
            growth in uniform3(-1e-5f32..1e-5), quadratic in uniform3(-0.019f32..0.019),
            cubic in uniform3(-0.019f32..0.019), cross in uniform3(uniform3(-0.019f32..0.019)),
            temperature in -40f32..85.0, crossed in any::<bool>(),
        ) {
            const RANGE: f32 = 32_768.0;
            let share = |x: f32| x / (2.0 * RANGE);
            let cross = if crossed { cross.map(|row| row.map(share)) } else { [[0.0; 3]; 3] };
            let terms = NonlinearTerms {
                quadratic: quadratic.map(share), cubic: cubic.map(|x| x / (3.0 * RANGE * RANGE)), cross,
            };
            let first = TemperatureTerms { reference: 20.0, bias_slope: [3.0; 3], scale_slope: [1e-4; 3] };
            let gain = Matrix3::new(2.5e-3, 1e-5, -2e-5, 3e-5, 2.4e-3, 1e-5, -1e-5, 2e-5, 2.6e-3);
            let triad = Triad { gain, bias: Vector3::from(bias) };
            let curvature = TemperatureCurvature { bias: second, scale: growth };
            let device = FullCorrector::new(
                Corrector::new(triad, Some(first)), Some(curvature), Some(Nonlinearity { terms, range: RANGE }),
            ).expect("gentle terms").apply_at(&Vector3::from(raw), temperature);
            let none = [0.0; 3];
            let temperatures = StoredTemperature {
                reference: 20.0,
                bias_slope: [3.0; 3],
                scale_slope: first.scale_slope.map(f64::from),
                quality: None,
                curvature: Some(StoredCurvature {
                    bias: second.map(f64::from), scale: growth.map(f64::from), bias_std: none, scale_std: none,
                }),
            };
            let rows = [0, 1, 2].map(|row| [0, 1, 2].map(|column| f64::from(gain[(row, column)])));
            let stored = StoredTriad {
                nonlinearity: Some(StoredNonlinearity {
                    range: RANGE.into(),
                    quadratic: terms.quadratic.map(f64::from),
                    cubic: terms.cubic.map(f64::from),
                    cross: terms.cross.map(|row| row.map(f64::from)),
                    quadratic_std: none, cubic_std: none, cross_std: [none; 3],
                }),
                ..figures(rows, bias.map(f64::from), Some(temperatures))
            };
            let bounds = correct(&stored, raw.map(f64::from), temperature.into());
            let reference = reference::correct_at(&stored, raw.map(f64::from), temperature.into());
            for ((device, bound), reference) in device.iter().zip(bounds).zip(reference) {
                let off = (f64::from(*device) - bound.value).abs();
                prop_assert!(off <= bound.error * (1.0 + 1e-6), "{device} {bound:?}");
                prop_assert!(bound.error < 2e-4, "{bound:?}");
                // What the rounds leave, by the core's own statement.
                let left = TOLERANCE * f64::from(RANGE) * 2.7e-3 * 1.1;
                prop_assert!((bound.value - reference).abs() <= left, "{bound:?} {reference}");
            }
        }
    }
}
