//! A fit of the unified model to poses on a rig: gauge, standard errors, held-out residuals.

use imucal_core::{
    model::{
        rig::{GimbalPose, Pose},
        unified::{Terms, UnifiedModel, UnifiedParameters},
    },
    solver::{LevenbergMarquardt, SolveReport, gauge::Gauge, lm::Settings},
    triad::Triad,
};
use nalgebra::{DMatrix, DVector, SMatrix, SVector, Vector3};

use super::{
    compare::Step,
    rows::{Residuals, Rows, influence},
};
use crate::{
    noise::{self, Noise},
    observe::pose::Poses,
};

/// A column that its predecessors leave less than this share of is told by them: far below what noise leaves of an
/// observable one, far above rounding.
const TOLERANCE: f64 = 1e-5;

/// One rung of a ladder, fitted.
#[derive(Clone, Debug)]
pub struct RigFit {
    /// Parameters at the optimum.
    pub parameters: UnifiedParameters<f64>,
    /// Entries estimated.
    pub entries: Vec<u8>,
    /// Those of them that the poses cannot tell, with the entry each is like.
    pub held: Vec<(u8, Option<u8>)>,
    /// The solver's report.
    pub report: SolveReport<f64>,
    /// Covariance of the estimated entries, for noise that may drift from pose to pose; zero where held.
    pub covariance: DMatrix<f64>,
    /// Rms residual of an axis, with the degrees of freedom left.
    pub rms: f64,
    /// Rms residual of poses left out in turn, all three axes of one at a time.
    pub held_out_rms: Option<f64>,
    /// Sum of squared residuals.
    pub squared_sum: f64,
    /// Residuals used, three a pose.
    pub residuals: usize,
}

/// Where a fit ended, and what the poses told of it.
pub(crate) struct Solved<'a, const P: usize, G: Pose<f64>> {
    /// The model, with what is held.
    pub model: UnifiedModel<'a, f64, P, G>,
    /// The solver at its end.
    pub solver: LevenbergMarquardt<f64, P>,
    /// What the poses do not tell.
    pub gauge: Gauge<f64, P>,
}

/// Fits `terms` from `base`.
pub fn fit<const P: usize>(poses: &Poses, base: &UnifiedParameters<f64>, terms: Terms<P>) -> RigFit {
    let outer = Vector3::ith(poses.axes.0[0] as usize, 1.0);
    summarise(poses, &solve(&poses.poses, poses.axes, base, terms, Some(outer)))
}

/// Solves for `terms` from `base`, holds what the poses do not tell, and keeps a field that is known at its length.
/// `outer` is the rig's outer axis.
pub(crate) fn solve<'a, const P: usize, G: Pose<f64>>(
    poses: &'a [G],
    axes: G::Axes,
    base: &UnifiedParameters<f64>,
    terms: Terms<P>,
    outer: Option<Vector3<f64>>,
) -> Solved<'a, P, G> {
    let free = UnifiedModel { poses, axes, base: *base, terms, held: 0 };
    let mut solver = LevenbergMarquardt::new(terms.theta(base), Settings::default());
    solver.run(&free);
    let gauge = Gauge::of(solver.factor().r(), TOLERANCE, |k| terms.class(k));
    let model = UnifiedModel { held: gauge.held, ..free };
    if gauge.held != 0 {
        let mut start = *solver.theta();
        let at = terms.theta(base);
        for k in (0..P).filter(|k| gauge.is_held(*k)) {
            start[k] = at[k];
        }
        solver = LevenbergMarquardt::new(start, Settings::default());
        solver.run(&model);
    }
    let found = terms.parameters(base, solver.theta());
    let Some(field) = of_known_length(outer, base, &found, &terms, &gauge) else {
        return Solved { model, solver, gauge };
    };
    // Held anew where the field has its length: K and sources are then those of the field that is known.
    let model = UnifiedModel { base: UnifiedParameters { vector_n: field, ..*base }, ..model };
    let start = terms.theta(&UnifiedParameters { vector_n: field, ..found });
    solver = LevenbergMarquardt::new(start, Settings::default());
    solver.run(&model);
    Solved { model, solver, gauge }
}

/// The field that is known, where what was found of it allows; `None` where nothing of it is held.
///
/// Its length is told by K alone, so that one entry is held; with a source on the outer gimbal, its component along
/// the outer axis as well. The entries that are held are not these, and in a base that points elsewhere they are off,
/// K and the sources with them: by 8e-4 for half a degree at a declination of 5°. So the field keeps its length, and
/// where its direction is told but in part, that part by a heading of the base.
fn of_known_length<const P: usize>(
    outer: Option<Vector3<f64>>,
    base: &UnifiedParameters<f64>,
    found: &UnifiedParameters<f64>,
    terms: &Terms<P>,
    gauge: &Gauge<f64, P>,
) -> Option<Vector3<f64>> {
    let of_field = |k: &usize| gauge.is_held(*k) && (14..17).contains(&terms.entries()[*k]);
    let (known, now) = (base.vector_n, found.vector_n);
    let field = match (0..P).filter(of_field).count() {
        1 => now * (known.norm() / now.norm()),
        2 => headed(&known, &outer?.cross(&now))?,
        _ => return None,
    };
    field.iter().all(|x| x.is_finite()).then_some(field)
}

/// `known` turned about the vertical until it is across `normal`, by Newton from no turn; `None` where no turn below
/// some 30° does it.
fn headed(known: &Vector3<f64>, normal: &Vector3<f64>) -> Option<Vector3<f64>> {
    let (mut heading, mut field) = (0.0f64, *known);
    for _ in 0..20 {
        let slope = normal.dot(&Vector3::new(-field.y, field.x, 0.0));
        heading -= normal.dot(&field) / slope;
        if heading.is_nan() || heading.abs() > 0.5 {
            return None;
        }
        let (sin, cos) = heading.sin_cos();
        field = Vector3::new(cos * known.x - sin * known.y, sin * known.x + cos * known.y, known.z);
    }
    Some(field)
}

impl<const P: usize, G: Pose<f64>> Solved<'_, P, G> {
    /// The fit, with these standard errors (zero where held) and this residual of what was left out.
    pub fn fit(&self, mut covariance: DMatrix<f64>, held_out_rms: Option<f64>) -> RigFit {
        let Self { model, solver, gauge } = self;
        let entries = model.terms.entries();
        let held: Vec<usize> = (0..P).filter(|k| gauge.is_held(*k)).collect();
        for k in &held {
            covariance.column_mut(*k).fill(0.0);
            covariance.row_mut(*k).fill(0.0);
        }
        let like = |k: &usize| (entries[*k], gauge.like[*k].map(|like| entries[usize::from(like)]));
        RigFit {
            parameters: model.terms.parameters(&model.base, solver.theta()),
            entries: entries.to_vec(),
            held: held.iter().map(like).collect(),
            report: solver.report(),
            covariance,
            rms: solver.variance().map_or(f64::NAN, f64::sqrt),
            held_out_rms,
            squared_sum: 2.0 * solver.report().cost,
            residuals: 3 * model.poses.len(),
        }
    }
}

fn summarise<const P: usize>(poses: &Poses, solved: &Solved<'_, P, GimbalPose<f64>>) -> RigFit {
    let Solved { model, solver, gauge } = solved;
    let held: Vec<usize> = (0..P).filter(|k| gauge.is_held(*k)).collect();
    let rows = Rows::of(model, solver.theta());
    let covariance = covariance(poses, &rows, &held).unwrap_or_else(|| {
        let white = solver.covariance().unwrap_or_else(|| SMatrix::repeat(f64::INFINITY));
        DMatrix::from_column_slice(P, P, white.as_slice())
    });
    solved.fit(covariance, held_out(model, solver.theta()))
}

/// Covariance A V Aᵀ of least squares, A = (JᵀJ)⁻¹Jᵀ, for noise that drifts; zero where held. `None` where the rows do
/// not determine the parameters, leave nothing, or are too many.
fn covariance<const P: usize>(poses: &Poses, rows: &Rows<P>, held: &[usize]) -> Option<DMatrix<f64>> {
    let count = 3 * poses.poses.len();
    let free: Vec<usize> = (0..P).filter(|k| !held.contains(k)).collect();
    let residuals = DVector::from_fn(count, |row, _| rows.residuals[row]);
    let jacobian = rows.derivatives(count, &free);
    let noise = Noise::of(&noise::Residuals {
        spans: &poses.spans,
        density: poses.density,
        residuals: &residuals,
        jacobian: &jacobian,
    })?;
    let influence = influence(&jacobian)?;
    let told = noise.propagated(&poses.spans, &influence);
    let mut covariance = DMatrix::zeros(P, P);
    for (i, row) in free.iter().enumerate() {
        for (j, column) in free.iter().enumerate() {
            covariance[(*row, *column)] = told[(i, j)];
        }
    }
    covariance.iter().all(|x| x.is_finite()).then_some(covariance)
}

/// Each pose left out in turn, one Gauss–Newton step from the optimum of all.
fn held_out<const P: usize>(model: &UnifiedModel<'_, f64, P>, theta: &SVector<f64, P>) -> Option<f64> {
    let rows = Rows::of(model, theta);
    let mut sum = 0.0;
    for k in 0..model.poses.len() {
        let there = theta + rows.step_without(3 * k..3 * k + 3)?;
        let alone = UnifiedModel { poses: &model.poses[k..=k], held: 0, ..*model };
        sum += Residuals::of(&alone, &there).iter().map(|r| r * r).sum::<f64>();
    }
    Some((sum / (3 * model.poses.len()) as f64).sqrt())
}

impl RigFit {
    /// The fit as a rung of a comparison.
    pub fn step(&self, name: &'static str, adds: &'static str) -> Step {
        Step {
            name,
            adds,
            entries: self.entries.clone(),
            free: self.free(),
            residuals: self.residuals,
            squared_sum: self.squared_sum,
            rms: self.rms,
            held_out_rms: self.held_out_rms,
            second_half_rms: None,
        }
    }

    /// Parameters that were estimated and not held.
    pub fn free(&self) -> usize {
        self.entries.len() - self.held.len()
    }

    /// Standard error of an entry; `None` where it was not estimated.
    pub fn std(&self, entry: u8) -> Option<f64> {
        let k = self.entries.iter().position(|e| *e == entry)?;
        Some(self.covariance[(k, k)].sqrt())
    }

    /// Gain and bias of the triad, nominal SI in, table axes out, and their covariance in the order gain by rows,
    /// bias. By `dG = −G dK G`; where one component of the field e is held so that |e| is, also by `dG = −G (e·de)/|e|²`.
    pub fn triad(&self) -> Option<(Triad<f64>, DMatrix<f64>)> {
        let gain = self.parameters.sensitivity.try_inverse()?;
        let length_held = self.held.iter().filter(|(entry, _)| (14..17).contains(entry)).count() == 1;
        let mut jacobian = DMatrix::zeros(12, self.entries.len());
        for (column, entry) in self.entries.iter().enumerate() {
            match usize::from(*entry) {
                k @ 0..9 => {
                    let by = -(gain.column(k / 3) * gain.row(k % 3));
                    jacobian.set_column(column, &pad(&by));
                }
                k @ 9..12 => jacobian[(k, column)] = 1.0,
                k @ 14..17 if length_held => {
                    let field = self.parameters.vector_n;
                    jacobian.set_column(column, &pad(&(gain * (-field[k - 14] / field.norm_squared()))));
                }
                _ => {}
            }
        }
        let covariance = &jacobian * &self.covariance * jacobian.transpose();
        Some((Triad { gain, bias: self.parameters.bias }, covariance))
    }
}

/// A gain's derivative by rows, and nothing of the bias.
fn pad(by: &nalgebra::Matrix3<f64>) -> DVector<f64> {
    DVector::from_iterator(12, by.transpose().iter().copied().chain([0.0; 3]))
}
