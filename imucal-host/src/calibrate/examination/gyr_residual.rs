//! What the residual of a gyroscope's turns could follow: columns for [`crate::calibrate::fit::score_test`].
//!
//! ```text
//! w' = w + ε f(w_j) e_j,   f(w) = w³, w², |w|, 1
//! z  = ∂r(w')/∂ε = [Cᵀ u_before]× Cᵀ Σ M_k ∂φ_k/∂ε
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | r, C, u_before | residual and attitude of a turn, and the direction before it ([`imucal_core::model::turn`]) |
//! | φ_k, M_k | rotation vector of a block, and how its change turns the attitude ([`Carrier::carry_with_derivative`]) |
//!
//! Soft saturation is a cubic term, vibration and asymmetry are even ones, and a bias that differs in motion from that at
//! rest is the last. Gains that follow a course take the model's own derivatives times the course. Source: ours, from
//! models.md 3. Not tested: g-sensitivity, which turns between rests hardly show.

use imucal_core::{
    model::{
        parameterisation::FULL_GAIN,
        turn::{Carrier, TurnModel},
    },
    triad::Triad,
};
use nalgebra::{DMatrix, Matrix3, SVector, Vector3};
use rayon::prelude::*;

use super::residual_driver::Course;
use crate::{
    calibrate::{
        fit::{parallel_turns::ParallelTurns, rows::Rows},
        outcome::KnownTurn,
        suspicion::Follows,
    },
    observe::turn::TurnSamples,
    recording::Series,
};

/// Columns of one test.
#[derive(Clone, Debug)]
pub struct Columns {
    /// What a residual with them follows.
    pub follows: Follows,
    /// In words, after "follows".
    pub name: String,
    /// A row a residual.
    pub values: DMatrix<f64>,
}

/// A function of a rate, and what a residual with it follows.
pub(super) type Alteration = (&'static str, fn(f64) -> f64);

/// Name of the columns of a bias that is another in motion.
pub const MOTION: &str = "motion, as a bias makes it that is another at rest";

/// See the module's equation.
pub(super) const ALTERATIONS: [Alteration; 4] = [
    ("rate, as cubic terms or soft saturation make it", |w| w * w * w),
    ("rate, as quadratic terms or rectified vibration make it", |w| w * w),
    ("rate, as gains make it that differ by sign", f64::abs),
    (MOTION, |_| 1.0),
];

/// Residuals and derivatives of the turns by the gain's nine entries.
pub fn rows(turns: &[KnownTurn], theta: &SVector<f64, 9>) -> Rows<9> {
    let known: Vec<_> = turns.iter().map(|turn| turn.data.between(turn.before, turn.after)).collect();
    Rows::of(&ParallelTurns(TurnModel { turns: &known, form: FULL_GAIN }), theta)
}

/// How a turn's residual changes with its rates, of each function a column for each axis.
fn changes(
    turn: &KnownTurn,
    samples: &TurnSamples,
    gain: &Matrix3<f64>,
) -> [Matrix3<f64>; ALTERATIONS.len()] {
    let carrier = |gain| Carrier::new(&Triad { gain, bias: Vector3::zeros() });
    // Changes are those of rates that were not stretched.
    let (integrated, changed) = (carrier(*gain), carrier(gain * turn.stretch));
    let known = turn.data.between(turn.before, turn.after);
    let mut c = Matrix3::identity();
    let mut turned = [Matrix3::zeros(); ALTERATIONS.len()];
    let changes = samples.changes(ALTERATIONS.map(|(_, of)| of));
    for (index, (block, changes)) in known.blocks.iter().zip(&changes).enumerate() {
        let m = integrated.carry_with_derivative(&mut c, block, known.durations.get(index));
        for (turned, change) in turned.iter_mut().zip(changes) {
            let by_axis = [0, 1, 2].map(|axis| changed.vector(&change.by(axis), 0.0));
            *turned += m * Matrix3::from_columns(&by_axis);
        }
    }
    let residual = c.tr_mul(&turn.before).cross_matrix() * c.transpose();
    turned.map(|turned| residual * turned)
}

/// The columns of rates that are altered.
fn altered(turns: &[KnownTurn], samples: &[TurnSamples], theta: &SVector<f64, 9>) -> Vec<Columns> {
    let gain = FULL_GAIN.triad(theta).gain;
    let changes: Vec<_> =
        turns.par_iter().zip(samples).map(|(turn, samples)| changes(turn, samples, &gain)).collect();
    let moved = samples.iter().any(TurnSamples::moves);
    let of_name = |(k, (name, _)): (usize, &Alteration)| Columns {
        follows: Follows::Rate,
        name: (*name).into(),
        values: DMatrix::from_fn(3 * turns.len(), 3, |row, axis| changes[row / 3][k][(row % 3, axis)]),
    };
    ALTERATIONS.iter().enumerate().filter(|_| moved).map(of_name).collect()
}

/// All columns to test, three an axis, of courses over the turns.
pub fn columns(
    turns: &[KnownTurn],
    rates: Series<'_>,
    theta: &SVector<f64, 9>,
    rows: &Rows<9>,
    courses: &[Course],
) -> Vec<Columns> {
    let count = rows.residuals.len();
    let samples: Result<Vec<_>, _> =
        turns.par_iter().map(|turn| TurnSamples::of(rates, &turn.data)).collect();
    // Turns that were integrated once can be again.
    let mut all = samples.map_or_else(|_| Vec::new(), |samples| altered(turns, &samples, theta));
    all.extend(courses.iter().map(|course| Columns {
        follows: course.follows,
        name: course.changing("gain"),
        values: DMatrix::from_fn(count, 3, |row, axis| rows.jacobian[row][4 * axis] * course.value(row / 3)),
    }));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observe::turn::{BiasPath, compress};

    #[test]
    fn columns_are_how_residuals_differ_where_rates_do() {
        let time: Vec<f64> = (0..120).map(|k| 0.01 * f64::from(k)).collect();
        let rate = |t: &f64| Vector3::new((5.0 * t).sin(), 0.8 * (3.0 * t).cos(), 0.6 - t);
        let values: Vec<_> = time.iter().map(rate).collect();
        let stretch = Matrix3::new(1.02, 0.01, 0.0, -0.01, 0.98, 0.02, 0.0, 0.01, 1.01);
        let path = BiasPath { before: (0.1, Vector3::zeros()), after: (1.1, Vector3::zeros()) };
        let usable = vec![true; time.len()];
        let rests = (0, &(0..20), 1, &(100..120));
        let turn = |values: &[Vector3<f64>]| {
            let rates = Series { time: &time, values, usable: &usable, interval: 0.01 };
            let data = compress(rates, rests, &path).unwrap().stretched(&stretch);
            KnownTurn { data, before: Vector3::new(0.6, 0.0, 0.8), after: Vector3::z(), stretch }
        };
        let gain = Matrix3::new(1.03, 0.02, -0.01, 0.01, 0.97, 0.03, 0.0, -0.02, 1.01);
        let theta = FULL_GAIN.theta(&Triad { gain, bias: Vector3::zeros() });
        let turns = [turn(&values)];
        let rates = Series { time: &time, values: &values, usable: &usable, interval: 0.01 };
        let found = columns(&turns, rates, &theta, &rows(&turns, &theta), &[]);
        for (columns, (name, f)) in found.iter().zip(ALTERATIONS) {
            for axis in 0..3 {
                let residuals = |size: f64| {
                    let altered: Vec<_> =
                        values.iter().map(|w| w + Vector3::ith(axis, size * f(w[axis]))).collect();
                    rows(&[turn(&altered)], &theta).residuals
                };
                let (above, below) = (residuals(1e-4), residuals(-1e-4));
                for (row, (above, below)) in above.iter().zip(&below).enumerate() {
                    let error = (above - below) / 2e-4 - columns.values[(row, axis)];
                    assert!(error.abs() < 1e-7, "{name}, axis {axis}: {error}");
                }
            }
        }
        assert_eq!(found.len(), ALTERATIONS.len());
    }
}
