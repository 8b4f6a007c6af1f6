//! Rests: stretches in which the accelerometer shows its own noise and nothing else.
//!
//! Samples are gathered into quarters of a window of one second. The window's variance, the sum of the axes', is compared with
//! a multiple of that of the quietest window so far:
//!
//! ```text
//! σ² = Σ_axes Var(f over four quarters)      still: σ² ≤ m · σ²_q,  |w̄ − b| ≤ w_0,  Σ_axes Var(w) ≤ w_1²
//! b ← b + clamp(w̄ − b, ±s)
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | m | [`RestSettings::multiple`] |
//! | σ²_q | variance of a window at rest: that of the quietest so far, or what the accelerometer's step hides (`rest/noise.rs`) |
//! | w̄ | mean rate of the window |
//! | b | median rate of the windows in which the accelerometer is still, followed by steps s (the first step reaches it) |
//! | w_0 | [`RestSettings::turning`]; of the first still window, against zero, [`LARGEST_OFFSET`] |
//! | w_1 | [`SWINGING`]: a swing about the vertical comes back, and has no mean |
//!
//! A rest holds the quarters between the middles of its first and its last still window, so that it ends half a window before a
//! motion begins. It lasts a second at least. A rest that is noisier than the multiple of a quieter window which came later is
//! none.
//!
//! Source: Tedaldi, Pretto and Menegatti 2014 (ICRA), section IV, for a recording; causal and of bounded memory here. Not done
//! here: another multiple afterwards, and what a recording's first and last half window hold.

use nalgebra::Vector3;

mod noise;
mod window;

use super::{Sample, ring::Ring};
use crate::{
    observation::{Moments, Rest},
    scalar::Scalar,
};
use noise::RestNoise;
use window::{Window, window};

/// A quarter of the window, µs.
pub const QUARTER: u64 = 250_000;
/// Quarters that a rest holds at least: one second.
pub const SHORTEST: u8 = 4;
/// Noisier than this nothing is at rest, however long it lasts, (m/s²)².
pub const NOISIEST: f64 = 0.25;
/// A gyroscope whose rates deviate by more than this from their mean swings, rad/s (6°/s): ten times what most show at rest, and more
/// than a hand that holds still does.
pub const SWINGING: f64 = 0.1;
/// Largest mean rate of the first still window, rad/s (29°/s): beyond the offset of any gyroscope, it turns.
pub const LARGEST_OFFSET: f64 = 0.5;
/// Time from one sample to the next that is so many times the usual one breaks a window.
const GAP: u64 = 5;
/// Steps by which the usual rate follows that of a window, rad/s: where they agree within [`RestSettings::turning`], and where
/// they do not, so that a slow turn is not soon taken for rest.
const STEPS: (f64, f64) = (1e-3, 2e-4);

/// When something is still.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestSettings<T> {
    /// Variance of a window allowed, as a multiple of the quietest one's. Larger: a trembling hand is at rest, and a slow start
    /// of a motion belongs to it.
    pub multiple: T,
    /// Least variance that the quietest window counts as, (m/s²)².
    pub least_variance: T,
    /// Mean rate allowed, against the usual one at rest, rad/s. Larger: a slow turn about the vertical is a rest.
    pub turning: T,
}

impl<T: Scalar> Default for RestSettings<T> {
    fn default() -> Self {
        Self { multiple: T::of(6.0), least_variance: T::of(1e-5), turning: T::of(0.03) }
    }
}

/// What the sensor does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// It moves, or nothing is known yet.
    Moving,
    /// Its last second was still.
    Still,
    /// It has been still for long enough to be at rest.
    Resting,
}

/// A rest that has ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObservedRest<T: Scalar> {
    /// The rest.
    pub rest: Rest<T>,
    /// From when it lasted on the IMU's clock, µs.
    pub start: u64,
    /// Until when, µs.
    pub end: u64,
    /// Variance of its noisiest window, (m/s²)².
    pub noise: T,
}

/// Samples of a quarter of a window, or of the quarters of a rest.
#[derive(Clone, Copy, Debug)]
struct Stretch<T: Scalar> {
    acc: Moments<T>,
    gyr: Moments<T>,
    temperature: T,
    temperatures: u32,
    rows: u32,
    start: u64,
    end: u64,
    /// A gap lies in it, or too few of its samples are whole.
    broken: bool,
}

impl<T: Scalar> Stretch<T> {
    fn new(start: u64) -> Self {
        Self {
            acc: Moments::default(),
            gyr: Moments::default(),
            temperature: T::zero(),
            temperatures: 0,
            rows: 0,
            start,
            end: start,
            broken: false,
        }
    }

    #[inline]
    fn push(&mut self, sample: &Sample<T>) {
        // Of a quarter: four billion samples of one time would come round.
        self.rows = self.rows.wrapping_add(1);
        if sample.is_whole() {
            self.acc.take(&sample.acc);
            if let Some(rate) = &sample.gyr {
                self.gyr.take(rate);
            }
        }
        if let Some(temperature) = sample.temperature.filter(|value| value.finite()) {
            self.temperature += temperature;
            self.temperatures = self.temperatures.wrapping_add(1);
        }
    }

    fn join(&mut self, next: &Self) {
        self.acc = self.acc.join(&next.acc);
        self.gyr = self.gyr.join(&next.gyr);
        self.temperature += next.temperature;
        self.temperatures = self.temperatures.saturating_add(next.temperatures);
        self.rows = self.rows.saturating_add(next.rows);
        self.end = next.end;
        self.broken |= next.broken;
    }

    /// A gap lies in it, or more than a fifth of its samples are not whole.
    fn is_broken(&self) -> bool {
        let whole = u64::from(self.acc.count());
        self.broken || whole < 2 || 5 * whole < 4 * u64::from(self.rows)
    }

    fn rest(&self) -> Rest<T> {
        let middle = self.start.midpoint(self.end) / 1000;
        let time = T::whole(u32::try_from(middle).unwrap_or(u32::MAX)) / T::whole(1000);
        // Zero by zero where none was measured.
        let temperature = self.temperature / T::whole(self.temperatures);
        Rest { time, acc: self.acc, gyr: self.gyr, temperature }
    }
}

/// A rest that goes on.
#[derive(Clone, Copy, Debug)]
struct Lasting<T: Scalar> {
    held: Option<Stretch<T>>,
    quarters: u8,
    noise: T,
}

/// Finds rests in samples as they arrive.
#[derive(Clone, Copy, Debug)]
pub struct RestObserver<T: Scalar> {
    settings: RestSettings<T>,
    /// The quarter that goes on, and the last three whole ones.
    stretches: Ring<Stretch<T>>,
    /// Time of the last sample, µs, and that at which the quarter ends; 0 where none goes on.
    last: u64,
    until: u64,
    /// Time between two samples beyond which there is a gap, µs; the largest there is before the usual one is known.
    gap: u64,
    quarters: u32,
    noise: RestNoise<T>,
    /// First sample of the accelerometer in the quarter that goes on, m/s².
    first: Vector3<T>,
    /// Usual rate of the windows in which the accelerometer is still, rad/s.
    rate: Option<Vector3<T>>,
    lasting: Option<Lasting<T>>,
}

impl<T: Scalar> Default for RestObserver<T> {
    fn default() -> Self {
        Self::new(RestSettings::default())
    }
}

impl<T: Scalar> RestObserver<T> {
    /// Before the first sample.
    pub fn new(settings: RestSettings<T>) -> Self {
        Self {
            settings,
            stretches: Ring::new(Stretch::new(0)),
            last: 0,
            until: 0,
            gap: u64::MAX,
            quarters: 0,
            noise: RestNoise::default(),
            first: Vector3::zeros(),
            rate: None,
            lasting: None,
        }
    }

    /// Takes a sample in; a rest, when this sample shows that one has ended.
    pub fn push(&mut self, sample: &Sample<T>) -> Option<ObservedRest<T>> {
        if self.goes_on(sample) { None } else { self.turn_over(sample) }
    }

    /// Takes in a sample of the quarter that goes on; false where it is of none. It is short, since it is for nearly all samples.
    #[inline]
    pub(super) fn goes_on(&mut self, sample: &Sample<T>) -> bool {
        if sample.time < self.last || sample.time >= self.until {
            return false;
        }
        let now = self.stretches.now();
        now.broken |= sample.time.wrapping_sub(self.last) > self.gap;
        self.last = sample.time;
        now.push(sample);
        true
    }

    /// Ends the quarter before a sample, and begins the next.
    #[inline(never)]
    pub(super) fn turn_over(&mut self, sample: &Sample<T>) -> Option<ObservedRest<T>> {
        if self.until == 0 {
            self.begin(sample);
            return None;
        }
        let Some(since) = sample.time.checked_sub(self.last) else {
            // The clock was set back: nothing goes on over it.
            let ended = self.finish();
            self.begin(sample);
            return ended;
        };
        let whole = self.stretches.now();
        whole.broken |= since > self.gap;
        whole.end = sample.time;
        let last = core::mem::replace(&mut self.last, sample.time);
        // A gap before this sample is none of the intervals of the quarter. A quarter of microseconds has less than 32 bits, of which
        // a device divides faster.
        let lasted = u32::try_from(last.saturating_sub(whole.start)).unwrap_or(u32::MAX);
        if let Some(interval) = lasted.checked_div(whole.rows.saturating_sub(1)) {
            self.gap = if interval > 0 { GAP.saturating_mul(interval.into()) } else { u64::MAX };
        }
        let ended = self.quarter(&sample.acc);
        self.first = sample.acc;
        self.until = sample.time.saturating_add(QUARTER);
        self.stretches.turn(Stretch::new(sample.time)).push(sample);
        ended
    }

    /// The rest that goes on, when no more samples come; what was gathered is forgotten, but not the quietest window.
    pub fn finish(&mut self) -> Option<ObservedRest<T>> {
        self.stretches.forget();
        (self.until, self.gap) = (0, u64::MAX);
        self.ended()
    }

    /// What the sensor does, by the last window.
    pub fn stage(&self) -> Stage {
        match &self.lasting {
            None => Stage::Moving,
            Some(lasting) if lasting.quarters < SHORTEST => Stage::Still,
            Some(_) => Stage::Resting,
        }
    }

    /// How long the rest that goes on has lasted so far, s; 0 while it moves.
    pub fn lasted(&self) -> T {
        let quarters = self.lasting.as_ref().map_or(0, |lasting| lasting.quarters);
        T::whole(quarters.into()) * T::of(QUARTER as f64 * 1e-6)
    }

    /// Mean specific force `f_s` of the last quarter while the sensor is still, m/s².
    pub fn direction(&self) -> Option<Vector3<T>> {
        self.lasting.as_ref().and(self.stretches.before(1)).map(|quarter| quarter.acc.mean())
    }

    /// Quarters of a second that have ended since the start; comes round after 34 years.
    pub fn quarters(&self) -> u32 {
        self.quarters
    }

    /// Time between two samples beyond which there is a gap, µs; the largest there is before the usual one is known.
    pub(super) fn gap(&self) -> u64 {
        self.gap
    }

    /// Usual rate at rest, rad/s; zero before the first rest.
    pub fn rate(&self) -> Vector3<T> {
        self.rate.unwrap_or_else(Vector3::zeros)
    }

    /// Variance up to which a window is still, (m/s²)²; [`NOISIEST`] before the first window.
    pub fn threshold(&self) -> T {
        let allowed = self.settings.multiple * self.noise.variance(self.settings.least_variance);
        let most = T::of(NOISIEST);
        if allowed < most { allowed } else { most }
    }

    fn begin(&mut self, sample: &Sample<T>) {
        let first = self.stretches.now();
        *first = Stretch::new(sample.time);
        first.push(sample);
        self.first = sample.acc;
        (self.last, self.until) = (sample.time, sample.time.saturating_add(QUARTER));
    }

    /// The quarter that went on is whole; `next`: the accelerometer's first sample after it, m/s².
    fn quarter(&mut self, next: &Vector3<T>) -> Option<ObservedRest<T>> {
        self.quarters = self.quarters.wrapping_add(1);
        let before = |back| self.stretches.before(back);
        let last = before(0)?;
        self.noise.take_quarter(&last.acc);
        let window = window([before(3)?, before(2)?, before(1)?, last]);
        let Some(variance) = window.and_then(|window| self.still(&window, next)) else { return self.ended() };
        let lasting = self.lasting.get_or_insert(Lasting { held: None, quarters: 0, noise: variance });
        lasting.noise = if variance > lasting.noise { variance } else { lasting.noise };
        // From the middle of the window before to that of this one.
        let inner = self.stretches.before(2)?;
        if let Some(held) = &mut lasting.held {
            held.join(inner);
        } else {
            lasting.held = Some(Stretch::new(inner.end));
            return None;
        }
        lasting.quarters = lasting.quarters.saturating_add(1);
        None
    }

    /// Variance of a window, if it is still; `next`: the accelerometer's first sample after it, m/s².
    fn still(&mut self, window: &Window<T>, next: &Vector3<T>) -> Option<T> {
        let variance = window.variance;
        self.noise.take(variance);
        let mut most = self.threshold();
        if variance > most && variance <= T::of(NOISIEST) {
            self.noise.take_step(&self.first, next);
            most = self.threshold();
        }
        let swings = window.swing > T::of(SWINGING * SWINGING);
        (variance <= most && !swings && self.is_usual(window.rate)).then_some(variance)
    }

    /// The mean rate of a window in which the accelerometer is still is the usual one, which follows it.
    fn is_usual(&mut self, rate: Vector3<T>) -> bool {
        let usual = match &mut self.rate {
            Some(usual) => usual,
            None if rate.norm() > T::of(LARGEST_OFFSET) => return false,
            first => first.insert(rate),
        };
        let off = rate - *usual;
        let agrees = off.norm() <= self.settings.turning;
        let step = T::of(if agrees { STEPS.0 } else { STEPS.1 });
        let within = |component: T| match component {
            off if off > step => step,
            off if off < -step => -step,
            off => off,
        };
        *usual += off.map(within);
        agrees
    }

    /// The rest that has ended, if it was one.
    fn ended(&mut self) -> Option<ObservedRest<T>> {
        let Lasting { held, quarters, noise } = self.lasting.take()?;
        let held = held.filter(|_| quarters >= SHORTEST && noise <= self.threshold())?;
        Some(ObservedRest { rest: held.rest(), start: held.start, end: held.end, noise })
    }
}

#[cfg(test)]
mod tests;
