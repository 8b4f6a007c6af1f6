//! Where the fit of a baseline begins if no rig guides the sensor.
//!
//! Sensors share what a reference does not show: its clock, its tilt, its heading. A magnet near one of them would pull
//! at all that it shares, and by way of it at the others. So each is heard in turn: first the gyroscope, of which
//! nothing but the clock is shared; then the accelerometer, which shows the tilt; the magnetometer last, once drift and
//! scatter of its own are known.

use super::refit::{Fit, refit};
use crate::{
    diagnosis::{
        error::DiagnosisError,
        mixed_model::noise::{Noise, Weighing},
        residual::{base_run::Reference, forward_model::ForwardModel},
    },
    effect::{Effect, Part},
    recording::SensorKind,
    simulator::Dose,
};

/// Sensors are fitted in this order; each stage estimates their terms, the clock, and what of the rig they show.
const STAGES: [&[SensorKind]; 2] = [&[SensorKind::Gyr], &[SensorKind::Gyr, SensorKind::Acc]];
/// Fits of each, each with the noise that the last one left.
const ROUNDS: usize = 2;
/// White noise of one that is not yet heard is taken for so many times what it is.
const MUTED: f64 = 1e6;

/// Fits the baseline to the sensors in turn. `None` where the simulator fails.
pub fn start(scene: &ForwardModel<'_>, doses: Vec<Dose>) -> Result<Fit, DiagnosisError> {
    let mut fit = Fit::of(scene, doses)?;
    for heard in STAGES {
        let is_shown = |effect: &Effect| match effect.part {
            Part::ClockTerm => true,
            Part::RigTerm(shown_by) => shown_by.iter().any(|kind| heard.contains(kind)),
            _ => effect.sensors.iter().all(|kind| heard.contains(kind)),
        };
        let (asked, rest): (Vec<Dose>, Vec<Dose>) =
            fit.doses.iter().cloned().partition(|dose| is_shown(dose.effect));
        fit = fit.with(scene, asked)?;
        for _ in 0..ROUNDS {
            let reference = Reference::new(scene, fit.doses.clone(), &scene.fine)?;
            let weighing = Weighing::new(scene, SensorKind::ALL.map(|kind| reference.output(kind)));
            let noise = muted(weighing.white(&fit.residual), heard);
            fit = refit(scene, fit, Some(&noise))?;
        }
        let all = fit.doses.iter().cloned().chain(rest).collect();
        fit = fit.with(scene, all)?;
    }
    Ok(fit)
}

/// A noise that lets only these sensors be heard.
fn muted(mut noise: Noise, heard: &[SensorKind]) -> Noise {
    for kind in SensorKind::ALL.into_iter().filter(|kind| !heard.contains(kind)) {
        let sensor = &mut noise.sensors[kind as usize];
        sensor.white.iter_mut().chain(&mut sensor.moving).for_each(|sigma| *sigma *= MUTED);
    }
    noise
}
