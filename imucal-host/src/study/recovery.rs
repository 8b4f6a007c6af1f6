//! Recovery: how far calibrations of simulated recordings are from the truth, in the standard errors they report.
//!
//! Every recording is a multi-position programme of a unit of its own, MTx and 3DM-GX2 in turn, on a base of its own.
//! Standard errors that are right give scores of mean 0 and standard deviation 1. Sources on the gimbals are scored
//! against none, as the simulator has none here. Parameters that the poses cannot determine are held and have no score.

use std::fmt::Write;

use imucal_core::triad::Triad;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use crate::{
    calibrate::{FitSummary, Options, calibrate},
    effect,
    recording::{Recording, SensorKind},
    simulator::{
        Dose, Programme, Simulation, SimulationError, UnitKind,
        random::{Purpose, Random},
    },
};

/// Sampling rate, Hz.
const RATE: f64 = 50.0;

/// Noise of the recordings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Noise {
    /// White, drift, scatter of the stops, encoders, rounding.
    All,
    /// White alone.
    White,
}

/// How the base stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Base {
    /// As it comes: the field's direction is estimated (X21).
    Drawn,
    /// Level, and pointing north: the field is known (X18).
    Exact,
}

/// Parameters whose scores are pooled.
pub const GROUPS: [&str; 8] =
    ["acc gain", "acc bias", "tilt", "gyr gain", "gyr bias", "mag gain", "mag bias", "sources"];

/// Scores of each of [`GROUPS`], in standard errors.
pub type Scores = [Vec<f64>; GROUPS.len()];

/// The recording of a seed.
///
/// # Errors
///
/// [`SimulationError`], which the study's own settings do not cause.
pub fn simulation(seed: u64, base: Base) -> Result<Simulation, SimulationError> {
    let unit = UnitKind::ALL[(seed % 2) as usize];
    let mut simulation =
        Simulation { unit, programme: Programme::MultiPosition, rate: RATE, seed, ..Simulation::default() };
    if base == Base::Exact {
        let drawn = simulation.schedule()?.machine(0.0);
        let undo = [
            ("rig.heading", vec![-drawn.heading]),
            ("rig.level_tilt", drawn.tilt.iter().map(|tilt| -tilt).collect()),
        ];
        let doses =
            undo.into_iter().filter_map(|(id, values)| Some(Dose { effect: effect::find(id)?, values }));
        simulation.doses.extend(doses);
    }
    Ok(simulation)
}

/// Records it with the noise asked for.
fn record(simulation: &Simulation, noise: Noise) -> Result<Recording, SimulationError> {
    if noise == Noise::All {
        return simulation.record("recovery.csv");
    }
    let mut recording = Simulation { noise: false, ..simulation.clone() }.record("recovery.csv")?;
    let unit = simulation.unit_under_test();
    let mut random = Random::new(simulation.seed, Purpose::Noise);
    for kind in SensorKind::ALL {
        let sigma = unit.triad(kind).noise;
        let triple = match kind {
            SensorKind::Acc => recording.acc.as_mut(),
            SensorKind::Gyr => recording.gyr.as_mut(),
            SensorKind::Mag => recording.mag.as_mut(),
        };
        let values = triple.into_iter().flat_map(|triple| triple.values.iter_mut());
        values.for_each(|value| *value += random.normals() * sigma);
    }
    Ok(recording)
}

/// Scores of one seed's recording; none of a sensor whose calibration is refused.
///
/// # Errors
///
/// As [`simulation`].
pub fn scores(seed: u64, noise: Noise, base: Base) -> Result<Scores, SimulationError> {
    let simulation = simulation(seed, base)?;
    let recording = record(&simulation, noise)?;
    let rig_mag = Some(if base == Base::Exact { "X18" } else { "X21" });
    let options = Options { multipliers: vec![4.0], rig_mag, ..Options::default() };
    let calibration = calibrate(&recording, &options, &|_| {});
    let unit = simulation.unit_under_test();
    let tilt = if base == Base::Exact { [0.0; 2] } else { simulation.schedule()?.machine(0.0).tilt };
    let mut scores = Scores::default();
    for (kind, first) in SensorKind::ALL.into_iter().zip([0, 3, 5]) {
        let Some(fit) = calibration.sensor(kind).and_then(|outcome| outcome.accepted()) else { continue };
        (scores[first], scores[first + 1]) = of_triad(fit, &unit.c_t_q, &unit.triad(kind).triad);
        let Some(rig) = &fit.rig else { continue };
        if let Some((found, std)) = rig.tilt {
            scores[2] = (0..2).map(|k| (found[k] - tilt[k]) / std[k]).collect();
        }
        let sources = rig.sources.iter().flatten();
        let determined = sources.flat_map(|(d, std)| d.iter().zip(std.iter()).filter(|(_, std)| **std > 0.0));
        scores[7].extend(determined.map(|(d, std)| d / std));
    }
    Ok(scores)
}

/// Scores of gain and bias; the unit's axes are turned on the table by its mount.
fn of_triad(fit: &FitSummary, c_t_q: &Matrix3<f64>, truth: &Triad<f64>) -> (Vec<f64>, Vec<f64>) {
    let gain = (fit.triad.gain - c_t_q.transpose() * truth.gain).component_div(&fit.gain_std);
    let bias: Vector3<f64> = (fit.triad.bias - truth.bias).component_div(&fit.bias_std);
    (gain.iter().copied().collect(), bias.iter().copied().collect())
}

/// Scores of `count` recordings from seed `first` on.
///
/// # Errors
///
/// As [`simulation`].
pub fn pooled(first: u64, count: u64, noise: Noise, base: Base) -> Result<Scores, SimulationError> {
    let all: Vec<Scores> =
        (0..count).into_par_iter().map(|k| scores(first + k, noise, base)).collect::<Result<_, _>>()?;
    let mut pooled = Scores::default();
    for scores in all {
        pooled.iter_mut().zip(scores).for_each(|(all, more)| all.extend(more));
    }
    Ok(pooled)
}

/// Mean and standard deviation.
pub fn moments(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt())
}

/// The study's table.
///
/// # Errors
///
/// As [`simulation`].
pub fn report(first: u64, count: u64) -> Result<String, SimulationError> {
    let mut text = format!(
        "Errors over the standard errors reported, {count} recordings of two units\nfrom seed {first} on.\n"
    );
    for (noise, base, what) in [
        (
            Noise::All,
            Base::Drawn,
            "white noise, drift and scatter of the stops; field's direction estimated\n(X21)",
        ),
        (Noise::All, Base::Exact, "the same on a base that is level and points north, field known (X18)"),
        (Noise::White, Base::Drawn, "white noise alone; field's direction estimated (X21)"),
    ] {
        let scores = pooled(first, count, noise, base)?;
        let _ = writeln!(text, "\n{what}:\n{:<10} {:>8} {:>8} {:>8}", "", "mean", "std", "number");
        let all = scores.concat();
        for (name, values) in GROUPS.into_iter().zip(&scores).chain([("all", &all)]) {
            let (mean, std) = moments(values);
            let _ = writeln!(text, "{name:<10} {mean:>+8.3} {std:>8.3} {:>8}", values.len());
        }
    }
    Ok(text)
}
