//! A small set of sealed trials: no figure is further from the contract's than chance would bring it.
//!
//! The full set, which gives the published figures, takes an hour: `imucal-host/docs/diagnosis.md`.

use imucal_host::{
    blind::{
        case::{Case, Drawn, draw},
        judgement::Judgement,
        robot::{
            case::draw as draw_robot, judgement::RobotJudgement, score::score as robot_score,
            trial::RobotWorld,
        },
        score::{Goal, Share, score},
        seal::Nonce,
        trial::{Folder, OwnEffects, mingled},
        world::WorldKind,
    },
    diagnosis::{Diagnosis, Options, diagnose},
    effect::Effect,
    recording::Stream,
    simulator::robot::RobotPair,
};

const HEALTHY: usize = 16;
const AFFLICTED: usize = 36;
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

/// A figure of so few trials that no outcome would be beyond chance must have one right at least; one of no trial says
/// nothing.
fn is_refused(share: &Share) -> bool {
    let worst = match share.must {
        Some(Goal::AtLeast(_) | Goal::Within(..)) => 0,
        Some(Goal::AtMost(_)) => share.trials,
        None => return false,
    };
    is_beyond_chance(share) || share.hits == worst
}

#[test]
fn a_figure_of_any_number_of_trials_can_be_refused() {
    let share = |hits, trials, must| Share { name: "", hits, trials, must: Some(must), aim: None };
    for trials in 0..100 {
        assert!(is_refused(&share(0, trials, Goal::AtLeast(0.7))), "none of {trials}");
        assert!(trials == 0 || !is_refused(&share(trials, trials, Goal::AtLeast(0.7))), "all of {trials}");
        assert!(is_refused(&share(trials, trials, Goal::AtMost(0.05))), "all of {trials}");
    }
    // By Clopper and Pearson 0 of 3 may still be 70.8 %, and 1 of 6 no more than 64.1 %.
    assert!(!is_refused(&share(1, 3, Goal::AtLeast(0.7))) && is_refused(&share(1, 6, Goal::AtLeast(0.7))));
}

#[test]
fn a_small_set_of_sealed_trials_is_answered_as_the_contract_asks() {
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
        assert!(!is_refused(share), "{}: {} of {}", share.name, share.hits, share.trials);
    }
    assert!(judged.iter().all(|judged| judged.answer.verdict.is_some()), "a diagnosis came to no end");
}

const ROBOTS: (usize, usize) = (6, 7);
const ROBOTS_NONCE: &str = "20261125";

#[test]
fn a_small_set_of_sealed_trials_with_robots_is_answered_as_the_contract_asks() {
    let path = tempfile::tempdir().expect("a folder");
    let nonce = Nonce::parse(ROBOTS_NONCE);
    let folder = Folder::open_of(WorldKind::Robot, path.path(), nonce, OwnEffects::default());
    let folder = folder.expect("a new set");
    let jobs = std::thread::available_parallelism().map_or(1, usize::from);
    let against_stream = |pair: &RobotPair, own: &[&'static Effect]| {
        let options =
            Options { stream: Stream::of(&pair.simulated), effects: own.to_vec(), ..Options::default() };
        diagnose(&pair.real, &options, &|_| ())
    };
    let (healthy, afflicted) = ROBOTS;
    let cases = mingled(healthy, afflicted);
    let world = RobotWorld { diagnose: &against_stream, own: folder.own() };
    folder.run_in(&world, &cases, jobs, &|_| ()).expect("all cases run");
    let judged: Vec<RobotJudgement> =
        folder.finished().expect("sealed").iter().filter_map(RobotJudgement::of).collect();
    assert_eq!(judged.len(), healthy + afflicted);
    let score = robot_score(&judged);
    println!("{}", score.table());
    judged.iter().filter(|judged| judged.is_missed()).for_each(|judged| println!("{}", judged.line()));
    // Of formulas so few are drawn that none may be right by chance; the full set says how often they are.
    for share in &score.shares {
        assert!(!is_beyond_chance(share), "{}: {} of {}", share.name, share.hits, share.trials);
    }
}

/// Drawn once by chance: a robot that slips by half a degree and comes back, which a search took for a mount that slips.
const COMES_BACK: (&str, usize) = ("20261126", 27);

#[test]
fn a_robot_that_slips_and_comes_back_is_no_mount_that_slips() {
    let nonce = Nonce::parse(COMES_BACK.0).expect("a nonce");
    let drawn = draw_robot(&nonce, Case::Afflicted(COMES_BACK.1), &OwnEffects::default()).expect("a pair");
    let stretches = drawn.label.mismatch.expect("another motion").stretches;
    let pair = drawn.scene.record("pair").expect("a recording");
    let options = Options { stream: Stream::of(&pair.simulated), ..Options::default() };
    let diagnosis = diagnose(&pair.real, &options, &|_| ());
    let mut named = named(&diagnosis);
    named.retain(|id| !id.starts_with("clk."));
    assert_eq!(named, ["ref.motion_mismatch"]);
    let cause = diagnosis.causes.iter().find(|cause| cause.effect == "ref.motion_mismatch").expect("named");
    let starts = cause.parameters.iter().filter(|amount| amount.name.starts_with("t_start"));
    let starts: Vec<f64> = starts.filter_map(|amount| amount.value).collect();
    assert_eq!(starts.len(), stretches.len());
    for (start, stretch) in starts.iter().zip(&stretches) {
        assert!((start - stretch[0]).abs() < 3.0, "{start} {stretch:?}");
    }
}

/// An afflicted case and its diagnosis.
fn drawn(nonce: &str, number: usize) -> (Drawn, Diagnosis) {
    let drawn = draw(&Nonce::parse(nonce).expect("a nonce"), Case::Afflicted(number)).expect("a case");
    let recording = drawn.simulation.record("drawn").expect("a recording");
    let diagnosis = diagnose(&recording, &Options::default(), &|_| ());
    (drawn, diagnosis)
}

fn named(diagnosis: &Diagnosis) -> Vec<&str> {
    let mut named: Vec<&str> = diagnosis.causes.iter().map(|cause| cause.effect.as_str()).collect();
    named.sort_unstable();
    named
}

/// Drawn once by chance, and missed by a search that adds one effect at a time: linear drift and the square of the
/// temperature, each of which leaves the other in the noise's drift.
const SLOW: (&str, usize) = ("cdab6a47e7b7db51f0c1509043cfcf9431e67f05e905309a3cc97e6c8aa06353", 16);

#[test]
fn two_slow_effects_of_one_sensor_are_found_together() {
    let (drawn, diagnosis) = drawn(SLOW.0, SLOW.1);
    let mut there: Vec<&str> = drawn.label.effects.iter().map(|effect| effect.effect.as_str()).collect();
    there.sort_unstable();
    assert_eq!(there.iter().filter(|id| id.starts_with("gyr.")).count(), 2, "{there:?}");
    assert_eq!(named(&diagnosis), there);
}

/// Drawn once by chance as well.
const OTHERS: &str = "7494c662eba6467320cfb2ae08c9e715ee7cde2a152f6e89b6d72aa03c575631";

#[test]
fn a_lone_episode_is_placed_where_it_began_and_ended_despite_drift() {
    let (drawn, diagnosis) = drawn(OTHERS, 77);
    assert_eq!(named(&diagnosis), ["mag.bias_step"]);
    for (name, true_value) in
        drawn.label.effects[0].parameters.iter().filter(|(name, _)| name.starts_with("t_"))
    {
        let said = diagnosis.causes[0].parameters.iter().find(|parameter| parameter.name == *name);
        let value = said.and_then(|said| said.value).expect("an instant");
        assert!((value - true_value).abs() < 2.0, "{name}: {value} s, {true_value} s in truth");
    }
}

#[test]
fn what_a_fit_does_not_keep_is_not_asserted() {
    // An episode that a quiet noise promises next to the true cause, and that its own fit would rather be without.
    let (_, diagnosis) = drawn(OTHERS, 526);
    assert_eq!(named(&diagnosis), ["mag.temp_scale"]);
}
