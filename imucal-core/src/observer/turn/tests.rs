use std::vec::Vec;

use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::{model::turn::attitude, rotation::exp};

/// A hand's turn by some angle about an axis that wanders, as rates at 100 Hz, rad/s.
fn hand(seed: u64, angle: f64) -> Vec<Vector3<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = || random.random::<f64>() - 0.5;
    let axis = Vector3::new(draw(), draw(), draw()).normalize();
    let wander = [0; 3].map(|_| Vector3::new(draw(), draw(), draw()));
    let samples = 200;
    (0..samples)
        .map(|k| {
            let share = f64::from(k) / f64::from(samples);
            let speed = angle / 2.0 * (1.0 - (std::f64::consts::TAU * share).cos());
            let [a, b, c] = [1.0, 2.0, 3.0].map(|n| (n * std::f64::consts::TAU * share).sin());
            axis * speed + (wander[0] * a + wander[1] * b + wander[2] * c) * (0.8 * speed)
        })
        .collect()
}

/// The turn as it is observed, between two rests of two seconds.
fn observed<const B: usize>(rates: &[Vector3<f64>], best: &Triad<f64>) -> ObservedTurn<f64, B> {
    observed_after(TurnObserver::new(), 8, rates, best)
}

/// The same where an observer has lost a turn before, and the first rest goes on for so many quarters once it is seen to be one.
fn observed_after<const B: usize>(
    mut observer: TurnObserver<f64, B>,
    quarters: usize,
    rates: &[Vector3<f64>],
    best: &Triad<f64>,
) -> ObservedTurn<f64, B> {
    let bias = &best.bias;
    let still = |observer: &mut TurnObserver<f64, B>| (0..25).for_each(|_| observer.push(bias, 0.01));
    assert!(observer.quarter(Stage::Resting, best).is_none());
    for _ in 0..quarters {
        still(&mut observer);
        assert!(observer.quarter(Stage::Resting, best).is_none());
    }
    for quarter in rates.chunks(25) {
        quarter.iter().for_each(|rate| observer.push(&(rate + bias), 0.01));
        assert!(observer.quarter(Stage::Moving, best).is_none());
    }
    for stage in [Stage::Moving, Stage::Moving, Stage::Moving, Stage::Still, Stage::Still] {
        still(&mut observer);
        assert!(observer.quarter(stage, best).is_none());
    }
    observer.quarter(Stage::Resting, best).expect("a turn")
}

fn product(rates: &[Vector3<f64>], triad: &Triad<f64>, bias: &Vector3<f64>) -> Matrix3<f64> {
    let still = std::iter::repeat_n(Vector3::zeros(), 100);
    let all = still.clone().take(75).chain(rates.iter().copied()).chain(still);
    all.fold(Matrix3::identity(), |c, rate| c * exp(&(triad.gain * (rate + bias - triad.bias) * 0.01)))
}

/// Largest angle, rad, by which turns of B blocks differ from the product over all samples.
fn largest_error<const B: usize>(angle: f64, gain_error: f64, known: f64) -> f64 {
    let bias = Vector3::new(0.02, -0.01, 0.03);
    let skew = Matrix3::new(1.0, 0.3, -0.4, -0.2, -0.8, 0.5, 0.3, 0.1, 0.9);
    let triad =
        Triad { gain: Matrix3::identity() + skew * gain_error, bias: bias + Vector3::new(1e-3, -1e-3, 5e-4) };
    let best = Triad { gain: Matrix3::identity() + skew * (gain_error * known), bias };
    let error = |seed| {
        let rates = hand(seed, angle);
        let turn = observed::<B>(&rates, &best);
        // The direction after is that which the product carries the one before to.
        let c = product(&rates, &triad, &bias);
        let before = Vector3::new(0.6, -0.5, 0.2).normalize();
        let carried = attitude(&triad, &turn.between(before, before)).tr_mul(&before);
        (carried - exp(&turn.remainder()) * c.tr_mul(&before)).norm()
    };
    (0..40).map(error).fold(0.0, f64::max)
}

#[test]
fn few_blocks_have_the_residual_of_all_samples_at_any_gain() {
    // Of a gain that is not known at all, and of one that is known to a twentieth.
    for (angle, gain_error, unknown, known) in
        [(1.6, 0.0, 2e-4, 2e-4), (1.6, 0.01, 4e-4, 2e-4), (1.6, 0.03, 8e-4, 2e-4), (3.1, 0.03, 4e-3, 1e-3)]
    {
        let five = largest_error::<5>(angle, gain_error, 0.0);
        let near = largest_error::<5>(angle, gain_error, 0.95);
        assert!(five < unknown && near < known, "{angle} rad, gain {gain_error}: {five:.1e}, {near:.1e}");
    }
}

#[test]
fn a_rate_from_before_a_gap_is_in_no_turn_after_it() {
    let best = Triad::identity();
    let mut lost = TurnObserver::<f64, 5>::new();
    assert!(lost.quarter(Stage::Resting, &best).is_none());
    (0..25).for_each(|_| lost.push(&Vector3::new(3.0, -2.0, 1.0), 0.01));
    assert!(lost.quarter(Stage::Moving, &best).is_none() && lost.interrupt());
    let rates = hand(1, 1.6);
    let [clean, after] =
        [TurnObserver::new(), lost].map(|observer| observed_after::<5>(observer, 2, &rates, &best));
    let before = Vector3::new(0.6, -0.5, 0.2).normalize();
    let carried = |turn: &ObservedTurn<f64, 5>| {
        exp(&turn.remainder()) * attitude(&best, &turn.between(before, before)).tr_mul(&before)
    };
    let off = (carried(&after) - carried(&clean)).norm();
    assert!(off < 1e-12, "{off:.1e}");
}
