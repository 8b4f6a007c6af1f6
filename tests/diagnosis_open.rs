//! Recordings by an independent simulator whose effects are known: the diagnosis names them, and no others.

use std::sync::OnceLock;

use imucal_host::{
    diagnosis::{Diagnosis, Options, Verdict, diagnose},
    recording::Recording,
};
use imucal_tests::data;
use serde_json::Value;

/// Each is made once.
static DIAGNOSES: [OnceLock<Diagnosis>; 12] = [const { OnceLock::new() }; 12];

/// A recording's diagnosis and its label; `None` without the data.
fn open(number: usize) -> Option<(&'static Diagnosis, Value)> {
    let folder = data::folder()?.join("blind");
    let label =
        std::fs::read_to_string(folder.join(format!("open-{number:02}.label.json"))).expect("a label");
    let diagnosis = DIAGNOSES[number - 1].get_or_init(|| {
        let path = folder.join(format!("open-{number:02}.csv.gz"));
        diagnose(&Recording::read(&path).expect("a good recording"), &Options::default(), &|_| ())
    });
    Some((diagnosis, serde_json::from_str(&label).expect("JSON")))
}

fn names(diagnosis: &Diagnosis) -> Vec<&str> {
    let mut names: Vec<&str> = diagnosis.causes.iter().map(|cause| cause.effect.as_str()).collect();
    names.sort_unstable();
    names
}

/// A fitted parameter and its standard error.
fn amount(diagnosis: &Diagnosis, effect: &str, parameter: &str) -> (f64, f64) {
    let cause = diagnosis.causes.iter().find(|cause| cause.effect == effect).expect("it is named");
    let amount = cause.parameters.iter().find(|amount| amount.name == parameter).expect("of the catalogue");
    (amount.value.expect("finite"), amount.std_error.expect("it was estimated"))
}

#[test]
fn the_effects_of_the_labelled_recordings_are_named_and_no_others() {
    for number in 1..=12 {
        let Some((diagnosis, label)) = open(number) else { return };
        let effects = label["effects"].as_object().expect("a map");
        let found = names(diagnosis);
        if effects.contains_key("outside the catalogue") {
            let honest = matches!(diagnosis.verdict, Verdict::Unknown | Verdict::Partly);
            assert!(honest && found.is_empty(), "{number}: {:?} {found:?}", diagnosis.verdict);
            println!("{number:>2} {:?} {found:?}", diagnosis.verdict);
            continue;
        }
        let mut expected: Vec<&str> = effects.keys().map(String::as_str).collect();
        expected.sort_unstable();
        assert_eq!(found, expected, "{number}: {:?}", diagnosis.verdict);
        let verdict = if expected.is_empty() { Verdict::None } else { Verdict::Explained };
        assert_eq!(diagnosis.verdict, verdict, "{number}");
        println!("{number:>2} {verdict:?} {found:?}");
        for cause in &diagnosis.causes {
            assert!(diagnosis.credible_set.contains(&cause.effect), "{number}");
        }
        if let Some(closed) = diagnosis.gap_closed_total {
            assert!(closed > 0.9, "{number}: {closed}");
        }
    }
    println!("labelled recordings answered as labelled: {0} of {0}", DIAGNOSES.len());
}

#[test]
fn the_size_of_what_is_named_is_that_of_the_label() {
    let Some((outer, label)) = open(2) else { return };
    let truth = label["effects"]["mag.gimbal_hard_iron_outer"].as_array().expect("a vector");
    // Along the outer axis it is the field's own vertical part, which the sensor's K shares in.
    for (axis, name) in ["x", "y"].iter().enumerate() {
        let (value, error) = amount(outer, "mag.gimbal_hard_iron_outer", name);
        let truth = truth[axis].as_f64().expect("a number");
        assert!((value - truth).abs() < 4.0 * error, "{name}: {value} ± {error}, {truth}");
        assert!(error < 0.02, "{name}: ± {error}");
    }
    let Some((late, label)) = open(6) else { return };
    let truth = label["effects"]["clk.time_offset"].as_f64().expect("a number");
    let (value, _) = amount(late, "clk.time_offset", "offset");
    assert!((value - truth).abs() < 1e-4, "{value} against {truth}");
}

#[test]
fn a_gap_outside_of_the_catalogue_is_located_though_not_named() {
    let Some((diagnosis, _)) = open(11) else { return };
    let place = diagnosis.places.first().expect("it lies somewhere");
    assert_eq!((place.sensor.as_str(), place.driver.as_str()), ("gyr", "gimbal_inner"));
    assert!(place.detail.contains("third harmonic"), "{}", place.detail);
}

#[test]
fn a_term_taken_out_of_the_baseline_is_named() {
    let Some(folder) = data::folder() else { return };
    let recording = Recording::read(&folder.join("blind/open-01.csv.gz")).expect("a good recording");
    for term in ["acc.misalignment", "gyr.scale", "mag.bias"] {
        let options = Options { without: vec![term.to_owned()], ..Default::default() };
        let diagnosis = diagnose(&recording, &options, &|_| ());
        assert_eq!(names(&diagnosis), [term]);
        assert!(diagnosis.gap_closed_total.expect("a cause") > 0.99);
    }
}

/// Those that are diagnosed here, of the twelve.
const ASKED: usize = 3;

#[test]
fn recordings_without_a_label_are_answered_as_they_were() {
    let Some(folder) = data::folder() else { return };
    let answers: Value = serde_json::from_str(include_str!("sealed-answers.json")).expect("JSON");
    let answers = answers.as_object().expect("a map");
    assert_eq!(answers.len(), 12);
    for (name, answer) in answers.iter().step_by(answers.len() / ASKED) {
        let path = folder.join("blind").join(format!("{name}.csv.gz"));
        let recording = Recording::read(&path).expect("a good recording");
        let diagnosis = diagnose(&recording, &Options::default(), &|_| ());
        let causes = answer["causes"].as_array().expect("causes");
        let expected: Vec<&str> = causes.iter().filter_map(|cause| cause["effect"].as_str()).collect();
        assert_eq!(names(&diagnosis), expected, "{name}");
        assert_eq!(serde_json::to_value(diagnosis.verdict).expect("JSON"), answer["verdict"], "{name}");
    }
}
