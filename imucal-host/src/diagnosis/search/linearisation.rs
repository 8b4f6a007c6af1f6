//! The linear problem about a fit: signatures as columns, sets of effects judged by least squares and evidence.

use crate::noise::precision::ChannelPrecision;
use std::sync::Arc;

use rayon::prelude::*;

use super::{
    memo::Memo,
    refit::{Fit, columns, signatures},
};
use crate::{
    diagnosis::{
        error::DiagnosisError,
        library::{
            candidates::Candidates,
            evidence::Projected,
            grid::{Grid, NuisanceColumns},
            grid_posterior::GridPosterior,
            nonlinear,
            nonlinear::Backdrop,
        },
        mixed_model::{
            design::{Design, DesignProducts, Normal, Signature},
            noise::{Noise, Weighing},
            shared_offsets::SharedOffsets,
        },
        residual::{base_run::Reference, forward_model::ForwardModel},
    },
    effect::{Act, Effect, Role, class::class},
    recording::SensorKind,
    simulator::Dose,
};

/// The problem about a fit, with all its effects put back into the residual.
pub struct Linearisation<'s> {
    /// The scene.
    pub scene: &'s ForwardModel<'s>,
    /// What there is to choose from.
    pub candidates: &'s Candidates,
    /// All columns and the residual of the baseline alone.
    pub design: Design,
    /// Weighs the blocks.
    pub weighing: Weighing<'s>,
    /// Columns of the baseline.
    pub baseline: Vec<usize>,
    /// Where each candidate's signature was taken.
    pub shapes: Vec<GridPosterior>,
    scan: Grid<'s>,
    /// Effects of the fit in addition to the baseline.
    held: Vec<Dose>,
    normals: Memo<Noise, Normal>,
    products: Memo<White, DesignProducts>,
    /// The same for all problems of a scene.
    offsets: Arc<Memo<White, Option<SharedOffsets>, 1>>,
    projected: Memo<Noise, Result<(Projected, Vec<usize>), DiagnosisError>>,
}

/// Effects with what each adds, the likeliest first.
type Ranked = Vec<(f64, &'static Effect)>;

/// White noise of each sensor at rest and in motion, by axis.
type White = [[[f64; 3]; 2]; 3];

impl<'s> Linearisation<'s> {
    /// About a fit, with its columns alone: nothing can be added.
    pub fn fitted_alone(
        scene: &'s ForwardModel<'s>,
        candidates: &'s Candidates,
        fit: &Fit,
    ) -> Result<Self, DiagnosisError> {
        let scan = Grid::new(scene, candidates, fit.doses.clone())?;
        Self::alone(&Reference::new(scene, fit.doses.clone(), &scene.fine)?, scan, scene, candidates, fit)
    }

    fn alone(
        reference: &Reference<'_>,
        scan: Grid<'s>,
        scene: &'s ForwardModel<'s>,
        candidates: &'s Candidates,
        fit: &Fit,
    ) -> Result<Self, DiagnosisError> {
        let neutral = |effect: &&'static Effect| GridPosterior::alone(effect.neutral(scene.duration()));
        let shapes = candidates.effects.iter().map(neutral).collect();
        let columns = columns(scene, &fit.doses.iter().map(|dose| dose.effect).collect::<Vec<_>>());
        let signatures = signatures(reference, &columns, &|_| Vec::new())?;
        let design = Design::new(scene, columns, &signatures, &fit.residual);
        let weighing = Weighing::new(scene, SensorKind::ALL.map(|kind| reference.output(kind)));
        Ok(Self::of(scene, candidates, scan, fit, design, weighing, shapes))
    }

    /// About a fit; shapes of candidates that it does not hold are those best under `noise`. What reaches no sensor on
    /// which this fit and another differ is taken from the problem about that.
    pub fn new(
        scene: &'s ForwardModel<'s>,
        candidates: &'s Candidates,
        fit: &Fit,
        noise: &Noise,
        before: Option<&Self>,
    ) -> Result<Self, DiagnosisError> {
        let reference = Reference::new(scene, fit.doses.clone(), &scene.fine)?;
        let scan = match before {
            Some(before) => before.scan.clone(),
            None => Grid::new(scene, candidates, fit.doses.clone())?,
        };
        let alone = Self::alone(&reference, scan.clone(), scene, candidates, fit)?;
        let every: Vec<usize> = (0..alone.design.columns.len()).collect();
        let nuisance = NuisanceColumns {
            doses: &fit.doses,
            weighing: &alone.weighing,
            design: &alone.design,
            fitted: &every,
        };
        let lasts = |effect: &Effect| before.is_some_and(|before| before.lasts(effect, fit));
        let known = |at: usize| before.and_then(|before| before.shapes.get(at));
        let spread = |at: usize| known(at).map_or(0.0, |shape| shape.spread);
        let kept = |at: usize| known(at).filter(|_| lasts(candidates.effects[at])).cloned();
        let shapes = scan.shapes(&nuisance, noise, &spread, &kept)?;
        let (old, new): (Vec<&'static Effect>, Vec<&'static Effect>) = candidates
            .effects
            .iter()
            .copied()
            .partition(|effect| lasts(effect) && fit.doses.iter().all(|dose| dose.effect != *effect));
        let fresh = columns(scene, &candidates.baseline.iter().copied().chain(new).collect::<Vec<_>>());
        let signatures = signatures(&reference, &fresh, &|effect| candidates.shape(&shapes, effect))?;
        let mut design = match before {
            Some(before) => {
                let kept: Vec<usize> = old.iter().flat_map(|effect| before.design.of(effect)).collect();
                let columns = kept.iter().map(|id| before.design.columns[*id]).chain(fresh).collect();
                before.design.extended(&kept, columns, &signatures).leaving(&fit.residual)
            }
            None => Design::new(scene, fresh, &signatures, &fit.residual),
        };
        restore(&mut design, fit.doses.iter().filter(|dose| !candidates.has_term(dose.effect)));
        let new = Self::of(scene, candidates, scan, fit, design, alone.weighing, shapes);
        Ok(match before {
            Some(before) => new.sharing_offsets(before),
            None => new,
        })
    }

    fn of(
        scene: &'s ForwardModel<'s>,
        candidates: &'s Candidates,
        scan: Grid<'s>,
        fit: &Fit,
        design: Design,
        weighing: Weighing<'s>,
        shapes: Vec<GridPosterior>,
    ) -> Self {
        let baseline = candidates.baseline.iter().flat_map(|term| design.of(term)).collect();
        let held = fit.doses.iter().filter(|dose| !candidates.has_term(dose.effect)).cloned().collect();
        Self {
            scene,
            candidates,
            design,
            weighing,
            baseline,
            shapes,
            scan,
            held,
            normals: Memo::default(),
            products: Memo::default(),
            offsets: Arc::default(),
            projected: Memo::default(),
        }
    }

    fn sharing_offsets(self, of: &Linearisation<'_>) -> Self {
        Self { offsets: Arc::clone(&of.offsets), ..self }
    }

    /// An effect's signature is the same about another fit but for the second order: no sensor it reaches has an effect in
    /// the one and not in the other, or in another shape.
    fn lasts(&self, effect: &Effect, fit: &Fit) -> bool {
        let moves = |effect: &Effect| matches!(effect.act, Act::Rig(_) | Act::Clock(_));
        let meets = |changed: &Dose| {
            let met = |kind| self.scene.reach(changed.effect).contains(kind);
            // What moves the rig reaches all sensors by the same path, whatever a sensor makes of it.
            if moves(effect) { moves(changed.effect) } else { self.scene.reach(effect).iter().any(met) }
        };
        let has = |doses: &[Dose], dose: &Dose| doses.iter().any(|other| has_same_shape(dose, other));
        let gone = self.held.iter().filter(|dose| !has(&fit.doses, dose));
        let come = fit.doses.iter().filter(|dose| !self.candidates.has_term(dose.effect));
        !gone.chain(come.filter(|dose| !has(&self.held, dose))).any(meets)
    }

    /// The same problem, with shapes of candidates that are best under another noise, or without some of the fit's
    /// effects; `None` as well where those are the same.
    pub fn reshaped(&self, fit: &Fit, noise: &Noise, without: &[&'static Effect]) -> Option<Self> {
        let is_taken = |effect: &Effect| without.contains(&effect);
        let doses: Vec<Dose> = fit.doses.iter().filter(|dose| !is_taken(dose.effect)).cloned().collect();
        let fitted: Vec<usize> = doses.iter().flat_map(|dose| self.design.of(dose.effect)).collect();
        let (design, weighing) = (&self.design, &self.weighing);
        let nuisance = NuisanceColumns { doses: &doses, weighing, design, fitted: &fitted };
        let meets = |effect: &Effect| {
            let reached = |kind| without.iter().any(|taken| self.scene.reach(taken).contains(kind));
            without.is_empty() || self.scene.reach(effect).iter().any(reached)
        };
        let spread = |at: usize| self.shapes[at].spread;
        let kept =
            |at: usize| Some(&self.shapes[at]).filter(|_| !meets(self.candidates.effects[at])).cloned();
        let shapes = self.scan.shapes(&nuisance, noise, &spread, &kept).ok()?;
        let others: Vec<&'static Effect> = self
            .candidates
            .effects
            .iter()
            .zip(self.shapes.iter().zip(&shapes))
            .filter(|(_, (own, other))| own.values != other.values)
            .map(|(effect, _)| *effect)
            .collect();
        if others.is_empty() {
            return None;
        }
        let reference = Reference::new(self.scene, doses.clone(), &self.scene.fine).ok()?;
        let changed = columns(self.scene, &others);
        let signatures =
            signatures(&reference, &changed, &|effect| self.candidates.shape(&shapes, effect)).ok()?;
        let is_kept = |id: &usize| !others.iter().any(|effect| self.design.columns[*id].is_of(effect));
        let kept: Vec<usize> = (0..self.design.columns.len()).filter(is_kept).collect();
        let columns = kept.iter().map(|id| self.design.columns[*id]).chain(changed).collect();
        let design = self.design.extended(&kept, columns, &signatures);
        let weighing = Weighing::new(self.scene, self.weighing.given.clone());
        let reshaped =
            Self::of(self.scene, self.candidates, self.scan.clone(), fit, design, weighing, shapes);
        Some(reshaped.sharing_offsets(self))
    }

    /// The same problem with terms of the baseline as effects of these values, the last of `candidates` in their order.
    pub fn with_effects<'c>(
        &'c self,
        candidates: &'c Candidates,
        fit: &Fit,
        terms: Vec<(&'static Effect, Vec<f64>)>,
    ) -> Linearisation<'c> {
        let mut design = self.design.clone();
        let doses: Vec<Dose> = terms.into_iter().map(|(effect, values)| Dose { effect, values }).collect();
        restore(&mut design, doses.iter());
        let neutral = |dose: &Dose| GridPosterior::alone(dose.effect.neutral(self.scene.duration()));
        let shapes = self.shapes.iter().cloned().chain(doses.iter().map(neutral)).collect();
        let weighing = Weighing::new(self.scene, self.weighing.given.clone());
        Linearisation::of(self.scene, candidates, self.scan.clone(), fit, design, weighing, shapes)
            .sharing_offsets(self)
    }

    /// The same problem with further effects, the last of `candidates`, whose signatures are given; what is `fitted` so far
    /// counts as the baseline.
    pub fn joined<'c>(
        &'c self,
        candidates: &'c Candidates,
        fit: &Fit,
        fitted: &[usize],
        effects: &[Dose],
        signatures: &[Signature],
    ) -> Linearisation<'c> {
        let kept: Vec<usize> = (0..self.design.columns.len()).collect();
        let doses: Vec<&'static Effect> = effects.iter().map(|dose| dose.effect).collect();
        let further = columns(self.scene, &doses);
        let all = self.design.columns.iter().copied().chain(further).collect();
        let design = self.design.extended(&kept, all, signatures);
        let shape = |dose: &Dose| GridPosterior::alone(dose.values.clone());
        let shapes = self.shapes.iter().cloned().chain(effects.iter().map(shape)).collect();
        let weighing = Weighing::new(self.scene, self.weighing.given.clone());
        let joined =
            Linearisation::of(self.scene, candidates, self.scan.clone(), fit, design, weighing, shapes);
        Linearisation { baseline: fitted.to_vec(), ..joined.sharing_offsets(self) }
    }

    /// Parameters at which a candidate's signature was taken.
    pub fn shape_of(&self, effect: &Effect) -> Vec<f64> {
        self.candidates.shape(&self.shapes, effect)
    }

    /// An effect's parameters at which its signature was taken; a shape is refined against what is fitted without it.
    pub fn refined(
        &self,
        effect: &'static Effect,
        doses: &[Dose],
        rest: &[&'static Effect],
        noise: &Noise,
    ) -> Result<Vec<f64>, DiagnosisError> {
        let values = self.shape_of(effect);
        if !effect.is_shaped() {
            return Ok(values);
        }
        let (fitted, precisions) = (self.fitted(rest), self.precisions(noise));
        let backdrop = Backdrop::new(self.scene, &self.design, &fitted, &precisions);
        let reference = Reference::new(self.scene, doses.to_vec(), &self.scene.fine)?;
        Ok(nonlinear::refine(effect, &values, &reference, &backdrop).map_or(values, |(refined, _)| refined))
    }

    /// Columns of the baseline and of a set.
    pub fn fitted(&self, set: &[&'static Effect]) -> Vec<usize> {
        let of = |effect: &&'static Effect| self.design.of(effect);
        self.baseline.iter().copied().chain(set.iter().flat_map(of)).collect()
    }

    /// Σ⁻¹ of each channel.
    pub fn precisions(&self, noise: &Noise) -> Vec<ChannelPrecision> {
        self.weighing.precisions(&self.design, noise)
    }

    /// Normal equations of all columns.
    pub fn normal(&self, noise: &Noise) -> Arc<Normal> {
        self.normals.get(noise.clone(), || noise.normal(&self.products(noise), self.design.size))
    }

    /// Cross-products of all columns, by the white noise.
    pub fn products(&self, noise: &Noise) -> Arc<DesignProducts> {
        self.products.get(white(noise), || {
            let every: Vec<usize> = (0..self.design.size).collect();
            self.weighing.products(&self.design, noise, &every)
        })
    }

    /// The gimbals' offsets that all channels share, by the white noise.
    pub fn offsets(&self, noise: &Noise) -> Arc<Option<SharedOffsets>> {
        self.offsets.get(white(noise), || SharedOffsets::of(self.scene, &self.design, &self.weighing, noise))
    }

    /// Scores of all columns but the baseline's, with the baseline projected out, and those columns.
    pub fn projected(&self, noise: &Noise) -> Arc<Result<(Projected, Vec<usize>), DiagnosisError>> {
        self.projected.get(noise.clone(), || {
            let every = 0..self.design.columns.len();
            let others: Vec<usize> = every.filter(|id| !self.baseline.contains(id)).collect();
            Ok((Projected::new(&self.normal(noise), &self.baseline, &others)?, others))
        })
    }

    /// Candidates by ln BF of a set with each of them added, best first; the first value is that of the set itself.
    pub fn ranked(&self, set: &[&'static Effect], noise: &Noise) -> Result<(f64, Ranked), DiagnosisError> {
        // Two of a class explain each other's noise and not the gap.
        let is_new = |effect: &&'static Effect| !set.iter().any(|own| class(&own.id) == class(&effect.id));
        let others: Vec<[&'static Effect; 1]> =
            self.candidates.effects.iter().copied().filter(is_new).map(|effect| [effect]).collect();
        let (own, values) = self.values(set, &others, noise)?;
        let mut ranked: Vec<(f64, &'static Effect)> =
            values.into_iter().zip(others).map(|(value, [effect])| (value, effect)).collect();
        ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
        Ok((own, ranked))
    }

    /// ln BF of a set, and of the set with each of `additions` added.
    pub fn values<const N: usize>(
        &self,
        set: &[&'static Effect],
        additions: &[[&'static Effect; N]],
        noise: &Noise,
    ) -> Result<(f64, Vec<f64>), DiagnosisError> {
        let projected = self.projected(noise);
        let (projected, others) = projected.as_ref().as_ref().map_err(Clone::clone)?;
        let places = |effect: &&'static Effect| -> Vec<usize> {
            (0..others.len()).filter(|at| self.design.columns[others[*at]].is_of(effect)).collect()
        };
        let own: Vec<Vec<usize>> = set.iter().map(places).collect();
        let value = |more: &[&'static Effect]| {
            let more: Vec<Vec<usize>> = more.iter().map(places).collect();
            let parts: Vec<&[usize]> = own.iter().chain(&more).map(Vec::as_slice).collect();
            projected.log_bayes_factor(&parts)
        };
        let neg_log_prior =
            |more: &[&'static Effect]| more.iter().map(|effect| self.neg_log_prior(effect)).sum::<f64>();
        Ok((value(&[]), additions.par_iter().map(|more| value(more) - neg_log_prior(more)).collect()))
    }
}

fn white(noise: &Noise) -> White {
    noise.sensors.map(|sensor| [sensor.white, sensor.moving])
}

/// The same effect with the same parameters but for its amplitudes.
fn has_same_shape(one: &Dose, other: &Dose) -> bool {
    let mut values = one.effect.parameters.iter().zip(one.values.iter().zip(&other.values));
    one.effect == other.effect && values.all(|(p, (a, b))| p.role == Role::Amplitude || a == b)
}

/// Puts effects back into a design's residual.
fn restore<'d>(design: &mut Design, doses: impl Iterator<Item = &'d Dose>) {
    let restored: Vec<(usize, f64)> = doses
        .flat_map(|dose| design.of(dose.effect).into_iter().map(move |id| (id, dose)))
        .map(|(id, dose)| {
            let at = design.columns[id].parameter;
            (id, dose.values[at] / dose.effect.parameters[at].prior_scale)
        })
        .collect();
    design.restore(&restored);
}
