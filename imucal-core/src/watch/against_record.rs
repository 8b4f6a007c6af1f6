//! The record chart: each pose once, against what the record states.
//!
//! ```text
//! σ² = σ_c² + σ_p² + σ_i² + v / n     z = s̄ / σ     C ← max(0, C₀ ± z − k),   k = 3 + 1.5 σ_i / σ
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | s̄ | mean of the statistic over the latest looks of this pose, up to [`BLOCK`] |
//! | σ_c | its error from those of gain and bias, propagated at this direction |
//! | σ_p | what differs from pose to pose: the residual of the fit; Earth's rate; the field from place to place |
//! | σ_i | in-run instability, which poses shortly after one another share: hence its part in k |
//! | v, n | variance of a look, and their number |
//! | C₀ | the sum before this pose |
//!
//! The looks of a pose share its error, so that a pose counts once, by its latest looks, however long it lasts. A unit whose
//! true error lies within three of its standard errors adds nothing. One that is 5 off adds 2 a pose, less what instability asks for.

use nalgebra::Vector3;

/// Reference value where instability is small, standard deviations.
pub const REFERENCE: f32 = 3.0;
/// What a share of instability adds to it.
const INSTABILITY: f32 = 1.5;
/// A pose agrees with the record within this share of k.
const AGREES: f32 = 0.5;
/// Looks of which s̄ is a mean, at the most.
pub const BLOCK: u16 = 60;
/// Looks without which a pose is not judged.
pub const FEWEST: u16 = 5;

/// What a healthy sensor may be off by in this pose, as variances.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Allowance {
    /// From the errors of gain and bias.
    pub(super) common: f32,
    /// From pose to pose.
    pub(super) pose: f32,
    /// In-run instability.
    pub(super) slow: f32,
    /// What is expected is known.
    pub(super) is_known: bool,
}

impl Allowance {
    /// All of it.
    pub(super) fn variance(&self) -> f32 {
        self.common + self.pose + self.slow
    }
}

/// The chart.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RecordChart {
    allowance: Allowance,
    /// Sums before this pose, and when each last was zero, s.
    base: [f32; 2],
    since: [u32; 2],
    count: u16,
    mean: f32,
    /// z and k of the latest looks, where they are enough.
    latest: Option<(f32, f32)>,
    /// Direction in which this pose reads the triad.
    direction: Option<Vector3<f32>>,
}

/// What a pose has said on the whole.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose {
    /// Direction in which it reads the triad.
    pub(super) direction: Vector3<f32>,
    /// It agrees with the record.
    pub(super) agrees: bool,
    /// A shift as large as this would not have escaped it, were the unit's own error all that is allowed.
    pub(super) shows: f32,
}

impl RecordChart {
    /// A pose is taken up; the one before counts.
    pub(super) fn begin(&mut self, allowance: &Allowance, direction: Option<Vector3<f32>>, time: u32) {
        self.base = self.sums();
        for (base, since) in self.base.iter().zip(&mut self.since) {
            *since = if *base > 0.0 { *since } else { time };
        }
        (self.allowance, self.count, self.mean, self.latest) = (*allowance, 0, 0.0, None);
        self.direction = direction;
    }

    /// What this pose has said, once it was judged.
    pub(super) fn pose(&self) -> Option<Pose> {
        let (_, reference) = self.latest?;
        let shows = (1.0 + AGREES) * reference * libm::sqrtf(self.allowance.variance());
        Some(Pose { direction: self.direction?, agrees: self.agrees_alone(), shows })
    }

    /// The allowance of this pose.
    pub(super) fn allowance(&self) -> &Allowance {
        &self.allowance
    }

    /// Takes a look in, whose variance is `noise`.
    pub(super) fn push(&mut self, value: f32, noise: f32, time: u32) {
        if self.count >= BLOCK {
            (self.count, self.mean) = (0, 0.0);
        }
        self.count += 1;
        self.mean += (value - self.mean) / f32::from(self.count);
        if self.count < FEWEST || !self.allowance.is_known {
            return;
        }
        let spread = libm::sqrtf(self.allowance.variance() + noise / f32::from(self.count));
        let reference = REFERENCE + INSTABILITY * libm::sqrtf(self.allowance.slow) / spread;
        self.latest = Some((self.mean / spread, reference));
        for (sum, since) in self.sums().iter().zip(&mut self.since) {
            *since = if *sum > 0.0 { *since } else { time };
        }
    }

    /// Both sums, this pose counted.
    pub(super) fn sums(&self) -> [f32; 2] {
        let Some((z, reference)) = self.latest else { return self.base };
        let [up, down] = self.base;
        let sum = |base: f32, z: f32| (base + z - reference).max(0.0);
        [sum(up, z), sum(down, -z)]
    }

    /// Where a sum has reached the threshold: when it last was zero, by how much the statistic is off, and the variance of that.
    pub(super) fn change(&self, threshold: f32) -> Option<(u32, f32, f32)> {
        let [up, down] = self.sums();
        let [up_since, down_since] = self.since;
        let since = if up >= threshold { up_since } else { down_since };
        (up >= threshold || down >= threshold).then_some((since, self.mean, self.allowance.variance()))
    }

    /// This pose agrees with the record, and no pose before it is held against the unit.
    pub(super) fn agrees(&self) -> bool {
        self.agrees_alone() && self.sums() == [0.0; 2]
    }

    /// This pose agrees, whatever those before it showed.
    fn agrees_alone(&self) -> bool {
        self.latest.is_some_and(|(z, reference)| z.abs() < AGREES * reference)
    }

    /// What the poses before this one showed is over: it is held against the unit no more.
    pub(super) fn forget_poses(&mut self) {
        self.base = [0.0; 2];
    }

    /// What disturbed the latest looks is over.
    pub(super) fn forget_block(&mut self) {
        (self.count, self.mean, self.latest) = (0, 0.0, None);
    }

    /// z of the latest looks; 0 where there are not enough.
    pub(super) fn latest(&self) -> f32 {
        self.latest.map_or(0.0, |(z, _)| z)
    }
}
