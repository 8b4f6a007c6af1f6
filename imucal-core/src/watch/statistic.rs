//! One statistic: its two charts, what they found, and what it is like on the whole.

use nalgebra::Vector3;

use super::{
    Compared, Now, StatisticSummary,
    against_record::{Allowance, RecordChart},
    reference::Reading,
    run_length::Thresholds,
    shift::Track,
    step::{Heard, StepChart},
};

/// Variance of what nothing is known of.
const UNKNOWN: f32 = 1e12;

/// The charts of a statistic.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Chart {
    step: StepChart,
    record: RecordChart,
    track: Track,
    is_begun: bool,
    looks: u32,
    mean: f32,
    squares: f32,
}

impl Chart {
    /// A pose has been taken up.
    pub(super) fn is_begun(&self) -> bool {
        self.is_begun
    }

    /// The next look expects what it would after a start.
    pub(super) fn restart(&mut self) {
        self.is_begun = false;
    }

    /// The device was put down; `turned`: in another pose. `direction`: in which the statistic reads the triad there; `None` where it
    /// does not depend on the pose. True where the poses before show that what was found is over.
    pub(super) fn begin_rest(
        &mut self,
        allowance: &Allowance,
        turned: bool,
        direction: Option<Vector3<f32>>,
        time: u32,
    ) -> bool {
        self.track.begin_rest(time);
        let turned = turned || direction.is_none();
        let all = if allowance.is_known { allowance.variance() } else { UNKNOWN };
        if !core::mem::replace(&mut self.is_begun, true) {
            self.step.begin(all);
            self.record.begin(allowance, direction, time);
            return false;
        }
        // Two poses differ by the errors of both.
        let own = direction.map_or(0.0, |_| allowance.common);
        self.step.loosen(if turned { 2.0 * (allowance.pose + own) } else { allowance.pose }, all);
        if !turned {
            return false;
        }
        let is_over = self.record.pose().is_some_and(|pose| self.track.pose(&pose, time));
        if is_over {
            self.record.forget_poses();
        }
        self.record.begin(allowance, direction, time);
        is_over
    }

    /// Takes a look in; true where something was found, or came back.
    pub(super) fn push(&mut self, reading: &Reading, now: &Now, thresholds: &Thresholds) -> bool {
        self.looks = self.looks.saturating_add(1);
        let off = reading.value - self.mean;
        self.mean += off / self.looks as f32;
        self.squares += off * (reading.value - self.mean);
        let noise = self.step.noise(reading.white);
        self.record.push(reading.value, noise, now.time);
        let slow = self.record.allowance().slow;
        match self.step.push(reading, slow, now, thresholds.step) {
            Some(Heard::Alarm(change)) => {
                self.track.step(&change, now);
                return true;
            }
            Some(Heard::Size(settled)) if self.track.size(&settled, now) => {
                self.record.forget_block();
                return true;
            }
            _ => {}
        }
        match self.track.shift.map(|shift| shift.compared) {
            None => {
                let Some((since, by, variance)) = self.record.change(thresholds.record) else { return false };
                self.track.against_record((since, by, libm::sqrtf(variance)), now);
                true
            }
            Some(Compared::WithRecord) if self.record.agrees() => {
                self.track.close(now.time);
                self.record.forget_poses();
                true
            }
            Some(_) => false,
        }
    }

    /// What there is to say.
    pub(super) fn summary(&self, thresholds: &Thresholds) -> StatisticSummary {
        let spread = if self.looks < 2 { 0.0 } else { libm::sqrtf(self.squares / (self.looks - 1) as f32) };
        StatisticSummary {
            looks: self.looks,
            mean: self.mean,
            spread,
            noise: libm::sqrtf(self.step.noise(0.0)),
            allowed: libm::sqrtf(self.record.allowance().variance()),
            step: self.step.sums().map(|sum| sum / thresholds.step),
            record: self.record.sums().map(|sum| sum / thresholds.record),
            latest: self.record.latest(),
            alarms: self.track.alarms,
            returns: self.track.returns,
            shift: self.track.shift,
            spell: self.track.spell,
        }
    }
}
