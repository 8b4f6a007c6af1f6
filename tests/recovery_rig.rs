//! Recordings of a simulated rig, drift and scatter of the stops included: what the fits find is off by what their
//! standard errors say. 200 recordings each, as `imucal study recovery` prints them.

use imucal_host::{
    calibrate::{Calibration, Options, calibrate},
    effect,
    recording::SensorKind,
    simulator::{Dose, Simulation},
    study::recovery::{self, Base, GROUPS, Noise, Scores, moments},
};

/// Recordings, and the seed of the first.
const RECORDINGS: u64 = 200;
const FIRST: u64 = 1000;
/// Parameters of each group that a recording tells, in the order of the groups.
const OBSERVABLE: [usize; GROUPS.len()] = [9, 3, 2, 9, 3, 9, 3, 4];
/// Groups of biases.
const BIASES: [usize; 3] = [1, 4, 6];

fn pooled(noise: Noise, base: Base) -> Scores {
    let scores = recovery::pooled(FIRST, RECORDINGS, noise, base).expect("possible recordings");
    println!("{noise:?}, {base:?}:");
    for ((name, values), observable) in GROUPS.into_iter().zip(&scores).zip(OBSERVABLE) {
        let (mean, std) = moments(values);
        println!("  {name}: mean {mean:.3}, standard deviation {std:.3} of {}", values.len());
        assert_eq!(values.len(), observable * RECORDINGS as usize, "{name}: every one of every recording");
    }
    scores
}

/// Mean and standard deviation of all scores: 0 and 1, each to a tenth.
fn assert_right_in_all(scores: &Scores) {
    let (mean, std) = moments(&scores.concat());
    assert!(mean.abs() < 0.1, "mean {mean}");
    assert!((std - 1.0).abs() < 0.1, "standard deviation {std}");
}

/// Of a group: its scores' own error is 0.03 to 0.06, as what recordings share makes them alike.
fn assert_right(scores: &Scores, group: usize) {
    let (name, (mean, std)) = (GROUPS[group], moments(&scores[group]));
    assert!(mean.abs() < 0.15, "{name}: mean {mean}");
    assert!((std - 1.0).abs() < 0.15, "{name}: standard deviation {std}");
}

#[test]
fn with_the_field_s_direction_estimated_errors_match_their_std_errors() {
    let scores = pooled(Noise::All, Base::Drawn);
    assert_right_in_all(&scores);
    (0..GROUPS.len()).for_each(|group| assert_right(&scores, group));
}

#[test]
fn on_a_base_that_points_north_errors_match_their_standard_errors() {
    let scores = pooled(Noise::All, Base::Exact);
    assert_right_in_all(&scores);
    (0..GROUPS.len()).for_each(|group| assert_right(&scores, group));
}

#[test]
fn without_drift_errors_match_their_standard_errors() {
    let scores = pooled(Noise::White, Base::Drawn);
    assert_right_in_all(&scores);
    for group in 0..GROUPS.len() {
        if BIASES.contains(&group) {
            // Four minutes cannot tell that there is no drift as large as white noise averages to in that time.
            let (_, std) = moments(&scores[group]);
            assert!((0.5..1.1).contains(&std), "{}: standard deviation {std}", GROUPS[group]);
        } else {
            assert_right(&scores, group);
        }
    }
}

#[test]
fn a_field_taken_as_known_on_a_base_that_points_elsewhere_is_warned_of() {
    let warned = |seed: u64, base: Base| {
        let simulation = recovery::simulation(seed, base).expect("possible");
        let recording = simulation.record("rig.csv").expect("a possible recording");
        let options = Options {
            skip: vec![SensorKind::Gyr],
            multipliers: vec![4.0],
            rig_mag: Some("X18"),
            ..Options::default()
        };
        let calibration = calibrate(&recording, &options, &|_| {});
        calibration.warnings.iter().any(|warning| warning.contains("heading"))
    };
    // A base points within 0.5° or so; a fifth of that is many standard errors.
    let elsewhere = |seed: &u64| {
        let simulation = recovery::simulation(*seed, Base::Drawn).expect("possible");
        simulation.schedule().expect("possible").machine(0.0).heading.abs() > 0.1f64.to_radians()
    };
    let seeds: Vec<u64> = (1000..1010).filter(elsewhere).collect();
    assert!(seeds.len() >= 5, "{seeds:?}");
    for seed in seeds {
        assert!(warned(seed, Base::Drawn), "seed {seed}");
        assert!(!warned(seed, Base::Exact), "seed {seed}: points north");
    }
}

fn calibrated(simulation: &Simulation, skip: &[SensorKind]) -> Calibration {
    let recording = simulation.record("rig.csv").expect("a possible recording");
    let options = Options { skip: skip.to_vec(), multipliers: vec![4.0], ..Options::default() };
    calibrate(&recording, &options, &|_| {})
}

/// How far the magnetometer's gain is off, in standard errors of its entries, the worst.
fn worst_gain(simulation: &Simulation, found: &Calibration) -> f64 {
    let outcome = found.sensor(SensorKind::Mag).expect("it was recorded");
    let fit = outcome.accepted().unwrap_or_else(|| panic!("not accepted: {:?}", outcome.verdict));
    let unit = simulation.unit_under_test();
    let truth = unit.c_t_q.transpose() * unit.triad(SensorKind::Mag).triad.gain;
    (fit.triad.gain - truth).component_div(&fit.gain_std).amax()
}

#[test]
fn a_base_that_stands_far_off_the_field_s_direction_leaves_the_gains_right() {
    for (seed, degrees) in [(1000, 28.0f64), (1001, -35.0), (1002, 60.0), (1003, 170.0), (1004, -100.0)] {
        let mut simulation = recovery::simulation(seed, Base::Exact).expect("possible");
        let heading = effect::find("rig.heading").expect("in the catalogue");
        simulation.doses.push(Dose { effect: heading, values: vec![degrees.to_radians()] });
        let found = calibrated(&simulation, &[SensorKind::Gyr]);
        let off = worst_gain(&simulation, &found);
        assert!(off < 4.5, "{degrees}: {off}");
        let said = format!("turned by {degrees:.1}°");
        assert!(found.warnings.iter().any(|warning| warning.contains(&said)), "{:?}", found.warnings);
    }
}

#[test]
fn a_magnetometer_alone_on_a_tilted_base_is_off_by_what_its_errors_allow() {
    for seed in 1000..1005 {
        let simulation = recovery::simulation(seed, Base::Drawn).expect("possible");
        let found = calibrated(&simulation, &[SensorKind::Acc, SensorKind::Gyr]);
        let off = worst_gain(&simulation, &found);
        assert!(off < 4.5, "{seed}: {off}");
        assert!(found.warnings.iter().any(|warning| warning.contains("nothing shows the base's tilt")));
    }
}
