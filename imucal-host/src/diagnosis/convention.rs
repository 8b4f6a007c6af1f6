//! What is wrong with the recording itself: looked for before any fit, since nothing later means anything without it.
//!
//! Each check compares samples with what the simulator says they were given, or with themselves, and names an effect of
//! the catalogue, or, where the fault lies not in one sensor, says in words what would explain it. Times of rows are
//! those of [`Recording::time`]. Not looked for: columns that are shifted by a row, wrong byte order.

use super::finding::Amount;
use crate::{
    effect::{self, Effect, Truth},
    recording::{Recording, SensorKind, integrity::Integrity},
    simulator::{Dose, Motion},
};

mod axis_swap;
mod gimbal_order;
mod noise_burst;
mod pairs;
mod saturation;
mod stuck_samples;
#[cfg(test)]
mod tests;
mod unit_error;

use self::pairs::Pairs;

/// No finding is made above this probability of as much by chance.
const SURE: f64 = 1e-6;
/// Rows that are compared with the truth, at most.
const ROWS: usize = 2000;

/// A fault of the recording that is an effect of the catalogue.
#[derive(Clone, Debug)]
pub struct Finding {
    /// The effect.
    pub effect: &'static Effect,
    /// Its parameters, in the order of [`Effect::parameters`].
    pub parameters: Vec<Amount>,
    /// Upper bound of the probability of as much by chance, all places that were looked at counted.
    pub p_value: f64,
}

impl Finding {
    /// Of an effect's id, with its parameters' values and standard errors. `None` where the catalogue has no such
    /// effect or another number of parameters.
    fn new(id: &str, values: &[(Option<f64>, Option<f64>)], p_value: f64) -> Option<Self> {
        let effect = effect::find(id)?;
        let parameters: Vec<Amount> = effect
            .parameters
            .iter()
            .zip(values)
            .map(|(parameter, (value, std_error))| Amount {
                name: parameter.name.clone(),
                value: *value,
                std_error: *std_error,
                unit: parameter.unit.clone(),
            })
            .collect();
        (parameters.len() == effect.parameters.len()).then_some(Self { effect, parameters, p_value })
    }

    /// The effect with these parameters, for the simulator; `None` where one is not known.
    pub fn dose(&self) -> Option<Dose> {
        let values: Option<Vec<f64>> = self.parameters.iter().map(|parameter| parameter.value).collect();
        Some(Dose { effect: self.effect, values: values? })
    }
}

/// What the checks found.
#[derive(Clone, Debug, Default)]
pub struct Conventions {
    /// Effects, in the order of the sensors.
    pub findings: Vec<Finding>,
    /// What else a reader ought to know.
    pub remarks: Vec<String>,
    /// Code of the turn, as `axis_swap` counts them, that all triads share: that of the mount.
    pub turned: Option<usize>,
    /// How the encoders contradict every sensor: no baseline fits before that is mended.
    pub contradiction: Option<String>,
}

/// Checks a recording against a movement that was told from it or besides it.
pub fn check(recording: &Recording, integrity: &Integrity, motion: &dyn Motion) -> Conventions {
    let mut found = Conventions::default();
    let stride = recording.rows().div_ceil(ROWS).max(1);
    let rows: Vec<usize> = (stride / 2..recording.rows()).step_by(stride).collect();
    let truth: Vec<Truth> = rows.iter().map(|row| motion.truth(recording.time[*row], &|_| ())).collect();
    let pairs = SensorKind::ALL.map(|kind| Pairs::of(recording, integrity, kind, &rows, &truth));
    match gimbal_order::remark(recording, integrity, motion, &rows, &truth, &pairs) {
        // Against a wrong movement no sensor's axes mean anything.
        Some(remark) => found.contradiction = Some(remark),
        None => {
            let scales = axis_swap::check(&pairs, &mut found);
            for (kind, scale) in SensorKind::ALL.into_iter().zip(scales) {
                if let (Some(scale), Some(triple)) = (scale, recording.sensor(kind)) {
                    unit_error::check(kind, triple.unit, &scale, &mut found);
                }
            }
        }
    }
    for sensor in &integrity.sensors {
        let Some(triple) = recording.sensor(sensor.sensor) else { continue };
        saturation::check(triple, sensor, &mut found);
        stuck_samples::check(triple, sensor, &mut found);
        if motion.encoders(0.0).is_none() {
            // What a hand does besides turning is no noise of the sensor.
            continue;
        }
        let moves = |row: usize| motion.truth(recording.time[row], &|_| ()).w_pt_t.norm();
        noise_burst::check(&recording.time, triple, sensor, &moves, &mut found);
    }
    found
}
