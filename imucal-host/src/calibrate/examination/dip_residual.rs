//! What the residual of a magnetometer's alignment could follow: the dip of the field at rest, which is constant.
//!
//! ```text
//! z = ∂r/∂φ ψ,   z = ψ
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | r, φ | residual and rotation vector of [`imucal_core::model::dip`] |
//! | ψ | a course over the rests: time, a step in time, temperature |
//!
//! The first is a magnetometer that turns against the accelerometer, which no length of a field shows, the second a field that
//! dips otherwise later. Source: ours. Not tested: direction, as the field of a room differs from place to place.

use imucal_core::{model::dip::DipModel, rotation::exp_with_jacobian};
use nalgebra::{DMatrix, DVector};

use super::{
    residual_driver::Course,
    tested::{Tested, judged},
};
use crate::calibrate::{
    fit::{
        alignment::Alignment,
        rows::Rows,
        score_test::{Score, ScoreTest},
    },
    suspicion::Suspicion,
};

/// What speaks against an alignment; `name` says which rest it is.
pub(super) fn examine(
    alignment: &Alignment,
    courses: &[Course],
    name: &dyn Fn(usize) -> String,
) -> Vec<Suspicion> {
    let rows = Rows::of(&DipModel { pairs: &alignment.pairs }, &alignment.theta());
    let count = rows.residuals.len();
    let Some(test) = ScoreTest::new(&rows.residuals, rows.derivatives(count, &[0, 1, 2, 3]), count) else {
        return Vec::new();
    };
    // The rotation's errors are in the axes it leads to.
    let (_, by_phi) = exp_with_jacobian(&alignment.phi);
    let turned = |tested: Tested, largest: Option<f64>| {
        let in_axes =
            |of: &DVector<f64>| DVector::from_column_slice((by_phi * of.fixed_rows::<3>(0)).as_slice());
        let change = largest.map(|largest| in_axes(&tested.score.coefficients) * largest);
        let shift = in_axes(&tested.score.shift);
        Tested { change, score: Score { shift, ..tested.score }, ..tested }
    };
    let of_course = |course: &Course| {
        let test = |kind: &str, parameters: &[usize]| {
            let columns = DMatrix::from_fn(count, parameters.len(), |rest, k| {
                rows.jacobian[rest][parameters[k]] * course.value(rest)
            });
            let score = test.test(&columns, parameters.len())?;
            let name = course.changing(kind);
            let turns = parameters.len() == 3;
            Some(turned(Tested::new(course.follows, name, score), turns.then(|| course.largest(count))))
        };
        [test("mounting", &[0, 1, 2]), test("field", &[3])]
    };
    let mut tests: Vec<Tested> = courses.iter().flat_map(of_course).flatten().collect();
    tests.extend(Tested::alone(&test, 1, 1, count, name).into_iter().map(|tested| turned(tested, None)));
    let std: Vec<f64> = alignment.axes.covariance.diagonal().iter().map(|variance| variance.sqrt()).collect();
    judged(tests, &[0, 1, 2], &std, |axis| {
        format!(
            "the rotation into the accelerometer's axes about {}, rad,",
            ["x", "y", "z"][usize::from(axis)]
        )
    })
}
