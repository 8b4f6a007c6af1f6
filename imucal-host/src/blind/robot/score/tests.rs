use super::*;
use crate::{
    blind::{
        answer::{Answer, Asserted, Finished},
        proposal::Proposed,
        robot::case::{Departed, RobotLabel, RobotPresent, RobotSetting},
    },
    diagnosis::Verdict,
};

fn label(content: Content) -> RobotLabel {
    let present = |effect: &str| RobotPresent {
        effect: effect.to_owned(),
        parameters: Vec::new(),
        lambda: 250.0,
        lambda_beyond: (content == Content::Spoken).then_some(220.0),
    };
    RobotLabel {
        format: "imucal-blind-robot-label/1".to_owned(),
        salt: String::new(),
        case: "case".to_owned(),
        content,
        setting: RobotSetting {
            machine: "legged".to_owned(),
            unit: "mtx".to_owned(),
            rates: [200.0; 2],
            duration: 60.0,
            mounting: [0.0; 3],
            clock_offset: 0.01,
            clock_rate_error: 1e-5,
            dropped: 0.0,
            white: [1.0; 3],
            drift: [1.0; 3],
            drift_kind: Default::default(),
            vibration: 1.0,
        },
        effect: match content {
            Content::Effect => Some(present("gyr.g_sensitivity")),
            Content::Spoken => Some(present("outside.acc.knee")),
            Content::Unspoken => Some(present("outside.acc.preisach")),
            Content::Own => Some(present("gyr.load_gain")),
            Content::Healthy | Content::Motion => None,
        },
        mismatch: (content == Content::Motion).then(|| Departed {
            kind: "slip".to_owned(),
            size: 1.0,
            stretches: vec![[10.0, 14.0]],
            lambda: 5000.0,
        }),
        passed_over: Vec::new(),
    }
}

/// Causes with a delay of so many s ± an error.
fn judged(content: Content, verdict: Verdict, ids: &[&str], delay: Option<(f64, f64)>) -> RobotJudgement {
    let cause = |effect: &str, amount: Option<(f64, f64)>| Asserted {
        effect: effect.to_owned(),
        probability: Some(0.99),
        equivalents: Vec::new(),
        parameters: amount.iter().map(|(value, _)| ("offset".to_owned(), Some(*value))).collect(),
        std_errors: amount.iter().map(|(_, error)| ("offset".to_owned(), Some(*error))).collect(),
    };
    let mut causes: Vec<Asserted> = ids.iter().map(|id| cause(id, None)).collect();
    causes.extend(delay.map(|delay| cause("clk.time_offset", Some(delay))));
    answered(content, Answer { verdict: Some(verdict), causes, ..Answer::of(None) })
}

fn answered(content: Content, answer: Answer) -> RobotJudgement {
    let label = serde_json::to_string(&label(content)).unwrap();
    let trial = Finished { case: "case".to_owned(), label, answer, truly_closed: None, seconds: 1.0 };
    RobotJudgement::of(&trial).unwrap()
}

/// The same with a formula of this correlation with the truth.
fn proposing(judged: &RobotJudgement, correlation: f64) -> RobotJudgement {
    let proposed = Proposed {
        sensor: "acc".to_owned(),
        formula: "k * a_x".to_owned(),
        correlation: Some(correlation),
        confirmed: None,
    };
    answered(judged.label.content, Answer { proposals: vec![proposed], ..judged.answer.clone() })
}

fn perfect() -> Vec<RobotJudgement> {
    let right = Some((0.0101, 1e-4));
    vec![
        judged(Content::Healthy, Verdict::Explained, &[], right),
        judged(Content::Effect, Verdict::Explained, &["gyr.g_sensitivity"], right),
        judged(Content::Motion, Verdict::Explained, &["ref.motion_mismatch"], right),
        proposing(&judged(Content::Spoken, Verdict::Unknown, &[], right), 0.99),
        judged(Content::Unspoken, Verdict::Partly, &[], right),
        judged(Content::Own, Verdict::Explained, &["gyr.load_gain"], right),
    ]
}

#[test]
fn a_perfect_set_misses_nothing() {
    let perfect = perfect();
    assert!(perfect.iter().all(|judgement| !judgement.is_missed()));
    let score = score(&perfect);
    assert_eq!(score.trials, [1, 5]);
    assert!(score.shares.iter().all(|share| share.trials > 0 && share.meets_must()), "{score:?}");
    assert!(!score.table().contains("missed"));
}

#[test]
fn each_figure_can_be_missed() {
    let right = Some((0.0101, 1e-4));
    let missed = |at: usize, other: RobotJudgement| {
        let mut set = perfect();
        assert!(other.is_missed());
        set[at] = other;
        let of = |(k, share): (usize, &Share)| (!share.meets_must()).then_some(k);
        score(&set).shares.iter().enumerate().filter_map(of).collect::<Vec<_>>()
    };
    assert_eq!(missed(0, judged(Content::Healthy, Verdict::Unknown, &[], right)), [0]);
    assert_eq!(missed(0, judged(Content::Healthy, Verdict::Explained, &["ref.motion_mismatch"], right)), [0]);
    assert_eq!(missed(1, judged(Content::Effect, Verdict::Explained, &[], right)), [1]);
    let two = ["gyr.g_sensitivity", "acc.bias_step"];
    assert_eq!(missed(1, judged(Content::Effect, Verdict::Explained, &two, right)), [1]);
    let two = ["ref.motion_mismatch", "acc.bias_step"];
    assert_eq!(missed(2, judged(Content::Motion, Verdict::Explained, &two, right)), [3]);
    assert_eq!(missed(2, judged(Content::Motion, Verdict::Unknown, &[], right)), [3]);
    assert_eq!(missed(5, judged(Content::Own, Verdict::Explained, &["gyr.scale_cubic"], right)), [4]);
    assert_eq!(missed(3, judged(Content::Spoken, Verdict::Unknown, &[], right)), [5]);
    for (at, figure) in [(0, 7), (3, 5), (4, 6)] {
        assert_eq!(missed(at, proposing(&perfect()[at], 0.5)), [figure]);
    }
    // Not reported, too far by its errors, and too far by itself.
    for delay in [None, Some((0.0104, 1e-4)), Some((0.0125, 1e-3))] {
        assert_eq!(missed(0, judged(Content::Healthy, Verdict::None, &[], delay)), [2], "{delay:?}");
    }
}

#[test]
fn a_declared_equivalent_counts_in_the_contract_s_figure_and_not_as_the_class_itself() {
    let mut answer = judged(Content::Effect, Verdict::Ambiguous, &["gyr.warmup"], None).answer;
    assert!(!answered(Content::Effect, answer.clone()).right_or_equivalent);
    answer.causes[0].equivalents = vec!["gyr.temp_bias".to_owned(), "gyr.g_sensitivity".to_owned()];
    let judged = answered(Content::Effect, answer);
    assert!(judged.right_or_equivalent && !judged.class_right);
}
