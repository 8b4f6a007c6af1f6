use std::vec::Vec;

use super::*;
use crate::{
    fit::Units,
    record::{RawUnit, TriadRecord},
    session::{
        axes::{Axes, LARGEST_STRAIN},
        store::{NotStored, stated_error},
    },
};

const PER_UNIT: [f32; 3] = [1000.0, 2000.0, 100.0];

fn units(sensor: Sensor) -> Units {
    let calibrated = [RawUnit::MetrePerSecondSquared, RawUnit::RadianPerSecond, RawUnit::Arbitrary];
    let k = sensor as usize;
    Units { raw: RawUnit::Counts, calibrated: calibrated[k], offset: 0.0, per_unit: PER_UNIT[k] }
}

/// A session that ends, with its magnetometer in the accelerometer's axes.
fn session(seed: u64) -> (Held, Hand) {
    let (mut session, mut hand) = (Held::new(SessionSettings::default()), Hand::new(seed));
    hand.follow(&mut session, 60);
    session.finish();
    while session.work() {}
    assert_eq!(session.align_axes(), Ok(()), "seed {seed}");
    (session, hand)
}

/// What a rig has found of a hand's accelerometer, in axes of its table that lie like `phi`: each entry of the gain is off by `error`.
fn of_a_rig(hand: &mut Hand, session: &Held, phi: &Vector3<f64>, error: f64) -> TriadRecord {
    let mut record = better(session, Sensor::Accelerometer, None, &Axes::Own).expect("accepted");
    let mut off = || hand.normals(error);
    let relative = Matrix3::from_columns(&[off(), off(), off()]);
    let per_unit = f64::from(PER_UNIT[0]);
    let gain = (Matrix3::identity() + relative) * (Rotation3::new(*phi).into_inner() * hand.truth[0].gain);
    record.gain = (gain / per_unit).cast::<f32>().transpose().into();
    record.bias = (hand.truth[0].bias * per_unit).cast::<f32>().into();
    record.quality.gain_std = [[(error / per_unit) as f32; 3]; 3];
    record
}

fn better(
    session: &Held,
    sensor: Sensor,
    stored: Option<&TriadRecord>,
    axes: &Axes,
) -> Result<TriadRecord, NotStored> {
    session.better(sensor, &units(sensor), stored, axes)
}

fn axes(session: &Held, held: &TriadRecord) -> Axes {
    session.axes(&units(Sensor::Accelerometer), Some(held))
}

/// Differences of a gain from the truth, in standard errors.
fn scores(record: &TriadRecord, truth: &Matrix3<f64>, per_unit: f32) -> Vec<f64> {
    let (gain, std) = (record.gain.as_flattened(), record.quality.gain_std.as_flattened());
    let truth = truth.transpose() / f64::from(per_unit);
    let each = gain.iter().zip(std).zip(truth.iter());
    each.map(|((gain, std), truth)| (f64::from(*gain) - truth) / f64::from(*std)).collect()
}

#[test]
fn a_session_s_triads_are_in_the_axes_of_the_record_s_accelerometer_within_their_stated_errors() {
    let mut all: [Vec<f64>; 3] = Default::default();
    for seed in 0..100u32 {
        let (session, mut hand) = session(seed.into());
        let k = f64::from(seed);
        let axis = Vector3::new((1.7 * k).sin(), (2.3 * k + 1.0).sin(), (3.1 * k + 2.0).sin()).normalize();
        let phi = axis * (0.031 * (k + 1.0));
        let rig = of_a_rig(&mut hand, &session, &phi, 3e-4);
        let axes = axes(&session, &rig);
        let lies = Rotation3::new(phi).into_inner();
        for (k, sensor) in Sensor::ALL.into_iter().enumerate() {
            let turned = better(&session, sensor, None, &axes).expect("accepted");
            let gain = hand.truth[k].gain;
            // The gauge of a field of unknown length.
            let size = if sensor == Sensor::Magnetometer { gain.determinant().cbrt() } else { 1.0 };
            all[k].extend(scores(&turned, &(lies * gain / size), PER_UNIT[k]));
        }
    }
    for (sensor, scores) in Sensor::ALL.into_iter().zip(&all) {
        let within = scores.iter().filter(|score| score.abs() < 1.96).count() as f64 / scores.len() as f64;
        let rms = (scores.iter().map(|score| score * score).sum::<f64>() / scores.len() as f64).sqrt();
        std::println!(
            "{sensor:?}: off by {rms:.3} standard errors rms, {:.1} % of {} entries within",
            100.0 * within,
            scores.len()
        );
        assert!((0.7..1.1).contains(&rms) && within > 0.93, "{sensor:?}: {rms} {within}");
    }
}

#[test]
fn a_record_in_axes_of_the_sensor_s_own_changes_nothing() {
    let (session, _) = session(3);
    let own = better(&session, Sensor::Accelerometer, None, &Axes::Own).expect("accepted");
    assert_eq!(axes(&session, &own), Axes::Own);
    assert_eq!(session.axes(&units(Sensor::Accelerometer), None::<&TriadRecord>), Axes::Own);
}

#[test]
fn an_accelerometer_that_is_surer_than_a_rig_s_takes_its_place_in_the_table_s_axes() {
    let (session, mut hand) = session(5);
    let mut rig = of_a_rig(&mut hand, &session, &Vector3::new(0.4, -0.2, 1.1), 2e-5);
    let surer = better(&session, Sensor::Accelerometer, Some(&rig), &axes(&session, &rig));
    assert!(matches!(surer, Err(NotStored::Surer { .. })), "{surer:?}");
    // A rig that knows the directions, and neither the scales nor the bias.
    let scales = &mut rig.quality.gain_std;
    (scales[0][0], scales[1][1], scales[2][2]) = (1e-5, 1e-5, 1e-5);
    rig.quality.bias_std = [50.0; 3];
    let turned = better(&session, Sensor::Accelerometer, Some(&rig), &axes(&session, &rig)).expect("surer");
    assert!(stated_error(&turned, 9.8) < stated_error(&rig, 9.8));
    let off = (Matrix3::from(turned.gain) - Matrix3::from(rig.gain)) * PER_UNIT[0];
    assert!(off.amax() < 2e-3, "{off}");
}

#[test]
fn nothing_is_stored_where_the_axes_of_the_record_are_not_known() {
    let (session, mut hand) = session(7);
    let rig = of_a_rig(&mut hand, &session, &Vector3::new(0.0, 0.0, 0.5), 1e-4);
    let strained = TriadRecord { gain: rig.gain.map(|row| [row[0] * 1.02, row[1], row[2]]), ..rig.clone() };
    let mirrored =
        TriadRecord { gain: [rig.gain[0].map(|entry| -entry), rig.gain[1], rig.gain[2]], ..rig.clone() };
    let other = TriadRecord { unit_in: RawUnit::MetrePerSecondSquared, ..rig.clone() };
    for held in [strained, mirrored, other] {
        let axes = axes(&session, &held);
        for sensor in Sensor::ALL {
            let refused = better(&session, sensor, Some(&held), &axes);
            let unknown = |strain: f32, most: f32| strain > most && most == LARGEST_STRAIN;
            assert!(
                matches!(refused, Err(NotStored::OtherAxes { strain, most }) if unknown(strain, most)),
                "{refused:?}"
            );
        }
    }
    let (mut plain, mut hand) = (Held::new(SessionSettings::default()), Hand::new(7));
    hand.follow(&mut plain, 60);
    let unknown = Axes::Unknown { strain: f32::INFINITY };
    let own = better(&plain, Sensor::Magnetometer, None, &unknown);
    assert!(own.is_ok(), "a magnetometer in axes of its own is in nobody else's: {own:?}");
}
