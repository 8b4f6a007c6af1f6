//! Simulated recordings of the rig, calibrated, packed into the device's record and corrected by it in `f32`: every
//! sample of every sensor against the reference in `f64`.

use std::path::Path;

use imucal_core::record::Date;
use imucal_host::{
    calibrate::{Options, calibrate},
    equivalence::samples::{self, Samples},
    recording::SensorKind,
    simulator::{Programme, Simulation, UnitKind},
    store::StoredCalibration,
};
use rayon::prelude::*;

/// Programmes with rests enough for all three sensors.
const PROGRAMMES: [Programme; 3] = [Programme::MultiPosition, Programme::Thermal, Programme::Full];
/// Largest difference of each sensor of a recording, in bounds of its roundings.
fn differences(seed: u64) -> Vec<(SensorKind, f64)> {
    let unit = UnitKind::ALL[(seed % 2) as usize];
    let programme = PROGRAMMES[(seed % 3) as usize];
    // Both raw counts and SI: the record is in the recording's own unit.
    let counts = seed % 4 < 2;
    let simulation = Simulation { unit, programme, rate: 50.0, seed, counts, ..Simulation::default() };
    let recording = simulation.record("simulated.csv").expect("a possible recording");
    let options = Options { multipliers: vec![4.0], ..Options::default() };
    let calibration = calibrate(&recording, &options, &|_| {});
    let stored = StoredCalibration::of(&calibration, Date::from_days(20_000));
    let record = stored.to_record(Path::new("record")).expect("it fits the record");
    let compare = |kind: SensorKind| {
        let of = format!("seed {seed}, {} in {}, {kind}", unit.name(), programme.name());
        let Some(triad) = stored.triad(kind) else {
            panic!("{of}: {:?}", calibration.sensor(kind).map(|outcome| &outcome.verdict))
        };
        let replayed = Samples::of(&recording, kind).expect("recorded");
        let found = samples::compare(replayed, triad, record.triad(kind.into()).expect("stored"));
        assert_eq!(found.samples, recording.rows(), "{of}");
        assert!(found.passes() && found.max > 0.0, "{of}: {found:?}");
        (kind, found.of_bound)
    };
    SensorKind::ALL.map(compare).to_vec()
}

#[test]
fn the_device_corrects_twenty_simulated_recordings_as_the_reference_does() {
    let all: Vec<(SensorKind, f64)> = (0..20).into_par_iter().flat_map(differences).collect();
    assert_eq!(all.len(), 60);
    for kind in SensorKind::ALL {
        let worst = all.iter().filter(|(of, _)| *of == kind).map(|(_, share)| *share).fold(0.0, f64::max);
        println!("{kind}: {worst:.2} of the bound");
        // A bound that nothing comes near would say nothing.
        assert!((0.25..=1.0).contains(&worst), "{kind}: {worst:.2} of the bound");
    }
}
