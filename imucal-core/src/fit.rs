//! A fit that has stopped: its figures, whether it is accepted, and its part of a record.
//!
//! [`solver`](crate::solver) finds parameters, [`accept`] and [`coverage`](crate::coverage) hold one check each, and
//! [`record`](crate::record) holds what is kept. Here they are asked in the order in which a refusal says most: what was
//! observed, how the solver ended, how precise the parameters are, whether their errors are those of a linear model, and
//! whether a sensor can be like that. Every model on a device goes this way; `examples/fit_on_device.rs` shows it.
//!
//! A record is of `f32`; all else is for `f32` and `f64`. Not here: where observations come from, when the solver runs, and where a record is
//! stored.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use crate::{
    accept::{self, Limits, Refusal},
    coverage::Coverage,
    model::{Model, rig::GimbalPose},
    observation::ShellPoint,
    record::{FirstOrder, FitQuality, ModelName, RawUnit, TriadRecord},
    scalar::Scalar,
    solver::{LevenbergMarquardt, SolveReport},
    triad::Triad,
};

/// What was fitted to; it says which directions were observed.
#[derive(Clone, Copy, Debug)]
pub enum Observed<'a, T: Scalar> {
    /// Raw points on a shell. Their directions are those of the calibrated vectors.
    Points(&'a [ShellPoint<T>]),
    /// Raw means in attitudes of a rig, likewise.
    Poses(&'a [GimbalPose<T>]),
    /// Unit vectors of a fixed direction before and after each turn. A turn observes its axis, in both senses.
    TurnEnds(&'a [[Vector3<T>; 2]]),
}

impl<T: Scalar> Observed<'_, T> {
    /// Coverage of the sphere, as a fit that found `triad` sees it.
    #[inline(never)]
    pub fn coverage(&self, triad: &Triad<T>) -> Coverage<T> {
        Coverage::of((0..self.directions()).map(|index| self.direction(triad, index)))
    }

    fn directions(&self) -> usize {
        match self {
            Self::Points(points) => points.len(),
            Self::Poses(poses) => poses.len(),
            Self::TurnEnds(ends) => 2 * ends.len(),
        }
    }

    fn direction(&self, triad: &Triad<T>, index: usize) -> Vector3<T> {
        let value = match self {
            Self::Points(points) => points.get(index).map(|point| triad.correct(&point.value)),
            Self::Poses(poses) => poses.get(index).map(|pose| triad.correct(&pose.value)),
            Self::TurnEnds(ends) => ends.get(index / 2).map(|[before, after]| {
                let axis = before.cross(after);
                if index.is_multiple_of(2) { axis } else { -axis }
            }),
        };
        let value = value.unwrap_or_else(Vector3::zeros);
        value / value.dot(&value).root()
    }
}

/// What a fit must meet.
#[derive(Clone, Copy, Debug)]
pub struct Criteria<'a, T: Scalar> {
    /// What it was fitted to.
    pub observed: Observed<'a, T>,
    /// Limits of acceptance.
    pub limits: Limits,
    /// What the rms residual is compared with: for vectors the norm in the raw unit, for angles 1.
    pub radius: T,
    /// Whether the cost's departure from a parabola is examined. Not needed where the model is nearly linear, as on a rig.
    pub nonlinearity: bool,
}

/// Figures of a fit, without what has the size of its parameters: one body makes records of all models.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitSummary<T: Scalar> {
    /// The solver's report.
    pub report: SolveReport<T>,
    /// Rms residual over the degrees of freedom left, unit of the residual; NaN where none is left.
    pub rms: T,
    /// Directions observed.
    pub coverage: Coverage<T>,
    /// The cost's departure from a parabola one standard error away, see [`accept::nonlinearity`]; 0 where it was not
    /// examined.
    pub nonlinearity: T,
    /// Parameters fitted.
    pub parameters: usize,
}

impl<T: Scalar> FitSummary<T> {
    /// Of a solver that has stopped at the parameters of `triad`.
    pub fn of<const P: usize>(
        solver: &LevenbergMarquardt<T, P>,
        model: &impl Model<T, P>,
        triad: &Triad<T>,
        criteria: &Criteria<'_, T>,
    ) -> Self {
        Self {
            report: solver.report(),
            rms: solver.variance().map_or(T::of(f64::NAN), T::root),
            coverage: criteria.observed.coverage(triad),
            nonlinearity: if criteria.nonlinearity {
                accept::nonlinearity(solver, model, T::whole(1))
            } else {
                T::whole(0)
            },
            parameters: P,
        }
    }

    /// Whether the fit is accepted; `std` are the standard errors of `triad`.
    ///
    /// # Errors
    ///
    /// The first check that fails, with its figures.
    #[inline(never)]
    pub fn check(&self, triad: &Triad<T>, std: &Triad<T>, criteria: &Criteria<'_, T>) -> Result<(), Refusal> {
        let limits = &criteria.limits;
        accept::check_observations(&self.coverage, self.parameters, limits)?;
        accept::check_report(&self.report)?;
        let error = accept::relative_error(&triad.gain, std, criteria.radius);
        accept::check_precision(error, limits)?;
        accept::check_nonlinearity(self.nonlinearity, error, limits)?;
        accept::check_plausibility(triad, true, self.rms / criteria.radius, limits)
    }
}

impl FitSummary<f32> {
    /// The calibration for a record, with this fit's figures of quality. A model's name that is too long is left out.
    #[inline]
    pub fn record(&self, triad: &Triad<f32>, std: &Triad<f32>, model: &str, units: &Units) -> TriadRecord {
        let triad = triad.in_unit(units.offset, units.per_unit);
        let std = std.in_unit(0.0, libm::fabsf(units.per_unit));
        TriadRecord {
            gain: rows(&triad.gain),
            bias: triad.bias.into(),
            unit_in: units.raw,
            unit_out: units.calibrated,
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
            order: FirstOrder,
        }
    }
}

/// Units of a record's triad, where the fit was made in nominal SI: `raw = offset + per_unit · nominal`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Units {
    /// Of raw samples.
    pub raw: RawUnit,
    /// Of calibrated samples, in which the fit was made.
    pub calibrated: RawUnit,
    /// Raw value at zero, raw unit.
    pub offset: f32,
    /// Raw units a calibrated unit; not zero.
    pub per_unit: f32,
}

/// Standard errors of parameters, each in its own unit; zeros without a covariance, which no accepted fit lacks.
pub fn standard_errors<T: Scalar, const P: usize>(covariance: &Option<SMatrix<T, P, P>>) -> SVector<T, P> {
    covariance.as_ref().map_or_else(SVector::zeros, |c| c.diagonal().map(T::root))
}

/// Standard errors of gain and bias where the sensitivity `K = gain⁻¹` was fitted, by `dG = −G dK G`.
///
/// The parameters begin with the nine entries of `K` by rows and the bias, as
/// [`UnifiedParameters`](crate::model::unified::UnifiedParameters) has them. Zeros without a covariance.
pub fn errors_by_sensitivity<T: Scalar, const P: usize>(
    gain: &Matrix3<T>,
    covariance: &Option<SMatrix<T, P, P>>,
) -> Triad<T> {
    let mut std = Triad { gain: Matrix3::zeros(), bias: Vector3::zeros() };
    let Some(covariance) = covariance else { return std };
    for (i, left) in gain.row_iter().enumerate() {
        for (j, right) in gain.column_iter().enumerate() {
            // Derivative of G_ij by K_kl is −G_ik G_lj.
            let mut by = SVector::<T, P>::zeros();
            for (slot, factor) in
                by.iter_mut().zip(left.iter().flat_map(|a| right.iter().map(move |b| *a * *b)))
            {
                *slot = factor;
            }
            if let Some(entry) = std.gain.get_mut((i, j)) {
                *entry = (covariance * by).dot(&by).root();
            }
        }
    }
    let variances = covariance.diagonal();
    for (slot, variance) in std.bias.iter_mut().zip(variances.iter().skip(9)) {
        *slot = variance.root();
    }
    std
}

fn rows(matrix: &Matrix3<f32>) -> [[f32; 3]; 3] {
    matrix.transpose().into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{norm::NormModel, parameterisation::UPPER_TRIANGULAR};

    /// Rests of an ideal sensor on the sphere of radius 10.
    fn sphere() -> [ShellPoint<f32>; 32] {
        core::array::from_fn(|k| {
            let z = 1.0 - (2 * k + 1) as f32 / 32.0;
            let (sin, cos) = libm::sincosf(2.4 * k as f32);
            let radius = libm::sqrtf(1.0 - z * z);
            let wave = 1.0 + 1e-3 * libm::sinf(7.0 * k as f32);
            ShellPoint::new(Vector3::new(cos * radius, sin * radius, z) * (10.0 * wave))
        })
    }

    fn fitted(points: &[ShellPoint<f32>]) -> (NormModel<'_, f32, 9>, LevenbergMarquardt<f32, 9>) {
        let model = NormModel { points, norm: 10.0, form: UPPER_TRIANGULAR };
        let start = UPPER_TRIANGULAR.theta(&Triad::identity());
        let mut solver = LevenbergMarquardt::new(start, Default::default());
        solver.run(&model);
        (model, solver)
    }

    fn criteria(points: &[ShellPoint<f32>]) -> Criteria<'_, f32> {
        let observed = Observed::Points(points);
        Criteria { observed, limits: Limits::for_norm(9, 10), radius: 10.0, nonlinearity: true }
    }

    #[test]
    fn a_fit_all_round_is_accepted_with_its_figures_in_the_record() {
        let points = sphere();
        let (model, solver) = fitted(&points);
        let triad = UPPER_TRIANGULAR.triad(solver.theta());
        let std = UPPER_TRIANGULAR.triad(&standard_errors(&solver.covariance()));
        let criteria = criteria(&points);
        let summary = FitSummary::of(&solver, &model, &triad, &criteria);
        assert_eq!(summary.check(&triad, &std, &criteria), Ok(()));
        let unit = RawUnit::MetrePerSecondSquared;
        let units = Units { raw: RawUnit::Counts, calibrated: unit, offset: 100.0, per_unit: -50.0 };
        let record = summary.record(&triad, &std, "T9", &units);
        // A raw value of 100 counts is zero before calibration; a count is −0.02 m/s².
        for (raw, bias) in record.bias.iter().zip(&triad.bias) {
            assert!((raw - (100.0 - 50.0 * bias)).abs() < 1e-4);
        }
        assert!((record.gain[0][0] * -50.0 - triad.gain[(0, 0)]).abs() < 1e-6);
        assert!((record.quality.bias_std[1] - 50.0 * std.bias.y).abs() < 1e-6);
        assert_eq!((record.quality.observations, record.quality.parameters), (32, 9));
        assert_eq!(record.quality.rms, summary.rms);
        assert_eq!(record.model.as_str(), "T9");
    }

    #[test]
    fn a_cap_of_the_sphere_is_refused_for_its_coverage() {
        let points = sphere();
        let (model, solver) = fitted(&points);
        let triad = UPPER_TRIANGULAR.triad(solver.theta());
        let cap: std::vec::Vec<_> = (0..32).map(|k| points[k % 4]).collect();
        let criteria = criteria(&cap);
        let summary = FitSummary::of(&solver, &model, &triad, &criteria);
        let refused = summary.check(&triad, &triad, &criteria);
        assert!(matches!(refused, Err(Refusal::PoorCoverage { .. })), "{refused:?}");
    }

    #[test]
    fn a_turn_observes_its_axis_in_both_senses() {
        let ends = [[Vector3::<f32>::x(), Vector3::y()]];
        let triad = Triad::identity();
        let seen = Observed::TurnEnds(&ends);
        assert_eq!(seen.direction(&triad, 0), Vector3::z());
        assert_eq!(seen.direction(&triad, 1), -Vector3::z());
        assert_eq!(seen.coverage(&triad).observations, 2);
    }

    #[test]
    fn errors_of_a_gain_are_those_of_finite_differences_of_the_inverse() {
        let sensitivity = Matrix3::new(1.1, 0.1, -0.05, 0.02, 0.9, 0.07, -0.03, 0.04, 1.05);
        let gain = sensitivity.try_inverse().expect("it is regular");
        let covariance = SMatrix::<f32, 12, 12>::from_fn(|i, j| match (i == j, i.abs_diff(j)) {
            (true, _) => 1e-4 * (1 + i) as f32,
            (false, 1) => 2e-5,
            _ => 0.0,
        });
        let found = errors_by_sensitivity(&gain, &Some(covariance));
        for (at, std) in found.gain.iter().enumerate() {
            let mut slopes = SVector::<f32, 12>::zeros();
            for (k, slope) in slopes.iter_mut().take(9).enumerate() {
                let mut moved = sensitivity.map(f64::from);
                moved[(k / 3, k % 3)] += 1e-6;
                let moved = moved.try_inverse().expect("it is regular")[at];
                let gain = sensitivity.map(f64::from).try_inverse().expect("it is regular")[at];
                *slope = ((moved - gain) / 1e-6) as f32;
            }
            let dense = (slopes.transpose() * covariance * slopes)[0].sqrt();
            assert!((std - dense).abs() < 1e-5 * (1.0 + dense), "entry {at}: {std} for {dense}");
        }
        assert!((found.bias.z - covariance[(11, 11)].sqrt()).abs() < 1e-7);
    }
}
