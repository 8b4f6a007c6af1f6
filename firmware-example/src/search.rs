//! A gyroscope's bias and gain sought by a swarm against known attitudes, laid aside every few blocks as a main loop
//! does, and polished: what the gate links of a search.

use core::convert::Infallible;

use imucal_core::{
    model::{
        Cost,
        attitude::{AttitudeModel, AttitudePass},
        parameterisation::FULL,
    },
    observation::{Block, BlockBuilder, Compared, Durations, Motion},
    rotation::{exp, quaternion},
    solver::{
        LevenbergMarquardt,
        swarm::{Bounds, Settings, Swarm},
    },
    triad::Triad,
};
use nalgebra::{Matrix3, Quaternion, Vector3};
use rand_core::TryRng;

/// Particles: few, since the gate proves that a search links, and not that it finds.
const PARTICLES: usize = 10;
/// Blocks of the motion, and references along it.
const BLOCKS: usize = 30;
const REFERENCES: usize = 6;
/// Samples of a block and the time between them, s.
const SAMPLES: u16 = 5;
const INTERVAL: f32 = 0.02;

/// The generator that a caller brings along: the linear congruential one of *Numerical Recipes*.
#[derive(Clone, Copy, Debug)]
pub struct Draws(pub u32);

impl TryRng for Draws {
    type Error = Infallible;

    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        Ok(self.0)
    }

    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        let (high, low) = (self.try_next_u32()?, self.try_next_u32()?);
        Ok(u64::from(high) << 32 | u64::from(low))
    }

    fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Infallible> {
        for byte in bytes {
            *byte = (self.try_next_u32()? >> 24) as u8;
        }
        Ok(())
    }
}

/// Whether a search with `budget` blocks a call ends lower than it began, and its polish lower still.
#[inline(never)]
pub fn gyroscope(budget: usize) -> bool {
    let (blocks, references, after) = motion();
    let motions = [Motion {
        blocks: &blocks,
        durations: Durations::Uniform(f32::from(SAMPLES) * INTERVAL),
        earth: &[],
        force: &[],
        start: Quaternion::identity(),
        references: &references,
        compared: Compared::After(&after),
    }];
    let cost = AttitudeModel { motions: &motions, form: FULL };
    let nominal = FULL.theta(&Triad::identity());
    let reach = FULL.theta(&Triad { gain: Matrix3::repeat(0.1), bias: Vector3::repeat(0.1) });
    let Some(bounds) = Bounds::around(&nominal, &reach) else { return false };
    let settings = Settings { iterations: 12, ..Settings::default() };
    let mut swarm = Swarm::<f32, PARTICLES, 12, AttitudePass<f32>>::new(bounds, settings);
    let mut draws = Draws(1);
    while swarm.step(&cost, &mut draws, budget).is_none() {}
    let found = swarm.report();
    let mut polish = LevenbergMarquardt::new(*swarm.best(), Default::default());
    polish.run(&cost);
    let (before, after) = (cost.cost(&nominal), cost.cost(polish.theta()));
    found.best < before && after < found.best && swarm.minimum_at_bound().len() == 12
}

/// A table that turns about all axes, as a gyroscope with a bias of some 2 °/s and a gain 4 % off has it.
fn motion() -> ([Block<f32>; BLOCKS], [Quaternion<f32>; REFERENCES], [u32; REFERENCES]) {
    let truth = Triad { gain: Matrix3::identity() * 1.04, bias: Vector3::new(0.03, -0.02, 0.01) };
    let mut builder = BlockBuilder::default();
    let (none, _) = builder.finish();
    let (mut blocks, mut references) = ([none; BLOCKS], [Quaternion::identity(); REFERENCES]);
    let mut after = [0; REFERENCES];
    let (mut c, mut time) = (Matrix3::identity(), 0.0f32);
    let mut marks = references.iter_mut().zip(after.iter_mut());
    for (index, block) in blocks.iter_mut().enumerate() {
        for _ in 0..SAMPLES {
            let rate = Vector3::new(libm::sinf(2.0 * time), libm::cosf(1.3 * time), libm::sinf(0.7 * time));
            c *= exp(&(rate * INTERVAL));
            builder.push(&truth.predict(&rate).unwrap_or(rate), INTERVAL);
            time += INTERVAL;
        }
        (*block, _) = builder.finish();
        if (index + 1) % (BLOCKS / REFERENCES) == 0
            && let Some((reference, blocks_before)) = marks.next()
        {
            *reference = quaternion(&c);
            *blocks_before = index as u32 + 1;
        }
    }
    (blocks, references, after)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_search_of_three_blocks_a_call_finds_what_the_gate_expects() {
        assert!(gyroscope(3));
    }
}
