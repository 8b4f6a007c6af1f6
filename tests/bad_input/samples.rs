//! Samples that are missing, clipped, stuck or absurd, and recordings with hardly any.

use super::{ACC, ALL, Bad, GYR, MAG, assert_as_clean};

fn warnings(bad: &Bad) -> Vec<String> {
    let json = bad.json();
    let list = json["warnings"].as_array().expect("a list");
    list.iter().map(|warning| warning.as_str().expect("text").to_owned()).collect()
}

#[test]
fn missing_samples_are_left_out_and_counted() {
    let mut bad = Bad::new();
    for line in [302, 303, 1200] {
        bad.line(line)[ACC] = String::new();
    }
    bad.line(2000)[GYR + 1] = "NaN".into();
    bad.line(2500)[MAG + 2] = "nan".into();
    bad.calibrate().with(0).printing(&[
        "acc: 3 rows not measured",
        "gyr: 1 rows not measured",
        "mag: 1 rows not measured",
    ]);
    assert_as_clean(&bad, &ALL);
}

#[test]
fn a_sensor_that_was_never_measured_is_refused() {
    let mut bad = Bad::new();
    for row in &mut bad.rows[1..] {
        row[ACC..GYR].fill(String::new());
    }
    bad.calibrate().with(0).printing(&["accelerometer (T9): REFUSED", "magnetometer (E9): accepted"]);
}

#[test]
fn infinite_samples_are_refused_with_their_place() {
    for infinite in ["inf", "-inf", "Infinity", "1e999"] {
        let mut bad = Bad::new();
        bad.line(1234)[GYR] = infinite.into();
        bad.calibrate().with(2).telling(&[
            "small.csv, line 1234, column `gyr_x`",
            "infinite",
            infinite,
            "leave it empty",
        ]);
    }
}

#[test]
fn a_huge_sample_is_named_and_left_out() {
    for (huge, column, name, kind) in [
        ("1e12", ACC, "acc_x", "acc"),
        ("-1e30", ACC + 1, "acc_y", "acc"),
        ("1e308", ACC + 2, "acc_z", "acc"),
        ("1e160", GYR, "gyr_x", "gyr"),
        ("1e13", MAG + 2, "mag_z", "mag"),
    ] {
        let mut bad = Bad::new();
        bad.line(1500)[column] = huge.into();
        let place = format!("small.csv, line 1500, column `{name}`");
        let shown = format!("{:.3e} counts", huge.parse::<f64>().expect("a number"));
        let ended = bad.calibrate().with(0).telling(&["warning", &place, &shown, "taken for not measured"]);
        ended.printing(&[&format!("{kind}: 1 rows not measured")]);
        assert_as_clean(&bad, &ALL);
    }
}

#[test]
fn a_clipped_stretch_is_reported_and_left_out() {
    let mut bad = Bad::new();
    let highest =
        bad.rows[1..].iter().map(|row| row[GYR].parse::<f64>().expect("a number")).fold(0.0, f64::max);
    let limit = (32768.0 + 0.7 * (highest - 32768.0)).round();
    bad.map(GYR, |raw| raw.min(limit));
    bad.calibrate().with(0).printing(&["gyr_x: clipped in rows", "left out"]);
    assert_as_clean(&bad, &ALL);
}

#[test]
fn a_clip_at_the_declared_range_is_reported_and_left_out() {
    let mut bad = Bad::new();
    let far = |raw: &String| (raw.parse::<f64>().expect("a number") - 32768.0).abs();
    let highest = bad.rows[1..].iter().flat_map(|row| row[GYR..MAG].iter().map(far)).fold(0.0, f64::max);
    let limit = (0.95 * highest).round();
    for axis in 0..3 {
        bad.map(GYR + axis, |raw| raw.clamp(32768.0 - limit, 32768.0 + limit));
    }
    bad.toml += &format!("\n[ranges]\ngyr = {limit:.1}\n");
    bad.calibrate().with(0).printing(&["clipped in rows"]);
    assert_as_clean(&bad, &ALL);
}

#[test]
fn a_stuck_stretch_is_reported_and_left_out() {
    let mut bad = Bad::new();
    for (first, last) in [(ACC, GYR), (GYR, MAG), (MAG, MAG + 3)] {
        let held = bad.rows[601][first..last].to_vec();
        bad.rows[601..701].iter_mut().for_each(|row| row[first..last].clone_from_slice(&held));
    }
    bad.calibrate().with(0);
    for kind in ALL {
        let messages = warnings(&bad);
        assert!(
            messages.iter().any(|w| w.starts_with(&format!("{kind}: stuck in rows 600 to 700"))),
            "{messages:?}"
        );
    }
    assert_as_clean(&bad, &ALL);
}

#[test]
fn one_row_and_two_rows_are_refused_not_fitted() {
    for rows in [1, 2] {
        let mut bad = Bad::new();
        bad.rows.truncate(1 + rows);
        bad.calibrate().with(1).printing(&[
            "accelerometer (T9): REFUSED",
            "gyroscope (K9): REFUSED",
            "magnetometer (E9): REFUSED",
            "to do:",
        ]);
    }
}

#[test]
fn a_constant_sensor_is_refused() {
    let mut bad = Bad::new();
    let held = bad.rows[1][ACC..].to_vec();
    bad.rows[1..].iter_mut().for_each(|row| row[ACC..].clone_from_slice(&held));
    bad.calibrate().with(1).printing(&["stuck", "accelerometer (T9): REFUSED", "magnetometer (E9): REFUSED"]);
}

#[test]
fn a_sensor_of_zeros_is_refused() {
    let mut bad = Bad::new();
    bad.rows[1..].iter_mut().for_each(|row| row[ACC..].fill("0".into()));
    bad.calibrate().with(1).printing(&["accelerometer (T9): REFUSED", "magnetometer (E9): REFUSED"]);
}
