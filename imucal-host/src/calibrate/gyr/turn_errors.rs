//! Standard errors of a gyroscope's gain from turns: what each turn's ends, its rates and the bias err by.
//!
//! ```text
//! r = Cᵀu − u',   δr = Cᵀ δu − δu' + B δb + [Cᵀu]× δφ
//! V = s² (V_a + ρ V_g)
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | u, u' | directions before and after, which neighbouring turns share ([`Directions`]): V_a, with the accelerometer's own covariance |
//! | δφ | angle random walk: the rate's white noise over the turn |
//! | δb, B | error of the bias, and how the turn follows it: one for all turns, or of the rests at both ends where it is interpolated |
//! | V_g | what δφ and δb come to |
//! | ρ | how much larger the gyroscope's part is than rests say: rates in motion are not those at rest |
//!
//! s and ρ come from the turns' own residuals ([`crate::noise::interval`]). Each turn is two rows, across the direction
//! after it. Not modelled: noise of rates that differs by axis, drift within a turn beyond the bias path.

use imucal_core::{
    model::{
        parameterisation::FULL,
        turn::{TurnModel, attitude},
    },
    observation::Turn,
    triad::Triad,
};
use nalgebra::{DMatrix, DVector, Matrix3, MatrixXx3, SMatrix, Vector3};
use rayon::prelude::*;

use crate::{
    calibrate::fit::{
        directions::{Directions, Move},
        rows::{Rows, influence},
    },
    noise::{
        interval::{Errors, Parts, Scale},
        state_space::{Row, StateSpace},
    },
};

/// See ρ, with prior weights.
const RATIOS: [(f64, f64); 4] = [(1.0, 0.85), (4.0, 0.1), (16.0, 0.04), (64.0, 0.01)];

/// A turn and which rests it is between.
#[derive(Clone, Copy, Debug)]
pub struct Between<'a> {
    /// The turn.
    pub turn: Turn<'a, f64>,
    /// The rests before and after.
    pub rests: (usize, usize),
}

/// What is known of the rates.
#[derive(Clone, Copy, Debug)]
pub struct RateNoise {
    /// Density of their white noise, (rad/s)²·s, mean of the axes.
    pub density: f64,
    /// Covariance of the bias that all turns share, (rad/s)².
    pub bias: Vector3<f64>,
    /// The bias of a turn is that of the rests at its ends.
    pub interpolated: bool,
}

/// How one turn's two rows follow what errs.
struct Linear {
    rests: (usize, usize),
    duration: f64,
    residual: [f64; 2],
    by_gain: DMatrix<f64>,
    by_bias: MatrixXx3<f64>,
    by_before: MatrixXx3<f64>,
    by_after: MatrixXx3<f64>,
}

fn linear(between: &Between<'_>, gain: &Matrix3<f64>) -> Linear {
    let triad = Triad { gain: *gain, bias: Vector3::zeros() };
    let turn = [between.turn];
    let rows = Rows::of(&TurnModel { turns: &turn, form: FULL }, &FULL.theta(&triad));
    let across = across(&turn[0].after);
    let jacobian = SMatrix::<f64, 3, 12>::from_fn(|row, k| rows.jacobian[row][k]);
    let moved = &across * jacobian;
    let c = attitude(&triad, &turn[0]);
    let residual = Vector3::from_column_slice(&rows.residuals);
    let residual = &across * residual;
    Linear {
        rests: between.rests,
        duration: (0..turn[0].blocks.len()).map(|k| turn[0].durations.get(k)).sum(),
        residual: [residual[0], residual[1]],
        by_gain: DMatrix::from_fn(2, 9, |row, k| moved[(row, k)]),
        by_bias: moved.fixed_columns::<3>(9).into(),
        by_before: &across * c.transpose(),
        by_after: -across,
    }
}

fn all_linear(turns: &[Between<'_>], gain: &Matrix3<f64>) -> Vec<Linear> {
    turns.par_iter().map(|turn| linear(turn, gain)).collect()
}

/// Two unit vectors across a direction, as rows.
pub fn across(direction: &Vector3<f64>) -> MatrixXx3<f64> {
    let least = direction.iamin();
    let one = direction.cross(&Vector3::ith(least, 1.0)).normalize();
    let other = direction.cross(&one);
    MatrixXx3::from_fn(2, |row, axis| if row == 0 { one[axis] } else { other[axis] })
}

/// Errors of the gain's nine entries; `None` where nothing is left over.
pub fn errors(
    turns: &[Between<'_>],
    gain: &Matrix3<f64>,
    directions: &Directions,
    rates: &RateNoise,
) -> Option<Errors> {
    let turns = all_linear(turns, gain);
    let noise = TurnCovariance::of_linear(&turns, directions, rates);
    let rows = 2 * turns.len();
    let (mut jacobian, mut residuals) = (DMatrix::zeros(rows, 9), DVector::zeros(rows));
    for (k, turn) in turns.iter().enumerate() {
        jacobian.rows_mut(2 * k, 2).copy_from(&turn.by_gain);
        residuals.rows_mut(2 * k, 2).copy_from_slice(&turn.residual);
    }
    noise.errors(&residuals, &jacobian, &influence(&jacobian)?)
}

/// V_a and V_g of turns, two rows each.
#[derive(Clone, Debug)]
pub struct TurnCovariance(StateSpace);

impl TurnCovariance {
    /// Of turns near a gain.
    pub fn of(
        turns: &[Between<'_>],
        gain: &Matrix3<f64>,
        directions: &Directions,
        rates: &RateNoise,
    ) -> Self {
        Self::of_linear(&all_linear(turns, gain), directions, rates)
    }

    fn of_linear(turns: &[Linear], directions: &Directions, rates: &RateNoise) -> Self {
        let of_ends = |(k, turn): (usize, &Linear)| {
            let ends = [(turn.rests.0, &turn.by_before), (turn.rests.1, &turn.by_after)];
            ends.map(|(rest, by)| {
                [0, 1].map(|row| Move { row: 2 * k + row, rest, by: by.row(row).transpose() })
            })
        };
        let moves: Vec<Move> = turns.iter().enumerate().flat_map(of_ends).flatten().collect();
        let mut rows = directions.rows(2 * turns.len(), &moves);
        for (k, row) in rows.iter_mut().enumerate() {
            follow_rates(row, &turns[k / 2], k % 2, directions, rates);
        }
        Self(
            directions
                .noise_of(rows, DMatrix::from_diagonal(&DVector::from_column_slice(rates.bias.as_slice()))),
        )
    }

    /// Errors of what follows from the rows by `influence`; see [`Parts::errors`].
    pub fn errors(
        &self,
        residuals: &DVector<f64>,
        jacobian: &DMatrix<f64>,
        influence: &DMatrix<f64>,
    ) -> Option<Errors> {
        let parts = Parts { parts: &self.0, ratios: &RATIOS, scale: Scale::Near, five: false };
        parts.errors(residuals, jacobian, influence)
    }
}

/// Adds V_g of one of a turn's rows.
fn follow_rates(row: &mut Row, turn: &Linear, which: usize, directions: &Directions, rates: &RateNoise) {
    // An angle about an axis across the direction turns it by as much; the gain is near one.
    row.own = rates.density * turn.duration;
    let by_bias: Vector3<f64> = turn.by_bias.row(which).transpose();
    row.shared[1] = DVector::from_column_slice(by_bias.as_slice());
    if !rates.interpolated {
        return;
    }
    // Turns that end at a rest share half of its bias' error.
    let ends = [turn.rests.0, turn.rests.1];
    let count = if ends[0] == ends[1] { 1 } else { 2 };
    for rest in ends.into_iter().take(count) {
        let span = &directions.spans[rest];
        let variance = 0.25 * rates.density / (span.end - span.start);
        row.independent.push((rest, by_bias * variance.sqrt()));
    }
}

/// The errors' covariance as a matrix of fixed size.
pub fn fixed(errors: &Errors) -> SMatrix<f64, 9, 9> {
    SMatrix::from_fn(|i, j| errors.covariance[(i, j)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::{Noise, interval::Whitening};

    fn turn(rests: (usize, usize), seed: f64) -> Linear {
        let by = |k: f64| MatrixXx3::from_fn(2, |i, j| (seed + k + (3 * i + j) as f64).sin());
        Linear {
            rests,
            duration: 2.0 + seed,
            residual: [0.0; 2],
            by_gain: DMatrix::zeros(2, 9),
            by_bias: by(0.0),
            by_before: by(1.0),
            by_after: by(2.0),
        }
    }

    #[test]
    fn rates_err_by_turn_by_the_bias_and_by_the_rests_that_turns_share() {
        let directions = Directions {
            triad: Triad::identity(),
            covariance: DMatrix::zeros(0, 0),
            covariance_of: Vec::new(),
            means: vec![Vector3::z(); 3],
            spans: (0..3).map(|k| 10.0 * f64::from(k)).map(|from| from..from + 4.0).collect(),
            noise: Noise { density: Vector3::repeat(1.0), white: 1.0, drift: 0.0 },
        };
        let turns = [turn((0, 1), 0.0), turn((1, 2), 5.0)];
        for interpolated in [false, true] {
            let rates = RateNoise { density: 0.2, bias: Vector3::new(0.1, 0.4, 0.3), interpolated };
            let mut rows = directions.rows(4, &[]);
            for (k, row) in rows.iter_mut().enumerate() {
                follow_rates(row, &turns[k / 2], k % 2, &directions, &rates);
            }
            let noise = directions
                .noise_of(rows, DMatrix::from_diagonal(&DVector::from_column_slice(&[0.1, 0.4, 0.3])));
            let [_, found] = noise.carried(&DMatrix::identity(4, 4));
            let expected = DMatrix::from_fn(4, 4, |i, j| {
                let (one, other) = (&turns[i / 2], &turns[j / 2]);
                let [by, by_other] =
                    [(one, i), (other, j)].map(|(turn, k)| turn.by_bias.row(k % 2).transpose());
                // One rest of each turn is the other's too; each has half of the bias' error, over 4 s.
                let shared = if i / 2 == j / 2 { 2.0 } else { 1.0 };
                let of_rests = if interpolated { shared * 0.25 * 0.2 / 4.0 * by.dot(&by_other) } else { 0.0 };
                let own = if i == j { 0.2 * one.duration } else { 0.0 };
                own + by.component_mul(&rates.bias).dot(&by_other) + of_rests
            });
            assert!((found - expected).amax() < 1e-14, "{interpolated}");
        }
    }
}
