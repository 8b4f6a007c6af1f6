//! Observations while samples arrive.

use imucal_core::{
    coverage,
    observer::{
        self, Sample,
        cloud::CloudObserver,
        inertial::{InertialObserver, Seen},
        rest::{RestObserver, RestSettings, Stage},
        thermometer::ThermometerObserver,
        turn::TurnObserver,
    },
    triad::Triad,
};
use nalgebra::{Matrix3, Vector3};

use crate::scene;

#[inline(never)]
pub(super) fn reach_all() {
    let mut rests: RestObserver<f32> = reach!(observer::rest::RestObserver::new(RestSettings::default()));
    for row in 0..500u32 {
        let sample = Sample {
            time: u64::from(row) * 10_000,
            acc: Vector3::new(0.0f32, 0.0, -9.8),
            gyr: Some(Vector3::zeros()),
            temperature: Some(25.0),
        };
        reach!(observer::Sample::is_whole(&sample));
        reach!(observer::rest::RestObserver::push(&mut rests, &sample));
    }
    reach!(observer::rest::RestObserver::stage(&rests));
    reach!(observer::rest::RestObserver::quarters(&rests));
    reach!(observer::rest::RestObserver::rate(&rests));
    reach!(observer::rest::RestObserver::lasted(&rests));
    reach!(observer::rest::RestObserver::direction(&rests));
    reach!(observer::rest::RestObserver::threshold(&rests));
    reach!(observer::rest::RestObserver::finish(&mut rests));
    let mut points: CloudObserver<f32, 16> = reach!(observer::cloud::CloudObserver::new(1.0));
    for k in 0..40 {
        let point = scene::spiral(k, 40) * 50.0;
        reach!(observer::cloud::CloudObserver::push(&mut points, &point));
        reach!(observer::cloud::CloudObserver::judged(&points));
    }
    for slot in reach!(observer::cloud::CloudObserver::slots(&points)) {
        reach!(observer::cloud::Slot::on_shell(slot, 50.0));
    }
    reach!(observer::cloud::CloudObserver::apart(&points));
    let mut thermometer: ThermometerObserver<f32> = ThermometerObserver::default();
    for row in 0..40u32 {
        reach!(observer::thermometer::ThermometerObserver::push(
            &mut thermometer,
            u64::from(row) * 1_000_000,
            (row / 2) as f32
        ));
    }
    reach!(observer::thermometer::ThermometerObserver::fault(&thermometer));
    turns();
    inertial();
    reach!(coverage::missing((0..20).map(|k| scene::spiral(k, 20))));
}

#[inline(never)]
fn turns() {
    let mut turns: TurnObserver<f32, 5> = reach!(observer::turn::TurnObserver::new());
    for stage in [Stage::Resting, Stage::Resting, Stage::Moving, Stage::Moving, Stage::Still, Stage::Resting]
    {
        for _ in 0..25 {
            reach!(observer::turn::TurnObserver::push(&mut turns, &Vector3::new(0.1f32, 0.2, 0.3), 0.01));
        }
        if let Some(turn) =
            reach!(observer::turn::TurnObserver::quarter(&mut turns, stage, &Triad::identity()))
        {
            reach!(observer::turn::ObservedTurn::remainder(&turn));
            reach!(observer::turn::ObservedTurn::blocks(&turn)).for_each(|block| {
                core::hint::black_box(block);
            });
            reach!(observer::turn::ObservedTurn::between(&turn, Vector3::x(), Vector3::y()));
        }
    }
    reach!(observer::turn::TurnObserver::interrupt(&mut turns));
}

#[inline(never)]
fn inertial() {
    let mut all: InertialObserver<f32, 5> =
        reach!(observer::inertial::InertialObserver::new(RestSettings::default()));
    reach!(observer::inertial::InertialObserver::set_gain(&mut all, &Matrix3::identity()));
    for row in 0..300u32 {
        let sample = Sample {
            time: u64::from(row) * 10_000,
            acc: Vector3::new(0.0f32, 0.0, -9.8),
            gyr: Some(Vector3::zeros()),
            temperature: None,
        };
        if let Seen::Rest(rest) = reach!(observer::inertial::InertialObserver::push(&mut all, &sample)) {
            core::hint::black_box(&rest);
        }
    }
    reach!(observer::inertial::InertialObserver::interrupt(&mut all));
    reach!(observer::inertial::InertialObserver::rests(&all));
    reach!(observer::inertial::InertialObserver::broken(&all));
    reach!(observer::inertial::InertialObserver::finish(&mut all));
}
