//! The gyroscope from turns between rests whose directions the accelerometer gives.
//!
//! ```text
//! φ_k = A (s0 − T b) + ½ cof(A) (c − s1 × b)        a block's rotation vector
//! C   = Π exp([φ_k]×),   r = Cᵀ u_before − u_after
//! ```
//!
//! | symbol | meaning | paper |
//! | --- | --- | --- |
//! | s0, s1, c, T | sums over a block of samples ([`crate::observation::Block`]) and its duration | – |
//! | A, b | gain and bias; cof(A) = det(A) A⁻ᵀ | K⁻¹, b |
//! | u | direction of the specific force at rest, calibrated axes | – |
//! | r | chord between the carried and the measured direction, rad to second order | – |
//!
//! Source: the field form of Tedaldi, Pretto & Menegatti 2014 (ICRA), eq. (16), with the block compression of
//! models.md 3 (a reconstruction of Secer & Barshan 2016). Each turn counts as two independent residuals: a
//! direction has two. Not observed: rotation about the vertical, hence a turn about it says nothing. Not modelled:
//! Earth rate (it is part of the bias where that is taken from rests), g-sensitivity, rates that change within a
//! sample.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::{Model, Parameterisation, RowSink, parameterisation::ENTRIES};
use crate::{
    observation::{Block, Turn},
    rotation::{cross_matrix, exp, exp_with_jacobian},
    scalar::Scalar,
    triad::Triad,
};

/// Derivative of a rotation vector by the twelve entries of a triad.
type ByEntries<T> = SMatrix<T, 3, ENTRIES>;

/// Turns whose end directions are known.
#[derive(Clone, Copy, Debug)]
pub struct TurnModel<'a, T: Scalar, const P: usize> {
    /// The turns; their rates are nominal SI, rad/s.
    pub turns: &'a [Turn<'a, T>],
    /// Entries of gain and bias that are estimated.
    pub form: Parameterisation<P>,
}

#[inline]
fn columns<T: Scalar>(a: &Matrix3<T>) -> [Vector3<T>; 3] {
    [a.column(0).into_owned(), a.column(1).into_owned(), a.column(2).into_owned()]
}

/// What a triad does to every block of a turn.
struct BlockRotation<T: Scalar> {
    gain: Matrix3<T>,
    /// cof(A), whose columns are the cross products of A's.
    cofactor: Matrix3<T>,
}

impl<T: Scalar> BlockRotation<T> {
    fn new(triad: &Triad<T>) -> Self {
        Self { gain: triad.gain, cofactor: Self::cofactor(&triad.gain) }
    }

    fn cofactor(gain: &Matrix3<T>) -> Matrix3<T> {
        let [x, y, z] = columns(gain);
        Matrix3::from_columns(&[y.cross(&z), z.cross(&x), x.cross(&y)])
    }

    /// φ of the module's first equation, from what [`reduce`] leaves of a block.
    #[inline]
    fn vector(&self, angle: &Vector3<T>, coning: &Vector3<T>) -> Vector3<T> {
        self.gain * angle + self.cofactor * coning
    }
}

/// A block less its bias: s0 − T b and ½ (c − s1 × b).
#[inline]
fn reduce<T: Scalar>(bias: &Vector3<T>, block: &Block<T>, duration: T) -> (Vector3<T>, Vector3<T>) {
    (block.s0 - bias * duration, (block.c - block.s1.cross(bias)) * T::of(0.5))
}

/// `C_after_before`: the attitude after the turn, as the product of its blocks.
pub fn attitude<T: Scalar>(triad: &Triad<T>, turn: &Turn<'_, T>) -> Matrix3<T> {
    let mut c = Matrix3::identity();
    let rotation = BlockRotation::new(triad);
    for (index, block) in turn.blocks.iter().enumerate() {
        let (angle, coning) = reduce(&triad.bias, block, turn.durations.get(index));
        c *= exp(&rotation.vector(&angle, &coning));
    }
    c
}

/// Sums over a turn's blocks from which the derivative by all twelve entries follows at its end.
///
/// A block adds M φ' to the derivative, M = C J_l(φ), and φ' is linear in the block's few numbers: so M is summed
/// against each of them, and the gain's and bias's part is multiplied on once a turn instead of once a block.
struct DerivativeSums<T: Scalar> {
    /// Σ M a_i, a = s0 − T b.
    angle: [Matrix3<T>; 3],
    /// Σ M w_i, w = ½ (c − s1 × b).
    coning: [Matrix3<T>; 3],
    /// Σ M s1_i.
    moment: [Matrix3<T>; 3],
    /// Σ M T.
    time: Matrix3<T>,
}

impl<T: Scalar> DerivativeSums<T> {
    fn new() -> Self {
        let none = [Matrix3::zeros(); 3];
        Self { angle: none, coning: none, moment: none, time: Matrix3::zeros() }
    }

    #[inline]
    fn add(
        &mut self,
        m: &Matrix3<T>,
        angle: &Vector3<T>,
        coning: &Vector3<T>,
        block: &Block<T>,
        duration: T,
    ) {
        for (sums, factors) in
            [(&mut self.angle, angle), (&mut self.coning, coning), (&mut self.moment, &block.s1)]
        {
            for (sum, factor) in sums.iter_mut().zip(factors.iter()) {
                *sum += m * *factor;
            }
        }
        self.time += m * duration;
    }

    /// Derivative by the gain's nine entries (rows) and the bias.
    fn by_entries(&self, gain: &Matrix3<T>) -> ByEntries<T> {
        let [x, y, z] = columns(gain);
        let [cx, cy, cz] = [x, y, z].map(|c| cross_matrix(&c));
        let [kx, ky, kz] = self.coning;
        let by_cofactor = [ky * cz - kz * cy, kz * cx - kx * cz, kx * cy - ky * cx];
        let mut by = ByEntries::zeros();
        for (column, (angle, cofactor)) in self.angle.iter().zip(by_cofactor.iter()).enumerate() {
            let part = angle + cofactor;
            for row in 0..3 {
                by.set_column(3 * row + column, &part.column(row));
            }
        }
        let cofactor = BlockRotation::cofactor(gain);
        let [mx, my, mz] = self.moment;
        let moment = mx * cofactor * cross_matrix(&Vector3::x())
            + my * cofactor * cross_matrix(&Vector3::y())
            + mz * cofactor * cross_matrix(&Vector3::z());
        by.fixed_columns_mut::<3>(9).copy_from(&(-(self.time * gain) - moment * T::of(0.5)));
        by
    }
}

/// The attitude and the derivative of its rotation, in the frame before the turn.
fn attitude_with_derivative<T: Scalar>(triad: &Triad<T>, turn: &Turn<'_, T>) -> (Matrix3<T>, ByEntries<T>) {
    let mut c = Matrix3::identity();
    let mut sums = DerivativeSums::new();
    let rotation = BlockRotation::new(triad);
    for (index, block) in turn.blocks.iter().enumerate() {
        let duration = turn.durations.get(index);
        let (angle, coning) = reduce(&triad.bias, block, duration);
        let (step, jacobian) = exp_with_jacobian(&rotation.vector(&angle, &coning));
        sums.add(&(c * jacobian), &angle, &coning, block, duration);
        c *= step;
    }
    (c, sums.by_entries(&triad.gain))
}

impl<T: Scalar, const P: usize> Model<T, P> for TurnModel<'_, T, P> {
    fn rows<S: RowSink<T, P>>(&self, theta: &SVector<T, P>, sink: &mut S) {
        let triad = self.form.triad(theta);
        for turn in self.turns {
            let (c, by) = if S::JACOBIAN {
                attitude_with_derivative(&triad, turn)
            } else {
                (attitude(&triad, turn), ByEntries::zeros())
            };
            let carried = c.tr_mul(&turn.before);
            let residual = carried - turn.after;
            let by_entries = if S::JACOBIAN { cross_matrix(&carried) * c.tr_mul(&by) } else { by };
            for (value, row) in residual.iter().zip(by_entries.row_iter()) {
                sink.row(*value, &self.form.select(&row.transpose()));
            }
        }
    }

    fn independent_rows(&self) -> usize {
        2 * self.turns.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        model::parameterisation::{FULL, FULL_GAIN},
        observation::{BlockBuilder, Durations},
        solver::jacobian_check::largest_jacobian_error,
    };
    use proptest::prelude::*;
    use std::vec::Vec;

    const DT: f64 = 0.01;

    /// Rate of a hand that tumbles a sensor through a few radians, rad/s.
    fn rate(k: usize) -> Vector3<f64> {
        let t = k as f64 * DT;
        Vector3::new(2.0 * (3.0 * t).sin(), 1.5 * (2.0 * t + 0.4).sin(), -1.2 * (2.5 * t + 1.0).cos())
    }

    fn blocks(samples: usize, of: usize) -> (Vec<Block<f64>>, Vec<f64>) {
        let mut builder = BlockBuilder::default();
        (0..samples)
            .filter_map(|k| {
                builder.push(&rate(k), DT);
                (builder.count() as usize == of).then(|| builder.finish())
            })
            .unzip()
    }

    proptest! {
        #[test]
        fn the_analytic_jacobian_is_the_numerical_one(noise in prop::array::uniform12(-0.05f64..0.05)) {
            let (blocks, durations) = blocks(60, 5);
            let turns = [Turn {
                blocks: &blocks,
                durations: Durations::Each(&durations),
                before: Vector3::z(),
                after: Vector3::x(),
            }];
            let theta = FULL.theta(&Triad::identity()) + SVector::from(noise);
            let (full, gain) = (TurnModel { turns: &turns, form: FULL }, TurnModel { turns: &turns, form: FULL_GAIN });
            let nine = FULL_GAIN.theta(&FULL.triad(&theta));
            prop_assert!(largest_jacobian_error(&full, &theta) < 1e-8);
            prop_assert!(largest_jacobian_error(&gain, &nine) < 1e-8);
        }
    }

    #[test]
    fn blocks_of_five_agree_with_the_product_over_samples() {
        let (blocks, durations) = blocks(1000, 5);
        let turn = Turn {
            blocks: &blocks,
            durations: Durations::Each(&durations),
            before: Vector3::z(),
            after: Vector3::z(),
        };
        let triad = Triad {
            gain: Matrix3::new(1.05, 0.02, -0.01, 0.01, 0.97, 0.03, 0.0, -0.02, 1.01),
            bias: Vector3::new(0.05, -0.03, 0.02),
        };
        let mut exact = Matrix3::identity();
        for k in 0..1000 {
            exact *= exp(&(triad.gain * (rate(k) - triad.bias) * DT));
        }
        let error =
            nalgebra::Rotation3::from_matrix_unchecked(exact.tr_mul(&attitude(&triad, &turn))).angle();
        assert!(error.to_degrees() < 1e-3, "{} degrees after 10 s", error.to_degrees());
    }
}
