//! Recordings of a simulated rig, drift and scatter of the stops included: what the fits find is off by what their
//! standard errors say.

use imucal_host::{
    calibrate::{FitSummary, Options, calibrate},
    effect::find,
    recording::SensorKind,
    simulator::{Dose, Programme, Simulation, UnitKind},
};
use imucal_tests::rig::moments;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

/// Recordings of each kind.
const RECORDINGS: u64 = 20;

/// Scores of one recording, in standard errors.
#[derive(Clone, Debug, Default)]
struct Scores {
    acc_gain: Vec<f64>,
    acc_bias: Vec<f64>,
    tilt: Vec<f64>,
    mag_gain: Vec<f64>,
    mag_bias: Vec<f64>,
    /// Sources, which are not there.
    sources: Vec<f64>,
}

/// A recording of a unit on a base that stands as it comes, or one that is level and points north.
fn simulation(seed: u64, north: bool) -> Simulation {
    let unit = UnitKind::ALL[(seed % 2) as usize];
    let mut simulation =
        Simulation { unit, programme: Programme::MultiPosition, rate: 50.0, seed, ..Simulation::default() };
    if north {
        let base = simulation.schedule().expect("a possible programme").machine(0.0);
        let mut undo = |id: &str, values: Vec<f64>| {
            let effect = find(id).expect("in the catalogue");
            simulation.doses.push(Dose { effect, values });
        };
        undo("rig.heading", vec![-base.heading]);
        undo("rig.level_tilt", base.tilt.iter().map(|tilt| -tilt).collect());
    }
    simulation
}

fn scores(seed: u64, rig_mag: &'static str, north: bool) -> Scores {
    let simulation = simulation(seed, north);
    let recording = simulation.record("rig.csv").expect("a possible recording");
    let options = Options {
        skip: vec![SensorKind::Gyr],
        multipliers: vec![4.0],
        rig_mag: Some(rig_mag),
        ..Options::default()
    };
    let calibration = calibrate(&recording, &options, &|_| {});
    let unit = simulation.unit_under_test();
    let fit = |kind: SensorKind| {
        let outcome = calibration.sensor(kind).expect("recorded");
        outcome.accepted().unwrap_or_else(|| panic!("seed {seed}, {kind}: {:?}", outcome.verdict))
    };
    let mut scores = Scores::default();
    let acc = fit(SensorKind::Acc);
    (scores.acc_gain, scores.acc_bias) = of_triad(acc, &unit.c_t_q, &unit.acc.triad);
    let rig = acc.rig.as_ref().expect("on a rig");
    let (tilt, std) = rig.tilt.expect("estimated");
    let truth = if north { [0.0; 2] } else { simulation.schedule().expect("possible").machine(0.0).tilt };
    scores.tilt = (0..2).map(|k| (tilt[k] - truth[k]) / std[k]).collect();
    let mag = fit(SensorKind::Mag);
    (scores.mag_gain, scores.mag_bias) = of_triad(mag, &unit.c_t_q, &unit.mag.triad);
    let sources = mag.rig.as_ref().expect("on a rig").sources.expect("estimated");
    let told = sources.iter().flat_map(|(d, std)| d.iter().zip(std.iter()).filter(|(_, std)| **std > 0.0));
    scores.sources = told.map(|(d, std)| d / std).collect();
    scores
}

/// Scores of gain and bias; the unit's axes are turned on the table by its mount.
fn of_triad(
    fit: &FitSummary,
    c_t_q: &Matrix3<f64>,
    truth: &imucal_core::triad::Triad<f64>,
) -> (Vec<f64>, Vec<f64>) {
    let gain = (fit.triad.gain - c_t_q.transpose() * truth.gain).component_div(&fit.gain_std);
    let bias: Vector3<f64> = (fit.triad.bias - truth.bias).component_div(&fit.bias_std);
    (gain.iter().copied().collect(), bias.iter().copied().collect())
}

fn pooled(count: u64, rig_mag: &'static str, north: bool) -> Scores {
    let all: Vec<Scores> =
        (0..count).into_par_iter().map(|seed| scores(1000 + seed, rig_mag, north)).collect();
    let of = |pick: fn(&Scores) -> &Vec<f64>| all.iter().flat_map(|s| pick(s).clone()).collect();
    let pooled = Scores {
        acc_gain: of(|s| &s.acc_gain),
        acc_bias: of(|s| &s.acc_bias),
        tilt: of(|s| &s.tilt),
        mag_gain: of(|s| &s.mag_gain),
        mag_bias: of(|s| &s.mag_bias),
        sources: of(|s| &s.sources),
    };
    println!("{count} recordings, {rig_mag}, {}:", if north { "level and north" } else { "as it stands" });
    for (name, values) in [
        ("acc gain", &pooled.acc_gain),
        ("acc bias", &pooled.acc_bias),
        ("tilt", &pooled.tilt),
        ("mag gain", &pooled.mag_gain),
        ("mag bias", &pooled.mag_bias),
        ("sources", &pooled.sources),
    ] {
        let (mean, std) = moments(values);
        println!("  {name}: mean {mean:.3}, standard deviation {std:.3} of {}", values.len());
    }
    pooled
}

/// Scores with their number and what their mean and spread are known to at three standard errors.
fn assert_as_said(name: &str, scores: &[f64], (count, mean_within, std_within): (usize, f64, f64)) {
    let (mean, std) = moments(scores);
    assert_eq!(scores.len(), count, "{name}: every one of every recording");
    assert!(mean.abs() < mean_within, "{name}: mean {mean}");
    assert!((std - 1.0).abs() < std_within, "{name}: standard deviation {std}");
}

fn assert_all_as_said(scores: &Scores) {
    // 20 recordings of nine gains each; gains of a row share its noise, which costs some of their number. Over 200
    // recordings their spread is 0.97 and 0.96 to 0.99.
    assert_as_said("acc gain", &scores.acc_gain, (180, 0.25, 0.2));
    assert_as_said("mag gain", &scores.mag_gain, (180, 0.25, 0.2));
    assert_as_said("tilt", &scores.tilt, (40, 0.5, 0.35));
    assert_as_said("sources", &scores.sources, (80, 0.35, 0.27));
    // What a recording tells of a drift is little, and the slow part of it is in the bias: with errors that took
    // poses for independent these spreads were 2.0 and 4.2. Over 200 recordings they are 1.03 and 1.18.
    assert_as_said("acc bias", &scores.acc_bias, (60, 0.4, 0.4));
    assert_as_said("mag bias", &scores.mag_bias, (60, 0.5, 0.5));
}

#[test]
fn on_a_base_that_points_north_errors_with_a_known_field_are_as_large_as_their_standard_errors() {
    assert_all_as_said(&pooled(RECORDINGS, "X18", true));
}

#[test]
fn on_a_base_as_it_stands_errors_with_the_field_s_direction_estimated_are_as_large_as_their_standard_errors()
{
    assert_all_as_said(&pooled(RECORDINGS, "X21", false));
}

#[test]
fn a_field_taken_as_known_on_a_base_that_points_elsewhere_is_warned_of() {
    let warned = |seed: u64, north: bool| {
        let recording = simulation(seed, north).record("rig.csv").expect("a possible recording");
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
        let schedule = simulation(*seed, false).schedule().expect("possible");
        schedule.machine(0.0).heading.abs() > 0.1f64.to_radians()
    };
    let seeds: Vec<u64> = (1000..1010).filter(elsewhere).collect();
    assert!(seeds.len() >= 5, "{seeds:?}");
    for seed in seeds {
        assert!(warned(seed, false), "seed {seed}");
        assert!(!warned(seed, true), "seed {seed}: points north");
    }
}
