//! The drift watch and its summary.

use core::fmt::Display;

use imucal_core::{
    record::{self, CalibrationRecord, Date, Sensor, SensorIdentity},
    watch::{
        self, CalibratedSample, LookObserver, MAX_LEN, Mean, Statistic, SummaryError, Watch, WatchSettings,
        WatchSummary,
    },
};
use nalgebra::Vector3;

use super::write;
use crate::RECORD;

#[inline(never)]
pub(super) fn reach_all() {
    let mut watch = begun();
    seconds(&mut watch);
    reach!(watch::Watch::restart(&mut watch));
    reach!(watch::Watch::summary(&watch), summary);
    reach!(watch::run_length::Thresholds::of(0.01));
    reach!(watch::run_length::siegmund(0.5, 10.0));
}

/// Out of line, as what follows: the record it is made from is gone before the watch goes on.
#[inline(never)]
fn begun() -> Watch {
    let sensor = SensorIdentity::default();
    let nothing = CalibrationRecord::empty(sensor, Date::from_days(20_000));
    let record = record::decode(RECORD).unwrap_or(nothing);
    reach!(watch::Watch::new(&record, WatchSettings::default()))
}

#[inline(never)]
fn seconds(watch: &mut Watch) {
    let mut observer = LookObserver::default();
    for row in 0..1_000u32 {
        let acc = Vector3::new(0.0, 0.1, 9.8) + Vector3::repeat((row % 7) as f32 * 1e-3);
        let (gyr, mag) = (Some(Vector3::repeat(1e-3)), Some(Vector3::new(20.0, 0.0, 44.0)));
        let sample = CalibratedSample { time: u64::from(row) * 20_000, acc, gyr, mag, temperature: 25.0 };
        if let Some(look) = reach!(watch::LookObserver::push(&mut observer, &sample, row % 300 > 10)) {
            let acc: &Mean = &look.acc;
            reach!(watch::Mean::is_finite(acc));
            reach!(watch::Watch::push(watch, &look));
        }
    }
}

#[inline(never)]
fn summary(summary: &WatchSummary) {
    for statistic in Statistic::ALL {
        reach!(watch::Statistic::sensor(statistic));
        reach!(watch::WatchSummary::statistic(summary, statistic));
    }
    for sensor in Sensor::ALL {
        reach!(watch::WatchSummary::state(summary, sensor));
        core::hint::black_box(reach!(watch::WatchSummary::shifts(summary, sensor)).count());
    }
    let mut page = [0xFF; MAX_LEN];
    // The result borrows the page: looked at here, it need not leave the call.
    let _bytes = reach!(watch::encode(summary, &mut page));
    reach!(watch::decode(&page), decoded);
}

#[inline(never)]
fn decoded(read: &Result<WatchSummary, SummaryError>) {
    if let Err(why) = read {
        write(|f| reach!(watch::SummaryError::fmt(why, f)));
    }
}
