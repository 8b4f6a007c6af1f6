//! Files are written whole or not at all, and never over what was read.

use std::fs;

use imucal_tests::data;

use super::{Folder, imucal};

/// The recording as it was, and no temporary file anywhere.
fn assert_untouched(folder: &Folder, before: &[Vec<u8>; 2]) {
    assert_eq!(&[folder.bytes("small.csv"), folder.bytes("small.toml")], before);
    let names = folder.names();
    assert!(names.iter().all(|name| !name.starts_with('.') && !name.ends_with(".part")), "{names:?}");
}

#[test]
fn an_output_that_cannot_be_written_is_named_and_leaves_nothing_behind() {
    let folder = Folder::with_recording();
    let before = [folder.bytes("small.csv"), folder.bytes("small.toml")];
    fs::create_dir(folder.path("taken.d")).expect("the folder takes folders");
    fs::write(folder.path("taken.d").join("kept"), "kept").expect("the folder takes files");
    for option in ["--out", "--record", "--json"] {
        for target in ["missing.d/cal.x", "taken.d"] {
            folder.run(&format!("calibrate small.csv {option} {target}")).with(2).telling(&[
                target,
                "cannot be written",
                "check the folder",
                "nothing was changed",
            ]);
            assert_untouched(&folder, &before);
            assert_eq!(folder.names(), ["small.csv", "small.toml", "taken.d"]);
        }
    }
    assert_eq!(super::names(&folder.path("taken.d")), ["kept"]);
}

#[test]
fn a_failed_output_leaves_former_files_and_other_outputs_whole() {
    let folder = Folder::with_calibration();
    let before = [folder.bytes("small.csv"), folder.bytes("small.toml")];
    let former = (folder.bytes("cal.toml"), folder.bytes("cal.bin"));
    folder
        .run("calibrate small.csv --out cal.toml --record missing.d/cal.bin")
        .with(2)
        .telling(&["missing.d"]);
    folder.run("inspect cal.toml").with(0);
    folder.run("calibrate small.csv --out missing.d/cal.toml --record cal.bin").with(2);
    folder.run("inspect cal.bin").with(0);
    folder.run("calibrate none.csv --out cal.toml --record cal.bin").with(2);
    assert_eq!((folder.bytes("cal.toml"), folder.bytes("cal.bin")), former);
    assert_untouched(&folder, &before);
}

#[test]
fn an_apply_that_cannot_write_leaves_nothing_behind() {
    let folder = Folder::with_calibration();
    let before = [folder.bytes("small.csv"), folder.bytes("small.toml")];
    let names = folder.names();
    for target in ["missing.d/out.csv", "out.txt"] {
        folder
            .run(&format!("apply small.csv --calibration cal.bin --out {target}"))
            .with(2)
            .telling(&[target]);
        assert_eq!(folder.names(), names);
    }
    for taken in ["out.csv", "out.toml"] {
        fs::create_dir(folder.path(taken)).expect("the folder takes folders");
        let mut names = folder.names();
        names.sort();
        folder.run("apply small.csv --calibration cal.bin --out out.csv").with(2).telling(&["out."]);
        assert_eq!(folder.names(), names);
        fs::remove_dir(folder.path(taken)).expect("it is empty");
    }
    assert_untouched(&folder, &before);
}

#[test]
fn no_output_replaces_what_was_read() {
    let folder = Folder::with_calibration();
    let all = || folder.names().iter().map(|name| folder.bytes(name)).collect::<Vec<_>>();
    let before = all();
    for (line, named) in [
        ("calibrate small.csv --out small.toml", "small.toml"),
        ("calibrate small.csv --out ./small.toml", "small.toml"),
        ("calibrate small.csv --record small.csv", "small.csv"),
        ("calibrate small.csv --json small.toml", "small.toml"),
        ("calibrate small.csv --out new.x --record new.x", "new.x"),
        ("apply small.csv --calibration cal.bin --out small.csv", "small.csv"),
        // Its manifest would be cal.toml.
        ("apply small.csv --calibration cal.toml --out cal.csv", "cal.toml"),
        // So would that of the recording.
        ("apply small.csv --calibration cal.bin --out small.csv.gz", "small.toml"),
    ] {
        folder.run(line).with(2).telling(&[named, "another name", "nothing was written"]);
        assert_eq!(all(), before, "{line}");
    }
}

#[test]
fn apply_writes_to_the_folder_of_the_recording_unless_another_is_given() {
    let folder = Folder::with_calibration();
    folder.run("apply small.csv --calibration cal.bin").with(0).printing(&["small-calibrated.csv"]);
    assert!(folder.path("small-calibrated.csv").exists() && folder.path("small-calibrated.toml").exists());
}

#[test]
fn a_dotted_name_keeps_its_dots_in_the_name_of_what_is_written() {
    let folder = Folder::with_calibration();
    for (from, to) in [("small.csv", "run.2026-11-21.csv"), ("small.toml", "run.2026-11-21.toml")] {
        fs::rename(folder.path(from), folder.path(to)).expect("the folder takes names");
    }
    folder.run("apply run.2026-11-21.csv --calibration cal.bin").with(0);
    assert!(folder.path("run.2026-11-21-calibrated.csv").exists(), "{:?}", folder.names());
}

#[test]
fn where_nothing_is_accepted_nothing_is_written_and_that_is_said() {
    let Some(path) = data::real("mpu6050-unobservable.csv.gz") else { return };
    let folder = Folder::new();
    let former = "format = \"imucal-calibration/1\"\n";
    folder.write("cal.toml", former);
    let mut arguments = folder.arguments("calibrate . --out cal.toml --record cal.bin --json cal.json");
    arguments[1] = path;
    let ended = imucal(&arguments).with(1);
    ended.telling(&["cal.toml: not written", "cal.bin: not written", "no sensor was accepted"]);
    assert_eq!(folder.names(), ["cal.json", "cal.toml"], "the JSON holds the reasons");
    assert_eq!(folder.text("cal.toml"), former);
}

#[test]
fn outputs_hold_the_accepted_sensors_alone() {
    let Some(path) = data::real("broad-32-magnet-1cm.csv.gz") else { return };
    let folder = Folder::new();
    let mut arguments = folder.arguments("calibrate . --out cal.toml --record cal.bin --json cal.json");
    arguments[1] = path;
    let ended = imucal(&arguments);
    let json: serde_json::Value = serde_json::from_str(&folder.text("cal.json")).expect("JSON");
    let accepted = |kind: &str| json["sensors"][kind]["status"] == "accepted";
    let any = ["acc", "gyr", "mag"].into_iter().any(accepted);
    assert_eq!(ended.status, i32::from(!any));
    for file in ["cal.toml", "cal.bin"].into_iter().filter(|_| any) {
        let inspected = folder.run(&format!("inspect {file}")).with(0).out;
        for (kind, words) in [("acc", "accelerometer"), ("gyr", "gyroscope"), ("mag", "magnetometer")] {
            assert_eq!(
                inspected.contains(&format!("{words}: not calibrated")),
                !accepted(kind),
                "{inspected}"
            );
        }
    }
}
