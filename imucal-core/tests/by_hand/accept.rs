//! Acceptance: each limit from both sides, and the departure from a parabola of a curve whose departure is known.

use imucal_core::{
    accept::{
        Limits, Quantity, Refusal, check_nonlinearity, check_observations, check_plausibility,
        check_precision, check_report, check_residual, nonlinearity,
    },
    coverage::Coverage,
    solver::{LevenbergMarquardt, SolveReport, Termination},
    triad::Triad,
};
use nalgebra::{Matrix3, SVector, Vector3};

use crate::rows::{Bent, Rows};

fn limits() -> Limits {
    Limits::for_norm(9, 12)
}

#[test]
fn one_observation_more_than_parameters_is_asked_of_a_norm() {
    let asked = limits();
    assert_eq!((asked.observations, asked.directions), (10, 12));
    assert_eq!((asked.gain, asked.coverage, asked.flatness), ((0.5, 2.0), 0.25, 0.01));
    assert_eq!((asked.nonlinearity, asked.rms), (0.1, 0.05));
    assert_eq!(Limits::for_norm(6, 7).observations, 7);
}

#[test]
fn observations_are_refused_below_each_limit_and_taken_at_it() {
    let at = Coverage { observations: 10, share: 0.25, flatness: 0.01, distinct: 12 };
    let check = |coverage: Coverage<f64>| check_observations(&coverage, 9, &limits());
    assert_eq!(check(at), Ok(()));
    assert_eq!(check(Coverage { observations: 11, share: 1.0, flatness: 0.3, distinct: 24 }), Ok(()));
    assert_eq!(
        check(Coverage { observations: 9, ..at }),
        Err(Refusal::TooFewObservations { have: 9, need: 10 })
    );
    assert_eq!(check(Coverage { observations: 3, ..at }).unwrap_err().reason(), "too-few-observations");
    let poor = |share: f64, flatness: f64| {
        let refusal = Refusal::PoorCoverage {
            coverage: share,
            flatness,
            need_coverage: limits().coverage,
            need_flatness: limits().flatness,
        };
        assert_eq!(check(Coverage { share, flatness, ..at }), Err(refusal));
    };
    poor(0.25f64.next_down(), 0.3);
    poor(1.0, 0.01f64.next_down());
    poor(0.1, 0.3);
    poor(1.0, 0.001);
    let refusal = Refusal::NotRedundant { directions: 11, need: 12, parameters: 9 };
    assert_eq!(check(Coverage { distinct: 11, ..at }), Err(refusal));
    assert_eq!(check(Coverage { distinct: 2, ..at }).unwrap_err().reason(), "not-redundant");
}

#[test]
fn the_first_limit_that_is_not_kept_is_the_refusal() {
    let none = Coverage { observations: 0, share: 0.0, flatness: 0.0, distinct: 0 };
    let reason = |coverage: Coverage<f64>| check_observations(&coverage, 9, &limits()).unwrap_err().reason();
    assert_eq!(reason(none), "too-few-observations");
    assert_eq!(reason(Coverage { observations: 10, ..none }), "poor-coverage");
    assert_eq!(
        reason(Coverage { observations: 10, share: 1.0, flatness: 0.3, distinct: 0 }),
        "not-redundant"
    );
}

fn report(termination: Termination, condition: f64) -> SolveReport<f64> {
    SolveReport {
        termination,
        iterations: 3,
        evaluations: 7,
        independent_rows: 20,
        cost: 0.5,
        gradient: 0.0,
        condition,
    }
}

#[test]
fn only_a_solver_that_stopped_at_a_minimum_is_believed() {
    for good in [Termination::Gradient, Termination::Step, Termination::Precision, Termination::Spread] {
        assert_eq!(check_report(&report(good, 1.0)), Ok(()), "{good:?}");
    }
    for termination in [Termination::Iterations, Termination::Stalled] {
        let refusal = Refusal::DidNotConverge { termination };
        assert_eq!(check_report(&report(termination, 1.0)), Err(refusal));
    }
    assert_eq!(check_report(&report(Termination::NotFinite, 1.0)), Err(Refusal::NotFinite));
}

#[test]
fn a_condition_is_taken_at_its_limit_and_refused_beyond() {
    // A hundredth of 1/ε of the arithmetic.
    let limit = 0.01 / f64::EPSILON;
    let check = |condition| check_report(&report(Termination::Step, condition));
    assert_eq!((check(1.0), check(limit)), (Ok(()), Ok(())));
    let beyond = limit.next_up();
    assert_eq!(check(beyond), Err(Refusal::IllConditioned { condition: beyond, limit }));
}

#[test]
fn an_expected_error_is_taken_at_its_limit_and_refused_beyond() {
    let check = |error: f64| check_precision(error, &limits());
    assert_eq!((check(0.0), check(0.06)), (Ok(()), Ok(())));
    let beyond = 0.06f64.next_up();
    assert_eq!(check(beyond), Err(Refusal::Imprecise { error: beyond, limit: 0.06 }));
    assert!(check(f64::MAX).is_err());
}

#[test]
fn a_departure_is_taken_at_its_limit_and_refused_beyond() {
    // As imprecise as is allowed, half, a fifth, a hundredth of it, and not known.
    for (error, limit) in [(0.06, 0.1), (0.03, 0.2), (0.012, 0.5), (0.0006, 0.5), (0.0, 0.5), (f64::NAN, 0.1)]
    {
        let check = |departure: f64| check_nonlinearity(departure, error, &limits());
        assert_eq!((check(0.0), check(limit * (1.0 - 1e-12))), (Ok(()), Ok(())), "{error}");
        let beyond = limit * (1.0 + 1e-12);
        let Err(Refusal::TooNonlinear { nonlinearity, limit: stated }) = check(beyond) else {
            panic!("{beyond} at {error}");
        };
        assert_eq!(nonlinearity, beyond);
        assert!((stated / limit - 1.0).abs() < 1e-12, "{stated} at {error}");
    }
}

#[test]
fn a_residual_is_taken_at_its_limit_and_refused_beyond() {
    let check = |share: f64| check_residual(share, &limits());
    assert_eq!((check(0.0), check(0.05)), (Ok(()), Ok(())));
    let value = 0.05f64.next_up();
    let refusal = Refusal::Implausible { what: Quantity::Residual, value, limit: 0.05 };
    assert_eq!(check(value), Err(refusal));
    assert_eq!(check(f64::NAN), Err(Refusal::NotFinite));
    assert_eq!(check(f64::INFINITY), Err(Refusal::NotFinite));
}

/// Axes of these gains, each turned a little way, so that an axis' gain is a column's length and no entry.
fn of_gains(gains: [f64; 3]) -> Triad<f64> {
    let turned = Matrix3::new(0.6, -0.8, 0.0, 0.8, 0.6, 0.0, 0.0, 0.0, 1.0);
    Triad { gain: turned * Matrix3::from_diagonal(&Vector3::from(gains)), bias: Vector3::zeros() }
}

#[test]
fn a_nominal_axis_is_taken_between_half_and_twice_its_gain() {
    // Ratios stay within: most over least is four.
    let check = |gains| check_plausibility(&of_gains(gains), true, 0.0, &limits());
    assert_eq!(check([1.0, 1.0, 1.0]), Ok(()));
    for axis in 0..3 {
        let with = |gain: f64| {
            let mut gains = [1.0; 3];
            gains[axis] = gain;
            check(gains)
        };
        let refused = |value: f64, limit: f64| match with(value) {
            Err(Refusal::Implausible { what: Quantity::Gain, value: found, limit: named }) => {
                assert!((found - value).abs() < 1e-15 && named == limit, "{found} {named}");
            }
            other => panic!("{value}: {other:?}"),
        };
        assert_eq!((with(0.5 + 1e-12), with(2.0 - 1e-12)), (Ok(()), Ok(())));
        refused(0.5 - 1e-12, 0.5);
        refused(2.0 + 1e-12, 2.0);
    }
    // In another unit than SI a gain may be anything.
    assert_eq!(check_plausibility(&of_gains([3e4, 3e4, 3e4]), false, 0.0, &limits()), Ok(()));
    assert_eq!(check_plausibility(&of_gains([3e-4, 3e-4, 3e-4]), false, 0.0, &limits()), Ok(()));
}

#[test]
fn an_axis_is_taken_up_to_four_times_another() {
    let check = |gains| check_plausibility(&of_gains(gains), false, 0.0, &limits());
    for (strong, weak) in [(0, 1), (1, 2), (2, 0), (1, 0)] {
        let with = |ratio: f64| {
            let mut gains = [20.0; 3];
            (gains[strong], gains[weak]) = (10.0 * ratio, 10.0);
            check(gains)
        };
        assert_eq!(with(4.0 - 1e-12), Ok(()));
        match with(4.5) {
            Err(Refusal::Implausible { what: Quantity::AxisRatio, value, limit }) => {
                assert!((value - 4.5).abs() < 1e-14 && limit == 4.0, "{value} {limit}");
            }
            other => panic!("{other:?}"),
        }
    }
    // A nominal gain is asked first, and an axis that senses nothing is no sensor's.
    let both = check_plausibility(&of_gains([0.4, 2.0, 2.0]), true, 0.0, &limits());
    assert!(matches!(both, Err(Refusal::Implausible { what: Quantity::Gain, .. })), "{both:?}");
    assert!(check([1.0, 1.0, 0.0]).is_err());
}

#[test]
fn a_result_that_is_not_finite_is_no_sensor() {
    let triad = of_gains([1.0; 3]);
    let bias = |x: f64| Triad { bias: Vector3::new(0.0, x, 0.0), ..triad };
    for (triad, rms) in [(bias(f64::NAN), 0.0), (bias(f64::INFINITY), 0.0), (triad, f64::NAN)] {
        assert_eq!(check_plausibility(&triad, false, rms, &limits()), Err(Refusal::NotFinite));
    }
    let noisy = check_plausibility(&triad, true, 0.06, &limits());
    let refusal = Refusal::Implausible { what: Quantity::Residual, value: 0.06, limit: 0.05 };
    assert_eq!(noisy, Err(refusal));
}

/// r = g θ + c (g θ)², and what is left of it at θ = 0: two residuals of `spread`, so that their variance is its
/// square with the two degrees of freedom that one parameter leaves.
///
/// A standard error k times inflated is k `spread`/g; the parabola rises by (k `spread`)² there, the sum of squares by
/// (k `spread`)² (1 ± c k `spread`)². It departs by 2 |c| k `spread` + (c k `spread`)².
fn bent(slope: f64, bend: f64, at: f64, spread: f64) -> Bent {
    Bent { slope, bend, at, spread, end: None }
}

/// A fit that has stopped at the minimum.
fn stopped(model: &Bent) -> LevenbergMarquardt<f64, 1> {
    let mut fit = LevenbergMarquardt::new(SVector::from([model.at]), Default::default());
    assert_eq!(fit.run(model).termination, Termination::Gradient);
    assert!((fit.variance().expect("redundant") / model.spread.powi(2) - 1.0).abs() < 1e-12);
    fit
}

#[test]
fn a_bent_cost_departs_by_what_its_bend_says() {
    for (slope, bend, spread, inflation) in
        [(1.0, 0.3, 0.5, 1.0), (3.0, 0.3, 0.5, 1.0), (3.0, -0.2, 0.7, 2.0), (0.25, 0.05, 4.0, 1.5)]
    {
        let model = bent(slope, bend, 0.0, spread);
        let found = nonlinearity(&stopped(&model), &model, inflation);
        let reach = f64::abs(bend) * inflation * spread;
        let expected = 2.0 * reach + reach * reach;
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} against {expected}");
    }
}

#[test]
fn a_straight_cost_departs_by_nothing_and_no_residual_by_none() {
    let straight = bent(3.0, 0.0, 0.0, 0.5);
    assert!(nonlinearity(&stopped(&straight), &straight, 2.0) < 1e-12);
    let exact = Rows { rows: vec![(0.0, [1.0]), (0.0, [2.0])] };
    let mut fit = LevenbergMarquardt::new(SVector::from([0.0]), Default::default());
    fit.run(&exact);
    assert_eq!(nonlinearity(&fit, &exact, 1.0), 0.0);
}

#[test]
fn without_redundancy_the_departure_is_the_largest() {
    let one = Rows { rows: vec![(1.0, [1.0])] };
    let flat = Rows { rows: vec![(1.0, [0.0]), (2.0, [0.0])] };
    for model in [one, flat] {
        let mut fit = LevenbergMarquardt::new(SVector::from([0.0]), Default::default());
        fit.run(&model);
        assert_eq!(nonlinearity(&fit, &model, 1.0), f64::MAX, "{model:?}");
    }
}

#[test]
fn a_cost_that_ends_within_a_standard_error_departs_by_the_largest() {
    let whole = bent(1.0, 0.1, 0.0, 0.5);
    // On one side alone, in each of the ways a number can end.
    for side in [-0.1, 0.1] {
        for value in [f64::NAN, f64::INFINITY] {
            let model = Bent { end: Some((side, value)), ..whole };
            assert_eq!(nonlinearity(&stopped(&whole), &model, 1.0), f64::MAX, "{value} from {side} on");
        }
    }
}

#[test]
fn a_rise_below_the_rounding_of_the_cost_tells_nothing() {
    // The sum 2 s² of residuals whose terms are g θ rounds by 2 ε √(2 s² (g θ)² / 3); a tenth of the rise, (k s)²,
    // is less where θ lies beyond k² s / (20 ε g √(2/3)).
    let (slope, spread, inflation) = (3.0, 1e-3, 1.5);
    let edge = inflation * inflation * spread / (20.0 * f64::EPSILON * slope * f64::sqrt(2.0 / 3.0));
    let at = |theta: f64| {
        let model = bent(slope, 50.0, theta, spread);
        nonlinearity(&stopped(&model), &model, inflation)
    };
    assert!(at(0.99 * edge) > 0.05);
    assert_eq!(at(1.01 * edge), 0.0);
}

#[test]
fn every_refusal_has_its_name_and_says_its_figures() {
    let poor = Refusal::PoorCoverage {
        coverage: 0.123,
        flatness: 0.00456,
        need_coverage: 0.25,
        need_flatness: 0.01,
    };
    let implausible = |what| Refusal::Implausible { what, value: 0.4321, limit: 2.5 };
    let said: [(Refusal, &str, &[&str]); 15] = [
        (Refusal::NoRest, "no-rest", &["lay still"]),
        (Refusal::NoMotion, "no-motion", &["turned"]),
        (Refusal::TooFewObservations { have: 7, need: 10 }, "too-few-observations", &["7", "10"]),
        (poor, "poor-coverage", &["12 %", "25 %", "0.0046", "0.01"]),
        (
            Refusal::NotRedundant { directions: 6, need: 10, parameters: 9 },
            "not-redundant",
            &["6", "10", "9"],
        ),
        (
            Refusal::IllConditioned { condition: 1.25e15, limit: 4.5e13 },
            "ill-conditioned",
            &["1.2e15", "4.5e13"],
        ),
        (Refusal::Imprecise { error: 0.123, limit: 0.06 }, "ill-conditioned", &["12.3 %", "6.0 %"]),
        (Refusal::TooNonlinear { nonlinearity: 0.23, limit: 0.1 }, "ill-conditioned", &["23 %", "10 %"]),
        (Refusal::DidNotConverge { termination: Termination::Stalled }, "did-not-converge", &["stalled"]),
        (implausible(Quantity::Gain), "implausible", &["0.432", "2.5"]),
        (implausible(Quantity::AxisRatio), "implausible", &["0.43", "2.5"]),
        (implausible(Quantity::Residual), "implausible", &["43.2 %", "250.0 %"]),
        (implausible(Quantity::Slope), "implausible", &["0.432", "2.5"]),
        (implausible(Quantity::Heading), "implausible", &["0.432 times"]),
        (Refusal::NotFinite, "not-finite", &["NaN"]),
    ];
    for (refusal, reason, figures) in said {
        let text = refusal.to_string();
        assert_eq!(refusal.reason(), reason, "{text}");
        assert!(figures.iter().all(|figure| text.contains(figure)), "{text}");
    }
}
