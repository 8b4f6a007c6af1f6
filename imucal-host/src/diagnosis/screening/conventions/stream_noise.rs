//! A noisy stretch along a simulator's stream: `P.noise_burst` where the sensor makes it, a remark where the machine may.
//!
//! A machine vibrates, more at some times than at others, and no simulator's stream holds that. Two things show that it is not the machine:
//! the movement of the stream has no part in the fourth differences of the noisy stretch, and the accelerometer, which feels every
//! vibration of the body, has hardly more noise there than elsewhere. An accelerometer's own noise cannot be distinguished from vibration. Not
//! recognised: noise of a gyroscope while the body vibrates for another reason.

use nalgebra::Vector3;

use super::{
    Conventions,
    noise_burst::{Burst, fresh, inside_and_outside},
    pairs::given,
};
use crate::{
    recording::{
        Recording, SensorKind,
        check::integrity::{Integrity, SensorIntegrity},
    },
    simulator::{Motion, Recorded},
};

/// What has less than this share of what a stretch has more than the rest, as mean squares, has no part in it.
const NO_PART: f64 = 0.1;
/// A stretch is remarked in which the noise is so many times as large as elsewhere, for less than half of the time: a machine vibrates more
/// while it moves.
const REMARKED: f64 = 3.0;

/// Looks at one sensor, where the stream has a movement.
pub(crate) fn check(
    recording: &Recording,
    integrity: &Integrity,
    motion: &dyn Recorded,
    sensor: &SensorIntegrity,
    found: &mut Conventions,
) {
    let kind = sensor.sensor;
    let Some(triple) = recording.sensor(kind).filter(|_| motion.gives(kind)) else { return };
    let mut within = sensor.clone();
    within.usable.iter_mut().zip(motion.known()).for_each(|(usable, known)| *usable &= *known);
    let moves = |row: usize| motion.truth(recording.time[row], &|_| ()).w_pt_t.norm();
    let Some(burst) = Burst::find(&recording.time, triple, &within, &moves) else { return };
    let rows = fresh(triple, &within);
    if has_part(recording, motion, &triple.values, &rows, kind, &burst) {
        return;
    }
    if kind != SensorKind::Acc && is_quiet(recording, integrity, &burst) {
        found.findings.extend(burst.finding(kind));
        return;
    }
    if burst.times() < REMARKED || 2 * burst.rows.len() > recording.rows() {
        return;
    }
    let time = |row: usize| recording.time.get(row).copied().unwrap_or(f64::NAN);
    found.remarks.push(format!(
        "the noise of the {kind} is {:.1} times as large from {:.1} to {:.1} s as elsewhere: the machine vibrates more there than in the \
         simulator, or the sensor is disturbed; leave that stretch out, or weigh it less",
        burst.times(),
        time(burst.rows.start),
        time(burst.rows.end - 1),
    ));
}

/// Whether the stream's movement has a part in what a stretch has more than the rest.
fn has_part(
    recording: &Recording,
    motion: &dyn Motion,
    values: &[Vector3<f64>],
    rows: &[usize],
    kind: SensorKind,
    burst: &Burst,
) -> bool {
    let truth = |time: &f64| given(kind, &motion.truth(*time, &|_| ()));
    let stream: Vec<Vector3<f64>> = recording.time.iter().map(truth).collect();
    let of = |values: &[Vector3<f64>]| inside_and_outside(&recording.time, values, rows, &burst.rows);
    let (Some([inside, outside]), Some([moved, _])) = (of(values), of(&stream)) else { return true };
    let has_none = moved.sum() <= NO_PART * (inside - outside).sum();
    !has_none
}

/// Whether the accelerometer is there, and its noise hardly grows in a stretch by the side of the other sensor's.
fn is_quiet(recording: &Recording, integrity: &Integrity, burst: &Burst) -> bool {
    let (Some(acc), Some(sensor)) = (&recording.acc, integrity.sensor(SensorKind::Acc)) else { return false };
    let noise = inside_and_outside(&recording.time, &acc.values, &fresh(acc, sensor), &burst.rows);
    let grows = |[inside, outside]: [Vector3<f64>; 2]| inside.sum() / outside.sum() - 1.0;
    noise.is_some_and(|noise| grows(noise) < NO_PART * (burst.times().powi(2) - 1.0))
}

#[cfg(test)]
mod tests {
    use crate::{
        diagnosis::{Source, screening::preparation::Preparation, settings::Settings},
        effect,
        recording::{SensorKind, Stream},
        simulator::{
            Dose,
            robot::{RobotKind, RobotScene},
        },
    };

    /// Findings' names and remarks of a robot with these effects.
    fn found(kind: RobotKind, doses: Vec<Dose>, vibration: f64, seed: u64) -> (Vec<String>, Vec<String>) {
        let scene = RobotScene { kind, doses, seed, vibration, duration: 100.0, ..RobotScene::default() };
        let pair = scene.record("pair").unwrap();
        let (stream, settings) = (Stream::of(&pair.simulated), Settings::preset(Source::Simulator));
        let preparation = Preparation::new(&pair.real, stream.as_ref(), None, &settings).unwrap();
        let named = preparation.findings.iter().map(|finding| finding.effect.id.clone());
        let noisy = preparation.remarks.into_iter().filter(|remark| remark.starts_with("the noise of the"));
        (named.filter(|id| id.ends_with("noise_burst")).collect(), noisy.collect())
    }

    fn burst(kind: SensorKind) -> Vec<Dose> {
        let effect = effect::find(&format!("{kind}.noise_burst")).unwrap();
        vec![Dose { effect, values: vec![4.0, 40.0, 60.0] }]
    }

    #[test]
    fn a_noisy_gyroscope_or_magnetometer_is_named_and_a_noisy_accelerometer_remarked() {
        for (seed, robot) in [RobotKind::Wheeled, RobotKind::Flying].into_iter().enumerate() {
            for kind in SensorKind::ALL {
                let (named, remarks) = found(robot, burst(kind), 1.0, 10 + seed as u64);
                if kind == SensorKind::Acc {
                    let says = |remark: &String| remark.contains("to 60.0 s");
                    assert!(named.is_empty() && remarks.iter().any(says), "{robot:?}: {named:?} {remarks:?}");
                } else {
                    assert_eq!(named, [format!("{kind}.noise_burst")], "{robot:?}: {remarks:?}");
                }
            }
        }
    }

    #[test]
    fn robots_that_vibrate_have_no_noisy_stretch() {
        for (seed, robot) in RobotKind::ALL.into_iter().enumerate() {
            for vibration in [1.0, 4.0] {
                let (named, remarks) = found(robot, Vec::new(), vibration, 20 + seed as u64);
                assert!(named.is_empty() && remarks.is_empty(), "{robot:?}: {named:?} {remarks:?}");
            }
        }
    }
}
