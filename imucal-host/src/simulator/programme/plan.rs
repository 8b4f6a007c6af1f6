//! Building a schedule, movement by movement.

use std::f64::consts::{PI, TAU};

use super::schedule::Segment;
use crate::simulator::course::Course;

/// Peak rate of the slews between poses, rad/s.
const SLEW_RATE: f64 = 1.2;
/// Peak rate over mean rate of a quintic.
const PEAK: f64 = 1.875;
/// Shortest slew, s.
const SHORTEST_SLEW: f64 = 0.8;

/// Movements so far, and where the gimbals stand after them.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    segments: Vec<Segment>,
    angles: [f64; 3],
}

impl Plan {
    /// Stays for `duration` s.
    pub fn rest(&mut self, duration: f64) {
        let courses = self.angles.map(|angle| Course::Slew { from: angle, to: angle });
        self.segments.push(Segment { duration, courses });
    }

    /// Goes to these angles, rad, each gimbal the short way, none above the slew rate.
    pub fn slew(&mut self, to: [f64; 3]) {
        self.slew_at(to, SLEW_RATE);
    }

    /// Likewise, none above a rate, rad/s.
    pub fn slew_at(&mut self, to: [f64; 3], rate: f64) {
        self.angles = self.angles.map(wrap);
        let mut target = self.angles;
        let mut duration = SHORTEST_SLEW;
        for (angle, to) in target.iter_mut().zip(to) {
            let way = wrap(to - *angle);
            duration = f64::max(duration, PEAK * way.abs() / rate);
            *angle += way;
        }
        self.slew_within(target, duration);
    }

    /// Goes to these angles, rad, as they stand, within `duration` s.
    pub fn slew_within(&mut self, to: [f64; 3], duration: f64) {
        let mut courses = [Course::Slew { from: 0.0, to: 0.0 }; 3];
        for ((course, from), to) in courses.iter_mut().zip(self.angles).zip(to) {
            *course = Course::Slew { from, to };
        }
        self.segments.push(Segment { duration, courses });
        // Turns of before do not count for what comes.
        self.angles = to.map(wrap);
    }

    /// Turns one gimbal at a rate, rad/s, reached and left within `ramp` s.
    pub fn cruise(&mut self, gimbal: usize, rate: f64, ramp: f64, duration: f64) {
        let from = self.angles[gimbal];
        self.one(gimbal, Course::Cruise { from, rate, ramp }, duration);
        self.angles[gimbal] = from + rate * (duration - ramp);
    }

    /// Swings one gimbal to and fro, rad.
    pub fn sine(&mut self, gimbal: usize, amplitude: f64, swings: f64, duration: f64) {
        let centre = self.angles[gimbal];
        self.one(gimbal, Course::Sine { centre, amplitude, swings }, duration);
    }

    fn one(&mut self, gimbal: usize, course: Course, duration: f64) {
        let mut courses = self.angles.map(|angle| Course::Slew { from: angle, to: angle });
        courses[gimbal] = course;
        self.segments.push(Segment { duration, courses });
    }

    /// Length so far, s.
    pub fn duration(&self) -> f64 {
        self.segments.iter().map(|segment| segment.duration).sum()
    }

    /// Shortest length that [`Self::stretched`] allows, s.
    pub fn shortest(&self, least_share: f64) -> f64 {
        self.duration() - (1.0 - least_share) * self.resting()
    }

    fn resting(&self) -> f64 {
        self.segments.iter().filter(|segment| segment.is_rest()).map(|segment| segment.duration).sum()
    }

    /// The same movements with rests stretched such that the whole lasts `duration` s.
    #[must_use]
    pub fn stretched(mut self, duration: f64) -> Self {
        let resting = self.resting();
        let factor = (duration - self.duration() + resting) / resting;
        for segment in self.segments.iter_mut().filter(|segment| segment.is_rest()) {
            segment.duration *= factor;
        }
        self
    }

    /// The segments.
    pub fn into_segments(self) -> Vec<Segment> {
        self.segments
    }
}

/// An angle to (−π, π].
pub fn wrap(angle: f64) -> f64 {
    let turns = angle / TAU;
    let wrapped = angle - TAU * (turns - 0.5).ceil();
    if wrapped <= -PI { wrapped + TAU } else { wrapped.min(PI) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_wrap_to_the_half_open_turn() {
        for (angle, wrapped) in [(0.0, 0.0), (PI, PI), (-PI, PI), (3.0 * PI, PI), (TAU, 0.0), (-1.0, -1.0)] {
            assert!((wrap(angle) - wrapped).abs() < 1e-12, "{angle}: {}", wrap(angle));
        }
    }

    #[test]
    fn a_slew_goes_the_short_way_however_often_the_gimbal_has_turned() {
        let mut plan = Plan::default();
        plan.cruise(0, 2.0, 1.0, 20.0);
        plan.slew([0.0; 3]);
        plan.slew_within([1.0, 0.0, 0.0], 2.0);
        for segment in &plan.into_segments()[1..] {
            let (begin, end) =
                (segment.courses[0].at(0.0, segment.duration), segment.courses[0].at(99.0, segment.duration));
            assert!((end.angle - begin.angle).abs() <= PI + 1e-12);
        }
    }

    #[test]
    fn stretching_touches_rests_only() {
        let mut plan = Plan::default();
        plan.rest(4.0);
        plan.slew([1.0, 0.0, 0.0]);
        let moving = plan.duration() - 4.0;
        let stretched = plan.stretched(20.0);
        assert!((stretched.duration() - 20.0).abs() < 1e-12);
        assert!((stretched.resting() - (20.0 - moving)).abs() < 1e-12);
    }
}
