//! A norm fit with all that a demanding user asks of it: outliers, held-out error, acceptance.

use std::slice::from_ref;

use imucal_core::{
    accept::{self, Limits, Refusal},
    coverage::Coverage,
    model::{
        Parameterisation,
        norm::{NormModel, curvature_excess},
    },
    observation::ShellPoint,
    solver::{LevenbergMarquardt, triangular::Triangular},
    triad::Triad,
};
use nalgebra::{SVector, Vector3};
use rayon::prelude::*;

use super::{
    held_out::{by_folds, by_steps, root_mean},
    least_squares,
    outlier::{Kept, leaving_out_few},
    parallel_rows::ParallelRows,
    report::FitReport,
    rows::{Residuals, Rows},
};

/// Rounds of leaving out gross outliers.
const ROUNDS: usize = 4;

/// More observations than this are left out in [`PARTS`] parts instead of one by one.
pub const SINGLES: usize = 400;
/// See [`SINGLES`].
pub const PARTS: usize = 20;

/// Points that one core fits, and points of a part where there are more.
const FEW: usize = 40_000;
/// See [`FEW`].
const PART: usize = 16_384;

/// Points that are enough to tell a minimum from another.
const SAMPLE: usize = 20_000;

/// What to fit.
#[derive(Clone, Copy, Debug)]
pub struct NormProblem<'a, const P: usize> {
    /// Observations in time order, nominal SI.
    pub points: &'a [ShellPoint<f64>],
    /// Radius of the calibrated sphere.
    pub norm: f64,
    /// Estimated entries.
    pub form: Parameterisation<P>,
    /// Neighbouring residuals may be alike: a cloud, not rests.
    pub serial: bool,
}

/// What a fit's errors are said to be.
#[derive(Clone, Copy, Debug)]
pub struct Stated {
    /// Standard errors of the entries, zero where one is not estimated.
    pub std: Triad<f64>,
    /// The standard error along the weakest direction over its classical one.
    pub inflation: f64,
}

/// A fit, before anyone has accepted it.
#[derive(Clone, Debug)]
pub struct NormFit<const P: usize> {
    /// The solver at its end.
    pub solver: LevenbergMarquardt<f64, P>,
    /// Observations used, in order: points with their expected excess.
    pub points: Vec<ShellPoint<f64>>,
    /// Index of each used point among the problem's.
    pub used: Vec<usize>,
    /// Indices left out, with their size in robust standard deviations.
    pub left_out: Vec<(usize, f64)>,
}

impl<const P: usize> NormProblem<'_, P> {
    fn model<'a>(&self, points: &'a [ShellPoint<f64>]) -> NormModel<'a, f64, P> {
        NormModel { points, norm: self.norm, form: self.form }
    }

    fn solve(&self, points: &[ShellPoint<f64>], start: SVector<f64, P>) -> LevenbergMarquardt<f64, P> {
        if points.len() <= FEW {
            return least_squares::solve(&self.model(points), start);
        }
        least_squares::solve(&self.parts(points), start)
    }

    /// The same from a start that is near the end: of very many points each pass counts.
    fn refine(&self, points: &[ShellPoint<f64>], start: SVector<f64, P>) -> LevenbergMarquardt<f64, P> {
        if points.len() <= FEW {
            return self.solve(points, start);
        }
        least_squares::refine(&self.parts(points), start)
    }

    fn parts<'a>(&self, points: &'a [ShellPoint<f64>]) -> ParallelRows<NormModel<'a, f64, P>> {
        ParallelRows(points.chunks(PART).map(|part| self.model(part)).collect())
    }

    /// An even sample of the points, all of them where they are not very many: for choosing among starts.
    pub fn sample(&self) -> Vec<ShellPoint<f64>> {
        self.points.iter().copied().step_by(self.points.len().div_ceil(SAMPLE).max(1)).collect()
    }

    /// Cost of a plain fit from `start`, and where it ended.
    pub fn ends(&self, start: &Triad<f64>) -> (f64, Triad<f64>) {
        let solver = self.solve(self.points, self.form.theta(start));
        let cost = solver.report().cost;
        (if cost.is_finite() { cost } else { f64::INFINITY }, self.form.triad(solver.theta()))
    }

    /// Fits from `start`, leaving out gross outliers; where all rounds together would leave out more than
    /// [`MOST`](super::outlier::MOST), none is.
    pub fn fit(&self, start: &Triad<f64>) -> NormFit<P> {
        let mut all = self.points.to_vec();
        let kept =
            leaving_out_few(all.len(), ROUNDS, |used, before: Option<&(LevenbergMarquardt<f64, P>, _)>| {
                if before.is_none() {
                    all.copy_from_slice(self.points);
                }
                let mut points: Vec<_> = used.iter().map(|k| all[*k]).collect();
                let mut solver = match before {
                    None => self.solve(&points, self.form.theta(start)),
                    Some((before, _)) => self.refine(&points, *before.theta()),
                };
                if self.serial {
                    self.expect_curvature(&mut points, &solver);
                    solver = self.refine(&points, *solver.theta());
                    used.iter().zip(&points).for_each(|(k, point)| all[*k] = *point);
                }
                let residuals = self.residuals(&points, solver.theta());
                ((solver, points), residuals)
            });
        let Kept { fit: (solver, points), used, left_out } = kept;
        NormFit { solver, points, used, left_out }
    }

    /// Sets the excess that the residuals' own noise makes on the curved shell.
    fn expect_curvature(&self, points: &mut [ShellPoint<f64>], solver: &LevenbergMarquardt<f64, P>) {
        let triad = self.form.triad(solver.theta());
        let variance = solver.variance().unwrap_or(0.0);
        points.par_iter_mut().with_min_len(PART).for_each(|point| {
            point.excess = curvature_excess(&triad, self.norm, &point.value, variance);
        });
    }

    /// Rms residual of single observations left out of the fit in turn. Each time the fit takes one Gauss–Newton
    /// step from the optimum of all; `None` where the others do not determine it.
    /// Beyond [`SINGLES`] observations, contiguous parts are left out instead: of so many, neighbours are alike.
    pub fn leave_one_out_rms(&self, fit: &NormFit<P>) -> Option<f64> {
        if fit.points.len() > SINGLES {
            return self.held_out_rms(fit, PARTS);
        }
        let (theta, count) = (fit.solver.theta(), fit.points.len());
        let sum = by_steps(&Rows::of(&self.model(&fit.points), theta), theta, (count, 1), |k, theta| {
            self.squared_sum(from_ref(&fit.points[k]), theta)
        });
        Some(root_mean(sum?, count))
    }

    fn residuals(&self, points: &[ShellPoint<f64>], theta: &SVector<f64, P>) -> Vec<f64> {
        let of_part = |part: &[ShellPoint<f64>]| Residuals::of(&self.model(part), theta);
        points.par_chunks(PART).map(of_part).collect::<Vec<_>>().concat()
    }

    fn squared_sum(&self, points: &[ShellPoint<f64>], theta: &SVector<f64, P>) -> f64 {
        Residuals::of(&self.model(points), theta).iter().map(|r| r * r).sum()
    }

    /// Rms residual of observations left out of the fit, `folds` contiguous parts in turn, each time fitted again, of very
    /// many by one Gauss–Newton step; `None` where a fit does not converge.
    pub fn held_out_rms(&self, fit: &NormFit<P>, folds: usize) -> Option<f64> {
        let count = fit.points.len();
        if count > FEW {
            return self.held_out_rms_by_factors(fit, folds);
        }
        let sum = by_folds(count, folds, |part| {
            let kept = [&fit.points[..part.start], &fit.points[part.end..]].concat();
            let solver = self.solve(&kept, *fit.solver.theta());
            let converged = solver.report().termination.was_successful();
            converged.then(|| self.squared_sum(&fit.points[part], solver.theta()))
        });
        Some(root_mean(sum?, count))
    }

    /// The same by a factor of each part, those of the others put together.
    fn held_out_rms_by_factors(&self, fit: &NormFit<P>, folds: usize) -> Option<f64> {
        let (theta, count) = (fit.solver.theta(), fit.points.len());
        let part = |fold: usize| fold * count / folds..(fold + 1) * count / folds;
        let models = (0..folds).map(|fold| self.model(&fit.points[part(fold)])).collect();
        let factors = ParallelRows(models).factors(theta);
        let sum = by_folds(count, folds, |points| {
            let mut others = Triangular::default();
            let not_this = factors.iter().enumerate().filter(|(fold, _)| part(*fold) != points);
            not_this.for_each(|(_, factor)| factor.stream(&mut others));
            let step = others.damped_step(0.0, &SVector::repeat(0.0))?;
            Some(self.squared_sum(&fit.points[points], &(theta + step)))
        });
        Some(root_mean(sum?, count))
    }

    /// Directions seen, as the fit sees them.
    pub fn coverage(&self, fit: &NormFit<P>) -> Coverage<f64> {
        let triad = self.form.triad(fit.solver.theta());
        Coverage::of(fit.points.iter().map(|p| triad.correct(&p.value).normalize()))
    }

    /// Acceptance of the fit; the departure from a parabola is returned either way.
    pub fn judge(
        &self,
        fit: &NormFit<P>,
        coverage: &Coverage<f64>,
        stated: &Stated,
        nominal: bool,
        limits: &Limits,
    ) -> (f64, Result<(), Refusal>) {
        let bend = accept::nonlinearity(&fit.solver, &self.parts(&fit.points), stated.inflation);
        let verdict = self.verdict(fit, coverage, (bend, &stated.std), nominal, limits);
        (bend, verdict)
    }

    fn verdict(
        &self,
        fit: &NormFit<P>,
        coverage: &Coverage<f64>,
        (bend, std): (f64, &Triad<f64>),
        nominal: bool,
        limits: &Limits,
    ) -> Result<(), Refusal> {
        let triad = self.form.triad(fit.solver.theta());
        let radius = mean_radius(&triad, self.norm);
        let relative_rms = fit.rms() / radius;
        accept::check_observations(coverage, P, limits)?;
        // Before what depends on the noise: a residual that is no noise would be blamed on the poses.
        if fit.solver.report().termination.was_successful() {
            accept::check_residual(relative_rms, limits)?;
        }
        accept::check_report(&fit.solver.report())?;
        let error = accept::relative_error(&triad.gain, std, radius);
        accept::check_precision(error, limits)?;
        accept::check_nonlinearity(bend, error, limits)?;
        accept::check_plausibility(&triad, nominal, relative_rms, limits)
    }
}

/// Radius of the shell in raw units, on average over the axes.
fn mean_radius(triad: &Triad<f64>, norm: f64) -> f64 {
    norm / triad.gain.determinant().abs().cbrt()
}

impl<const P: usize> NormFit<P> {
    /// Rms residual with the degrees of freedom left; NaN without any.
    pub fn rms(&self) -> f64 {
        least_squares::rms(&self.solver)
    }

    /// The fit's figures, one residual a point, without those that need more than the fit.
    pub fn report(&self) -> FitReport {
        FitReport::of(&self.solver, self.points.len(), 1)
    }
}

/// Directions before there is a fit: from the points' own middle, for a refusal of too little data.
pub fn raw_coverage(points: &[ShellPoint<f64>], middle: &Vector3<f64>) -> Coverage<f64> {
    Coverage::of(points.iter().map(|p| (p.value - middle).normalize()))
}

#[cfg(test)]
mod tests {
    use imucal_core::model::parameterisation::UPPER_TRIANGULAR;

    use super::*;
    use crate::simulator::random::{Purpose, Random};

    fn cloud(count: usize) -> Vec<ShellPoint<f64>> {
        let mut random = Random::new(1, Purpose::Noise);
        let point = |_| ShellPoint::new(random.normals().normalize() * 48.0 + random.normals() * 0.3);
        (0..count).map(point).collect()
    }

    #[test]
    fn of_very_many_points_a_sample_ends_near_and_parts_where_all_of_them_do() {
        let points = cloud(FEW + 5000);
        let problem = NormProblem { points: &points, norm: 48.0, form: UPPER_TRIANGULAR, serial: false };
        let start = Triad::identity();
        let whole = least_squares::solve(&problem.model(&points), problem.form.theta(&start));
        let (_, end) = NormProblem { points: &problem.sample(), ..problem }.ends(&start);
        // Of every third point; five of its standard errors.
        let std = whole.covariance().unwrap().diagonal().map(f64::sqrt) * 3f64.sqrt();
        let apart = (problem.form.theta(&end) - whole.theta()).component_div(&std);
        assert!((0.1..5.0).contains(&apart.amax()), "{apart}");
        let fit = problem.fit(&end);
        assert!(fit.left_out.is_empty());
        assert!((fit.solver.theta() - whole.theta()).component_div(&std).amax() < 1e-4);
    }

    #[test]
    fn what_a_step_says_of_parts_that_were_left_out_is_what_fits_without_them_say() {
        let points = cloud(2000);
        let problem = NormProblem { points: &points, norm: 48.0, form: UPPER_TRIANGULAR, serial: true };
        let fit = problem.fit(&Triad::identity());
        let (step, fits) = (problem.held_out_rms_by_factors(&fit, 5), problem.held_out_rms(&fit, 5));
        let (step, fits) = (step.unwrap(), fits.unwrap());
        assert!((step / fits - 1.0).abs() < 1e-6 && fits > fit.rms(), "{step} {fits}");
    }
}
