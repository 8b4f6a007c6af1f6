//! Evidence of a set of effects: axis by axis, with the noise estimated for it, and with all sensors jointly.

use rayon::prelude::*;

use super::{
    hypothesis::{Scored, Screened},
    linearisation::Linearisation,
};
use crate::{
    diagnosis::{
        error::DiagnosisError,
        library::{evidence::log_evidence, nonlinear},
        mixed_model::{
            design::Normal,
            noise::{Noise, SensorNoise},
            shared_offsets::SharedOffsets,
        },
    },
    effect::Effect,
    recording::SensorKind,
};

impl Linearisation<'_> {
    /// Noise and evidence of a set; the noise is estimated again for the sensors in `reached`.
    pub fn judge(
        &self,
        set: &[&'static Effect],
        start: &Noise,
        reached: &[SensorKind],
        steps: &[f64],
    ) -> Result<Scored, DiagnosisError> {
        let sifted = self.screen(set, start, reached, steps)?;
        self.scored_jointly(sifted, &self.offsets(start))
    }

    /// Evidence of a sifted set; as it was sifted where no rig guides the sensor, or none that would show its offsets.
    pub fn scored_jointly(
        &self,
        sifted: Screened,
        offsets: &Option<SharedOffsets>,
    ) -> Result<Scored, DiagnosisError> {
        let Screened { set, noise, value: sifted } = sifted;
        let Some(offsets) = offsets else {
            return Ok(Scored { set, noise, log_evidence: sifted, sifted });
        };
        let fitted = self.fitted(&set);
        let (baseline, groups) = (self.baseline.len(), self.groups(&set, &fitted));
        let value = |normal: &Normal| log_evidence(normal, &noise, baseline, &groups).ok();
        let likeliest = offsets.likeliest(self.scene, &self.design, &noise, &fitted, &value);
        let likeliest = likeliest.ok_or(DiagnosisError::JointScore { effects: set.len() })?;
        let neg_log_prior: f64 = set.iter().map(|effect| self.neg_log_prior(effect)).sum();
        Ok(Scored { log_evidence: likeliest - neg_log_prior, set, noise, sifted })
    }

    /// The same axis by axis.
    pub fn screen(
        &self,
        set: &[&'static Effect],
        start: &Noise,
        reached: &[SensorKind],
        steps: &[f64],
    ) -> Result<Screened, DiagnosisError> {
        let fitted = self.fitted(set);
        let mut noise = start.clone();
        let is_new = |column: &usize| !fitted.contains(column);
        let taken_out = self.candidates.taken_out.iter().flat_map(|term| self.design.of(term)).filter(is_new);
        let known: Vec<usize> = fitted.iter().copied().chain(taken_out).collect();
        let products = self.products(start).picked(None, &known);
        let every: Vec<usize> = (0..known.len()).collect();
        let fit = |kind: &SensorKind| self.weighing.fit(&products, *kind, &every, start, steps);
        let asked: Vec<SensorKind> =
            self.scene.kinds.iter().copied().filter(|kind| reached.contains(kind)).collect();
        let found: Vec<SensorNoise> = asked.par_iter().map(fit).collect();
        asked.into_iter().zip(found).for_each(|(kind, found)| noise.sensors[kind as usize] = found);
        let normal = noise.normal(&products.picked(None, &every[..fitted.len()]), fitted.len());
        let value = log_evidence(&normal, &noise, self.baseline.len(), &self.groups(set, &fitted))?
            - set.iter().map(|effect| self.neg_log_prior(effect)).sum::<f64>();
        Ok(Screened { set: set.to_vec(), noise, value })
    }

    /// Places of each effect's columns among the fitted.
    pub fn groups(&self, set: &[&'static Effect], fitted: &[usize]) -> Vec<Vec<usize>> {
        let of = |effect: &&'static Effect| -> Vec<usize> {
            (0..fitted.len()).filter(|at| self.design.columns[fitted[*at]].is_of(effect)).collect()
        };
        set.iter().map(of).collect()
    }

    /// −ln of an effect's prior: one of the candidates, in one of its shapes or such as are as likely. What was taken out of
    /// the baseline is no surprise.
    pub fn neg_log_prior(&self, effect: &Effect) -> f64 {
        if self.candidates.was_taken_out(effect) {
            return 0.0;
        }
        let at = self.candidates.effects.iter().position(|other| *other == effect);
        let spread = at.map_or(0.0, |at| self.shapes[at].spread);
        let shapes = (nonlinear::choices(effect, self.scene) as f64).ln();
        (self.candidates.effects.len() as f64).ln() + (shapes - spread).max(0.0)
    }
}
