//! Which entries of a triad are estimated: one list of indices, so that every form shares one formula.

use nalgebra::{Matrix3, SVector, Vector3};

use crate::{scalar::Scalar, triad::Triad};

/// Entries of a triad: the gain's nine by rows, then the bias's three.
pub const ENTRIES: usize = 12;

/// The `P` entries of a triad that are estimated; the others are zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameterisation<const P: usize> {
    entries: [u8; P],
}

/// Upper triangular gain and bias: what a norm can tell (T9). The gauge puts the sensor's x axis of the inverse
/// on the frame's x, and y in its x-y plane.
pub const UPPER_TRIANGULAR: Parameterisation<9> = Parameterisation { entries: [0, 1, 2, 4, 5, 8, 9, 10, 11] };
/// Diagonal gain and bias: what six faces can tell (T6).
pub const DIAGONAL: Parameterisation<6> = Parameterisation { entries: [0, 4, 8, 9, 10, 11] };
/// Full gain, no bias: the gyroscope's, whose bias the rests give.
pub const FULL_GAIN: Parameterisation<9> = Parameterisation { entries: [0, 1, 2, 3, 4, 5, 6, 7, 8] };
/// Full gain and bias (12).
pub const FULL: Parameterisation<12> = Parameterisation { entries: [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11] };

impl<const P: usize> Parameterisation<P> {
    /// The triad of a parameter vector.
    pub fn triad<T: Scalar>(&self, theta: &SVector<T, P>) -> Triad<T> {
        let mut all = SVector::<T, ENTRIES>::zeros();
        for (entry, value) in self.entries.iter().zip(theta.iter()) {
            if let Some(slot) = all.get_mut(usize::from(*entry)) {
                *slot = *value;
            }
        }
        // By name: a matrix built of an iterator panics where that ends early.
        let [a, b, c, d, e, f, g, h, i, x, y, z] = all.into();
        Triad { gain: Matrix3::new(a, b, c, d, e, f, g, h, i), bias: Vector3::new(x, y, z) }
    }

    /// The parameter vector of a triad; entries that are not estimated are left out.
    pub fn theta<T: Scalar>(&self, triad: &Triad<T>) -> SVector<T, P> {
        let by_rows = triad.gain.transpose();
        let mut all = SVector::<T, ENTRIES>::zeros();
        for (slot, value) in all.iter_mut().zip(by_rows.iter().chain(triad.bias.iter())) {
            *slot = *value;
        }
        self.select(&all)
    }

    /// The estimated entries of a derivative by all twelve.
    #[inline]
    pub fn select<T: Scalar>(&self, all: &SVector<T, ENTRIES>) -> SVector<T, P> {
        select(&self.entries, all)
    }

    /// Index of each parameter among the twelve entries.
    pub fn entries(&self) -> &[u8; P] {
        &self.entries
    }
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
    }
}
