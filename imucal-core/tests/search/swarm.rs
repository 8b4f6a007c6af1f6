//! The swarm on functions whose minimum is known.

use imucal_core::solver::{
    Swarm, Termination,
    swarm::{Bounds, Cost, Settings, Side, SwarmReport, Variant, uniform},
};
use nalgebra::SVector;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A sum with a term for each index, each term a block.
struct Sum<const P: usize> {
    term: fn(&SVector<f64, P>, usize) -> f64,
    terms: usize,
}

impl<const P: usize> Cost<f64, P> for Sum<P> {
    type State = (usize, f64);

    fn begin(&self, _: &SVector<f64, P>) -> (usize, f64) {
        (0, 0.0)
    }

    fn advance(&self, theta: &SVector<f64, P>, state: &mut (usize, f64), budget: &mut usize) -> Option<f64> {
        while state.0 < self.terms {
            *budget = budget.checked_sub(1)?;
            state.1 += (self.term)(theta, state.0);
            state.0 += 1;
        }
        Some(state.1)
    }
}

fn sphere<const P: usize>() -> Sum<P> {
    Sum { term: |x, k| (x[k] - 1.0).powi(2), terms: P }
}

/// Rosenbrock's valley; its minimum is at one.
fn rosenbrock<const P: usize>() -> Sum<P> {
    let term =
        |x: &SVector<f64, P>, k: usize| 100.0 * (x[k + 1] - x[k] * x[k]).powi(2) + (1.0 - x[k]).powi(2);
    Sum { term, terms: P - 1 }
}

/// Rastrigin's grid of minima; the lowest is at one here.
fn rastrigin<const P: usize>() -> Sum<P> {
    let term = |x: &SVector<f64, P>, k: usize| {
        let d = x[k] - 1.0;
        d * d + 10.0 * (1.0 - (std::f64::consts::TAU * d).cos())
    };
    Sum { term, terms: P }
}

fn bounds<const P: usize>() -> Bounds<f64, P> {
    Bounds::new(SVector::repeat(-5.12), SVector::repeat(5.12)).unwrap()
}

/// A run and the position it ends in.
fn run<const P: usize>(
    cost: &Sum<P>,
    settings: Settings<f64>,
    seed: u64,
) -> (SwarmReport<f64>, SVector<f64, P>) {
    let mut swarm = Swarm::<_, 40, P, _>::new(bounds(), settings);
    let report = swarm.run(cost, &mut ChaCha8Rng::seed_from_u64(seed));
    (report, *swarm.best())
}

/// Runs of 50 seeds that end within 0.1 of the minimum at one: in its basin, since Rastrigin's others are 1 away.
fn successes<const P: usize>(cost: &Sum<P>, settings: Settings<f64>) -> u32 {
    (0..50).map(|seed| u32::from((run(cost, settings, seed).1 - SVector::repeat(1.0)).amax() < 0.1)).sum()
}

const CONSTRICTION: Settings<f64> =
    Settings { variant: Variant::Constriction, iterations: 1000, spread: 1e-9 };
const INERTIA: Settings<f64> = Settings { variant: Variant::LinearInertia, iterations: 1000, spread: 1e-9 };

#[test]
fn success_rates_are_those_of_the_table() {
    let rates = [CONSTRICTION, INERTIA].map(|s| {
        [
            successes(&sphere::<12>(), s),
            successes(&rosenbrock::<2>(), s),
            successes(&rosenbrock::<4>(), s),
            successes(&rastrigin::<2>(), s),
            successes(&rastrigin::<5>(), s),
        ]
    });
    // Of 50 seeds, 40 particles and 1000 iterations: sphere 12, Rosenbrock 2 and 4, Rastrigin 2 and 5 parameters.
    // Constriction settles early and is caught by a grid of minima; falling inertia explores, and is late in a valley.
    assert_eq!(rates, [[50, 50, 48, 50, 16], [50, 50, 7, 50, 50]]);
}

#[test]
fn a_settled_swarm_holds_the_exact_minimum() {
    let (report, best) = run(&sphere::<12>(), CONSTRICTION, 7);
    assert_eq!(report.termination, Some(Termination::Spread));
    assert!((best - SVector::repeat(1.0)).amax() < 1e-7, "{best}");
    assert!(report.best < 1e-14 && report.spread <= 1e-9);
    assert_eq!(report.evaluations, 40 * u32::from(report.iterations));
    let (_, best) = run(&rosenbrock::<2>(), CONSTRICTION, 7);
    assert!((best - SVector::repeat(1.0)).amax() < 1e-6, "{best}");
    let (_, best) = run(&rastrigin::<2>(), INERTIA, 7);
    assert!((best - SVector::repeat(1.0)).amax() < 1e-7, "{best}");
}

#[test]
fn the_same_seed_gives_the_same_bits_and_another_does_not() {
    let bits = |seed| run(&rastrigin::<5>(), CONSTRICTION, seed).1.map(f64::to_bits);
    assert_eq!(bits(3), bits(3));
    assert_ne!(bits(3), bits(4));
}

#[test]
fn slices_of_any_size_give_the_same_bits_and_never_more_work_than_granted() {
    struct Counted(std::cell::Cell<usize>);
    impl Cost<f64, 5> for Counted {
        type State = (usize, f64);
        fn begin(&self, theta: &SVector<f64, 5>) -> Self::State {
            rastrigin().begin(theta)
        }
        fn advance(
            &self,
            theta: &SVector<f64, 5>,
            state: &mut Self::State,
            budget: &mut usize,
        ) -> Option<f64> {
            let before = *budget;
            let value = rastrigin().advance(theta, state, budget);
            self.0.set(self.0.get() + before - *budget);
            value
        }
    }
    let settings = Settings { iterations: 50, ..CONSTRICTION };
    let whole = run(&rastrigin::<5>(), settings, 11);
    for slice in [1, 2, 3, 5, 7, 101] {
        let mut swarm = Swarm::<_, 40, 5, _>::new(bounds(), settings);
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let cost = Counted(Default::default());
        while swarm.step(&cost, &mut rng, slice).is_none() {
            assert!(cost.0.take() <= slice);
        }
        assert_eq!((swarm.report(), *swarm.best()), whole, "slices of {slice}");
        assert_eq!(swarm.step(&cost, &mut rng, slice), whole.0.termination);
    }
}

#[test]
fn costs_ahead_of_their_turn_change_not_a_bit_and_few_are_in_vain() {
    let cost = rastrigin::<5>();
    for (settings, seed) in [(CONSTRICTION, 11), (Settings::default(), 12), (Settings::default(), 13)] {
        let whole = run(&cost, settings, seed);
        // From the beginning, and from within an evaluation.
        for begun in [0, 1, 3, 5 * 47 + 2] {
            let mut swarm = Swarm::<_, 40, 5, _>::new(bounds(), settings);
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            assert_eq!(swarm.step(&cost, &mut rng, begun), None);
            let mut worked_out = 0;
            let report = swarm.run_ahead(&mut rng, |positions, values| {
                worked_out += positions.len() as u32;
                positions.iter().zip(values).for_each(|(theta, value)| *value = cost.cost(theta));
            });
            assert_eq!((report, *swarm.best()), whole, "seed {seed}, {begun} blocks before");
            let share = f64::from(worked_out) / f64::from(report.evaluations);
            assert!(share < 1.3, "{share} costs for one that is kept");
        }
    }
}

#[test]
fn a_grant_without_end_ends_in_one_step() {
    let mut swarm = Swarm::<_, 40, 2, _>::new(bounds(), CONSTRICTION);
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    assert!(swarm.step(&sphere::<2>(), &mut rng, usize::MAX).is_some());
}

#[test]
fn a_grant_of_nothing_does_nothing() {
    let mut swarm = Swarm::<_, 4, 3, _>::new(bounds(), CONSTRICTION);
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    assert_eq!(swarm.step(&sphere(), &mut rng, 0), None);
    assert_eq!(swarm.report().evaluations, 0);
    assert_eq!(rng.next_u32(), ChaCha8Rng::seed_from_u64(0).next_u32());
}

#[test]
fn a_bound_that_excludes_the_minimum_is_named() {
    let bounds = Bounds::new(SVector::from([-5.0, -5.0, 2.0]), SVector::from([0.5, 5.0, 5.0])).unwrap();
    let mut swarm = Swarm::<_, 20, 3, _>::new(bounds, CONSTRICTION);
    swarm.run(&sphere(), &mut ChaCha8Rng::seed_from_u64(2));
    assert_eq!(swarm.minimum_at_bound(), [Some(Side::High), None, Some(Side::Low)]);
    assert_eq!((swarm.best()[0], swarm.best()[2]), (0.5, 2.0));
}

#[test]
fn a_parameter_with_equal_bounds_stays_and_touches_nothing() {
    let bounds = Bounds::new(SVector::from([-5.0, 3.0]), SVector::from([5.0, 3.0])).unwrap();
    // The fixed parameter's cost of 4 hides differences of the other below 1e-8: no swarm draws closer than that.
    let mut swarm = Swarm::<_, 20, 2, _>::new(bounds, Settings { spread: 1e-6, ..CONSTRICTION });
    let report = swarm.run(&sphere(), &mut ChaCha8Rng::seed_from_u64(2));
    assert_eq!(report.termination, Some(Termination::Spread));
    assert!((swarm.best() - SVector::from([1.0, 3.0])).amax() < 1e-5);
    assert_eq!(swarm.minimum_at_bound(), [None, None]);
}

#[test]
fn every_position_tried_lies_within_the_bounds() {
    struct Within;
    impl Cost<f32, 3> for Within {
        type State = ();
        fn begin(&self, theta: &SVector<f32, 3>) {
            assert!(theta.iter().all(|x| (-0.3..=0.7).contains(x)), "{theta}");
        }
        fn advance(&self, theta: &SVector<f32, 3>, _: &mut (), _: &mut usize) -> Option<f32> {
            Some(-theta.sum())
        }
    }
    let bounds = Bounds::new(SVector::repeat(-0.3), SVector::repeat(0.7)).unwrap();
    for variant in [Variant::Constriction, Variant::LinearInertia] {
        let mut swarm = Swarm::<_, 10, 3, _>::new(bounds, Settings { variant, ..Settings::default() });
        swarm.run(&Within, &mut ChaCha8Rng::seed_from_u64(5));
        assert_eq!(swarm.minimum_at_bound(), [Some(Side::High); 3]);
    }
}

#[test]
fn bounds_that_are_crossed_or_not_finite_are_refused() {
    let bounds = |low: f32, high: f32| Bounds::new(SVector::from([low]), SVector::from([high]));
    assert!(bounds(1.0, -1.0).is_none());
    assert!(bounds(f32::NAN, 1.0).is_none());
    assert!(bounds(0.0, f32::INFINITY).is_none());
    assert!(bounds(-f32::MAX, f32::MAX).is_none(), "their distance is not a number");
    assert!(bounds(1.0, 1.0).is_some());
}

#[test]
fn costs_that_are_not_finite_never_win_and_nothing_but_them_is_said() {
    struct Half(bool);
    impl Cost<f64, 1> for Half {
        type State = ();
        fn begin(&self, _: &SVector<f64, 1>) {}
        fn advance(&self, theta: &SVector<f64, 1>, _: &mut (), _: &mut usize) -> Option<f64> {
            Some(if self.0 && theta.x > 0.0 { theta.x } else { f64::NEG_INFINITY * theta.x })
        }
    }
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let mut swarm = Swarm::<_, 20, 1, _>::new(bounds(), CONSTRICTION);
    let report = swarm.run(&Half(false), &mut rng);
    assert_eq!((report.termination, report.iterations), (Some(Termination::NotFinite), 1));
    let mut swarm = Swarm::<_, 20, 1, _>::new(bounds(), Settings { iterations: 30, ..CONSTRICTION });
    let report = swarm.run(&Half(true), &mut rng);
    assert!(report.best.is_finite() && swarm.best().x > 0.0 && report.best == swarm.best().x);
}

#[test]
fn no_iterations_and_no_particles_end_at_once() {
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let mut swarm = Swarm::<_, 4, 3, _>::new(bounds(), Settings { iterations: 0, ..CONSTRICTION });
    assert_eq!(swarm.run(&sphere(), &mut rng).termination, Some(Termination::Iterations));
    let mut swarm = Swarm::<_, 0, 3, _>::new(bounds(), CONSTRICTION);
    assert_eq!(swarm.run(&sphere(), &mut rng).termination, Some(Termination::Iterations));
}

#[test]
fn both_precisions_draw_the_same_numbers_below_one() {
    let (mut a, mut b) = (ChaCha8Rng::seed_from_u64(1), ChaCha8Rng::seed_from_u64(1));
    for _ in 0..1000 {
        let (narrow, wide): (f32, f64) = (uniform(&mut a), uniform(&mut b));
        assert_eq!(f64::from(narrow), wide);
        assert!((0.0..1.0).contains(&wide));
    }
    struct Ones;
    impl rand::TryRng for Ones {
        type Error = std::convert::Infallible;
        fn try_next_u32(&mut self) -> Result<u32, Self::Error> {
            Ok(u32::MAX)
        }
        fn try_next_u64(&mut self) -> Result<u64, Self::Error> {
            Ok(u64::MAX)
        }
        fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Self::Error> {
            bytes.fill(u8::MAX);
            Ok(())
        }
    }
    assert_eq!(uniform::<f32>(&mut Ones), 1.0 - f32::EPSILON / 2.0);
}
