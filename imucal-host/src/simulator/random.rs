//! Random numbers that are the same on any machine: ChaCha8, and libm by name where a function is needed.

use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What a stream of random numbers is for. Each has its own, so that more of one moves none of the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Poses, dwell times, temperatures.
    Schedule,
    /// Errors of the unit.
    Unit,
    /// How the base stands.
    Rig,
    /// How far from their encoders the gimbals come to rest.
    Scatter,
    /// Noise of the encoders.
    Encoder,
    /// Noise of the thermometer.
    Thermometer,
    /// Noise of the sensors.
    Noise,
    /// Directions and shapes of effects.
    Effect,
    /// Which effects a sealed case has.
    Case,
    /// Where a robot goes, and how.
    Route,
    /// How a robot shakes its sensors.
    Vibration,
    /// Where a robot departs from its plan.
    Deviation,
    /// Which samples are lost.
    Loss,
}

/// A source of random numbers.
#[derive(Clone, Debug)]
pub struct Random {
    generator: ChaCha8Rng,
    spare: Option<f64>,
}

impl Random {
    /// The numbers of a seed for a purpose.
    pub fn new(seed: u64, purpose: Purpose) -> Self {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream(purpose as u64 + 1);
        Self { generator, spare: None }
    }

    /// A number of [0, 1), each multiple of 2⁻⁵³ alike.
    pub fn share(&mut self) -> f64 {
        (self.generator.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A number of `[low, high)`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.share()
    }

    /// A whole number below `count`, or 0.
    pub fn below(&mut self, count: usize) -> usize {
        ((self.share() * count as f64) as usize).min(count.saturating_sub(1))
    }

    /// A standard normal number: Marsaglia's polar method (Marsaglia & Bray 1964).
    pub fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        let [u, v, s] = self.of_disc();
        let factor = libm::sqrt(-2.0 * libm::log(s) / s);
        self.spare = Some(v * factor);
        u * factor
    }

    /// Goes on as if `count` standard normal numbers had been drawn.
    pub fn skip_normals(&mut self, count: usize) {
        let spare = usize::from(count > 0 && self.spare.take().is_some());
        let left = count - spare;
        for _ in 0..left / 2 {
            self.of_disc();
        }
        if left % 2 == 1 {
            self.normal();
        }
    }

    /// A point of the unit disc and the square of its distance from the centre, which is not 0.
    fn of_disc(&mut self) -> [f64; 3] {
        loop {
            let (u, v) = (2.0 * self.share() - 1.0, 2.0 * self.share() - 1.0);
            let s = u * u + v * v;
            if s > 0.0 && s < 1.0 {
                return [u, v, s];
            }
        }
    }

    /// Three of them.
    pub fn normals(&mut self) -> Vector3<f64> {
        let (x, y, z) = (self.normal(), self.normal(), self.normal());
        Vector3::new(x, y, z)
    }

    /// The items in another order.
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for last in (1..items.len()).rev() {
            items.swap(last, self.below(last + 1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_numbers_have_the_moments_of_the_normal_distribution() {
        let mut random = Random::new(1, Purpose::Noise);
        let draws: Vec<f64> = (0..200_000).map(|_| random.normal()).collect();
        let moment = |k: i32| draws.iter().map(|x| x.powi(k)).sum::<f64>() / draws.len() as f64;
        assert!(moment(1).abs() < 0.01 && (moment(2) - 1.0).abs() < 0.015, "{} {}", moment(1), moment(2));
        assert!(moment(3).abs() < 0.03 && (moment(4) - 3.0).abs() < 0.1, "{} {}", moment(3), moment(4));
    }

    #[test]
    fn skipped_numbers_are_those_that_would_have_been_drawn() {
        let mut drawn = Random::new(5, Purpose::Noise);
        let mut skipping = drawn.clone();
        for count in [0, 1, 2, 3, 0, 7, 1, 1, 100, 5] {
            for _ in 0..count {
                drawn.normal();
            }
            skipping.skip_normals(count);
            assert_eq!(drawn.clone().normals(), skipping.clone().normals(), "after {count} more");
        }
    }

    #[test]
    fn purposes_and_seeds_do_not_share_numbers() {
        let first = |seed, purpose| Random::new(seed, purpose).share();
        assert_eq!(first(7, Purpose::Unit), first(7, Purpose::Unit));
        assert_ne!(first(7, Purpose::Unit), first(7, Purpose::Noise));
        assert_ne!(first(7, Purpose::Unit), first(8, Purpose::Unit));
    }
}
