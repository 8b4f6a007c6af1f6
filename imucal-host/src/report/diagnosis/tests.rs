use super::*;
use crate::diagnosis::finding::{Absent, Experiment, FORMAT, NotTestable};

fn amount(name: &str, value: Option<f64>, std_error: Option<f64>, unit: &str) -> Amount {
    Amount { name: name.to_owned(), value, std_error, unit: unit.to_owned() }
}

fn cause() -> Cause {
    Cause {
        effect: "mag.bias_step".into(),
        probability: 0.9998,
        equivalents: vec!["mag.bias_drift".into()],
        parameters: vec![
            amount("x", Some(1.9), Some(0.02), "uT"),
            amount("t_start", Some(12.5), None, "s"),
            amount("t_end", None, None, "s"),
        ],
        material: true,
        gap_closed: Some(0.97),
        gap_closed_ci95: Some([0.95, 0.98]),
    }
}

fn diagnosis(verdict: Verdict) -> Diagnosis {
    Diagnosis {
        format: FORMAT.to_owned(),
        recording: "case-0007.csv".to_owned(),
        verdict,
        reference: None,
        remarks: Vec::new(),
        warnings: Vec::new(),
        gap: vec![Gap {
            sensor: "mag".into(),
            axis: "x".into(),
            unit: "uT".into(),
            rms_before: 0.41,
            rms_after: 0.052,
            noise_floor: f64::NAN,
        }],
        places: vec![Place {
            sensor: "mag".into(),
            driver: "gimbal_outer".into(),
            share: 0.83,
            p_value: 0.0,
            detail: "first harmonic".into(),
        }],
        causes: vec![cause()],
        credible_set: vec!["mag.bias_step".into(), "mag.bias_drift".into()],
        gap_closed_total: Some(0.97),
        gap_closed_total_ci95: Some([0.95, 0.98]),
        held_out: true,
        absent: vec![Absent {
            effect: "acc.scale_cubic".into(),
            minimum_detectable: 2.1e-5,
            unit: "1/(m/s^2)^2".into(),
        }],
        not_testable: vec![NotTestable {
            effect: "acc.gravity_error".into(),
            because: "same as scale".into(),
        }],
        user_effects: Vec::new(),
        proposals: Vec::new(),
        watch: None,
        profiles: Vec::new(),
        next_experiment: vec![Experiment {
            separates: vec!["mag.bias_step".into(), "mag.bias_drift".into()],
            instruction: "hold the first pose again, 120 s".into(),
            distinguishability_from: 2.1,
            to: 60.0,
        }],
    }
}

/// Its lines in full; where they change on purpose, the new ones are `left` of the failed comparison.
#[test]
fn the_page_is_the_one_that_was_read_and_approved() {
    let text = page(&diagnosis(Verdict::Explained));
    assert_eq!(text, include_str!("page.txt"), "\n{text}");
}

#[test]
fn each_verdict_has_its_own_sentence() {
    let first = |verdict| {
        let mut diagnosis = diagnosis(verdict);
        diagnosis.remarks = vec!["there is no rig".into(), "and no revisit".into()];
        page(&diagnosis).split_whitespace().collect::<Vec<_>>().join(" ")
    };
    assert!(first(Verdict::None).contains("no gap beyond the noise"));
    assert!(first(Verdict::Unknown).contains("no effect of the catalogue explains it"));
    assert!(first(Verdict::Partly).contains("mag.bias_step explains the gap in part"));
    assert!(first(Verdict::Ambiguous).contains("cannot distinguish mag.bias_step from"));
    let refused = first(Verdict::NotTestable);
    assert!(refused.contains("Nothing can be said: there is no rig.") && refused.contains("note: and no"));
}

#[test]
fn a_page_is_not_wider_than_a_terminal() {
    let mut wide = diagnosis(Verdict::Explained);
    wide.absent = vec![wide.absent[0].clone(); 40];
    assert!(page(&wide).lines().all(|line| line.chars().count() <= 100));
}

#[test]
fn what_is_no_number_is_null_in_the_json() {
    let mut odd = diagnosis(Verdict::Partly);
    odd.gap_closed_total = Some(f64::INFINITY);
    let json = serde_json::to_value(&odd).unwrap();
    assert!(json["gap"][0]["noise_floor"].is_null() && json["gap_closed_total"].is_null());
    assert_eq!((&json["verdict"], &json["where"][0]["share"]), (&"partly".into(), &0.83.into()));
}

#[test]
fn a_simulator_s_page_says_what_to_change_first_and_what_remains() {
    let mut with_stream = diagnosis(Verdict::Explained);
    with_stream.reference = Some(ReferenceKind::Simulator);
    let mut clock = cause();
    clock.effect = "clk.time_offset".into();
    clock.parameters = vec![amount("offset", Some(0.0124), Some(1e-4), "s")];
    (clock.gap_closed, clock.gap_closed_ci95) = (Some(0.99), Some([0.98, 1.0]));
    with_stream.causes.push(clock);
    with_stream.gap[0].noise_floor = 0.05;
    let text = page(&with_stream);
    let place = |part: &str| text.find(part).unwrap_or_else(|| panic!("{part} is missing in {text}"));
    let parts = [
        "what to change in the simulator",
        "1. clk.time_offset, 99 % (98 to 100 %): offset 12.40 ± 0.10 ms",
        "2. mag.bias_step, 97 %",
        "before      after",
        "what remains\n  nothing beyond the noise",
    ];
    assert!(parts.map(place).is_sorted(), "{text}");
    with_stream.gap[0].noise_floor = 0.01;
    assert!(page(&with_stream).contains("mag x: 5.1e-2 uT beyond the noise"), "{}", page(&with_stream));
}
