//! Columns that are missing, misspelt or in another unit.

use super::{ACC, ALL, Bad, GYR, MAG, TIME, assert_as_clean};

#[test]
fn a_missing_axis_is_named_with_its_neighbours() {
    let mut bad = Bad::new();
    bad.rows.iter_mut().for_each(|row| drop(row.remove(ACC + 1)));
    bad.calibrate().with(2).telling(&[
        "small.csv, line 1",
        "`acc_y` is missing",
        "found `acc_x`, `acc_z`",
        "expected all of `acc_x`, `acc_y`, `acc_z` or none",
        "add the column",
    ]);
}

#[test]
fn a_misspelt_column_is_distinguished_from_an_unknown_one() {
    for (found, meant) in [("acc_X", "acc_x"), ("accx", "acc_x"), ("Acc_x", "acc_x"), ("acc-x", "acc_x")] {
        let mut bad = Bad::new();
        bad.line(1)[ACC] = found.into();
        let parts = [format!("`{found}`"), format!("`{meant}`")];
        bad.calibrate().with(2).telling(&["small.csv, line 1", &parts[0], &parts[1]]);
    }
}

#[test]
fn all_columns_are_named_at_once_with_what_they_probably_are() {
    let mut bad = Bad::new();
    for (column, name) in
        ["timestamp", "ax", "ay", "az", "gyro_x (deg/s)", "wy", "wz"].into_iter().enumerate()
    {
        bad.line(1)[column] = name.into();
    }
    bad.rows.iter_mut().for_each(|row| drop(row.remove(MAG + 1)));
    bad.line(1).push("temp_c".into());
    bad.rows[1..].iter_mut().for_each(|row| row.push("20".into()));
    let parts = [
        "small.csv, line 1",
        "`timestamp` for `t`, `ax` for `acc_x`, `ay` for `acc_y`, `az` for `acc_z`",
        "`gyro_x (deg/s)` for `gyr_x`, `wy` for `gyr_y`, `wz` for `gyr_z`, `temp_c` for `temp`",
        "column `mag_y` is missing",
        "[units]",
    ];
    bad.calibrate().with(2).telling(&parts);
    let semicolons = bad.text().replace(',', ";");
    bad.calibrate_bytes("small.csv", semicolons.as_bytes()).with(2).telling(&parts).telling(&["semicolons"]);
}

#[test]
fn a_column_twice_is_refused() {
    let mut bad = Bad::new();
    bad.line(1)[MAG] = "acc_x".into();
    bad.calibrate().with(2).telling(&["small.csv, line 1", "`acc_x` twice", "remove or rename"]);
}

#[test]
fn a_file_without_time_is_refused() {
    let mut bad = Bad::new();
    bad.line(1)[0] = "when".into();
    bad.calibrate().with(2).telling(&["small.csv, line 1", "no column `t`", "rename the time column"]);
}

#[test]
fn another_separator_is_reported() {
    let bad = Bad::new();
    let semicolons = bad.text().replace(',', ";");
    bad.calibrate_bytes("small.csv", semicolons.as_bytes())
        .with(2)
        .telling(&["small.csv, line 1", "separate columns by commas"]);
}

#[test]
fn a_decimal_comma_is_a_field_too_many() {
    let bad = Bad::new();
    let text = bad.text().replacen("0.02,", "0,02,", 1);
    bad.calibrate_bytes("small.csv", text.as_bytes())
        .with(2)
        .telling(&["line 3", "found 11 fields, expected 10"]);
}

/// From counts to m/s², which the default units say.
fn in_si(bad: &mut Bad) {
    // Without the large offsets, as most units in SI are.
    for (axis, offset) in [33_124.9, 33_274.3, 32_365.5].into_iter().enumerate() {
        bad.map(ACC + axis, |raw| (raw - offset) / 415.0);
    }
    bad.manifest("acc = \"counts\"", "acc = \"m/s^2\"");
}

#[test]
fn samples_in_g_that_the_manifest_calls_si_are_refused() {
    let mut bad = Bad::new();
    in_si(&mut bad);
    for axis in 0..3 {
        bad.map(ACC + axis, |value| value / 9.80665);
    }
    bad.calibrate().with(2).telling(&[
        "small.csv, from line 2 on, sensor acc",
        "when read as `m/s^2`",
        "about 9.8",
        "acc = \"g\"",
        "[units]",
    ]);
}

#[test]
fn one_axis_in_g_among_others_in_si_is_refused() {
    let mut bad = Bad::new();
    in_si(&mut bad);
    bad.map(ACC + 2, |value| value / 9.80665);
    bad.calibrate().with(2).telling(&[
        "small.csv, from line 2 on, column `acc_z`",
        "look like `g`",
        "convert the column",
    ]);
}

#[test]
fn counts_that_the_manifest_calls_si_are_refused() {
    let mut bad = Bad::new();
    bad.manifest("acc = \"counts\"", "acc = \"m/s^2\"");
    bad.calibrate().with(2).telling(&[
        "small.csv, from line 2 on, sensor acc",
        "look like `counts`",
        "[units]",
    ]);
}

#[test]
fn counts_without_their_conversion_are_refused() {
    let mut bad = Bad::new();
    let (head, tail) = bad.toml.split_once("[counts").expect("conversions");
    let rest = tail.find("\n[sensor]").expect("a sensor");
    bad.toml = format!("{head}{}", &tail[rest + 1..]);
    bad.calibrate().with(2).telling(&[
        "small.toml, line",
        "= \"counts\" and no conversion",
        "[counts]",
        "data sheet",
    ]);
}

#[test]
fn extra_columns_are_reported_and_change_nothing() {
    let mut bad = Bad::new();
    for (index, row) in bad.rows.iter_mut().enumerate() {
        row.push(if index == 0 { "note".into() } else { "x y".into() });
    }
    bad.calibrate().with(0).telling(&["warning", "small.csv, line 1, column `note`", "not used"]);
    assert_as_clean(&bad, &ALL);
}

#[test]
fn a_recording_without_any_sensor_has_nothing_to_calibrate() {
    let mut bad = Bad::new();
    bad.rows.iter_mut().for_each(|row| row.truncate(1));
    bad.calibrate().with(1).telling(&[
        "small.csv",
        "no sensor columns",
        "acc_x",
        "nothing can be calibrated",
    ]);
}

/// The gyroscope in °/s; nothing that says so.
fn in_degrees(bad: &mut Bad) {
    for (axis, offset) in [32_768.0; 3].into_iter().enumerate() {
        bad.map(GYR + axis, |raw| ((raw - offset) / 4778.0f64).to_degrees());
    }
}

#[test]
fn degrees_per_second_read_as_radians_are_named() {
    for unit in ["gyr = \"rad/s\"\n", ""] {
        let mut bad = Bad::new();
        in_degrees(&mut bad);
        bad.manifest("gyr = \"counts\"\n", unit);
        let ended = bad.calibrate();
        let gyr = &bad.json()["sensors"]["gyr"];
        assert_eq!(
            (&gyr["status"], &gyr["reason"]),
            (&"refused".into(), &"implausible".into()),
            "{ended:#?}"
        );
        let advice = gyr["advice"].as_str().expect("text");
        for part in ["gyr.unit_error", "180/π", "write gyr = \"deg/s\" below [units]"] {
            assert!(advice.contains(part), "{part}: {advice}");
        }
        let warnings = bad.json()["warnings"].to_string();
        let assumed = warnings.contains("assumed: gyr = \\\"rad/s\\\"");
        assert_eq!(assumed, unit.is_empty(), "{warnings}");
        // What is said on the terminal is in the file.
        assert_eq!(assumed, ended.err.contains("assumed: gyr"), "{}", ended.err);
    }
}

#[test]
fn radians_per_second_read_as_degrees_are_named() {
    let mut bad = Bad::new();
    (0..3).for_each(|axis| bad.map(GYR + axis, |raw| (raw - 32_768.0) / 4778.0));
    bad.manifest("gyr = \"counts\"", "gyr = \"deg/s\"");
    bad.calibrate();
    let gyr = &bad.json()["sensors"]["gyr"];
    let advice = gyr["advice"].as_str().expect("refused");
    assert!(advice.contains("write gyr = \"rad/s\" below [units]"), "{gyr}");
}

#[test]
fn a_diagnosis_of_degrees_read_as_radians_blames_no_encoders() {
    let mut bad = Bad::new();
    in_degrees(&mut bad);
    bad.manifest("gyr = \"counts\"", "gyr = \"rad/s\"");
    bad.calibrate();
    let ended = bad.diagnose();
    assert!(!ended.out.contains("encoder") && ended.out.contains("gyr.unit_error"), "{ended:#?}");
    assert!(ended.out.contains("gyr = \"deg/s\""), "{ended:#?}");
}

#[test]
fn nanoseconds_declared_microseconds_are_refused() {
    let mut bad = Bad::new();
    // Seconds since 1970, as a logger stamps them.
    bad.map(TIME, |t| ((1.75e9 + t) * 1e9).round());
    bad.manifest("t = \"s\"", "t = \"us\"");
    bad.calibrate().with(2).telling(&["small.csv, from line 2 on, column `t`", "t = \"ns\""]);
    bad.manifest("t = \"us\"", "t = \"ns\"");
    bad.calibrate().with(0);
    assert_as_clean(&bad, &ALL);
}

#[test]
fn a_gain_that_a_wrong_range_explains_is_remarked() {
    let mut bad = Bad::new();
    // Half of the counts a radian per second really gives: the sensor's full scale is twice what was assumed.
    bad.manifest("per_unit = 4778.0", "per_unit = 2480.0");
    bad.calibrate().with(0).printing(&[
        "gyr: its gain is 0.5",
        "one over two: another full scale",
        "[counts]",
    ]);
}

/// Gives every row further fields, the header's first.
fn with(bad: &mut Bad, names: &[&str], field: impl Fn(usize) -> String) {
    for (index, row) in bad.rows.iter_mut().enumerate() {
        for (column, name) in names.iter().enumerate() {
            row.push(if index == 0 { (*name).into() } else { field(column) });
        }
    }
}

#[test]
fn a_part_of_a_reference_or_of_a_simulator_s_sensor_is_named_with_the_rest() {
    for (names, missing) in [
        (["ref_px", "ref_pz"], "`ref_py`"),
        (["sim_acc_x", "sim_acc_y"], "`sim_acc_z`"),
        (["sim_gyr_z", "sim_gyr_y"], "`sim_gyr_x`"),
    ] {
        let mut bad = Bad::new();
        with(&mut bad, &names, |_| "0".into());
        bad.calibrate().with(2).telling(&["small.csv, line 1", missing, "is missing", "add the column"]);
    }
}

#[test]
fn misspelt_columns_of_a_reference_and_of_a_simulator_are_reported() {
    let mut bad = Bad::new();
    with(&mut bad, &["ref_p_x", "ref_py", "ref_pz", "sim_accx", "sim_acc_y", "sim_acc_z"], |_| "0".into());
    bad.calibrate().with(2).telling(&[
        "small.csv, line 1",
        "`ref_p_x` for `ref_px`, `sim_accx` for `sim_acc_x`",
        "rename them",
    ]);
}

#[test]
fn text_in_a_simulator_s_column_names_line_and_column() {
    let names = ["sim_mag_x", "sim_mag_y", "sim_mag_z", "sim_temp"];
    let mut bad = Bad::new();
    with(&mut bad, &names, |_| String::new());
    bad.line(7)[11] = "north".into();
    bad.calibrate().with(2).telling(&["small.csv, line 7, column `sim_mag_y`", "`north`", "a number"]);
}

#[test]
fn what_a_simulator_says_and_a_position_alone_change_no_calibration() {
    let mut bad = Bad::new();
    with(&mut bad, &["sim_acc_x", "sim_acc_y", "sim_acc_z"], |axis| ["", "0", "-9.8"][axis].into());
    with(&mut bad, &["ref_px", "ref_py", "ref_pz"], |axis| ["1", "inf", ""][axis].into());
    bad.calibrate().with(0).telling(&["column `ref_px`", "without an attitude", "not used"]);
    assert_as_clean(&bad, &ALL);
}

#[test]
fn a_simulator_s_file_has_nothing_to_calibrate() {
    let mut bad = Bad::new();
    for (column, name) in bad.line(1).iter_mut().enumerate().skip(ACC) {
        *name = format!("sim_{}", ["acc", "gyr", "mag"][(column - 1) / 3]) + &name[3..];
    }
    bad.calibrate().with(1).telling(&[
        "small.csv",
        "a simulator's columns",
        "nothing can be calibrated",
        "--sim",
    ]);
}
