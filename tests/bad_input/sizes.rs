//! Files that are far longer than what they hold: they end in an error before they fill the memory.

use std::io::Write;
use std::process::{Command, Stdio};

use flate2::{Compression, write::GzEncoder};

use super::Bad;

/// Memory that the program may have, KiB: far less than the files below come to.
const MEMORY: usize = 600_000;

/// Runs the program with no more memory than that; standard error of one that ended with 2.
fn refused(bad: &Bad, arguments: &[&str]) -> String {
    let output = Command::new("sh")
        .args(["-c", &format!("ulimit -v {MEMORY}; exec \"$0\" \"$@\"")])
        .arg(env!("CARGO_BIN_EXE_imucal-under-test"))
        .args(arguments)
        .current_dir(bad.folder.path())
        .stdin(Stdio::null())
        .output()
        .expect("the program starts");
    let message = String::from_utf8(output.stderr).expect("the program writes UTF-8");
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
    message
}

/// A gigabyte of the same bytes in a megabyte of gzip: one member many times.
fn bomb(head: &str, piece: &str) -> Vec<u8> {
    let packed = |text: &str| {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(text.as_bytes()).expect("memory takes it");
        encoder.finish().expect("memory takes it")
    };
    let member = packed(&piece.repeat((1 << 20) / piece.len()));
    [packed(head), member.repeat(1000)].concat()
}

/// The small recording's manifest, and these samples.
fn with_samples(name: &str, bytes: &[u8]) -> Bad {
    let bad = Bad::new();
    std::fs::write(bad.path("small.toml"), &bad.toml).expect("the folder takes files");
    std::fs::write(bad.path(name), bytes).expect("the folder takes files");
    bad
}

const SAMPLES: &str = "small.csv.gz";
const HEADER: &str = "t,acc_x,acc_y,acc_z\n";

#[test]
fn a_gigabyte_of_zeros_or_commas_is_a_line_that_is_too_long() {
    // An open quote takes all lines for one.
    let quoted = format!("{HEADER}0,\"");
    for (head, piece, line) in [("", "\0", 1), ("", ",", 1), (HEADER, "0", 2), (quoted.as_str(), "x\n", 2)] {
        let bad = with_samples(SAMPLES, &bomb(head, piece));
        let message = refused(&bad, &["calibrate", SAMPLES]);
        let parts = [format!("{SAMPLES}, line {line}: found"), "raise the limit with --max-columns".into()];
        assert!(parts.iter().all(|part| message.contains(part.as_str())), "{message}");
    }
}

#[test]
fn a_gigabyte_of_rows_is_too_much_at_a_limit_that_can_be_raised() {
    let bad = with_samples(SAMPLES, &bomb(HEADER, "0,,,\n"));
    let message = refused(&bad, &["calibrate", SAMPLES, "--max-size", "64M"]);
    assert!(
        message.contains("samples that take more than 64 MiB") && message.contains("--max-size"),
        "{message}"
    );
    let bad = with_samples(SAMPLES, &bomb(HEADER, "\n"));
    let message = refused(&bad, &["calibrate", SAMPLES, "--max-size", "64M"]);
    assert!(message.contains("more than 64 MiB of it") && message.contains("--max-size"), "{message}");
}

#[cfg(target_os = "linux")]
#[test]
fn no_reader_follows_a_device_that_does_not_end() {
    let bad = with_samples("small.csv", b"");
    std::fs::remove_file(bad.path("small.csv")).expect("it was written");
    std::os::unix::fs::symlink("/dev/zero", bad.path("small.csv")).expect("the folder takes links");
    std::os::unix::fs::symlink("/dev/zero", bad.path("zero.toml")).expect("the folder takes links");
    std::fs::write(bad.path("zero.csv"), bad.text()).expect("the folder takes files");
    let (zero, manifest) = ("/dev/zero", "small.toml");
    for (arguments, part) in [
        (&["inspect", zero][..], "/dev/zero: found more than 1 MiB, expected a calibration"),
        (&["inspect", "zero.toml"], "zero.toml: found more than 1 MiB"),
        (&["calibrate", "small.csv"], "small.csv, line 1: found a line longer than 64 KiB"),
        (&["calibrate", "zero.csv"], "zero.toml: found more than 1 MiB"),
        (&["import", zero, zero, "--manifest", manifest, "--out", "new.csv"], "/dev/zero, line 1"),
        (&["import", zero, zero, "--manifest", zero, "--out", "new.csv"], "/dev/zero: found more than 1 MiB"),
    ] {
        let message = refused(&bad, arguments);
        assert!(message.contains(part), "{arguments:?}: {message}");
    }
}

#[test]
fn a_recording_of_many_columns_is_read_once_that_is_allowed() {
    let mut bad = Bad::new();
    for (index, row) in bad.rows.iter_mut().enumerate() {
        row.extend((0..1100).map(|column| if index == 0 { format!("c{column}") } else { String::new() }));
    }
    bad.rows.truncate(200);
    let bad = with_samples("small.csv", bad.text().as_bytes());
    let message = refused(&bad, &["calibrate", "small.csv"]);
    assert!(message.contains("small.csv, line 1: found more than 1024 columns"), "{message}");
    let program = env!("CARGO_BIN_EXE_imucal-under-test");
    let raised = ["calibrate", &bad.path("small.csv").display().to_string(), "--max-columns", "2000"];
    let ended = imucal_tests::program::run(program, &[], &raised);
    assert!(ended.status < 2 && ended.err.contains("column `c1099`"), "{}", ended.status);
}
