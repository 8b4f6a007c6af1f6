//! Observations while samples arrive.

use imucal_core::{
    coverage,
    observer::{
        self, Sample,
        cloud::CloudObserver,
        rest::{RestObserver, RestSettings},
    },
};
use nalgebra::Vector3;

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
    reach!(observer::rest::RestObserver::is_still(&rests));
    reach!(observer::rest::RestObserver::threshold(&rests));
    reach!(observer::rest::RestObserver::finish(&mut rests));
    let mut points: CloudObserver<f32, 16> = reach!(observer::cloud::CloudObserver::new(1.0));
    for k in 0..40 {
        let point = scene::spiral(k, 40) * 50.0;
        reach!(observer::cloud::CloudObserver::push(&mut points, &point));
    }
    reach!(observer::cloud::CloudObserver::points(&points));
    reach!(observer::cloud::CloudObserver::apart(&points));
    reach!(coverage::missing((0..20).map(|k| scene::spiral(k, 20))));
}
