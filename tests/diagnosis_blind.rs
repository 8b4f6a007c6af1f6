//! A small set of sealed trials: no figure is further from the contract's than chance would bring it.
//!
//! The full set, which tells the figures, takes an hour: README, "Diagnosis".

use imucal_host::{
    blind::{
        case::{Case, draw},
        judgement::Judgement,
        score::{Goal, Share, score},
        seal::Nonce,
        trial::{Folder, mingled},
    },
    diagnosis::{Options, diagnose},
};

const HEALTHY: usize = 40;
const AFFLICTED: usize = 24;
/// A set of any nonce must do; this one has been drawn once and for all, so that the test has one outcome.
const NONCE: &str = "20261122";

/// A tool with the contract's rate does as badly as this less often than once in forty sets.
fn is_beyond_chance(share: &Share) -> bool {
    let [low, high] = share.interval();
    match share.must {
        Some(Goal::AtLeast(least)) => high < least,
        Some(Goal::AtMost(most)) => low > most,
        Some(Goal::Within(least, most)) => high < least || low > most,
        None => false,
    }
}

#[test]
fn a_small_set_of_sealed_trials_is_answered_no_worse_than_the_contract_allows() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = Folder::open(folder.path(), Nonce::parse(NONCE)).expect("a new set");
    let jobs = std::thread::available_parallelism().map_or(1, usize::from);
    let plain = |recording: &_| diagnose(recording, &Options::default(), &|_| ());
    folder.run(&mingled(HEALTHY, AFFLICTED), jobs, &plain, &|_| ()).expect("all cases run");
    let judged: Vec<Judgement> =
        folder.finished().expect("sealed").iter().filter_map(Judgement::of).collect();
    assert_eq!(judged.len(), HEALTHY + AFFLICTED);
    let score = score(&judged);
    println!("{}", score.table());
    judged.iter().filter(|judged| judged.is_missed()).for_each(|judged| println!("{}", judged.line()));
    for share in &score.shares {
        assert!(!is_beyond_chance(share), "{}: {} of {}", share.name, share.hits, share.trials);
    }
    assert!(judged.iter().all(|judged| judged.answer.verdict.is_some()), "a diagnosis came to no end");
}

/// Drawn once by chance, and missed by a search that adds one effect at a time: linear drift and the square of the
/// temperature, each of which leaves the other in the noise's drift.
const SLOW: (&str, usize) = ("cdab6a47e7b7db51f0c1509043cfcf9431e67f05e905309a3cc97e6c8aa06353", 16);

#[test]
fn two_slow_effects_of_one_sensor_are_found_together() {
    let drawn = draw(&Nonce::parse(SLOW.0).expect("a nonce"), Case::Afflicted(SLOW.1)).expect("a case");
    let recording = drawn.simulation.record("slow").expect("a recording");
    let diagnosis = diagnose(&recording, &Options::default(), &|_| ());
    let mut named: Vec<&str> = diagnosis.causes.iter().map(|cause| cause.effect.as_str()).collect();
    let mut there: Vec<&str> = drawn.label.effects.iter().map(|effect| effect.effect.as_str()).collect();
    named.sort_unstable();
    there.sort_unstable();
    assert_eq!(there.iter().filter(|id| id.starts_with("gyr.")).count(), 2, "{there:?}");
    assert_eq!(named, there);
}
