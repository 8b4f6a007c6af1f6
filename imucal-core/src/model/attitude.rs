//! The gyroscope against attitudes that a rig's encoders give.
//!
//! ```text
//! ω̂      = A (ω_m − b − G f) − e
//! φ_k     = A s0 − T v + ½ cof(A) c − ½ (A s1) × v,   v = A (b + G f_k) + e_k
//! Ĉ       = C_0 Π exp([φ_k]×)
//! r = δφ  = log(C_refᵀ Ĉ),   J = mean |δφ|²
//! ∂δφ     = J_l⁻¹(δφ)ᵀ Ĉᵀ Σ_k Ĉ_k J_l(φ_k) ∂φ_k
//! ```
//!
//! | symbol | meaning | paper |
//! | --- | --- | --- |
//! | ω_m; s0, s1, c, T | raw rate, rad/s; its sums over a block ([`crate::observation::Block`]), and its duration | e_m |
//! | A, b | gain, with the mounting on the table, and bias, rad/s; cof(A) = det(A) A⁻ᵀ | K⁻¹, b |
//! | G, f | g-sensitivity, raw rad/s per m/s²; specific force, table axes, mean over the block | – |
//! | e | Earth rate, table axes, mean over the block, rad/s | C_n^p e^n |
//! | C_0, C_ref, Ĉ | attitude before the first block, reference, integrated: table `r` to base `p` | C_FMS |
//! | δφ | rotation from the reference to the integrated attitude, table axes, rad, at most π | – |
//!
//! Source: models.md 3, a reconstruction: of Secer & Barshan 2016 only the first two pages were at hand, which state
//! that the attitude integrated from the rates is compared with the simulator's and that a particle swarm searches.
//! The compression to blocks is exact to second order: over 100 s of slews of up to 150° it departs from the product
//! over samples by less than 1e-3° with blocks of 10 at 100 Hz (`tests/search`, which prints other sizes too).
//! A block costs 36 bytes in `f32`, 12 more with Earth rate, 12 more with g-sensitivity, and 16 for each reference.
//!
//! The cost has further minima where an error is whole turns, and is flat far from the lowest: search with
//! [`crate::solver::swarm`], or start from the bias of a rest, and finish with Levenberg–Marquardt.
//!
//! Not modelled: bias that wanders, errors of the rig, rates that change within a sample. Errors at successive
//! references have the noise before them in common, so a covariance that counts them as independent is too small.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::{
    Cost, Model, Parameterisation, RowSink,
    block::{BlockRotation, DerivativeSums, reduce},
    parameterisation::{ENTRIES, GYROSCOPE_ENTRIES},
};
use crate::{
    observation::{Block, Motion},
    rotation::{exp_with_jacobian, inverse_left_jacobian, matrix, product, quaternion, quaternion_log, turn},
    scalar::Scalar,
};

/// Motions with reference attitudes, and what is estimated from them: for Levenberg–Marquardt as a [`Model`], for a
/// swarm as a [`Cost`] (mean |δφ|², rad²; NaN without a reference), one block of it for each block of the motions.
#[derive(Clone, Copy, Debug)]
pub struct AttitudeModel<'a, T: Scalar, const P: usize> {
    /// The motions, each from its own known start.
    pub motions: &'a [Motion<'a, T>],
    /// Entries of gain, bias and g-sensitivity that are estimated.
    pub form: Parameterisation<P>,
}

/// A gyroscope's parameters, made ready for its blocks.
#[derive(Clone, Copy, Debug)]
struct Gyroscope<T: Scalar> {
    rotation: BlockRotation<T>,
    gain: Matrix3<T>,
    bias: Vector3<T>,
    /// A b.
    still: Vector3<T>,
    /// G, where it is estimated.
    sensitivity: Option<Matrix3<T>>,
}

impl<T: Scalar> Gyroscope<T> {
    fn new<const P: usize>(form: &Parameterisation<P>, theta: &SVector<T, P>) -> Self {
        let triad = form.triad(theta);
        Self {
            rotation: BlockRotation::new(&triad),
            gain: triad.gain,
            bias: triad.bias,
            still: triad.gain * triad.bias,
            sensitivity: form.has_sensitivity().then(|| form.sensitivity(theta)),
        }
    }

    /// β: the bias, and what specific force adds to it.
    #[inline]
    fn beta(&self, motion: &Motion<'_, T>, index: usize) -> Option<Vector3<T>> {
        let (sensitivity, force) = (self.sensitivity.as_ref()?, motion.force.get(index)?);
        Some(self.bias + sensitivity * force)
    }

    /// φ of the module's second equation.
    #[inline]
    fn vector(&self, motion: &Motion<'_, T>, index: usize, block: &Block<T>) -> Vector3<T> {
        let mut still = self.beta(motion, index).map_or(self.still, |beta| self.gain * beta);
        if let Some(earth) = motion.earth.get(index) {
            still += earth;
        }
        self.rotation.vector(block, motion.durations.get(index), &still)
    }
}

/// δφ of an attitude from a reference.
#[inline]
fn difference<T: Scalar>(reference: &nalgebra::Quaternion<T>, attitude: &Matrix3<T>) -> Vector3<T> {
    quaternion_log(&(reference.conjugate() * quaternion(attitude)))
}

/// Derivative of δφ by all entries of a gyroscope.
type ByEntries<T> = SMatrix<T, 3, GYROSCOPE_ENTRIES>;

/// Sums over the blocks so far, from which the derivative follows.
struct Derivative<T: Scalar> {
    triad: DerivativeSums<T>,
    /// Σ M ∂φ/∂b f_j.
    force: [Matrix3<T>; 3],
}

impl<T: Scalar> Derivative<T> {
    fn new() -> Self {
        Self { triad: DerivativeSums::new(), force: [Matrix3::zeros(); 3] }
    }

    /// Takes in a block with its M.
    fn add(
        &mut self,
        m: &Matrix3<T>,
        gyroscope: &Gyroscope<T>,
        motion: &Motion<'_, T>,
        at: (usize, &Block<T>),
    ) {
        let (index, block) = at;
        let duration = motion.durations.get(index);
        let (angle, coning) =
            reduce(&gyroscope.beta(motion, index).unwrap_or(gyroscope.bias), block, duration);
        self.triad.add(m, &angle, &coning, block, duration);
        if let Some(earth) = motion.earth.get(index) {
            self.triad.add_earth(m, block, earth);
        }
        if let (Some(_), Some(force)) = (&gyroscope.sensitivity, motion.force.get(index)) {
            let by_bias = m * gyroscope.rotation.by_bias(block, duration);
            for (sum, component) in self.force.iter_mut().zip(force.iter()) {
                *sum += by_bias * *component;
            }
        }
    }

    /// Of the attitude's rotation in the base's axes, by all entries.
    fn by_entries(&self, gain: &Matrix3<T>) -> ByEntries<T> {
        let mut by = ByEntries::zeros();
        by.fixed_columns_mut::<ENTRIES>(0).copy_from(&self.triad.by_entries(gain));
        for (column, sum) in self.force.iter().enumerate() {
            for row in 0..3 {
                by.set_column(ENTRIES + 3 * row + column, &sum.column(row));
            }
        }
        by
    }
}

impl<T: Scalar, const P: usize> Model<T, P> for AttitudeModel<'_, T, P> {
    #[inline(never)]
    fn rows<S: RowSink<T, P>>(&self, theta: &SVector<T, P>, sink: &mut S) {
        let gyroscope = Gyroscope::new(&self.form, theta);
        for motion in self.motions {
            let mut c = matrix(&motion.start);
            let mut sums = Derivative::new();
            let (mut index, mut reference) = (0, 0);
            while let Some((after, attitude)) = motion.reference(reference) {
                for block in motion.blocks.iter().take(after).skip(index) {
                    let phi = gyroscope.vector(motion, index, block);
                    if S::JACOBIAN {
                        let (step, jacobian) = exp_with_jacobian(&phi);
                        sums.add(&(c * jacobian), &gyroscope, motion, (index, block));
                        c = product(&c, &step);
                    } else {
                        turn(&mut c, &phi);
                    }
                    index += 1;
                }
                let residual = difference(attitude, &c);
                let by = if S::JACOBIAN {
                    inverse_left_jacobian(&residual).tr_mul(&c.tr_mul(&sums.by_entries(&gyroscope.gain)))
                } else {
                    ByEntries::zeros()
                };
                for (value, row) in residual.iter().zip(by.row_iter()) {
                    sink.row(*value, &self.form.select(&row.transpose()));
                }
                reference += 1;
            }
        }
    }

    fn independent_rows(&self) -> usize {
        let references =
            |motion: &Motion<'_, T>| (0..).take_while(|k| motion.reference(*k).is_some()).count();
        3 * self.motions.iter().map(references).sum::<usize>()
    }
}

/// An evaluation of [`AttitudeModel`]'s cost under way.
#[derive(Clone, Copy, Debug)]
pub struct AttitudePass<T: Scalar> {
    gyroscope: Gyroscope<T>,
    motion: usize,
    block: usize,
    reference: usize,
    attitude: Matrix3<T>,
    /// Σ |δφ|² so far, and its number of terms.
    sum: T,
    terms: u32,
}

impl<T: Scalar, const P: usize> AttitudeModel<'_, T, P> {
    fn start(&self, motion: usize) -> Matrix3<T> {
        self.motions.get(motion).map_or_else(Matrix3::identity, |motion| matrix(&motion.start))
    }
}

impl<T: Scalar, const P: usize> Cost<T, P> for AttitudeModel<'_, T, P> {
    type State = AttitudePass<T>;

    fn begin(&self, theta: &SVector<T, P>) -> AttitudePass<T> {
        AttitudePass {
            gyroscope: Gyroscope::new(&self.form, theta),
            motion: 0,
            block: 0,
            reference: 0,
            attitude: self.start(0),
            sum: T::zero(),
            terms: 0,
        }
    }

    fn advance(&self, _: &SVector<T, P>, pass: &mut AttitudePass<T>, budget: &mut usize) -> Option<T> {
        while let Some(motion) = self.motions.get(pass.motion) {
            let Some((after, reference)) = motion.reference(pass.reference) else {
                pass.motion += 1;
                (pass.block, pass.reference) = (0, 0);
                pass.attitude = self.start(pass.motion);
                continue;
            };
            let until = after.min(pass.block.saturating_add(*budget));
            let mut c = pass.attitude;
            for (index, block) in motion.blocks.iter().enumerate().take(until).skip(pass.block) {
                turn(&mut c, &pass.gyroscope.vector(motion, index, block));
            }
            pass.attitude = c;
            *budget = budget.saturating_sub(until.saturating_sub(pass.block));
            pass.block = pass.block.max(until);
            if pass.block < after {
                return None;
            }
            pass.sum += difference(reference, &c).norm_squared();
            pass.terms = pass.terms.saturating_add(1);
            pass.reference += 1;
        }
        Some(pass.sum / T::whole(pass.terms))
    }
}
