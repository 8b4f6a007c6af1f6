//! A session without a host.

use imucal_core::{
    accept,
    fit::Units,
    observer::Sample,
    record::{RawUnit, Sensor, TriadRecord},
    session::{
        self, Session, SessionSettings,
        axes::Axes,
        bias::{MeanRate, RestBias},
    },
    temperature,
};
use nalgebra::Vector3;

use crate::scene;

#[inline(never)]
pub(super) fn reach_all() {
    let mut session: Session<8, 2, 16> = reach!(session::Session::new(SessionSettings::default()));
    for row in 0..2_000u32 {
        let pose = row / 200;
        let turning = row % 200 > 150;
        let rate = if turning { Vector3::repeat(0.5) } else { Vector3::zeros() };
        let acc = scene::spiral(pose as usize, 10) * 9.8 + rate * ((row % 7) as f32);
        let temperature = Some(scene::spiral(pose as usize, 10).x * 10.0);
        let sample = Sample { time: u64::from(row) * 10_000, acc, gyr: Some(rate), temperature };
        reach!(session::Session::push(&mut session, &sample));
        reach!(session::Session::push_field(&mut session, &(scene::spiral(row as usize, 2_000) * 50.0)));
        reach!(session::Session::work(&mut session));
    }
    reach!(session::Session::finish(&mut session));
    while reach!(session::Session::work(&mut session)) {}
    reach!(session::Session::guide(&session));
    reach!(session::Session::settings(&session));
    reach!(session::Session::cloud(&session));
    let poses = reach!(session::Session::poses(&session));
    reach!(session::poses::Poses::forgotten(poses));
    for pose in reach!(session::poses::Poses::list(poses)) {
        reach!(session::poses::Pose::has_turn(pose));
    }
    aligned(&mut session);
    kept(&session);
    warm(&session);
    rates();
    reach!(accept::outlier::gross(&[1.0f32, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0]));
}

#[inline(never)]
fn aligned(session: &mut Session<8, 2, 16>) {
    if let Ok(mut fit) = reach!(session::Session::alignment(session)) {
        while reach!(session::alignment::AlignmentFit::work(&mut fit, session)) {}
        let _own_axes = reach!(session::Session::align(session, &fit));
    }
    let _own_axes = reach!(session::Session::align_axes(session));
}

#[inline(never)]
fn kept(session: &Session<8, 2, 16>) {
    let units =
        Units { raw: RawUnit::Counts, calibrated: RawUnit::RadianPerSecond, offset: 0.0, per_unit: 100.0 };
    let record = reach!(session::Session::better(
        session,
        Sensor::Accelerometer,
        &units,
        None::<&TriadRecord>,
        &Axes::Own
    ));
    if let Some(estimate) = reach!(session::Session::estimate(session, Sensor::Accelerometer)) {
        let record = reach!(session::estimate::Estimate::record(estimate, "T9", &units));
        reach!(session::store::stated_error(&record, 9.8));
        let still = MeanRate { mean: Vector3::repeat(1e-3), variance: Vector3::repeat(1e-10), count: 1 };
        reach!(session::store::bias_of_the_day(&still, &record, 0.1));
        let axes = reach!(session::Session::axes(session, &units, Some(&record)));
        let again =
            reach!(session::Session::better(session, Sensor::Accelerometer, &units, Some(&record), &axes));
        core::hint::black_box(&again);
    }
    reach!(session::store::model_of(Sensor::Gyroscope));
    core::hint::black_box(&record);
}

#[inline(never)]
fn warm(session: &Session<8, 2, 16>) {
    let units =
        Units { raw: RawUnit::Counts, calibrated: RawUnit::RadianPerSecond, offset: 0.0, per_unit: 100.0 };
    if let Ok(mut fit) = reach!(session::Session::warmth(session, Sensor::Gyroscope)) {
        while reach!(session::temperature::WarmthFit::work(&mut fit)) {}
        reach!(session::temperature::WarmthFit::found(&fit));
        let record = reach!(session::Session::better_warm(
            session,
            Sensor::Gyroscope,
            &fit,
            &units,
            None::<&TriadRecord>,
            &Axes::Own
        ));
        core::hint::black_box(&record);
    }
    let record = reach!(session::Session::better_at_temperatures(
        session,
        Sensor::Accelerometer,
        &units,
        None::<&TriadRecord>,
        &Axes::Own
    ));
    core::hint::black_box(&record);
    let temperatures = [20.0f32, 35.0, 22.0];
    reach!(temperature::course::span(&temperatures));
    reach!(temperature::course::apart(&temperatures, &mut [(0.0, 0.0); 3]));
    reach!(accept::f_score::f_score(12.0, 3.0, 20.0));
}

#[inline(never)]
fn rates() {
    let rate =
        |k: u32| MeanRate { mean: Vector3::repeat(k as f32), variance: Vector3::repeat(1.0), count: 100 };
    if let Some(bias) = reach!(session::bias::RestBias::of((0..9).map(rate))) {
        let bias: RestBias<f32> = bias;
        reach!(session::bias::RestBias::wanders(&bias));
        reach!(session::bias::RestBias::std(&bias));
    }
}
