//! From a triad's clean output to its samples: noise, drift, limit and steps of the converter.

use nalgebra::Vector3;

use super::{chain::Chain, random::Random, triad_noise::TriadNoise, unit::TriadUnderTest};
use crate::{effect::SignalRun, recording::SensorKind};

/// Noise and step of the thermometer, K.
const THERMOMETER: (f64, f64) = (0.03, 0.01);

/// What a triad adds by chance.
#[derive(Debug)]
pub(super) struct Chance<'a> {
    /// Its noise, which goes on with these rows.
    pub noise: &'a mut TriadNoise,
    /// What else shakes it, row by row, SI units; may be empty.
    pub shaken: &'a [Vector3<f64>],
}

/// Samples of clean output, SI units; without chance there is neither noise nor rounding.
pub(super) fn samples(
    kind: SensorKind,
    triad: &TriadUnderTest,
    chain: &Chain<'_>,
    clean: Vec<Vector3<f64>>,
    time: &[f64],
    chance: Option<Chance<'_>>,
) -> Vec<Vector3<f64>> {
    let mut samples = clean;
    let rounds = chance.is_some();
    let mut noise = match chance {
        Some(Chance { noise, shaken }) => {
            let drift = noise.drift(samples.len());
            samples.iter_mut().zip(drift).for_each(|(sample, drift)| *sample += drift);
            let mut white = noise.white(samples.len());
            white.iter_mut().zip(shaken).for_each(|(noise, shaken)| *noise += shaken);
            white
        }
        None => vec![Vector3::zeros(); samples.len()],
    };
    let mut limit = triad.full_scale;
    chain.signal(kind, SignalRun { time, noise: &mut noise, limit: &mut limit });
    for (sample, noise) in samples.iter_mut().zip(&noise) {
        *sample = (*sample + noise).map(|value| value.clamp(-limit, limit));
        if rounds {
            *sample = sample.map(|value| (value * triad.counts.per_unit).round() / triad.counts.per_unit);
        }
    }
    chain.data(kind, &mut samples);
    samples
}

/// What a thermometer reads of a temperature, °C; without chance the temperature itself.
pub(super) fn thermometer(temperature: f64, random: Option<&mut Random>) -> f64 {
    let (sigma, step) = THERMOMETER;
    match random {
        Some(random) => ((temperature + sigma * random.normal()) / step).round() * step,
        None => temperature,
    }
}
