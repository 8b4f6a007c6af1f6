//! What the residual of a gyroscope's motions between known attitudes could follow: columns for
//! [`crate::calibrate::fit::score_test`].
//!
//! ```text
//! w' = w + ε f(w_j − b_j) e_j,   f(w) = w³, w², |w|
//! z  = ∂δφ(w')/∂ε
//! z  = ∂δφ/∂p d φ    d = e_j for b and for each entry of G, A e_j e_jᵀ and [e_j]× A for A: a gain, and the mounting
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | δφ, A, b, G | residual, gain, bias and g-sensitivity ([`imucal_core::model::attitude`]) |
//! | p, d | its entries, and the direction in which they could change |
//! | φ | a course over the motions: time, a step in time, temperature; none for G |
//!
//! Source: ours, from models.md 3. A change of the rates is differentiated numerically. Not tested: what is the same in all
//! motions and in gain or bias.

use std::ops::Range;

use imucal_core::model::{
    attitude::AttitudeModel,
    parameterisation::{FULL_WITH_SENSITIVITY, GYROSCOPE_ENTRIES},
};
use nalgebra::{DMatrix, DVector, Matrix3, SVector, Vector3};
use rayon::prelude::*;

use super::{
    gyr_residual::{ALTERATIONS, Columns, MOTION},
    residual_driver::Course,
    tested::{Tested, judged, least_of_many},
};
use crate::{
    calibrate::{
        fit::{
            blocked_score::{self, BlockedScore},
            gyr_rig_fit::{MotionFit, Weighted, weights},
            rows::{Residuals, Rows},
            score_test::ScoreTest,
        },
        outcome::{FitSummary, entry_name},
        suspicion::{Follows, Suspicion},
    },
    observe::motion::MotionData,
};

/// Largest change of a rate over half of which a residual is differentiated, rad/s.
const CHANGE: f64 = 1e-4;

/// All parameters of a gyroscope.
type All = SVector<f64, GYROSCOPE_ENTRIES>;

/// What speaks against a fit to motions; `name` says which motion it is, where their errors are independent.
pub(super) fn examine(
    (data, of): (&[MotionData], &MotionFit),
    fit: &FitSummary,
    courses: &[Course],
    name: Option<&dyn Fn(usize) -> String>,
) -> Vec<Suspicion> {
    let theta = All::from_fn(|k, _| of.parameters.get(k).copied().unwrap_or(0.0));
    let used: Vec<&MotionData> = data.iter().collect();
    let (motions, weights): (Vec<_>, _) = (used.iter().map(|d| d.motion()).collect(), weights(&used));
    let model = Weighted { motions: &motions, weights: &weights, form: FULL_WITH_SENSITIVITY };
    let (rows, count) = (Rows::of(&model, &theta), 3 * data.len());
    let estimated = of.entries.len();
    let independent = count.saturating_sub(of.report.parameters.saturating_sub(estimated));
    let jacobian = rows.derivatives(count, &Vec::from_iter(0..estimated));
    let mut columns = altered(data, &weights, (&theta, &of.triad.bias));
    columns.extend(of_parameters(&rows, &of.triad.gain, courses));
    if name.is_some() {
        // The errors of a reference depend on the attitude as well.
        columns.extend(of_sensitivity(&rows, estimated));
    }
    let residuals = DVector::from_vec(rows.residuals);
    let tests = match name {
        Some(name) => one_by_one((&residuals, jacobian, independent), &columns, name),
        None => by_blocks((&residuals, &jacobian, independent), &columns),
    };
    let of_triad = |entry: &u8| match usize::from(*entry) {
        k @ 0..9 => fit.gain_std[(k / 3, k % 3)],
        k @ 9..12 => fit.bias_std[k - 9],
        _ => 0.0,
    };
    let std: Vec<f64> = of.entries.iter().map(of_triad).collect();
    judged(tests, &of.entries, &std, entry_name)
}

/// Tests of motions whose errors are independent.
fn one_by_one(
    (residuals, jacobian, independent): (&DVector<f64>, DMatrix<f64>, usize),
    columns: &[Columns],
    name: &dyn Fn(usize) -> String,
) -> Vec<Tested> {
    let Some(test) = ScoreTest::new(residuals.as_slice(), jacobian, independent) else { return Vec::new() };
    let of_columns = |columns: &Columns| {
        let score = test.test(&columns.values, columns.values.ncols())?;
        Some(Tested::of(columns, score))
    };
    let mut tests: Vec<Tested> = columns.par_iter().filter_map(of_columns).collect();
    tests.extend(Tested::alone(&test, 3, 3, residuals.len(), name));
    tests
}

/// Tests of motions along a reference: one ends where the next begins, and a reference is off by what depends on the place.
fn by_blocks(
    (residuals, jacobian, independent): (&DVector<f64>, &DMatrix<f64>, usize),
    columns: &[Columns],
) -> Vec<Tested> {
    let made = |motions: Range<usize>| {
        let (from, count) = (3 * motions.start, 3 * motions.len());
        let part = |matrix: &DMatrix<f64>| matrix.rows(from, count).into_owned();
        blocked_score::Rows {
            residual: residuals.rows(from, count).into_owned(),
            jacobian: part(jacobian),
            columns: columns.iter().map(|columns| part(&columns.values)).collect(),
        }
    };
    let Some(test) = BlockedScore::new(residuals.len() / 3, independent, &made) else { return Vec::new() };
    let tested = |(index, columns): (usize, &Columns)| {
        Some(Tested::of(columns, test.test(index, least_of_many(columns.follows))?))
    };
    columns.iter().enumerate().filter_map(tested).collect()
}

/// The columns of rates that are altered.
fn altered(data: &[MotionData], weights: &[f64], (theta, bias): (&All, &Vector3<f64>)) -> Vec<Columns> {
    let alterations = ALTERATIONS.iter().filter(|(name, _)| *name != MOTION);
    let of_alteration = |(name, of): &(&str, fn(f64) -> f64)| {
        let of_motion = |(motion, weight): (&MotionData, &f64)| change(motion, (theta, bias), *of) * *weight;
        let changes: Vec<Matrix3<f64>> = data.par_iter().zip(weights).map(of_motion).collect();
        let values = DMatrix::from_fn(3 * data.len(), 3, |row, axis| changes[row / 3][(row % 3, axis)]);
        Columns { follows: Follows::Rate, name: (*name).into(), values }
    };
    alterations.map(of_alteration).collect()
}

/// How a motion's residual changes with a function of each rate, a column for each axis.
fn change(motion: &MotionData, (theta, bias): (&All, &Vector3<f64>), of: fn(f64) -> f64) -> Matrix3<f64> {
    let rates = motion.samples.iter().map(|sample| sample.rate - bias);
    let most = rates.map(|rate| rate.map(|w| of(w).abs()).max()).fold(0.0, f64::max);
    if most <= 0.0 {
        return Matrix3::zeros();
    }
    let step = CHANGE / most;
    let residual = |axis: usize, step: f64| {
        let rate = |w: &Vector3<f64>| w + Vector3::ith(axis, step * of(w[axis] - bias[axis]));
        let altered = motion.altered(rate);
        let model = AttitudeModel { motions: &[altered.motion()], form: FULL_WITH_SENSITIVITY };
        Vector3::from_column_slice(&Residuals::of(&model, theta))
    };
    let by_axis = [0, 1, 2].map(|axis| (residual(axis, step) - residual(axis, -step)) / (2.0 * step));
    Matrix3::from_columns(&by_axis)
}

/// The columns of parameters that follow a course.
fn of_parameters(rows: &Rows<GYROSCOPE_ENTRIES>, gain: &Matrix3<f64>, courses: &[Course]) -> Vec<Columns> {
    let of_gain = |change: &dyn Fn(usize) -> Matrix3<f64>| {
        Vec::from_iter((0..3).map(|axis| {
            let change = change(axis);
            All::from_fn(|k, _| if k < 9 { change[(k / 3, k % 3)] } else { 0.0 })
        }))
    };
    let kinds = [
        ("bias", Vec::from_iter((9..12).map(|k| All::ith(k, 1.0)))),
        ("gain", of_gain(&|axis| Matrix3::from_fn(|i, j| if j == axis { gain[(i, j)] } else { 0.0 }))),
        ("mounting", of_gain(&|axis| Vector3::<f64>::ith(axis, 1.0).cross_matrix() * gain)),
    ];
    let of_course = |course: &Course| {
        let of_kind = |(kind, directions): &(&str, Vec<All>)| Columns {
            follows: course.follows,
            name: course.changing(kind),
            values: along(rows, directions, &|motion| course.value(motion)),
        };
        kinds.iter().map(of_kind).collect::<Vec<_>>()
    };
    courses.iter().flat_map(of_course).collect()
}

/// The columns of a g-sensitivity, where it is not estimated.
fn of_sensitivity(rows: &Rows<GYROSCOPE_ENTRIES>, estimated: usize) -> Option<Columns> {
    let directions = Vec::from_iter((estimated..GYROSCOPE_ENTRIES).map(|k| All::ith(k, 1.0)));
    (!directions.is_empty()).then(|| Columns {
        follows: Follows::Force,
        name: "specific force, as a g-sensitivity makes it".into(),
        values: along(rows, &directions, &|_| 1.0),
    })
}

/// Derivatives in some directions of all parameters, times a value of the motion.
fn along(rows: &Rows<GYROSCOPE_ENTRIES>, directions: &[All], value: &dyn Fn(usize) -> f64) -> DMatrix<f64> {
    let of_row = |row: usize, k: usize| rows.jacobian[row].dot(&directions[k]) * value(row / 3);
    DMatrix::from_fn(rows.residuals.len(), directions.len(), of_row)
}

#[cfg(test)]
mod tests {
    use imucal_core::rotation::exp;

    use super::*;
    use crate::{observe::motion::MotionInput, recording::Series};

    #[test]
    fn columns_of_rates_are_how_residuals_differ_where_rates_do() {
        let time: Vec<f64> = (0..150).map(|k| 0.01 * f64::from(k)).collect();
        let bias = Vector3::new(0.02, -0.01, 0.03);
        let rate = |t: &f64| Vector3::new((5.0 * t).sin(), 0.8 * (3.0 * t).cos(), 0.6 - t) + bias;
        let values: Vec<_> = time.iter().map(rate).collect();
        let attitudes: Vec<_> =
            time.iter().map(|t| Some(exp(&(Vector3::new(0.2, 0.5, -0.1) * *t)))).collect();
        let motion = |values: &[Vector3<f64>]| {
            let rates = Series { time: &time, values, usable: &[true; 150], interval: 0.01 };
            let none = Vector3::zeros();
            let input = MotionInput { rates, attitudes: &attitudes, earth_p: none, force_p: none };
            let ends = [attitudes[0].as_ref().unwrap(), attitudes[149].as_ref().unwrap()];
            input.compress(0..150, ends, &|_| none).unwrap()
        };
        let theta = All::from_fn(|k, _| match k {
            0 | 4 | 8 => 1.01,
            9..12 => bias[k - 9],
            _ => 0.0,
        });
        let columns = altered(&[motion(&values)], &[2.0], (&theta, &bias));
        assert_eq!(columns.len(), ALTERATIONS.len() - 1);
        for (columns, (_, f)) in columns.iter().zip(ALTERATIONS) {
            for axis in 0..3 {
                let residual = |size: f64| {
                    let off = |w: &Vector3<f64>| w + Vector3::ith(axis, size * f(w[axis] - bias[axis]));
                    let altered: Vec<_> = values.iter().map(off).collect();
                    let data = motion(&altered);
                    let motions = [data.motion()];
                    let model = Weighted { motions: &motions, weights: &[2.0], form: FULL_WITH_SENSITIVITY };
                    Residuals::of(&model, &theta)
                };
                for (row, (above, below)) in residual(1e-3).iter().zip(residual(-1e-3)).enumerate() {
                    let error = (above - below) / 2e-3 - columns.values[(row, axis)];
                    assert!(error.abs() < 1e-5, "{} {axis}: {error}", columns.name);
                }
            }
        }
    }
}
