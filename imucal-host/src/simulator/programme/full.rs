//! All of it: rests, rates, swings, the gyroscope's trajectory, over a thermal profile.

use super::{gyroscope, multi_position, plan::Plan, rates, sinusoids};
use crate::{recording::manifest::Axis, simulator::random::Random};

pub(super) fn add(plan: &mut Plan, axes: [Axis; 3], random: &mut Random) {
    multi_position::add(plan, axes, random);
    let mut parts = [rates::add, sinusoids::add, gyroscope::add];
    random.shuffle(&mut parts);
    for part in parts {
        part(plan, axes, random);
    }
}
