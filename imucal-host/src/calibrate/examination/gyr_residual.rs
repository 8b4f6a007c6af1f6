//! What the residual of a gyroscope's turns could follow: columns for [`crate::calibrate::fit::score_test`].
//!
//! ```text
//! w' = w + ε e_j f(w),   f = w_j³, w_j², |w_j|, 1
//! z  = (r(w') − r(w)) / ε
//! ```
//!
//! Each turn is integrated again with rates that differ a little: soft saturation is a cubic term, vibration and
//! asymmetry are even ones, and a bias that differs in motion from that at rest is the last. Gains that follow a course
//! take the model's own derivatives times the course. Source: ours, from models.md 3. Not tested: g-sensitivity, which
//! turns between rests hardly show.

use imucal_core::{
    model::{parameterisation::FULL_GAIN, turn::TurnModel},
    observation::Turn,
};
use nalgebra::{DMatrix, SVector, Vector3};
use rayon::prelude::*;

use super::{norm_residual::Columns, residual_driver::Course};
use crate::{
    calibrate::{
        fit::rows::{Residuals, Rows},
        outcome::KnownTurn,
        suspicion::Follows,
    },
    observe::turn::{Rates, TurnData, TurnSamples},
};

/// Rates are altered by this share of the largest.
const SHARE: f64 = 1e-3;

/// How a rate is altered, and what a residual with it follows.
type Alteration = (&'static str, fn(f64) -> f64);

/// Name of the columns of a bias that is another in motion.
pub const MOTION: &str = "motion, as a bias makes it that is another at rest";

/// See the module's equation.
const ALTERATIONS: [Alteration; 4] = [
    ("rate, as cubic terms or soft saturation make it", |w| w * w * w),
    ("rate, as quadratic terms or rectified vibration make it", |w| w * w),
    ("rate, as gains make it that differ by sign", f64::abs),
    (MOTION, |_| 1.0),
];

fn known<'a>(turns: &'a [KnownTurn], data: &'a [TurnData]) -> Vec<Turn<'a, f64>> {
    turns.iter().zip(data).map(|(turn, data)| data.between(turn.before, turn.after)).collect()
}

/// Residuals and derivatives of the turns by the gain's nine entries.
pub fn rows(turns: &[KnownTurn], theta: &SVector<f64, 9>) -> Rows<9> {
    let data: Vec<TurnData> = turns.iter().map(|turn| turn.data.clone()).collect();
    Rows::of(&TurnModel { turns: &known(turns, &data), form: FULL_GAIN }, theta)
}

/// Residuals with altered rates, less those without, by the alteration's size; `None` where nothing moves. `most` is the largest rate
/// of any turn, rad/s.
fn column(
    turns: &[KnownTurn],
    samples: &[TurnSamples],
    (theta, as_is): (&SVector<f64, 9>, &[f64]),
    most: f64,
    (axis, of): (usize, fn(f64) -> f64),
) -> Option<Vec<f64>> {
    let size = SHARE * most / of(most);
    let altered = |mut rate: Vector3<f64>| {
        rate[axis] += size * of(rate[axis]);
        rate
    };
    let again = |(turn, samples): (&KnownTurn, &TurnSamples)| {
        samples.altered(&turn.data, altered).stretched(&turn.stretch)
    };
    let data: Vec<TurnData> = turns.iter().zip(samples).map(again).collect();
    let altered = Residuals::of(&TurnModel { turns: &known(turns, &data), form: FULL_GAIN }, theta);
    (size > 0.0).then(|| altered.iter().zip(as_is).map(|(a, b)| (a - b) / size).collect())
}

/// The columns of rates that are altered.
fn altered(
    turns: &[KnownTurn],
    samples: &[TurnSamples],
    (theta, rows): (&SVector<f64, 9>, &Rows<9>),
) -> Vec<Columns> {
    let count = rows.residuals.len();
    let most = samples.iter().map(TurnSamples::largest).fold(0.0, f64::max);
    let altered = ALTERATIONS.par_iter().filter_map(|(name, of)| {
        let of_axis = |axis| column(turns, samples, (theta, &rows.residuals), most, (axis, *of));
        let axes: Vec<_> = (0..3).into_par_iter().map(of_axis).collect::<Option<_>>()?;
        let values = DMatrix::from_fn(count, 3, |row, axis| axes[axis][row]);
        Some(Columns { follows: Follows::Rate, name: (*name).into(), values })
    });
    altered.collect()
}

/// All columns to test, three an axis, of courses over the turns.
pub fn columns(
    turns: &[KnownTurn],
    rates: Rates<'_>,
    theta: &SVector<f64, 9>,
    rows: &Rows<9>,
    courses: &[Course],
) -> Vec<Columns> {
    let count = rows.residuals.len();
    let samples: Result<Vec<_>, _> =
        turns.par_iter().map(|turn| TurnSamples::of(rates, &turn.data)).collect();
    // Turns that were integrated once can be again.
    let mut all = samples.map_or_else(|_| Vec::new(), |samples| altered(turns, &samples, (theta, rows)));
    all.extend(courses.iter().map(|course| Columns {
        follows: course.follows,
        name: format!("{}, as a gain makes it that changes", course.name),
        values: DMatrix::from_fn(count, 3, |row, axis| rows.jacobian[row][4 * axis] * course.values[row / 3]),
    }));
    all
}
