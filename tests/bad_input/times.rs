//! Times that stand still, run back or jump.

use super::{ALL, Bad, TIME, assert_as_clean};

#[test]
fn time_that_runs_back_names_the_line_and_both_times() {
    let mut bad = Bad::new();
    bad.line(1000)[TIME] = "1.5".into();
    bad.calibrate().with(2).telling(&[
        "small.csv, line 1000, column `t`",
        "found 1.5 after",
        "increasing",
        "sort",
    ]);
}

#[test]
fn time_that_repeats_names_the_line() {
    let mut bad = Bad::new();
    let before = bad.line(999)[TIME].clone();
    bad.line(1000)[TIME] = before;
    bad.calibrate().with(2).telling(&["small.csv, line 1000, column `t`", "remove the duplicate"]);
}

#[test]
fn the_last_row_must_be_in_order_too() {
    let mut bad = Bad::new();
    let last = bad.rows.len();
    bad.line(last)[TIME] = "0".into();
    let place = format!("small.csv, line {last}, column `t`");
    bad.calibrate().with(2).telling(&[&place, "found 0 after"]);
}

#[test]
fn a_row_without_time_is_refused() {
    for nothing in ["", "NaN"] {
        let mut bad = Bad::new();
        bad.line(50)[TIME] = nothing.into();
        bad.calibrate().with(2).telling(&["small.csv, line 50, column `t`", "no time", "remove the row"]);
    }
}

#[test]
fn a_gap_is_reported_and_the_rest_calibrates() {
    let mut bad = Bad::new();
    bad.rows.drain(1001..1101);
    // The rows after the header count from 0.
    bad.calibrate().with(0).printing(&["gap of 2.020 s", "row 1000", "19.980"]);
    assert!(bad.json()["warnings"][0].as_str().is_some_and(|warning| warning.starts_with("gap")));
    assert_as_clean(&bad, &ALL);
}

#[test]
fn times_in_another_unit_than_the_manifest_says_are_noticed() {
    let mut bad = Bad::new();
    bad.map(TIME, |t| (t * 1e6).round());
    bad.calibrate().with(2).telling(&[
        "small.csv, from line 2 on, column `t`",
        "median interval",
        "t = \"us\"",
        "[units]",
    ]);
}

#[test]
fn times_that_nothing_samples_at_are_refused() {
    for interval in [1e-300, 1e-30, 1e-12] {
        let mut bad = Bad::new();
        bad.rows.truncate(60);
        bad.map(TIME, |t| t * interval);
        bad.calibrate().with(2).telling(&[
            "small.csv, from line 2 on, column `t`",
            "median interval",
            "correct the times",
        ]);
    }
}

#[test]
fn a_jump_of_the_clock_is_a_gap() {
    let mut bad = Bad::new();
    for (index, row) in bad.rows.iter_mut().enumerate().skip(2001) {
        row[TIME] = format!("{}", 1.7e9 + index as f64 * 0.02);
    }
    bad.calibrate().with(0).printing(&["gap of", "row 2000"]);
    assert_as_clean(&bad, &ALL);
}

#[test]
fn seconds_since_1970_with_microseconds_calibrate_as_those_since_the_start() {
    let mut bad = Bad::new();
    let times: Vec<f64> = bad.rows[1..].iter().map(|row| row[TIME].parse().expect("a number")).collect();
    for (row, time) in bad.rows[1..].iter_mut().zip(times) {
        // Of whole microseconds, which a double since 1970 is a quarter of.
        row[TIME] = format!("{:.6}", 1.7e9 + 0.123456 + time);
    }
    bad.calibrate().with(0);
    assert_as_clean(&bad, &ALL);
}

#[test]
fn absolute_times_that_run_back_are_reported_as_the_file_has_them() {
    let mut bad = Bad::new();
    for (index, row) in bad.rows.iter_mut().enumerate().skip(1) {
        row[TIME] = format!("17000000{:02}.{:06}", index / 50, index % 50 * 20_000);
    }
    bad.line(1000)[TIME] = "1700000001.500001".into();
    bad.calibrate()
        .with(2)
        .telling(&["small.csv, line 1000, column `t`", "found 1700000001.500001 after 17000000"]);
}
