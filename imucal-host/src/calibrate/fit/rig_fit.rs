//! A fit of the unified model to poses on a rig: gauge, standard errors, held-out residuals.

use imucal_core::{
    model::{
        rig::{GimbalPose, Pose},
        unified::{Terms, UnifiedModel, UnifiedParameters},
    },
    solver::{
        LevenbergMarquardt,
        gauge::{Gauge, bit},
    },
    triad::Triad,
};
use nalgebra::{DMatrix, DVector, SVector, Vector3};

use super::{
    compare::Step,
    heading::{self, Heading, headings},
    held_out::{by_steps, root_mean},
    least_squares,
    least_squares::dynamic,
    report::FitReport,
    rows::{Residuals, Rows, influence},
};
use crate::{
    noise::{self, Noise},
    observe::pose::Poses,
};

/// A column that its predecessors leave less than this share of is determined by them: far below what noise leaves of an
/// observable one, far above rounding.
const TOLERANCE: f64 = 1e-5;

/// One rung of a ladder, fitted.
#[derive(Clone, Debug)]
pub struct RigFit {
    /// Parameters at the optimum.
    pub parameters: UnifiedParameters<f64>,
    /// Entries estimated.
    pub entries: Vec<u8>,
    /// Those of them that the poses cannot determine, with the entry each is like.
    pub held: Vec<(u8, Option<u8>)>,
    /// The heading of the base against the known field, where it was looked for.
    pub heading: Option<Heading>,
    /// Its figures: three residuals a pose, held out three at a time.
    pub report: FitReport,
    /// Covariance of the estimated entries, for noise that may drift from pose to pose; zero where held.
    pub covariance: DMatrix<f64>,
}

/// Where a fit ended, and what the poses determine of it.
pub(crate) struct Solved<'a, const P: usize, G: Pose<f64>> {
    /// The model, with what is held.
    pub model: UnifiedModel<'a, f64, P, G>,
    /// The solver at its end.
    pub solver: LevenbergMarquardt<f64, P>,
    /// What the poses do not determine.
    pub gauge: Gauge<f64, P>,
    /// The heading of the base, where it was looked for.
    pub heading: Option<Heading>,
}

/// Fits `terms` from `base`.
pub fn fit<const P: usize>(poses: &Poses, base: &UnifiedParameters<f64>, terms: Terms<P>) -> RigFit {
    let outer = Vector3::ith(poses.axes.0[0] as usize, 1.0);
    summarise(poses, &solve(&poses.poses, poses.axes, base, terms, Some(outer)))
}

/// Solves for `terms` from `base`, holds what the poses do not determine, and keeps a field that is known at its length.
/// `outer` is the rig's outer axis.
pub(crate) fn solve<'a, const P: usize, G: Pose<f64>>(
    poses: &'a [G],
    axes: G::Axes,
    base: &UnifiedParameters<f64>,
    terms: Terms<P>,
    outer: Option<Vector3<f64>>,
) -> Solved<'a, P, G> {
    let known = base.vector_n;
    let free = UnifiedModel { poses, axes, base: *base, terms, held: 0 };
    let base = &if outer.is_some() { headed(&free) } else { *base };
    let free = UnifiedModel { base: *base, ..free };
    let mut solver = least_squares::solve(&free, terms.theta(base));
    let gauge = Gauge::of(solver.factor().r(), TOLERANCE, |k| terms.class(k));
    let model = UnifiedModel { held: gauge.held, ..free };
    if gauge.held != 0 {
        let mut start = *solver.theta();
        let at = terms.theta(base);
        for k in (0..P).filter(|k| gauge.is_held(*k)) {
            start[k] = at[k];
        }
        solver = least_squares::solve(&model, start);
    }
    let found = terms.parameters(base, solver.theta());
    let fields = of_known_length(outer, &known, &found.vector_n, held_of_field(&terms, &gauge));
    let not_found = fields.as_ref().err().map(|share| Heading::None(*share));
    // Held again where the field has its length: K and sources are then those of the field that is known.
    let with = |Directed { field, heading }| {
        let model = UnifiedModel { base: UnifiedParameters { vector_n: field, ..*base }, ..model };
        let start = terms.theta(&UnifiedParameters { vector_n: field, ..found });
        let solver = least_squares::solve(&model, start);
        Solved { model, solver, gauge, heading }
    };
    let fields = fields
        .unwrap_or_default()
        .into_iter()
        .filter(|directed| directed.field.iter().all(|x| x.is_finite()));
    let solutions = fields.map(with).map(|solved| (sources(&solved.parameters()), solved));
    match solutions.min_by(|(one, _), (other, _)| one.total_cmp(other)) {
        Some((_, solved)) => solved,
        None => Solved { model, solver, gauge, heading: not_found },
    }
}

/// How much hard iron a solution has on the gimbals, µT: of those that fit alike, the one with least of it is taken.
fn sources(parameters: &UnifiedParameters<f64>) -> f64 {
    parameters.outer_source.norm().hypot(parameters.middle_source.norm())
}

/// The base of a model, its field turned about the vertical as a fit of gain and bias alone wants it, where the field is estimated: far
/// from its direction, a fit with sources runs off along what the poses do not determine, or ends at a mirrored sensor.
fn headed<const P: usize, G: Pose<f64>>(free: &UnifiedModel<'_, f64, P, G>) -> UnifiedParameters<f64> {
    let entries = free.terms.entries();
    if !entries.contains(&14) {
        return free.base;
    }
    let held = (0..P).filter(|k| (14..23).contains(&entries[*k])).fold(0, |held, k| held | bit(k));
    let fitted = |field| {
        let base = UnifiedParameters { vector_n: field, ..free.base };
        let model = UnifiedModel { base, held, ..*free };
        let solver = least_squares::solve(&model, free.terms.theta(&base));
        (solver.report().cost, base)
    };
    let fits = heading::starts(free.base.vector_n).map(fitted);
    fits.min_by(|(one, _), (other, _)| one.total_cmp(other)).map_or(free.base, |(_, base)| base)
}

/// What the known field can be in the base's frame, and the heading that this takes, where it was looked for.
struct Directed {
    field: Vector3<f64>,
    heading: Option<Heading>,
}

/// How many components of the field are held.
fn held_of_field<const P: usize>(terms: &Terms<P>, gauge: &Gauge<f64, P>) -> usize {
    (0..P).filter(|k| gauge.is_held(*k) && (14..17).contains(&terms.entries()[*k])).count()
}

/// What the known field can be, where what was `found` of it allows; nothing where nothing of it is held. As an error, how many times as
/// large it would have to be for a heading to explain what was found.
///
/// Its length is determined by K alone, so that one entry is held; with a source on the outer gimbal, its component along
/// the outer axis as well. The entries that are held are not these, and in a base that points elsewhere they are off,
/// K and the sources with them: by 8e-4 for half a degree at a declination of 5°. So the field keeps its length, and
/// where its direction is determined only in part, that part by a heading of the base.
fn of_known_length(
    outer: Option<Vector3<f64>>,
    known: &Vector3<f64>,
    found: &Vector3<f64>,
    held: usize,
) -> Result<Vec<Directed>, f64> {
    match (held, outer) {
        (1, _) => Ok(vec![Directed { field: found * (known.norm() / found.norm()), heading: None }]),
        (2, Some(outer)) => headings(known, &outer, found).map(|turns| {
            let directed =
                |turn| Directed { field: heading::turned(known, turn), heading: Some(Heading::Found(turn)) };
            turns.into_iter().map(directed).collect()
        }),
        _ => Ok(Vec::new()),
    }
}

impl<const P: usize, G: Pose<f64>> Solved<'_, P, G> {
    /// The parameters where it ended.
    fn parameters(&self) -> UnifiedParameters<f64> {
        self.model.terms.parameters(&self.model.base, self.solver.theta())
    }

    /// The fit's figures, without those that need more than the solver.
    pub fn report(&self) -> FitReport {
        let held = (0..P).filter(|k| self.gauge.is_held(*k)).count();
        FitReport { parameters: P - held, ..FitReport::of(&self.solver, self.model.poses.len(), 3) }
    }

    /// The fit, with these standard errors (zero where held) and these figures.
    pub fn fit(&self, mut covariance: DMatrix<f64>, report: FitReport) -> RigFit {
        let Self { model, gauge, heading, .. } = self;
        let entries = model.terms.entries();
        let held: Vec<usize> = (0..P).filter(|k| gauge.is_held(*k)).collect();
        for k in &held {
            covariance.column_mut(*k).fill(0.0);
            covariance.row_mut(*k).fill(0.0);
        }
        let like = |k: &usize| (entries[*k], gauge.like[*k].map(|like| entries[usize::from(like)]));
        RigFit {
            parameters: self.parameters(),
            entries: entries.to_vec(),
            held: held.iter().map(like).collect(),
            heading: *heading,
            report,
            covariance,
        }
    }
}

fn summarise<const P: usize>(poses: &Poses, solved: &Solved<'_, P, GimbalPose<f64>>) -> RigFit {
    let Solved { model, solver, gauge, .. } = solved;
    let held: Vec<usize> = (0..P).filter(|k| gauge.is_held(*k)).collect();
    let rows = Rows::of(model, solver.theta());
    let covariance =
        covariance(poses, &rows, &held).unwrap_or_else(|| dynamic(&least_squares::covariance(solver)));
    let held_out_rms = held_out(model, &rows, solver.theta());
    solved.fit(covariance, FitReport { held_out_rms, ..solved.report() })
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
    let propagated = noise.propagated(&poses.spans, &influence);
    let mut covariance = DMatrix::zeros(P, P);
    for (i, row) in free.iter().enumerate() {
        for (j, column) in free.iter().enumerate() {
            covariance[(*row, *column)] = propagated[(i, j)];
        }
    }
    covariance.iter().all(|x| x.is_finite()).then_some(covariance)
}

/// Rms residual of an axis of poses left out in turn, all three axes of one at a time.
fn held_out<const P: usize>(
    model: &UnifiedModel<'_, f64, P>,
    rows: &Rows<P>,
    theta: &SVector<f64, P>,
) -> Option<f64> {
    let count = model.poses.len();
    let sum = by_steps(rows, theta, (count, 3), |k, theta| {
        let alone = UnifiedModel { poses: &model.poses[k..=k], held: 0, ..*model };
        Residuals::of(&alone, theta).iter().map(|r| r * r).sum()
    });
    Some(root_mean(sum?, 3 * count))
}

impl RigFit {
    /// The fit as a rung of a comparison.
    pub fn step(&self, name: &'static str, adds: &'static str) -> Step {
        self.report.step(name, adds, &self.entries)
    }

    /// Entries that were estimated and not held.
    pub fn free_entries(&self) -> Vec<u8> {
        let held = |entry: &u8| self.held.iter().any(|(held, _)| held == entry);
        self.entries.iter().copied().filter(|entry| !held(entry)).collect()
    }

    /// How many these are.
    pub fn free(&self) -> usize {
        self.report.parameters
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
