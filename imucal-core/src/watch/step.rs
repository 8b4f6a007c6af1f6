//! The step chart: each second against what the minutes before let expect.
//!
//! The expected value x of a statistic at this rest is unknown within what the record allows; it wanders as the sensor's bias does in
//! a run, and each look shows it with noise:
//!
//! ```text
//! x₀ ~ N(0, P₀)     x_n = x_{n−1} + N(0, q Δt),  q = 2 σ_i² / τ     s_n = x_n + N(0, v)
//! z = (s − x̂) / √(P + v)     C⁺ ← max(0, C⁺ + min(z, c) − k)     C⁻ ← max(0, C⁻ + min(−z, c) − k)
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | x̂, P | estimate of x and its variance, by Kalman's filter; P does not grow beyond 2 σ_i² |
//! | σ_i, τ | in-run instability, and its correlation time |
//! | v | variance of a look: the larger of what its samples say and of half the mean square of differences of looks in succession |
//! | k, c | [`REFERENCE`], [`MOST`] |
//!
//! So z is N(0, 1) and independent while the sensor is healthy, however long it lies still, and a step shows in all that come until
//! x̂ has followed. The change began when the sum last was zero; the x̂ of the ten looks after the alarm less that of then is
//! the shift.
//!
//! Sources: Page (1954); innovations of a filter as terms: Basseville and Nikiforov (1993), section 4.3.

use super::{Now, reference::Reading};

/// Reference value, standard deviations of a look: half the shift that is found best.
pub const REFERENCE: f32 = 0.5;
/// A look counts as so many standard deviations at the most: no single second makes an alarm.
pub const MOST: f32 = 4.0;
/// Looks after a pose was taken up that only tell x̂.
const FIRST: u8 = 5;
/// Looks after a change that tell its size.
const SETTLING: u8 = 10;
/// Differences of looks that the noise is a mean of.
const NOISE_LOOKS: u16 = 256;
/// Fewer differences are no estimate yet.
const FEWEST: u16 = 32;
/// A squared difference counts so many times the mean at the most: a step is no noise.
const WILD: f32 = 16.0;

/// One side of a chart.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sum {
    value: f32,
    since: u32,
    count: u16,
    total: f32,
    /// Estimate and variance before the sum left zero.
    before: (f32, f32),
}

/// A change of the statistic.
#[derive(Clone, Copy, Debug)]
pub(super) struct Change {
    /// When the sum last was zero, s on the device's clock.
    pub(super) since: u32,
    /// By how much.
    pub(super) by: f32,
    /// Variance of that.
    pub(super) variance: f32,
    /// Estimate and variance before it.
    pub(super) from: (f32, f32),
}

/// The estimate after a change.
#[derive(Clone, Copy, Debug)]
pub(super) struct Settled {
    pub(super) estimate: f32,
    pub(super) variance: f32,
    /// As many looks as settle it have come.
    pub(super) is_whole: bool,
}

/// What a look says of a change.
#[derive(Clone, Copy, Debug)]
pub(super) enum Heard {
    /// There is one.
    Alarm(Change),
    /// Where the statistic is after the last one, now that more was seen of it.
    Size(Settled),
}

impl Sum {
    fn push(&mut self, z: f32, sample: f32, before: (f32, f32), time: u32) {
        let value = self.value + if z < MOST { z } else { MOST } - REFERENCE;
        if value <= 0.0 || value.is_nan() {
            *self = Self::default();
            return;
        }
        if self.count == 0 {
            *self = Self { since: time, before, ..Self::default() };
        }
        self.value = value;
        self.count = self.count.saturating_add(1);
        self.total += sample - self.before.0;
    }

    fn change(&self, noise: f32) -> Change {
        let count = f32::from(self.count);
        let variance = noise / count + self.before.1;
        Change { since: self.since, by: self.total / count, variance, from: self.before }
    }
}

/// How much a look of this statistic scatters.
#[derive(Clone, Copy, Debug, Default)]
struct Noise {
    last: Option<f32>,
    mean: f32,
    count: u16,
}

impl Noise {
    fn push(&mut self, value: f32) {
        let Some(last) = self.last.replace(value) else { return };
        let square = 0.5 * (value - last) * (value - last);
        let wild = self.count >= FEWEST && square > WILD * self.mean;
        let square = if wild { WILD * self.mean } else { square };
        self.count = if self.count < NOISE_LOOKS { self.count + 1 } else { NOISE_LOOKS };
        self.mean += (square - self.mean) / f32::from(self.count);
    }

    /// Variance of a look; `white` is what its samples say.
    fn variance(&self, white: f32) -> f32 {
        if self.count >= FEWEST && self.mean > white { self.mean } else { white.max(f32::MIN_POSITIVE) }
    }
}

/// The chart and its filter.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct StepChart {
    estimate: f32,
    variance: f32,
    /// Looks yet that only tell the estimate.
    first: u8,
    noise: Noise,
    sums: [Sum; 2],
    /// Looks yet that tell the size of the last change.
    settling: u8,
}

impl StepChart {
    /// Nothing is expected but what the record says, within `variance`.
    pub(super) fn begin(&mut self, variance: f32) {
        (self.estimate, self.variance, self.first, self.settling) = (0.0, variance, FIRST, 0);
        self.sums = [Sum::default(); 2];
    }

    /// The device was moved: what is expected is less certain by `variance`; beyond `most`, the record is the better guess.
    pub(super) fn loosen(&mut self, variance: f32, most: f32) {
        (self.noise.last, self.settling) = (None, 0);
        self.variance += variance;
        if self.variance >= most {
            self.begin(most);
        }
    }

    /// Takes a look in; `slow` is the sensor's instability as a variance.
    pub(super) fn push(&mut self, reading: &Reading, slow: f32, now: &Now, threshold: f32) -> Option<Heard> {
        let variance = self.wandered(slow, now);
        let noise = self.noise(reading.white);
        self.noise.push(reading.value);
        let spread = libm::sqrtf(variance + noise);
        let off = reading.value - self.estimate;
        let z = off / spread;
        let before = (self.estimate, variance);
        let gain = variance / (variance + noise);
        // What is wild pulls the estimate no further than it counts, unless it is all that is known but the record.
        let is_wild = self.first == 0 && z.abs() > MOST;
        let pull = if is_wild { if z > 0.0 { MOST * spread } else { -MOST * spread } } else { off };
        self.estimate += gain * pull;
        self.variance = gain * noise;
        if self.first > 0 {
            self.first -= 1;
            return self.size();
        }
        let [up, down] = &mut self.sums;
        up.push(z, reading.value, before, now.time);
        down.push(-z, reading.value, before, now.time);
        let Some(sum) = self.sums.into_iter().find(|sum| sum.value >= threshold) else { return self.size() };
        let change = sum.change(noise);
        // The sum may have left zero before the change, so that its mean is too small: the next looks tell.
        self.settling = SETTLING;
        (self.estimate, self.variance) = (sum.before.0 + change.by, change.variance + change.by * change.by);
        (self.first, self.sums) = (FIRST, [Sum::default(); 2]);
        Some(Heard::Alarm(change))
    }

    /// Size of the last change, for some looks after it.
    fn size(&mut self) -> Option<Heard> {
        self.settling = self.settling.checked_sub(1)?;
        let is_whole = self.settling == 0;
        Some(Heard::Size(Settled { estimate: self.estimate, variance: self.variance, is_whole }))
    }

    /// Variance of the estimate at this look.
    fn wandered(&self, slow: f32, now: &Now) -> f32 {
        let most = if self.variance > 2.0 * slow { self.variance } else { 2.0 * slow };
        let wandered = self.variance + 2.0 * slow / now.memory * now.since as f32;
        if wandered < most { wandered } else { most }
    }

    /// Variance of a look; `white` is what its samples say.
    pub(super) fn noise(&self, white: f32) -> f32 {
        self.noise.variance(white)
    }

    /// Both sums.
    pub(super) fn sums(&self) -> [f32; 2] {
        self.sums.map(|sum| sum.value)
    }
}
