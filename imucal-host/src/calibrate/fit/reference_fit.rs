//! A fit of the unified model to samples along an attitude reference: start, outliers, honest errors, held-out parts.
//!
//! The start is found and not guessed, since neither the sensor's mounting on the body that the reference tracks nor the
//! field in the reference's frame is known. Without errors, each output is
//!
//! ```text
//! m_i = Σ_jl W_(ij)l C_jl + b_i,   W_(ij)l = K_ij e_l,   C = C_p_t
//! ```
//!
//! linear in W and b. W, nine rows of three, has rank one; its leading singular vectors are K and the direction of e.
//! What is determined then: K with the mounting in it, b and the direction of e, but of K's size and the length of e their
//! product alone. K's determinant is taken as positive: a left-handed sensor would show the field reversed.
//!
//! How far the sensor is behind the reference ([`super::lag`]) is one more parameter that K is hardly distinguished from,
//! since a hand turns about one axis more than about others. Standard errors allow for it: what a lag does to each output
//! is taken out of the Jacobian's columns, which leaves the covariance of the others whatever the lag is.

use imucal_core::{
    accept,
    model::{
        rig::{Pose, ReferencePose},
        unified::{Terms, UnifiedModel, UnifiedParameters},
    },
    solver::triangular::Triangular,
};
use nalgebra::{DMatrix, Matrix3, SMatrix, SVector, Vector3};

use super::{
    autocorrelation,
    held_out::{by_folds, root_mean},
    least_squares,
    least_squares::dynamic,
    outlier::{Kept, leaving_out_few},
    report::FitReport,
    rig_fit::{RigFit, Solved, solve},
    rows::{Residuals, Rows},
};

/// Rounds of leaving out gross outliers.
const ROUNDS: usize = 3;
/// Contiguous parts that are held out in turn.
const FOLDS: usize = 5;
/// Coefficients of the start for each axis: nine of W, one of b.
const LINEAR: usize = 10;
/// A singular value below this share of the largest says nothing.
const SINGULAR: f64 = 1e-6;

/// A fit along a reference.
#[derive(Clone, Debug)]
pub struct ReferenceFit {
    /// The fit, with standard errors that allow for residuals alike in time.
    pub fit: RigFit,
    /// Samples used.
    pub kept: Vec<ReferencePose<f64>>,
    /// Their indices.
    pub used: Vec<usize>,
    /// Indices left out, with their size in robust standard deviations.
    pub left_out: Vec<(usize, f64)>,
}

/// Parameters to start from, by the module's equation, the field's length such that K's determinant is one; `None`
/// where the samples do not determine them.
pub fn start(poses: &[ReferencePose<f64>]) -> Option<UnifiedParameters<f64>> {
    let mut normal = SMatrix::<f64, LINEAR, LINEAR>::zeros();
    let mut right = SMatrix::<f64, LINEAR, 3>::zeros();
    for pose in poses {
        let c = pose.rotations(&()).c_p_t;
        let row = SVector::<f64, LINEAR>::from_fn(|k, _| if k < 9 { c[(k / 3, k % 3)] } else { 1.0 });
        normal += row * row.transpose();
        right += row * pose.value.transpose();
    }
    let svd = normal.svd(true, true);
    let linear = svd.solve(&right, SINGULAR * svd.singular_values.max()).ok()?;
    // Rows (i, j), columns l.
    let w = SMatrix::<f64, 9, 3>::from_fn(|row, l| linear[(3 * (row % 3) + l, row / 3)]);
    let svd = w.svd(true, true);
    let (u, v) = (svd.u?, svd.v_t?);
    let leading = svd.singular_values.imax();
    let by_rows = u.column(leading) * svd.singular_values[leading];
    let sensitivity = Matrix3::from_fn(|i, j| by_rows[3 * i + j]);
    // Negative where both are reversed.
    let size = sensitivity.determinant().cbrt();
    let mut parameters = UnifiedParameters::nominal(v.row(leading).transpose() * size);
    parameters.sensitivity = sensitivity / size;
    parameters.bias = linear.row(9).transpose();
    let finite = size != 0.0 && parameters.to_vector().iter().all(|x| x.is_finite());
    finite.then_some(parameters)
}

/// Samples with their attitudes, and how these turn with the lag.
#[derive(Clone, Debug)]
pub struct Tracked {
    /// The samples.
    pub poses: Vec<ReferencePose<f64>>,
    /// Change of `C_p_t` with the lag, 1/s; empty where no lag was found.
    pub by_lag: Vec<Matrix3<f64>>,
}

/// Fits `terms` from `base`, leaving out gross outliers; where that would be more than
/// [`MOST`](super::outlier::MOST), none is.
pub fn fit<const P: usize>(
    tracked: &Tracked,
    base: &UnifiedParameters<f64>,
    terms: Terms<P>,
) -> ReferenceFit {
    let found = leaving_out_few(tracked.poses.len(), ROUNDS, |used, _| {
        let poses: Vec<_> = used.iter().map(|k| tracked.poses[*k]).collect();
        let Solved { model, solver, gauge, .. } = solve(&poses, (), base, terms, None);
        let distances = distances(&model, solver.theta());
        ((model.base, model.held, solver, gauge), distances)
    });
    let Kept { fit: (base, held, solver, gauge), used, left_out } = found;
    let kept: Vec<_> = used.iter().map(|k| tracked.poses[*k]).collect();
    let by_lag: Vec<_> = used.iter().filter_map(|k| tracked.by_lag.get(*k).copied()).collect();
    let model = UnifiedModel { poses: &kept, axes: (), base, terms, held };
    let fit = summarise(&Solved { model, solver, gauge, heading: None }, &by_lag);
    ReferenceFit { fit, kept, used, left_out }
}

/// Rms residual of an axis at the plain fit.
pub fn rms<const P: usize>(
    poses: &[ReferencePose<f64>],
    base: &UnifiedParameters<f64>,
    terms: Terms<P>,
) -> f64 {
    least_squares::rms(&solve(poses, (), base, terms, None).solver)
}

/// Distance of each output from what it ought to be.
fn distances<const P: usize>(
    model: &UnifiedModel<'_, f64, P, ReferencePose<f64>>,
    theta: &SVector<f64, P>,
) -> Vec<f64> {
    let residuals = Residuals::of(model, theta);
    let of_poses = &residuals[..3 * model.poses.len()];
    of_poses.chunks_exact(3).map(|r| Vector3::from_column_slice(r).norm()).collect()
}

fn summarise<const P: usize>(solved: &Solved<'_, P, ReferencePose<f64>>, by_lag: &[Matrix3<f64>]) -> RigFit {
    let Solved { model, solver, .. } = solved;
    let mut rows = Rows::of(model, solver.theta());
    let now = model.terms.parameters(&model.base, solver.theta());
    let lagging = by_lag.iter().flat_map(|by| {
        let moved = now.sensitivity * (by * now.vector_n);
        [moved.x, moved.y, moved.z]
    });
    take_out(&mut rows, &lagging.collect::<Vec<_>>());
    let mut factor = Triangular::default();
    rows.residuals.iter().zip(&rows.jacobian).for_each(|(r, j)| factor.push(*r, j));
    let unscaled = factor.covariance(1.0).zip(solver.variance());
    let (inflation, covariance) = match unscaled {
        Some((unscaled, variance)) => {
            let inflation = autocorrelation::inflation(&rows, &unscaled, 3);
            let scale = SMatrix::from_diagonal(&inflation);
            (inflation, dynamic(&(scale * unscaled * scale * variance)))
        }
        None => (SVector::repeat(1.0), DMatrix::repeat(P, P, f64::INFINITY)),
    };
    let inflation = inflation.max();
    let nonlinearity = accept::nonlinearity(solver, model, inflation);
    let held_out_rms = held_out(solved);
    solved.fit(covariance, FitReport { held_out_rms, nonlinearity, inflation, ..solved.report() })
}

/// Takes out of each column of the Jacobian what is like `direction`; rows beyond its end have none of it.
fn take_out<const P: usize>(rows: &mut Rows<P>, direction: &[f64]) {
    let length: f64 = direction.iter().map(|x| x * x).sum();
    if length <= 0.0 {
        return;
    }
    let like: SVector<f64, P> = rows.jacobian.iter().zip(direction).map(|(row, x)| row * *x).sum();
    for (row, x) in rows.jacobian.iter_mut().zip(direction) {
        *row -= like * (x / length);
    }
}

/// Rms residual of an axis in contiguous parts left out in turn, each time fitted again; `None` where one does not
/// converge.
fn held_out<const P: usize>(solved: &Solved<'_, P, ReferencePose<f64>>) -> Option<f64> {
    let (model, poses) = (&solved.model, solved.model.poses);
    let base = model.terms.parameters(&model.base, solved.solver.theta());
    let sum = by_folds(poses.len(), FOLDS, |part| {
        let others = [&poses[..part.start], &poses[part.end..]].concat();
        let again = solve(&others, (), &base, model.terms, None);
        let alone = UnifiedModel { poses: &poses[part], held: 0, ..again.model };
        let converged = again.solver.report().termination.was_successful();
        let residuals = Residuals::of(&alone, again.solver.theta());
        converged.then(|| residuals.iter().map(|r| r * r).sum())
    });
    Some(root_mean(sum?, 3 * poses.len()))
}
