//! The correction in integers.

use imucal_core::{
    integer::{self, IntegerCompensator},
    record::{self, Sensor},
    temperature::{self, TemperatureTerms},
};

use super::arithmetic::terms;
use crate::{RECORD, scene};

#[inline(never)]
pub(super) fn reach_all() {
    let (triad, terms) = (scene::gyroscope().truth.in_unit(0.0, 940.0), terms());
    let warm: TemperatureTerms<f32> = reach!(temperature::TemperatureTerms::in_unit(&terms, 940.0));
    let finest = reach!(integer::finest(&triad, Some(&warm))).unwrap_or_default();
    if let Ok(corrector) = reach!(integer::IntegerCorrector::new(&triad, finest)) {
        let corrected = reach!(integer::IntegerCorrector::apply(&corrector, [1, -2, 3]));
        reach!(integer::IntegerCorrector::value(&corrector, corrected));
        reach!(integer::IntegerCorrector::fraction(&corrector));
        reach!(integer::IntegerCorrector::bound(&corrector));
    }
    if let Ok(mut compensator) = reach!(integer::IntegerCompensator::new(&triad, Some(&warm), finest)) {
        follow(&mut compensator);
    }
    if let Ok(record) = record::decode(RECORD)
        && let Some(triad) = record.triad(Sensor::Accelerometer)
    {
        let _refused = reach!(integer::IntegerCorrector::from_record(triad, 22));
        let _refused = reach!(integer::IntegerCompensator::from_record(triad, 22));
    }
}

#[inline(never)]
fn follow(compensator: &mut IntegerCompensator) {
    reach!(integer::IntegerCompensator::set_temperature(compensator, 31.0));
    reach!(integer::IntegerCompensator::apply(compensator, [1, -2, 3]));
    reach!(integer::IntegerCompensator::corrector(compensator));
}
