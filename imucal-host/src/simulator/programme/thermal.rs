//! Seven rounds through the six faces and two oblique attitudes while the room warms and cools, each in another order.

use super::{multi_position::faces, plan::Plan};
use crate::{recording::manifest::Axis, simulator::random::Random};

/// Rounds.
const ROUNDS: usize = 7;

pub(super) fn add(plan: &mut Plan, axes: [Axis; 3], random: &mut Random) {
    let mut poses = faces(axes, random);
    for _ in 0..2 {
        poses.push([(); 3].map(|()| random.between(-1.2, 1.2)));
    }
    for _ in 0..ROUNDS {
        random.shuffle(&mut poses);
        for pose in &poses {
            plan.slew(*pose);
            plan.rest(random.between(3.0, 5.0));
        }
    }
}
