//! What no catalogue holds: a formula that says it is proposed and confirmed, and where none does there is none.

use imucal_host::{
    blind::outside::{self, BEYOND_FORMULAS},
    diagnosis::{
        Options, Verdict, diagnose,
        finding::{Proposal, ProposalStatus},
        proposal::entry,
    },
    recording::Recording,
    simulator::{Dose, Programme, Simulation},
};

/// A mechanism of each family from outside the catalogue that a formula says, and its formula.
const SPOKEN: [(&str, &str); 7] = [
    ("acc.cross_cubic", "x: k_x * y_y^3; y: k_y * y_z^3; z: k_z * y_x^3"),
    ("acc.crosstalk", "x: k_x * B_y; y: k_y * B_z; z: k_z * B_x"),
    (
        "acc.dead_zone",
        "x: k_x * (y_x - max(min(y_x, d), -d)); y: k_y * (y_y - max(min(y_y, d), -d)); \
         z: k_z * (y_z - max(min(y_z, d), -d))",
    ),
    (
        "gyr.motion_heat",
        "x: k_x * lag((w_x^2 + w_y^2 + w_z^2), tau); y: k_y * lag((w_x^2 + w_y^2 + w_z^2), tau); \
         z: k_z * lag((w_x^2 + w_y^2 + w_z^2), tau)",
    ),
    // On the third axis it is lost in the noise.
    ("mag.temp_cross", "x: k_x * (temp - 27.4) * y_y; y: k_y * (temp - 27.4) * y_z"),
    ("acc.temp_rate", "x: k_x * temp_rate; y: k_y * temp_rate; z: k_z * temp_rate"),
    (
        "mag.angle_harmonic_inner",
        "x: k_x * cos(5 * inner) + l_x * sin(5 * inner); y: k_y * cos(5 * inner) + l_y * sin(5 * inner); \
         z: k_z * cos(5 * inner) + l_z * sin(5 * inner)",
    ),
];
/// Likewise of each that no formula says.
const UNSPOKEN: [&str; 2] = ["mag.ladder", "gyr.ripple"];

/// Three minutes of a unit that has a mechanism from outside the catalogue.
fn with_mechanism(id: &str, seed: u64) -> Recording {
    let mechanism = outside::find(&format!("outside.{id}")).expect("a mechanism");
    let duration = 200.0;
    let simulation = Simulation {
        programme: Programme::Mixed,
        rate: 25.0,
        duration: Some(duration),
        seed,
        doses: vec![Dose::sized(mechanism, 3.0, 1, duration)],
        ..Simulation::default()
    };
    simulation.record("outside.csv").expect("a recording")
}

/// The one proposal of a diagnosis.
fn proposal(recording: &Recording, options: &Options, id: &str) -> Proposal {
    let diagnosis = diagnose(recording, options, &|_| ());
    let [proposal] = &diagnosis.proposals[..] else { panic!("{id}: {diagnosis:#?}") };
    proposal.clone()
}

#[test]
fn what_a_formula_says_is_proposed_and_a_second_recording_confirms_it() {
    for (id, formula) in SPOKEN {
        let proposed = proposal(&with_mechanism(id, 31), &Options::default(), id);
        assert_eq!(
            (proposed.sensor.as_str(), proposed.formula.as_str()),
            (&id[..3], formula),
            "{proposed:#?}"
        );
        assert_eq!(proposed.status, ProposalStatus::Proposed, "{id}");
        let frozen = Options {
            effects: entry::effects(&proposed.toml),
            frozen: Some(proposed.toml),
            ..Options::default()
        };
        let confirmed = proposal(&with_mechanism(id, 32), &frozen, id);
        assert_eq!(confirmed.status, ProposalStatus::Confirmed, "{id}: {confirmed:#?}");
    }
    for id in UNSPOKEN {
        let diagnosis = diagnose(&with_mechanism(id, 31), &Options::default(), &|_| ());
        assert!(matches!(diagnosis.verdict, Verdict::Unknown | Verdict::Partly), "{id}: {diagnosis:#?}");
        assert_eq!(diagnosis.proposals, [], "{id}");
    }
}

#[test]
fn every_family_from_outside_is_asked_for_its_formula() {
    // Of a harmonic there is one a gimbal.
    let family = |id: &str| {
        let name = id.rsplit('.').next().unwrap_or(id);
        if name.starts_with("angle_harmonic") { "angle_harmonic" } else { name }.to_owned()
    };
    let sorted = |mut list: Vec<String>| {
        list.sort();
        list.dedup();
        list
    };
    let there = sorted(outside::OUTSIDE.iter().map(|mechanism| family(&mechanism.id)).collect());
    let asked = SPOKEN.iter().map(|(id, _)| *id).chain(UNSPOKEN);
    assert_eq!(sorted(asked.map(family).collect()), there);
    assert!(UNSPOKEN.iter().all(|id| BEYOND_FORMULAS.contains(&family(id).as_str())));
}
