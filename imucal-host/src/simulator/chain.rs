//! The chain from a movement to a unit's samples, with effects at their places.

use imucal_core::triad::Triad;
use nalgebra::Vector3;
use rayon::prelude::*;

use super::{dose::Dose, error::OutputError, recent::Recent, truth::Motion};
use crate::{
    effect::{Act, CATALOGUE, DataRun, Effect, Input, Machine, SensorRun, SignalRun, Truth},
    recording::SensorKind,
};

/// Rows that one core simulates at a time, at least.
const TOGETHER: usize = 512;

/// Effects in the order of the chain; those that are off are left out, so that they change not a bit.
#[derive(Clone, Debug, Default)]
pub struct Chain<'a> {
    doses: Vec<&'a Dose>,
}

impl<'a> Chain<'a> {
    /// A chain with these effects, given in any order. Of two doses of one effect, both act.
    pub fn new(doses: &'a [Dose]) -> Self {
        let mut active: Vec<&Dose> = doses.iter().filter(|dose| dose.acts()).collect();
        active.sort_by_key(|dose| place(dose.effect));
        Self { doses: active }
    }

    /// Some effect looks at other rows than its own, so that a run has to be given to it whole.
    pub fn remembers(&self) -> bool {
        self.doses.iter().any(|dose| dose.effect.act.remembers())
    }

    /// Some effect alters samples behind the converter, where it may repeat those of other rows.
    pub fn alters_samples(&self) -> bool {
        self.doses.iter().any(|dose| matches!(dose.effect.act, Act::Data(..)))
    }

    /// The truth of each row: times of the sensor's clock, s.
    pub fn truth(&self, motion: &dyn Motion, times: &[f64]) -> Vec<Truth> {
        let row = |recent: &mut Recent, time: &f64| self.row(motion, *time, recent);
        times.par_iter().with_min_len(TOGETHER).map_init(Recent::default, row).collect()
    }

    /// The rows as a unit is given them whose axes are the table's.
    pub fn inputs(&self, motion: &dyn Motion, times: &[f64]) -> Vec<Input> {
        let row = |recent: &mut Recent, time: &f64| Input::of(&self.row(motion, *time, recent));
        times.par_iter().with_min_len(TOGETHER).map_init(Recent::default, row).collect()
    }

    fn row(&self, motion: &dyn Motion, time: f64, recent: &mut Recent) -> Truth {
        let shown = self.doses.iter().fold(time, |shown, dose| match dose.effect.act {
            Act::Clock(alter) => alter(&dose.values, shown),
            _ => shown,
        });
        let rig = |machine: &mut Machine| {
            for dose in &self.doses {
                if let Act::Rig(alter) = dose.effect.act {
                    alter(&dose.values, machine);
                }
            }
        };
        let mut row = motion.truth_among(shown, &rig, recent);
        row.time = time;
        for dose in &self.doses {
            if let Act::Field(alter) = dose.effect.act {
                alter(&dose.values, &mut row);
            }
        }
        row
    }

    /// A triad's output without noise, SI units: K v + b, and what effects make of it.
    ///
    /// # Errors
    ///
    /// [`OutputError`], where K is singular or a user's formula has no value.
    pub fn output(
        &self,
        kind: SensorKind,
        triad: &Triad<f64>,
        input: &[Input],
    ) -> Result<Vec<Vector3<f64>>, OutputError> {
        let (triad, sensed) = self.sensed(kind, triad, input)?;
        self.output_of(kind, &triad.bias, input, &sensed)
    }

    /// The same, of what its axes sense.
    ///
    /// # Errors
    ///
    /// [`OutputError`], where a user's formula has no value.
    pub fn output_of(
        &self,
        kind: SensorKind,
        bias: &Vector3<f64>,
        input: &[Input],
        sensed: &[Vector3<f64>],
    ) -> Result<Vec<Vector3<f64>>, OutputError> {
        let mut output: Vec<_> = sensed.iter().map(|sensed| sensed + bias).collect();
        let mut run = SensorRun { input, sensed, output: &mut output };
        for dose in &self.doses {
            match dose.effect.act {
                Act::Sensor(of, alter) if of == kind => alter(&dose.values, &mut run.rows()),
                Act::Memory(of, alter) if of == kind => alter(&dose.values, &mut run),
                Act::Formula(of, formula) if of == kind => formula.add(&dose.values, &mut run)?,
                _ => {}
            }
        }
        Ok(output)
    }

    /// A triad as the chain alters it, and what its axes sense: its output less its bias, before the other effects; SI units.
    ///
    /// # Errors
    ///
    /// [`OutputError`], where K is singular.
    pub fn sensed(
        &self,
        kind: SensorKind,
        triad: &Triad<f64>,
        input: &[Input],
    ) -> Result<(Triad<f64>, Vec<Vector3<f64>>), OutputError> {
        let mut triad = *triad;
        for dose in &self.doses {
            if let Act::Triad(of, alter) = dose.effect.act
                && of == kind
            {
                alter(&dose.values, &mut triad);
            }
        }
        let k = triad.sensitivity().ok_or(OutputError::Singular { sensor: kind })?;
        Ok((triad, input.iter().map(|row| k * row.given(kind)).collect()))
    }

    /// Noise and limit of a triad on the way to its converter.
    pub fn signal(&self, kind: SensorKind, mut run: SignalRun<'_>) {
        for dose in &self.doses {
            if let Act::Signal(of, alter) = dose.effect.act
                && of == kind
            {
                alter(&dose.values, &mut run);
            }
        }
    }

    /// Samples of a triad after its converter.
    pub fn data(&self, kind: SensorKind, samples: &mut [Vector3<f64>]) {
        let mut run = DataRun { samples };
        for dose in &self.doses {
            if let Act::Data(of, alter) = dose.effect.act
                && of == kind
            {
                alter(&dose.values, &mut run);
            }
        }
    }
}

/// Where an effect stands in the chain: a user's formula comes before the sensor's low-pass, which filters it too.
fn place(effect: &Effect) -> (Option<usize>, bool) {
    let of = |id: &str| CATALOGUE.iter().position(|entry| entry.id == id);
    match effect.act {
        Act::Formula(..) => (of("acc.bandwidth"), false),
        _ => (of(&effect.id), true),
    }
}
