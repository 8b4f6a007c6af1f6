//! Keys, types and exit status that scripts rely on.

use imucal_host::effect;
use serde_json::Value;

use super::{Folder, afflicted, causes, rates, without_rig};

const VERDICTS: [&str; 6] = ["explained", "ambiguous", "partly", "unknown", "none", "not-testable"];

/// Paths of all keys with the types of their values; of a list, all its entries'.
fn structure(value: &Value, path: &str, lines: &mut Vec<String>) {
    match value {
        Value::Object(fields) => {
            fields.iter().for_each(|(key, value)| structure(value, &format!("{path}.{key}"), lines));
        }
        Value::Array(entries) => {
            lines.push(format!("{path}: list"));
            entries.iter().for_each(|entry| structure(entry, &format!("{path}[]"), lines));
        }
        Value::Null => lines.push(format!("{path}: null")),
        Value::Bool(_) => lines.push(format!("{path}: boolean")),
        Value::Number(_) => lines.push(format!("{path}: number")),
        Value::String(_) => lines.push(format!("{path}: text")),
    }
}

/// What the contract allows at each path.
const CONTRACT: [&str; 54] = [
    ".absent: list",
    ".absent[].effect: text",
    ".absent[].minimum_detectable: number",
    ".absent[].unit: text",
    ".causes: list",
    ".causes[].effect: text",
    ".causes[].equivalents: list",
    ".causes[].equivalents[]: text",
    ".causes[].gap_closed: null",
    ".causes[].gap_closed: number",
    ".causes[].gap_closed_ci95: list",
    ".causes[].gap_closed_ci95: null",
    ".causes[].gap_closed_ci95[]: null",
    ".causes[].gap_closed_ci95[]: number",
    ".causes[].material: boolean",
    ".causes[].parameters: list",
    ".causes[].parameters[].name: text",
    ".causes[].parameters[].std_error: null",
    ".causes[].parameters[].std_error: number",
    ".causes[].parameters[].unit: text",
    ".causes[].parameters[].value: null",
    ".causes[].parameters[].value: number",
    ".causes[].probability: number",
    ".credible_set: list",
    ".credible_set[]: text",
    ".format: text",
    ".gap: list",
    ".gap[].axis: text",
    ".gap[].noise_floor: number",
    ".gap[].rms_after: number",
    ".gap[].rms_before: number",
    ".gap[].sensor: text",
    ".gap[].unit: text",
    ".gap_closed_total: null",
    ".gap_closed_total: number",
    ".gap_closed_total_ci95: list",
    ".gap_closed_total_ci95: null",
    ".gap_closed_total_ci95[]: number",
    ".held_out: boolean",
    ".next_experiment: list",
    ".next_experiment[].distinguishability_from: number",
    ".next_experiment[].do: text",
    ".next_experiment[].separates: list",
    ".next_experiment[].separates[]: text",
    ".next_experiment[].to: number",
    ".not_testable: list",
    ".not_testable[].because: text",
    ".not_testable[].effect: text",
    ".recording: text",
    ".remarks: list",
    ".remarks[]: text",
    ".verdict: text",
    ".warnings: list",
    ".where: list",
];
const PLACES: [&str; 5] = [
    ".where[].detail: text",
    ".where[].driver: text",
    ".where[].p_value: number",
    ".where[].sensor: text",
    ".where[].share: number",
];

fn assert_keeps_contract(diagnosis: &Value) {
    let mut lines = Vec::new();
    structure(diagnosis, "", &mut lines);
    for line in &lines {
        let known = CONTRACT.contains(&line.as_str()) || PLACES.contains(&line.as_str());
        assert!(known, "`{line}` is not in the contract: {diagnosis:#}");
    }
    for key in CONTRACT.iter().filter_map(|line| line[1..].split([':', '.', '[']).next()) {
        assert!(diagnosis.get(key).is_some(), "{key} is missing");
    }
    assert_eq!(diagnosis["format"], "imucal-diagnosis/1");
    assert_eq!(diagnosis["recording"], "run.csv");
    assert!(VERDICTS.iter().any(|verdict| diagnosis["verdict"] == *verdict), "{}", diagnosis["verdict"]);
    let ids = |list: &str, key: &str| -> Vec<String> {
        let entries = diagnosis[list].as_array().expect("a list");
        entries.iter().map(|entry| entry[key].as_str().expect("an id").to_owned()).collect()
    };
    for id in [ids("causes", "effect"), ids("absent", "effect"), ids("not_testable", "effect")].concat() {
        assert!(effect::find(&id).is_some(), "{id} is in no catalogue");
    }
}

#[test]
fn a_healthy_recording_has_no_cause_and_ends_with_0() {
    let diagnosis = Folder::of(rates(3).record("run.csv")).diagnosed(0);
    assert_keeps_contract(&diagnosis);
    assert_eq!(diagnosis["verdict"], "none", "{diagnosis:#}");
    assert!(causes(&diagnosis).is_empty() && diagnosis["gap_closed_total"].is_null());
    assert!(!diagnosis["absent"].as_array().unwrap().is_empty());
}

#[test]
fn a_strong_effect_is_the_cause_with_size_and_share_closed() {
    let simulation = afflicted(rates(3), "mag.gimbal_hard_iron_outer", 3.0);
    let diagnosis = Folder::of(simulation.record("run.csv")).diagnosed(0);
    assert_keeps_contract(&diagnosis);
    let asserted = causes(&diagnosis);
    let outer = |id: &&str| id.starts_with("mag.gimbal_") && id.ends_with("iron_outer");
    assert!(asserted.len() == 1 && asserted.iter().all(outer), "{diagnosis:#}");
    assert!(["explained", "ambiguous"].iter().any(|verdict| diagnosis["verdict"] == *verdict));
    assert!(diagnosis["gap_closed_total"].as_f64().is_some_and(|share| (0.8..=1.0).contains(&share)));
    assert_eq!(diagnosis["causes"][0]["material"], true);
    assert_eq!(diagnosis["where"][0]["sensor"], "mag");
}

#[test]
fn what_is_withheld_is_not_asserted() {
    let simulation = afflicted(rates(3), "gyr.g_sensitivity", 3.0);
    let folder = Folder::of(simulation.record("run.csv"));
    let line = "diagnose run.csv --json - --without gyr.g_sensitivity gyr.g2_sensitivity";
    let ended = folder.run(line).with(0);
    let diagnosis: Value = serde_json::from_str(&ended.out).expect("JSON");
    assert!(!causes(&diagnosis).contains(&"gyr.g_sensitivity"), "{diagnosis:#}");
    assert!(!diagnosis["credible_set"].as_array().unwrap().contains(&"gyr.g_sensitivity".into()));
}

#[test]
fn a_recording_that_lacks_what_the_question_needs_ends_with_1() {
    let folder = Folder::with(&rates(3), without_rig);
    let diagnosis = folder.diagnosed(1);
    assert_keeps_contract(&diagnosis);
    assert_eq!(diagnosis["verdict"], "not-testable");
}

#[test]
fn bad_usage_and_unreadable_input_end_with_2() {
    let folder = Folder::of(rates(3).record("run.csv"));
    folder.run("diagnose").with(2).telling(&["RECORDING"]);
    folder.run("diagnose none.csv").with(2).telling(&["none.csv", "there is no such file"]);
    folder.run("diagnose run.csv --without acc.lever").with(2).telling(&["acc.lever", "did you mean"]);
    folder.run("diagnose run.csv --json run.toml").with(2).telling(&["run.toml", "same name as the input"]);
}

#[test]
fn the_same_recording_gives_the_same_diagnosis() {
    let folder = Folder::of(afflicted(rates(3), "acc.lever_arm", 2.0).record("run.csv"));
    assert_eq!(folder.diagnosed(0), folder.diagnosed(0));
}
