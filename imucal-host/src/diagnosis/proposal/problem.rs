//! What formulas are tried on: the residual of one sensor, the columns fitted in any case, and formulas as columns.

use nalgebra::Vector3;

use super::term::Formulated;
use crate::{
    diagnosis::{
        error::DiagnosisError,
        library::evidence::{Projected, log_evidence},
        mixed_model::{
            design::{Design, Normal, Signature},
            noise::{NEAR, Noise},
        },
        residual::{
            base_run::Reference, block::Means, forward_model::ForwardModel, sample_points::SamplePoints,
        },
        search::linearisation::Linearisation,
    },
    effect::user::Formula,
    recording::SensorKind,
    simulator::Dose,
};

/// The run of a fit.
pub struct Run<'s> {
    /// At all nodes.
    pub fine: Reference<'s>,
    /// At a few: many formulas are screened there.
    pub sparse: Reference<'s>,
}

impl<'s> Run<'s> {
    /// With these effects.
    ///
    /// # Errors
    ///
    /// [`DiagnosisError::Simulation`], where a triad is singular.
    pub fn new(scene: &'s ForwardModel<'s>, doses: &[Dose]) -> Result<Self, DiagnosisError> {
        let at = |points: &'s SamplePoints| Reference::new(scene, doses.to_vec(), points);
        Ok(Self { fine: at(&scene.fine)?, sparse: at(&scene.sparse)? })
    }
}

/// What a formula's amplitudes multiply, term by term, on each axis, block by block.
pub type Factors = Vec<Vec<Vector3<f64>>>;

/// The residual of one sensor, and what is fitted in any case.
pub struct Problem<'p, 's> {
    /// The problem about the search's fit.
    pub linear: &'p Linearisation<'s>,
    /// The sensor.
    pub kind: SensorKind,
    /// Columns of the problem that are fitted in any case.
    pub fitted: Vec<usize>,
    /// Those columns alone, in that order, of the sensor's channels.
    pub design: Design,
    run: &'p Run<'p>,
}

/// The columns of a formula, an axis and a term, of the size of white noise in a sample.
#[derive(Clone, Debug)]
pub struct FormulaColumns {
    /// Term by term, axis by axis.
    pub signatures: Vec<Signature>,
    /// Amplitude for which a column has that size, in the unit of the amplitude.
    pub sizes: Vec<f64>,
}

/// What is fitted with a noise of its own.
#[derive(Clone, Debug)]
pub struct Weighed {
    /// The noise.
    pub noise: Noise,
    /// ln of the probability of the data, but for a constant.
    pub log_evidence: f64,
    /// The normal equations: what is fitted in any case, then the further columns.
    pub normal: Normal,
}

impl<'p, 's> Problem<'p, 's> {
    /// Of a sensor; `fitted` are the columns that are fitted in any case.
    pub fn new(
        linear: &'p Linearisation<'s>,
        run: &'p Run<'p>,
        kind: SensorKind,
        fitted: Vec<usize>,
    ) -> Self {
        let mut design = linear.design.extended(&fitted, Vec::new(), &[]);
        design.channels.retain(|channel| channel.kind == kind);
        Self { linear, kind, fitted, design, run }
    }

    /// What a formula multiplies on each axis, block by block.
    ///
    /// # Errors
    ///
    /// [`DiagnosisError::Formula`], where it has no value.
    pub fn factors(&self, formula: &Formula, shapes: &[f64]) -> Result<Vec<Vector3<f64>>, DiagnosisError> {
        self.run.fine.factors(formula, self.kind, shapes)
    }

    /// A formula's columns; `None` where it has no value in this recording.
    pub fn columns(&self, formula: &Formulated, noise: &Noise) -> Option<FormulaColumns> {
        let of_term = |term: &Formula| self.factors(term, &formula.shapes()).ok();
        Some(self.scaled(&formula.parsed().ok()?.iter().map(of_term).collect::<Option<Factors>>()?, noise))
    }

    /// What a formula multiplies, from a few nodes a block; `None` where it has no value there.
    pub fn sparse_factors(&self, formula: &Formulated) -> Option<Factors> {
        let (run, shapes) = (&self.run.sparse, formula.shapes());
        let of_term = |term: &Formula| run.factors(term, self.kind, &shapes).ok();
        formula.parsed().ok()?.iter().map(of_term).collect()
    }

    /// Columns of what a formula multiplies.
    pub fn scaled(&self, factors: &Factors, noise: &Noise) -> FormulaColumns {
        let usual = noise.usual(self.kind);
        let mut columns = FormulaColumns { signatures: Vec::new(), sizes: Vec::new() };
        for factors in factors {
            for axis in 0..3 {
                let (signature, size) = self.column(factors, axis, usual);
                columns.signatures.push(signature);
                columns.sizes.push(size);
            }
        }
        columns
    }

    /// One axis of what a formula multiplies as a column, about its mean and of a usual size, and the amplitude that this
    /// takes; zero where it does not vary.
    pub fn column(&self, factors: &[Vector3<f64>], axis: usize, usual: f64) -> (Signature, f64) {
        let blocks = &self.linear.scene.blocks;
        let held = || factors.iter().zip(blocks).filter(|(_, block)| !block.rows.is_empty());
        let count = held().count().max(1) as f64;
        let mean = held().map(|(factor, _)| factor[axis]).sum::<f64>() / count;
        let square = held().map(|(factor, _)| (factor[axis] - mean).powi(2)).sum::<f64>() / count;
        let largest = held().fold(0.0f64, |most, (factor, _)| most.max(factor[axis].abs()));
        let size = match libm::sqrt(square) {
            sigma if sigma > 1e-9 * largest => usual / sigma,
            _ => 0.0,
        };
        let along = |value: f64| Vector3::from_fn(|k, _| if k == axis { value } else { 0.0 });
        let value = |(factor, block): (&Vector3<f64>, &crate::diagnosis::residual::block::Block)| {
            if block.rows.is_empty() { along(0.0) } else { along(size * (factor[axis] - mean)) }
        };
        let mut means: Means = Default::default();
        means[self.kind as usize] = Some(factors.iter().zip(blocks).map(value).collect());
        (means.into(), size)
    }

    /// With another residual of the sensor.
    #[must_use]
    pub fn leaving(&self, residual: &[Vector3<f64>]) -> Design {
        let mut means: Means = Default::default();
        means[self.kind as usize] = Some(residual.to_vec());
        self.design.clone().leaving(&means)
    }

    /// Fits what is fitted in any case, and groups of further columns, to a residual, with the sensor's noise estimated again.
    ///
    /// # Errors
    ///
    /// [`DiagnosisError::Score`].
    pub fn weighed(
        &self,
        residual: &Design,
        further: &[&[Signature]],
        start: &Noise,
    ) -> Result<Weighed, DiagnosisError> {
        let first = self.fitted.len();
        let kept: Vec<usize> = (0..first).collect();
        let design = residual.extended(&kept, Vec::new(), &further.concat());
        let every: Vec<usize> = (0..design.size).collect();
        let linear = self.linear;
        // The other sensors do not show it, but what they have in common with this one.
        let others = linear.products(start).picked(None, &self.fitted);
        let products = linear.weighing.products(&design, start, &every).with_others(others);
        let mut noise = start.clone();
        noise.sensors[self.kind as usize] = linear.weighing.fit(&products, self.kind, &every, start, &NEAR);
        let normal = noise.normal(&products, design.size);
        let mut from = first;
        let places = |group: &&[Signature]| {
            from += group.len();
            every[from - group.len()..from].to_vec()
        };
        let groups: Vec<Vec<usize>> = further.iter().map(places).collect();
        let log_evidence = log_evidence(&normal, &noise, first, &groups)?;
        Ok(Weighed { noise, log_evidence, normal })
    }

    /// What is fitted in any case projected out of the further columns of normal equations.
    ///
    /// # Errors
    ///
    /// [`DiagnosisError::Score`].
    pub fn projected(&self, normal: &Normal) -> Result<Projected, DiagnosisError> {
        let every: Vec<usize> = (0..normal.score.len()).collect();
        let (first, others) = every.split_at(self.fitted.len());
        Projected::new(normal, first, others)
    }
}
