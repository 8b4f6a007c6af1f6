//! A reference with fewer attitudes than the recording has rows: those between are missing, or the last one is repeated.
//!
//! Repeated ones are left out. Between two attitudes that are not far apart the turn is the cubic through four of them,
//!
//! ```text
//! Log(C_kᵀ C(τ)) = Σ L_j(τ) Log(C_kᵀ C_j)      j = k − 1 … k + 2, L_j of Lagrange
//! ```
//!
//! Not known afterwards: what turns faster than half of the reference's rate.

use imucal_core::rotation::{exp, log};
use nalgebra::{Matrix3, Vector3};

use crate::{
    diagnosis::{reference::pose::Pose, screening::held_values::held},
    observe::motion::Attitudes,
    recording::median,
};

/// Attitudes further apart than so many of their usual intervals have a gap between them, and those further apart than
/// this, s, say nothing of what lies between.
const GAP: f64 = 2.5;
const LONGEST: f64 = 0.12;

/// Leaves out what is repeated and fills in what lies between; what a reader ought to know.
///
/// Positions are `fresh` where the same one in several rows is a repeated one.
pub fn fill(time: &[f64], pose: &mut Pose, fresh: bool) -> Vec<String> {
    let mut remarks = Vec::new();
    let same_attitude = |row: usize, pose: &Pose| pose.attitudes[row] == pose.attitudes[row - 1];
    if let Some(found) = held(time.len(), &|row| same_attitude(row, pose)) {
        found.repeated.iter().for_each(|row| pose.attitudes[*row] = None);
        remarks.push(held_words("attitude", "ref_q", found.rows));
    }
    if let Some(positions) = pose.positions.as_mut().filter(|_| fresh)
        && let Some(found) = held(positions.len(), &|row| positions[row] == positions[row - 1])
    {
        found.repeated.iter().for_each(|row| positions[*row] = [f64::NAN; 3]);
        remarks.push(held_words("position", "ref_p", found.rows));
    }
    remarks.extend(filled(time, &mut pose.attitudes));
    remarks
}

fn held_words(what: &str, column: &str, held: f64) -> String {
    format!(
        "each {what} of the reference ({column}*) stands in {held:.0} rows, expected a new one in each or empty fields; the \
         first row of each is used"
    )
}

/// Fills in the rows between two attitudes.
fn filled(time: &[f64], attitudes: &mut Attitudes) -> Option<String> {
    let given: Vec<(f64, Matrix3<f64>)> =
        time.iter().zip(&*attitudes).filter_map(|(time, c)| Some((*time, (*c)?))).collect();
    let usual = median(given.windows(2).map(|pair| pair[1].0 - pair[0].0).collect())?;
    let interval = median(time.windows(2).map(|pair| pair[1] - pair[0]).collect())?;
    if usual < 1.5 * interval {
        return None;
    }
    let longest = (GAP * usual).min(LONGEST);
    for (row, attitude) in attitudes.iter_mut().enumerate().filter(|(_, attitude)| attitude.is_none()) {
        let after = given.partition_point(|(t, _)| *t < time[row]);
        let about = after.checked_sub(2).and_then(|from| given.get(from..after + 2));
        let Some([a, b, c, d]) = about else { continue };
        if [(a, b), (b, c), (c, d)].iter().all(|(from, to)| to.0 - from.0 <= longest) {
            *attitude = Some(between([a, b, c, d], time[row]));
        }
    }
    let error = error(&given, longest);
    Some(format!(
        "the reference has {:.0} attitudes a second and the recording {:.0} rows: those between are interpolated, with an \
         error of about {error:.1e} rad; record the reference faster, or believe nothing that is faster than {:.0} Hz",
        usual.recip(),
        interval.recip(),
        0.5 / usual
    ))
}

/// The attitude at a time between the second and the third of four.
fn between(about: [&(f64, Matrix3<f64>); 4], time: f64) -> Matrix3<f64> {
    let [_, (_, from), ..] = about;
    let weight = |k: usize| {
        let others = about.iter().enumerate().filter(|(j, _)| *j != k);
        others.map(|(_, (t, _))| (time - t) / (about[k].0 - t)).product::<f64>()
    };
    let turn: Vector3<f64> =
        about.iter().enumerate().map(|(k, (_, c))| log(&from.tr_mul(c)) * weight(k)).sum();
    from * exp(&turn)
}

/// Median error of attitudes that were given, were they interpolated from their neighbours, less what the interval between
/// those, twice as long, adds: a quarter.
fn error(given: &[(f64, Matrix3<f64>)], longest: f64) -> f64 {
    let of = |w: &[(f64, Matrix3<f64>)]| {
        let near = w[6].0 - w[0].0 <= 6.0 * longest;
        near.then(|| log(&w[3].1.tr_mul(&between([&w[0], &w[2], &w[4], &w[6]], w[3].0))).norm())
    };
    0.25 * median(given.windows(7).filter_map(of).collect()).unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn attitude(time: f64) -> Matrix3<f64> {
        exp(&(Vector3::new(0.3, -0.5, 0.8) * (3.0 * time).sin())) * exp(&Vector3::new(0.0, 0.4 * time, 0.0))
    }

    fn pose(rows: usize) -> (Vec<f64>, Pose) {
        let time: Vec<f64> = (0..rows).map(|k| 0.001 * k as f64).collect();
        let attitudes = time.iter().map(|t| Some(attitude(*t))).collect();
        (time, Pose { attitudes, positions: None })
    }

    #[test]
    fn attitudes_at_thirty_hertz_are_filled_in_for_a_kilohertz() {
        let (time, whole) = pose(6000);
        let thinned = |repeats: bool| {
            let kept = |row: usize| whole.attitudes[if repeats { row / 33 * 33 } else { row }];
            let attitudes = (0..6000).map(|row| kept(row).filter(|_| repeats || row % 33 == 0)).collect();
            Pose { attitudes, positions: None }
        };
        for (repeats, remarks) in [(false, 1), (true, 2)] {
            let mut pose = thinned(repeats);
            let said = fill(&time, &mut pose, true);
            assert!(said.len() == remarks && said[remarks - 1].contains("30 attitudes a second"), "{said:?}");
            for (time, found) in time.iter().zip(&pose.attitudes).take(5800).skip(200) {
                let found = found.expect("filled in");
                assert!(log(&found.tr_mul(&attitude(*time))).norm() < 2e-4, "{time}");
            }
        }
    }

    #[test]
    fn a_reference_at_the_rate_of_the_rows_keeps_its_gaps() {
        let (time, mut whole) = pose(1000);
        whole.attitudes[500..510].fill(None);
        let before = whole.clone();
        assert!(fill(&time, &mut whole, true).is_empty());
        assert_eq!(whole, before);
    }
}
