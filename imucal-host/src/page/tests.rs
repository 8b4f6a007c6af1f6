use super::*;
use crate::{
    calibrate::{self, calibrate},
    diagnosis::{self as diagnosing, diagnose},
    effect,
    recording::Recording,
    simulator::{Programme, Simulation},
};
use imucal_core::record::Date;

fn recorded() -> Recording {
    let mut simulation =
        Simulation { programme: Programme::MultiPosition, rate: 50.0, ..Simulation::default() };
    simulation.add(effect::find("acc.scale_cubic").unwrap(), 3.0).unwrap();
    simulation.record("rig.csv").unwrap()
}

/// Of a recording on the rig, its calibration and its diagnosis on one page.
fn whole() -> String {
    let recording = recorded();
    let calibrated = calibrate(&recording, &calibrate::Options::default(), &|_| {});
    let found = diagnose(&recording, &diagnosing::Options::default(), &|_| {});
    let provenance = Provenance::new(Date::from_unix(0)).with_recording(&recording);
    page(
        "rig.csv",
        &provenance,
        &[calibration::calibration(&calibrated, &recording), diagnosis::diagnosis(&found)],
    )
}

#[test]
fn a_page_is_self_contained_and_short() {
    let page = whole();
    assert!(page.len() <= 300_000, "{} bytes", page.len());
    for foreign in ["http:", "https:", "<script", "url(", "@import", "<link", "src="] {
        assert!(!page.contains(foreign), "{foreign}");
    }
    assert!(!page.contains("NaN") && !page.contains("inf"), "a figure that is no number");
}

#[test]
fn a_page_says_what_was_measured_and_what_was_found() {
    let page = whole();
    for part in [
        "acc.scale_cubic",
        "k = 2",
        "gain_xy",
        "bias_z",
        "From the gap to the noise",
        "Rests and motions",
        "imucal 0.",
    ] {
        assert!(page.contains(part), "{part}");
    }
}

#[test]
fn what_a_file_says_is_never_markup() {
    let provenance = Provenance::default().with("unit", "<b>&\"x\"");
    let page = page("<script>alert(1)</script>", &provenance, &[]);
    assert!(!page.contains("<script") && !page.contains("<b>&"), "{page}");
}
