//! A robot's recording with its simulator's ideal stream, each with a clock and a rate of its own.

use imucal_core::rotation;
use nalgebra::Vector3;

use super::{
    mismatch::{Mismatch, MismatchKind},
    motion::RobotMotion,
    trajectory::{RobotKind, Trajectory},
    vibration::Vibration,
};
use crate::{
    effect::{self, Input},
    recording::{
        Manifest, Recording, SensorKind, Simulated,
        manifest::{ReferenceInfo, ReferenceKind},
    },
    simulator::{
        Dose, NoiseLevel, Place, SimulationError, UnitKind,
        chain::Chain,
        clean::Clean,
        climate::Climate,
        converter::{self, Chance},
        random::{Purpose, Random},
        triad_noise::TriadNoise,
        truth::Motion,
        unit::UnitUnderTest,
    },
};

/// Rates there is a stream of, Hz.
const RATES: (f64, f64) = (10.0, 1000.0);
/// Lengths, s.
const LENGTHS: (f64, f64) = (40.0, 3600.0);

/// What to simulate.
#[derive(Clone, Debug)]
pub struct RobotScene {
    /// What moves.
    pub kind: RobotKind,
    /// Everything random follows from it.
    pub seed: u64,
    /// The unit's own seed, for further recordings of one unit; `None`: that of the recording.
    pub unit_seed: Option<u64>,
    /// Length, s, 40 to 3600.
    pub duration: f64,
    /// Rate of the recording, Hz, 10 to 1000.
    pub real_rate: f64,
    /// Rate of the simulator's stream, Hz, 10 to 1000.
    pub sim_rate: f64,
    /// Where.
    pub place: Place,
    /// Type of the unit.
    pub unit: UnitKind,
    /// How the unit is turned on the body, rad.
    pub mounting: Vector3<f64>,
    /// The recording's row of t shows the simulator's t + offset, s,
    pub clock_offset: f64,
    /// divided by 1 + this error.
    pub clock_rate_error: f64,
    /// Share of the recording's rows that are lost.
    pub dropped: f64,
    /// Noise, drift, vibration and rounding; without, a recording is a smooth function of the effects' parameters.
    pub noise: bool,
    /// Noise against the sheet's, by [`SensorKind::ALL`].
    pub levels: [NoiseLevel; 3],
    /// Vibration, in multiples of the usual.
    pub vibration: f64,
    /// Raw counts in the file instead of SI units.
    pub counts: bool,
    /// Effects, of the catalogue or from outside.
    pub doses: Vec<Dose>,
    /// How the robot moves otherwise than the simulator says, and how far, in multiples of the usual.
    pub mismatch: Option<(MismatchKind, f64)>,
}

impl Default for RobotScene {
    fn default() -> Self {
        Self {
            kind: RobotKind::default(),
            seed: 1,
            unit_seed: None,
            duration: 120.0,
            real_rate: 200.0,
            sim_rate: 200.0,
            place: Place::ankara(),
            unit: UnitKind::default(),
            mounting: Vector3::zeros(),
            clock_offset: 0.0,
            clock_rate_error: 0.0,
            dropped: 0.0,
            noise: true,
            levels: [NoiseLevel::default(); 3],
            vibration: 1.0,
            counts: true,
            doses: Vec::new(),
            mismatch: None,
        }
    }
}

/// What a robot recorded, and what its simulator says.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotPair {
    /// By the unit, on its clock.
    pub real: Recording,
    /// Of ideal sensors in the body's axes, on the simulator's clock.
    pub simulated: Recording,
}

impl RobotScene {
    /// The movement as the simulator has it.
    ///
    /// # Errors
    ///
    /// [`SimulationError`], when rates or duration are impossible.
    pub fn planned(&self) -> Result<RobotMotion, SimulationError> {
        for found in [self.real_rate, self.sim_rate] {
            if !(RATES.0..=RATES.1).contains(&found) {
                return Err(SimulationError::Rate { found });
            }
        }
        let (shortest, longest) = LENGTHS;
        if self.duration > longest {
            return Err(SimulationError::TooLong { found: self.duration, longest });
        }
        if self.duration.is_nan() || self.duration < shortest {
            let programme = self.kind.name();
            return Err(SimulationError::TooShort { programme, duration: self.duration, shortest });
        }
        let mut random = Random::new(self.seed, Purpose::Route);
        let trajectory = Trajectory::draw(self.kind, self.duration, &mut random);
        let climate = Climate {
            mean: random.between(15.0, 30.0),
            swing: random.between(0.0, 3.0),
            period: random.between(300.0, 1200.0),
            phase: random.between(-3.0, 3.0),
            lag: random.between(40.0, 200.0),
            self_heating: random.between(3.0, 15.0),
        };
        Ok(RobotMotion { trajectory, climate, place: self.place, mismatch: Mismatch::default() })
    }

    /// The movement as it was.
    ///
    /// # Errors
    ///
    /// As [`Self::planned`].
    pub fn moved(&self) -> Result<RobotMotion, SimulationError> {
        let mut motion = self.planned()?;
        if let Some((kind, size)) = self.mismatch {
            let mut random = Random::new(self.seed, Purpose::Deviation);
            motion.mismatch = Mismatch::draw(kind, size, &motion.trajectory, &mut random);
        }
        Ok(motion)
    }

    /// Another recording of the same unit.
    #[must_use]
    pub fn again(&self) -> Self {
        let unit_seed = self.unit_seed.or(Some(self.seed));
        Self { seed: self.seed.wrapping_add(1), unit_seed, ..self.clone() }
    }

    /// The unit on the body, without effects.
    pub fn unit_under_test(&self) -> UnitUnderTest {
        let mut unit = UnitUnderTest::draw(self.unit, self.unit_seed.unwrap_or(self.seed), self.real_rate);
        unit.apply(self.levels);
        // The unit is turned; components go the other way.
        unit.c_t_q = rotation::exp(&-self.mounting);
        unit
    }

    /// The vibration of the machine.
    pub fn shaking(&self) -> Vibration {
        Vibration::draw(self.kind, self.vibration, &mut Random::new(self.seed, Purpose::Vibration))
    }

    /// The clock as effects, and those of the scene.
    pub fn all_doses(&self) -> Vec<Dose> {
        let clock = [("clk.time_offset", self.clock_offset), ("clk.rate_error", self.clock_rate_error)];
        let clock = clock
            .into_iter()
            .filter_map(|(id, value)| Some(Dose { effect: effect::find(id)?, values: vec![value] }));
        clock.chain(self.doses.iter().cloned()).collect()
    }

    /// The simulator's time that the recording's row of a time shows, s.
    pub fn shown(&self, time: f64) -> f64 {
        (time + self.clock_offset) / (1.0 + self.clock_rate_error)
    }

    /// Records the pair: `NAME-real.csv` and `NAME-sim.csv`.
    ///
    /// # Errors
    ///
    /// As [`Self::planned`], and [`SimulationError::Output`] for an effect beyond reason.
    pub fn record(&self, name: &str) -> Result<RobotPair, SimulationError> {
        Ok(RobotPair {
            real: self.real(&format!("{name}-real.csv"))?,
            simulated: self.simulated(&format!("{name}-sim.csv"))?,
        })
    }

    /// What the robot records.
    ///
    /// # Errors
    ///
    /// As [`Self::record`].
    pub fn real(&self, name: &str) -> Result<Recording, SimulationError> {
        let motion = self.moved()?;
        let unit = self.unit_under_test();
        let doses = self.all_doses();
        let chain = Chain::new(&doses);
        let time = times(self.duration, self.real_rate);
        let Clean { outputs, temperature } = Clean::of(&unit, &motion, &chain, &time)?;
        let shown: Vec<f64> = time.iter().map(|time| self.shown(*time)).collect();
        let manifest = unit.manifest(self.place.site(), motion.rig(), self.counts);
        let kept = self.kept(time.len());
        let rows = |column: Vec<Vector3<f64>>| kept.iter().map(|row| column[*row]).collect::<Vec<_>>();
        let mut recording =
            Recording::new(name, manifest.clone(), kept.iter().map(|row| time[*row]).collect());
        let mut random = Random::new(self.seed, Purpose::Noise);
        let mut shaken = Random::new(self.seed, Purpose::Vibration);
        let vibration = Vibration::draw(self.kind, self.vibration, &mut shaken);
        for (kind, clean) in SensorKind::ALL.into_iter().zip(outputs) {
            let triad = unit.triad(kind);
            let shaken = match self.noise && self.vibration > 0.0 {
                true => vibration.rows(kind, &motion.trajectory, &shown, self.real_rate, &mut shaken),
                false => Vec::new(),
            };
            let mut noise =
                self.noise.then(|| TriadNoise::of(&mut random, triad, time.len(), 1.0 / self.real_rate));
            let chance = noise.as_mut().map(|noise| Chance { noise, shaken: &shaken });
            let samples = converter::samples(kind, triad, &chain, clean, &time, chance);
            // Its own manifest has every conversion it needs.
            let triple = manifest.triple(kind, rows(samples)).ok();
            match kind {
                SensorKind::Acc => recording.acc = triple,
                SensorKind::Gyr => recording.gyr = triple,
                SensorKind::Mag => recording.mag = triple,
            }
        }
        let mut random = Random::new(self.seed, Purpose::Thermometer);
        let read = |of: &f64| converter::thermometer(*of, self.noise.then_some(&mut random));
        let temperature: Vec<f64> = temperature.iter().map(read).collect();
        recording.temperature = Some(kept.iter().map(|row| temperature[*row]).collect());
        Ok(recording)
    }

    /// What the simulator says.
    ///
    /// # Errors
    ///
    /// As [`Self::planned`].
    pub fn simulated(&self, name: &str) -> Result<Recording, SimulationError> {
        let motion = self.planned()?;
        let time = times(self.duration, self.sim_rate);
        let input = Chain::new(&[]).inputs(&motion, &time);
        let manifest = Manifest {
            site: self.place.site(),
            reference: Some(ReferenceInfo {
                kind: ReferenceKind::Simulator,
                noise: None,
                name: Some(self.kind.name().to_owned()),
            }),
            ..Manifest::default()
        };
        let mut recording = Recording::new(name, manifest, time);
        let of = |value: fn(&Input) -> Vector3<f64>| Some(input.iter().map(value).collect());
        recording.simulated = Some(Simulated {
            acc: of(|row| row.f_q),
            gyr: of(|row| row.w_iq_q),
            mag: of(|row| row.b_q),
            temperature: None,
        });
        Ok(recording)
    }

    /// Rows that are not lost; the first is never.
    fn kept(&self, rows: usize) -> Vec<usize> {
        let mut random = Random::new(self.seed, Purpose::Loss);
        (0..rows).filter(|row| random.share() >= self.dropped || *row == 0).collect()
    }
}

fn times(duration: f64, rate: f64) -> Vec<f64> {
    (0..(duration * rate).floor() as usize).map(|k| k as f64 / rate).collect()
}

#[cfg(test)]
mod tests;
