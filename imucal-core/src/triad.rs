//! The affine triad: what a calibration is once it has been fitted.
//!
//! ```text
//! calibrated = gain · (raw − bias)          correct, on the device
//! raw        = gain⁻¹ · calibrated + bias   predict, in the simulator
//! ```
//!
//! | symbol | meaning | paper |
//! | --- | --- | --- |
//! | `gain` | 3×3, calibrated unit per raw unit: inverse of scale, non-orthogonality and mounting | K⁻¹ |
//! | `bias` | raw output at zero input, raw unit | b |
//!
//! Source: Secer & Barshan 2016, eq. (1) with h affine; the split of K is a reconstruction, since only the
//! paper's first two pages were at hand. Not modelled: saturation, bandwidth; what is not affine in the input is
//! [`crate::nonlinearity`], and temperature [`crate::temperature`].

use nalgebra::{Matrix3, Vector3};

use crate::scalar::Scalar;

/// An affine calibration of three axes, raw unit in, calibrated unit out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triad<T: Scalar> {
    /// Calibrated unit per raw unit, row by output axis. Upper triangular where the frame is the sensor's own.
    pub gain: Matrix3<T>,
    /// Raw output at zero input, raw unit.
    pub bias: Vector3<T>,
}

impl<T: Scalar> Triad<T> {
    /// Changes nothing: unit gain, no bias.
    pub fn identity() -> Self {
        Self { gain: Matrix3::identity(), bias: Vector3::zeros() }
    }

    /// `gain · (raw − bias)`: a raw sample, sensor axes and raw unit, to calibrated axes and unit.
    #[inline]
    pub fn correct(&self, raw: &Vector3<T>) -> Vector3<T> {
        self.scaled(raw.x - self.bias.x, raw.y - self.bias.y, raw.z - self.bias.z)
    }

    /// `gain · (x, y, z)`.
    #[inline]
    pub(crate) fn scaled(&self, x: T, y: T, z: T) -> Vector3<T> {
        // By components: nalgebra's product is the same arithmetic in the same order, but at the device's
        // `opt-level = "s"` it stays a loop, several times as long as the count `tests/firmware_link.rs` asserts.
        let m = &self.gain;
        Vector3::new(
            m.m11 * x + m.m12 * y + m.m13 * z,
            m.m21 * x + m.m22 * y + m.m23 * z,
            m.m31 * x + m.m32 * y + m.m33 * z,
        )
    }

    /// `gain⁻¹ · calibrated + bias`: what the sensor would put out; `None` where the gain is singular.
    pub fn predict(&self, calibrated: &Vector3<T>) -> Option<Vector3<T>> {
        Some(self.sensitivity()? * calibrated + self.bias)
    }

    /// K, raw unit per calibrated unit: the inverse of the gain; `None` where that is singular.
    pub fn sensitivity(&self) -> Option<Matrix3<T>> {
        self.gain.try_inverse()
    }

    /// The same triad for raw values of another affine unit, `raw = offset + per_unit · raw'`.
    ///
    /// `self` takes `raw'`, the result takes `raw`. `per_unit` must not be zero.
    pub fn in_unit(&self, offset: T, per_unit: T) -> Self {
        Self { gain: self.gain / per_unit, bias: self.bias * per_unit + Vector3::repeat(offset) }
    }

    /// The columns of the gain are dependent, as far as `T` can show: different raw samples look alike.
    ///
    /// The determinant is taken of columns scaled to a largest entry of one, so that the unit does not matter.
    pub fn is_singular(&self) -> bool {
        let [a, b, c] = <[[T; 3]; 3]>::from(self.gain).map(|[x, y, z]| {
            let larger = |a: T, b: T| if a.abs() > b.abs() { a } else { b };
            let largest = larger(larger(x, y), z);
            Vector3::new(x / largest, y / largest, z / largest)
        });
        let determinant =
            a.x * (b.y * c.z - b.z * c.y) + a.y * (b.z * c.x - b.x * c.z) + a.z * (b.x * c.y - b.y * c.x);
        // Below 64 ε the determinant is rounding error. A zero column makes it NaN, which is singular as well.
        let independent = determinant.abs() > T::EPSILON * T::of(64.0);
        !independent
    }

    /// Every entry is finite.
    pub fn is_finite(&self) -> bool {
        self.gain.iter().chain(self.bias.iter()).all(|x| x.finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    prop_compose! {
        /// A triad as sensors have them: axes within 20 % of nominal, skew below 6°, bias below one full scale.
        fn triad()(scale in prop::array::uniform3(0.8f64..1.2), skew in prop::array::uniform6(-0.1f64..0.1),
                   bias in prop::array::uniform3(-50.0f64..50.0)) -> Triad<f64> {
            Triad {
                gain: Matrix3::new(scale[0], skew[0], skew[1], skew[2], scale[1], skew[3], skew[4], skew[5], scale[2]),
                bias: Vector3::from(bias),
            }
        }
    }

    proptest! {
        #[test]
        fn correct_undoes_predict_over_the_valid_range(t in triad(), x in prop::array::uniform3(-100.0f64..100.0)) {
            let x = Vector3::from(x);
            let raw = t.predict(&x).unwrap();
            prop_assert!((t.correct(&raw) - x).norm() < 1e-11 * (1.0 + x.norm()));
        }

        #[test]
        fn correct_rounds_as_the_matrix_product_does(t in triad(), raw in prop::array::uniform3(-100.0f64..100.0)) {
            let raw = Vector3::from(raw);
            prop_assert_eq!(t.correct(&raw), t.gain * (raw - t.bias));
        }

        #[test]
        fn a_change_of_unit_changes_no_calibrated_value(t in triad(), x in prop::array::uniform3(-100.0f64..100.0),
                offset in -4e4f64..4e4, per_unit in 1.0f64..5e3) {
            let x = Vector3::from(x);
            let counts = x * per_unit + Vector3::repeat(offset);
            let (a, b) = (t.correct(&x), t.in_unit(offset, per_unit).correct(&counts));
            prop_assert!((a - b).norm() < 1e-9 * (1.0 + a.norm()));
        }
    }

    #[test]
    fn singular_is_a_matter_of_direction_and_not_of_unit() {
        let with = |gain: Matrix3<f32>| Triad { gain, bias: Vector3::zeros() };
        for unit in [1e-20, 1.0, 1e15] {
            assert!(!with(Matrix3::new(1.0, 0.1, 0.1, 0.0, 1.0, 0.1, 0.0, 0.0, 1.0) * unit).is_singular());
            assert!(with(Matrix3::new(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0) * unit).is_singular());
            assert!(with(Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0) * unit).is_singular());
        }
    }

    #[test]
    fn a_singular_gain_has_no_prediction() {
        let t = Triad { gain: Matrix3::<f32>::zeros(), bias: Vector3::zeros() };
        assert!(t.predict(&Vector3::x()).is_none());
    }
}
