//! Where in time, and in what shape, each candidate is likeliest.

use std::sync::Arc;

use rayon::prelude::*;

use super::{candidates::Candidates, grid_posterior::GridPosterior, nonlinear, nonlinear::Backdrop};
use crate::{
    diagnosis::{
        error::DiagnosisError,
        mixed_model::{
            design::Design,
            noise::{Noise, Weighing},
        },
        residual::{base_run::Reference, forward_model::ForwardModel},
    },
    effect::Effect,
    simulator::Dose,
};

/// Scans the shapes of candidates. Signatures are those about the fit it was made with: what is fitted later changes where
/// they lie in the second order only, and they are computed again where their size counts.
#[derive(Clone)]
pub struct Grid<'s> {
    scene: &'s ForwardModel<'s>,
    candidates: &'s Candidates,
    coarse: Arc<Reference<'s>>,
}

/// What is fitted while candidates are shaped.
pub struct NuisanceColumns<'a> {
    /// Effects that have their shapes.
    pub doses: &'a [Dose],
    /// Weighs the blocks.
    pub weighing: &'a Weighing<'a>,
    /// The columns of those effects, and a residual.
    pub design: &'a Design,
    /// Indices of those columns.
    pub fitted: &'a [usize],
}

impl<'s> Grid<'s> {
    /// About a fit. `None` where the simulator fails.
    pub fn new(
        scene: &'s ForwardModel<'s>,
        candidates: &'s Candidates,
        doses: Vec<Dose>,
    ) -> Result<Self, DiagnosisError> {
        Ok(Self { scene, candidates, coarse: Arc::new(Reference::new(scene, doses, &scene.coarse)?) })
    }

    /// The shape of each candidate that is best under a noise; that of the doses for those they hold, as widely `spread`
    /// as it was when it was found, and what `kept` holds of others.
    pub fn shapes(
        &self,
        nuisance: &NuisanceColumns<'_>,
        noise: &Noise,
        spread: &(dyn Fn(usize) -> f64 + Sync),
        kept: &(dyn Fn(usize) -> Option<GridPosterior> + Sync),
    ) -> Result<Vec<GridPosterior>, DiagnosisError> {
        let (scene, design) = (self.scene, nuisance.design);
        let precisions = nuisance.weighing.precisions(design, noise);
        let in_quiet = || nuisance.weighing.precisions(design, &noise.quieter().even());
        let quiet = scene.settings.library.places_in_quiet_noise.then(in_quiet);
        let backdrop = Backdrop::new(scene, design, nuisance.fitted, &precisions);
        let quiet = quiet.as_ref().map(|quiet| Backdrop::new(scene, design, nuisance.fitted, quiet));
        let best = |effect: &'static Effect| match quiet.as_ref().filter(|_| nonlinear::is_episode(effect)) {
            Some(quiet) => {
                let best = nonlinear::best(effect, &self.coarse, quiet)?;
                let (values, _) = nonlinear::refine(effect, &best.values, &self.coarse, quiet)?;
                Ok(GridPosterior { values, ..best })
            }
            None => nonlinear::best(effect, &self.coarse, &backdrop),
        };
        let shape = |(at, effect): (usize, &&'static Effect)| {
            let held = nuisance.doses.iter().find(|dose| dose.effect == *effect);
            let held = held.map(|dose| GridPosterior { values: dose.values.clone(), spread: spread(at) });
            match held.or_else(|| kept(at)) {
                Some(shape) => Ok(shape),
                None if effect.is_shaped() => best(effect),
                None => Ok(GridPosterior::alone(effect.neutral(scene.duration()))),
            }
        };
        self.candidates.effects.par_iter().enumerate().map(shape).collect()
    }
}
