//! What exists is not lost: files are replaced only where that is asked for, and what is no plain file stays.

use std::fs;
#[cfg(unix)]
use std::os::unix::fs::{FileTypeExt, PermissionsExt, symlink};
#[cfg(unix)]
use std::process::Command;

use super::Folder;

/// All files of a folder with what is in them.
fn state(folder: &Folder) -> Vec<(String, Vec<u8>)> {
    folder.names().into_iter().map(|name| (name.clone(), folder.bytes(&name))).collect()
}

#[test]
fn every_command_refuses_to_replace_a_file_unless_forced() {
    let folder = Folder::with_calibration();
    let path = folder.path("small.csv");
    fs::copy(&path, folder.path("there.csv")).expect("the folder takes files");
    fs::copy(folder.path("small.toml"), folder.path("there.toml")).expect("the folder takes files");
    folder.write("there.txt", "another's");
    folder.write("acc.mat", "0 0 0 -9.8\n0.02 0 0 -9.8\n");
    folder.write("gyr.mat", "0 0 0 0\n0.02 0 0 0\n");
    folder.write("si.toml", "format = \"imucal-recording/1\"\n");
    for (line, named) in [
        ("apply small.csv --calibration cal.bin --out there.csv", "there.csv: found a recording"),
        (
            "apply small.csv --calibration cal.bin --out there.csv.gz",
            "there.toml: found a recording's manifest",
        ),
        // Its manifest would be cal.toml.
        ("simulate --programme rates --rate 10 --out cal.csv", "cal.toml: found a calibration of this name"),
        ("simulate --programme rates --rate 10 --sealed --out there.csv", "there.csv"),
        ("import acc.mat gyr.mat --manifest si.toml --out there.csv", "there.csv"),
        ("diagnose small.csv --json there.txt", "there.txt: found a file"),
        ("calibrate small.csv --out there.toml", "there.toml: found a recording's manifest"),
        ("calibrate small.csv --record there.csv", "there.csv: found a recording"),
        ("calibrate small.csv --json there.txt", "there.txt: found a file"),
        ("calibrate small.csv --out cal.bin", "cal.bin: found a calibration's record"),
        ("calibrate small.csv --json cal.toml", "cal.toml: found a calibration of this name"),
        ("calibrate small.csv --out cal2.toml --record there.txt", "there.txt"),
    ] {
        let before = state(&folder);
        folder.run(line).with(2).telling(&[named, "--force", "another name", "nothing was written"]);
        assert_eq!(state(&folder), before, "{line}");
    }
    folder.run("apply small.csv --calibration cal.bin --out there.csv --force").with(0);
    assert_ne!(folder.bytes("there.csv"), folder.bytes("small.csv"));
    folder.run("import acc.mat gyr.mat --manifest si.toml --out there.csv --force").with(0);
    folder.run("simulate --programme rates --rate 10 --out there.csv --force").with(0);
    folder.run("calibrate small.csv --out there.toml --json there.txt --force").with(0);
    folder.run("inspect there.toml").with(0);
}

#[test]
fn a_hyphen_is_no_file_but_for_json() {
    let folder = Folder::with_calibration();
    let before = state(&folder);
    for line in
        ["calibrate small.csv --out -", "calibrate small.csv --record -", "export cal.toml --to csv --out -"]
    {
        folder.run(line).with(2).telling(&["found `-`", "expected the name of a file", "./-"]);
        assert_eq!(state(&folder), before, "{line}");
    }
}

#[test]
fn a_calibration_replaces_its_own_outputs_of_the_same_kind() {
    let folder = Folder::with_calibration();
    let line = "calibrate small.csv --out cal.toml --record cal.bin --json cal.json";
    folder.run(line).with(0);
    folder.replace("cal.toml", "SIM-0001", "SIM-0009");
    folder.write("cal.bin", [folder.bytes("cal.bin"), b"more".to_vec()].concat());
    folder.run(line).with(0);
    assert!(folder.text("cal.toml").contains("SIM-0001"));
    assert!(!folder.bytes("cal.bin").ends_with(b"more"));
    // Made by mktemp, for instance.
    folder.write("new.toml", "");
    folder.run("calibrate small.csv --out new.toml").with(0);
}

#[test]
fn force_replaces_no_input_and_applies_no_foreign_calibration() {
    let folder = Folder::with_calibration();
    let before = state(&folder);
    for line in [
        "calibrate small.csv --out small.toml --force",
        "apply small.csv --calibration cal.toml --out cal.csv --force",
        "calibrate small.csv --out new.x --record new.x --force",
    ] {
        folder.run(line).with(2).telling(&["another name", "nothing was written"]);
        assert_eq!(state(&folder), before, "{line}");
    }
    folder.replace("small.toml", "SIM-0001", "SIM-0002");
    folder
        .run("apply small.csv --calibration cal.bin --out out.csv --force")
        .with(1)
        .telling(&["`SIM-0001`", "--other-serial"]);
}

#[test]
fn a_demo_replaces_an_earlier_one_and_nothing_else() {
    let folder = Folder::new();
    fs::create_dir(folder.path("demo.d")).expect("the folder takes folders");
    folder.write("demo.d/calibration.toml", "another's");
    folder.run("demo --out demo.d").with(2).telling(&["calibration.toml", "--force"]);
    assert_eq!(super::names(&folder.path("demo.d")), ["calibration.toml"]);
    folder.run("demo --out demo.d --force").with(0);
    let names = super::names(&folder.path("demo.d"));
    folder.run("demo --out demo.d").with(0);
    assert_eq!(super::names(&folder.path("demo.d")), names);
}

#[test]
fn a_folder_without_a_set_is_neither_scored_nor_added_to() {
    let folder = Folder::new();
    fs::create_dir(folder.path("set.d")).expect("the folder takes folders");
    folder.run("blind --score set.d").with(2).telling(&["set.d: found no set of trials"]);
    // Whose last line is not whole, and would be cut off.
    folder.write("set.d/answers.jsonl", "{\"mine\": 1}\nno line end");
    folder.run("blind --healthy 1 --cases 0 --out set.d").with(2).telling(&["answers.jsonl", "set.json"]);
    assert_eq!(folder.text("set.d/answers.jsonl"), "{\"mine\": 1}\nno line end");
    assert_eq!(super::names(&folder.path("set.d")), ["answers.jsonl"]);
}

#[cfg(target_os = "linux")]
#[test]
fn devices_and_the_standard_output_are_written_through() {
    let folder = Folder::with_recording();
    folder.run("calibrate small.csv --json /dev/null --record /dev/null").with(0);
    assert!(fs::metadata("/dev/null").expect("Linux has it").file_type().is_char_device());
    let ended = folder.run("calibrate small.csv --out /dev/stdout").with(0);
    ended.printing(&["accelerometer (T9): accepted", "format = \"imucal-calibration/1\"", "[mag]"]);
    // A file behind the standard output is not replaced under it, or the table would be lost.
    let log = fs::File::create(folder.path("log.txt")).expect("the folder takes files");
    let status = Command::new(env!("CARGO_BIN_EXE_imucal-under-test"))
        .args(folder.arguments("calibrate small.csv --out /dev/stdout"))
        .stdout(log)
        .status();
    assert!(status.expect("the program starts").success());
    let log = folder.text("log.txt");
    assert!(log.contains("accelerometer (T9): accepted") && log.contains("[mag]"), "{log}");
    assert_eq!(folder.names(), ["log.txt", "small.csv", "small.toml"]);
}

#[cfg(target_os = "linux")]
#[test]
fn where_one_output_fails_no_other_is_changed() {
    let folder = Folder::with_calibration();
    let before = state(&folder);
    folder
        .run("calibrate small.csv --out cal.toml --json new.json --record /dev/full")
        .with(2)
        .telling(&["/dev/full", "no file was changed"]);
    assert_eq!(state(&folder), before);
}

#[cfg(unix)]
#[test]
fn links_are_followed_and_fifos_fed() {
    let folder = Folder::with_calibration();
    fs::rename(folder.path("cal.toml"), folder.path("real.toml")).expect("the folder takes names");
    symlink("real.toml", folder.path("cal.toml")).expect("the folder takes links");
    folder.replace("real.toml", "SIM-0001", "SIM-0009");
    folder.run("calibrate small.csv --out cal.toml").with(0);
    assert!(folder.path("cal.toml").is_symlink() && folder.text("real.toml").contains("SIM-0001"));

    let fifo = folder.path("fed.csv");
    let made = Command::new("mkfifo").arg(&fifo).status().expect("mkfifo starts");
    assert!(made.success());
    let reader = std::thread::spawn({
        let fifo = fifo.clone();
        move || fs::read_to_string(fifo).expect("text")
    });
    folder.run("apply small.csv --calibration cal.bin --out fed.csv").with(0);
    let fed = reader.join().expect("it reads");
    folder.run("apply small.csv --calibration cal.bin --out plain.csv").with(0);
    assert_eq!(fed, folder.text("plain.csv"));
    assert!(fs::metadata(&fifo).expect("it is there").file_type().is_fifo());
}

#[cfg(unix)]
#[test]
fn read_only_files_are_refused_and_modes_kept() {
    let folder = Folder::with_calibration();
    let set = |mode| {
        let permissions = fs::Permissions::from_mode(mode);
        fs::set_permissions(folder.path("cal.toml"), permissions).expect("the file is ours");
    };
    set(0o640);
    folder.run("calibrate small.csv --out cal.toml").with(0);
    let mode = fs::metadata(folder.path("cal.toml")).expect("it is there").permissions().mode();
    assert_eq!(mode & 0o777, 0o640);
    set(0o444);
    let before = state(&folder);
    for force in ["", " --force"] {
        folder.run(&format!("calibrate small.csv --out cal.toml --json new.json{force}")).with(2).telling(&[
            "cal.toml",
            "read-only",
            "make it writable",
            "nothing was changed",
        ]);
        assert_eq!(state(&folder), before);
    }
}
