//! An accelerometer's poses on a rig at several temperatures: K, bias and their terms, and the base's tilt.

use imucal_core::model::{
    rig::GimbalPose,
    thermal::{Side, ThermalForm},
    unified::{Terms as Unified, UnifiedModel, UnifiedParameters},
};
use nalgebra::{DMatrix, DVector};

use super::{
    finding::{Part, TemperatureFinding},
    groups::Group,
    ladder::{self, Climbed},
    problem::{Problem, form, shares},
    refusal::TemperatureRefusal,
    rests::Kept,
    terms::Terms,
    thermometry::Thermometry,
};
use crate::{
    calibrate::{
        fit::rig_fit::RigFit,
        known_attitudes::ladder::{I14, T12},
    },
    noise::{self, Noise, Span},
    observe::pose::Poses,
};

/// K and bias, and all terms.
const OF_T12: ThermalForm<12, 24> =
    form(&[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11], &Group::ALL, Side::Sensitivity);
/// K, bias and the base's tilt, and all terms.
const OF_I14: ThermalForm<14, 26> =
    form(&[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13], &Group::ALL, Side::Sensitivity);

/// What became of the terms next to a rung of the ladder, and these where some are kept. `fit` is the rung's without them,
/// from `base`.
pub fn estimate(
    poses: &Poses,
    thermometry: &Thermometry<'_>,
    (name, fit): (&'static str, &RigFit),
    base: &UnifiedParameters<f64>,
) -> (TemperatureFinding, Option<Kept>) {
    let temperatures: Vec<f64> = poses.spans.iter().map(|span| thermometry.between(span)).collect();
    let finding = TemperatureFinding::new(&temperatures);
    if let Err(refusal) = thermometry.check(&temperatures) {
        return (finding.refused(refusal), None);
    }
    let rung = Rung { poses, temperatures: &temperatures, base, near: &fit.parameters };
    match name {
        // What the poses do not determine is held, and then there is no telling what warmth does to it.
        "T12" if fit.held.is_empty() => rung.climb(finding, T12, OF_T12),
        "I14" if fit.held.is_empty() => rung.climb(finding, I14, OF_I14),
        _ => (finding.refused(TemperatureRefusal::Model { model: name }), None),
    }
}

/// A rung and the poses it is fitted to.
#[derive(Clone, Copy)]
struct Rung<'a> {
    poses: &'a Poses,
    temperatures: &'a [f64],
    base: &'a UnifiedParameters<f64>,
    near: &'a UnifiedParameters<f64>,
}

impl<'a> Rung<'a> {
    fn climb<const S: usize, const P: usize>(
        &self,
        mut finding: TemperatureFinding,
        terms: Unified<S>,
        form: ThermalForm<S, P>,
    ) -> (TemperatureFinding, Option<Kept>) {
        let reference = finding.reference;
        let climbed = ladder::climb(self.poses.poses.len(), |used| {
            Box::new(self.problem(used, reference, terms, form))
        });
        let climbed = match climbed {
            Err(refusal) => return (finding.refused(refusal), None),
            Ok(climbed) => climbed,
        };
        finding.parts.push(Part::of(&climbed, "poses", "m/s^2"));
        let Climbed { fit: Some(fit), left_out, .. } = climbed else { return (finding, None) };
        let all = self.problem(&fit.used, reference, terms, form);
        let found = Terms::of(&all, &fit.fitted.theta, reference);
        finding.terms = Some((found, Terms::of(&all, &fit.std(), reference)));
        (finding, Some(Kept { terms: found, fit, left_out, temperatures: self.temperatures.to_vec() }))
    }

    fn problem<const S: usize, const P: usize>(
        &self,
        used: &[usize],
        reference: f64,
        terms: Unified<S>,
        form: ThermalForm<S, P>,
    ) -> Problem<'a, impl Fn(usize) -> Option<UnifiedModel<'a, f64, S>> + Sync + use<'a, S, P>, S, P> {
        let Self { poses, temperatures, base, near } = *self;
        let chosen = used.to_vec();
        let spans: Vec<Span> = used.iter().map(|k| poses.spans[*k].clone()).collect();
        let middles: Vec<f64> = spans.iter().map(|span| 0.5 * (span.start + span.end)).collect();
        Problem {
            of: move |k| {
                let at = *chosen.get(k)?;
                let poses_of: &[GimbalPose<f64>] = poses.poses.get(at..=at)?;
                Some(UnifiedModel { poses: poses_of, axes: poses.axes, base: *base, terms, held: 0 })
            },
            form,
            changes: super::problem::changes(used.iter().map(|k| temperatures[*k]), reference),
            times: shares(&middles),
            each: 3,
            independent: 3 * used.len(),
            start: terms.theta(near),
            noise: Box::new(
                move |residuals: &DVector<f64>, jacobian: &DMatrix<f64>, influence: &DMatrix<f64>| {
                    let given =
                        noise::Residuals { spans: &spans, density: poses.density, residuals, jacobian };
                    Some(Noise::of(&given)?.propagated(&spans, influence))
                },
            ),
        }
    }
}
