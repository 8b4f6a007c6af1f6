//! The axes of a record: those of its accelerometer, into which a session's triads are turned.
//!
//! A session's accelerometer is in axes of its own, with an upper triangular gain, and so are most records. One that a rig has
//! calibrated is in the table's axes, to which its gain, without zeros, leads. Where such a record is in use, a session's triads are
//! turned into those axes, so that the three sensors of a record agree whichever of them are replaced.
//!
//! ```text
//! M = G_r G_s⁻¹ = (I + P) R      G' = R G      E = dG G⁻¹
//! E'_ij = (E_s,ij + E_s,ji) / 2 + (E_r,ij − E_r,ji) / 2      accelerometer: the record says how it lies, the session the rest
//! E'_ij =  E_s,ij               + (E_r,ij − E_r,ji) / 2      gyroscope and magnetometer
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | G_r, G_s | gains of the record's accelerometer and of the session's |
//! | R, P | rotation into the record's axes, and the strain that is left: symmetric |
//! | E | relative error of a gain, in the record's axes |
//!
//! The session's own error of direction drops out, since all its triads have it. Where the strain is larger than the record's error of
//! direction, it takes its place: entries of a gain that moved may have turned as far. Not modelled: correlations between the entries
//! of a gain; the axes of a record without an accelerometer; what slopes of scale that differ from axis to axis turn into off the
//! diagonal, (s_i − s_j) R_ik R_jk for each kelvin, since a record has none there.

use nalgebra::{Matrix3, Vector3};

use super::{
    Session,
    store::{is_upper_triangular, model_of},
};
use crate::{
    fit::Units,
    record::{Sensor, TriadRecord},
    rotation::{image, product},
};

/// Strain between two calibrations of one accelerometer at most, as a share: a hundredth, which is half a degree.
pub const LARGEST_STRAIN: f32 = 0.01;
/// Newton's iterations for the rotation: quadratic, from a matrix that is one within a few hundredths.
const ITERATIONS: usize = 5;

/// Axes of the record in use, as a session finds them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Axes {
    /// The session's own.
    Own,
    /// The record's accelerometer is in other ones.
    Of(Rotated),
    /// The record's accelerometer and the session's differ by more than a rotation.
    Unknown {
        /// Largest entry of the strain; infinite in other units, and where one is a mirror image.
        strain: f32,
    },
}

/// A rotation from the session's axes into the record's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotated {
    /// R.
    pub rotation: Matrix3<f32>,
    /// Variance of the rotation about the axis that is neither a row's nor a column's, rad².
    variance: Matrix3<f32>,
}

impl<const N: usize, const B: usize, const M: usize> Session<N, B, M> {
    /// How the axes of a record lie, by the accelerometer that it holds before anything of the session is taken into it; `units`:
    /// those of the accelerometer.
    #[inline(never)]
    pub fn axes<O>(&self, units: &Units, held: Option<&TriadRecord<O>>) -> Axes {
        let Some((held, own)) = held.zip(self.estimate(Sensor::Accelerometer)) else { return Axes::Own };
        if is_upper_triangular(&held.gain) {
            return Axes::Own;
        }
        let own = own.record(model_of(Sensor::Accelerometer), units);
        let unknown = Axes::Unknown { strain: f32::INFINITY };
        if held.unit_in != own.unit_in || held.unit_out != own.unit_out {
            return unknown;
        }
        let (of_record, of_session) = (rows(&held.gain), rows(&own.gain));
        let Some((rotation, strain)) =
            of_session.try_inverse().and_then(|inverse| polar(&product(&of_record, &inverse)))
        else {
            return unknown;
        };
        let errors = relative_variance(&rows(&held.quality.gain_std), &of_record);
        let Some(errors) = errors.filter(|_| strain.amax() <= LARGEST_STRAIN) else {
            return Axes::Unknown { strain: strain.amax() };
        };
        let mut variance = halves(&errors)
            .zip_map(&strain, |stated, seen| if stated > seen * seen { stated } else { seen * seen });
        variance.set_diagonal(&Vector3::zeros());
        Axes::Of(Rotated { rotation, variance })
    }
}

impl Axes {
    /// Slopes of scale of the session's axes in the record's: the diagonal of R diag(s) Rᵀ.
    #[inline]
    pub(super) fn scale_slope(&self, slope: &[f32; 3]) -> [f32; 3] {
        match self {
            Self::Of(rotated) => image(&squared(&rotated.rotation), &Vector3::from(*slope)).into(),
            _ => *slope,
        }
    }
}

impl Rotated {
    /// Turns a triad of the session's axes into the record's; false where its gain is singular.
    #[inline]
    pub(super) fn turn(&self, sensor: Sensor, triad: &mut TriadRecord) -> bool {
        let (gain, std) = (rows(&triad.gain), rows(&triad.quality.gain_std));
        let Some(own) = relative_variance(&std, &gain) else { return false };
        let squares = squared(&self.rotation);
        let mut errors = product(&product(&squares, &own), &squares.transpose());
        if sensor == Sensor::Accelerometer {
            let diagonal = errors.diagonal();
            errors = halves(&errors);
            errors.set_diagonal(&diagonal);
        }
        let gain = product(&self.rotation, &gain);
        let variance = product(&(errors + self.variance), &squared(&gain));
        triad.gain = gain.transpose().into();
        triad.quality.gain_std = variance.map(libm::sqrtf).transpose().into();
        true
    }
}

#[inline]
fn rows(rows: &[[f32; 3]; 3]) -> Matrix3<f32> {
    Matrix3::from(*rows).transpose()
}

#[inline]
fn squared(matrix: &Matrix3<f32>) -> Matrix3<f32> {
    matrix.component_mul(matrix)
}

/// Variances of E = dG G⁻¹, whose entries do not correlate.
#[inline]
fn relative_variance(std: &Matrix3<f32>, gain: &Matrix3<f32>) -> Option<Matrix3<f32>> {
    Some(product(&squared(std), &squared(&gain.try_inverse()?)))
}

/// Variances of half a sum, or a difference, of the entries ij and ji.
#[inline]
fn halves(variance: &Matrix3<f32>) -> Matrix3<f32> {
    (variance + variance.transpose()) * 0.25
}

/// R and P of `(I + P) R`, R by Newton's iteration (Higham 1986); `None` of a mirror image, and of what is singular.
#[inline]
fn polar(matrix: &Matrix3<f32>) -> Option<(Matrix3<f32>, Matrix3<f32>)> {
    let mut rotation = *matrix;
    for _ in 0..ITERATIONS {
        rotation = (rotation + rotation.try_inverse()?.transpose()) * 0.5;
    }
    (rotation.determinant() > 0.0)
        .then(|| (rotation, product(matrix, &rotation.transpose()) - Matrix3::identity()))
}
