//! A recording of the flight motion simulator: programme, unit, effects and a seed.

use super::{
    SimulationError,
    chain::Chain,
    clean::Clean,
    conditions::Conditions,
    converter::{self, Chance},
    dose::Dose,
    programme::{Programme, Schedule, wrap},
    random::{Purpose, Random},
    truth::Motion,
    unit::{UnitKind, UnitUnderTest},
};
use crate::{
    effect::Effect,
    recording::{Manifest, Recording, SensorKind, manifest::Axis},
};

/// Rates there is a recording of, Hz.
const RATES: (f64, f64) = (10.0, 1000.0);
/// Longest recording, s.
const LONGEST: f64 = 21_600.0;
/// A step of the encoders, rad: twenty bits a turn.
const ENCODER_STEP: f64 = std::f64::consts::TAU / 1_048_576.0;
/// An arc second, rad.
const ARC_SECOND: f64 = std::f64::consts::PI / 648_000.0;

/// What to simulate.
#[derive(Clone, Debug)]
pub struct Simulation {
    /// Type of the unit.
    pub unit: UnitKind,
    /// What the rig does.
    pub programme: Programme,
    /// Gimbal axes, outermost first.
    pub axes: [Axis; 3],
    /// Sampling rate, Hz, 10 to 1000.
    pub rate: f64,
    /// Length, s, to six hours; `None` as long as the programme takes.
    pub duration: Option<f64>,
    /// Everything random follows from it.
    pub seed: u64,
    /// The unit's own seed, for further recordings of one unit; `None`: that of the recording.
    pub unit_seed: Option<u64>,
    /// Noise, drift, scatter of the rests and rounding; without, a recording is a smooth function of the effects'
    /// parameters.
    pub noise: bool,
    /// Where, how noisy, how exactly the gimbals stand.
    pub conditions: Conditions,
    /// Raw counts in the file instead of SI units.
    pub counts: bool,
    /// Effects beyond the baseline.
    pub doses: Vec<Dose>,
}

impl Default for Simulation {
    fn default() -> Self {
        Self {
            unit: UnitKind::default(),
            programme: Programme::default(),
            axes: [Axis::Z, Axis::Y, Axis::X],
            rate: 100.0,
            duration: None,
            seed: 1,
            unit_seed: None,
            noise: true,
            conditions: Conditions::default(),
            counts: true,
            doses: Vec::new(),
        }
    }
}

impl Simulation {
    /// The rig's movement, without effects.
    ///
    /// # Errors
    ///
    /// [`SimulationError`], when rate or duration are impossible.
    pub fn schedule(&self) -> Result<Schedule, SimulationError> {
        if !(RATES.0..=RATES.1).contains(&self.rate) {
            return Err(SimulationError::Rate { found: self.rate });
        }
        if let Some(found) = self.duration.filter(|duration| *duration > LONGEST) {
            return Err(SimulationError::TooLong { found, longest: LONGEST });
        }
        let schedule = self.programme.schedule(self.axes, self.seed, self.duration, self.conditions.place)?;
        let schedule = schedule.on_base(self.seed);
        if !self.noise {
            return Ok(schedule);
        }
        let mut random = Random::new(self.seed, Purpose::Scatter);
        Ok(schedule.scattered(self.conditions.scatter, &mut random))
    }

    /// The unit, without effects.
    pub fn unit_under_test(&self) -> UnitUnderTest {
        let drawn = UnitUnderTest::draw(self.unit, self.unit_seed.unwrap_or(self.seed), self.rate);
        self.conditions.applied_to(drawn)
    }

    /// Adds an effect of a size, see [`Dose::sized`].
    ///
    /// # Errors
    ///
    /// As [`Self::schedule`].
    pub fn add(&mut self, effect: &'static Effect, size: f64) -> Result<(), SimulationError> {
        let duration = self.schedule()?.duration();
        self.doses.push(Dose::sized(effect, size, self.seed, duration));
        Ok(())
    }

    /// Records it.
    ///
    /// # Errors
    ///
    /// As [`Self::schedule`], and [`SimulationError::Output`] for an effect beyond reason.
    pub fn record(&self, name: &str) -> Result<Recording, SimulationError> {
        let schedule = self.schedule()?;
        let unit = self.unit_under_test();
        let chain = Chain::new(&self.doses);
        let rows = (schedule.duration() * self.rate).floor() as usize;
        let time: Vec<f64> = (0..rows).map(|k| k as f64 / self.rate).collect();
        let Clean { outputs, temperature } = Clean::of(&unit, &schedule, &chain, &time)?;
        let mut random = Random::new(self.seed, Purpose::Noise);
        let manifest = self.manifest(&schedule, &unit);
        let mut recording = Recording::new(name, manifest.clone(), time);
        for (kind, clean) in SensorKind::ALL.into_iter().zip(outputs) {
            let triad = unit.triad(kind);
            let chance =
                self.noise.then(|| Chance { random: &mut random, interval: 1.0 / self.rate, shaken: &[] });
            let samples = converter::samples(kind, triad, &chain, clean, &recording.time, chance);
            // Its own manifest has every conversion it needs.
            let triple = manifest.triple(kind, samples).ok();
            match kind {
                SensorKind::Acc => recording.acc = triple,
                SensorKind::Gyr => recording.gyr = triple,
                SensorKind::Mag => recording.mag = triple,
            }
        }
        recording.temperature = Some(self.thermometer(&temperature));
        recording.gimbal = Some(self.encoders(&schedule, &recording.time));
        Ok(recording)
    }

    fn thermometer(&self, temperature: &[f64]) -> Vec<f64> {
        let mut random = Random::new(self.seed, Purpose::Thermometer);
        let read = |of: &f64| converter::thermometer(*of, self.noise.then_some(&mut random));
        temperature.iter().map(read).collect()
    }

    fn encoders(&self, schedule: &Schedule, time: &[f64]) -> Vec<[f64; 3]> {
        let mut random = Random::new(self.seed, Purpose::Encoder);
        let sigma = [(); 3].map(|()| random.between(2.0, 20.0) * ARC_SECOND);
        let mut read = |angle: f64, sigma: f64| match self.noise {
            true => wrap(((angle + sigma * random.normal()) / ENCODER_STEP).round() * ENCODER_STEP),
            false => wrap(angle),
        };
        time.iter()
            .map(|time| {
                let mut angles = schedule.encoders(*time).unwrap_or_default();
                angles.iter_mut().zip(sigma).for_each(|(angle, sigma)| *angle = read(*angle, sigma));
                angles
            })
            .collect()
    }

    fn manifest(&self, motion: &dyn Motion, unit: &UnitUnderTest) -> Manifest {
        unit.manifest(motion.place().site(), motion.rig(), self.counts)
    }
}

#[cfg(test)]
mod tests;
