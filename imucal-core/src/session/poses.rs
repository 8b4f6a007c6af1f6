//! What is kept of each rest: means, and the turn that led to it, in two hundred bytes.
//!
//! A turn's blocks are kept less the usual rate of the rest before, b₀, so that their first moments are no longer needed:
//! `c − s1 × b₀` and `s0 − T b₀` are all that a gain acts on, and a change of the bias by δ takes `T δ` off the angle (its part
//! by s1, `s1 × δ`, is below 1e-6 rad² for the drift of a rest to the next).

use heapless::Vec;
use nalgebra::Vector3;

use crate::{
    observation::{Block, Durations, Turn},
    observer::{rest::ObservedRest, turn::ObservedTurn},
    rotation::exp,
    triad::Triad,
};

/// What a difference of temperature takes off the likeness of two rests, per K²: for 10 K as much as 30° between their directions.
const BY_WARMTH: f32 = 1.34e-3;

/// A turn, as it is kept.
#[derive(Clone, Copy, Debug)]
struct KeptTurn<const B: usize> {
    /// s0 and c of each block, less b₀.
    blocks: [(Vector3<f32>, Vector3<f32>); B],
    /// How long each lasted, s; zero beyond the last.
    durations: [f32; B],
    /// Rotation vector of what joining has lost, rad.
    remainder: Vector3<f32>,
    /// Mean specific force of the rest before, nominal.
    before: Vector3<f32>,
    /// Mean rate of the rest before, b₀, rad/s.
    bias: Vector3<f32>,
}

/// A rest that is kept.
#[derive(Clone, Copy, Debug)]
pub struct Pose<const B: usize> {
    /// Mean specific force, nominal, m/s².
    pub acc: Vector3<f32>,
    /// Mean rate, nominal, rad/s; NaN without a gyroscope.
    pub gyr: Vector3<f32>,
    /// Mean field, nominal, µT; NaN without a magnetometer.
    pub field: Vector3<f32>,
    /// Mean temperature, °C; NaN where it is not measured.
    pub temperature: f32,
    /// Samples that were averaged.
    pub samples: u32,
    /// Variance of its mean specific force by white noise, mean of the axes, (m/s²)².
    pub(super) acc_variance: f32,
    /// The same of its mean rate, (rad/s)².
    pub(super) rate_variance: f32,
    /// Variance of its noisiest window, (m/s²)².
    noise: f32,
    turn: Option<KeptTurn<B>>,
}

/// Rests and turns of a session, `N` at the most.
#[derive(Clone, Debug)]
pub struct Poses<const N: usize, const B: usize> {
    list: Vec<Pose<B>, N>,
    /// The last rest, kept or forgotten since; `None` where the chain is broken.
    last: Option<(Vector3<f32>, Vector3<f32>)>,
    /// Rests that had to go.
    forgotten: u16,
}

impl<const N: usize, const B: usize> Default for Poses<N, B> {
    fn default() -> Self {
        const { assert!(N <= 64 && N > 1) };
        Self { list: Vec::new(), last: None, forgotten: 0 }
    }
}

impl<const N: usize, const B: usize> Poses<N, B> {
    /// A rest has ended; `turn` led to it from the last one, where it was seen whole.
    pub(super) fn push(
        &mut self,
        observed: &ObservedRest<f32>,
        field: Option<Vector3<f32>>,
        turn: Option<&ObservedTurn<f32, B>>,
    ) {
        let missing = Vector3::repeat(f32::NAN);
        let rest = &observed.rest;
        let (acc, rates) = (rest.acc.mean(), rest.gyr.count());
        let gyr = if rates > 0 { rest.gyr.mean() } else { missing };
        let turn = turn.zip(self.last).map(|(turn, (before, bias))| KeptTurn::new(turn, before, bias));
        self.last = (rates > 0).then_some((acc, gyr));
        if self.list.is_full() {
            self.forget();
        }
        let pose = Pose {
            acc,
            gyr,
            field: field.unwrap_or(missing),
            temperature: rest.temperature,
            samples: rest.acc.count(),
            acc_variance: rest.acc.variance().sum() / (3 * rest.acc.count().max(1)) as f32,
            rate_variance: rest.gyr.variance().sum() / (3 * rates.max(1)) as f32,
            noise: observed.noise,
            turn,
        };
        // There is room: one was forgotten.
        let _ = self.list.push(pose);
    }

    /// Between the last rest and the next something is missing.
    pub(super) fn break_off(&mut self) {
        self.last = None;
    }

    /// Of the two rests that are nearest to one another, the one without a turn goes, or else the older.
    fn forget(&mut self) {
        let mut nearest = (0, 0, f32::NEG_INFINITY);
        for (i, a) in self.list.iter().enumerate() {
            for (j, b) in self.list.iter().enumerate().take(i) {
                let alike = a.likeness(b);
                if alike > nearest.2 {
                    nearest = (j, i, alike);
                }
            }
        }
        let (older, newer, _) = nearest;
        let has_turn = |at: usize| self.list.get(at).is_some_and(Pose::has_turn);
        let gone = if has_turn(older) && !has_turn(newer) { newer } else { older };
        if gone < self.list.len() {
            self.list.remove(gone);
        }
        self.forgotten = self.forgotten.saturating_add(1);
    }

    /// Rests noisier than this are none: a quieter one has come.
    pub(super) fn retain_quieter(&mut self, most: f32) -> usize {
        let before = self.list.len();
        self.list.retain(|pose| pose.noise <= most);
        before.saturating_sub(self.list.len())
    }

    /// As if a rest had been without a magnetometer.
    #[cfg(test)]
    pub(super) fn forget_field(&mut self, at: usize) {
        self.list[at].field = Vector3::repeat(f32::NAN);
    }

    /// What is kept, in the order of its coming.
    pub fn list(&self) -> &[Pose<B>] {
        &self.list
    }

    /// Mean temperature of the rests that have one, °C; NaN without any.
    pub(super) fn temperature(&self) -> f32 {
        let measured = || self.list.iter().map(|pose| pose.temperature).filter(|value| value.is_finite());
        measured().sum::<f32>() / measured().count() as f32
    }

    /// Rests that had to go, since there was no more room.
    pub fn forgotten(&self) -> u16 {
        self.forgotten
    }
}

impl<const B: usize> Pose<B> {
    /// Nominal direction of the specific force, unit vector.
    pub(super) fn direction(&self) -> Vector3<f32> {
        self.acc / libm::sqrtf(self.acc.norm_squared())
    }

    /// How near two rests are: the cosine between their directions, less what temperatures apart take off it.
    fn likeness(&self, other: &Self) -> f32 {
        let apart = self.temperature - other.temperature;
        let warmth = if apart.is_finite() { BY_WARMTH * apart * apart } else { 0.0 };
        self.direction().dot(&other.direction()) - warmth
    }

    /// The field was measured.
    pub(super) fn has_field(&self) -> bool {
        self.field.x.is_finite()
    }

    /// A turn led to it.
    pub fn has_turn(&self) -> bool {
        self.turn.is_some()
    }

    /// Directions of the specific force before and after the turn that led to it, calibrated axes.
    pub(super) fn ends(&self, acc: &Triad<f32>) -> Option<[Vector3<f32>; 2]> {
        let turn = self.turn.as_ref()?;
        Some([turn.before, self.acc].map(|mean| unit(&acc.correct(&mean))))
    }

    /// Calls with the turn that led to it, its rates less the mean bias, or less the mean of the rests at both ends.
    pub(super) fn with_turn<R>(
        &self,
        acc: &Triad<f32>,
        mean: Option<&Vector3<f32>>,
        call: impl FnOnce(&Turn<'_, f32>) -> R,
    ) -> Option<R> {
        let (turn, [before, after]) = (self.turn.as_ref()?, self.ends(acc)?);
        let off = match mean {
            Some(mean) => mean - turn.bias,
            None => (self.gyr - turn.bias) * 0.5,
        };
        let none = Vector3::zeros();
        let mut blocks = [Block { s0: none, s1: none, c: none }; B];
        for ((block, (s0, c)), duration) in blocks.iter_mut().zip(&turn.blocks).zip(&turn.durations) {
            (block.s0, block.c) = (s0 - off * *duration, *c);
        }
        let durations = Durations::Each(&turn.durations);
        Some(call(&Turn { blocks: &blocks, durations, before, after: exp(&turn.remainder) * after }))
    }
}

impl<const B: usize> KeptTurn<B> {
    fn new(turn: &ObservedTurn<f32, B>, before: Vector3<f32>, bias: Vector3<f32>) -> Self {
        let none = Vector3::zeros();
        let mut kept = Self {
            blocks: [(none, none); B],
            durations: [0.0; B],
            remainder: turn.remainder(),
            before,
            bias,
        };
        for ((slot, lasted), (block, duration)) in
            kept.blocks.iter_mut().zip(&mut kept.durations).zip(turn.blocks())
        {
            let block = block.less(&bias, duration);
            (*slot, *lasted) = ((block.s0, block.c), duration);
        }
        kept
    }
}

/// Of any length but zero.
#[inline]
pub(super) fn unit(v: &Vector3<f32>) -> Vector3<f32> {
    v / libm::sqrtf(v.norm_squared())
}
