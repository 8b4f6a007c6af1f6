//! `imucal compare`: two calibrations of one unit.

use super::Folder;

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

    // A bias of the gyroscope that is a hundred counts off.
    let text = folder.text("cal.toml");
    let at = text.find("[gyr]").expect("a gyroscope");
    let line = text[at..].lines().find(|line| line.starts_with("bias = [")).expect("a bias").to_owned();
    let first: f64 =
        line["bias = [".len()..].split(',').next().expect("three").trim().parse().expect("a number");
    let changed = line.replacen(
        &line["bias = [".len()..line.find(',').expect("three")],
        &(first + 100.0).to_string(),
        1,
    );
    folder.write("later.toml", text.replacen(&line, &changed, 1));
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
