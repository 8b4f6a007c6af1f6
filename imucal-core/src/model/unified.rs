//! The unified model of a triad at known attitudes, on a rig or along a reference: one code path for accelerometer and magnetometer, and every rung of their
//! ladders.
//!
//! ```text
//! v = C_p_t T(α, β) e + C_o_t d_o + C_m_t d_m
//! y = K v
//! m = y + q∘y² + c∘y³ + x∘(y_y y_z, y_z y_x, y_x y_y) + b,      r = m − measured
//! ```
//!
//! | symbol | meaning | unit | paper |
//! | --- | --- | --- | --- |
//! | e | measured vector in n: (0, 0, −g) or Earth's field | SI | e^n |
//! | T(α, β) | n → p, the base's levelling tilt: e^p = (g sin β, −g cos β sin α, −g cos β cos α) for gravity | rad | C_n^p |
//! | d_o, d_m | constant vectors on the outer and middle gimbal: hard iron | SI | d_g |
//! | K | scale, non-orthogonality, packaging and mounting; for a magnetometer soft iron too | – | K |
//! | b | bias; for a magnetometer hard iron on the table too | SI | b |
//! | q, c, x | quadratic, cubic and cross-axis terms of what each axis senses | 1/SI, 1/SI², 1/SI | – |
//!
//! Source: models.md 1, 2 and 4; beyond eq. (1) of Secer & Barshan 2016 a reconstruction. What belongs to the machine
//! (α, β, d) is reported and never stored in a sensor's record. Not modelled: induced iron on gimbals, a field that
//! varies over the sensor's path, temperature, anything while the table moves.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::{
    Model, RowSink,
    parameterisation::{matrix_by_rows, select, vector},
    rig::{GimbalPose, Pose, PoseRotations},
};
use crate::{
    rotation::{product, sin_cos},
    scalar::Scalar,
};

/// Entries of the unified model.
pub const UNIFIED: usize = 32;

/// Every parameter of the unified model; those that are not estimated keep their value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnifiedParameters<T: Scalar> {
    /// K, by rows entries 0 to 8.
    pub sensitivity: Matrix3<T>,
    /// b, 9 to 11.
    pub bias: Vector3<T>,
    /// α, β: 12, 13, rad.
    pub tilt: [T; 2],
    /// e, 14 to 16.
    pub vector_n: Vector3<T>,
    /// d_o, 17 to 19.
    pub outer_source: Vector3<T>,
    /// d_m, 20 to 22.
    pub middle_source: Vector3<T>,
    /// q, 23 to 25.
    pub quadratic: Vector3<T>,
    /// c, 26 to 28.
    pub cubic: Vector3<T>,
    /// x, 29 to 31: of axis x the product of y and z, and so on round.
    pub cross_product: Vector3<T>,
}

impl<T: Scalar> UnifiedParameters<T> {
    /// A perfect triad that measures `vector_n`.
    pub fn nominal(vector_n: Vector3<T>) -> Self {
        let none = Vector3::zeros();
        Self {
            sensitivity: Matrix3::identity(),
            bias: none,
            tilt: [T::zero(); 2],
            vector_n,
            outer_source: none,
            middle_source: none,
            quadratic: none,
            cubic: none,
            cross_product: none,
        }
    }

    /// All entries in a row.
    pub fn to_vector(&self) -> SVector<T, UNIFIED> {
        let by_rows = self.sensitivity.transpose();
        let vectors = [
            &self.vector_n,
            &self.outer_source,
            &self.middle_source,
            &self.quadratic,
            &self.cubic,
            &self.cross_product,
        ];
        let first = [by_rows.as_slice(), self.bias.as_slice(), &self.tilt];
        let mut all = SVector::<T, UNIFIED>::zeros();
        let mut slots = all.iter_mut();
        for part in first.into_iter().chain(vectors.map(|vector| vector.as_slice())) {
            part.iter().zip(&mut slots).for_each(|(value, slot)| *slot = *value);
        }
        all
    }

    /// From all entries in a row.
    pub fn from_vector(all: &SVector<T, UNIFIED>) -> Self {
        let mut tilt = [T::zero(); 2];
        for (slot, value) in tilt.iter_mut().zip(all.iter().skip(12)) {
            *slot = *value;
        }
        Self {
            sensitivity: matrix_by_rows(all, 0),
            bias: vector(all, 9),
            tilt,
            vector_n: vector(all, 14),
            outer_source: vector(all, 17),
            middle_source: vector(all, 20),
            quadratic: vector(all, 23),
            cubic: vector(all, 26),
            cross_product: vector(all, 29),
        }
    }

    /// What the sensor puts out at a pose, nominal SI, sensor axes.
    pub fn predict(&self, rotations: &PoseRotations<T>) -> Vector3<T> {
        let tilt = Tilt::new(self.tilt);
        self.output(&(self.sensitivity * self.sensed(rotations, &tilt)))
    }

    /// v: the measured vector in the table's frame.
    fn sensed(&self, r: &PoseRotations<T>, tilt: &Tilt<T>) -> Vector3<T> {
        r.c_p_t * (tilt.c_n_p * self.vector_n) + r.c_o_t * self.outer_source + r.c_m_t * self.middle_source
    }

    /// m, from what each axis senses.
    fn output(&self, y: &Vector3<T>) -> Vector3<T> {
        let square = y.component_mul(y);
        y + self.quadratic.component_mul(&square)
            + self.cubic.component_mul(&square.component_mul(y))
            + self.cross_product.component_mul(&products(y))
            + self.bias
    }

    /// ∂m/∂y.
    fn slope(&self, y: &Vector3<T>) -> Matrix3<T> {
        let (two, three) = (T::of(2.0), T::of(3.0));
        let diagonal =
            y.zip_zip_map(&self.quadratic, &self.cubic, |y, q, c| T::one() + two * q * y + three * c * y * y);
        let x = self.cross_product;
        Matrix3::new(
            diagonal.x,
            x.x * y.z,
            x.x * y.y,
            x.y * y.z,
            diagonal.y,
            x.y * y.x,
            x.z * y.y,
            x.z * y.x,
            diagonal.z,
        )
    }
}

/// (y z, z x, x y).
fn products<T: Scalar>(y: &Vector3<T>) -> Vector3<T> {
    Vector3::new(y.y * y.z, y.z * y.x, y.x * y.y)
}

/// T(α, β) and its derivatives.
struct Tilt<T: Scalar> {
    c_n_p: Matrix3<T>,
    by_alpha: Matrix3<T>,
    by_beta: Matrix3<T>,
}

impl<T: Scalar> Tilt<T> {
    fn new([alpha, beta]: [T; 2]) -> Self {
        let ((sa, ca), (sb, cb)) = (sin_cos(alpha), sin_cos(beta));
        let o = T::zero();
        Self {
            c_n_p: Matrix3::new(cb, o, -sb, sa * sb, ca, sa * cb, ca * sb, -sa, ca * cb),
            by_alpha: Matrix3::new(o, o, o, ca * sb, -sa, ca * cb, -sa * sb, -ca, -sa * cb),
            by_beta: Matrix3::new(-sb, o, -cb, sa * cb, o, -sa * sb, ca * cb, o, -ca * sb),
        }
    }
}

/// The `P` entries that are estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Terms<const P: usize> {
    entries: [u8; P],
}

impl<const P: usize> Terms<P> {
    /// Entries by index; indices of [`UNIFIED`] and beyond are never estimated.
    pub const fn new(entries: [u8; P]) -> Self {
        Self { entries }
    }

    /// The entries.
    pub fn entries(&self) -> &[u8; P] {
        &self.entries
    }

    /// Order in which parameter `k` is taken when the gauge is sought: what belongs to the sensor, then what belongs
    /// to the machine, and last the field. Of a source along the outer axis and the field's component there it is the
    /// field that is held: a survey knows its dip better than anyone knows the iron.
    pub fn class(&self, k: usize) -> u8 {
        match self.entries.get(k) {
            Some(0..=11 | 23..=31) => 0,
            Some(14..=16) => 2,
            _ => 1,
        }
    }

    /// The parameter vector of these entries.
    pub fn theta<T: Scalar>(&self, parameters: &UnifiedParameters<T>) -> SVector<T, P> {
        select(&self.entries, &parameters.to_vector())
    }

    /// `base` with these entries replaced.
    pub fn parameters<T: Scalar>(
        &self,
        base: &UnifiedParameters<T>,
        theta: &SVector<T, P>,
    ) -> UnifiedParameters<T> {
        let mut all = base.to_vector();
        for (entry, value) in self.entries.iter().zip(theta.iter()) {
            if let Some(slot) = all.get_mut(usize::from(*entry)) {
                *slot = *value;
            }
        }
        UnifiedParameters::from_vector(&all)
    }
}

/// Poses on a rig or along a reference, and the terms that are estimated from them.
#[derive(Clone, Copy, Debug)]
pub struct UnifiedModel<'a, T: Scalar, const P: usize, G: Pose<T> = GimbalPose<T>> {
    /// The poses.
    pub poses: &'a [G],
    /// The rig's axes; nothing where a reference gives the attitude.
    pub axes: G::Axes,
    /// Values of the entries that are not estimated.
    pub base: UnifiedParameters<T>,
    /// Entries that are estimated.
    pub terms: Terms<P>,
    /// Bit k set: parameter k is held at its base value, since the poses cannot determine it
    /// ([`crate::solver::gauge`]).
    pub held: u32,
}

impl<T: Scalar, const P: usize, G: Pose<T>> UnifiedModel<'_, T, P, G> {
    /// Derivative of the three outputs by all entries.
    fn jacobian(
        &self,
        now: &UnifiedParameters<T>,
        r: &PoseRotations<T>,
        tilt: &Tilt<T>,
    ) -> (Vector3<T>, ByAll<T>) {
        let v = now.sensed(r, tilt);
        let y = now.sensitivity * v;
        let slope = now.slope(&y);
        let by_v = product(&slope, &now.sensitivity);
        let by_base = product(&by_v, &r.c_p_t);
        let mut by = ByAll::<T>::zeros();
        for (row, column) in slope.column_iter().enumerate() {
            for (k, component) in v.iter().enumerate() {
                by.set_column(3 * row + k, &column.map(|entry| entry * *component));
            }
        }
        let square = y.component_mul(&y);
        by.fixed_columns_mut::<3>(9).copy_from(&Matrix3::identity());
        by.set_column(12, &(by_base * (tilt.by_alpha * now.vector_n)));
        by.set_column(13, &(by_base * (tilt.by_beta * now.vector_n)));
        by.fixed_columns_mut::<3>(14).copy_from(&product(&by_base, &tilt.c_n_p));
        by.fixed_columns_mut::<3>(17).copy_from(&product(&by_v, &r.c_o_t));
        by.fixed_columns_mut::<3>(20).copy_from(&product(&by_v, &r.c_m_t));
        by.fixed_columns_mut::<3>(23).copy_from(&Matrix3::from_diagonal(&square));
        by.fixed_columns_mut::<3>(26).copy_from(&Matrix3::from_diagonal(&square.component_mul(&y)));
        by.fixed_columns_mut::<3>(29).copy_from(&Matrix3::from_diagonal(&products(&y)));
        (now.output(&y), by)
    }

    fn is_held(&self, k: usize) -> bool {
        u32::try_from(k).is_ok_and(|k| self.held.checked_shr(k).unwrap_or(0) & 1 == 1)
    }

    /// A row a held parameter, that keeps it where it is.
    fn hold<S: RowSink<T, P>>(&self, theta: &SVector<T, P>, sink: &mut S) {
        let base = self.terms.theta(&self.base);
        for (k, (now, at)) in theta.iter().zip(base.iter()).enumerate() {
            if self.is_held(k) {
                let mut row = SVector::<T, P>::zeros();
                if let Some(entry) = row.get_mut(k) {
                    *entry = T::one();
                }
                sink.row(*now - *at, &row);
            }
        }
    }
}

type ByAll<T> = SMatrix<T, 3, UNIFIED>;

impl<T: Scalar, const P: usize, G: Pose<T>> Model<T, P> for UnifiedModel<'_, T, P, G> {
    #[inline(never)]
    fn rows<S: RowSink<T, P>>(&self, theta: &SVector<T, P>, sink: &mut S) {
        let now = self.terms.parameters(&self.base, theta);
        let tilt = Tilt::new(now.tilt);
        for pose in self.poses {
            let rotations = pose.rotations(&self.axes);
            if S::JACOBIAN {
                let (output, by) = self.jacobian(&now, &rotations, &tilt);
                for ((out, measured), row) in output.iter().zip(pose.value().iter()).zip(by.row_iter()) {
                    let mut row = select(&self.terms.entries, &row.transpose());
                    for (k, entry) in row.iter_mut().enumerate() {
                        if self.is_held(k) {
                            *entry = T::zero();
                        }
                    }
                    sink.row(*out - *measured, &row);
                }
            } else {
                let output = now.output(&(now.sensitivity * now.sensed(&rotations, &tilt)));
                for (out, measured) in output.iter().zip(pose.value().iter()) {
                    sink.row(*out - *measured, &SVector::zeros());
                }
            }
        }
        self.hold(theta, sink);
    }

    fn independent_rows(&self) -> usize {
        3 * self.poses.len() + self.held.count_ones() as usize
    }
}

#[cfg(test)]
mod tests;
