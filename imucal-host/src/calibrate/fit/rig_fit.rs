//! A fit of the unified model to poses on a rig: gauge, standard errors, held-out residuals.

use imucal_core::{
    model::{
        rig::{GimbalPose, Pose},
        unified::{Terms, UnifiedModel, UnifiedParameters},
    },
    solver::{LevenbergMarquardt, gauge::Gauge},
    triad::Triad,
};
use nalgebra::{DMatrix, DVector, Rotation3, SVector, Vector3};

use super::{
    compare::Step,
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

/// A heading of the base that turns the known field into the measured one, as far as this is determined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Heading {
    /// Of the field about the vertical, rad; the base's is the opposite.
    Found(f64),
    /// None does: across the outer axis the field would have to be so many times as large.
    None(f64),
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
    let free = UnifiedModel { poses, axes, base: *base, terms, held: 0 };
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
    let (field, heading) = of_known_length(outer, base, &found, &terms, &gauge);
    let Some(field) = field.filter(|field| field.iter().all(|x| x.is_finite())) else {
        return Solved { model, solver, gauge, heading };
    };
    // Held again where the field has its length: K and sources are then those of the field that is known.
    let model = UnifiedModel { base: UnifiedParameters { vector_n: field, ..*base }, ..model };
    let start = terms.theta(&UnifiedParameters { vector_n: field, ..found });
    let solver = least_squares::solve(&model, start);
    Solved { model, solver, gauge, heading }
}

/// The field that is known, where what was found of it allows, and the heading that was looked for; `None` where nothing of it is held.
///
/// Its length is determined by K alone, so that one entry is held; with a source on the outer gimbal, its component along
/// the outer axis as well. The entries that are held are not these, and in a base that points elsewhere they are off,
/// K and the sources with them: by 8e-4 for half a degree at a declination of 5°. So the field keeps its length, and
/// where its direction is determined only in part, that part by a heading of the base.
fn of_known_length<const P: usize>(
    outer: Option<Vector3<f64>>,
    base: &UnifiedParameters<f64>,
    found: &UnifiedParameters<f64>,
    terms: &Terms<P>,
    gauge: &Gauge<f64, P>,
) -> (Option<Vector3<f64>>, Option<Heading>) {
    let of_field = |k: &usize| gauge.is_held(*k) && (14..17).contains(&terms.entries()[*k]);
    let (known, now) = (base.vector_n, found.vector_n);
    match ((0..P).filter(of_field).count(), outer) {
        (1, _) => (Some(now * (known.norm() / now.norm())), None),
        (2, Some(outer)) => {
            let heading = heading(&known, &outer.cross(&now));
            let turned = match heading {
                Heading::Found(angle) => Some(Rotation3::from_axis_angle(&Vector3::z_axis(), angle) * known),
                Heading::None(_) => None,
            };
            (turned, Some(heading))
        }
        _ => (None, None),
    }
}

/// The smaller of the two turns about the vertical that bring `known` across `normal`:
///
/// ```text
/// n · R_z(ψ) m = a cos ψ + b sin ψ + n_z m_z = 0,   a = n_x m_x + n_y m_y,   b = n_y m_x − n_x m_y
/// ```
///
/// The other one has the field's part along the outer axis reversed, which a source on the outer gimbal hides.
fn heading(known: &Vector3<f64>, normal: &Vector3<f64>) -> Heading {
    let a = normal.xy().dot(&known.xy());
    let b = normal.y * known.x - normal.x * known.y;
    let share = -normal.z * known.z / a.hypot(b);
    if share.is_nan() || share.abs() > 1.0 {
        return Heading::None(share.abs());
    }
    let (middle, half) = (b.atan2(a), share.acos());
    let wrapped = |angle: f64| angle.sin().atan2(angle.cos());
    let [one, other] = [middle - half, middle + half].map(wrapped);
    Heading::Found(if one.abs() < other.abs() { one } else { other })
}

impl<const P: usize, G: Pose<f64>> Solved<'_, P, G> {
    /// The fit's figures, without those that need more than the solver.
    pub fn report(&self) -> FitReport {
        let held = (0..P).filter(|k| self.gauge.is_held(*k)).count();
        FitReport { parameters: P - held, ..FitReport::of(&self.solver, self.model.poses.len(), 3) }
    }

    /// The fit, with these standard errors (zero where held) and these figures.
    pub fn fit(&self, mut covariance: DMatrix<f64>, report: FitReport) -> RigFit {
        let Self { model, solver, gauge, heading } = self;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_heading_of_a_base_is_found_by_what_its_outer_axis_does_not_hide() {
        let known = Vector3::new(25.0, 2.0, 40.0);
        for degrees in [-60.0f64, -29.0, 0.0, 0.3, 28.0, 45.0, 70.0] {
            let turned = Rotation3::from_axis_angle(&Vector3::z_axis(), degrees.to_radians()) * known;
            for hidden in [-30.0, 0.0, 12.0] {
                let measured = turned + Vector3::x() * hidden;
                let found = heading(&known, &Vector3::x().cross(&measured));
                assert!(
                    matches!(found, Heading::Found(angle) if (angle.to_degrees() - degrees).abs() < 1e-9),
                    "{degrees} {found:?}"
                );
            }
        }
        // 25 µT cannot have a part of 50 µT across the axis.
        let found = heading(&known, &Vector3::x().cross(&Vector3::new(0.0, 50.0, 40.0)));
        assert!(matches!(found, Heading::None(share) if (share - 2.0).abs() < 0.01), "{found:?}");
    }
}
