//! An accelerometer's rests at several temperatures: gain, bias and their terms from |f ∘ gain · (raw − bias(θ))| = g.

use imucal_core::{
    model::{
        norm::NormModel,
        parameterisation::FULL,
        thermal::{Side, ThermalForm},
    },
    observation::ShellPoint,
    triad::Triad,
};
use nalgebra::{DMatrix, DVector, Vector3};

use super::{
    finding::{Part, TemperatureFinding},
    groups::Group,
    ladder::{self, Climbed, ThermalFit},
    problem::{Problem, form, shares},
    terms::Terms,
    thermometry::Thermometry,
};
use crate::calibrate::fit::{rest_covariance::RestCovariance, rest_noise::RestNoise, shell_errors::normals};

/// Upper triangular gain and bias, and all terms.
const T9: ThermalForm<12, 21> = form(&[0, 1, 2, 4, 5, 8, 9, 10, 11], &Group::ALL, Side::Gain);
/// Diagonal gain and bias, and all terms.
const T6: ThermalForm<12, 18> = form(&[0, 4, 8, 9, 10, 11], &Group::ALL, Side::Gain);

/// Rests of an accelerometer.
#[derive(Clone, Copy, Debug)]
pub struct WarmRests<'a> {
    /// Means, nominal SI.
    pub points: &'a [ShellPoint<f64>],
    /// When each was, s.
    pub times: &'a [f64],
    /// Its temperature, °C.
    pub temperatures: &'a [f64],
    /// Local gravity, m/s².
    pub gravity: f64,
    /// What they show of the noise of their means.
    pub noise: &'a RestNoise,
    /// Only the gain's diagonal is estimated.
    pub diagonal: bool,
}

/// Terms of some observations and the fit that found them.
#[derive(Clone, Debug)]
pub struct Kept {
    /// The terms.
    pub terms: Terms,
    /// The fit.
    pub fit: ThermalFit,
    /// Observations left out of it, with their size in robust standard deviations.
    pub left_out: Vec<(usize, f64)>,
    /// Temperature of every observation, °C.
    pub temperatures: Vec<f64>,
}

impl Kept {
    /// The bias at the reference temperature, of a fit to rates at rest.
    pub fn rest_bias(&self) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| self.fit.fitted.theta[axis])
    }
}

/// What became of the terms, and these where some are kept. `near` is the triad by a fit without them.
pub fn estimate(
    rests: &WarmRests<'_>,
    thermometry: &Thermometry<'_>,
    near: &Triad<f64>,
) -> (TemperatureFinding, Option<Kept>) {
    let finding = TemperatureFinding::new(rests.temperatures);
    if let Err(refusal) = thermometry.check(rests.temperatures) {
        return (finding.refused(refusal), None);
    }
    if rests.diagonal { with_form(rests, finding, near, T6) } else { with_form(rests, finding, near, T9) }
}

fn with_form<const P: usize>(
    rests: &WarmRests<'_>,
    mut finding: TemperatureFinding,
    near: &Triad<f64>,
    form: ThermalForm<12, P>,
) -> (TemperatureFinding, Option<Kept>) {
    let reference = finding.reference;
    let climbed =
        ladder::climb(rests.points.len(), |used| Box::new(problem(rests, used, near, reference, form)));
    let climbed = match climbed {
        Err(refusal) => return (finding.refused(refusal), None),
        Ok(climbed) => climbed,
    };
    finding.parts.push(Part::of(&climbed, "rests", "m/s^2"));
    let Climbed { fit: Some(fit), left_out, .. } = climbed else { return (finding, None) };
    let all = problem(rests, &fit.used, near, reference, form);
    let terms = Terms::of(&all, &fit.fitted.theta, reference);
    finding.terms = Some((terms, Terms::of(&all, &fit.std(), reference)));
    (finding, Some(Kept { terms, fit, left_out, temperatures: rests.temperatures.to_vec() }))
}

fn problem<'a, const P: usize>(
    rests: &WarmRests<'a>,
    used: &[usize],
    near: &Triad<f64>,
    reference: f64,
    form: ThermalForm<12, P>,
) -> Problem<'a, impl Fn(usize) -> Option<NormModel<'a, f64, 12>> + Sync + use<'a, P>, 12, P> {
    let (points, norm) = (rests.points, rests.gravity);
    let chosen = used.to_vec();
    let seen: Vec<ShellPoint<f64>> = used.iter().map(|k| points[*k]).collect();
    let noise = RestCovariance::along(rests.noise, used, &normals(near, &seen));
    Problem {
        of: move |k| {
            let at = *chosen.get(k)?;
            Some(NormModel { points: points.get(at..=at)?, norm, form: FULL })
        },
        form,
        changes: super::problem::changes(used.iter().map(|k| rests.temperatures[*k]), reference),
        times: shares(&used.iter().map(|k| rests.times[*k]).collect::<Vec<_>>()),
        each: 1,
        independent: used.len(),
        start: FULL.theta(near),
        noise: Box::new(
            move |residuals: &DVector<f64>, jacobian: &DMatrix<f64>, influence: &DMatrix<f64>| {
                Some(noise.as_ref()?.errors(residuals, jacobian, influence)?.covariance)
            },
        ),
    }
}
