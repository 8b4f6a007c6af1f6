//! A gyroscope's mean rates at rest at several temperatures: bias and its terms, m = b + β δ + β₂ δ² + e.

use imucal_core::model::{
    Model, RowSink,
    thermal::{Side, ThermalForm},
};
use nalgebra::{DMatrix, DVector, SVector, Vector3};

use super::{
    finding::{Part, TemperatureFinding},
    groups::Group,
    ladder::{self, Climbed},
    problem::{Problem, form, shares},
    rests::Kept,
    terms::Terms,
};
use crate::calibrate::fit::{rest_covariance::RestCovariance, rest_noise::RestNoise};

/// Bias and its terms.
const FORM: ThermalForm<12, 9> = form(&[9, 10, 11], &[Group::Bias, Group::BiasQuadratic], Side::Gain);

/// The mean rate of one rest.
#[derive(Clone, Copy, Debug)]
struct RestRate(Vector3<f64>);

impl Model<f64, 12> for RestRate {
    fn rows<S: RowSink<f64, 12>>(&self, theta: &SVector<f64, 12>, sink: &mut S) {
        for (axis, rate) in self.0.iter().enumerate() {
            sink.row(theta[9 + axis] - rate, &SVector::ith(9 + axis, 1.0));
        }
    }

    fn independent_rows(&self) -> usize {
        3
    }
}

/// Rests of a gyroscope.
#[derive(Clone, Copy, Debug)]
pub struct WarmRates<'a> {
    /// Mean rates less Earth's, nominal rad/s.
    pub means: &'a [Vector3<f64>],
    /// When each was, s.
    pub times: &'a [f64],
    /// Its temperature, °C.
    pub temperatures: &'a [f64],
    /// What they show of the noise of their means.
    pub noise: &'a RestNoise,
}

/// Adds what became of the bias' terms; these, where some are kept. Temperatures have been checked.
pub fn estimate(rates: &WarmRates<'_>, finding: &mut TemperatureFinding) -> Option<Kept> {
    let reference = finding.reference;
    let climbed = ladder::climb(rates.means.len(), |used| Box::new(problem(rates, used, reference)));
    let climbed = match climbed {
        Err(refusal) => {
            finding.refusal = Some(refusal);
            return None;
        }
        Ok(climbed) => climbed,
    };
    finding.parts.push(Part::of(&climbed, "rests", "rad/s"));
    let Climbed { fit: Some(fit), left_out, .. } = climbed else { return None };
    let all = problem(rates, &fit.used, reference);
    let terms = Terms::of(&all, &fit.fitted.theta, reference);
    finding.terms = Some((terms, Terms::of(&all, &fit.std(), reference)));
    Some(Kept { terms, fit, left_out, temperatures: rates.temperatures.to_vec() })
}

fn problem<'a>(
    rates: &WarmRates<'a>,
    used: &[usize],
    reference: f64,
) -> Problem<'a, impl Fn(usize) -> Option<RestRate> + Sync + use<'a>, 12, 9> {
    let means: Vec<Vector3<f64>> = used.iter().map(|k| rates.means[*k]).collect();
    let noise = RestCovariance::of_vectors(rates.noise, used);
    let mut start = SVector::<f64, 12>::zeros();
    start.fixed_rows_mut::<3>(9).copy_from(&(means.iter().sum::<Vector3<f64>>() / means.len().max(1) as f64));
    Problem {
        of: move |k| Some(RestRate(*means.get(k)?)),
        form: FORM,
        changes: super::problem::changes(used.iter().map(|k| rates.temperatures[*k]), reference),
        times: shares(&used.iter().map(|k| rates.times[*k]).collect::<Vec<_>>()),
        each: 3,
        independent: 3 * used.len(),
        start,
        noise: Box::new(
            move |residuals: &DVector<f64>, jacobian: &DMatrix<f64>, influence: &DMatrix<f64>| {
                Some(noise.as_ref()?.errors(residuals, jacobian, influence)?.covariance)
            },
        ),
    }
}
