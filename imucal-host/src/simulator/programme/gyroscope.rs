//! The gyroscope's trajectory: slews of all gimbals to 150° over 100 s (models.md 3), with short rests between.

use super::plan::Plan;
use crate::{recording::manifest::Axis, simulator::random::Random};

/// Length, s.
const DURATION: f64 = 100.0;
/// Largest angle, rad.
const REACH: f64 = 150.0 / 180.0 * std::f64::consts::PI;

pub(super) fn add(plan: &mut Plan, _: [Axis; 3], random: &mut Random) {
    plan.slew([0.0; 3]);
    let begin = plan.duration();
    let mut side = [1.0; 3].map(|side: f64| if random.share() < 0.5 { side } else { -side });
    let mut leg = 0;
    while plan.duration() - begin < DURATION {
        let mut target = side.map(|side| side * REACH * random.between(0.2, 1.0));
        // One gimbal at a time goes all the way.
        target[leg % 3] = side[leg % 3] * REACH;
        plan.slew_within(target, random.between(4.0, 6.0));
        plan.rest(random.between(1.5, 2.5));
        side[leg % 3] = -side[leg % 3];
        leg += 1;
    }
}
