//! No two alike: rests, rates, swings and slews in shares, order and strength drawn from the seed.
//!
//! Every face is shown and every gimbal turned, since nothing can be said of a unit without; all else is chance.

use std::f64::consts::TAU;

use super::{multi_position::faces, plan::Plan};
use crate::{recording::manifest::Axis, simulator::random::Random};

/// One item of the programme.
#[derive(Clone, Copy, Debug)]
enum Part {
    /// A rest at these angles, rad.
    Pose([f64; 3]),
    /// A constant rate, rad/s, of one gimbal.
    Cruise { gimbal: usize, rate: f64 },
    /// Swings of one gimbal, of this peak rate, rad/s.
    Swings { gimbal: usize, count: f64, rate: f64 },
    /// A slew of all gimbals, none above a rate, rad/s, that is followed by hardly any rest.
    Leg { angles: [f64; 3], rate: f64 },
}

impl Part {
    /// How long it takes, about, s.
    fn length(self) -> f64 {
        match self {
            Self::Pose(_) => 6.0,
            Self::Cruise { .. } => 10.5,
            Self::Swings { .. } => 11.0,
            Self::Leg { .. } => 5.0,
        }
    }

    fn add(self, plan: &mut Plan, random: &mut Random) {
        match self {
            Self::Pose(angles) => {
                plan.slew(angles);
                plan.rest(random.between(2.0, 5.0));
            }
            Self::Cruise { gimbal, rate } => {
                aside(plan, random);
                plan.cruise(gimbal, rate, random.between(0.6, 1.4), random.between(5.0, 9.0));
                plan.rest(random.between(1.0, 2.0));
            }
            Self::Swings { gimbal, count, rate } => {
                aside(plan, random);
                let duration = random.between(6.0, 10.0);
                plan.sine(gimbal, rate * duration / (TAU * count), count, duration);
                plan.rest(random.between(1.0, 2.0));
            }
            Self::Leg { angles, rate } => {
                plan.slew_at(angles, rate);
                plan.rest(random.between(0.4, 1.0));
            }
        }
    }
}

/// Now and then another attitude to turn from.
fn aside(plan: &mut Plan, random: &mut Random) {
    if random.share() < 0.4 {
        plan.slew([(); 3].map(|()| random.between(-1.5, 1.5)));
        plan.rest(random.between(1.0, 2.0));
    }
}

fn cruise(gimbal: usize, random: &mut Random) -> Part {
    let sign = if random.share() < 0.5 { -1.0 } else { 1.0 };
    Part::Cruise { gimbal, rate: sign * 0.3 * libm::pow(8.0, random.share()) }
}

fn swings(gimbal: usize, random: &mut Random) -> Part {
    Part::Swings { gimbal, count: 2.0 + random.below(12) as f64, rate: random.between(0.6, 1.8) }
}

fn anywhere(reach: f64, random: &mut Random) -> [f64; 3] {
    [(); 3].map(|()| random.between(-reach, reach))
}

/// Fills about `extent` s.
pub(super) fn add(plan: &mut Plan, axes: [Axis; 3], extent: f64, random: &mut Random) {
    let mut poses = faces(axes, random);
    let mut parts: Vec<Part> = poses.iter().copied().map(Part::Pose).collect();
    for gimbal in 0..3 {
        parts.push(if random.share() < 0.5 { cruise(gimbal, random) } else { swings(gimbal, random) });
    }
    let shares = [(); 4].map(|()| random.between(0.05, 1.0));
    let revisited = random.between(0.0, 0.5);
    random.shuffle(&mut parts);
    let mut left = extent - parts.iter().map(|part| part.length()).sum::<f64>();
    while left > 0.0 {
        let gimbal = random.below(3);
        let part = match pick(&shares, random) {
            0 if random.share() < revisited => Part::Pose(poses[random.below(poses.len())]),
            0 => {
                poses.push(anywhere(3.1, random));
                Part::Pose(poses[poses.len() - 1])
            }
            1 => cruise(gimbal, random),
            2 => swings(gimbal, random),
            _ => Part::Leg { angles: anywhere(3.1, random), rate: random.between(0.6, 2.2) },
        };
        left -= part.length();
        parts.insert(random.below(parts.len() + 1), part);
    }
    for part in parts {
        part.add(plan, random);
    }
}

/// An index, by its share of all.
fn pick(shares: &[f64], random: &mut Random) -> usize {
    let mut left = random.share() * shares.iter().sum::<f64>();
    let reached = shares.iter().position(|share| {
        left -= share;
        left < 0.0
    });
    reached.unwrap_or(0)
}
