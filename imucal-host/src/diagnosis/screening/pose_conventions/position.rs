//! Positions that jump, come in steps, or are in another unit than metres.
//!
//! The unit shows in what the accelerometer senses other than gravity, turned into the frame: it is the positions' second
//! derivative times the unit.

use nalgebra::{Matrix3, Vector3};

use super::attitude::{mount, rates};
use crate::{
    diagnosis::{reference::pose::Pose, screening::bandwidth},
    observe::quantum::quantum,
    recording::{Recording, SensorKind, check::integrity::Integrity, median},
    simulator::position_smoother::Readings,
};

/// Nothing that is tracked is faster than this, m/s, nor so many times faster than it is in all but a thousandth of rows.
const FASTEST: f64 = 10.0;
const TIMES: f64 = 5.0;
/// Steps from this on are reported, m.
const COARSE: f64 = 5e-4;
/// Accelerations that belong together correlate by this at least.
const FOLLOWS: f64 = 0.6;
/// A unit explains a factor within this ratio.
const ALIKE: f64 = 1.5;
/// Positions so close to a missing one are not compared, s.
const APART: f64 = 0.3;
/// Units that positions come in, in metres.
const UNITS: [(f64, &str); 4] =
    [(1e-3, "millimetres"), (1e-2, "centimetres"), (0.3048, "feet"), (0.0254, "inches")];

/// Moves positions after a jump back by it; what a reader ought to know.
pub fn mend_jumps(time: &[f64], pose: &mut Pose) -> Option<String> {
    let positions = pose.positions.as_mut()?;
    let given: Vec<usize> =
        (0..time.len()).filter(|row| positions[*row].iter().all(|value| value.is_finite())).collect();
    let way = |pair: &[usize]| Vector3::from(positions[pair[1]]) - Vector3::from(positions[pair[0]]);
    let ways: Vec<(f64, Vector3<f64>)> =
        given.windows(2).map(|pair| (time[pair[1]] - time[pair[0]], way(pair))).collect();
    let mut speeds: Vec<f64> = ways.iter().map(|(span, way)| way.norm() / span).collect();
    speeds.sort_by(f64::total_cmp);
    let usual = *speeds.get(speeds.len() * 995 / 1000)?;
    let most = FASTEST.max(TIMES * usual);
    let (mut shift, mut before, mut jumps) = (Vector3::zeros(), Vector3::zeros(), Vec::new());
    for (row, (span, way)) in given.iter().skip(1).zip(&ways) {
        if way.norm() > most * span {
            jumps.push(time[*row]);
            shift += way - before * *span;
        } else {
            before = way / *span;
        }
        positions[*row] = (Vector3::from(positions[*row]) - shift).into();
    }
    let first = jumps.first()?;
    Some(format!(
        "the reference's position jumps {} times, first at {first:.2} s, where it would move faster than {most:.0} m/s; what \
         comes after each jump is moved back by it; check the tracker's view of its markers",
        jumps.len()
    ))
}

/// The positions come in steps.
pub fn steps(pose: &Pose) -> Option<String> {
    let positions: Vec<Vector3<f64>> = pose.positions.as_ref()?.iter().map(|p| Vector3::from(*p)).collect();
    let step = quantum(&positions, &vec![true; positions.len()]).max();
    (step > COARSE).then(|| {
        format!(
            "the reference's position comes in steps of {:.1} mm: the linear acceleration is known so much the less; write \
             ref_p* with more digits",
            1e3 * step
        )
    })
}

/// The positions are in another unit, for a reader.
pub fn other_unit(recording: &Recording, integrity: &Integrity, pose: &Pose) -> Option<String> {
    let moved = accelerations(&recording.time, pose.positions.as_ref()?)?;
    let (samples, sensor) = (&recording.acc.as_ref()?.values, integrity.sensor(SensorKind::Acc)?);
    let mount = mount(&rates(recording, integrity, &recording.time, &pose.attitudes))
        .unwrap_or_else(Matrix3::identity);
    let rows = (0..recording.rows()).filter(|row| sensor.usable[*row]);
    let pairs: Vec<(Vector3<f64>, Vector3<f64>)> = rows
        .filter_map(|row| Some((pose.attitudes[row]? * mount.tr_mul(&samples[row]), moved[row]?)))
        .collect();
    let mean = pairs.iter().map(|(felt, _)| felt).sum::<Vector3<f64>>() / pairs.len().max(1) as f64;
    let (mut along, mut felt, mut given) = (0.0, 0.0, 0.0);
    for (own, moved) in &pairs {
        let own = own - mean;
        along += own.dot(moved);
        felt += own.norm_squared();
        given += moved.norm_squared();
    }
    let follows = along / (felt * given).sqrt();
    if follows < -FOLLOWS {
        return Some(format!(
            "the reference's position moves against what the accelerometer senses (correlation {follows:.2}), expected along \
             with it: position and attitude are of left-handed axes, or of different frames; write both in one right-handed \
             frame"
        ));
    }
    if follows.is_nan() || follows < FOLLOWS {
        return None;
    }
    let scale = along / given;
    let apart = |unit: f64| (scale / unit).ln().abs();
    let (unit, name) = UNITS.into_iter().min_by(|a, b| apart(a.0).total_cmp(&apart(b.0)))?;
    (apart(unit) < ALIKE.ln()).then(|| {
        format!(
            "the reference's position looks like {name}: the accelerometer senses {scale:.2e} times what its second derivative \
             says, expected about 1; write ref_p* in metres, times {unit}"
        )
    })
}

/// Second derivatives of positions, row by row; `None` where there is no position.
fn accelerations(time: &[f64], positions: &[[f64; 3]]) -> Option<Vec<Option<Vector3<f64>>>> {
    let is_given = |row: usize| positions[row].iter().all(|value| value.is_finite());
    let given: Vec<f64> = (0..time.len()).filter(|row| is_given(*row)).map(|row| time[row]).collect();
    let interval = median(given.windows(2).map(|pair| pair[1] - pair[0]).collect())?;
    let axes = [0, 1, 2].map(|axis| {
        let position: Vec<f64> = positions.iter().map(|row| row[axis]).collect();
        Readings { time, position: &position, interval, bandwidth: bandwidth::USUAL }.smoothed()
    });
    let missing: Vec<f64> = (0..time.len()).filter(|row| !is_given(*row)).map(|row| time[row]).collect();
    let sparse = missing.len() > given.len() / 4;
    let is_apart = |row: usize| {
        let next = missing.partition_point(|gap| *gap < time[row] - APART);
        sparse || missing.get(next).is_none_or(|gap| *gap > time[row] + APART)
    };
    let of = |row: usize| {
        (is_given(row) && is_apart(row)).then(|| Vector3::from_fn(|axis, _| axes[axis][row].state.z))
    };
    Some((0..time.len()).map(of).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jumps_are_mended_and_steps_reported() {
        let time: Vec<f64> = (0..4000).map(|k| 0.01 * f64::from(k)).collect();
        let way = |t: f64| if t < 20.0 { t.sin() } else { t.sin() + 0.4 };
        let positions = |step: f64| {
            let round = |p: f64| if step > 0.0 { (p / step).round() * step } else { p };
            Some(time.iter().map(|t| [round(way(*t)), round(0.1 * (0.7 * t).cos()), 0.0]).collect::<Vec<_>>())
        };
        let mut pose = Pose { attitudes: vec![None; 4000], positions: positions(0.0) };
        let said = mend_jumps(&time, &mut pose).unwrap();
        assert!(said.contains("jumps 1 times, first at 20.00 s"), "{said}");
        let mended = pose.positions.as_ref().unwrap();
        let off = |row: usize| (mended[row][0] - time[row].sin()).abs();
        assert!(off(1999) < 1e-9 && off(2000) < 1e-3 && off(3999) < 1e-3);
        assert_eq!((mend_jumps(&time, &mut pose), steps(&pose)), (None, None));
        let coarse = steps(&Pose { attitudes: Vec::new(), positions: positions(0.01) }).unwrap();
        assert!(coarse.contains("steps of 10.0 mm"), "{coarse}");
    }
}
