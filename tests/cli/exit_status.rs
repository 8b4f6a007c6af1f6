//! 0 done, 1 read but refused, 2 bad usage or unreadable input.

use imucal_tests::data;
use imucal_tests::program::Ended;

use super::{Folder, imucal};

/// Calibrates a real recording; nothing where the data are not there.
fn real(file: &str, options: &[&str]) -> Option<Ended> {
    let path = data::real(file)?;
    let mut arguments = vec!["calibrate", path.to_str().expect("a plain path")];
    arguments.extend(options);
    Some(imucal(&arguments))
}

#[test]
fn an_accepted_calibration_ends_with_0() {
    let folder = Folder::with_recording();
    let ended = folder.run("calibrate small.csv").with(0);
    ended.printing(&[
        "accelerometer (T9): accepted",
        "gyroscope (K9): accepted",
        "magnetometer (E9): accepted",
    ]);
    imucal(&["calibrate", folder.path("small.csv").to_str().unwrap(), "--model", "acc=T9,gyr=K9,mag=E9"])
        .with(0);
}

#[test]
fn rests_that_do_not_determine_nine_parameters_end_with_1() {
    let Some(ended) = real("mpu6050-unobservable.csv.gz", &[]) else { return };
    ended.with(1).printing(&["accelerometer (T9): REFUSED, ill-conditioned", "because:", "to do:"]);
}

#[test]
fn six_faces_end_with_1_for_nine_parameters_and_with_0_for_six() {
    let Some(ended) = real("imucal-ferraris.csv.gz", &[]) else { return };
    ended.with(1).printing(&["REFUSED, not-redundant", "--model acc=T6"]);
    for (model, status) in [("acc=T9", 1), ("acc=T6", 0)] {
        real("imucal-ferraris.csv.gz", &["--model", model]).expect("the data are there").with(status);
    }
}

#[test]
fn a_refused_sensor_matters_only_where_it_was_named() {
    let Some(ended) = real("broad-01-undisturbed.csv.gz", &[]) else { return };
    ended.with(0).printing(&["accelerometer (T9): REFUSED", "magnetometer (M15): accepted"]);
    let named = real("broad-01-undisturbed.csv.gz", &["--model", "acc=T9"]).expect("the data are there");
    named.with(1).printing(&["magnetometer (M15): accepted"]);
}

#[test]
fn a_sensor_that_is_named_but_not_recorded_ends_with_2() {
    let Some(ended) = real("px4-mag.csv", &["--model", "acc=T9"]) else { return };
    ended.with(2).telling(&["px4-mag.csv", "names acc", "acc_x, acc_y, acc_z", "leave it out"]);
}

#[test]
fn bad_usage_ends_with_2() {
    let folder = Folder::with_recording();
    for (line, part) in [
        ("", "Usage"),
        ("calibrate", "<RECORDING>"),
        ("callibrate small.csv", "similar subcommand"),
        ("calibrate small.csv --outt x.toml", "--out"),
        ("calibrate small.csv --model acc=T99", "expected acc=T9 or acc=T6, on a rig acc="),
        ("calibrate small.csv --model acc=T9,acc=T6", "acc"),
        ("calibrate small.csv --threshold 0", "above 0"),
        ("apply small.csv", "--calibration"),
        ("verify small.csv", "--calibration"),
        ("inspect", "<CALIBRATION>"),
    ] {
        let words =
            folder.arguments(line).iter().map(|w| w.to_string_lossy().into_owned()).collect::<Vec<_>>();
        imucal(&words).with(2).telling(&[part]);
    }
}

#[test]
fn help_and_version_end_with_0() {
    for line in [&["--help"][..], &["--version"], &["calibrate", "--help"], &["apply", "--help"]] {
        assert_eq!(imucal(line).with(0).err, "");
    }
}

#[test]
fn what_cannot_be_read_ends_with_2() {
    let folder = Folder::with_calibration();
    folder.run("calibrate none.csv").with(2).telling(&["none.csv", "no such file", "check the path"]);
    folder.run("inspect none.bin").with(2).telling(&["none.bin", "check the path"]);
    folder.run("apply small.csv --calibration none.bin --out out.csv").with(2).telling(&["none.bin"]);
    folder.run("apply none.csv --calibration cal.bin --out out.csv").with(2).telling(&["none.csv"]);
    folder.run("verify none.csv --calibration cal.bin").with(2).telling(&["none.csv"]);
    folder.run("calibrate small.toml").with(2).telling(&["small.toml", "give the samples file"]);
    assert!(!folder.path("out.csv").exists());
}

#[test]
fn what_only_a_device_has_needs_one() {
    let folder = Folder::with_calibration();
    for option in ["--flash unit.flash", "--key unit.key"] {
        folder
            .run(&format!("verify small.csv --calibration cal.bin {option}"))
            .with(2)
            .telling(&["--device"]);
    }
}

#[test]
fn a_gyroscope_alone_is_refused_for_what_is_missing() {
    let folder = Folder::with_calibration();
    let rate = |k: u32| (0.01 * f64::from(k)).sin();
    let rows = (0..3000).map(|k| {
        format!("{:.2},{:.5},{:.5},{:.5}\n", 0.01 * f64::from(k), rate(k), rate(2 * k), rate(3 * k))
    });
    folder.write("gyr.csv", "t,gyr_x,gyr_y,gyr_z\n".to_owned() + &rows.collect::<String>());
    folder.write("gyr.toml", "format = \"imucal-recording/1\"\n[units]\ngyr = \"rad/s\"\n");
    let said = ["0 observations, 8 needed", "how far the gyroscope turned", "record the accelerometer"];
    folder.run("calibrate gyr.csv").with(1).printing(&said);
}
