//! A small set of sealed trials: no figure is further from the contract's than chance would bring it.
//!
//! The full set, which tells the figures, takes an hour: README, "How often it is right".

use imucal_host::{
    blind::{
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
