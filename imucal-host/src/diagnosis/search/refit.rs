//! Non-linear least squares through the simulator: baseline and chosen effects together.
//!
//! Gauss–Newton: the residual at full rate, its derivative from the nodes. Steps that make it worse are halved.

use crate::noise::precision::ChannelPrecision;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::{
    diagnosis::{
        error::DiagnosisError,
        library::candidates,
        mixed_model::{
            design::{Column, Design, Signature},
            noise::{Noise, Weighing},
        },
        residual::{base_run::Reference, block::Means, forward_model::ForwardModel},
    },
    effect::{Effect, Role},
    simulator::Dose,
};

/// Steps at most.
const STEPS: usize = 8;
/// A step is small enough when no parameter moves by more than this share of its standard error.
const SETTLED: f64 = 0.05;
/// A step that would move none by more than this share is not tried: what it gains is lost in the energy's rounding.
const DONE: f64 = 1e-4;
/// After a step that moved none by more than this many of them, the derivative is that of before.
const NEAR: f64 = 1.0;

/// Prior standard deviation of a term of the baseline, in usual sizes.
const FREE: f64 = 1e4;
/// Of an effect.
const LARGE: f64 = 30.0;
/// A shape goes no further than this in one step, in usual sizes; it is not drawn to anywhere.
const STRIDE: f64 = 1.0;

/// Effects with fitted amplitudes and what they leave.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Baseline and chosen effects.
    pub doses: Vec<Dose>,
    /// Recorded less simulated.
    pub residual: Means,
}

impl Fit {
    /// Doses as they are, and what they leave.
    ///
    /// # Errors
    ///
    /// [`DiagnosisError`], when the simulator fails.
    pub fn of(scene: &ForwardModel<'_>, doses: Vec<Dose>) -> Result<Self, DiagnosisError> {
        Ok(Self { residual: scene.residual(&doses)?, doses })
    }

    /// The same with other doses in their place; where the same of them act, they leave the same.
    ///
    /// # Errors
    ///
    /// As [`Self::of`].
    pub fn with(self, scene: &ForwardModel<'_>, doses: Vec<Dose>) -> Result<Self, DiagnosisError> {
        let (before, now) = (self.doses.iter(), doses.iter());
        if before.filter(|dose| dose.acts()).eq(now.filter(|dose| dose.acts())) {
            return Ok(Self { doses, ..self });
        }
        Self::of(scene, doses)
    }
}

/// All amplitudes of some effects, and their details where these are fitted.
pub fn columns(scene: &ForwardModel<'_>, effects: &[&'static Effect]) -> Vec<Column> {
    let of = |effect: &'static Effect| {
        let details = effect.details().filter(|_| scene.settings.search.fits_details);
        effect.amplitudes().chain(details).map(move |parameter| Column { effect, parameter })
    };
    effects.iter().flat_map(|effect| of(effect)).collect()
}

/// All amplitudes of some doses, and the shapes of those.
fn free(scene: &ForwardModel<'_>, doses: &[Dose]) -> Vec<Column> {
    let of = |dose: &Dose| -> Vec<Column> {
        let effect = dose.effect;
        let shapes = effect.shapes_at(&dose.values).map(|parameter| Column { effect, parameter });
        columns(scene, &[effect]).into_iter().chain(shapes).collect()
    };
    doses.iter().flat_map(of).collect()
}

/// Signatures of columns in a run; `neutral` gives an effect's parameters where the run does not hold it. `None` where
/// a triad becomes singular.
pub fn signatures(
    reference: &Reference<'_>,
    columns: &[Column],
    neutral: &(dyn Fn(&'static Effect) -> Vec<f64> + Sync),
) -> Result<Vec<Signature>, DiagnosisError> {
    let of = |column: &Column| {
        let means = reference.signature(column.effect, column.parameter, &neutral(column.effect))?;
        Ok(Signature::from(means))
    };
    columns.par_iter().map(of).collect()
}

/// Fits the amplitudes of all doses, from what they are.
pub fn refit(scene: &ForwardModel<'_>, mut fit: Fit, noise: Option<&Noise>) -> Result<Fit, DiagnosisError> {
    let columns = free(scene, &fit.doses);
    let mut least: Option<Noise> = None;
    let mut near: Option<(Weighing<'_>, Design)> = None;
    for _ in 0..STEPS {
        let (weighing, design) = match near.take() {
            Some((weighing, design)) => (weighing, design.leaving(&fit.residual)),
            None => {
                let reference = Reference::new(scene, fit.doses.clone(), &scene.fine)?;
                let signatures = signatures(&reference, &columns, &|_| Vec::new())?;
                let given = crate::recording::SensorKind::ALL.map(|kind| reference.output(kind));
                let design = Design::new(scene, columns.clone(), &signatures, &fit.residual);
                (Weighing::new(scene, given), design)
            }
        };
        let noise = noise.cloned().unwrap_or_else(|| {
            let white = weighing.white(&fit.residual);
            least.as_ref().map_or_else(|| white.clone(), |least| white.clone().at_most(least))
        });
        least = Some(noise.clone());
        let precisions = weighing.precisions(&design, &noise);
        let (step, largest) = step(&fit, &columns, &design, &precisions)?;
        if largest < DONE {
            break;
        }
        let energy = |fit: &Fit| {
            let (precision, at) = prior(&fit.doses, &columns);
            let data = Design::of_residual(scene, &fit.residual).normal(&precisions, &[]).energy;
            data + precision.component_mul(&at).dot(&at)
        };
        let before = energy(&fit);
        let mut factor = 1.0;
        let better = loop {
            let tried = Fit::of(scene, moved_by(&fit.doses, &columns, &(&step * factor)))?;
            if energy(&tried) <= before + 1e-9 {
                break Some(tried);
            }
            factor *= 0.5;
            if factor < 0.05 || largest < SETTLED {
                break None;
            }
        };
        let Some(better) = better else { return Ok(fit) };
        fit = better;
        if largest < SETTLED {
            break;
        }
        near = (largest < NEAR).then_some((weighing, design));
    }
    Ok(fit)
}

/// The Gauss–Newton step in usual sizes, and how far it goes at most in standard errors.
fn step(
    fit: &Fit,
    columns: &[Column],
    design: &Design,
    precisions: &[ChannelPrecision],
) -> Result<(DVector<f64>, f64), DiagnosisError> {
    let all: Vec<usize> = (0..columns.len()).collect();
    let normal = design.normal(precisions, &all);
    let (prior, at) = prior(&fit.doses, columns);
    let covariance = (&normal.information + DMatrix::from_diagonal(&prior)).cholesky();
    let covariance = covariance.ok_or(DiagnosisError::Fit { columns: columns.len() })?.inverse();
    let step = &covariance * (&normal.score - prior.component_mul(&at));
    let moved =
        step.iter().zip(covariance.diagonal().iter()).map(|(s, v)| s.abs() / v.sqrt()).fold(0.0, f64::max);
    Ok((step, moved))
}

/// Precision of each column's prior, and where the column stands, in usual sizes. A term of the baseline may be of any
/// size; an effect is not many times its usual one, so that what the data do not show stays small.
fn prior(doses: &[Dose], columns: &[Column]) -> (DVector<f64>, DVector<f64>) {
    let role = |column: &Column| column.effect.parameters[column.parameter].role;
    let precision = columns.iter().map(|column| {
        let loose = match role(column) {
            Role::Amplitude if candidates::is_term(column.effect) => FREE,
            Role::Amplitude => LARGE,
            _ => STRIDE,
        };
        1.0 / (loose * loose)
    });
    let at = columns.iter().map(|column| {
        if role(column) != Role::Amplitude {
            return 0.0;
        }
        let dose = doses.iter().find(|dose| column.is_of(dose.effect));
        dose.map_or(0.0, |dose| dose.values[column.parameter])
            / column.effect.parameters[column.parameter].prior_scale
    });
    (DVector::from_iterator(columns.len(), precision), DVector::from_iterator(columns.len(), at))
}

/// Doses with their amplitudes moved by usual sizes, within what can be.
fn moved_by(doses: &[Dose], columns: &[Column], step: &DVector<f64>) -> Vec<Dose> {
    let mut doses = doses.to_vec();
    for (column, step) in columns.iter().zip(step.iter()) {
        let parameter = &column.effect.parameters[column.parameter];
        if let Some(dose) = doses.iter_mut().find(|dose| dose.effect == column.effect) {
            let value = &mut dose.values[column.parameter];
            *value += step * parameter.prior_scale;
            match parameter.role {
                Role::Amplitude if parameter.range.0 < 0.0 => {}
                Role::Amplitude => *value = value.max(0.0),
                _ => *value = value.clamp(parameter.range.0, parameter.range.1),
            }
        }
    }
    doses
}
