//! Which calibrations are applied to which recordings.

use super::Folder;

const APPLY: &str = "apply small.csv --calibration cal.bin --out out.csv";

#[test]
fn the_calibration_of_another_serial_is_refused_with_both_named() {
    let folder = Folder::with_calibration();
    folder.replace("small.toml", "SIM-0001", "SIM-0002");
    let refused = folder.run(APPLY).with(1);
    refused.telling(&["refused", "small.csv", "`SIM-0001`", "`SIM-0002`", "--other-serial"]);
    assert!(!folder.path("out.csv").exists());
    folder.run("verify small.csv --calibration cal.toml").with(1).telling(&["`SIM-0001`", "`SIM-0002`"]);
}

#[test]
fn the_calibration_of_another_serial_is_applied_with_a_warning_on_request() {
    let folder = Folder::with_calibration();
    folder.replace("small.toml", "SIM-0001", "SIM-0002");
    let forced = folder.run(&format!("{APPLY} --other-serial")).with(0);
    forced.telling(&["warning", "small.csv", "SIM-0001", "SIM-0002", "--other-serial"]);
    assert!(folder.path("out.csv").exists());
    folder
        .run("verify small.csv --calibration cal.bin --other-serial")
        .with(0)
        .telling(&["warning", "SIM-0002"]);
}

#[test]
fn without_a_serial_a_calibration_is_applied_with_a_warning() {
    let folder = Folder::with_calibration();
    folder.replace("small.toml", "serial = \"SIM-0001\"\n", "");
    folder.run(APPLY).with(0).telling(&["warning", "small.csv", "no serial"]);
    // Nor does the calibration know, if it came from that recording.
    folder.run("calibrate small.csv --record nobodys.bin").with(0);
    folder.replace("small.toml", "[sensor]\n", "[sensor]\nserial = \"SIM-0001\"\n");
    folder
        .run("apply small.csv --calibration nobodys.bin --out other.csv")
        .with(0)
        .telling(&["warning", "no serial"]);
}

#[test]
fn a_recording_in_another_unit_is_refused() {
    let folder = Folder::with_calibration();
    folder.run(APPLY).with(0);
    // The corrected recording is in m/s², the calibration takes counts.
    let lines = [
        "apply out.csv --calibration cal.bin --out twice.csv",
        "apply out.csv --calibration cal.bin --out twice.csv --other-serial",
        "verify out.csv --calibration cal.toml",
    ];
    for line in lines {
        folder.run(line).with(1).telling(&[
            "refused",
            "out.csv",
            "acc was corrected by this calibration before",
        ]);
    }
    let manifest = folder.text("out.toml");
    let (before, calibrated) = manifest.split_once("[calibrated]").expect("it is written");
    let after =
        calibrated.split_once("[sensor]").map_or(String::new(), |(_, sensor)| format!("[sensor]{sensor}"));
    folder.write("out.toml", format!("{before}{after}"));
    for line in lines {
        folder.run(line).with(1).telling(&["refused", "out.csv", "acc is in m/s^2", "takes counts"]);
    }
    assert!(!folder.path("twice.csv").exists());
}

#[test]
fn a_calibration_of_none_of_the_recorded_sensors_is_refused() {
    let folder = Folder::with_calibration();
    let toml = folder.text("cal.toml");
    let (head, _) = toml.split_once("[acc]").expect("an accelerometer");
    folder.write("none.toml", head);
    folder.run("apply small.csv --calibration none.toml --out out.csv").with(1).telling(&[
        "refused",
        "small.csv",
        "none of the sensors",
    ]);
    folder.run("verify small.csv --calibration none.toml").with(1);
}

#[test]
fn a_sensor_without_calibration_passes_unchanged() {
    let folder = Folder::with_calibration();
    let toml = folder.text("cal.toml");
    let (head, _) = toml.split_once("[mag]").expect("a magnetometer");
    folder.write("inertial.toml", head);
    folder.run("apply small.csv --calibration inertial.toml --out out.csv").with(0);
    let mag = |name: &str| -> Vec<String> {
        let text = folder.text(name);
        text.lines().map(|line| line.splitn(8, ',').nth(7).unwrap_or_default().to_owned()).collect()
    };
    assert_eq!(mag("out.csv"), mag("small.csv"));
}

/// Every use of a calibration file that must not be used ends so, and writes nothing.
fn assert_unusable(folder: &Folder, file: &str, inspected: i32, used: i32, parts: &[&str]) {
    let ended = folder.run(&format!("inspect {file}")).with(inspected);
    let printed = format!("{}{}", ended.out, ended.err);
    // A report is broken at blanks.
    let flat = printed.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(parts.iter().all(|part| flat.contains(part)), "{parts:?} in {printed}");
    assert!(!printed.contains("intact\n"), "{printed}");
    folder.run(&format!("apply small.csv --calibration {file} --out out.csv")).with(used).telling(parts);
    folder.run(&format!("verify small.csv --calibration {file}")).with(used).telling(parts);
    assert!(!folder.path("out.csv").exists());
}

#[test]
fn a_record_with_a_flipped_byte_is_refused() {
    let folder = Folder::with_calibration();
    let intact = folder.bytes("cal.bin");
    for at in [13, 40, intact.len() / 2, intact.len() - 1] {
        let mut flipped = intact.clone();
        flipped[at] ^= 0x10;
        folder.write("bad.bin", &flipped);
        assert_unusable(&folder, "bad.bin", 1, 1, &["bad.bin", "copy it again"]);
    }
}

#[test]
fn a_cut_record_is_refused() {
    let folder = Folder::with_calibration();
    let intact = folder.bytes("cal.bin");
    for length in [0, 3, intact.len() / 2, intact.len() - 1] {
        folder.write("bad.bin", &intact[..length]);
        assert_unusable(&folder, "bad.bin", 1, 1, &["bad.bin", "copy it again"]);
    }
}

#[test]
fn a_foreign_file_is_no_calibration() {
    let folder = Folder::with_calibration();
    folder.write("photo.bin", [0x89, b'P', b'N', b'G', 13, 10, 26, 10, 0, 0, 0, 13]);
    folder.write("erased.bin", [0xff; 600]);
    for file in ["photo.bin", "small.csv", "erased.bin"] {
        assert_unusable(
            &folder,
            file,
            2,
            2,
            &[file, "neither a TOML nor a record", "`imucal calibrate` wrote"],
        );
    }
}

#[test]
fn a_toml_that_is_no_calibration_cannot_be_read() {
    let folder = Folder::with_calibration();
    assert_unusable(
        &folder,
        "small.toml",
        2,
        2,
        &["small.toml", "imucal-recording/1", "imucal-calibration/1"],
    );
    folder.write("broken.toml", "format = \"imucal-calibration/1\"\ndate = 2026");
    assert_unusable(&folder, "broken.toml", 2, 2, &["broken.toml", "line 2"]);
    folder
        .write("newer.toml", folder.text("cal.toml").replace("imucal-calibration/1", "imucal-calibration/2"));
    assert_unusable(
        &folder,
        "newer.toml",
        2,
        2,
        &["newer.toml", "imucal-calibration/2", "imucal-calibration/1"],
    );
    let misspelt = folder.text("cal.toml").replacen("unit_in", "unit_inn", 1);
    folder.write("misspelt.toml", misspelt);
    assert_unusable(&folder, "misspelt.toml", 2, 2, &["misspelt.toml", "unit_in"]);
    let mistaken = folder.text("cal.toml").replacen("\n[mag]", "\n[mgn]", 1);
    folder.write("mistaken.toml", mistaken);
    assert_unusable(&folder, "mistaken.toml", 2, 2, &["mistaken.toml", "mgn"]);
}

#[test]
fn a_toml_with_a_gain_nobody_can_apply_is_refused() {
    let folder = Folder::with_calibration();
    let toml = folder.text("cal.toml");
    let line = toml.lines().find(|line| line.starts_with("gain = ")).expect("a gain");
    for gain in [
        "[[1e300, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]",
        "[[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]",
        "[[nan, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]",
    ] {
        folder.write("bad.toml", toml.replacen(line, &format!("gain = {gain}"), 1));
        assert_unusable(&folder, "bad.toml", 1, 1, &["bad.toml", "acc", "gain", "calibrate again"]);
    }
}

#[test]
fn a_calibration_that_no_sensor_can_have_is_refused_with_its_figure() {
    let folder = Folder::with_calibration();
    let toml = folder.text("cal.toml");
    let line = |start: &str| toml.lines().find(|line| line.starts_with(start)).expect("a line of the triad");
    for (start, spoiled, fault) in [
        ("coverage = ", "coverage = 1.5", "the coverage is 1.500, expected 0 to 1.000"),
        ("rms = ", "rms = -1.0", "the rms residual is -1.000"),
        ("bias = ", "bias = [1e12, 0.0, 0.0]", "the bias is 1.000e12"),
        ("unit_in = ", "unit_in = \"rad/s\"", "no such sensor has the unit rad/s"),
        ("unit_in = ", "unit_in = \"g\"", "expected 3.269 to 29.421"),
    ] {
        folder.write("bad.toml", toml.replacen(line(start), spoiled, 1));
        assert_unusable(&folder, "bad.toml", 1, 1, &["bad.toml", "acc", fault, "calibrate again"]);
    }
}
