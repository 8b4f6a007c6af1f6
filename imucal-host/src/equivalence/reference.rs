//! The reference: plain `f64` arrays, numerical derivatives, per-sample integration; nothing of the core's models.
//!
//! It is written from models.md, not from the core: a mistake shared by both would have to be made twice.

use std::ops::Range;

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::{
    observe::{motion::MotionData, turn::BiasPath},
    store::{StoredNonlinearity, StoredTriad},
};

/// Rounds of Gauss–Newton at the most.
const ROUNDS: usize = 60;
/// Halvings of a step that does not lower the cost.
const HALVINGS: usize = 30;

/// `gain · (raw − bias)`, written out.
pub fn correct(gain: &[[f64; 3]; 3], bias: &[f64; 3], raw: [f64; 3]) -> [f64; 3] {
    let d = [raw[0] - bias[0], raw[1] - bias[1], raw[2] - bias[2]];
    [0, 1, 2].map(|i| gain[i][0] * d[0] + gain[i][1] * d[1] + gain[i][2] * d[2])
}

/// The same at a temperature, `(1 + s Δ + s₂ Δ²) ∘ gain · x` with `x + n(x) = raw − bias − β Δ − β₂ Δ²`; Δ is zero where
/// there is no reading, and n where the calibration has no nonlinear terms.
pub fn correct_at(figures: &StoredTriad, raw: [f64; 3], temperature: f64) -> [f64; 3] {
    let terms = figures.temperature.filter(|_| temperature.is_finite());
    let change = terms.map_or(0.0, |terms| temperature - terms.reference);
    let drifted = |at: f64, first: [f64; 3], second: [f64; 3], axis: usize| {
        at + first[axis] * change + second[axis] * change * change
    };
    let none = [0.0; 3];
    let (beta, scale) = terms.map_or((none, none), |terms| (terms.bias_slope, terms.scale_slope));
    let curvature = terms.and_then(|terms| terms.curvature);
    let (beta_2, scale_2) = curvature.map_or((none, none), |second| (second.bias, second.scale));
    let output = [0, 1, 2].map(|axis| raw[axis] - drifted(figures.bias[axis], beta, beta_2, axis));
    let sensed = figures.nonlinearity.map_or(output, |terms| sensed(&terms, output));
    let value = correct(&figures.gain, &none, sensed);
    [0, 1, 2].map(|axis| value[axis] * drifted(1.0, scale, scale_2, axis))
}

/// Rounds that solve `x + n(x) = output` for terms of a tenth's slope: each takes a digit off.
const INVERSE_ROUNDS: usize = 20;

/// x of `x + n(x) = output`, by as many rounds as `f64` can show.
fn sensed(terms: &StoredNonlinearity, output: [f64; 3]) -> [f64; 3] {
    let mut x = output;
    for _ in 0..INVERSE_ROUNDS {
        let [u, v, w] = x.map(|axis| axis.clamp(-terms.range, terms.range));
        let own = [u, v, w];
        x = [0, 1, 2].map(|axis| {
            let [p, q, r] = terms.cross[axis];
            let bent = (terms.quadratic[axis] + terms.cubic[axis] * own[axis]) * own[axis] * own[axis];
            output[axis] - bent - (p * u * v + q * v * w + r * w * u)
        });
    }
    x
}

/// Distance of `m` outside the shell |A(m − b)| = norm, to first order, less `excess`.
/// `theta`: upper triangular A by rows (6) or its diagonal (3), then b.
fn shell_distance(theta: &[f64], m: [f64; 3], norm: f64, excess: f64) -> f64 {
    let (a, b) = split_upper(theta);
    let y = correct(&a, &b, m);
    let length = (y[0] * y[0] + y[1] * y[1] + y[2] * y[2]).sqrt();
    let u = y.map(|v| v / length);
    let pulled = [0, 1, 2].map(|j| a[0][j] * u[0] + a[1][j] * u[1] + a[2][j] * u[2]);
    let slope = (pulled[0] * pulled[0] + pulled[1] * pulled[1] + pulled[2] * pulled[2]).sqrt();
    (length - norm) / slope - excess
}

fn split_upper(theta: &[f64]) -> ([[f64; 3]; 3], [f64; 3]) {
    match *theta {
        [a, d, f, x, y, z] => ([[a, 0.0, 0.0], [0.0, d, 0.0], [0.0, 0.0, f]], [x, y, z]),
        [a, b, c, d, e, f, x, y, z] => ([[a, b, c], [0.0, d, e], [0.0, 0.0, f]], [x, y, z]),
        _ => ([[f64::NAN; 3]; 3], [f64::NAN; 3]),
    }
}

/// Fits the shell through points; `diagonal` for six parameters instead of nine. Returns them as in `theta` above.
pub fn fit_shell(points: &[([f64; 3], f64)], norm: f64, diagonal: bool, start: &[f64]) -> Option<Vec<f64>> {
    debug_assert_eq!(start.len(), if diagonal { 6 } else { 9 });
    gauss_newton(start, |theta| {
        points.iter().map(|(m, excess)| shell_distance(theta, *m, norm, *excess)).collect()
    })
}

/// One turn for the reference: the samples themselves.
#[derive(Clone, Debug)]
pub struct SampledTurn {
    /// Rows integrated.
    pub rows: Range<usize>,
    /// Bias along the way.
    pub bias: BiasPath,
    /// Direction before, calibrated axes.
    pub before: Vector3<f64>,
    /// Direction after.
    pub after: Vector3<f64>,
    /// What rates less the bias are multiplied by, to be those of the reference temperature.
    pub stretch: Matrix3<f64>,
}

/// Carries a direction through a turn sample by sample under a full gain by rows.
fn carry(theta: &[f64], turn: &SampledTurn, time: &[f64], gyr: &[Vector3<f64>]) -> Vector3<f64> {
    let gain: [[f64; 3]; 3] = [0, 1, 2].map(|i| [theta[3 * i], theta[3 * i + 1], theta[3 * i + 2]]);
    let mut attitude = UnitQuaternion::identity();
    let measured: Vec<usize> = turn.rows.clone().filter(|k| gyr[*k].iter().all(|w| w.is_finite())).collect();
    for (index, k) in measured.iter().copied().enumerate() {
        let since = if index > 0 { time[k] - time[measured[index - 1]] } else { 0.0 };
        let until = measured.get(index + 1).map_or(0.0, |next| time[*next] - time[k]);
        let rate = turn.stretch * (gyr[k] - turn.bias.at(time[k]));
        let rate = correct(&gain, &[0.0; 3], rate.into());
        attitude *= UnitQuaternion::from_scaled_axis(Vector3::from(rate) * (0.5 * (since + until)));
    }
    attitude.inverse_transform_vector(&turn.before)
}

/// Fits a full gyroscope gain (by rows) to turns.
pub fn fit_turns(
    turns: &[SampledTurn],
    time: &[f64],
    gyr: &[Vector3<f64>],
    start: &[f64],
) -> Option<Vec<f64>> {
    gauss_newton(start, |theta| {
        turns
            .iter()
            .flat_map(|turn| {
                let r = carry(theta, turn, time, gyr) - turn.after;
                [r.x, r.y, r.z]
            })
            .collect()
    })
}

/// Fits a gyroscope's gain by rows, bias and, where `start` has 21 entries, g-sensitivity to motions between known
/// attitudes, sample by sample; residuals are weighted.
pub fn fit_motions(motions: &[MotionData], weights: &[f64], start: &[f64]) -> Option<Vec<f64>> {
    gauss_newton(start, |theta| {
        let by_rows = |from: usize| Matrix3::from_row_slice(&theta[from..from + 9]);
        let (gain, bias) = (by_rows(0), Vector3::new(theta[9], theta[10], theta[11]));
        let sensitivity = if theta.len() > 12 { by_rows(12) } else { Matrix3::zeros() };
        let errors = motions.iter().zip(weights).flat_map(|(motion, weight)| {
            let [before, after] = motion.ends().map(UnitQuaternion::from_quaternion);
            let carried = motion.samples.iter().fold(before, |attitude, sample| {
                let (earth, force) = motion.surroundings(sample.block);
                let rate = gain * (sample.rate - bias - sensitivity * force) - earth;
                attitude * UnitQuaternion::from_scaled_axis(rate * sample.held)
            });
            let r = (after.inverse() * carried).scaled_axis() * *weight;
            [r.x, r.y, r.z]
        });
        errors.collect()
    })
}

/// A pose with its rotations.
#[derive(Clone, Debug)]
pub struct KnownPose {
    /// Output, nominal SI.
    pub output: [f64; 3],
    /// From base, outer and middle gimbal to the table.
    pub c_p_t: Matrix3<f64>,
    /// See `c_p_t`.
    pub c_o_t: Matrix3<f64>,
    /// See `c_p_t`.
    pub c_m_t: Matrix3<f64>,
}

/// Fits the `free` ones of the unified model's 32 entries, the others as in `start`; returns the free ones.
pub fn fit_poses(poses: &[KnownPose], start: &[f64; 32], free: &[u8]) -> Option<Vec<f64>> {
    let from: Vec<f64> = free.iter().map(|entry| start[usize::from(*entry)]).collect();
    gauss_newton(&from, |theta| {
        let mut p = *start;
        free.iter().zip(theta).for_each(|(entry, value)| p[usize::from(*entry)] = *value);
        poses.iter().flat_map(|pose| unified(&p, pose)).collect()
    })
}

/// Output of the unified model less the measured one: models.md 1 with tilt, sources, and terms of higher order.
fn unified(p: &[f64; 32], pose: &KnownPose) -> [f64; 3] {
    let three = |from: usize| Vector3::new(p[from], p[from + 1], p[from + 2]);
    // From n to p, so that gravity is (g sin β, −g cos β sin α, −g cos β cos α).
    let tilt = Rotation3::from_axis_angle(&Vector3::x_axis(), -p[12])
        * Rotation3::from_axis_angle(&Vector3::y_axis(), -p[13]);
    let sensed = pose.c_p_t * (tilt * three(14)) + pose.c_o_t * three(17) + pose.c_m_t * three(20);
    let y = Matrix3::from_row_slice(&p[..9]) * sensed;
    let product = [y.y * y.z, y.z * y.x, y.x * y.y];
    [0, 1, 2].map(|k| {
        y[k] + p[23 + k] * y[k].powi(2) + p[26 + k] * y[k].powi(3) + p[29 + k] * product[k] + p[9 + k]
            - pose.output[k]
    })
}

/// Gauss–Newton with central differences and an SVD; `None` where it does not settle.
fn gauss_newton(start: &[f64], residuals: impl Fn(&[f64]) -> Vec<f64> + Sync) -> Option<Vec<f64>> {
    let mut theta = start.to_vec();
    let mut here = DVector::from_vec(residuals(&theta));
    for _ in 0..ROUNDS {
        let jacobian = differences(&theta, &residuals, here.len());
        let scale: Vec<f64> = jacobian.column_iter().map(|c| c.norm().max(f64::MIN_POSITIVE)).collect();
        let mut scaled = jacobian;
        for (mut column, s) in scaled.column_iter_mut().zip(&scale) {
            column /= *s;
        }
        let step = scaled.svd(true, true).solve(&-&here, 1e-14).ok()?;
        let mut share = 1.0;
        let mut moved = None;
        for _ in 0..HALVINGS {
            let trial: Vec<f64> =
                theta.iter().zip(step.iter().zip(&scale)).map(|(t, (d, s))| t + share * d / s).collect();
            let there = DVector::from_vec(residuals(&trial));
            if there.norm_squared() <= here.norm_squared() {
                moved = Some((trial, there));
                break;
            }
            share *= 0.5;
        }
        let Some((trial, there)) = moved else {
            return Some(theta);
        };
        let settled = step.norm() <= 1e-10 * here.norm().max(f64::MIN_POSITIVE)
            || there.norm_squared() >= here.norm_squared() * (1.0 - 1e-15);
        (theta, here) = (trial, there);
        if settled {
            return Some(theta);
        }
    }
    None
}

fn differences(theta: &[f64], residuals: &(impl Fn(&[f64]) -> Vec<f64> + Sync), rows: usize) -> DMatrix<f64> {
    use rayon::prelude::*;
    let columns: Vec<DVector<f64>> = (0..theta.len())
        .into_par_iter()
        .map(|k| {
            let step = 6e-6 * (1.0 + theta[k].abs());
            let at = |value: f64| {
                let mut moved = theta.to_vec();
                moved[k] = value;
                DVector::from_vec(residuals(&moved))
            };
            (at(theta[k] + step) - at(theta[k] - step)) / (2.0 * step)
        })
        .collect();
    if columns.is_empty() { DMatrix::zeros(rows, 0) } else { DMatrix::from_columns(&columns) }
}
