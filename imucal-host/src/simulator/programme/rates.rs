//! Constant rates: three levels of both signs about each axis, each for more than a radian.

use super::plan::Plan;
use crate::{recording::manifest::Axis, simulator::random::Random};

/// Rates, rad/s, and how long each is held with its ramps, s.
const LEVELS: [(f64, f64); 3] = [(0.5, 8.0), (1.2, 7.0), (2.4, 6.0)];
/// Time to reach a rate, s.
const RAMP: f64 = 1.0;

pub(super) fn add(plan: &mut Plan, _: [Axis; 3], random: &mut Random) {
    for gimbal in 0..3 {
        let mut aside = [0.0; 3].map(|_: f64| random.between(-0.3, 0.3));
        aside[gimbal] = 0.0;
        plan.slew(aside);
        let mut runs: Vec<(f64, f64)> =
            LEVELS.iter().flat_map(|(rate, duration)| [(*rate, *duration), (-rate, *duration)]).collect();
        random.shuffle(&mut runs);
        for (rate, duration) in runs {
            plan.rest(random.between(1.2, 2.0));
            plan.cruise(gimbal, rate * random.between(0.95, 1.05), RAMP, duration);
        }
        plan.rest(random.between(1.2, 2.0));
    }
}
