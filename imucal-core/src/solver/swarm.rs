//! Particle swarm: a search by cost alone, for where no start lies in the minimum's basin. Resumable within a particle.
//!
//! ```text
//! v ← w v + c₁ r₁ (p − x) + c₂ r₂ (g − x),   |v| ≤ 0.2 (high − low),   x ← x + v, clamped to the bounds
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | x, v | a particle's position and velocity; a component of v is zeroed where x is clamped |
//! | p, g | best position of the particle, and of the whole swarm |
//! | r₁, r₂ | uniform in [0, 1), drawn for every component ([`uniform`]) |
//! | w, c₁, c₂ | see [`Variant`] |
//!
//! Source: models.md 6; Clerc & Kennedy 2002 (IEEE Trans. Evol. Comput. 6); Shi & Eberhart 1998 (ICEC). Particles
//! move one after the other and see the best at once (asynchronous, as in Carlisle & Dozier 2001), so that one best
//! position is held and a particle's move is no more work than its turn needs. Every draw and sum has a fixed order:
//! the same seed gives the same bits on host and device, however the work is sliced.
//!
//! Not modelled: constraints other than bounds. Nothing is said about whether the minimum is the lowest there is.

use nalgebra::SVector;
use rand_core::Rng;

mod particle;

use self::particle::{Particle, keep};
use super::report::Termination;
pub use crate::model::Cost;
use crate::scalar::Scalar;

/// Particles that [`Swarm::run_ahead`] looks ahead at the least.
const FEWEST_AHEAD: usize = 2;

/// Where to search: a closed range for each parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds<T: Scalar, const P: usize> {
    low: SVector<T, P>,
    range: SVector<T, P>,
    high: SVector<T, P>,
}

impl<T: Scalar, const P: usize> Bounds<T, P> {
    /// Bounds in the parameters' units; `None` where one is not finite or `low` exceeds `high`. A parameter with
    /// equal bounds stays there.
    pub fn new(low: SVector<T, P>, high: SVector<T, P>) -> Option<Self> {
        let range = high - low;
        let valid =
            low.iter().chain(range.iter()).all(|x| x.finite()) && range.iter().all(|r| *r >= T::zero());
        valid.then_some(Self { low, range, high })
    }

    /// `reach` to either side of `centre`; `None` where that is not finite or a reach is negative.
    pub fn around(centre: &SVector<T, P>, reach: &SVector<T, P>) -> Option<Self> {
        Self::new(centre - reach, centre + reach)
    }
}

/// Which end of its range a parameter touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Side {
    /// The lower.
    Low,
    /// The upper.
    High,
}

/// How the swarm is slowed down.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Variant {
    /// w = 0.7298, c₁ = c₂ = 1.49618: contracts by itself, whatever the number of iterations (Clerc & Kennedy 2002).
    Constriction,
    /// w from 0.9 in the first iteration to 0.4 in the last, c₁ = c₂ = 2 (Shi & Eberhart 1998): explores for longer,
    /// and settles only towards the end of the iterations allowed. On the gyroscope's cost, far from nominal, it
    /// fails half as often (`tests/search`); so it is the default.
    #[default]
    LinearInertia,
}

impl Variant {
    /// w, and c₁ = c₂, in iteration `done` of `all`.
    fn weights<T: Scalar>(self, done: u16, all: u16) -> (T, T) {
        match self {
            Self::Constriction => (T::of(0.7298), T::of(1.49618)),
            Self::LinearInertia => {
                let share = T::whole(done.into()) / T::whole(all.saturating_sub(1).max(1).into());
                (T::of(0.9) - share * T::of(0.5), T::of(2.0))
            }
        }
    }
}

/// How to search and when to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings<T> {
    /// How the swarm is slowed down. Default: linear inertia.
    pub variant: Variant,
    /// Iterations at the most, each an evaluation of every particle. Default: 300.
    pub iterations: u16,
    /// Stop once no particle is further from the best than this share of the range, on any axis. Zero: go on to the
    /// last iteration. Large: sooner, with fewer digits; below the square root of the rounding unit, the cost may be
    /// flat to its last digit and the swarm draws no closer. Default: 1e-3, enough to start Levenberg–Marquardt.
    pub spread: T,
}

impl<T: Scalar> Default for Settings<T> {
    fn default() -> Self {
        Self { variant: Variant::default(), iterations: 300, spread: T::of(1e-3) }
    }
}

/// What a swarm did so far.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SwarmReport<T: Scalar> {
    /// Why it stopped: [`Spread`](Termination::Spread), [`Iterations`](Termination::Iterations), or
    /// [`NotFinite`](Termination::NotFinite) where no particle of the first iteration had a finite cost. `None`
    /// while it is under way.
    pub termination: Option<Termination>,
    /// Iterations completed.
    pub iterations: u16,
    /// Costs worked out.
    pub evaluations: u32,
    /// The least cost, the largest number there is before the first.
    pub best: T,
    /// Largest distance of a particle from the best after the last whole iteration, as a share of the range; 1 before.
    pub spread: T,
}

/// A search by `N` particles in `P` parameters, with an evaluation's state `S` where it was laid aside.
///
/// Holds `N (3P + 1)` numbers and a few more: below 8 KiB for 40 particles of 12 in `f32`.
///
/// ```
/// use imucal_core::solver::swarm::{Bounds, Cost, Settings, Swarm};
/// use nalgebra::SVector;
/// use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
///
/// /// The squared distance from (1, −2).
/// struct Distance;
/// impl Cost<f32, 2> for Distance {
///     type State = ();
///     fn begin(&self, _: &SVector<f32, 2>) {}
///     fn advance(&self, theta: &SVector<f32, 2>, _: &mut (), _: &mut usize) -> Option<f32> {
///         Some((theta.x - 1.0).powi(2) + (theta.y + 2.0).powi(2))
///     }
/// }
///
/// let bounds = Bounds::around(&SVector::zeros(), &SVector::repeat(5.0)).unwrap();
/// let mut swarm = Swarm::<_, 20, 2, _>::new(bounds, Settings::default());
/// let mut rng = ChaCha8Rng::seed_from_u64(1);
/// // A main loop that grants 8 blocks a round.
/// while swarm.step(&Distance, &mut rng, 8).is_none() { /* the device's other work */ }
/// assert!(swarm.report().termination.unwrap().was_successful());
/// assert!((swarm.best().x - 1.0).abs() < 1e-2);
/// ```
#[derive(Clone, Debug)]
pub struct Swarm<T: Scalar, const N: usize, const P: usize, S> {
    bounds: Bounds<T, P>,
    settings: Settings<T>,
    particles: [Particle<T, P>; N],
    best: SVector<T, P>,
    least: T,
    /// The particle whose turn it is, and its evaluation once begun.
    turn: usize,
    state: Option<S>,
    iterations: u16,
    evaluations: u32,
    spread: T,
    stopped: Option<Termination>,
}

impl<T: Scalar, const N: usize, const P: usize, S> Swarm<T, N, P, S> {
    /// A search within bounds; nothing is drawn before the first step.
    pub fn new(bounds: Bounds<T, P>, settings: Settings<T>) -> Self {
        let none = SVector::zeros();
        let particle = Particle { position: none, velocity: none, best: none, least: T::LARGEST };
        Self {
            bounds,
            settings,
            particles: [particle; N],
            best: bounds.low,
            least: T::LARGEST,
            turn: 0,
            state: None,
            iterations: 0,
            evaluations: 0,
            spread: T::one(),
            stopped: None,
        }
    }

    /// Works off at most `budget` blocks of the cost; says why it stopped, once it has.
    ///
    /// An evaluation counts as one block at the least. Cost and generator must be the same at every call. In addition to the
    /// blocks, an evaluation costs 2P draws, and an iteration N P comparisons.
    pub fn step<C: Cost<T, P, State = S>>(
        &mut self,
        cost: &C,
        rng: &mut impl Rng,
        budget: usize,
    ) -> Option<Termination> {
        let mut left = budget;
        while left > 0 && self.is_under_way() {
            let before = left;
            if !self.evaluate(cost, rng, &mut left) {
                break;
            }
            left = left.min(before - 1);
        }
        self.stopped
    }

    /// Runs to the end in one go.
    pub fn run<C: Cost<T, P, State = S>>(&mut self, cost: &C, rng: &mut impl Rng) -> SwarmReport<T> {
        while self.step(cost, rng, usize::MAX).is_none() {}
        self.report()
    }

    /// Runs to the end as [`run`](Self::run) does, and to the same bits, with the costs of several particles at once.
    ///
    /// `costs` works out those of the positions it is given, on as many cores as there are: of the next particles, as
    /// they move where none before them betters the best. Where one does, the particles after it move again by the new
    /// best, and their costs are worked out again. A cost under way is begun again.
    pub fn run_ahead<R: Rng + Clone>(
        &mut self,
        rng: &mut R,
        mut costs: impl FnMut(&[SVector<T, P>], &mut [T]),
    ) -> SwarmReport<T> {
        let mut ahead = FEWEST_AHEAD;
        while self.is_under_way() {
            let (mut positions, mut values) = ([SVector::zeros(); N], [T::LARGEST; N]);
            let count = self.look_ahead(&mut rng.clone(), ahead, &mut positions);
            let (Some(positions), Some(values)) = (positions.get(..count), values.get_mut(..count)) else {
                break;
            };
            costs(positions, values);
            let least = self.least;
            for value in values.iter() {
                self.move_next(rng);
                self.settle(*value);
                if self.least < least {
                    break;
                }
            }
            ahead = if self.least < least { (ahead / 2).max(FEWEST_AHEAD) } else { (2 * ahead).min(N) };
        }
        self.report()
    }

    /// Whether there is an iteration left; the search has stopped where there is none.
    fn is_under_way(&mut self) -> bool {
        if self.stopped.is_none() && (self.iterations >= self.settings.iterations || N == 0) {
            self.stopped = Some(Termination::Iterations);
        }
        self.stopped.is_none()
    }

    /// Positions of the next particles, at most `ahead` and none of the next iteration, if the best stays; their number.
    fn look_ahead(&self, rng: &mut impl Rng, ahead: usize, positions: &mut [SVector<T, P>; N]) -> usize {
        let (weights, begun) = (self.weights(), self.state.is_some());
        let next = self.particles.iter().skip(self.turn).take(ahead);
        let mut count = 0;
        for (particle, position) in next.zip(positions) {
            let mut particle = *particle;
            if count > 0 || !begun {
                particle.advance(&self.best, weights, &self.bounds, rng);
            }
            *position = particle.position;
            count += 1;
        }
        count
    }

    /// Works on the evaluation whose turn it is; true once it is done.
    fn evaluate<C: Cost<T, P, State = S>>(
        &mut self,
        cost: &C,
        rng: &mut impl Rng,
        budget: &mut usize,
    ) -> bool {
        self.move_next(rng);
        let Some(Particle { position, .. }) = self.particles.get(self.turn) else {
            self.turn = 0;
            return true;
        };
        let state = self.state.get_or_insert_with(|| cost.begin(position));
        let Some(value) = cost.advance(position, state, budget) else {
            return false;
        };
        self.settle(value);
        true
    }

    /// w, and c₁ = c₂; `None` in the first iteration, whose particles are scattered.
    fn weights(&self) -> Option<(T, T)> {
        let Settings { variant, iterations, .. } = self.settings;
        (self.iterations > 0).then(|| variant.weights(self.iterations, iterations))
    }

    /// Moves the particle whose turn it is, unless its evaluation has begun.
    fn move_next(&mut self, rng: &mut impl Rng) {
        let weights = self.weights();
        if let (None, Some(particle)) = (&self.state, self.particles.get_mut(self.turn)) {
            particle.advance(&self.best, weights, &self.bounds, rng);
        }
    }

    /// Takes the cost of the particle whose turn it is, which has moved.
    fn settle(&mut self, value: T) {
        let Some(Particle { position, best, least, .. }) = self.particles.get_mut(self.turn) else { return };
        self.state = None;
        self.evaluations = self.evaluations.saturating_add(1);
        if value.finite() && value < *least {
            *least = value;
            keep(best, position);
        }
        if value.finite() && value < self.least {
            self.least = value;
            keep(&mut self.best, position);
        }
        self.turn += 1;
        if self.turn >= N {
            self.turn = 0;
            self.finish_iteration();
        }
    }

    fn finish_iteration(&mut self) {
        self.iterations = self.iterations.saturating_add(1);
        self.spread = self.particles.iter().fold(T::zero(), |worst, particle| {
            particle.position.iter().zip(self.best.iter()).zip(self.bounds.range.iter()).fold(
                worst,
                |worst, ((x, best), range)| {
                    let distance = (*x - *best).abs();
                    if distance > worst * *range { distance / *range } else { worst }
                },
            )
        });
        self.stopped = if self.least >= T::LARGEST {
            Some(Termination::NotFinite)
        } else if self.spread <= self.settings.spread {
            Some(Termination::Spread)
        } else if self.iterations >= self.settings.iterations {
            Some(Termination::Iterations)
        } else {
            None
        };
    }

    /// The best position so far; the lower bounds before the first evaluation.
    pub fn best(&self) -> &SVector<T, P> {
        &self.best
    }

    /// What it did so far.
    pub fn report(&self) -> SwarmReport<T> {
        SwarmReport {
            termination: self.stopped,
            iterations: self.iterations,
            evaluations: self.evaluations,
            best: self.least,
            spread: self.spread,
        }
    }

    /// The bound that each parameter of the best touches: where one does, the bounds may exclude the truth.
    ///
    /// A parameter whose bounds are equal touches none.
    pub fn minimum_at_bound(&self) -> [Option<Side>; P] {
        let mut sides = [None; P];
        let limits = self.bounds.low.iter().zip(self.bounds.high.iter());
        for (side, (x, (low, high))) in sides.iter_mut().zip(self.best.iter().zip(limits)) {
            *side = match (x <= low, x >= high) {
                (true, false) => Some(Side::Low),
                (false, true) => Some(Side::High),
                _ => None,
            };
        }
        sides
    }
}

/// A number in [0, 1), a multiple of 2⁻²⁴: the top 24 of 32 bits drawn, exact in `f32`, so that `f32` and `f64`
/// draw alike.
#[inline]
pub fn uniform<T: Scalar>(rng: &mut impl Rng) -> T {
    T::whole(rng.next_u32() >> 8) * T::of(1.0 / 16_777_216.0)
}
