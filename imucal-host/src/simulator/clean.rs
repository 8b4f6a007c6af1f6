//! What a unit puts out over a run before noise, and how warm it is.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::{chain::Chain, error::OutputError, truth::Motion, unit::UnitUnderTest};
use crate::{effect::Input, recording::SensorKind};

/// Rows that are simulated at a time, where no effect looks at others: what a unit is given in a row takes more memory than what it puts
/// out.
const PART: usize = 1 << 14;

/// A run without noise.
#[derive(Clone, Debug, Default)]
pub(super) struct Clean {
    /// Output of each triad, row by row, by [`SensorKind::ALL`], SI units.
    pub(super) outputs: [Vec<Vector3<f64>>; 3],
    /// Temperature of the sensor, °C.
    pub(super) temperature: Vec<f64>,
}

impl Clean {
    /// Of a unit on a movement, at these times of its clock, s.
    ///
    /// # Errors
    ///
    /// [`OutputError`], for an effect beyond reason.
    pub(super) fn of(
        unit: &UnitUnderTest,
        motion: &dyn Motion,
        chain: &Chain<'_>,
        time: &[f64],
    ) -> Result<Self, OutputError> {
        let part = if chain.remembers() { time.len().max(1) } else { PART };
        let mut clean = Self::default();
        for time in time.chunks(part) {
            let mut input = chain.inputs(motion, time);
            input.par_iter_mut().for_each(|row| *row = row.turned(&unit.c_t_q));
            for kind in SensorKind::ALL {
                let output = chain.output(kind, &unit.triad(kind).triad, &input)?;
                clean.outputs[kind as usize].extend(output);
            }
            clean.temperature.extend(input.iter().map(|row: &Input| row.temperature));
        }
        Ok(clean)
    }
}
