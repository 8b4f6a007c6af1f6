//! What goes to standard output and standard error, and what does not.

use std::io::Read;
use std::process::{Command, Stdio};

use imucal_host::calibrate::{Options, calibrate};
use imucal_host::report::table::table;
use imucal_tests::simulated;

use super::{Folder, imucal_on_a_day};

#[test]
fn a_pipe_gets_no_escape_codes_and_no_progress() {
    let folder = Folder::with_calibration();
    for line in [
        "calibrate small.csv",
        "apply small.csv --calibration cal.bin --out out.csv",
        "inspect cal.bin",
        "inspect cal.toml",
        "verify small.csv --calibration cal.toml",
        "--help",
        "calibrate none.csv",
        "calibrate small.csv --nothing",
    ] {
        let ended = folder.run(line);
        for text in [&ended.out, &ended.err] {
            assert!(!text.contains(['\u{1b}', '\r', '\u{8}']), "{line}: {ended:#?}");
        }
    }
}

#[test]
fn success_is_silent_on_standard_error() {
    let folder = Folder::with_calibration();
    for line in [
        "calibrate small.csv",
        "apply small.csv --calibration cal.toml --out out.csv",
        "inspect cal.toml",
        "verify small.csv --calibration cal.bin",
    ] {
        assert_eq!(folder.run(line).with(0).err, "", "{line}");
    }
}

#[test]
fn a_figure_that_is_no_number_is_said_in_words() {
    let mut calibration = calibrate(&simulated::small(), &Options::default(), &|_| {});
    let nan = f64::NAN;
    for fit in calibration.sensors.iter_mut().filter_map(|outcome| outcome.fit.as_mut()) {
        (fit.rms, fit.held_out_rms, fit.condition, fit.coverage) = (nan, Some(nan), nan, nan);
        (fit.triad.bias.x, fit.gain_std[(1, 1)], fit.field_norm) = (nan, nan, Some(nan));
        fit.rig.get_or_insert_default().tilt = Some(([nan; 2], [nan; 2]));
        if let Some(alignment) = &mut fit.alignment {
            (alignment.held_out_rms, alignment.dip, alignment.phi.x) = (None, (nan, nan), nan);
        }
    }
    let text = table(&calibration);
    assert!(!text.contains("NaN"), "{text}");
    for part in ["dip not known, no rest can be held out", "base tilted by not known", "rms not known"] {
        assert!(text.contains(part), "{part} is missing in {text}");
    }
}

#[test]
fn json_on_standard_output_stands_alone() {
    let folder = Folder::with_recording();
    let ended = folder.run("calibrate small.csv --json -").with(0);
    assert_eq!(ended.err, "");
    let value: serde_json::Value = serde_json::from_str(&ended.out).expect("JSON and nothing else");
    assert_eq!(value["format"], "imucal-calibration/1");
}

#[test]
fn a_reader_that_closes_the_pipe_is_no_failure() {
    let folder = Folder::with_recording();
    let mut child = Command::new(env!("CARGO_BIN_EXE_imucal-under-test"))
        .args(folder.arguments("calibrate small.csv --out cal.toml"))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    drop(child.stdout.take());
    let mut message = String::new();
    child.stderr.take().expect("piped").read_to_string(&mut message).expect("text");
    let status = child.wait().expect("the child is ours");
    assert_eq!((status.code(), message.as_str()), (Some(0), ""));
    assert!(folder.path("cal.toml").exists(), "what was asked for is written all the same");
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_behind_standard_output_is_reported() {
    let folder = Folder::with_recording();
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").expect("Linux has it");
    let output = Command::new(env!("CARGO_BIN_EXE_imucal-under-test"))
        .args(folder.arguments("calibrate small.csv"))
        .stdout(full)
        .output()
        .expect("the program starts");
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("standard output") && !message.contains("panicked"), "{message}");
}

#[test]
fn on_one_day_two_runs_write_the_same_bytes() {
    let folder = Folder::with_recording();
    let run = |name: &str| {
        let line = format!("calibrate small.csv --out {name}.toml --record {name}.bin --json {name}.json");
        let table = imucal_on_a_day(&folder.arguments(&line)).with(0).out;
        (table, ["toml", "bin", "json"].map(|ending| folder.bytes(&format!("{name}.{ending}"))))
    };
    let first = run("first");
    assert_eq!(first, run("second"));
    let toml = String::from_utf8(first.1[0].clone()).expect("text");
    assert!(toml.contains("date = \"2026-09-21\""), "{toml}");
}

#[test]
fn escapes_in_a_header_reach_neither_reports_nor_messages() {
    let folder = Folder::with_recording();
    let text = folder.text("small.csv");
    let rows = text.lines().enumerate().map(|(row, line)| match row {
        0 => format!("\u{1b}[2Jname,{line}\n"),
        _ => format!("0,{line}\n"),
    });
    folder.write("small.csv", rows.collect::<String>());
    let run = folder.run("calibrate small.csv");
    let printed = run.out + &run.err;
    assert!(printed.contains("\\u{1b}[2Jname") && !printed.contains("\u{1b}[2J"), "{printed}");
}
