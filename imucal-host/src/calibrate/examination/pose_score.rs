//! Score tests of fits to known attitudes: poses on a rig one by one, samples along a reference by blocks of neighbours.

use std::ops::Range;

use imucal_core::model::{
    rig::{GimbalPose, ReferencePose},
    unified::UNIFIED,
};
use nalgebra::{DVector, Vector3};
use rayon::prelude::*;

use super::{
    examine::{CHANCE, CHANCE_ALONG_REFERENCE},
    pose_residual::{PoseFit, Term, of_courses, of_direction},
    residual_driver::Course,
    tested::{Tested, judged_by, least_of_many},
};
use crate::{
    calibrate::{
        fit::{
            blocked_score::{BlockedScore, Rows},
            rig_fit::RigFit,
            rows as residual,
            score_test::ScoreTest,
        },
        known_attitudes::rig::unified_name,
        suspicion::{Follows, Suspicion},
    },
    observe::pose::Poses,
    recording::{GIMBALS, SensorKind},
};

/// What speaks against a fit to poses on a rig, which were reached from these sides. `warm` parameters of temperature were estimated with
/// it; `name` says which pose it is.
///
/// Terms that a higher rung of the accelerometer's ladder has are no suspicion: a warning names that rung
/// ([`rig::accelerometer`](crate::calibrate::known_attitudes::rig::accelerometer)). Where they explain most, all else is tested as if
/// they were estimated.
pub(super) fn of_rig(
    (kind, poses, fit): (SensorKind, &Poses, &RigFit),
    sides: &[Vector3<f64>],
    warm: usize,
    courses: &[Course],
    name: &dyn Fn(usize) -> String,
) -> Vec<Suspicion> {
    let of = PoseFit { poses: &poses.poses, axes: poses.axes, parameters: &fit.parameters, sides };
    let count = poses.poses.len();
    let (rows, free) = (of.rows(0..count), fit.free_entries());
    let (of_ladder, others): (Vec<_>, Vec<_>) =
        of_direction().partition(|term| kind == SensorKind::Acc && term.is_of_ladder());
    let others: Vec<_> = others.into_iter().chain(of_courses(kind, courses)).collect();
    let score = |test: &ScoreTest, term: &Term<'_>| {
        let columns = of.columns(term, 0..count, &rows);
        Some(Tested::new(term.follows, term.name.clone(), test.test(&columns, columns.ncols())?))
    };
    let tests_of = |free: &[u8]| {
        let jacobian = rows.derivatives(3 * count, &indices(free));
        let test = ScoreTest::new(&rows.residuals, jacobian, (3 * count).saturating_sub(warm))?;
        let mut tests: Vec<Tested> = others.par_iter().filter_map(|term| score(&test, term)).collect();
        tests.extend(of_machine((kind, &of), &test, &rows));
        tests.extend(Tested::alone(&test, 3, 3, 3 * count, name));
        Some((test, tests))
    };
    let Some((test, tests)) = tests_of(&free) else { return Vec::new() };
    let larger = of_ladder.iter().filter_map(|term| Some(score(&test, term)?.score.p)).fold(1.0, f64::min);
    let other = tests.iter().map(|tested| tested.score.p).fold(1.0, f64::min);
    if larger * (of_ladder.len() as f64) < CHANCE && larger <= other {
        let entries = (23..UNIFIED as u8).filter(|entry| !fit.entries.contains(entry));
        let free: Vec<u8> = free.iter().copied().chain(entries).collect();
        if let Some((_, tests)) = tests_of(&free) {
            return judged(CHANCE, tests, fit, &free);
        }
    }
    judged(CHANCE, tests, fit, &free)
}

/// Places of entries in the unified model.
fn indices(entries: &[u8]) -> Vec<usize> {
    entries.iter().map(|entry| usize::from(*entry)).collect()
}

/// Tests of what belongs to the rig, as far as the model has nothing like it.
fn of_machine(
    (kind, fit): (SensorKind, &PoseFit<'_, GimbalPose<f64>>),
    test: &ScoreTest,
    rows: &residual::Rows<UNIFIED>,
) -> Vec<Tested> {
    let encoder = |gimbal: usize| {
        let name = "encoder's angle, as an error of its zero or one of a period a turn makes it";
        (format!("the {} {name}", GIMBALS[gimbal]), fit.encoder(gimbal))
    };
    let joint = |gimbal: usize| {
        let (parent, own) = (GIMBALS[gimbal - 1], GIMBALS[gimbal]);
        let name = format!("attitude, as axes of the {parent} and the {own} gimbal make it that are oblique");
        Some((name, fit.oblique(gimbal)?))
    };
    let iron = |gimbal: usize| {
        let name = format!("attitude, as soft iron on the {} gimbal makes it", GIMBALS[gimbal]);
        (name, fit.soft_iron(gimbal, rows))
    };
    let iron = (0..2).filter(|_| kind == SensorKind::Mag).map(iron);
    let all = (0..3).map(encoder).chain((1..3).filter_map(joint)).chain(iron);
    all.filter_map(|(name, columns)| {
        let columns = test.distinct(&columns);
        let score = (columns.ncols() > 0).then(|| test.test(&columns, columns.ncols()))??;
        Some(Tested::new(Follows::Attitude, name, score))
    })
    .collect()
}

/// What speaks against a magnetometer's fit along a reference: what changes with time or temperature. Direction is not tested, since a
/// reference's own errors and the field of a room depend on attitude and place.
pub(super) fn along_reference(
    (kind, poses, fit): (SensorKind, &[ReferencePose<f64>], &RigFit),
    courses: &[Course],
) -> Vec<Suspicion> {
    let of_poses = PoseFit { poses, axes: (), parameters: &fit.parameters, sides: &[] };
    let free = fit.free_entries();
    let entries = indices(&free);
    let terms = of_courses(kind, courses);
    let made = |of: Range<usize>| {
        let rows = of_poses.rows(of.clone());
        let count = rows.residuals.len();
        Rows {
            columns: terms.iter().map(|term| of_poses.columns(term, of.clone(), &rows)).collect(),
            jacobian: rows.derivatives(count, &entries),
            residual: DVector::from_vec(rows.residuals),
        }
    };
    let Some(score) = BlockedScore::new(poses.len(), 3 * poses.len(), &made) else { return Vec::new() };
    let tests = terms.iter().enumerate().filter_map(|(index, term)| {
        let score = score.test(index, least_of_many(term.follows))?;
        let change = of_poses.change(term, score.coefficients.as_slice());
        let change = change.map(|all| DVector::from_iterator(free.len(), entries.iter().map(|k| all[*k])));
        Some(Tested { change, ..Tested::new(term.follows, term.name.clone(), score) })
    });
    judged(CHANCE_ALONG_REFERENCE, tests.collect(), fit, &free)
}

/// Those of the sensor's own entries: what belongs to the rig is not its calibration.
fn judged(chance: f64, tests: Vec<Tested>, fit: &RigFit, free: &[u8]) -> Vec<Suspicion> {
    let of_sensor = |entry: &u8| matches!(entry, 0..12 | 23..);
    let std = |entry: &u8| fit.std(*entry).filter(|_| of_sensor(entry)).unwrap_or(0.0);
    let std: Vec<f64> = free.iter().map(std).collect();
    judged_by(chance, tests, free, &std, unified_name)
}
