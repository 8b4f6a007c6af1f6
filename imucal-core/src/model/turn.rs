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

use nalgebra::{Matrix3, SVector, Vector3};

use super::{
    Cost, Model, Parameterisation, RowSink,
    block::{BlockRotation, ByEntries, DerivativeSums, reduce},
};
use crate::{
    observation::{Block, Turn},
    rotation::{self, cross_matrix, exp_with_jacobian, product},
    scalar::Scalar,
    triad::Triad,
};

/// Turns whose end directions are known.
#[derive(Clone, Copy, Debug)]
pub struct TurnModel<'a, T: Scalar, const P: usize> {
    /// The turns; their rates are nominal SI, rad/s.
    pub turns: &'a [Turn<'a, T>],
    /// Entries of gain and bias that are estimated.
    pub form: Parameterisation<P>,
}

/// What a gyroscope of some triad makes of blocks, one after the other: [`attitude`] of a turn whose blocks are not kept.
#[derive(Clone, Copy, Debug)]
pub struct Carrier<T: Scalar> {
    blocks: BlockRotation<T>,
    /// A b.
    still: Vector3<T>,
}

impl<T: Scalar> Carrier<T> {
    /// Of a triad, nominal SI in.
    pub fn new(triad: &Triad<T>) -> Self {
        Self { blocks: BlockRotation::new(triad), still: triad.gain * triad.bias }
    }

    /// Rotation vector of a block of some duration, s, rad: linear in the block's sums and its duration.
    #[inline]
    pub fn vector(&self, block: &Block<T>, duration: T) -> Vector3<T> {
        self.blocks.vector(block, duration, &self.still)
    }

    /// Turns an attitude on by a block of some duration, s.
    #[inline]
    pub fn carry(&self, c: &mut Matrix3<T>, block: &Block<T>, duration: T) {
        rotation::turn(c, &self.vector(block, duration));
    }

    /// The same. Returns M = C J_l(φ), of C before the block: where the block's rotation vector φ changes by δφ, every attitude
    /// after it is multiplied by `exp([M δφ]×)` from the left, to first order.
    #[inline]
    pub fn carry_with_derivative(&self, c: &mut Matrix3<T>, block: &Block<T>, duration: T) -> Matrix3<T> {
        let (step, jacobian) = exp_with_jacobian(&self.vector(block, duration));
        let m = product(c, &jacobian);
        *c = product(c, &step);
        m
    }
}

/// `C_after_before`: the attitude after the turn, as the product of its blocks.
pub fn attitude<T: Scalar>(triad: &Triad<T>, turn: &Turn<'_, T>) -> Matrix3<T> {
    let mut c = Matrix3::identity();
    let carrier = Carrier::new(triad);
    for (index, block) in turn.blocks.iter().enumerate() {
        carrier.carry(&mut c, block, turn.durations.get(index));
    }
    c
}

/// The attitude and the derivative of its rotation, in the frame before the turn.
fn attitude_with_derivative<T: Scalar>(triad: &Triad<T>, turn: &Turn<'_, T>) -> (Matrix3<T>, ByEntries<T>) {
    let mut c = Matrix3::identity();
    let mut sums = DerivativeSums::new();
    let carrier = Carrier::new(triad);
    for (index, block) in turn.blocks.iter().enumerate() {
        let duration = turn.durations.get(index);
        let (angle, coning) = reduce(&triad.bias, block, duration);
        let m = carrier.carry_with_derivative(&mut c, block, duration);
        sums.add(&m, &angle, &coning, block, duration);
    }
    (c, sums.by_entries(&triad.gain))
}

impl<T: Scalar, const P: usize> Model<T, P> for TurnModel<'_, T, P> {
    #[inline(never)]
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

/// An evaluation of [`TurnModel`]'s cost under way.
#[derive(Clone, Copy, Debug)]
pub struct TurnPass<T: Scalar> {
    rotation: BlockRotation<T>,
    /// A b.
    still: Vector3<T>,
    turn: usize,
    block: usize,
    attitude: Matrix3<T>,
    /// Σ |r|² of the turns before.
    sum: T,
}

/// The field form as a swarm's cost: mean |r|² of a turn, rad² to second order; NaN without turns. A block of it is
/// a block of a turn.
impl<T: Scalar, const P: usize> Cost<T, P> for TurnModel<'_, T, P> {
    type State = TurnPass<T>;

    fn begin(&self, theta: &SVector<T, P>) -> TurnPass<T> {
        let triad = self.form.triad(theta);
        TurnPass {
            rotation: BlockRotation::new(&triad),
            still: triad.gain * triad.bias,
            turn: 0,
            block: 0,
            attitude: Matrix3::identity(),
            sum: T::zero(),
        }
    }

    fn advance(&self, _: &SVector<T, P>, pass: &mut TurnPass<T>, budget: &mut usize) -> Option<T> {
        while let Some(turn) = self.turns.get(pass.turn) {
            let until = turn.blocks.len().min(pass.block.saturating_add(*budget));
            for (index, block) in turn.blocks.iter().enumerate().take(until).skip(pass.block) {
                let angle = pass.rotation.vector(block, turn.durations.get(index), &pass.still);
                rotation::turn(&mut pass.attitude, &angle);
            }
            *budget = budget.saturating_sub(until.saturating_sub(pass.block));
            pass.block = until;
            if pass.block < turn.blocks.len() {
                return None;
            }
            pass.sum += (pass.attitude.tr_mul(&turn.before) - turn.after).norm_squared();
            pass.turn += 1;
            pass.block = 0;
            pass.attitude = Matrix3::identity();
        }
        Some(pass.sum / T::whole(self.turns.len() as u32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        model::parameterisation::{FULL, FULL_GAIN},
        observation::{BlockBuilder, Durations},
        rotation::exp,
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
