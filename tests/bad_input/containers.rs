//! Files that are empty, cut, compressed badly or in another encoding.

use std::io::Write;

use flate2::{Compression, write::GzEncoder};

use super::{ACC, ALL, Bad, assert_as_clean};

#[test]
fn an_empty_file_is_refused() {
    for empty in ["", "\n\n", "\u{feff}"] {
        Bad::new().calibrate_bytes("small.csv", empty.as_bytes()).with(2).telling(&[
            "small.csv",
            "an empty file",
            "a header row and samples",
            "again",
        ]);
    }
}

#[test]
fn a_header_alone_is_refused() {
    let mut bad = Bad::new();
    bad.rows.truncate(1);
    let parts = ["small.csv", "a header and no sample", "at least one row"];
    bad.calibrate().with(2).telling(&parts);
    bad.calibrate_bytes("small.csv", bad.text().trim().as_bytes()).with(2).telling(&["small.csv"]);
}

#[test]
fn a_cut_last_line_is_dropped_with_a_warning() {
    let bad = Bad::new();
    let text = bad.text();
    let line = format!("line {}", bad.rows.len());
    bad.calibrate_bytes("small.csv", &text.as_bytes()[..text.len() - 30]).with(0).telling(&[
        "warning",
        "small.csv",
        &line,
        "is cut",
        "dropped",
    ]);
    assert_as_clean(&bad, &ALL);
}

#[test]
fn a_last_line_without_line_end_is_kept_with_a_warning() {
    let bad = Bad::new();
    let text = bad.text();
    bad.calibrate_bytes("small.csv", text.trim_end().as_bytes()).with(0).telling(&["warning", "no line end"]);
    assert_as_clean(&bad, &ALL);
}

#[test]
fn windows_line_ends_and_a_byte_order_mark_change_nothing() {
    let bad = Bad::new();
    let text = format!("\u{feff}{}", bad.text().replace('\n', "\r\n"));
    let ended = bad.calibrate_bytes("small.csv", text.as_bytes()).with(0);
    assert_eq!(ended.err, "");
    assert_as_clean(&bad, &ALL);
}

#[test]
fn a_manifest_with_windows_line_ends_and_a_byte_order_mark_is_read() {
    let mut bad = Bad::new();
    bad.toml = format!("\u{feff}{}", bad.toml.replace('\n', "\r\n"));
    assert_eq!(bad.calibrate().with(0).err, "");
}

fn packed(text: &str) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(text.as_bytes()).expect("memory takes it");
    encoder.finish().expect("memory takes it")
}

#[test]
fn a_cut_gzip_stream_gives_its_whole_rows_and_a_warning() {
    let bad = Bad::new();
    let stream = packed(&bad.text());
    bad.calibrate_bytes("small.csv.gz", &stream[..stream.len() - stream.len() / 20]).with(0).telling(&[
        "warning",
        "small.csv.gz",
        "ends early",
        "whole rows were kept",
        "copy the file again",
    ]);
}

#[test]
fn a_gzip_stream_cut_within_its_header_row_is_refused() {
    let bad = Bad::new();
    let stream = packed(&bad.text());
    for length in [2, 5, 11, 20] {
        bad.calibrate_bytes("small.csv.gz", &stream[..length]).with(2).telling(&["small.csv.gz"]);
    }
}

#[test]
fn a_damaged_gzip_stream_is_refused() {
    let bad = Bad::new();
    let mut stream = packed(&bad.text());
    let middle = stream.len() / 2;
    stream[middle..middle + 64].fill(0x55);
    let ended = bad.calibrate_bytes("small.csv.gz", &stream).with(2);
    assert!(ended.err.contains("small.csv.gz"), "{ended:#?}");
}

#[test]
fn another_encoding_is_refused() {
    let bad = Bad::new();
    let text = bad.text();
    let wide: Vec<u8> =
        [0xfeffu16].into_iter().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    bad.calibrate_bytes("small.csv", &wide).with(2).telling(&[
        "small.csv, line 1",
        "not UTF-8",
        "save the file as UTF-8",
    ]);
    let mut latin = text.clone().into_bytes();
    latin[2] = 0xe9;
    bad.calibrate_bytes("small.csv", &latin).with(2).telling(&["small.csv, line 1", "not UTF-8"]);
    let second = text.find('\n').expect("lines") + 3;
    let mut latin = text.into_bytes();
    latin[second] = 0xe9;
    bad.calibrate_bytes("small.csv", &latin).with(2).telling(&["small.csv, line 2", "expected a number"]);
}

#[test]
fn text_in_another_encoding_in_an_unknown_column_is_refused_too() {
    let mut bad = Bad::new();
    for (index, row) in bad.rows.iter_mut().enumerate() {
        row.push(if index == 0 { "note".into() } else { "?".into() });
    }
    let mut text = bad.text().into_bytes();
    let at = text.iter().rposition(|byte| *byte == b'?').expect("notes");
    text[at] = 0xe9;
    let line = format!("line {}", bad.rows.len());
    bad.calibrate_bytes("small.csv", &text).with(2).telling(&["small.csv", &line, "not UTF-8"]);
}

#[test]
fn a_folder_of_the_recordings_name_is_refused() {
    let bad = Bad::new();
    std::fs::create_dir(bad.path("folder.csv")).expect("the folder takes folders");
    std::fs::write(bad.path("folder.toml"), &bad.toml).expect("the folder takes files");
    bad.calibrate_file("folder.csv").with(2).telling(&["folder.csv", "cannot be read"]);
}

#[test]
fn lines_of_another_length_are_refused() {
    let mut bad = Bad::new();
    bad.line(100).pop();
    bad.calibrate().with(2).telling(&[
        "small.csv, line 100",
        "found 9 fields, expected 10",
        "correct or remove",
    ]);
    let mut bad = Bad::new();
    bad.line(200)[ACC] = "abc".into();
    bad.calibrate().with(2).telling(&["small.csv, line 200, column `acc_x`", "`abc`", "expected a number"]);
}
