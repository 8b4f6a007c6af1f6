//! A fit that has stopped, judged, and made part of a record: one way for every model on the device.

use imucal_core::{
    accept::{self, Limits, Refusal},
    coverage::Coverage,
    model::{Model, rig::GimbalPose},
    observation::ShellPoint,
    record::{FitQuality, ModelName, RawUnit, TriadRecord},
    solver::{LevenbergMarquardt, SolveReport},
    triad::Triad,
};
use nalgebra::{Matrix3, Vector3};

/// What the fit has seen.
#[derive(Clone, Copy, Debug)]
pub enum Seen<'a> {
    /// Points, which calibration turns into directions.
    Points(&'a [ShellPoint<f32>]),
    /// Poses, likewise.
    Poses(&'a [GimbalPose<f32>]),
    /// Directions before and after each turn: what is seen is the axis, both ways.
    Ends(&'a [[Vector3<f32>; 2]]),
}

impl Seen<'_> {
    fn count(&self) -> usize {
        match self {
            Self::Points(points) => points.len(),
            Self::Poses(poses) => poses.len(),
            Self::Ends(ends) => 2 * ends.len(),
        }
    }

    fn direction(&self, triad: &Triad<f32>, index: usize) -> Vector3<f32> {
        let value = match self {
            Self::Points(points) => points.get(index).map(|point| triad.correct(&point.value)),
            Self::Poses(poses) => poses.get(index).map(|pose| triad.correct(&pose.value)),
            Self::Ends(ends) => ends.get(index / 2).map(|[before, after]| {
                let axis = before.cross(after);
                if index.is_multiple_of(2) { axis } else { -axis }
            }),
        };
        unit(&value.unwrap_or_else(Vector3::zeros))
    }

    /// Directions seen, as the fit sees them.
    #[inline(never)]
    pub fn coverage(&self, triad: &Triad<f32>) -> Coverage<f32> {
        Coverage::of((0..self.count()).map(|index| self.direction(triad, index)))
    }
}

/// A vector at unit length.
pub fn unit(v: &Vector3<f32>) -> Vector3<f32> {
    v / libm::sqrtf(v.dot(v))
}

/// What is asked of a fit, and what it is measured by.
#[derive(Clone, Copy, Debug)]
pub struct Question<'a> {
    /// What was seen.
    pub seen: Seen<'a>,
    /// Limits of acceptance.
    pub limits: Limits,
    /// What the rms residual is small against, raw unit; 1 for an angle.
    pub radius: f32,
    /// The minimum's roundness is asked for.
    pub bend: bool,
}

/// The answer, but for what has the parameters' size: one body makes records and reports of all models.
#[derive(Clone, Copy, Debug)]
pub struct Judgement {
    /// The solver's report.
    pub report: SolveReport<f32>,
    /// Rms residual with the degrees of freedom left; NaN without any.
    pub rms: f32,
    /// What was covered.
    pub coverage: Coverage<f32>,
    /// Departure from a parabola.
    pub nonlinearity: f32,
    /// Parameters fitted.
    pub parameters: usize,
}

impl Judgement {
    /// Judges a fit that found `triad`.
    pub fn of<const P: usize>(
        solver: &LevenbergMarquardt<f32, P>,
        model: &impl Model<f32, P>,
        triad: &Triad<f32>,
        question: &Question<'_>,
    ) -> Self {
        Self {
            report: solver.report(),
            rms: solver.variance().map_or(f32::NAN, libm::sqrtf),
            coverage: question.seen.coverage(triad),
            nonlinearity: if question.bend { accept::nonlinearity(solver, model, 1.0) } else { 0.0 },
            parameters: P,
        }
    }

    /// Accepted, or why not; `std` are the standard errors of `triad`.
    ///
    /// # Errors
    ///
    /// [`Refusal`].
    #[inline(never)]
    pub fn verdict(
        &self,
        triad: &Triad<f32>,
        std: &Triad<f32>,
        question: &Question<'_>,
    ) -> Result<(), Refusal> {
        let limits = &question.limits;
        accept::check_observations(&self.coverage, self.parameters, limits)?;
        accept::check_report(&self.report)?;
        let error = accept::relative_error(&triad.gain, std, question.radius);
        accept::check_precision(error, limits)?;
        accept::check_nonlinearity(self.nonlinearity, error, limits)?;
        accept::check_plausibility(triad, true, self.rms / question.radius, limits)
    }

    /// The calibration, as the record has it; the figures of quality are this fit's.
    #[inline(never)]
    pub fn record(&self, triad: &Triad<f32>, std: &Triad<f32>, model: &str, unit: &Unit) -> TriadRecord {
        let triad = triad.in_unit(unit.offset, unit.per_unit);
        let std = std.in_unit(0.0, libm::fabsf(unit.per_unit));
        TriadRecord {
            gain: rows(&triad.gain),
            bias: triad.bias.into(),
            unit_in: unit.raw,
            unit_out: unit.calibrated,
            model: ModelName::try_from(model).unwrap_or_default(),
            temperature: None,
            quality: FitQuality {
                gain_std: rows(&std.gain),
                bias_std: std.bias.into(),
                rms: self.rms,
                held_out_rms: None,
                observations: u32::try_from(self.coverage.observations).unwrap_or(u32::MAX),
                parameters: u8::try_from(self.parameters).unwrap_or(u8::MAX),
                condition: self.report.condition,
                coverage: self.coverage.share,
                field_norm: None,
            },
        }
    }
}

/// Units of a record's triad: `raw = offset + per_unit · nominal SI`.
#[derive(Clone, Copy, Debug)]
pub struct Unit {
    /// Of raw samples.
    pub raw: RawUnit,
    /// Of calibrated ones: nominal SI.
    pub calibrated: RawUnit,
    /// See above.
    pub offset: f32,
    /// See above; not zero.
    pub per_unit: f32,
}

fn rows(matrix: &Matrix3<f32>) -> [[f32; 3]; 3] {
    matrix.transpose().into()
}
