use super::*;
use crate::{
    fit::Units,
    record::{RawUnit, TriadRecord},
    session::{
        alignment::NotAligned,
        axes::Axes,
        store::{NotStored, stated_error},
    },
};

/// A session that ends, of a unit whose magnetometer lies like `phi` on its board.
fn session(seed: u64, phi: &Vector3<f64>) -> (Held, Triad<f64>) {
    let (mut session, mut hand) = (Held::new(SessionSettings::default()), Hand::new(seed));
    let lies = Rotation3::new(*phi);
    hand.truth[2].gain = lies.into_inner() * hand.truth[2].gain;
    let truth = hand.truth[2];
    hand.follow(&mut session, 60);
    session.finish();
    while session.work() {}
    // The gauge of a field of unknown length.
    let gain = truth.gain / truth.gain.determinant().cbrt();
    (session, Triad { gain, ..truth })
}

#[test]
fn a_magnetometer_is_turned_into_the_accelerometer_s_axes_whatever_way_it_lies() {
    let mut all = std::vec::Vec::new();
    for seed in 0..100u32 {
        let k = f64::from(seed);
        let axis = Vector3::new((1.7 * k).sin(), (2.3 * k + 1.0).sin(), (3.1 * k + 2.0).sin()).normalize();
        let (mut session, truth) = session(seed.into(), &(axis * (0.031 * k)));
        assert_eq!(session.align_axes(), Ok(()), "seed {seed}");
        let estimate = session.estimate(Sensor::Magnetometer).expect("an estimate");
        let errors = standardised(estimate, &truth);
        all.extend(errors.iter().take(9).copied());
        let moved = estimate.triad.gain.cast::<f64>() * truth.gain.try_inverse().expect("regular");
        let turn = (moved - moved.transpose()) * 0.5;
        let turn = Vector3::new(turn.m32, turn.m13, turn.m21).norm();
        let stated = f64::from(estimate.alignment_error.expect("aligned"));
        assert!(turn < 0.02 && stated < 0.01, "seed {seed}: turned {turn} rad, stated {stated}");
    }
    let within = all.iter().filter(|error| error.abs() < 1.96).count() as f64 / all.len() as f64;
    let rms = (all.iter().map(|error| error * error).sum::<f64>() / all.len() as f64).sqrt();
    std::println!(
        "off by {rms:.3} standard errors rms, {:.1} % of {} entries within",
        100.0 * within,
        all.len()
    );
    // Stated about a fifth too large.
    assert!((0.75..1.05).contains(&rms) && (0.93..0.99).contains(&within), "{rms} {within}");
}

#[test]
fn a_magnetometer_without_rests_to_compare_it_at_stays_in_its_own_axes_and_says_why() {
    let none = Held::new(SessionSettings::default());
    assert_eq!(none.alignment().err(), Some(NotAligned::NotAccepted(Sensor::Accelerometer)));
    let (mut once, _) = session(3, &Vector3::zeros());
    assert_eq!(once.align_axes(), Ok(()));
    let before = *once.estimate(Sensor::Magnetometer).expect("an estimate");
    assert_eq!(once.align_axes(), Err(NotAligned::Already));
    assert_eq!(once.estimate(Sensor::Magnetometer), Some(&before));
    let (mut blind, mut hand) = (Held::new(SessionSettings::default()), Hand::new(4));
    hand.follow(&mut blind, 60);
    for pose in 0..blind.poses.list().len() {
        blind.poses.forget_field(pose);
    }
    assert_eq!(blind.align_axes(), Err(NotAligned::TooFewRests { have: 0, need: 8 }));
}

#[test]
fn a_magnetometer_in_the_accelerometer_s_axes_takes_the_place_of_one_in_its_own_and_not_the_other_way_round()
{
    let units = Units { raw: RawUnit::Counts, calibrated: RawUnit::Arbitrary, offset: 0.0, per_unit: 100.0 };
    let (mut again, _) = session(3, &Vector3::new(0.3, 0.0, 0.0));
    let better = |session: &Held, stored: Option<&TriadRecord>| {
        session.better(Sensor::Magnetometer, &units, stored, &Axes::Own)
    };
    let own = better(&again, None).expect("accepted");
    assert_eq!(again.align_axes(), Ok(()));
    let turned = better(&again, None).expect("accepted");
    // Its errors are larger, since they say how it lies.
    assert!(stated_error(&turned, 48.0) > stated_error(&own, 48.0));
    assert_eq!(better(&again, Some(&own)), Ok(turned.clone()));
    let (plain, _) = session(3, &Vector3::new(0.3, 0.0, 0.0));
    assert_eq!(better(&plain, Some(&turned)), Err(NotStored::OwnAxes));
}
