//! What the flight motion simulator is to record: programme, unit, effects and a seed.

use super::{
    SimulationError,
    conditions::Conditions,
    dose::Dose,
    programme::{Programme, Schedule},
    random::{Purpose, Random},
    truth::Motion,
    unit::{UnitKind, UnitUnderTest},
};
use crate::{effect::Effect, recording::manifest::Axis};

/// Rates there is a recording of, Hz.
const RATES: (f64, f64) = (10.0, 1000.0);
/// Longest recording, s.
const LONGEST: f64 = 21_600.0;

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

    /// Another recording of the same unit.
    #[must_use]
    pub fn again(&self) -> Self {
        let unit_seed = self.unit_seed.or(Some(self.seed));
        Self { seed: self.seed.wrapping_add(1), unit_seed, ..self.clone() }
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
}

#[cfg(test)]
mod tests;
