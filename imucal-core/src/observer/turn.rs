//! Turns: what the gyroscope saw from inside one rest to inside the next, in a fixed number of blocks.
//!
//! ```text
//! C(A, b) ≈ C_B(A, b) E        E = C_B(A₀, b₀)ᵀ C(A₀, b₀)
//! r       = Cᵀ u_before − u_after   →   C_Bᵀ u_before − E u_after     (of the same length)
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | C | attitude after the turn, as the product over blocks of [`FINE`] seconds |
//! | C_B | the same over B blocks, into which those were joined |
//! | A, b | gain and bias of the gyroscope |
//! | A₀, b₀ | the best known gain, nominal at first, and the usual rate of the rest before |
//! | E | [`ObservedTurn::remainder`]: what joining has lost at A₀, b₀ |
//! | u | direction of the specific force at rest, calibrated axes |
//!
//! Joined blocks lose the third order of their angle. At A₀ and b₀ nothing is lost, since E is exact there; near to them the
//! loss is a share, the error of A₀, of that of the B blocks. So a fit linearises a turn at any gain, in a tenth of the memory
//! that the blocks of its samples take. A turn that is full joins the two neighbours that lose least.
//!
//! A rest ends before it is seen to have ended: while it lasts, the last three quarters of a second are kept, and a turn
//! begins with them.
//!
//! Source: deferred correction (Stetter 1978, Numerische Mathematik 29), of the blocks of [`crate::observation::Block`]. The
//! error is asserted by `few_blocks_have_the_residual_of_all_samples_at_any_gain`. Not done here: g-sensitivity, which would
//! take the specific force along.

use heapless::Vec;
use nalgebra::{Matrix3, Vector3};

use super::{rest::Stage, ring::Ring};
use crate::{
    model::turn::Carrier,
    observation::{Block, BlockBuilder, Durations, Turn},
    rotation::{exp, log},
    scalar::Scalar,
    triad::Triad,
};

/// How long a block lasts before blocks are joined, s: a third of a quarter of the rest's window.
pub const FINE: f64 = 1.0 / 12.0;

/// A turn that has ended in a rest.
#[derive(Clone, Debug)]
pub struct ObservedTurn<T: Scalar, const B: usize> {
    blocks: Vec<Block<T>, B>,
    durations: Vec<T, B>,
    /// Rotation vector of E, rad.
    remainder: Vector3<T>,
}

impl<T: Scalar, const B: usize> ObservedTurn<T, B> {
    /// The turn between two directions of the specific force, unit vectors in calibrated axes.
    pub fn between(&self, before: Vector3<T>, after: Vector3<T>) -> Turn<'_, T> {
        let after = exp(&self.remainder) * after;
        Turn { blocks: &self.blocks, durations: Durations::Each(&self.durations), before, after }
    }

    /// Its blocks, of rates as measured, and how long each lasted, s.
    pub fn blocks(&self) -> impl Iterator<Item = (&Block<T>, T)> {
        self.blocks.iter().zip(self.durations.iter().copied())
    }

    /// Rotation vector that joining its blocks has lost, rad: of E.
    pub fn remainder(&self) -> Vector3<T> {
        self.remainder
    }
}

/// Blocks in succession, and the attitude after them at nominal gain.
#[derive(Clone, Debug)]
struct Path<T: Scalar, const B: usize> {
    blocks: Vec<Block<T>, B>,
    durations: Vec<T, B>,
    attitude: Matrix3<T>,
}

impl<T: Scalar, const B: usize> Path<T, B> {
    fn new() -> Self {
        const { assert!(B > 1) };
        Self { blocks: Vec::new(), durations: Vec::new(), attitude: Matrix3::identity() }
    }

    /// Goes on by a block.
    fn push(&mut self, block: &Block<T>, duration: T) {
        if self.blocks.is_full() {
            self.join_the_least();
        }
        // There is room: two have become one.
        let _ = self.blocks.push(*block);
        let _ = self.durations.push(duration);
    }

    /// Joins the two neighbours that lose least: the square of the third order, |a × b| (|a| + |b|), to a factor.
    fn join_the_least(&mut self) {
        let loss = |a: &Vector3<T>, b: &Vector3<T>| {
            a.cross(b).norm_squared() * (a.norm_squared() + b.norm_squared())
        };
        let pairs = self.blocks.iter().zip(self.blocks.iter().skip(1)).map(|(a, b)| loss(&a.s0, &b.s0));
        let none = (0, T::LARGEST);
        let (least, _) =
            pairs.enumerate().fold(none, |least, (at, sum)| if sum < least.1 { (at, sum) } else { least });
        let next = least.saturating_add(1);
        let gone = self.blocks.get(next).copied().zip(self.durations.get(next).copied());
        if let Some((block, duration)) = gone
            && let (Some(first), Some(lasted)) = (self.blocks.get_mut(least), self.durations.get_mut(least))
        {
            *first = first.join(*lasted, &block, duration);
            *lasted += duration;
            close(&mut self.blocks, next);
            close(&mut self.durations, next);
        }
    }

    fn turn(&self, reference: &Carrier<T>) -> ObservedTurn<T, B> {
        let (blocks, durations) = (self.blocks.clone(), self.durations.clone());
        let mut turn = ObservedTurn { blocks, durations, remainder: Vector3::zeros() };
        let mut joined = Matrix3::identity();
        turn.blocks().for_each(|(block, duration)| reference.carry(&mut joined, block, duration));
        turn.remainder = log(&joined.tr_mul(&self.attitude));
        turn
    }
}

/// Takes a value out of a list, where there is one. (The list's own way panics where there is none.)
fn close<V: Copy, const N: usize>(list: &mut Vec<V, N>, mut at: usize) {
    while let Some(next) = list.get(at.saturating_add(1)).copied() {
        if let Some(slot) = list.get_mut(at) {
            *slot = next;
        }
        at = at.saturating_add(1);
    }
    list.pop();
}

/// A quarter of a second at rest.
#[derive(Clone, Copy, Debug)]
struct Quarter<T: Scalar> {
    block: Block<T>,
    duration: T,
    attitude: Matrix3<T>,
}

impl<T: Scalar> Quarter<T> {
    fn new() -> Self {
        let none = Vector3::zeros();
        Self {
            block: Block { s0: none, s1: none, c: none },
            duration: T::zero(),
            attitude: Matrix3::identity(),
        }
    }

    fn push(&mut self, block: &Block<T>, duration: T) {
        self.block = self.block.join(self.duration, block, duration);
        self.duration += duration;
    }
}

/// Where samples go.
#[derive(Clone, Debug)]
enum Way<T: Scalar, const B: usize> {
    /// Nowhere: since the last rest something is missing, or there was none.
    Lost,
    /// At rest: the quarter that goes on, and the last three.
    Resting(Ring<Quarter<T>>),
    /// From a rest; with the turn up to where the sensor was first seen to be still again.
    Turning(Path<T, B>, Option<ObservedTurn<T, B>>),
}

/// Gathers turns as samples arrive; [`super::inertial`] says when a rest goes on.
#[derive(Clone, Debug)]
pub struct TurnObserver<T: Scalar, const B: usize> {
    way: Way<T, B>,
    builder: BlockBuilder<T>,
    /// The last rate, and half the time since the one before it, s.
    held: Option<(Vector3<T>, T)>,
    /// By A₀ and b₀ of the turn under way.
    reference: Carrier<T>,
}

impl<T: Scalar, const B: usize> Default for TurnObserver<T, B> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Scalar, const B: usize> TurnObserver<T, B> {
    /// Before the first rest.
    pub fn new() -> Self {
        let reference = Carrier::new(&Triad::identity());
        Self { way: Way::Lost, builder: BlockBuilder::default(), held: None, reference }
    }

    /// Takes a rate `w_ns_s` in, rad/s, that was measured `since` s after the one before. It is held from half-way after the one
    /// before to half-way before the next.
    #[inline]
    pub fn push(&mut self, rate: &Vector3<T>, since: T) {
        if matches!(self.way, Way::Lost) {
            return;
        }
        let half = since * T::of(0.5);
        if let Some((before, earlier)) = self.held.replace((*rate, half)) {
            self.builder.push(&before, earlier + half);
            // At rest a quarter turns by so little that it is one block.
            if self.builder.duration() >= T::of(FINE) && matches!(self.way, Way::Turning(..)) {
                self.block();
            }
        }
    }

    /// Something is missing: the turn under way is none. True where there was one.
    pub fn interrupt(&mut self) -> bool {
        let turning = matches!(self.way, Way::Turning(..));
        // A rate from before the gap belongs to no turn after it.
        (self.way, self.held) = (Way::Lost, None);
        turning
    }

    /// A quarter of a second has ended, after which the sensor is at that stage. The best known triad has a gain of any quality,
    /// and for bias the usual rate at rest, rad/s. Gives the turn, where a rest after one was now seen to be one.
    pub fn quarter(&mut self, stage: Stage, best: &Triad<T>) -> Option<ObservedTurn<T, B>> {
        if self.builder.count() > 0 {
            self.block();
        }
        match (&mut self.way, stage) {
            (Way::Lost, Stage::Resting) => {
                self.rest(best);
                None
            }
            (Way::Lost, _) => None,
            (Way::Resting(quarters), Stage::Resting) => {
                quarters.turn(Quarter::new());
                None
            }
            (Way::Resting(quarters), _) => {
                let mut path = Path::new();
                for quarter in [3, 2, 1, 0].into_iter().filter_map(|back| quarters.before(back)) {
                    path.attitude *= quarter.attitude;
                    path.push(&quarter.block, quarter.duration);
                }
                self.way = Way::Turning(path, None);
                None
            }
            (Way::Turning(_, arrived), Stage::Moving) => {
                *arrived = None;
                None
            }
            (Way::Turning(path, arrived), Stage::Still) => {
                arrived.get_or_insert_with(|| path.turn(&self.reference));
                None
            }
            (Way::Turning(path, arrived), Stage::Resting) => {
                let turn = arrived.take().unwrap_or_else(|| path.turn(&self.reference));
                self.rest(best);
                Some(turn)
            }
        }
    }

    fn rest(&mut self, best: &Triad<T>) {
        self.reference = Carrier::new(best);
        self.way = Way::Resting(Ring::new(Quarter::new()));
    }

    /// Ends a block.
    fn block(&mut self) {
        let (block, duration) = self.builder.finish();
        match &mut self.way {
            Way::Lost => {}
            Way::Resting(quarters) => {
                let now = quarters.now();
                self.reference.carry(&mut now.attitude, &block, duration);
                now.push(&block, duration);
            }
            Way::Turning(path, _) => {
                self.reference.carry(&mut path.attitude, &block, duration);
                path.push(&block, duration);
            }
        }
    }
}

#[cfg(test)]
mod tests;
