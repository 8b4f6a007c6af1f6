//! A robot's recordings with its simulator's streams, both by an independent simulator whose effects are known: the
//! diagnosis names them with their sizes, and no others.

use std::{path::PathBuf, sync::OnceLock};

use imucal_host::{
    diagnosis::{Diagnosis, Options, Verdict, diagnose, finding::Amount},
    recording::{Recording, Stream},
};
use imucal_tests::data;
use serde_json::Value;

/// Labelled pairs, and of these at least so many are answered as they are labelled.
const PAIRS: usize = 10;
const RIGHT: usize = 9;

/// Each is made once.
static DIAGNOSES: [OnceLock<Diagnosis>; PAIRS] = [const { OnceLock::new() }; PAIRS];

fn folder() -> Option<PathBuf> {
    Some(data::folder()?.join("robot"))
}

/// A recording and its simulator's stream; `None` without the data.
fn pair(name: &str) -> Option<(Recording, Stream)> {
    let read = |path: String| Some(Recording::read(&folder()?.join(path)).expect("a good recording"));
    let (real, simulated) = (read(format!("{name}-real.csv.gz"))?, read(format!("{name}-sim.csv.gz"))?);
    let stream = Stream::of_pair(&simulated, &real).expect("a stream");
    Some((real, stream))
}

fn diagnosed((real, stream): (Recording, Stream)) -> Diagnosis {
    diagnose(&real, &Options { stream: Some(stream), ..Options::default() }, &|_| ())
}

/// The diagnosis of a labelled pair and its label; `None` without the data.
fn open(number: usize) -> Option<(&'static Diagnosis, Value)> {
    let name = format!("open-{number:02}");
    let label = std::fs::read_to_string(folder()?.join(format!("{name}.label.json"))).expect("a label");
    let made = pair(&name)?;
    let diagnosis = DIAGNOSES[number - 1].get_or_init(|| diagnosed(made));
    Some((diagnosis, serde_json::from_str(&label).expect("JSON")))
}

fn names(diagnosis: &Diagnosis) -> Vec<&str> {
    let mut names: Vec<&str> = diagnosis.causes.iter().map(|cause| cause.effect.as_str()).collect();
    names.sort_unstable();
    names
}

fn amount<'d>(diagnosis: &'d Diagnosis, effect: &str, parameter: &str) -> Option<&'d Amount> {
    let cause = diagnosis.causes.iter().find(|cause| cause.effect == effect)?;
    cause.parameters.iter().find(|amount| amount.name == parameter)
}

/// The truth and nothing else; an effect of no catalogue is called unknown and nothing is asserted.
fn is_right(diagnosis: &Diagnosis, label: &Value) -> bool {
    let effects = label["effects"].as_object().expect("a map");
    let (outside, inside): (Vec<&str>, Vec<&str>) =
        effects.keys().map(String::as_str).partition(|id| id.starts_with("x."));
    let verdict = match (outside.len(), inside.len()) {
        (0, 0) => Verdict::None,
        (0, _) => Verdict::Explained,
        (_, 0) => Verdict::Unknown,
        _ => Verdict::Partly,
    };
    let mut expected = inside;
    expected.sort_unstable();
    names(diagnosis) == expected && diagnosis.verdict == verdict
}

#[test]
fn nine_of_ten_labelled_pairs_are_answered_as_labelled() {
    let mut right = 0;
    for number in 1..=PAIRS {
        let Some((diagnosis, label)) = open(number) else { return };
        let is_right = is_right(diagnosis, &label);
        right += usize::from(is_right);
        println!("{number:>2} {:?} {:?} {is_right}", diagnosis.verdict, names(diagnosis));
    }
    assert!(right >= RIGHT, "{right} of {PAIRS}");
}

#[test]
fn clocks_are_reported_within_three_standard_errors() {
    let mut clocks = 0;
    for number in 1..=PAIRS {
        let Some((diagnosis, label)) = open(number) else { return };
        let effects = label["effects"].as_object().expect("a map");
        // The labels count the simulator's world by t · (1 + error), the catalogue by t / (1 + error).
        for (effect, parameter, sign) in
            [("clk.time_offset", "offset", 1.0), ("clk.rate_error", "error", -1.0)]
        {
            let Some(truth) = effects.get(effect).and_then(Value::as_f64) else { continue };
            clocks += 1;
            let found = amount(diagnosis, effect, parameter).expect("it is named");
            let (value, error) = (found.value.expect("known"), found.std_error.expect("known"));
            assert!((value - sign * truth).abs() < 3.0 * error, "{number}: {value} ± {error}, {truth}");
        }
    }
    assert_eq!(clocks, 3);
}

#[test]
fn stretches_in_which_the_machine_moved_otherwise_are_found_with_their_ends() {
    let Some((diagnosis, label)) = open(5) else { return };
    let edges = label["effects"]["ref.motion_mismatch"]["edges"].as_array().expect("stretches");
    for (at, edge) in edges.iter().enumerate() {
        let suffix = if at == 0 { String::new() } else { format!("_{}", at + 1) };
        for (name, truth) in [("t_start", &edge[0]), ("t_end", &edge[1])] {
            let found = amount(diagnosis, "ref.motion_mismatch", &format!("{name}{suffix}"));
            let value = found.expect("as many stretches as there are").value.expect("known");
            assert!((value - truth.as_f64().expect("s")).abs() < 1.5, "{name}{suffix}: {value}, {truth}");
        }
    }
    assert!(amount(diagnosis, "ref.motion_mismatch", "t_start_4").is_none());
}

#[test]
fn a_delay_that_is_put_in_is_reported_with_its_sign_and_size() {
    let own_of_02 = -0.034_810_7;
    for (name, own, delay) in [
        ("open-01", 0.0, -0.05),
        ("open-01", 0.0, 0.002),
        ("open-07", 0.0, 0.02),
        ("open-02", own_of_02, 0.05),
    ] {
        let Some((real, mut stream)) = pair(name) else { return };
        // The row of t then shows the stream of t + delay.
        stream.time.iter_mut().for_each(|time| *time += delay);
        let diagnosis = diagnosed((real, stream));
        let truth: f64 = own + delay;
        let found = amount(&diagnosis, "clk.time_offset", "offset");
        let found = found.unwrap_or_else(|| panic!("{name}, {delay}: {:?}", names(&diagnosis)));
        let (value, error) = (found.value.expect("known"), found.std_error.expect("known"));
        assert!((value - truth).abs() < 3.0 * error.max(3e-5), "{name}, {delay}: {value} ± {error}");
        assert_eq!(names(&diagnosis), ["clk.time_offset"], "{name}, {delay}");
    }
}

/// Those that are diagnosed here, of the twelve.
const ASKED: usize = 3;

#[test]
fn pairs_without_a_label_are_answered_as_they_were() {
    let answers: Value = serde_json::from_str(include_str!("sealed-robot-answers.json")).expect("JSON");
    let answers = answers.as_object().expect("a map");
    assert_eq!(answers.len(), 12);
    for (name, answer) in answers.iter().step_by(answers.len() / ASKED) {
        let Some(made) = pair(name) else { return };
        let diagnosis = diagnosed(made);
        let causes = answer["causes"].as_array().expect("causes");
        let mut expected: Vec<&str> = causes.iter().filter_map(|cause| cause["effect"].as_str()).collect();
        expected.sort_unstable();
        assert_eq!(names(&diagnosis), expected, "{name}");
        assert_eq!(serde_json::to_value(diagnosis.verdict).expect("JSON"), answer["verdict"], "{name}");
    }
}
