//! A particle of a swarm and how it moves.

use nalgebra::SVector;
use rand_core::Rng;

use super::{Bounds, uniform};
use crate::scalar::Scalar;

/// Largest speed, as a share of the range on each axis.
const SPEED: f64 = 0.2;

/// A position and its velocity, and the best position it had.
#[derive(Clone, Copy, Debug)]
pub(super) struct Particle<T: Scalar, const P: usize> {
    pub(super) position: SVector<T, P>,
    pub(super) velocity: SVector<T, P>,
    pub(super) best: SVector<T, P>,
    pub(super) least: T,
}

impl<T: Scalar, const P: usize> Particle<T, P> {
    /// Its next move in a swarm with this best, by [`super`]'s equation; without weights its first.
    pub(super) fn advance(
        &mut self,
        swarm: &SVector<T, P>,
        weights: Option<(T, T)>,
        bounds: &Bounds<T, P>,
        rng: &mut impl Rng,
    ) {
        match weights {
            Some(weights) => self.fly(swarm, weights, bounds, rng),
            None => self.scatter(bounds, rng),
        }
    }

    /// Puts the particle anywhere within the bounds, with any speed allowed.
    fn scatter(&mut self, bounds: &Bounds<T, P>, rng: &mut impl Rng) {
        let limits = bounds.low.iter().zip(bounds.range.iter()).zip(bounds.high.iter());
        for ((x, v), ((low, range), high)) in
            self.position.iter_mut().zip(self.velocity.iter_mut()).zip(limits)
        {
            let place = *low + *range * uniform(rng);
            *x = if place > *high { *high } else { place };
            let share: T = uniform(rng);
            *v = *range * T::of(SPEED) * (share + share - T::one());
        }
        self.best = self.position;
    }

    fn fly(&mut self, swarm: &SVector<T, P>, (w, c): (T, T), bounds: &Bounds<T, P>, rng: &mut impl Rng) {
        let limits = bounds.low.iter().zip(bounds.range.iter()).zip(bounds.high.iter());
        let bests = self.best.iter().zip(swarm.iter());
        let moving = self.position.iter_mut().zip(self.velocity.iter_mut());
        for (((x, v), (own, all)), ((low, range), high)) in moving.zip(bests).zip(limits) {
            let (first, second): (T, T) = (uniform(rng), uniform(rng));
            let wish = w * *v + c * first * (*own - *x) + c * second * (*all - *x);
            let most = *range * T::of(SPEED);
            *v = if wish > most {
                most
            } else if wish < -most {
                -most
            } else {
                wish
            };
            let place = *x + *v;
            *x = if place < *low {
                *v = T::zero();
                *low
            } else if place > *high {
                *v = T::zero();
                *high
            } else {
                place
            };
        }
    }
}

/// `best ← position`. Out of line: within one particle the compiler would call for a move, 1.6 KiB of code that nothing
/// else on a device needs.
#[inline(never)]
pub(super) fn keep<T: Scalar, const P: usize>(best: &mut SVector<T, P>, position: &SVector<T, P>) {
    *best = *position;
}
