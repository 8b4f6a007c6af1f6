use super::*;
use crate::{
    accept::{Quantity, Refusal},
    fit::Units,
    record::{RawUnit, TriadRecord},
    rotation::axis_order::signed_permutation,
    session::{
        alignment::NotAligned,
        axes::Axes,
        store::{NotStored, stated_error},
    },
};

/// A session that ends, of a unit whose magnetometer lies like `phi` on its board, at a place where the field points down.
fn session(seed: u64, phi: &Vector3<f64>) -> (Held, Triad<f64>) {
    let lies = Rotation3::new(*phi).into_inner();
    session_of(seed, [Matrix3::identity(), lies], Some(true))
}

/// The same of one whose accelerometer and magnetometer have their axes by those matrices.
fn session_of(seed: u64, axes: [Matrix3<f64>; 2], field_down: Option<bool>) -> (Held, Triad<f64>) {
    let settings = SessionSettings { field_down, ..Default::default() };
    let (mut session, mut hand) = (Held::new(settings), Hand::new(seed));
    hand.truth[0].gain = axes[0] * hand.truth[0].gain;
    hand.truth[2].gain = axes[1] * hand.truth[2].gain;
    let truth = hand.truth[2];
    hand.follow(&mut session, 60);
    session.finish();
    while session.work() {}
    // The gauge of a field of unknown length.
    let gain = truth.gain / truth.gain.determinant().abs().cbrt();
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

#[test]
fn a_magnetometer_is_compared_with_one_in_another_unit_by_the_field_of_each() {
    let units = Units { raw: RawUnit::Counts, calibrated: RawUnit::MicroTesla, offset: 0.0, per_unit: 100.0 };
    let (session, _) = session(3, &Vector3::new(0.3, 0.0, 0.0));
    let better =
        |stored: Option<&TriadRecord>| session.better(Sensor::Magnetometer, &units, stored, &Axes::Own);
    let new = better(None).expect("accepted");
    // As a host keeps it in a field of unknown length: in raw units, a hundred a microtesla. Its errors are so many times ours.
    let in_counts = |times: f32| {
        let mut stored = new.clone();
        let field = new.quality.field_norm.expect("of the session");
        stored.unit_out = RawUnit::Counts;
        stored.gain = new.gain.map(|row| row.map(|entry| 100.0 * entry));
        stored.quality.field_norm = Some(100.0 * field);
        stored.quality.gain_std = new.quality.gain_std.map(|row| row.map(|std| 100.0 * times * std));
        stored.quality.bias_std = new.quality.bias_std.map(|std| times * std);
        stored
    };
    assert!(matches!(better(Some(&in_counts(0.5))), Err(NotStored::Surer { .. })));
    // What is stored instead gives its values in that unit too.
    let stored = better(Some(&in_counts(2.0))).expect("surer");
    let mut expected = in_counts(1.0);
    expected.quality.rms = 100.0 * new.quality.rms;
    assert_eq!(stored, expected);
    let arbitrary = TriadRecord { unit_out: RawUnit::Arbitrary, ..in_counts(2.0) };
    assert_eq!(better(Some(&arbitrary)), Ok(new.clone()));
    let units = Units { calibrated: RawUnit::Arbitrary, ..units };
    let stored = TriadRecord { unit_out: RawUnit::MicroTesla, ..in_counts(2.0) };
    let refused = session.better(Sensor::Magnetometer, &units, Some(&stored), &Axes::Own);
    assert_eq!(refused, Err(NotStored::OtherUnit));
}

/// What an alignment says, and the verdicts of accelerometer and magnetometer after it.
fn verdicts(
    axes: [Matrix3<f64>; 2],
    field_down: Option<bool>,
) -> (Result<(), NotAligned>, [Result<(), Refusal>; 2]) {
    let (mut session, _) = session_of(3, axes, field_down);
    let aligned = session.align_axes();
    let verdict = |sensor: Sensor| session.estimate(sensor).expect("an estimate").verdict;
    (aligned, [Sensor::Accelerometer, Sensor::Magnetometer].map(verdict))
}

fn axes_are(code: usize) -> Result<(), Refusal> {
    Err(Refusal::Implausible { what: Quantity::Axes, value: code as f64, limit: 0.0 })
}

#[test]
fn a_mirrored_magnetometer_is_refused_where_the_field_s_sense_is_known() {
    let straight = Matrix3::identity();
    // What it puts out: y negated.
    let mirrored = signed_permutation(0b010).expect("a code");
    for down in [true, false] {
        let (aligned, verdicts) = verdicts([straight, mirrored], Some(down));
        if down {
            assert_eq!((aligned, verdicts), (Err(NotAligned::Mirrored), [Ok(()), axes_are(0b010)]));
        } else {
            // As it is, it looks like one that is turned by half a turn about y.
            assert_eq!((aligned, verdicts), (Ok(()), [Ok(()); 2]));
        }
    }
    // All axes reversed, of one of the two: nothing says of which.
    for reversed in [[straight, -straight], [-straight, straight]] {
        let (aligned, verdicts) = verdicts(reversed, Some(true));
        assert_eq!((aligned, verdicts), (Err(NotAligned::Mirrored), [axes_are(7); 2]));
    }
}

#[test]
fn one_that_is_mounted_in_another_order_or_mirrored_is_refused_where_the_field_s_sense_is_not_known() {
    let straight = Matrix3::identity();
    let mirrored = signed_permutation(0b010).expect("a code");
    let (aligned, verdicts) = verdicts([straight, mirrored], None);
    assert_eq!((aligned, verdicts), (Err(NotAligned::MountOrMirror), [Ok(()), axes_are(0b010)]));
    let half_a_turn = signed_permutation(0b101).expect("a code");
    assert_eq!(self::verdicts([straight, half_a_turn], None).0, Err(NotAligned::MountOrMirror));
    assert_eq!(self::verdicts([straight, half_a_turn], Some(true)).0, Ok(()));
    assert_eq!(self::verdicts([straight, straight], None).0, Ok(()));
}

#[test]
fn a_field_that_hardly_dips_says_nothing_of_a_mirror() {
    let settings = SessionSettings { field_down: Some(true), ..Default::default() };
    let (mut session, mut hand) = (Held::new(settings), Hand::new(3));
    hand.field = Vector3::new(48.0, 2.0, -1.0);
    hand.follow(&mut session, 60);
    session.finish();
    while session.work() {}
    assert_eq!(session.align_axes(), Ok(()));
}
