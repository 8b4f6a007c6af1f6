//! A recording of the flight motion simulator: as a whole, or by parts in constant memory.

use rayon::prelude::*;

use super::{
    SimulationError,
    chain::Chain,
    clean::Clean,
    converter::{self, Chance},
    programme::{Schedule, wrap},
    random::{Purpose, Random},
    run::Simulation,
    triad_noise::TriadNoise,
    truth::Motion,
    unit::UnitUnderTest,
};
use crate::recording::{Manifest, Recording, SensorKind};

/// Rows of a part.
const ROWS: usize = 1 << 16;
/// A step of the encoders, rad: twenty bits a turn.
const ENCODER_STEP: f64 = std::f64::consts::TAU / 1_048_576.0;
/// An arc second, rad.
const ARC_SECOND: f64 = std::f64::consts::PI / 648_000.0;

impl Simulation {
    /// Records it.
    ///
    /// # Errors
    ///
    /// As [`Self::schedule`], and [`SimulationError::Output`] for an effect beyond reason.
    pub fn record(&self, name: &str) -> Result<Recording, SimulationError> {
        let mut whole = Parts::of(self, name, usize::MAX)?;
        whole.part(0, whole.rows)
    }

    /// Records it by parts of consecutive rows, which make up what [`Self::record`] gives. They take the memory of one, unless an effect
    /// looks at rows other than its own: then there is but one.
    ///
    /// # Errors
    ///
    /// As [`Self::schedule`]; a part may be [`SimulationError::Output`].
    pub fn parts(&self, name: &str) -> Result<Parts<'_>, SimulationError> {
        let chain = Chain::new(&self.doses);
        let whole = chain.remembers() || chain.alters_samples();
        Parts::of(self, name, if whole { usize::MAX } else { ROWS })
    }
}

/// Consecutive rows of a simulated recording, part by part.
#[derive(Debug)]
pub struct Parts<'a> {
    simulation: &'a Simulation,
    name: String,
    schedule: Schedule,
    unit: UnitUnderTest,
    chain: Chain<'a>,
    manifest: Manifest,
    /// By [`SensorKind::ALL`]; none without noise.
    noise: [Option<TriadNoise>; 3],
    thermometer: Random,
    encoders: Encoders,
    /// Rows of the whole, of a part, and of the parts that are done.
    rows: usize,
    at_a_time: usize,
    done: Option<usize>,
}

impl<'a> Parts<'a> {
    fn of(simulation: &'a Simulation, name: &str, at_a_time: usize) -> Result<Self, SimulationError> {
        let schedule = simulation.schedule()?;
        let unit = simulation.unit_under_test();
        let rows = (schedule.duration() * simulation.rate).floor() as usize;
        let mut random = Random::new(simulation.seed, Purpose::Noise);
        let mut noise = |kind| TriadNoise::of(&mut random, unit.triad(kind), rows, 1.0 / simulation.rate);
        let noise = SensorKind::ALL.map(|kind| simulation.noise.then(|| noise(kind)));
        Ok(Self {
            simulation,
            name: name.to_owned(),
            chain: Chain::new(&simulation.doses),
            manifest: unit.manifest(schedule.place().site(), schedule.rig(), simulation.counts),
            noise,
            thermometer: Random::new(simulation.seed, Purpose::Thermometer),
            encoders: Encoders::new(simulation.seed),
            rows,
            at_a_time,
            done: None,
            schedule,
            unit,
        })
    }

    /// The rows from `first` on.
    fn part(&mut self, first: usize, rows: usize) -> Result<Recording, SimulationError> {
        let time: Vec<f64> = (first..first + rows).map(|row| row as f64 / self.simulation.rate).collect();
        let Clean { outputs, temperature } = Clean::of(&self.unit, &self.schedule, &self.chain, &time)?;
        let (unit, chain, manifest) = (&self.unit, &self.chain, &self.manifest);
        let triples = SensorKind::ALL.into_par_iter().zip(outputs).zip(&mut self.noise);
        let triples = triples.map(|((kind, clean), noise)| {
            let chance = noise.as_mut().map(|noise| Chance { noise, shaken: &[] });
            let samples = converter::samples(kind, unit.triad(kind), chain, clean, &time, chance);
            // Its own manifest has every conversion it needs.
            manifest.triple(kind, samples).ok()
        });
        let mut triples = triples.collect::<Vec<_>>().into_iter();
        let mut triple = || triples.next().flatten();
        let thermometer = &mut self.thermometer;
        let noisy = self.simulation.noise;
        let mut read = |of: f64| converter::thermometer(of, noisy.then_some(&mut *thermometer));
        let temperature = temperature.into_iter().map(&mut read).collect();
        let gimbal = self.encoders.read(&self.schedule, &time, noisy);
        let mut recording = Recording::new(&self.name, manifest.clone(), time);
        (recording.acc, recording.gyr, recording.mag) = (triple(), triple(), triple());
        recording.temperature = Some(temperature);
        recording.gimbal = Some(gimbal);
        Ok(recording)
    }
}

impl Iterator for Parts<'_> {
    type Item = Result<Recording, SimulationError>;

    /// The first part is there even if it has no row.
    fn next(&mut self) -> Option<Self::Item> {
        let first = self.done.unwrap_or(0);
        if self.done.is_some() && first == self.rows {
            return None;
        }
        let rows = self.at_a_time.min(self.rows - first);
        let part = self.part(first, rows);
        self.done = Some(if part.is_ok() { first + rows } else { self.rows });
        Some(part)
    }
}

/// The encoders of the gimbals.
#[derive(Clone, Debug)]
struct Encoders {
    random: Random,
    /// Standard deviations of their noise, rad.
    sigma: [f64; 3],
}

impl Encoders {
    fn new(seed: u64) -> Self {
        let mut random = Random::new(seed, Purpose::Encoder);
        let sigma = [(); 3].map(|()| random.between(2.0, 20.0) * ARC_SECOND);
        Self { random, sigma }
    }

    /// Angles at the next rows, rad.
    fn read(&mut self, schedule: &Schedule, time: &[f64], noisy: bool) -> Vec<[f64; 3]> {
        let Self { random, sigma } = self;
        let mut read = |angle: f64, sigma: f64| match noisy {
            true => wrap(((angle + sigma * random.normal()) / ENCODER_STEP).round() * ENCODER_STEP),
            false => wrap(angle),
        };
        time.iter()
            .map(|time| {
                let mut angles = schedule.encoders(*time).unwrap_or_default();
                angles.iter_mut().zip(&*sigma).for_each(|(angle, sigma)| *angle = read(*angle, *sigma));
                angles
            })
            .collect()
    }
}

#[cfg(test)]
mod tests;
