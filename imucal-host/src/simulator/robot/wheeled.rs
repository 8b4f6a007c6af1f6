//! A wheeled robot: it drives, turns and stops on uneven ground, nods as it speeds up, leans in bends, and bumps.
//!
//! ```text
//! z = Σ A_i sin(κ_i l + φ_i),  pitch = Σ A_i κ_i cos(κ_i l + φ_i) + c v̇,  roll = Σ B_i sin(…) − c v ψ̇
//! ```
//!
//! l is the way that has been driven; a bump is (1 − u²)⁵ of it.

use std::f64::consts::TAU;

use super::{
    deviation::{Deviation, plus},
    jet::Jet,
    route::{Plan, Route},
    trajectory::{Body, Wave, fill},
};
use crate::simulator::random::Random;

/// Fastest, m/s.
const FASTEST: f64 = 2.5;

/// Something on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bump {
    /// On the way, m.
    at: f64,
    /// Half its length, m.
    half: f64,
    /// m.
    height: f64,
    /// How far the body rolls over it, rad.
    roll: f64,
}

/// What a wheeled robot does.
#[derive(Clone, Debug)]
pub struct Drive {
    pub(super) route: Route,
    /// Heights along the way.
    ground: Vec<Wave>,
    /// Roll along the way.
    cant: Vec<Wave>,
    /// rad per m/s².
    give: [f64; 2],
    bumps: Vec<Bump>,
}

impl Drive {
    /// Draws a drive of this length, s.
    pub fn draw(duration: f64, random: &mut Random) -> Self {
        let mut plan = Plan::new(random.between(-3.0, 3.0));
        fill(&mut plan, duration, random, episode);
        let route = plan.route();
        let slope = random.between(5e-3, 1.5e-2);
        let waves = |random: &mut Random| -> Vec<(f64, f64)> {
            [4.0, 2.2, 1.2, 0.7]
                .map(|length| (TAU / (length * random.between(0.8, 1.2)), random.between(0.5, 1.0)))
                .to_vec()
        };
        let ground = waves(random)
            .into_iter()
            .map(|(number, share)| Wave::draw(slope * share / number, number, random))
            .collect();
        let cant = waves(random)
            .into_iter()
            .map(|(number, share)| Wave::draw(0.7 * slope * share, number, random))
            .collect();
        let give = [random.between(3e-3, 1.2e-2), random.between(3e-3, 1.2e-2)];
        let bumps = bumps(route.at(duration).way[2].value, random);
        Self { route, ground, cant, give, bumps }
    }

    /// The body at a time, s.
    pub(super) fn body(&self, time: f64, deviation: &Deviation) -> Body {
        let going = self.route.at(time);
        let way = going.way[2];
        let height = Wave::sum(&self.ground, way, deviation) * deviation.amplitude;
        let slopes = self.ground.iter().map(|wave| {
            (way * wave.number + wave.phase + deviation.phase).cos() * (wave.amplitude * wave.number)
        });
        let slope = slopes.fold(Jet::default(), |sum, slope| sum + slope) * deviation.amplitude;
        let cant = Wave::sum(&self.cant, way, deviation) * deviation.amplitude;
        let (bump, bump_roll) = self.bump(way);
        let (bump, bump_roll) = (bump * deviation.contact, bump_roll * deviation.contact);
        let pitch = slope + going.acceleration * self.give[0];
        let roll = cant - going.speed * going.turn * self.give[1] + bump_roll;
        Body {
            position: plus([going.way[0], going.way[1], -height - bump], deviation.shift),
            attitude: plus([going.heading, pitch, roll], deviation.turn),
        }
    }

    fn bump(&self, way: Jet) -> (Jet, Jet) {
        let after = self.bumps.partition_point(|bump| bump.at < way.value);
        let near = self.bumps.iter().skip(after.saturating_sub(1)).take(2);
        near.fold((Jet::default(), Jet::default()), |(height, roll), bump| {
            let pulse = ((way + -bump.at) * (1.0 / bump.half)).pulse();
            (height + pulse * bump.height, roll + pulse * bump.roll)
        })
    }

    pub(super) fn effort(&self, time: f64) -> f64 {
        let going = self.route.at(time);
        libm::hypot(going.speed.value, 0.3 * going.turn.value) / FASTEST
    }
}

fn bumps(length: f64, random: &mut Random) -> Vec<Bump> {
    let mut bumps = Vec::new();
    let mut at = random.between(1.0, 4.0);
    while at < length {
        let half = random.between(0.2, 0.45);
        let height = random.between(2e-3, 1.2e-2);
        bumps.push(Bump { at, half, height, roll: random.between(-0.03, 0.03) });
        at += random.between(1.0, 10.0);
    }
    bumps
}

/// A drive with turns, or a turn on the spot.
fn episode(plan: &mut Plan, left: f64, random: &mut Random) -> bool {
    if left < 9.0 {
        return false;
    }
    let side = if random.share() < 0.5 { -1.0 } else { 1.0 };
    if random.share() < 0.25 {
        plan.turn(random.between(1.5, 5.0), side * random.between(0.8, 4.0));
        return true;
    }
    let end = plan.time() + left.min(random.between(9.0, 40.0));
    plan.pace(random.between(1.0, 2.5), random.between(0.4, FASTEST));
    while end - plan.time() > 5.5 {
        match random.below(4) {
            0 => plan.hold(random.between(1.0, 3.0)),
            1 => plan.pace(random.between(1.0, 2.5), random.between(0.4, FASTEST)),
            _ => plan.turn(random.between(1.5, 3.5), random.between(-1.8, 1.8)),
        }
    }
    plan.pace(random.between(1.0, 2.0), 0.0);
    true
}
