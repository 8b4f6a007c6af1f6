//! What warmth does to a sensor, from a session's rests at several temperatures.
//!
//! ```text
//! accelerometer:  | f ∘ gain · (m − b − β δ) | = g,   f = 1 + s δ        gyroscope:  m = b + β δ        δ = (θ − θ₀) / 10 K
//! ```
//!
//! | file | what |
//! | --- | --- |
//! | `evidence` | rests at their temperatures as rows of a fit |
//! | `ladder` | which terms are kept |
//!
//! The terms are those of [`crate::model::thermal`]. The bias' are tried first, then the scale's, then both. They are kept where a variance
//! ratio as large has a chance of one in a thousand, where the order of the rests explains their residuals less well than their
//! temperature does, and where rests of temperatures that the fit has not seen (5 K at a time) are predicted better. Nothing is tried
//! below 10 K of span or where the temperature runs with time alone ([`crate::temperature::course`]).
//!
//! Not modelled: the scale of a gyroscope, which rests do not show; terms of the second order; the drift of an accelerometer within
//! the fit of a gyroscope's turns; noise of rests that wanders.

mod evidence;
mod ladder;

use heapless::Vec;
use nalgebra::{Matrix3, SVector, Vector3};

use super::{
    Session,
    axes::Axes,
    evidence::Used,
    fitting::acc_limits,
    store::{NotStored, known_terms, model_of},
};
use crate::{
    accept::Limits,
    fit::{Criteria, FitSummary, Observed, Units, standard_errors},
    model::{
        parameterisation::{FULL, UPPER_TRIANGULAR},
        thermal::UNIT,
    },
    observation::ShellPoint,
    observer::thermometer::ThermometerFault,
    record::{Order, Sensor, TriadRecord},
    temperature::{
        TemperatureTerms,
        course::{self, LEAST_APART, LEAST_SPAN},
    },
    triad::Triad,
};
use evidence::{Evidence, FORM, Groups, Part, Theta};
use ladder::Ladder;

/// Residuals left at least where all terms are fitted.
const LEAST_FREEDOM: usize = 6;

/// Why no terms of temperature are fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NoWarmth {
    /// The rests of a magnetometer say nothing of it.
    OtherSensor,
    /// A rest has no temperature.
    NotMeasured,
    /// The thermometer jumps or is stuck.
    Thermometer(ThermometerFault<f32>),
    /// There are too few rests.
    TooFewRests {
        /// Rests.
        have: usize,
        /// Needed at least.
        need: usize,
    },
    /// The temperatures are too near to one another, K.
    Narrow {
        /// From the lowest to the highest.
        span: f32,
        /// Needed at least.
        need: f32,
    },
    /// The temperature rises or falls with time, from which it cannot be distinguished.
    AloneWithTime {
        /// Share of its variance that no monotone function of time has.
        apart: f32,
        /// Needed at least.
        need: f32,
    },
}

/// The fit of a sensor's terms of temperature, under way.
#[derive(Clone, Debug)]
pub struct WarmthFit<const N: usize> {
    ladder: Ladder<N>,
}

/// A triad and its terms of temperature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WarmTriad {
    /// Gain and bias at the reference temperature, nominal SI in. The gain of a gyroscope is the identity: rests do not show it.
    pub triad: Triad<f32>,
    /// Their standard errors.
    pub std: Triad<f32>,
    /// The terms, nominal SI in.
    pub terms: TemperatureTerms<f32>,
    /// Their standard errors; zero where a term is not estimated.
    pub terms_std: TemperatureTerms<f32>,
    /// Lowest and highest temperature of the rests, °C.
    pub span: (f32, f32),
}

impl<const N: usize, const B: usize, const M: usize> Session<N, B, M> {
    /// Begins the fit of a sensor's terms of temperature, to the rests as they are now.
    ///
    /// # Errors
    ///
    /// [`NoWarmth`]: why none can be fitted.
    #[inline(never)]
    pub fn warmth(&self, sensor: Sensor) -> Result<WarmthFit<N>, NoWarmth> {
        if sensor == Sensor::Magnetometer {
            return Err(NoWarmth::OtherSensor);
        }
        let (mut means, mut temperatures) = (Vec::<Vector3<f32>, N>::new(), Vec::<f32, N>::new());
        for pose in self.poses.list() {
            let mean = if sensor == Sensor::Accelerometer { pose.acc } else { pose.gyr };
            if mean.x.is_finite() && mean.y.is_finite() && mean.z.is_finite() {
                let _room = (means.push(mean), temperatures.push(pose.temperature));
            }
        }
        let reference = check::<N>(&temperatures, self.thermometer.fault())?;
        let rests = means.len();
        let last = rests.saturating_sub(1).max(1) as f32;
        let (mut changes, mut order) = (Vec::new(), Vec::new());
        for (at, temperature) in temperatures.iter().enumerate() {
            let place = 2.0 * at as f32 / last - 1.0;
            let _room = (changes.push((temperature - reference) / UNIT as f32), order.push(place));
        }
        let (least, norm) = (course::span(&temperatures).0, self.settings.gravity);
        let evidence = Evidence { sensor, norm, reference, least, means, changes, order, used: Used::ALL };
        let most = evidence.parameters(evidence.offered()).saturating_add(LEAST_FREEDOM);
        if evidence.rows() < most {
            let each = evidence.rows() / rests.max(1);
            return Err(NoWarmth::TooFewRests { have: rests, need: most.div_ceil(each.max(1)) });
        }
        let start = FORM.theta(&FULL.theta(&Triad::identity()));
        Ok(WarmthFit { ladder: Ladder::new(evidence, start) })
    }

    /// A sensor's calibration with terms of temperature where its rests bear them out: [`Self::warmth`] to its end, then
    /// [`Self::better_warm`]. It takes as long as a few dozen fits; who has samples to take meanwhile calls those by slices.
    ///
    /// # Errors
    ///
    /// [`NotStored`]; then the stored one is to be kept.
    pub fn better_at_temperatures<O: Order>(
        &self,
        sensor: Sensor,
        units: &Units,
        stored: Option<&TriadRecord<O>>,
        axes: &Axes,
    ) -> Result<TriadRecord, NotStored> {
        let Ok(mut fit) = self.warmth(sensor) else { return self.better(sensor, units, stored, axes) };
        while fit.work() {}
        self.better_warm(sensor, &fit, units, stored, axes)
    }

    /// A sensor's calibration with the terms of temperature that a fit has kept, for the record, if it is accepted and surer than the
    /// one `stored`; without such terms that of [`Self::better`]. Terms that the rests do not show are those of the stored one.
    ///
    /// # Errors
    ///
    /// [`NotStored`]; then the stored one is to be kept.
    #[inline(never)]
    pub fn better_warm<O: Order>(
        &self,
        sensor: Sensor,
        fit: &WarmthFit<N>,
        units: &Units,
        stored: Option<&TriadRecord<O>>,
        axes: &Axes,
    ) -> Result<TriadRecord, NotStored> {
        let Some(warm) = fit.found() else { return self.better(sensor, units, stored, axes) };
        self.not_mirrored(sensor)?;
        let mut new = match sensor {
            Sensor::Accelerometer => {
                fit.accelerometer(&warm)?.record(&warm.triad, &warm.std, model_of(sensor), units)
            }
            _ => {
                let estimate = self.estimate(sensor).ok_or(NotStored::NoEstimate)?;
                estimate.verdict.map_err(NotStored::Refused)?;
                let (triad, std) = (&estimate.triad, &estimate.std);
                let triad = Triad { bias: warm.triad.bias, ..*triad };
                let std = Triad { bias: warm.std.bias, ..*std };
                estimate.summary.record(&triad, &std, model_of(sensor), units)
            }
        };
        let groups = fit.ladder.kept().unwrap_or(Groups::NONE);
        let mut terms = warm.terms.in_unit(units.per_unit);
        terms.scale_slope = axes.scale_slope(&terms.scale_slope);
        // Those that the rests do not show stay as they are known.
        if let Some(known) = known_terms(&new, stored, terms.reference) {
            if !groups.has(Groups::BIAS) {
                terms.bias_slope = known.bias_slope;
            }
            if !groups.has(Groups::SCALE) {
                terms.scale_slope = known.scale_slope;
            }
        }
        new.temperature = Some(terms);
        self.surer(sensor, new, units, stored, axes)
    }
}

impl<const N: usize> WarmthFit<N> {
    /// One slice: an iteration of a fit; false once nothing is left to be done.
    pub fn work(&mut self) -> bool {
        self.ladder.step()
    }

    /// The triad with the terms that are kept; `None` before the end, and where none are.
    #[inline(never)]
    pub fn found(&self) -> Option<WarmTriad> {
        self.ladder.kept()?;
        let theta = *self.ladder.solver.theta();
        let errors = standard_errors(&Some(self.ladder.covariance()?));
        let evidence = &self.ladder.evidence;
        let triad = |all: &Theta| UPPER_TRIANGULAR.triad(&SVector::from_fn(|k, _| at(all, k)));
        let (mut own, mut std) = (triad(&theta), triad(&errors));
        if evidence.sensor != Sensor::Accelerometer {
            (own.gain, std.gain) = (Matrix3::identity(), Matrix3::zeros());
        }
        Some(WarmTriad {
            triad: own,
            std,
            terms: self.ladder.only_kept(FORM.terms(&theta, evidence.reference)),
            terms_std: self.ladder.only_kept(FORM.terms(&errors, evidence.reference)),
            span: evidence.span(),
        })
    }

    /// Figures of an accelerometer's fit, if it is accepted.
    #[inline(never)]
    fn accelerometer(&self, warm: &WarmTriad) -> Result<FitSummary<f32>, NotStored> {
        let Ladder { evidence, solver, .. } = &self.ladder;
        let mut points: Vec<ShellPoint<f32>, N> = Vec::new();
        for (at, mean) in evidence.means.iter().enumerate() {
            if evidence.used.has(at) {
                let _room = points.push(ShellPoint::new(*mean));
            }
        }
        let radius = evidence.norm * libm::sqrtf(3.0 / warm.triad.gain.norm_squared());
        let groups = self.ladder.kept().unwrap_or(Groups::NONE);
        let parameters = evidence.parameters(groups);
        let limits = Limits { observations: parameters + 1, ..acc_limits() };
        let criteria = Criteria { observed: Observed::Points(&points), limits, radius, nonlinearity: true };
        let model = evidence.model(groups, Part::Whole);
        let of_all = FitSummary::of(solver, &model, &warm.triad, &criteria);
        let summary = FitSummary { parameters, ..of_all };
        summary.check(&warm.triad, &warm.std, &criteria).map_err(NotStored::Refused)?;
        Ok(summary)
    }
}

/// The mean of temperatures from which terms can be estimated, °C.
fn check<const N: usize>(
    temperatures: &[f32],
    fault: Option<ThermometerFault<f32>>,
) -> Result<f32, NoWarmth> {
    if let Some(fault) = fault {
        return Err(NoWarmth::Thermometer(fault));
    }
    if temperatures.is_empty() || temperatures.iter().any(|value| !value.is_finite()) {
        return Err(NoWarmth::NotMeasured);
    }
    let (least, most) = course::span(temperatures);
    let need = LEAST_SPAN as f32;
    if most - least < need {
        return Err(NoWarmth::Narrow { span: most - least, need });
    }
    let apart = course::apart(temperatures, &mut [(0.0, 0.0); N]);
    let need = LEAST_APART as f32;
    if apart < need {
        return Err(NoWarmth::AloneWithTime { apart, need });
    }
    Ok(temperatures.iter().sum::<f32>() / temperatures.len() as f32)
}

fn at(all: &Theta, k: usize) -> f32 {
    all.get(k).map_or(0.0, |value| *value)
}
