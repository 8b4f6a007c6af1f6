//! A flying robot: it takes off, hovers, flies, climbs, banks in bends and lands; gusts move it about.
//!
//! ```text
//! pitch = −atan(v̇ / g) − c v,  roll = atan(v ψ̇ / g)      thrust points where it has to
//! ```
//!
//! Gusts are sines of time in position and attitude, of which as much acts as it is off the ground.

use std::f64::consts::TAU;

use super::{
    deviation::{Deviation, plus},
    jet::Jet,
    route::{Going, Plan, Route},
    trajectory::{Body, Wave, fill},
};
use crate::simulator::random::Random;

/// For its attitude: what it leans against, m/s².
const GRAVITY: f64 = 9.81;
/// Fastest, m/s.
const FASTEST: f64 = 6.0;
/// Height at which half of the gusts act, m.
const LIFTED: f64 = 0.3;

/// What a flying robot does.
#[derive(Clone, Debug)]
pub struct Flight {
    pub(super) route: Route,
    /// Gusts: north, east, down; yaw, pitch, roll.
    gusts: [Vec<Wave>; 6],
    /// Lean into the wind of its own, rad per m/s.
    drag: f64,
}

impl Flight {
    /// Draws a flight of this length, s.
    pub fn draw(duration: f64, random: &mut Random) -> Self {
        let mut plan = Plan::new(random.between(-3.0, 3.0));
        fill(&mut plan, duration, random, episode);
        let degree = 1f64.to_radians();
        let mut waves = |count: usize, amplitude: f64, (low, high): (f64, f64)| -> Vec<Wave> {
            let wave = |_| {
                let number = TAU * low * libm::pow(high / low, random.share());
                Wave::draw(amplitude * random.between(0.4, 1.2), number, random)
            };
            (0..count).map(wave).collect()
        };
        let gusts = [
            waves(3, 0.06, (0.1, 0.5)),
            waves(3, 0.06, (0.1, 0.5)),
            waves(3, 0.03, (0.1, 0.8)),
            waves(3, 1.0 * degree, (0.1, 0.8)),
            waves(4, 0.6 * degree, (0.3, 3.0)),
            waves(4, 0.6 * degree, (0.3, 3.0)),
        ];
        Self { route: plan.route(), gusts, drag: random.between(0.01, 0.03) }
    }

    /// The body at a time, s.
    pub(super) fn body(&self, time: f64, deviation: &Deviation) -> Body {
        let going = self.route.at(time);
        let share = lifted(&going) * deviation.amplitude;
        let gust = |k: usize| Wave::sum(&self.gusts[k], Jet::time(time), deviation) * share;
        let pitch = -(going.acceleration * (1.0 / GRAVITY)).atan() - going.speed * self.drag;
        let roll = (going.speed * going.turn * (1.0 / GRAVITY)).atan();
        let position = [going.way[0] + gust(0), going.way[1] + gust(1), -going.height + gust(2)];
        let attitude = [going.heading + gust(3), pitch + gust(4), roll + gust(5)];
        Body { position: plus(position, deviation.shift), attitude: plus(attitude, deviation.turn) }
    }

    pub(super) fn effort(&self, time: f64) -> f64 {
        let going = self.route.at(time);
        let climb = going.height.second / GRAVITY;
        let side = libm::hypot(going.acceleration.value, going.speed.value * going.turn.value) / GRAVITY;
        lifted(&going).value * (0.8 * libm::hypot(1.0 + climb, side) + 0.2 * going.speed.value / FASTEST)
    }
}

fn lifted(going: &Going) -> Jet {
    let square = going.height.square();
    square * (square + LIFTED * LIFTED).inverse()
}

/// From the ground to the ground.
fn episode(plan: &mut Plan, left: f64, random: &mut Random) -> bool {
    if left < 16.0 {
        return false;
    }
    let end = plan.time() + left.min(random.between(25.0, 90.0));
    let mut height = random.between(1.5, 8.0);
    plan.climb(random.between(3.0, 5.0), height);
    while end - plan.time() > 10.5 {
        let fast = plan.speed() > 0.0;
        match random.below(6) {
            0 => plan.hold(random.between(1.0, 3.0)),
            1 => {
                height = random.between(1.5, 12.0);
                plan.climb(random.between(2.5, 4.0), height);
            }
            2 | 3 if !fast => plan.pace(random.between(1.5, 3.5), random.between(1.0, FASTEST)),
            2 => plan.pace(random.between(1.5, 3.5), 0.0),
            _ => plan.turn(random.between(1.5, 4.0), random.between(-2.0, 2.0)),
        }
    }
    if plan.speed() > 0.0 {
        plan.pace(random.between(2.0, 3.0), 0.0);
    }
    plan.climb(random.between(3.5, 6.0), 0.0);
    true
}
