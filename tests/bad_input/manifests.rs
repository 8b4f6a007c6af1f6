//! Manifests that are missing or misspelt.

use super::Bad;

#[test]
fn a_missing_manifest_is_named_with_an_example() {
    let bad = Bad::new();
    std::fs::remove_file(bad.path("small.toml")).expect("it is there");
    bad.calibrate_file("small.csv").with(2).telling(&[
        "small.toml: not found",
        "the manifest of the recording small",
        "format = \"imucal-recording/1\"",
    ]);
}

#[test]
fn another_format_is_refused() {
    for format in ["imucal-recording/2", "imucal-calibration/1", ""] {
        let mut bad = Bad::new();
        bad.manifest("imucal-recording/1", format);
        bad.calibrate().with(2).telling(&["small.toml, line 1", "format", "imucal-recording/1"]);
    }
    let mut bad = Bad::new();
    bad.manifest("format = \"imucal-recording/1\"\n", "");
    bad.calibrate().with(2).telling(&["small.toml", "imucal-recording/1"]);
}

#[test]
fn a_misspelt_key_is_reported_with_the_one_meant() {
    let mut bad = Bad::new();
    bad.manifest("gravity = ", "gravty = ");
    let ended = bad.calibrate();
    ended.telling(&["small.toml, line", "gravty", "gravity"]);
    let mut bad = Bad::new();
    bad.manifest("[units]", "[unit]");
    // Then the samples cannot be understood either, and both are reported.
    bad.calibrate().with(2).telling(&[
        "small.csv, from line 2 on, sensor acc",
        "small.toml, line",
        "`unit`",
        "`units`",
    ]);
}

#[test]
fn an_unknown_unit_is_refused_with_the_units_there_are() {
    let mut bad = Bad::new();
    bad.manifest("acc = \"counts\"", "acc = \"m/s2\"");
    bad.calibrate().with(2).telling(&["small.toml, line", "`m/s2`", "m/s^2, g, mg, counts"]);
    let mut bad = Bad::new();
    bad.manifest("acc = \"counts\"", "acc = \"deg/s\"");
    bad.calibrate().with(2).telling(&["small.toml, line", "deg/s", "m/s^2, g, mg, counts"]);
}

#[test]
fn a_manifest_that_is_no_toml_is_refused_with_its_line() {
    let mut bad = Bad::new();
    bad.manifest("[units]", "[units");
    bad.calibrate().with(2).telling(&["small.toml, line 3", "correct the line"]);
}

#[test]
fn numbers_that_nothing_can_have_are_refused() {
    for (from, to, part) in [
        ("per_unit = 415.0", "per_unit = 0.0", "per_unit"),
        ("per_unit = 415.0", "per_unit = nan", "per_unit"),
        ("per_unit = 415.0", "per_unit = inf", "per_unit"),
        ("offset = 32768.0", "offset = inf", "offset"),
        ("gravity = 9.7997", "gravity = -9.8", "gravity"),
        ("gravity = 9.7997", "gravity = nan", "gravity"),
        ("field_ned_ut = [25.3", "field_ned_ut = [inf", "field_ned_ut"),
        ("latitude_deg = 39.8", "latitude_deg = 139.8", "latitude_deg"),
    ] {
        let mut bad = Bad::new();
        bad.manifest(from, to);
        bad.calibrate().with(2).telling(&["small.toml, line", part, "expected", "correct it"]);
    }
}

#[test]
fn gravity_of_no_place_on_earth_is_warned_about() {
    let mut bad = Bad::new();
    bad.manifest("gravity = 9.7997", "gravity = 9.6");
    bad.calibrate().telling(&["warning", "small.toml, line", "gravity 9.6", "expected 9.76 to 9.84"]);
}

#[test]
fn a_reference_that_cannot_be_is_refused() {
    let with = |section: &str| {
        let mut bad = Bad::new();
        bad.toml += section;
        bad.calibrate()
    };
    with("\n[reference]\nkind = \"optical\"\n").with(2).telling(&[
        "small.toml, line",
        "optical",
        "attitude",
        "pose",
    ]);
    with("\n[reference]\nkind = \"pose\"\nnoise = -1.0\n")
        .with(2)
        .telling(&["reference.noise = -1", "above zero"]);
    with("\n[reference]\nkind = \"pose\"\nname = 7\n").with(2).telling(&[
        "small.toml, line",
        "integer",
        "string",
    ]);
    with("\n[reference]\nkind = \"pose\"\nnois = 1.0\n")
        .with(0)
        .telling(&["`reference.nois`", "write `noise`"]);
}
