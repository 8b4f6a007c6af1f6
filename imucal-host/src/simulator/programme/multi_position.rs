//! Rests in 24 attitudes, six of them twice: six faces and eighteen oblique ones, in random order.

use std::f64::consts::FRAC_PI_4;

use nalgebra::Vector3;

use super::plan::Plan;
use crate::{
    effect::{Machine, Swing},
    recording::manifest::Axis,
    simulator::{
        gimbal::{direction, pose},
        random::Random,
    },
};

/// Attitudes other than the six faces.
const OBLIQUE: usize = 18;
/// Attitudes that come twice.
const REVISITS: usize = 6;
/// Draws for each oblique attitude; the one farthest from those before it is taken.
const DRAWS: usize = 24;

pub(super) fn add(plan: &mut Plan, axes: [Axis; 3], random: &mut Random) {
    let mut poses = faces(axes, random);
    for _ in 0..OBLIQUE {
        poses.push(oblique(axes, &poses, random));
    }
    random.shuffle(&mut poses);
    // Revisits come late, so that they show what time does.
    let revisits: Vec<[f64; 3]> = poses.iter().take(REVISITS).copied().collect();
    let late = poses.len() / 2;
    for revisit in revisits {
        let at = late + random.below(poses.len() - late + 1);
        poses.insert(at, revisit);
    }
    for pose in poses {
        plan.slew(pose);
        plan.rest(random.between(3.0, 5.0));
    }
}

/// Down in the table.
pub(super) fn down(axes: [Axis; 3], angles: [f64; 3]) -> Vector3<f64> {
    let mut machine = Machine::exact(axes.map(direction));
    machine.gimbals = angles.map(Swing::still);
    pose(&machine).c_t_p.tr_mul(&Vector3::z())
}

/// One attitude for each face, of those at quarter turns that have it down.
pub(super) fn faces(axes: [Axis; 3], random: &mut Random) -> Vec<[f64; 3]> {
    let mut quarters: Vec<[f64; 3]> =
        (0..64).map(|k| [k / 16, k / 4 % 4, k % 4].map(|turn| 2.0 * FRAC_PI_4 * f64::from(turn))).collect();
    random.shuffle(&mut quarters);
    let axes_of = [Vector3::x(), Vector3::y(), Vector3::z()];
    let faces = axes_of.into_iter().flat_map(|axis| [axis, -axis]);
    faces
        .filter_map(|face| quarters.iter().find(|angles| down(axes, **angles).dot(&face) > 0.99).copied())
        .collect()
}

/// An attitude near eighth turns, far from those there are.
fn oblique(axes: [Axis; 3], poses: &[[f64; 3]], random: &mut Random) -> [f64; 3] {
    let taken: Vec<Vector3<f64>> = poses.iter().map(|angles| down(axes, *angles)).collect();
    let mut best = ([0.0; 3], f64::INFINITY);
    for _ in 0..DRAWS {
        let angles = [(); 3].map(|()| FRAC_PI_4 * (random.below(8) as f64 + random.between(-0.2, 0.2)));
        let here = down(axes, angles);
        let nearest = taken.iter().map(|other| here.dot(other)).fold(-1.0, f64::max);
        if nearest < best.1 {
            best = (angles, nearest);
        }
    }
    best.0
}
