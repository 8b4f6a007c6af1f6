//! A magnetometer brought into the accelerometer's axes: the rotation that makes the dip the same in every rest.

use imucal_core::{
    model::{
        alignment,
        dip::{DipModel, DirectionPair, LARGEST_ERROR, LEAST_POSES, RELABELLINGS, is_lower, relabelling},
    },
    rotation::cross_matrix,
    solver::{LevenbergMarquardt, lm::Settings},
    triad::Triad,
};
use nalgebra::{DMatrix, DVector, Matrix3, SMatrix, SVector, Vector3};
use rayon::prelude::*;

use super::{
    directions::{Directions, Move},
    held_out::{by_steps, root_mean},
    rows::{Residuals, Rows, influence},
};
use crate::noise::interval::{Parts, Scale};

/// Noise of the field at rest against that of the directions, in multiples of what rests show of both.
const RATIOS: [(f64, f64); 4] = [(1.0, 0.5), (4.0, 0.2), (16.0, 0.2), (64.0, 0.1)];

/// Where the magnetometer's axes lie against the accelerometer's.
#[derive(Clone, Debug)]
pub struct Alignment {
    /// Rotation from the magnetometer's axes to the accelerometer's, with the covariance of the directions' own errors.
    pub axes: alignment::Alignment<f64>,
    /// Rotation vector of it, rad.
    pub phi: Vector3<f64>,
    /// Dip of the field, rad, positive down, and its standard error.
    pub dip: (f64, f64),
    /// Rms of the dip over the rests, rad.
    pub rms: f64,
    /// The same for rests left out in turn.
    pub held_out_rms: Option<f64>,
    /// Directions at each rest used.
    pub pairs: Vec<DirectionPair<f64>>,
    /// Index of each rest.
    pub rests: Vec<usize>,
}

/// A magnetometer at rest.
#[derive(Clone, Copy, Debug)]
pub struct FieldAtRest {
    /// Index of the rest.
    pub rest: usize,
    /// Mean output, nominal SI.
    pub mean: Vector3<f64>,
    /// Variance of the mean that its own samples explain, per axis.
    pub variance: Vector3<f64>,
}

/// Finds the rotation from what was seen at rests, with errors that follow from those of both sensors' means and of the
/// accelerometer's calibration; `triad` is the magnetometer's. `None` where the rests cannot determine it.
pub fn align_at_rests(
    directions: &Directions,
    at_rest: &[FieldAtRest],
    triad: &Triad<f64>,
) -> Option<Alignment> {
    let pairs: Vec<_> =
        at_rest.iter().map(|seen| (directions.calibrated(seen.rest), triad.correct(&seen.mean))).collect();
    let rests: Vec<usize> = at_rest.iter().map(|seen| seen.rest).collect();
    if pairs.len() < LEAST_POSES || pairs.iter().any(|(f, b)| !(f + b).iter().all(|x| x.is_finite())) {
        return None;
    }
    let errors = |model: &DipModel<'_, f64>, theta: &SVector<f64, 4>| {
        let rotation = imucal_core::rotation::exp(&theta.xyz());
        let moves: Vec<Move> = (at_rest.iter().zip(model.pairs).enumerate())
            .map(|(row, (seen, pair))| Move { row, rest: seen.rest, by: rotation * pair.u_b })
            .collect();
        let mut followed = directions.rows(at_rest.len(), &moves);
        for (row, ((seen, pair), (_, field))) in
            followed.iter_mut().zip(at_rest.iter().zip(model.pairs).zip(&pairs))
        {
            let along = rotation.tr_mul(&pair.u_f);
            let across = (along - pair.u_b * pair.u_b.dot(&along)) / field.norm();
            row.own = triad.gain.tr_mul(&across).map(|x| x * x).dot(&seen.variance);
        }
        let parts = directions.noise_of(followed, DMatrix::zeros(0, 0));
        let parts = Parts { parts: &parts, ratios: &RATIOS, scale: Scale::AtLeastOne, five: false };
        let rows = Rows::of(model, theta);
        let jacobian = rows.derivatives(at_rest.len(), &[0, 1, 2, 3]);
        let residuals = DVector::from_column_slice(&rows.residuals);
        let errors = parts.errors(&residuals, &jacobian, &influence(&jacobian)?)?;
        Some(SMatrix::from_fn(|i, j| errors.covariance[(i, j)]))
    };
    align_with(&pairs, rests, &errors)
}

/// Finds the rotation from calibrated pairs (specific force, field) alone, each as good as the next; `None` where the
/// rests cannot determine it.
pub fn align(pairs: &[(Vector3<f64>, Vector3<f64>)]) -> Option<Alignment> {
    align_with(pairs, (0..pairs.len()).collect(), &|_, _| None)
}

/// Covariance of a fit's four parameters; `None` for that of residuals that are independent and alike.
type Covariance<'a> = &'a dyn Fn(&DipModel<'_, f64>, &SVector<f64, 4>) -> Option<SMatrix<f64, 4, 4>>;

fn align_with(
    pairs: &[(Vector3<f64>, Vector3<f64>)],
    rests: Vec<usize>,
    errors: Covariance<'_>,
) -> Option<Alignment> {
    let field = pairs.iter().map(|(_, b)| b.norm()).sum::<f64>() / pairs.len() as f64;
    let pairs: Vec<DirectionPair<f64>> =
        pairs.iter().map(|(f, b)| DirectionPair { u_f: f.normalize(), u_b: b.normalize() }).collect();
    let finite = |pair: &DirectionPair<f64>| pair.u_f.iter().chain(pair.u_b.iter()).all(|x| x.is_finite());
    if pairs.len() < LEAST_POSES || !pairs.iter().all(finite) {
        return None;
    }
    let model = DipModel { pairs: &pairs };
    let solver = best(&model);
    let covariance = errors(&model, solver.theta()).or_else(|| solver.covariance())?;
    let inverse = solver.factor().covariance(1.0)?;
    let axes = alignment::Alignment::new(pairs.iter().copied(), field, solver.theta(), &covariance, &inverse);
    let error = axes.error();
    if !solver.report().termination.was_successful() || error.is_nan() || error > LARGEST_ERROR {
        return None;
    }
    let cos = solver.theta().w.clamp(-1.0, 1.0);
    // An error of the cosine is one of the angle, by the sine between gravity and field.
    let per_angle = (1.0 - cos * cos).sqrt().max(1e-3);
    let held_out_rms = held_out(&model, solver.theta()).map(|rms| rms / per_angle);
    Some(Alignment {
        axes,
        phi: solver.theta().xyz(),
        dip: ((-cos).asin(), covariance[(3, 3)].sqrt() / per_angle),
        rms: solver.variance()?.sqrt() / per_angle,
        held_out_rms,
        pairs,
        rests,
    })
}

/// The best of fits from the 24 ways in which axes can be relabelled without a mirror: a magnetometer may lie any way
/// round on its board.
fn best(model: &DipModel<'_, f64>) -> LevenbergMarquardt<f64, 4> {
    let fit = |start: SVector<f64, 4>| {
        let mut solver = LevenbergMarquardt::new(start, Settings::default());
        solver.run(model);
        solver
    };
    let start = |way: &([i8; 3], i8)| {
        let phi = relabelling::<f64>(*way);
        SVector::<f64, 4>::new(phi.x, phi.y, phi.z, 0.0)
    };
    let [own, others @ ..] = &RELABELLINGS;
    let (own, others) =
        rayon::join(|| fit(start(own)), || others.par_iter().map(|way| fit(start(way))).collect::<Vec<_>>());
    others.into_iter().fold(own, |chosen, other| {
        if is_lower(other.report().cost, chosen.report().cost) { other } else { chosen }
    })
}

fn held_out(model: &DipModel<'_, f64>, theta: &SVector<f64, 4>) -> Option<f64> {
    let count = model.pairs.len();
    let sum = by_steps(&Rows::of(model, theta), theta, (count, 1), |k, theta| {
        let alone = DipModel { pairs: &model.pairs[k..=k] };
        Residuals::of(&alone, theta).iter().map(|r| r * r).sum()
    });
    Some(root_mean(sum?, count))
}

impl Alignment {
    /// Parameters of the fit: φ and the cosine of the angle between both.
    pub fn theta(&self) -> SVector<f64, 4> {
        SVector::<f64, 4>::new(self.phi.x, self.phi.y, self.phi.z, -self.dip.0.sin())
    }

    /// The triad in the accelerometer's axes, and the covariance of its twelve entries (gain by rows, bias).
    /// `covariance` is that of the entries `of` before.
    pub fn turn(
        &self,
        triad: &Triad<f64>,
        covariance: &DMatrix<f64>,
        of: &[u8],
    ) -> (Triad<f64>, SMatrix<f64, 12, 12>) {
        let turned = self.axes.turned(triad);
        let entries = |triad: &Triad<f64>| {
            let by_rows = triad.gain.transpose();
            SVector::<f64, 12>::from_iterator(by_rows.iter().chain(triad.bias.iter()).copied())
        };
        let mut by_rotation = SMatrix::<f64, 12, 3>::zeros();
        for axis in 0..3 {
            let gain = cross_matrix(&Vector3::ith(axis, 1.0)) * turned.gain;
            by_rotation.set_column(axis, &entries(&Triad { gain, bias: Vector3::zeros() }));
        }
        let inverse = triad.gain.try_inverse().unwrap_or_else(Matrix3::zeros);
        let mut by_entries = DMatrix::zeros(12, of.len());
        for (column, entry) in of.iter().enumerate() {
            let mut change = Triad { gain: Matrix3::zeros(), bias: Vector3::zeros() };
            match usize::from(*entry) {
                k @ 0..9 => change.gain[(k / 3, k % 3)] = 1.0,
                k => change.bias[k - 9] = 1.0,
            }
            by_entries.set_column(column, &entries(&self.axes.followed(triad, &inverse, &change)));
        }
        let own = &by_entries * covariance * by_entries.transpose();
        let by_axes = by_rotation * self.axes.covariance * by_rotation.transpose();
        let total = SMatrix::<f64, 12, 12>::from_fn(|i, j| own[(i, j)] + by_axes[(i, j)]);
        (turned, total)
    }
}

#[cfg(test)]
mod tests {
    use imucal_core::rotation::exp;

    use super::*;

    #[test]
    fn a_magnetometer_mounted_upside_down_is_found_so() {
        let mounted =
            Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0)) * exp(&Vector3::new(0.02, -0.03, 0.01));
        let pairs: Vec<_> = (0..20)
            .map(|k| {
                let k = f64::from(k);
                let c_n_s =
                    exp(&Vector3::new(2.0 * (1.3 * k).sin(), 2.5 * (2.1 * k).cos(), 1.5 * (0.7 * k).sin()));
                let noise = Vector3::new((7.0 * k).sin(), (11.0 * k).sin(), (13.0 * k).sin()) * 1e-3;
                (
                    c_n_s * Vector3::new(0.0, 0.0, -9.8),
                    mounted.transpose() * (c_n_s * Vector3::new(25.0, 2.0, 40.0)) + noise,
                )
            })
            .collect();
        let alignment = align(&pairs).unwrap();
        assert!((alignment.axes.rotation - mounted).norm() < 1e-3, "{}", alignment.axes.rotation);
        assert!((alignment.dip.0 - (40.0f64 / 25.0f64.hypot(2.0)).atan()).abs() < 1e-3);
    }
}
