use std::sync::atomic::AtomicUsize;

use super::*;
use crate::diagnosis::{Verdict, finding::FORMAT};

fn nothing(recording: &Recording) -> Diagnosis {
    Diagnosis {
        format: FORMAT.to_owned(),
        recording: recording.name.clone(),
        verdict: Verdict::None,
        reference: None,
        remarks: Vec::new(),
        warnings: Vec::new(),
        gap: Vec::new(),
        places: Vec::new(),
        causes: Vec::new(),
        credible_set: Vec::new(),
        gap_closed_total: None,
        gap_closed_total_ci95: None,
        held_out: false,
        absent: Vec::new(),
        not_testable: Vec::new(),
        user_effects: Vec::new(),
        proposals: Vec::new(),
        watch: None,
        profiles: Vec::new(),
        next_experiment: Vec::new(),
    }
}

fn cases() -> Vec<Case> {
    mingled(2, 2)
}

fn names(trials: &[Finished]) -> Vec<&str> {
    trials.iter().map(|trial| trial.case.as_str()).collect()
}

fn run(folder: &Folder, jobs: usize) -> usize {
    let runs = AtomicUsize::new(0);
    let count = |recording: &Recording| {
        runs.fetch_add(1, Ordering::Relaxed);
        nothing(recording)
    };
    folder.run(&cases(), jobs, &count, &|_| ()).unwrap();
    runs.into_inner()
}

fn replace(path: &Path, from: &str, to: &str) {
    let text = fs::read_to_string(path).unwrap();
    assert!(text.contains(from));
    fs::write(path, text.replacen(from, to, 1)).unwrap();
}

#[test]
fn a_set_goes_on_where_it_was_interrupted_and_ends_as_if_it_had_not_been() {
    let place = tempfile::tempdir().unwrap();
    let folder = Folder::open(place.path(), Nonce::parse("1a")).unwrap();
    assert_eq!(run(&folder, 2), 4);
    let whole = folder.finished().unwrap();
    assert_eq!(names(&whole), ["afflicted-0000", "afflicted-0001", "healthy-0000", "healthy-0001"]);
    assert_eq!(run(&folder, 2), 0);
    // Killed in the middle of the last line.
    let answers = place.path().join("answers.jsonl");
    let bytes = fs::read(&answers).unwrap();
    fs::write(&answers, &bytes[..bytes.len() - 20]).unwrap();
    let again = Folder::open(place.path(), None).unwrap();
    assert_eq!(again.finished().unwrap().len(), 3);
    assert_eq!(run(&again, 1), 1);
    let labels = |trials: &[Finished]| trials.iter().map(|trial| trial.label.clone()).collect::<Vec<_>>();
    assert_eq!(labels(&again.finished().unwrap()), labels(&whole));
}

#[test]
fn a_label_that_was_altered_after_sealing_is_found() {
    let place = tempfile::tempdir().unwrap();
    let folder = Folder::open(place.path(), Nonce::parse("1b")).unwrap();
    folder.run(&cases()[..1], 1, &nothing, &|_| ()).unwrap();
    replace(&place.path().join("answers.jsonl"), "imucal-blind-label/1", "imucal-blind-label/2");
    assert!(matches!(folder.finished(), Err(TrialError::Broken { .. })));
    fs::write(place.path().join("seals.jsonl"), "").unwrap();
    assert!(matches!(folder.finished(), Err(TrialError::Unsealed { .. })));
}

#[test]
fn a_label_is_sealed_before_its_recording_is_diagnosed() {
    let place = tempfile::tempdir().unwrap();
    let folder = Folder::open(place.path(), None).unwrap();
    let look = |recording: &Recording| {
        let seals = fs::read_to_string(place.path().join("seals.jsonl")).unwrap();
        assert!(seals.contains(recording.name.trim_end_matches(".csv")));
        assert!(!seals.contains("parameters"));
        nothing(recording)
    };
    folder.run(&cases()[..1], 1, &look, &|_| ()).unwrap();
    assert_eq!(folder.finished().unwrap()[0].answer.verdict, Some(Verdict::None));
}

#[test]
fn a_diagnosis_that_panics_fails_its_trial_and_not_the_set() {
    let place = tempfile::tempdir().unwrap();
    let folder = Folder::open(place.path(), Nonce::parse("1c")).unwrap();
    folder.run(&cases()[..2], 1, &|_| panic!("a defect"), &|_| ()).unwrap();
    assert!(folder.finished().unwrap().iter().all(|trial| trial.answer.verdict.is_none()));
}

#[test]
fn a_folder_keeps_to_its_nonce_and_a_damaged_line_is_named() {
    let place = tempfile::tempdir().unwrap();
    let folder = Folder::open(place.path(), Nonce::parse("1d")).unwrap();
    assert_eq!(Folder::open(place.path(), None).unwrap().nonce(), folder.nonce());
    let other = Folder::open(place.path(), Nonce::parse("1e"));
    assert!(matches!(other, Err(TrialError::OtherSet { .. })));
    fs::write(place.path().join("answers.jsonl"), "{}\n{}\n").unwrap();
    assert!(matches!(folder.finished(), Err(TrialError::Damaged { line: 1, .. })));
}

#[test]
fn healthy_and_afflicted_cases_are_mingled_in_proportion() {
    let cases = mingled(10, 5);
    assert_eq!(cases.len(), 15);
    let healthy = cases[..6].iter().filter(|case| matches!(case, Case::Healthy(_))).count();
    assert_eq!(healthy, 4);
}
