//! A formula added to what is fitted, as effects like any other: what it closes on stretches that no fit has seen, and what
//! the sensor's residual still follows.

use crate::{
    diagnosis::{
        error::DiagnosisError,
        library::{candidates::Candidates, evidence::Projected},
        location::{
            covariate::Covariate,
            score_test::{self, Following},
        },
        mixed_model::{design::Signature, noise::Noise},
        residual::base_run::Reference,
        search::{
            linearisation::Linearisation,
            refit::{Fit, columns, signatures},
        },
        verdict::shares::{self, Share},
    },
    effect::Effect,
    recording::SensorKind,
    simulator::Dose,
};

/// A formula's effects as candidates of their own.
pub struct Joined {
    effects: Vec<&'static Effect>,
    doses: Vec<Dose>,
    signatures: Vec<Signature>,
    candidates: Candidates,
}

/// What a formula does in a recording.
#[derive(Clone, Debug)]
pub struct Tried {
    /// Share that it closes of what is left of its sensor's gap.
    pub share: Share,
    /// What the sensor's residual still follows most, beyond chance.
    pub left: Option<Following>,
    /// Amplitudes and their standard errors, effect by effect.
    pub amounts: Vec<(f64, f64)>,
}

impl Joined {
    /// Effects whose amplitudes are fitted; their shapes are the usual ones.
    ///
    /// # Errors
    ///
    /// [`DiagnosisError::Formula`], where one has no value.
    pub fn new(
        candidates: &Candidates,
        reference: &Reference<'_>,
        effects: Vec<&'static Effect>,
    ) -> Result<Self, DiagnosisError> {
        let scene = reference.scene;
        let neutral = |effect: &'static Effect| effect.neutral(scene.duration());
        let signatures = signatures(reference, &columns(scene, &effects), &neutral)?;
        let doses = effects.iter().map(|effect| Dose { effect, values: neutral(effect) }).collect();
        let mut candidates = candidates.clone();
        candidates.effects.extend(&effects);
        Ok(Self { effects, doses, signatures, candidates })
    }

    /// The problem with these effects; what is `fitted` counts as the baseline.
    pub fn problem<'c>(
        &'c self,
        linear: &'c Linearisation<'_>,
        fit: &Fit,
        fitted: &[usize],
    ) -> Linearisation<'c> {
        linear.joined(&self.candidates, fit, fitted, &self.doses, &self.signatures)
    }

    /// Tries them in the problem that [`Self::problem`] gives, in a noise that was estimated with them.
    ///
    /// # Errors
    ///
    /// [`DiagnosisError`], where nothing can be scored or held out.
    pub fn tried(
        &self,
        joined: &Linearisation<'_>,
        kind: SensorKind,
        noise: &Noise,
        drivers: &[Covariate],
    ) -> Result<Tried, DiagnosisError> {
        let by = &joined.scene.settings.location;
        let after = score_test::score_tests_refitted(joined, &self.effects, noise, drivers)?;
        let is_followed = |f: &&Following| f.kind == kind && f.p_value * after.len() as f64 <= by.p_value;
        let left = after.iter().find(is_followed).cloned();
        let remainder = left.as_ref().map_or(0.0, |left| left.size);
        let share = shares::closed_of_sensor(joined, kind, &self.effects, noise, remainder)?.total;
        Ok(Tried { share, left, amounts: self.amounts(joined, noise)? })
    }

    /// Fitted amplitudes and their standard errors.
    fn amounts(&self, joined: &Linearisation<'_>, noise: &Noise) -> Result<Vec<(f64, f64)>, DiagnosisError> {
        let fitted = joined.fitted(&self.effects);
        let normal = joined.design.normal(&joined.precisions(noise), &fitted);
        let every: Vec<usize> = (0..fitted.len()).collect();
        let (first, own) = every.split_at(joined.baseline.len());
        let places: Vec<usize> = (0..own.len()).collect();
        let estimate = Projected::new(&normal, first, own)?.estimate(&places);
        let (amplitudes, covariance) = estimate.ok_or(DiagnosisError::Estimates { columns: fitted.len() })?;
        let amount = |at: usize| {
            let column = joined.design.columns[fitted[first.len() + at]];
            let size = column.effect.parameters[column.parameter].prior_scale;
            (size * amplitudes[at], size * covariance[(at, at)].max(0.0).sqrt())
        };
        Ok(places.into_iter().map(amount).collect())
    }
}
