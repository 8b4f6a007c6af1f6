//! Under what a pair is made: drawn for each.

use crate::{
    blind::setting::{level, logarithmic},
    simulator::{
        Place, UnitKind,
        random::Random,
        robot::{RobotKind, RobotScene},
    },
};

/// Rates of recordings and of simulators, Hz.
const REAL_RATES: [f64; 5] = [100.0, 125.0, 200.0, 200.0, 250.0];
const SIM_RATES: [f64; 5] = [100.0, 200.0, 200.0, 250.0, 500.0];
/// Lengths, s.
const DURATION: (f64, f64) = (60.0, 900.0);
/// Delays, s, either way; the share of pairs with one, and the longest of the others.
pub const DELAY: (f64, f64) = (2e-3, 50e-3);
const DELAYED: f64 = 0.8;
const PROMPT: f64 = 1e-3;
/// Standard deviation of the clock's rate.
const CLOCK_RATE: f64 = 5e-5;
/// Turn of the mount, degrees.
const MOUNT: (f64, f64) = (0.3, 3.0);
/// Vibration against the usual.
const VIBRATION: (f64, f64) = (0.3, 2.0);
/// Share of rows that are lost where some are.
const LOST: (f64, f64) = (3e-4, 0.02);

/// A pair without effects.
pub(super) fn draw(seed: u64, random: &mut Random) -> RobotScene {
    let sign = |random: &mut Random| if random.share() < 0.5 { -1.0 } else { 1.0 };
    let turn = logarithmic(MOUNT, random).to_radians();
    let clock_offset = match random.share() < DELAYED {
        true => sign(random) * logarithmic(DELAY, random),
        false => random.between(-PROMPT, PROMPT),
    };
    RobotScene {
        kind: RobotKind::ALL[random.below(RobotKind::ALL.len())],
        seed,
        duration: logarithmic(DURATION, random).round(),
        real_rate: REAL_RATES[random.below(REAL_RATES.len())],
        sim_rate: SIM_RATES[random.below(SIM_RATES.len())],
        place: Place::draw(random),
        unit: UnitKind::ALL[random.below(UnitKind::ALL.len())],
        mounting: random.normals().normalize() * turn,
        clock_offset,
        clock_rate_error: CLOCK_RATE * random.normal(),
        dropped: if random.share() < 0.5 { 0.0 } else { logarithmic(LOST, random) },
        levels: [level(random), level(random), level(random)],
        vibration: logarithmic(VIBRATION, random),
        ..RobotScene::default()
    }
}
