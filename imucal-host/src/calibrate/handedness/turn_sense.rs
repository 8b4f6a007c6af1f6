//! The sense in which a gyroscope says that a sensor was turned, against gravity's at the rests before and after.
//!
//! ```text
//! C = Π exp([c P (ω − b) Δt]×),   r = Cᵀ u_before − u_after,   P, c: the median of |r| is least
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | ω, b | nominal rate, and its mean at rest |
//! | u | direction of the specific force at rest |
//! | P | one of the 48 signed permutations of [`axis_swap`]: axes of the gyroscope to those of the accelerometer |
//! | c | 1, or what a wrong unit or range makes of a gain |
//!
//! With an accelerometer whose axes read Q f, Q orthogonal, gravity turns by `det(Q) Q ω`: where the gyroscope is right P
//! is always proper, `+Q` or `−Q`. So an improper P says that the gyroscope is mirrored, and a proper one other than 1
//! that either sensor is turned, or the accelerometer mirrored. Reversing all axes of the accelerometer (f taken for
//! gravity) does not show. Not modelled: misalignment, since P differs from others by much more.

use std::ops::Range;

use imucal_core::{
    model::turn,
    observation::Turn,
    session::sense::{ALIKE, LEAST_ANGLE, NEAR},
    triad::Triad,
};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::gain_remark::FACTORS;
use crate::{
    effect::axis_swap,
    observe::{
        rest::{RestDetector, Samples},
        turn::{BiasPath, TurnData, compress},
    },
    recording::{Recording, SensorKind, median},
};

/// Multiple of the initial rest's variance up to which the accelerometer alone is at rest.
const MULTIPLIER: f64 = 5.0;
/// Turns at least, and as many as are looked at.
pub const TURNS: (usize, usize) = (6, 32);

/// What carries gravity from rest to rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sense {
    /// Code of P; where the turns leave several, the one that is as it ought to be or has the fewest changes.
    pub code: usize,
    /// Factor c of the rates, 1 where none is needed.
    pub factor: f64,
}

/// Rests by the accelerometer alone: rates in a wrong unit hide those that the gyroscope has to confirm.
pub fn rests_by_force(recording: &Recording) -> Vec<Range<usize>> {
    let (Some(acc), Some(interval)) = (&recording.acc, recording.median_interval()) else {
        return Vec::new();
    };
    let usable: Vec<bool> = acc.values.iter().map(|force| force.iter().all(|x| x.is_finite())).collect();
    let Some(acc) = recording.series(SensorKind::Acc, &usable) else { return Vec::new() };
    let samples = Samples { acc, gyr: None, temperature: None };
    RestDetector::new(samples, interval).cut(MULTIPLIER).rests
}

/// Looks at the turns between rests; `None` without a gyroscope, with too few turns, or where no order and no factor
/// carries gravity.
pub fn of(recording: &Recording, rests: &[Range<usize>], acc: &Triad<f64>, factors: bool) -> Option<Sense> {
    let (data, ends) = turns(recording, rests, acc)?;
    let turns: Vec<Turn<'_, f64>> =
        data.iter().zip(&ends).map(|(turn, [before, after])| turn.between(*before, *after)).collect();
    if let Some(code) = carried(&turns) {
        return Some(Sense { code, factor: 1.0 });
    }
    let factors = FACTORS.iter().filter(|_| factors).flat_map(|(factor, _)| [*factor, factor.recip()]);
    let errors = factors.map(|factor| (error(&turns, factor), factor));
    let (least, factor) = errors.min_by(|a, b| a.0.total_cmp(&b.0))?;
    (least < NEAR).then_some(Sense { code: 0, factor })
}

/// The order of the axes that carries gravity, if any does.
fn carried(turns: &[Turn<'_, f64>]) -> Option<usize> {
    let attitudes = [1.0, -1.0].map(|factor| attitudes(turns, factor));
    let errors: Vec<(f64, usize)> =
        (0..axis_swap::CODES).filter_map(|code| Some((error_of(turns, &attitudes, code)?, code))).collect();
    let least = errors.iter().map(|(error, _)| *error).fold(f64::INFINITY, f64::min);
    let alike = errors.into_iter().filter(|(error, _)| *error <= ALIKE * least);
    let simplest = alike.map(|(_, code)| code).min_by_key(|code| changes(*code));
    simplest.filter(|_| least < NEAR)
}

/// Median error of the directions that rates in an order of the axes carry, rad; from the attitudes after the turns as
/// they are, and with their rates reversed.
///
/// P is a rotation Q or its reverse, and `exp([Q φ]×) = Q exp([φ]×) Qᵀ`: no order has to be integrated by itself.
fn error_of(turns: &[Turn<'_, f64>], attitudes: &[Vec<Matrix3<f64>>; 2], code: usize) -> Option<f64> {
    let p = axis_swap::signed_permutation(code)?;
    let sense = p.determinant();
    let (q, attitudes) = (p * sense, &attitudes[usize::from(sense < 0.0)]);
    let chord = |(t, c): (&Turn<'_, f64>, &Matrix3<f64>)| {
        (c.tr_mul(&q.tr_mul(&t.before)) - q.tr_mul(&t.after)).norm()
    };
    median(turns.iter().zip(attitudes).map(chord).collect())
}

/// Attitudes after turns whose rates are multiplied by a factor.
fn attitudes(turns: &[Turn<'_, f64>], factor: f64) -> Vec<Matrix3<f64>> {
    let triad = Triad { gain: Matrix3::identity() * factor, bias: Vector3::zeros() };
    turns.par_iter().map(|t| turn::attitude(&triad, t)).collect()
}

/// How much a code changes: axes out of place, then signs.
fn changes(code: usize) -> (u32, u32) {
    let p = axis_swap::signed_permutation(code).unwrap_or_else(Matrix3::zeros);
    let moved = 3 - p.diagonal().iter().filter(|x| **x != 0.0).count() as u32;
    (moved, (code % 8).count_ones())
}

/// Median error of the directions that rates carry, multiplied by a factor, rad.
fn error(turns: &[Turn<'_, f64>], factor: f64) -> f64 {
    let chord = |(t, c): (&Turn<'_, f64>, Matrix3<f64>)| (c.tr_mul(&t.before) - t.after).norm();
    let chords = turns.iter().zip(attitudes(turns, factor)).map(chord);
    median(chords.collect()).unwrap_or(f64::INFINITY)
}

type Turns = (Vec<TurnData>, Vec<[Vector3<f64>; 2]>);

/// Turns that move gravity, evenly from all, and its directions at their ends.
fn turns(recording: &Recording, rests: &[Range<usize>], acc: &Triad<f64>) -> Option<Turns> {
    let (force, gyr) = (recording.acc.as_ref()?, recording.gyr.as_ref()?);
    let usable: Vec<bool> = gyr.values.iter().map(|rate| rate.iter().all(|x| x.is_finite())).collect();
    let still: Vec<(Vector3<f64>, Vector3<f64>, f64)> = rests
        .iter()
        .map(|rows| {
            let direction = acc.correct(&mean(&force.values, rows)).normalize();
            let middle = 0.5 * (recording.time[rows.start] + recording.time[rows.end - 1]);
            (direction, mean(&gyr.values, rows), middle)
        })
        .collect();
    let moved: Vec<usize> = (1..rests.len())
        .filter(|k| {
            still[k - 1].0.angle(&still[*k].0) > LEAST_ANGLE && still[*k].1.iter().all(|x| x.is_finite())
        })
        .collect();
    let step = moved.len().div_ceil(TURNS.1).max(1);
    let rates = recording.series(SensorKind::Gyr, &usable)?;
    let turns: Turns = moved
        .into_iter()
        .step_by(step)
        .filter_map(|k| {
            let [before, after] = [&still[k - 1], &still[k]];
            let path = BiasPath { before: (before.2, before.1), after: (after.2, after.1) };
            let ends = (k - 1, &rests[k - 1], k, &rests[k]);
            let data = compress(rates, ends, &path).ok()?;
            Some((data, [before.0, after.0]))
        })
        .unzip();
    (turns.0.len() >= TURNS.0).then_some(turns)
}

/// Mean of the rows that are measured.
fn mean(values: &[Vector3<f64>], rows: &Range<usize>) -> Vector3<f64> {
    let measured = values[rows.clone()].iter().filter(|value| value.iter().all(|x| x.is_finite()));
    let (sum, count) =
        measured.fold((Vector3::zeros(), 0.0), |(sum, count), value| (sum + value, count + 1.0));
    sum / count
}

#[cfg(test)]
mod tests {
    use imucal_core::observation::{Block, Durations};

    use super::*;

    #[test]
    fn orders_of_the_axes_carry_directions_as_if_each_was_integrated() {
        let vector = |k: usize| Vector3::new((k as f64).sin(), (2.3 * k as f64).cos(), 0.4 * (k % 3) as f64);
        let blocks: Vec<_> = (0..40)
            .map(|k| Block { s0: vector(k) * 0.1, s1: vector(k + 1), c: vector(k + 2) * 0.02 })
            .collect();
        let turn = |k: usize| Turn {
            blocks: &blocks[k..k + 20],
            durations: Durations::Each(&[0.05; 20]),
            before: vector(k + 3).normalize(),
            after: vector(k + 4).normalize(),
        };
        let turns: Vec<_> = (0..7).map(turn).collect();
        let both = [1.0, -1.0].map(|factor| attitudes(&turns, factor));
        for code in 0..axis_swap::CODES {
            let triad = Triad { gain: axis_swap::signed_permutation(code).unwrap(), bias: Vector3::zeros() };
            let chord = |t: &Turn<'_, f64>| (turn::attitude(&triad, t).tr_mul(&t.before) - t.after).norm();
            let expected = median(turns.iter().map(chord).collect()).unwrap();
            let found = error_of(&turns, &both, code).unwrap();
            assert!((found - expected).abs() < 1e-12, "{code}: {found} {expected}");
        }
    }
}
