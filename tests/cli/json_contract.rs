//! `calibrate --json`: format `imucal-calibration/1`.

use imucal_tests::data;
use serde_json::Value;

use super::{Folder, imucal};

/// The only reasons there are.
const REASONS: [&str; 9] = [
    "too-few-observations",
    "poor-coverage",
    "ill-conditioned",
    "not-redundant",
    "did-not-converge",
    "implausible",
    "no-rest",
    "no-motion",
    "not-finite",
];

fn small() -> Value {
    let folder = Folder::with_recording();
    serde_json::from_str(&folder.run("calibrate small.csv --json -").with(0).out).expect("JSON")
}

fn is_vector(value: &Value) -> bool {
    value.as_array().is_some_and(|entries| entries.len() == 3 && entries.iter().all(Value::is_f64))
}

fn is_matrix(value: &Value) -> bool {
    value.as_array().is_some_and(|rows| rows.len() == 3 && rows.iter().all(is_vector))
}

/// Whether a value has the type that the contract gives the key of a fitted sensor.
fn keeps_type(key: &str, value: &Value) -> bool {
    match key {
        "model" | "unit_in" | "unit_out" | "rms_unit" | "termination" => value.is_string(),
        "gain" | "gain_std" => is_matrix(value),
        "bias" | "bias_std" => is_vector(value),
        "observations" | "parameters" | "iterations" => value.is_u64(),
        "rms" | "condition" | "coverage" => value.is_f64(),
        "held_out_rms" => value.is_f64() || value.is_null(),
        _ => false,
    }
}

const KEYS: [&str; 16] = [
    "model",
    "gain",
    "bias",
    "gain_std",
    "bias_std",
    "unit_in",
    "unit_out",
    "observations",
    "parameters",
    "rms",
    "held_out_rms",
    "rms_unit",
    "condition",
    "coverage",
    "iterations",
    "termination",
];

#[test]
fn accepted_sensors_have_every_key_of_the_contract() {
    let json = small();
    assert_eq!(json["format"], "imucal-calibration/1");
    assert_eq!(json["recording"], "small.csv");
    for (kind, model, out, rms) in
        [("acc", "T9", "m/s^2", "m/s^2"), ("gyr", "K9", "rad/s", "rad"), ("mag", "E9", "uT", "uT")]
    {
        let sensor = &json["sensors"][kind];
        assert_eq!(sensor["status"], "accepted");
        assert!(sensor.get("reason").is_some_and(Value::is_null), "{kind}: reason");
        for key in KEYS {
            let value = sensor.get(key).unwrap_or_else(|| panic!("{kind} has no {key}"));
            assert!(keeps_type(key, value), "{kind}: {key} is {value}");
        }
        assert_eq!((&sensor["model"], &sensor["unit_in"]), (&model.into(), &"counts".into()));
        assert_eq!((&sensor["unit_out"], &sensor["rms_unit"]), (&out.into(), &rms.into()));
    }
    for key in ["tilt_x", "tilt_y", "tilt_std"] {
        assert!(json["sensors"]["acc"]["rig"].get(key).is_some(), "{key}");
    }
    for key in ["outer_hard_iron", "middle_hard_iron"] {
        assert!(json["sensors"]["mag"]["rig"].get(key).is_some(), "{key}");
    }
    let segmentation = &json["segmentation"];
    assert!(segmentation["rests"].is_u64());
    assert!(segmentation["threshold"].is_f64() && segmentation["gain_spread_over_thresholds"].is_f64());
}

/// The gain's lower triangle is zero, and so are its standard errors.
fn is_upper_triangular(sensor: &Value) -> bool {
    [(1, 0), (2, 0), (2, 1)]
        .into_iter()
        .all(|(row, column)| sensor["gain"][row][column] == 0.0 && sensor["gain_std"][row][column] == 0.0)
}

#[test]
fn gains_are_upper_triangular_alone_and_full_with_an_accelerometer() {
    let json = small();
    assert!(is_upper_triangular(&json["sensors"]["acc"]));
    assert!(!is_upper_triangular(&json["sensors"]["mag"]) && json["sensors"]["mag"]["alignment"].is_object());
    let Some(path) = data::real("px4-mag.csv") else { return };
    let ended = imucal(&["calibrate", path.to_str().unwrap(), "--json", "-"]).with(0);
    let alone: Value = serde_json::from_str(&ended.out).expect("JSON");
    assert!(is_upper_triangular(&alone["sensors"]["mag"]) && alone["sensors"]["mag"]["alignment"].is_null());
}

#[test]
fn a_magnetometer_without_a_known_field_has_determinant_one() {
    let Some(path) = data::real("px4-mag.csv") else { return };
    let ended = imucal(&["calibrate", path.to_str().unwrap(), "--json", "-"]).with(0);
    let json: Value = serde_json::from_str(&ended.out).expect("JSON");
    let mag = &json["sensors"]["mag"];
    let gain = nalgebra::Matrix3::from_fn(|i, j| mag["gain"][i][j].as_f64().expect("a number"));
    assert!((gain.determinant() - 1.0).abs() < 1e-9, "{gain}");
    assert!(mag["field_norm"].as_f64().is_some_and(|norm| norm > 0.0));
    assert_eq!((&mag["unit_in"], &mag["unit_out"]), (&"G".into(), &"G".into()));
    assert!(json["sensors"].get("acc").is_none() && json["segmentation"].is_null());
}

#[test]
fn refused_sensors_carry_a_reason_of_the_list_and_its_figures() {
    for file in [
        "mpu6050-unobservable.csv.gz",
        "imucal-ferraris.csv.gz",
        "hamagure-mag-2.csv.gz",
        "broad-01-undisturbed.csv.gz",
    ] {
        let Some(path) = data::real(file) else { return };
        let json: Value =
            serde_json::from_str(&imucal(&["calibrate", path.to_str().unwrap(), "--json", "-"]).out)
                .expect("JSON");
        let sensors = json["sensors"].as_object().expect("sensors by name");
        let refused: Vec<_> = sensors.values().filter(|sensor| sensor["status"] == "refused").collect();
        assert!(!refused.is_empty(), "{file}");
        for sensor in refused {
            let reason = sensor["reason"].as_str().expect("a reason");
            assert!(REASONS.contains(&reason), "{reason}");
            let detail = sensor["detail"].as_str().expect("a detail");
            assert!(detail.contains(|c: char| c.is_ascii_digit()), "no figure in: {detail}");
            assert!(sensor["model"].is_string() && sensor["advice"].is_string());
        }
    }
}

/// Paths of all keys with the types of their values; of a list, its first entry.
fn structure(value: &Value, path: &str, lines: &mut Vec<String>) {
    match value {
        Value::Object(fields) => {
            fields.iter().for_each(|(key, value)| structure(value, &format!("{path}.{key}"), lines));
        }
        Value::Array(entries) if !entries.is_empty() => structure(&entries[0], &format!("{path}[]"), lines),
        Value::Array(_) => lines.push(format!("{path}[]")),
        Value::Null => lines.push(format!("{path}: null")),
        Value::Bool(_) => lines.push(format!("{path}: boolean")),
        Value::Number(number) if number.is_f64() => lines.push(format!("{path}: number")),
        Value::Number(_) => lines.push(format!("{path}: integer")),
        Value::String(_) => lines.push(format!("{path}: text")),
    }
}

#[test]
fn the_structure_is_the_one_that_scripts_were_written_for() {
    let mut lines = Vec::new();
    structure(&small(), "", &mut lines);
    let found = lines.join("\n") + "\n";
    let golden = concat!(env!("CARGO_MANIFEST_DIR"), "/golden/calibration_json_structure.txt");
    let expected = std::fs::read_to_string(golden).unwrap_or_default();
    assert!(
        found == expected,
        "the structure of the JSON has changed. A key may be added: then put this into {golden}. A key that \
         changes its type or is gone needs a new format.\n{found}"
    );
}
