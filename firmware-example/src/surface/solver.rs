//! Solvers, and whether to believe them.

use imucal_core::{
    accept::{self, Limits, Refusal},
    coverage::Coverage,
    fit::{self, Criteria, FitSummary, Observed, Units},
    model::{Cost, RowSink, SquaredSum, norm::NormModel, parameterisation::UPPER_TRIANGULAR},
    observation::ShellPoint,
    record::RawUnit,
    solver::{
        self, LevenbergMarquardt, SolveReport, Termination,
        gauge::Gauge,
        swarm::{Bounds, Swarm},
        triangular::Triangular,
    },
    triad::Triad,
};
use nalgebra::{SVector, Vector3};

use crate::{scene, search::Draws};

/// The squared distance from (1, −2), in one block.
struct Distance;

impl Cost<f32, 2> for Distance {
    type State = ();

    fn begin(&self, _: &SVector<f32, 2>) {}

    fn advance(&self, theta: &SVector<f32, 2>, _: &mut (), _: &mut usize) -> Option<f32> {
        Some((theta.x - 1.0) * (theta.x - 1.0) + (theta.y + 2.0) * (theta.y + 2.0))
    }
}

#[inline(never)]
pub(super) fn reach_all() {
    let points: [ShellPoint<f32>; 16] =
        core::array::from_fn(|k| ShellPoint::new(scene::spiral(k, 16) * 9.7 + Vector3::new(0.1, 0.2, 0.3)));
    let shell = NormModel { points: &points, norm: 9.8, form: UPPER_TRIANGULAR };
    let fit = descent(&shell);
    judged(&fit, &shell);
    summarised(&fit, &shell);
    factor();
    searched();
}

#[inline(never)]
fn descent(shell: &NormModel<'_, f32, 9>) -> LevenbergMarquardt<f32, 9> {
    let settings: solver::lm::Settings<f32> = reach!(solver::lm::Settings::default());
    let theta = UPPER_TRIANGULAR.theta(&Triad::identity());
    let mut fit = reach!(solver::lm::LevenbergMarquardt::new(theta, settings));
    reach!(solver::lm::LevenbergMarquardt::step(&mut fit, shell));
    reach!(solver::lm::LevenbergMarquardt::run(&mut fit, shell));
    reach!(solver::lm::LevenbergMarquardt::theta(&fit));
    reach!(solver::lm::LevenbergMarquardt::iterations(&fit));
    let mut factor = *reach!(solver::lm::LevenbergMarquardt::factor(&fit));
    reach!(solver::panel::triangularise(shell, &theta, &mut factor));
    reach!(solver::lm::LevenbergMarquardt::variance(&fit));
    reach!(solver::lm::LevenbergMarquardt::covariance(&fit));
    reach!(solver::jacobian_check::largest_jacobian_error(shell, &theta));
    fit
}

#[inline(never)]
fn judged(fit: &LevenbergMarquardt<f32, 9>, shell: &NormModel<'_, f32, 9>) {
    let limits: Limits = reach!(accept::Limits::for_norm(9, 10));
    let report: SolveReport<f32> = reach!(solver::lm::LevenbergMarquardt::report(fit));
    reach!(solver::report::Termination::was_successful(report.termination));
    reach!(solver::report::Termination::name(Termination::Stalled));
    let coverage = Coverage { observations: 20, share: 0.5f32, flatness: 0.1, distinct: 12 };
    let bend = reach!(accept::nonlinearity(fit, shell, 1.0f32));
    let triad: Triad<f32> = Triad::identity();
    let error = reach!(accept::relative_error(&triad.gain, &triad, 1.0f32));
    let verdicts = [
        reach!(accept::check_observations(&coverage, 9, &limits)),
        reach!(accept::check_report(&report)),
        reach!(accept::check_precision(error, &limits)),
        reach!(accept::check_nonlinearity(bend, error, &limits)),
        reach!(accept::check_plausibility(&Triad::identity(), true, 0.01f32, &limits)),
        reach!(accept::check_residual(0.01f32, &limits)),
    ];
    let refusal = verdicts.into_iter().find_map(Result::err).unwrap_or(Refusal::NotFinite);
    reach!(accept::Refusal::reason(&refusal));
}

#[inline(never)]
fn summarised(solver: &LevenbergMarquardt<f32, 9>, shell: &NormModel<'_, f32, 9>) {
    let triad = UPPER_TRIANGULAR.triad(solver.theta());
    let observed = Observed::Points(shell.points);
    let criteria = Criteria { observed, limits: Limits::for_norm(9, 10), radius: 9.8, nonlinearity: true };
    reach!(fit::Observed::coverage(&criteria.observed, &triad));
    let summary: FitSummary<f32> = reach!(fit::FitSummary::of(solver, shell, &triad, &criteria));
    let covariance = solver.covariance();
    let std = UPPER_TRIANGULAR.triad(&reach!(fit::standard_errors(&covariance)));
    reach!(fit::errors_by_sensitivity(&triad.gain, &covariance));
    let _accepted = reach!(fit::FitSummary::check(&summary, &triad, &std, &criteria));
    let unit = RawUnit::MetrePerSecondSquared;
    let units = Units { raw: unit, calibrated: unit, offset: 0.0, per_unit: 1.0 };
    reach!(fit::FitSummary::record(&summary, &triad, &std, "T9", &units));
}

#[inline(never)]
fn factor() {
    let mut factor: Triangular<f32, 9> = reach!(solver::triangular::Triangular::default());
    let row = SVector::repeat(0.5);
    reach!(solver::triangular::Triangular::push(&mut factor, 0.5, &row));
    reach!(solver::triangular::Triangular::row(&mut factor, 0.5, &row));
    let mut sum = SquaredSum(0.0f32);
    reach!(solver::triangular::Triangular::stream(&factor, &mut sum));
    reach!(solver::triangular::Triangular::squared_sum(&factor));
    reach!(solver::triangular::Triangular::gradient(&factor));
    let norms = reach!(solver::triangular::Triangular::column_norms(&factor));
    reach!(solver::triangular::Triangular::length_of(&factor, &row));
    reach!(solver::triangular::Triangular::damped_step(&factor, 1e-3, &norms));
    reach!(solver::triangular::Triangular::inverse(&factor));
    reach!(solver::triangular::Triangular::covariance(&factor, 1.0));
    let r = reach!(solver::triangular::Triangular::r(&factor));
    reach!(solver::condition::normalised_condition(r));
    reach!(solver::condition::weakest_direction(r));
    let gauge: Gauge<f32, 9> = reach!(solver::gauge::Gauge::of(r, 1e-5, |k| (k / 3) as u8));
    reach!(solver::gauge::Gauge::is_held(&gauge, 99));
    reach!(solver::gauge::bit(99));
}

#[inline(never)]
fn searched() {
    let settings: solver::swarm::Settings<f32> = reach!(solver::swarm::Settings::default());
    let reach_of = SVector::from([1.0f32, 2.0]);
    reach!(solver::swarm::Bounds::new(-reach_of, reach_of));
    let bounds: Option<Bounds<f32, 2>> = reach!(solver::swarm::Bounds::around(&reach_of, &reach_of));
    let (Some(bounds), mut draws) = (bounds, Draws(1)) else { return };
    let mut swarm: Swarm<f32, 10, 2, ()> = reach!(solver::swarm::Swarm::new(bounds, settings));
    reach!(solver::swarm::Swarm::step(&mut swarm, &Distance, &mut draws, 3));
    reach!(solver::swarm::Swarm::run(&mut swarm, &Distance, &mut draws));
    reach!(solver::swarm::Swarm::run_ahead(
        &mut swarm,
        &mut draws,
        |positions: &[SVector<f32, 2>], values: &mut [f32]| {
            positions.iter().zip(values).for_each(|(theta, value)| *value = Distance.cost(theta));
        }
    ));
    reach!(solver::swarm::Swarm::best(&swarm));
    reach!(solver::swarm::Swarm::report(&swarm));
    reach!(solver::swarm::Swarm::minimum_at_bound(&swarm));
    let _drawn: f32 = reach!(solver::swarm::uniform(&mut draws));
}
