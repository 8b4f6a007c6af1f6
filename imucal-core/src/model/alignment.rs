//! A triad turned into the axes of another one, with errors that follow from both.
//!
//! ```text
//! G' = R G      b' = b      dG' = R dG + [δ]× R G      δ = δ_R + Σ B_i (E, c)      E = dG G⁻¹      c = −G db / |f|
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | G, b | gain and bias of the triad, in its own axes |
//! | R | rotation into the other's axes, as [`super::dip`] finds it |
//! | δ_R | error of the rotation for a triad without errors, rad, in the axes it leads to |
//! | E, c | change of a calibrated vector of length one by an error of the triad: f → f + E f + c |
//! | B | how the rotation moves with it: the optimum of the dip's residuals, −(JᵀJ)⁻¹ Jᵀ dr |
//! | f | the calibrated vectors that R was found from |
//!
//! An error of the triad that turns its axes turns the rotation back. Not modelled: errors of the second order.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::dip::DirectionPair;
use crate::{
    rotation::{cross_matrix, exp_with_jacobian, image, product},
    scalar::Scalar,
    triad::Triad,
};

/// Rotation from a triad's axes to those of another one.
#[derive(Clone, Copy, Debug)]
pub struct Alignment<T: Scalar> {
    /// R.
    pub rotation: Matrix3<T>,
    /// Covariance of δ_R, rad².
    pub covariance: Matrix3<T>,
    /// B: for each component of δ the factors of E and c.
    by_triad: [Triad<T>; 3],
    /// Mean length of the vectors.
    length: T,
}

impl<T: Scalar> Alignment<T> {
    /// From the pairs that a fit of the dip was made of, their vectors' mean length, the parameters φ and s, their covariance, and
    /// (JᵀJ)⁻¹.
    pub fn new(
        pairs: impl Iterator<Item = DirectionPair<T>>,
        length: T,
        theta: &SVector<T, 4>,
        covariance: &SMatrix<T, 4, 4>,
        inverse: &SMatrix<T, 4, 4>,
    ) -> Self {
        let (rotation, jacobian) = exp_with_jacobian(&theta.xyz());
        let none = Triad { gain: Matrix3::zeros(), bias: Vector3::zeros() };
        let mut slopes = [none; 4];
        for DirectionPair { u_f, u_b } in pairs {
            let seen = rotation.tr_mul(&u_f);
            let across = seen - u_b * u_b.dot(&seen);
            let by_gain = across * u_b.transpose();
            let row = DirectionPair { u_f, u_b }.derivative(&(rotation * u_b), &jacobian);
            for (slope, by) in slopes.iter_mut().zip(row.iter()) {
                slope.gain += by_gain * *by;
                slope.bias += across * *by;
            }
        }
        let sum = |factors: &[T], of: &[Triad<T>]| {
            let mut sum = none;
            for (factor, triad) in factors.iter().zip(of) {
                sum.gain += triad.gain * *factor;
                sum.bias += triad.bias * *factor;
            }
            sum
        };
        // Symmetric: its columns are its rows.
        let [x, y, z, _] = <[[T; 4]; 4]>::from(*inverse).map(|row| sum(&row.map(|factor| -factor), &slopes));
        let by_triad = <[[T; 3]; 3]>::from(jacobian.transpose()).map(|row| sum(&row, &[x, y, z]));
        let [a, b, c, _] = <[[T; 4]; 4]>::from(*covariance);
        let of_phi = Matrix3::from([a, b, c].map(|[x, y, z, _]| [x, y, z]));
        let covariance = product(&product(&jacobian, &of_phi), &jacobian.transpose());
        Self { rotation, covariance, by_triad, length }
    }

    /// Largest standard error of the rotation by itself, rad.
    pub fn error(&self) -> T {
        let [x, y, z] = [self.covariance.m11, self.covariance.m22, self.covariance.m33];
        let larger = |a: T, b: T| if a > b { a } else { b };
        larger(larger(x, y), z).root()
    }

    /// The triad in the other axes.
    pub fn turned(&self, triad: &Triad<T>) -> Triad<T> {
        Triad { gain: product(&self.rotation, &triad.gain), bias: triad.bias }
    }

    /// How the turned triad follows a small change of `triad`, whose gain has this inverse.
    pub fn followed(&self, triad: &Triad<T>, inverse: &Matrix3<T>, change: &Triad<T>) -> Triad<T> {
        let e = product(&change.gain, inverse);
        let c = image(&triad.gain, &change.bias) / -self.length;
        let by = |factors: &Triad<T>| factors.gain.dot(&e) + factors.bias.dot(&c);
        let [x, y, z] = &self.by_triad;
        let turn = cross_matrix(&Vector3::new(by(x), by(y), by(z)));
        let turned = product(&turn, &product(&self.rotation, &triad.gain));
        Triad { gain: product(&self.rotation, &change.gain) + turned, bias: change.bias }
    }

    /// Standard errors of the turned triad: how `triad` follows each of its parameters, and their covariance. `None` where its gain
    /// is singular.
    pub fn errors<const P: usize>(
        &self,
        triad: &Triad<T>,
        changes: &[Triad<T>; P],
        covariance: &SMatrix<T, P, P>,
    ) -> Option<Triad<T>> {
        let inverse = triad.gain.try_inverse()?;
        let mut moved = *changes;
        moved.iter_mut().for_each(|change| *change = self.followed(triad, &inverse, change));
        let squared = |value: &dyn Fn(&Triad<T>) -> Option<T>| {
            let mut slopes = SVector::<T, P>::zeros();
            for (slope, change) in slopes.iter_mut().zip(&moved) {
                *slope = value(change).unwrap_or(T::zero());
            }
            (covariance * slopes).dot(&slopes)
        };
        let (mut gain, mut bias) = (Matrix3::zeros(), Vector3::zeros());
        for (at, square) in gain.iter_mut().enumerate() {
            *square = squared(&|change| change.gain.as_slice().get(at).copied());
        }
        for (at, square) in bias.iter_mut().enumerate() {
            *square = squared(&|change| change.bias.as_slice().get(at).copied());
        }
        let turned = <[[T; 3]; 3]>::from(product(&self.rotation, &triad.gain));
        let by_rotation = turned.map(|column| {
            let by = cross_matrix(&Vector3::from(column));
            product(&product(&by, &self.covariance), &by.transpose()).diagonal().into()
        });
        gain += Matrix3::from(by_rotation);
        Some(Triad { gain: gain.map(T::root), bias: bias.map(T::root) })
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;
    use crate::{model::dip::DipModel, rotation::exp, solver::LevenbergMarquardt};

    const FIELD: f64 = 48.0;

    fn direction(k: usize) -> Vector3<f64> {
        let k = k as f64;
        Vector3::new((1.3 * k).sin(), (2.1 * k + 0.4).cos(), (0.7 * k + 1.0).sin()).normalize()
    }

    /// Directions of gravity, and raw fields, of poses of a unit whose magnetometer lies like `phi`.
    fn poses(phi: &Vector3<f64>, raw: &Triad<f64>) -> Vec<(Vector3<f64>, Vector3<f64>)> {
        let field_n = Vector3::new(0.5, 0.05, 0.85).normalize() * FIELD;
        let pose = |k: usize| {
            let c_n_s = exp(&(direction(k) * k as f64));
            let field = exp(&-phi) * (c_n_s * field_n);
            (c_n_s * -Vector3::z(), raw.predict(&field).expect("regular"))
        };
        (0..16).map(pose).collect()
    }

    fn pairs<'a>(
        poses: &'a [(Vector3<f64>, Vector3<f64>)],
        triad: &'a Triad<f64>,
    ) -> impl Iterator<Item = DirectionPair<f64>> + 'a {
        poses.iter().map(|(u_f, raw)| DirectionPair { u_f: *u_f, u_b: triad.correct(raw).normalize() })
    }

    fn aligned(
        poses: &[(Vector3<f64>, Vector3<f64>)],
        triad: &Triad<f64>,
        near: &Vector3<f64>,
    ) -> Alignment<f64> {
        let all: Vec<_> = pairs(poses, triad).collect();
        let start = SVector::from([near.x, near.y, near.z, 0.0]);
        let mut fit = LevenbergMarquardt::new(start, Default::default());
        assert!(fit.run(&DipModel { pairs: &all }).termination.was_successful());
        let inverse = fit.factor().covariance(1.0).expect("regular");
        Alignment::new(all.into_iter(), FIELD, fit.theta(), &(inverse * 1e-8), &inverse)
    }

    #[test]
    fn a_turned_triad_follows_a_change_of_the_one_before_as_a_fit_of_the_dip_does() {
        let phi = Vector3::new(0.4, -1.1, 0.3);
        let gain = Matrix3::new(1.02, 0.03, -0.01, 0.0, 0.97, 0.02, 0.0, 0.0, 1.01);
        let triad = Triad { gain, bias: Vector3::new(12.0, -5.0, 8.0) };
        let poses = poses(&phi, &triad);
        let found = aligned(&poses, &triad, &phi);
        assert!((found.rotation - exp(&phi)).amax() < 1e-9);
        let inverse = triad.gain.try_inverse().expect("regular");
        for entry in 0..12 {
            let mut change = Triad { gain: Matrix3::zeros(), bias: Vector3::zeros() };
            match entry {
                0..9 => change.gain[entry] = 1e-6,
                _ => change.bias[entry - 9] = 1e-5,
            }
            let moved = Triad { gain: triad.gain + change.gain, bias: triad.bias + change.bias };
            let turned = aligned(&poses, &moved, &phi).turned(&moved);
            let expected = turned.gain - found.turned(&triad).gain;
            let followed = found.followed(&triad, &inverse, &change);
            assert!((followed.gain - expected).amax() < 2e-9, "{entry}: {} {expected}", followed.gain);
            assert_eq!(followed.bias, change.bias);
        }
    }

    #[test]
    fn errors_of_a_triad_without_any_are_those_of_the_rotation() {
        let phi = Vector3::new(0.1, 0.2, -0.1);
        let triad = Triad { gain: Matrix3::identity(), bias: Vector3::zeros() };
        let covariance = Matrix3::identity() * 1e-6;
        let found = Alignment { covariance, ..aligned(&poses(&phi, &triad), &triad, &phi) };
        let errors = found.errors(&triad, &[triad; 2], &SMatrix::zeros()).expect("regular");
        // As sure about any axis, it turns each column by as much, across the column.
        let expected = found.rotation.map(|entry| 1e-3 * (1.0 - entry * entry).sqrt());
        assert!((errors.gain - expected).amax() < 1e-12, "{} {expected}", errors.gain);
        assert_eq!(found.error(), 1e-3);
    }
}
