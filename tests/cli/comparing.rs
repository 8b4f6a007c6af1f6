//! `imucal compare` and `imucal check`: two calibrations of one unit.

use imucal_tests::simulated;

use super::Folder;

/// The calibration with the first bias of a sensor so many counts off.
fn moved(folder: &Folder, sensor: &str, counts: f64) -> String {
    let text = folder.text("cal.toml");
    let at = text.find(&format!("[{sensor}]")).expect("a sensor");
    let line = text[at..].lines().find(|line| line.starts_with("bias = [")).expect("a bias");
    let first = line["bias = [".len()..].split(',').next().expect("three");
    let changed: f64 = first.trim().parse::<f64>().expect("a number") + counts;
    let other = line.replacen(first, &format!("{changed:?}"), 1);
    format!("{}{}", &text[..at], text[at..].replacen(line, &other, 1))
}

#[test]
fn a_calibration_compared_with_itself_has_not_moved_and_a_changed_one_has() {
    let folder = Folder::with_calibration();
    folder.run("compare cal.toml cal.bin --json same.json").with(0).printing(&[
        "accelerometer: no parameter has moved",
        "0 days",
        "+0.0",
    ]);
    let json: serde_json::Value = serde_json::from_str(&folder.text("same.json")).expect("JSON");
    assert_eq!(json["format"], "imucal-compare/1");
    assert_eq!(json["sensors"].as_array().map(Vec::len), Some(3));

    folder.write("later.toml", moved(&folder, "gyr", 100.0));
    folder
        .run("compare cal.toml later.toml")
        .with(0)
        .printing(&["gyroscope: moved beyond chance: bias_x", "°/s"]);
}

#[test]
fn calibrations_of_two_units_are_compared_only_on_request() {
    let folder = Folder::with_calibration();
    folder.write("other.toml", folder.text("cal.toml").replace("serial = \"", "serial = \"X"));
    folder.run("compare cal.toml other.toml").with(1).telling(&["serials", "--other-serial"]);
    folder.run("compare cal.toml other.toml --other-serial").with(0);
}

#[test]
fn a_calibration_still_fits_another_recording_of_its_unit_and_a_moved_one_does_not() {
    let folder = Folder::with_calibration();
    let other = simulated::tumbled(simulated::RESTS, 77);
    other.write(&folder.path("other.csv")).expect("room");
    folder
        .run("check other.csv --calibration cal.toml --json check.json")
        .with(0)
        .printing(&["accelerometer: the calibration still fits", "gyroscope: the calibration still fits"]);
    assert!(folder.text("check.json").contains("imucal-compare/1"));

    folder.write("moved.toml", moved(&folder, "acc", 100.0));
    folder.run("check other.csv --calibration moved.toml").with(1).printing(&[
        "accelerometer: the calibration no longer fits",
        "gyroscope: the calibration still fits",
        "moved beyond chance: bias_x",
    ]);
}

#[test]
fn what_is_not_compared_is_never_said_to_fit() {
    let folder = Folder::with_calibration();
    let other = simulated::tumbled(simulated::RESTS, 77);
    other.write(&folder.path("other.csv")).expect("room");
    // Six parameters: the fit to the other recording leaves the angles between the axes, as that of the first did.
    folder.run("calibrate other.csv --model acc=T6 --accept-suspect --out six.toml").with(0);
    let checked = folder.run("check other.csv --calibration six.toml");
    assert!(!checked.out.contains("accelerometer: the calibration still fits"), "{}", checked.out);
    assert!(checked.out.contains("accelerometer: not checked; its fit to this recording is suspect"));

    let mut text = String::new();
    for line in folder.text("cal.toml").lines() {
        let unknown = match line.split(" = ").next() {
            Some("gain_std") => "gain_std = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]",
            Some("bias_std") => "bias_std = [0.0, 0.0, 0.0]",
            _ => line,
        };
        text += &format!("{unknown}\n");
    }
    folder.write("unknown.toml", text);
    folder
        .run("check other.csv --calibration unknown.toml")
        .with(1)
        .printing(&["accelerometer: not checked; one calibration states no standard errors"])
        .telling(&["nothing is checked"]);
}

#[test]
fn a_recording_that_calibrates_nothing_checks_nothing() {
    let folder = Folder::with_calibration();
    let few = simulated::tumbled(2, 5);
    few.write(&folder.path("few.csv")).expect("room");
    folder
        .run("check few.csv --calibration cal.toml")
        .with(1)
        .printing(&["accelerometer: not checked; this recording does not calibrate it"])
        .telling(&["nothing is checked"]);
}

#[test]
fn a_calibration_of_corrected_values_is_composed_upon_the_one_that_corrected_them() {
    let folder = Folder::with_calibration();
    let other = simulated::tumbled(simulated::RESTS, 77);
    other.write(&folder.path("other.csv")).expect("room");
    // The device corrects by a calibration that is off; what it puts out is calibrated again.
    folder.write("off.toml", moved(&folder, "acc", 100.0));
    folder.run("apply other.csv --calibration off.toml --out corrected.csv").with(0);
    folder.run("calibrate corrected.csv --out second.toml --no-temperature").with(0);
    folder
        .run("compose off.toml second.toml --out both.toml --record both.bin")
        .with(0)
        .printing(&["both.toml: both as one calibration of raw values"]);
    folder.run("check other.csv --calibration off.toml").with(1);
    folder.run("check other.csv --calibration both.toml").with(0);
    folder.run("compare both.toml both.bin").with(0).printing(&["accelerometer: no parameter has moved"]);

    // Raw values are not what the first calibration puts out.
    folder.run("compose off.toml cal.toml --out wrong.toml").with(1).telling(&["counts", "expected m/s^2"]);
    assert!(!folder.path("wrong.toml").exists());
    folder.run("compose off.toml second.toml").with(2).telling(&["--out"]);
}
