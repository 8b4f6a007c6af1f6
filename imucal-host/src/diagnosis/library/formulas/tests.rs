use std::path::Path;

use crate::{
    diagnosis::{Diagnosis, Options, Verdict, diagnose},
    effect::{
        Effect,
        user::{find_among, parse},
    },
    recording::Recording,
    report,
    simulator::{OutputError, Programme, Simulation, SimulationError},
};

/// The entries that the documentation shows.
fn documented() -> Vec<&'static Effect> {
    let page = include_str!("../../../../docs/user_effects.md");
    let entries: Vec<&str> =
        page.split("```toml\n").skip(1).filter_map(|part| part.split("```").next()).collect();
    parse(&entries.concat(), Path::new("user_effects.md")).unwrap()
}

fn simulated(own: &[&'static Effect], id: &str, size: f64) -> Result<Recording, SimulationError> {
    let mut simulation =
        Simulation { programme: Programme::Full, rate: 25.0, seed: 21, ..Simulation::default() };
    simulation.add(find_among(id, own).unwrap(), size)?;
    simulation.record("own.csv")
}

fn diagnosed(recording: &Recording, effects: &[&'static Effect]) -> Diagnosis {
    diagnose(recording, &Options { effects: effects.to_vec(), ..Options::default() }, &|_| ())
}

fn ids(diagnosis: &Diagnosis) -> Vec<&str> {
    diagnosis.causes.iter().map(|cause| cause.effect.as_str()).collect()
}

#[test]
fn an_effect_that_only_a_file_knows_is_named_with_the_file_and_not_without() {
    let own = documented();
    let recording = simulated(&own, "gyr.cable_torque", 3.0).unwrap();
    let with = diagnosed(&recording, &own);
    assert_eq!(ids(&with), ["gyr.cable_torque"], "{with:#?}");
    assert!(matches!(with.verdict, Verdict::Explained | Verdict::Ambiguous), "{with:#?}");
    assert!(with.gap_closed_total.unwrap() > 0.8, "{with:#?}");
    let s = with.causes[0].parameters.iter().find(|amount| amount.name == "s").unwrap();
    assert!((0.5..=10.0).contains(&s.value.unwrap()), "{s:?}");
    let page = report::diagnosis::page(&with);
    for part in ["gyr.cable_torque", "a cable that pulls at the inner gimbal", "route it through the axis"] {
        assert!(page.contains(part), "{part}: {page}");
    }
    assert_eq!(with.user_effects.len(), 1);
    let without = diagnosed(&recording, &[]);
    assert!(!matches!(without.verdict, Verdict::None) && without.user_effects.is_empty(), "{without:#?}");
    assert!(!ids(&without).contains(&"gyr.cable_torque"), "{without:#?}");
}

#[test]
fn effects_that_are_the_same_are_named_together_and_one_without_a_value_cannot_be_tested() {
    let entry = |id: &str, formula: &str| {
        format!(
            "[[effect]]\nid = \"{id}\"\nsensor = \"mag\"\nformula = \"{formula}\"\nunit = \"uT\"\n\
             amplitude = {{ typical = 0.02, material = 0.004 }}\ncause = \"c\"\nremedy = \"r\"\n"
        )
    };
    let mut text: String =
        (0..40).map(|k| entry(&format!("mag.own_{k:02}"), &format!("a_y * {k}.5 * a_z"))).collect();
    text += &entry("mag.rooted", "sqrt(a_y)");
    text += &entry("mag.huge", "exp(100 * t)");
    // It has a value at its usual and extreme shapes, and none at some that the search tries.
    text += &entry("mag.hidden", "sqrt((s - 5)^2 - 1) * a_y");
    text += "shape = { s = { typical = 3, low = 0.5, high = 10, unit = '-' } }\n";
    let own = parse(&text, Path::new("own.toml")).unwrap();
    let recording = simulated(&own, "mag.own_07", 0.05).unwrap();
    let diagnosis = diagnosed(&recording, &own);
    assert_eq!(ids(&diagnosis), ["mag.own_00"], "{diagnosis:#?}");
    let cause = &diagnosis.causes[0];
    let same = (1..40).filter(|k| cause.equivalents.contains(&format!("mag.own_{k:02}"))).count();
    assert_eq!((same, diagnosis.verdict), (39, Verdict::Ambiguous), "{diagnosis:#?}");
    assert!(cause.probability < 0.03 && diagnosis.user_effects.len() == 40, "{diagnosis:#?}");
    for (id, reason) in [
        ("mag.rooted", "gives NaN on axis x at"),
        ("mag.huge", "`exp(100 * t)` gives"),
        ("mag.hidden", "gives NaN on axis x at"),
    ] {
        let not = diagnosis.not_testable.iter().find(|not| not.effect == id).unwrap();
        assert!(not.because.contains(reason), "{not:?}");
    }
    let failed = simulated(&own, "mag.rooted", 1.0).unwrap_err();
    assert!(matches!(&failed, SimulationError::Output(OutputError::NotFinite(cause)) if cause.row > 0));
    assert!(failed.to_string().contains("from its formula `sqrt(a_y)` on axis x in row"), "{failed}");
}
