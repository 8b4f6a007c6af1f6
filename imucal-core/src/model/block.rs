//! What a gyroscope's triad makes of compressed blocks: one formula for every model that integrates them.
//!
//! ```text
//! φ = A s0 − T v + ½ cof(A) c − ½ (A s1) × v,   v = A β + e        the block's rotation vector
//! C ← C exp([φ]×)
//! ∂C: C(A + δA, b + δb) = exp([Σ M_k φ'_k]×) C,     M_k = C_k J_l(φ_k)
//! ```
//!
//! | symbol | meaning | paper |
//! | --- | --- | --- |
//! | s0, s1, c, T | sums over a block of samples ([`Block`]), rad, rad·s, rad², and its duration, s | – |
//! | A, β | gain, and bias with whatever else is constant over a block, raw rad/s | K⁻¹, b |
//! | e | Earth rate, calibrated axes, mean over the block, rad/s; zero where it is part of the bias | Ω |
//! | v | rate that the block reads while nothing turns, calibrated, rad/s | – |
//! | C | attitude before the block; φ' the derivative of φ by an entry of A or b | Ĉ |
//!
//! This is `A (s0 − T β') + ½ cof(A) (c − s1 × β')` with β' = β + A⁻¹ e, written out by cof(A)(x × y) = Ax × Ay: so
//! no inverse is taken, and all that is constant over a block is one vector.
//!
//! Source: models.md 3 (a reconstruction of Secer & Barshan 2016). Not modelled: rates that change within a sample,
//! and the third order of a block (see [`super::attitude`] for its size).

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::parameterisation::ENTRIES;
use crate::{
    observation::Block,
    rotation::{cross_matrix, image, product},
    scalar::Scalar,
    triad::Triad,
};

/// Derivative of a rotation vector by the twelve entries of a triad.
pub(super) type ByEntries<T> = SMatrix<T, 3, ENTRIES>;

#[inline]
fn columns<T: Scalar>(a: &Matrix3<T>) -> [Vector3<T>; 3] {
    [a.column(0).into_owned(), a.column(1).into_owned(), a.column(2).into_owned()]
}

/// What a triad does to every block.
#[derive(Clone, Copy, Debug)]
pub(super) struct BlockRotation<T: Scalar> {
    gain: Matrix3<T>,
    /// cof(A), whose columns are the cross products of A's.
    cofactor: Matrix3<T>,
}

impl<T: Scalar> BlockRotation<T> {
    pub(super) fn new(triad: &Triad<T>) -> Self {
        Self { gain: triad.gain, cofactor: Self::cofactor(&triad.gain) }
    }

    fn cofactor(gain: &Matrix3<T>) -> Matrix3<T> {
        let [x, y, z] = columns(gain);
        Matrix3::from_columns(&[y.cross(&z), z.cross(&x), x.cross(&y)])
    }

    /// φ of the module's first equation, less what stands still: v.
    #[inline]
    pub(super) fn vector(&self, block: &Block<T>, duration: T, still: &Vector3<T>) -> Vector3<T> {
        // By components, for the same reason as `image`.
        let (s, v) = (block, still);
        let (angle, moment, coning) =
            (image(&self.gain, &s.s0), image(&self.gain, &s.s1), image(&self.cofactor, &s.c));
        let half = T::of(0.5);
        Vector3::new(
            angle.x - v.x * duration + (coning.x - (moment.y * v.z - moment.z * v.y)) * half,
            angle.y - v.y * duration + (coning.y - (moment.z * v.x - moment.x * v.z)) * half,
            angle.z - v.z * duration + (coning.z - (moment.x * v.y - moment.y * v.x)) * half,
        )
    }

    /// Derivative of φ by the bias: −T A − ½ cof(A) \[s1\]×.
    #[inline]
    pub(super) fn by_bias(&self, block: &Block<T>, duration: T) -> Matrix3<T> {
        -(self.gain * duration) - self.cofactor * cross_matrix(&block.s1) * T::of(0.5)
    }
}

/// What the derivative by the gain is made of: s0 − T β and ½ (c − s1 × β).
#[inline]
pub(super) fn reduce<T: Scalar>(
    bias: &Vector3<T>,
    block: &Block<T>,
    duration: T,
) -> (Vector3<T>, Vector3<T>) {
    let less = block.less(bias, duration);
    (less.s0, less.c * T::of(0.5))
}

/// Sums over a run of blocks from which the derivative by all twelve entries follows at its end.
///
/// A block adds M φ' to the derivative, M = C J_l(φ), and φ' is linear in the block's few numbers: so M is summed
/// against each of them, and the gain's and bias's part is multiplied on once a run instead of once a block.
pub(super) struct DerivativeSums<T: Scalar> {
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
    pub(super) fn new() -> Self {
        let none = [Matrix3::zeros(); 3];
        Self { angle: none, coning: none, moment: none, time: Matrix3::zeros() }
    }

    #[inline]
    pub(super) fn add(
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

    /// Adds what the Earth rate taken out of the block just added changes: −½ (δA s1) × e, by δA.
    #[inline]
    pub(super) fn add_earth(&mut self, m: &Matrix3<T>, block: &Block<T>, earth: &Vector3<T>) {
        let turned = m * cross_matrix(&(earth * T::of(0.5)));
        for (sum, moment) in self.angle.iter_mut().zip(block.s1.iter()) {
            *sum += turned * *moment;
        }
    }

    /// Derivative by the gain's nine entries (rows) and the bias.
    pub(super) fn by_entries(&self, gain: &Matrix3<T>) -> ByEntries<T> {
        let [x, y, z] = columns(gain);
        let [cx, cy, cz] = [x, y, z].map(|c| cross_matrix(&c));
        let [kx, ky, kz] = self.coning;
        let commuted = |a, y, b, x| product(a, y) - product(b, x);
        let by_cofactor =
            [commuted(&ky, &cz, &kz, &cy), commuted(&kz, &cx, &kx, &cz), commuted(&kx, &cy, &ky, &cx)];
        let mut by = ByEntries::zeros();
        for (column, (angle, cofactor)) in self.angle.iter().zip(by_cofactor.iter()).enumerate() {
            let part = angle + cofactor;
            for row in 0..3 {
                by.set_column(3 * row + column, &part.column(row));
            }
        }
        let cofactor = BlockRotation::cofactor(gain);
        let [mx, my, mz] = self.moment;
        let across = |m, axis| product(&product(m, &cofactor), &cross_matrix(&axis));
        let moment = across(&mx, Vector3::x()) + across(&my, Vector3::y()) + across(&mz, Vector3::z());
        by.fixed_columns_mut::<3>(9).copy_from(&(-product(&self.time, gain) - moment * T::of(0.5)));
        by
    }
}
