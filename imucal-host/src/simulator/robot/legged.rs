//! A legged robot: it walks, turns on the spot, stops; its body bobs, sways and nods with its steps, and feet strike.
//!
//! ```text
//! θ = 2π (f₀ t + k l)                     phase of the steps; θ/2 that of the strides
//! a = p² / (p² + p₀²),  p² = v² + (r ψ̇)²   vigour of the gait: none at rest, nearly whole at a walk
//! d = D (1 − u²)⁵,  u = (t − t_k) / τ      a strike at the step of t_k: |t − t_k| ≤ τ, milliseconds
//! ```

use std::f64::consts::TAU;

use super::{
    deviation::{Deviation, plus},
    jet::Jet,
    route::{Going, Plan, Route},
    trajectory::{Body, Wave, fill},
};
use crate::simulator::random::Random;

/// Speed at which the gait has half its vigour, m/s, and the arm that makes a turn on the spot as vigorous, m.
const PACE: (f64, f64) = (0.15, 0.3);
/// Feet strike if the gait is more vigorous than this.
const STRIKING: f64 = 0.1;
/// Half the length of a strike, s: from 5 to 20 ms, which a stream at some hundred Hz does not resolve.
const HALF: (f64, f64) = (2.5e-3, 10e-3);
/// Largest acceleration of a usual strike at full vigour, m/s².
const HARD: (f64, f64) = (4.0, 15.0);
/// Steps are looked for at this distance, s.
const LOOK: f64 = 0.01;

/// A foot that strikes the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Strike {
    time: f64,
    /// Half its length, s.
    half: f64,
    /// Largest displacement, n, m.
    reach: [f64; 3],
}

/// Amplitudes of what a body does with its steps.
#[derive(Clone, Debug)]
struct Gait {
    /// Steps a second at rest, and steps a metre more.
    steps: (f64, f64),
    /// Of the steps' phase: down, forward, pitch.
    step: [Vec<Wave>; 3],
    /// Of the strides' phase: right, roll, yaw.
    stride: [Vec<Wave>; 3],
    /// Lean of roll and pitch as the gait begins, rad.
    lean: [f64; 2],
}

/// What a legged robot does.
#[derive(Clone, Debug)]
pub struct Walk {
    pub(super) route: Route,
    gait: Gait,
    strikes: Vec<Strike>,
}

impl Walk {
    /// Draws a walk of this length, s.
    pub fn draw(duration: f64, random: &mut Random) -> Self {
        let mut plan = Plan::new(random.between(-3.0, 3.0));
        fill(&mut plan, duration, random, episode);
        let mut walk = Self { route: plan.route(), gait: Gait::draw(random), strikes: Vec::new() };
        walk.strike(random);
        walk
    }

    /// Draws the strikes: one a step.
    fn strike(&mut self, random: &mut Random) {
        let hard = random.between(HARD.0, HARD.1);
        let phase = |time: f64| self.gait.phase(time, &self.route.at(time)).value / TAU;
        let rows = (self.route.duration() / LOOK) as usize;
        let (mut strikes, mut before) = (Vec::new(), phase(0.0));
        for row in 1..=rows {
            let from = LOOK * (row - 1) as f64;
            let here = phase(from + LOOK);
            if here.floor() > before.floor() {
                let time = from + LOOK * (here.floor() - before) / (here - before);
                let going = self.route.at(time);
                let vigour = vigour(&going).value;
                let half = random.between(HALF.0, HALF.1);
                let peak = hard * vigour * random.between(0.5, 1.5);
                let (forward, right) = (random.between(-0.5, 0.1), random.between(-0.3, 0.3));
                if vigour > STRIKING {
                    // The largest acceleration of a strike is 10 D / τ², upwards.
                    let size = peak * half * half / 10.0;
                    let [north, east] =
                        going.sideways(Jet::constant(forward * size), Jet::constant(right * size));
                    strikes.push(Strike { time, half, reach: [north.value, east.value, size] });
                }
            }
            before = here;
        }
        self.strikes = strikes;
    }

    /// The body at a time, s.
    pub(super) fn body(&self, time: f64, deviation: &Deviation) -> Body {
        let going = self.route.at(time);
        let vigour = vigour(&going) * deviation.amplitude;
        let phase = self.gait.phase(time, &going);
        let [down, forward, pitch] =
            [0, 1, 2].map(|k| Wave::sum(&self.gait.step[k], phase, deviation) * vigour);
        let [right, roll, yaw] =
            [0, 1, 2].map(|k| Wave::sum(&self.gait.stride[k], phase * 0.5, deviation) * vigour);
        let [north, east] = going.sideways(forward, right);
        let struck = self.struck(time).map(|jet| jet * deviation.contact);
        let [lean_roll, lean_pitch] = self.gait.lean.map(|lean| vigour * lean);
        Body {
            position: plus(plus([going.way[0] + north, going.way[1] + east, down], struck), deviation.shift),
            attitude: plus([going.heading + yaw, pitch + lean_pitch, roll + lean_roll], deviation.turn),
        }
    }

    fn struck(&self, time: f64) -> [Jet; 3] {
        let after = self.strikes.partition_point(|strike| strike.time < time);
        let near = self.strikes.iter().skip(after.saturating_sub(1)).take(2);
        near.fold([Jet::default(); 3], |sum, strike| {
            let share =
                Jet { value: (time - strike.time) / strike.half, first: 1.0 / strike.half, second: 0.0 };
            let pulse = share.pulse();
            plus(sum, strike.reach.map(|reach| pulse * reach))
        })
    }

    pub(super) fn effort(&self, time: f64) -> f64 {
        vigour(&self.route.at(time)).value
    }
}

fn vigour(going: &Going) -> Jet {
    let (speed, arm) = PACE;
    let square = going.speed.square() + going.turn.square() * (arm * arm);
    square * (square + speed * speed).inverse()
}

impl Gait {
    fn draw(random: &mut Random) -> Self {
        let degree = 1f64.to_radians();
        let mut with_harmonics = |low: f64, high: f64, shares: &[f64]| -> Vec<Wave> {
            let amplitude = random.between(low, high);
            let wave = |(k, share): (usize, &f64)| {
                let share = share * random.between(0.5, 1.5);
                Wave::draw(amplitude * share, (k + 1) as f64, random)
            };
            shares.iter().enumerate().map(wave).collect()
        };
        let step = [
            with_harmonics(4e-3, 12e-3, &[1.0, 0.25, 0.1]),
            with_harmonics(3e-3, 8e-3, &[1.0, 0.2]),
            with_harmonics(0.5 * degree, 2.0 * degree, &[1.0, 0.3, 0.1]),
        ];
        let stride = [
            with_harmonics(5e-3, 15e-3, &[1.0, 0.1, 0.15]),
            with_harmonics(1.0 * degree, 3.0 * degree, &[1.0, 0.2, 0.2]),
            with_harmonics(0.5 * degree, 2.0 * degree, &[1.0, 0.2]),
        ];
        let lean = [random.between(-1.0, 1.0) * degree, random.between(-4.0, 4.0) * degree];
        Self { steps: (random.between(1.1, 1.7), random.between(0.4, 0.9)), step, stride, lean }
    }

    fn phase(&self, time: f64, going: &Going) -> Jet {
        (Jet::time(time) * self.steps.0 + going.way[2] * self.steps.1) * TAU
    }
}

/// A walk with turns, or a turn on the spot.
fn episode(plan: &mut Plan, left: f64, random: &mut Random) -> bool {
    if left < 8.0 {
        return false;
    }
    let side = if random.share() < 0.5 { -1.0 } else { 1.0 };
    if random.share() < 0.25 {
        plan.turn(random.between(2.0, 5.0), side * random.between(0.8, 3.0));
        return true;
    }
    let end = plan.time() + left.min(random.between(8.0, 40.0));
    plan.pace(random.between(1.0, 2.0), random.between(0.3, 1.1));
    while end - plan.time() > 4.5 {
        match random.below(4) {
            0 => plan.hold(random.between(1.0, 3.0)),
            1 => plan.pace(random.between(1.0, 2.0), random.between(0.3, 1.1)),
            _ => plan.turn(random.between(1.5, 3.0), random.between(-1.6, 1.6)),
        }
    }
    plan.pace(random.between(0.8, 1.5), 0.0);
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::random::Purpose;

    #[test]
    fn feet_strike_while_it_walks_and_only_then() {
        let walk = Walk::draw(60.0, &mut Random::new(3, Purpose::Route));
        assert!(walk.strikes.len() > 20, "{}", walk.strikes.len());
        for strike in &walk.strikes {
            assert!(walk.effort(strike.time) > STRIKING);
            let barefoot = Deviation { contact: Jet::constant(0.0), ..Deviation::NONE };
            let [with, without] = [Deviation::NONE, barefoot].map(|d| walk.body(strike.time, &d));
            let struck = (with.acceleration() - without.acceleration()).norm();
            assert!((0.1..30.0).contains(&struck), "{strike:?} {struck}");
            let past = strike.time + strike.half;
            let [with, without] = [Deviation::NONE, barefoot].map(|d| walk.body(past, &d));
            assert!((with.acceleration() - without.acceleration()).norm() < 1e-9);
        }
    }
}
