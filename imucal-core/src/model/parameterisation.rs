//! Which entries of a triad are estimated: one list of indices, so that every form shares one formula.

use nalgebra::{Matrix3, SVector, Vector3};

use crate::{scalar::Scalar, triad::Triad};

/// Entries of a triad: the gain's nine by rows, then the bias's three.
pub const ENTRIES: usize = 12;
/// Entries of a gyroscope: those of its triad, then the nine of its g-sensitivity by rows.
pub const GYROSCOPE_ENTRIES: usize = ENTRIES + 9;

/// The `P` entries of a triad, or of a gyroscope, that are estimated; the others are zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameterisation<const P: usize> {
    entries: [u8; P],
}

/// Upper triangular gain and bias: what a norm can determine (T9). The gauge puts the sensor's x axis of the inverse
/// on the frame's x, and y in its x-y plane.
pub const UPPER_TRIANGULAR: Parameterisation<9> = Parameterisation { entries: [0, 1, 2, 4, 5, 8, 9, 10, 11] };
/// Diagonal gain and bias: what six faces can determine (T6).
pub const DIAGONAL: Parameterisation<6> = Parameterisation { entries: [0, 4, 8, 9, 10, 11] };
/// Full gain, no bias: the gyroscope's, whose bias the rests give.
pub const FULL_GAIN: Parameterisation<9> = Parameterisation { entries: [0, 1, 2, 3, 4, 5, 6, 7, 8] };
/// Full gain and bias (12).
pub const FULL: Parameterisation<12> = Parameterisation { entries: [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11] };

/// Full gain and bias, and g-sensitivity (21): the gyroscope's alone.
pub const FULL_WITH_SENSITIVITY: Parameterisation<21> =
    Parameterisation { entries: [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20] };

impl<const P: usize> Parameterisation<P> {
    /// All entries of a parameter vector, as far as the first `E`; zero where one is not estimated.
    #[inline]
    fn spread<T: Scalar, const E: usize>(&self, theta: &SVector<T, P>) -> SVector<T, E> {
        let mut all = SVector::<T, E>::zeros();
        for (entry, value) in self.entries.iter().zip(theta.iter()) {
            if let Some(slot) = all.get_mut(usize::from(*entry)) {
                *slot = *value;
            }
        }
        all
    }

    /// The g-sensitivity of a parameter vector, raw rate per specific force, rad/s per m/s²: zero where it is not
    /// estimated.
    pub fn sensitivity<T: Scalar>(&self, theta: &SVector<T, P>) -> Matrix3<T> {
        let all = self.spread::<T, GYROSCOPE_ENTRIES>(theta);
        matrix_by_rows(&all, ENTRIES)
    }

    /// Whether any entry of the g-sensitivity is estimated.
    pub fn has_sensitivity(&self) -> bool {
        self.entries.iter().any(|entry| usize::from(*entry) >= ENTRIES)
    }

    /// The triad of a parameter vector.
    pub fn triad<T: Scalar>(&self, theta: &SVector<T, P>) -> Triad<T> {
        let all = self.spread::<T, ENTRIES>(theta);
        Triad { gain: matrix_by_rows(&all, 0), bias: vector(&all, 9) }
    }

    /// The parameter vector of a triad; entries that are not estimated are left out, a g-sensitivity is zero.
    pub fn theta<T: Scalar>(&self, triad: &Triad<T>) -> SVector<T, P> {
        let by_rows = triad.gain.transpose();
        let mut all = SVector::<T, ENTRIES>::zeros();
        for (slot, value) in all.iter_mut().zip(by_rows.iter().chain(triad.bias.iter())) {
            *slot = *value;
        }
        self.select(&all)
    }

    /// The estimated entries of a derivative by all of a triad's, or of a gyroscope's.
    #[inline]
    pub fn select<T: Scalar, const E: usize>(&self, all: &SVector<T, E>) -> SVector<T, P> {
        select(&self.entries, all)
    }

    /// Index of each parameter among the entries.
    pub fn entries(&self) -> &[u8; P] {
        &self.entries
    }
}

/// Three entries from one on; zero beyond the last. (A matrix built of an iterator panics where that ends early.)
#[inline]
pub(super) fn vector<T: Scalar, const N: usize>(all: &SVector<T, N>, from: usize) -> Vector3<T> {
    let at = |k: usize| all.get(from + k).copied().unwrap_or_else(T::zero);
    Vector3::new(at(0), at(1), at(2))
}

/// Nine entries from one on, by rows.
#[inline]
pub(super) fn matrix_by_rows<T: Scalar, const N: usize>(all: &SVector<T, N>, from: usize) -> Matrix3<T> {
    let [a, b, c] = [0, 3, 6].map(|row| vector(all, from + row));
    Matrix3::new(a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z)
}

/// Those of `all` that a list of indices names.
#[inline]
pub(super) fn select<T: Scalar, const N: usize, const P: usize>(
    entries: &[u8; P],
    all: &SVector<T, N>,
) -> SVector<T, P> {
    let mut some = SVector::<T, P>::zeros();
    for (slot, entry) in some.iter_mut().zip(entries.iter()) {
        *slot = all.get(usize::from(*entry)).copied().unwrap_or_else(T::zero);
    }
    some
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triad_comes_back_from_its_parameters() {
        let triad = Triad {
            gain: Matrix3::new(1.0, 2.0, 3.0, 0.0, 4.0, 5.0, 0.0, 0.0, 6.0),
            bias: Vector3::new(7.0, 8.0, 9.0),
        };
        let theta = UPPER_TRIANGULAR.theta(&triad);
        assert_eq!(theta.as_slice(), &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]);
        assert_eq!(UPPER_TRIANGULAR.triad(&theta), triad);
        assert_eq!(FULL.triad(&FULL.theta(&triad)), triad);
        let with = FULL_WITH_SENSITIVITY.theta(&triad);
        assert_eq!(FULL_WITH_SENSITIVITY.triad(&with), triad);
        assert_eq!(FULL_WITH_SENSITIVITY.sensitivity(&with), Matrix3::zeros());
    }

    #[test]
    fn a_sensitivity_comes_last_and_by_rows() {
        let theta = SVector::<f64, 21>::from_iterator((0..21).map(f64::from));
        let expected = Matrix3::new(12.0, 13.0, 14.0, 15.0, 16.0, 17.0, 18.0, 19.0, 20.0);
        assert_eq!(FULL_WITH_SENSITIVITY.sensitivity(&theta), expected);
        assert!(FULL_WITH_SENSITIVITY.has_sensitivity() && !FULL.has_sensitivity());
        assert_eq!(FULL.sensitivity(&SVector::repeat(1.0)), Matrix3::zeros());
    }
}
