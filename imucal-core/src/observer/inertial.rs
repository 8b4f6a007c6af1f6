//! Accelerometer and gyroscope together: rests, and the turns that lead from one to the next.
//!
//! A turn is seen once the rest after it has lasted a second, and that rest once it has ended. What breaks the chain between two
//! rests (a gap, a clipped sample, a rest that proves too noisy) is an event of its own, so that nothing is joined across it.

use nalgebra::Matrix3;

use super::{
    Sample, is_finite,
    rest::{ObservedRest, RestObserver, RestSettings, Stage},
    turn::{ObservedTurn, TurnObserver},
};
use crate::{scalar::Scalar, triad::Triad};

/// What a sample has shown.
#[derive(Clone, Debug)]
pub enum Seen<T: Scalar, const B: usize> {
    /// Nothing new.
    Nothing,
    /// A rest has ended.
    Rest(ObservedRest<T>),
    /// What was still is no rest: it was too short, or noisier than a quieter stretch later on allows.
    NoRest,
    /// A turn from the last rest to the one that goes on.
    Turn(ObservedTurn<T, B>),
}

/// Finds rests and turns in samples as they arrive.
#[derive(Clone, Debug)]
pub struct InertialObserver<T: Scalar, const B: usize> {
    rests: RestObserver<T>,
    turns: TurnObserver<T, B>,
    /// The gyroscope's gain as far as it is known.
    gain: Matrix3<T>,
    /// Time of the last rate, µs.
    last: Option<u64>,
    /// Turns that were broken off.
    broken: u16,
}

impl<T: Scalar, const B: usize> Default for InertialObserver<T, B> {
    fn default() -> Self {
        Self::new(RestSettings::default())
    }
}

impl<T: Scalar, const B: usize> InertialObserver<T, B> {
    /// Before the first sample.
    pub fn new(settings: RestSettings<T>) -> Self {
        Self {
            rests: RestObserver::new(settings),
            turns: TurnObserver::new(),
            gain: Matrix3::identity(),
            last: None,
            broken: 0,
        }
    }

    /// Takes a sample in.
    #[inline]
    pub fn push(&mut self, sample: &Sample<T>) -> Seen<T, B> {
        if self.goes_on(sample) { Seen::Nothing } else { self.turn_over(sample) }
    }

    /// Takes in a sample that shows nothing new; false where it may, and is to be taken by [`Self::turn_over`].
    #[inline]
    pub(crate) fn goes_on(&mut self, sample: &Sample<T>) -> bool {
        let goes_on = self.rests.goes_on(sample);
        if goes_on {
            self.follow(sample);
        }
        goes_on
    }

    /// A quarter of a second has ended before a sample.
    #[inline(never)]
    pub(crate) fn turn_over(&mut self, sample: &Sample<T>) -> Seen<T, B> {
        let (stage, quarters) = (self.rests.stage(), self.rests.quarters());
        let ended = self.rests.turn_over(sample);
        let best =
            (self.rests.quarters() != quarters).then(|| Triad { gain: self.gain, bias: self.rests.rate() });
        let turn = best.and_then(|best| self.turns.quarter(self.rests.stage(), &best));
        self.follow(sample);
        // What is seen is large: it is made where it is returned, and nothing of it where there is nothing.
        if let Some(turn) = turn {
            return Seen::Turn(turn);
        }
        match ended {
            Some(rest) => Seen::Rest(rest),
            None if stage != Stage::Moving && self.rests.stage() == Stage::Moving => Seen::NoRest,
            None => Seen::Nothing,
        }
    }

    /// The rest that goes on, when no more samples come.
    pub fn finish(&mut self) -> Option<ObservedRest<T>> {
        self.broken = self.broken.saturating_add(u16::from(self.turns.interrupt()));
        self.last = None;
        self.rests.finish()
    }

    /// A sample was beyond the sensor's range: what it turned by is not known.
    pub fn interrupt(&mut self) {
        self.broken = self.broken.saturating_add(u16::from(self.turns.interrupt()));
    }

    /// The gyroscope's gain is better known: what turns lose from now on is smaller.
    pub fn set_gain(&mut self, gain: &Matrix3<T>) {
        self.gain = *gain;
    }

    /// The rests.
    pub fn rests(&self) -> &RestObserver<T> {
        &self.rests
    }

    /// Turns that a gap or a clipped sample has broken off.
    pub fn broken(&self) -> u16 {
        self.broken
    }

    /// Takes the rate of a sample into the turn.
    #[inline]
    fn follow(&mut self, sample: &Sample<T>) {
        // One that is missing is bridged by its neighbours.
        let Some(rate) = sample.gyr.as_ref().filter(|rate| is_finite(rate)) else { return };
        let Some(last) = self.last.replace(sample.time) else {
            return self.turns.push(rate, T::zero());
        };
        let since = sample.time.wrapping_sub(last);
        if sample.time < last || since > self.rests.gap() {
            return self.interrupt();
        }
        let seconds = T::whole(u32::try_from(since).unwrap_or(u32::MAX)) * T::of(1e-6);
        self.turns.push(rate, seconds);
    }
}
