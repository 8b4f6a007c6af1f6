use std::path::Path;

use crate::{
    diagnosis::{
        Diagnosis, Options, Verdict, diagnose,
        finding::{Proposal, ProposalStatus},
        proposal::entry,
    },
    effect::{Act, Effect, user},
    recording::Recording,
    report,
    simulator::{Dose, Programme, Simulation},
};

/// An effect that the catalogue does not hold.
fn outside(id: &str, formula: &str, typical: f64) -> &'static Effect {
    let text = format!(
        "[[effect]]\nid = \"{id}\"\nsensor = \"{}\"\nformula = {formula}\nunit = \"SI\"\n\
         amplitude = {{ typical = {typical:e}, material = {typical:e} }}\ncause = \"c\"\nremedy = \"r\"\n",
        &id[..3]
    );
    user::parse(&text, Path::new("outside.toml")).unwrap()[0]
}

/// Of field in the accelerometer's neighbouring axes.
fn crosstalk() -> &'static Effect {
    outside("acc.own_crosstalk", "[\"B_y\", \"B_z\", \"B_x\"]", 5e-4)
}

fn recorded(dose: Option<Dose>, seed: u64) -> Recording {
    let doses = dose.into_iter().collect();
    let simulation = Simulation {
        programme: Programme::Mixed,
        rate: 25.0,
        duration: Some(200.0),
        seed,
        doses,
        ..Simulation::default()
    };
    simulation.record("outside.csv").unwrap()
}

fn dose(effect: &'static Effect, size: f64) -> Option<Dose> {
    let typical = effect.parameters[0].prior_scale;
    Some(Dose { effect, values: [1.0, -0.7, 0.5].map(|share| share * size * typical).to_vec() })
}

fn diagnosed(recording: &Recording) -> Diagnosis {
    diagnose(recording, &Options::default(), &|_| ())
}

fn held_against(recording: &Recording, toml: &str) -> Proposal {
    let options =
        Options { effects: entry::effects(toml), frozen: Some(toml.to_owned()), ..Options::default() };
    let diagnosis = diagnose(recording, &options, &|_| ());
    let [proposal] = &diagnosis.proposals[..] else { panic!("{diagnosis:#?}") };
    proposal.clone()
}

#[test]
fn a_crosstalk_is_proposed_confirmed_on_a_second_recording_and_then_named() {
    let effect = crosstalk();
    let first = diagnosed(&recorded(dose(effect, 1.0), 31));
    let [proposal] = &first.proposals[..] else { panic!("{first:#?}") };
    assert_eq!(proposal.formula, "x: k_x * B_y; y: k_y * B_z; z: k_z * B_x", "{proposal:#?}");
    assert!(proposal.gap_closed > 0.8 && proposal.gap_closed_ci95[0] > 0.0, "{proposal:#?}");
    for (amount, truth) in proposal.parameters.iter().zip([5e-4, -3.5e-4, 2.5e-4]) {
        let (value, error) = (amount.value.unwrap(), amount.std_error.unwrap());
        assert!((value - truth).abs() < 4.0 * error, "{amount:?}");
    }
    assert!(report::diagnosis::page(&first).contains("x: k_x * B_y"));

    let second = recorded(dose(effect, 1.0), 32);
    let confirmed = held_against(&second, &proposal.toml);
    assert_eq!(confirmed.status, ProposalStatus::Confirmed, "{confirmed:#?}");
    // It is an effect of the user's own as well.
    let options = Options { effects: entry::effects(&proposal.toml), ..Options::default() };
    let named = diagnose(&second, &options, &|_| ());
    assert_eq!(named.causes[0].effect, "acc.proposed_b_next", "{named:#?}");
    assert_eq!(named.proposals, []);
    // Of the opposite sign it is another.
    let opposite = held_against(&recorded(dose(effect, -1.0), 33), &proposal.toml);
    assert_eq!(opposite.status, ProposalStatus::Refuted, "{opposite:#?}");
}

#[test]
fn a_shape_that_no_formula_says_is_located_and_not_proposed() {
    let ladder = outside("acc.own_ladder", "\"sin(2 * pi * y / 1.7)\"", 8e-3);
    let diagnosis = diagnosed(&recorded(dose(ladder, 1.0), 41));
    assert!(matches!(diagnosis.verdict, Verdict::Unknown | Verdict::Partly), "{diagnosis:#?}");
    assert_eq!(diagnosis.proposals, []);
    assert!(diagnosis.remarks.iter().any(|remark| remark.contains("no formula")), "{diagnosis:#?}");
}

#[test]
fn a_healthy_recording_refutes_a_formula_and_has_none_of_its_own() {
    let healthy = recorded(None, 51);
    assert_eq!(diagnosed(&healthy).proposals, []);
    let Act::Formula(kind, _) = crosstalk().act else { panic!("a formula") };
    let text = "[[effect]]\nid = \"acc.proposed\"\nsensor = \"acc\"\naxes = [\"x\"]\nformula = \"B_y\"\nunit = \"SI\"\n\
                amplitude = { typical = 5e-4, material = 1e-4 }\nfitted = { x = { value = 5e-4, std_error = 1e-5 } }\n\
                cause = \"c\"\nremedy = \"r\"\n";
    let refuted = held_against(&healthy, text);
    assert_eq!((refuted.status, refuted.sensor.as_str()), (ProposalStatus::Refuted, kind.prefix()));
}
