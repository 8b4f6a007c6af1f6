//! Swings about each axis at three frequencies, all of the same peak rate.

use std::f64::consts::TAU;

use super::plan::Plan;
use crate::{recording::manifest::Axis, simulator::random::Random};

/// Length of each, s.
const DURATION: f64 = 8.0;
/// Swings in that time: 0.375, 0.875 and 1.75 Hz.
const SWINGS: [f64; 3] = [3.0, 7.0, 14.0];
/// Peak rate, rad/s.
const PEAK_RATE: f64 = 1.5;

pub(super) fn add(plan: &mut Plan, _: [Axis; 3], random: &mut Random) {
    for gimbal in 0..3 {
        plan.slew([(); 3].map(|()| random.between(-0.8, 0.8)));
        for swings in SWINGS {
            plan.rest(random.between(1.2, 2.0));
            let rate = PEAK_RATE * random.between(0.9, 1.1);
            plan.sine(gimbal, rate * DURATION / (TAU * swings), swings, DURATION);
        }
        plan.rest(random.between(1.2, 2.0));
    }
}
