//! A gyroscope's motions on a rig at several temperatures: gain, bias and the scale's terms. The bias' terms come from the
//! still stretches between them ([`super::rest_rates`]).

use imucal_core::{
    model::{
        parameterisation::FULL,
        thermal::{Side, ThermalForm},
    },
    observation::Motion,
    triad::Triad,
};
use nalgebra::{DMatrix, DVector};

use super::{
    finding::{Part, TemperatureFinding},
    groups::Group,
    ladder::{self, Climbed},
    problem::{Problem, form, shares},
    rests::Kept,
    terms::Terms,
};
use crate::{
    calibrate::fit::gyr_rig_fit::{self, Weighted},
    observe::motion::MotionData,
};

/// Full gain, bias and the scale's terms.
const FORM: ThermalForm<12, 18> =
    form(&[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11], &[Group::Scale, Group::ScaleQuadratic], Side::Gain);

/// Adds what became of the scale's terms; these, where some are kept. `near` is the triad by a fit without terms.
pub fn estimate(
    data: &[&MotionData],
    temperatures: &[f64],
    near: &Triad<f64>,
    finding: &mut TemperatureFinding,
) -> Option<Kept> {
    let reference = finding.reference;
    let motions: Vec<Motion<'_, f64>> = data.iter().map(|data| data.motion()).collect();
    let weights = gyr_rig_fit::weights(data);
    let times: Vec<f64> = data.iter().map(|data| 0.5 * (data.span.start + data.span.end)).collect();
    let given = Warm { motions: &motions, weights: &weights, times: &times, temperatures, near };
    let climbed = ladder::climb(data.len(), |used| Box::new(problem(&given, used, reference))).ok()?;
    finding.parts.push(Part::of(&climbed, "motions", "rad"));
    let Climbed { fit: Some(fit), left_out, .. } = climbed else { return None };
    let all = problem(&given, &fit.used, reference);
    let (terms, std) =
        (Terms::of(&all, &fit.fitted.theta, reference), Terms::of(&all, &fit.std(), reference));
    finding.add_scale(terms, std);
    Some(Kept { terms, fit, left_out, temperatures: temperatures.to_vec() })
}

#[derive(Clone, Copy)]
struct Warm<'a> {
    motions: &'a [Motion<'a, f64>],
    weights: &'a [f64],
    times: &'a [f64],
    temperatures: &'a [f64],
    near: &'a Triad<f64>,
}

fn problem<'a>(
    given: &Warm<'a>,
    used: &[usize],
    reference: f64,
) -> Problem<'a, impl Fn(usize) -> Option<Weighted<'a, 12>> + Sync + use<'a>, 12, 18> {
    let Warm { motions, weights, times, temperatures, near } = *given;
    let chosen = used.to_vec();
    Problem {
        of: move |k| {
            let at = *chosen.get(k)?;
            Some(Weighted { motions: motions.get(at..=at)?, weights: weights.get(at..=at)?, form: FULL })
        },
        form: FORM,
        changes: super::problem::changes(used.iter().map(|k| temperatures[*k]), reference),
        times: shares(&used.iter().map(|k| times[*k]).collect::<Vec<_>>()),
        each: 3,
        independent: 3 * used.len(),
        start: FULL.theta(near),
        noise: Box::new(|residuals: &DVector<f64>, jacobian: &DMatrix<f64>, influence: &DMatrix<f64>| {
            let left = residuals + jacobian * -influence.tr_mul(residuals);
            let freedom = residuals.len().checked_sub(jacobian.ncols()).filter(|freedom| *freedom > 0)?;
            Some(influence.tr_mul(influence) * (left.norm_squared() / freedom as f64))
        }),
    }
}
