//! Covariance of a fit to poses whose noise drifts: neighbouring poses err alike.
//!
//! ```text
//! V = I + λ D,   D_ij = ⅓ Σ_τ exp(−|i − j| / τ)      each axis on its own, i and j poses in time order
//! cov(θ) = σ² A V Aᵀ,   A = (JᵀJ)⁻¹ Jᵀ
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | λ | variance of the drift over that of the white noise |
//! | τ | a decade apart, from a few poses to all of a recording: a spectrum that falls as 1/f |
//!
//! The estimates stay those of least squares. λ is weighed by its restricted likelihood (Patterson & Thompson 1971),
//! in which the fit's parameters have been integrated out: a bias takes the slow part of a drift with it, and its
//! residuals alone would show too little of it. A mean over λ, since a single recording tells it badly. Not modelled:
//! time between poses that differs, an error of the encoders that many poses share.

use nalgebra::{Cholesky, DMatrix, DVector, SMatrix};

use super::rows::Rows;

/// Correlation lengths of the drift, poses.
const LENGTHS: [f64; 3] = [2.0, 20.0, 200.0];
/// Ratios of drift to white noise that are weighed, each three times the one before, after none at all.
const RATIOS: [f64; 8] = [0.0, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0];
/// More poses than this are rests of a long recording, whose drift would take long to weigh.
const MOST: usize = 400;

/// Covariance of the parameters; zero where `held`. `rows` hold three residuals a pose in the first `count`, in time
/// order. `None` where the rows do not determine the parameters, leave nothing, or are too many.
pub fn covariance<const P: usize>(
    rows: &Rows<P>,
    count: usize,
    held: &[usize],
) -> Option<SMatrix<f64, P, P>> {
    let free: Vec<usize> = (0..P).filter(|k| !held.contains(k)).collect();
    if count > 3 * MOST || count <= free.len() {
        return None;
    }
    let residuals = DVector::from_fn(count, |k, _| rows.residuals[k]);
    // Columns at unit length: parameters of different units would spoil the inverse.
    let scale: Vec<f64> = free
        .iter()
        .map(|k| rows.jacobian[..count].iter().map(|j| j[*k].powi(2)).sum::<f64>().sqrt())
        .collect();
    let jacobian = DMatrix::from_fn(count, free.len(), |row, k| rows.jacobian[row][free[k]] / scale[k]);
    let inverse = (jacobian.transpose() * &jacobian).try_inverse()?;
    let influence = &jacobian * inverse;
    let weighed: Vec<Weighed> =
        RATIOS.iter().filter_map(|ratio| weigh(&residuals, &jacobian, &influence, *ratio)).collect();
    let most = weighed.iter().map(|w| w.log_likelihood).fold(f64::NEG_INFINITY, f64::max);
    let mut total = DMatrix::zeros(free.len(), free.len());
    let mut sum = 0.0;
    for each in &weighed {
        let weight = (each.log_likelihood - most).exp();
        total += &each.covariance * weight;
        sum += weight;
    }
    if !(most.is_finite() && total.iter().all(|x| x.is_finite())) {
        return None;
    }
    let mut covariance = SMatrix::zeros();
    for (i, row) in free.iter().enumerate() {
        for (j, column) in free.iter().enumerate() {
            covariance[(*row, *column)] = total[(i, j)] / (sum * scale[i] * scale[j]);
        }
    }
    Some(covariance)
}

/// What one ratio comes to.
struct Weighed {
    log_likelihood: f64,
    covariance: DMatrix<f64>,
}

fn weigh(
    residuals: &DVector<f64>,
    jacobian: &DMatrix<f64>,
    influence: &DMatrix<f64>,
    ratio: f64,
) -> Option<Weighed> {
    let (count, free) = jacobian.shape();
    let poses = count / 3;
    let noise = DMatrix::from_fn(poses, poses, |i, j| {
        let apart = i.abs_diff(j) as f64;
        let drift = LENGTHS.iter().map(|length| (-apart / length).exp()).sum::<f64>() / LENGTHS.len() as f64;
        f64::from(u8::from(i == j)) + ratio * drift
    });
    let lower = Cholesky::new(noise)?.l();
    let log_det = 3.0 * 2.0 * lower.diagonal().iter().map(|d| d.ln()).sum::<f64>();
    let white = whitened(jacobian, &lower)?;
    let data = whitened(&DMatrix::from_column_slice(count, 1, residuals.as_slice()), &lower)?;
    let qr = white.qr();
    let log_det_fit = 2.0 * qr.r().diagonal().iter().map(|d| d.abs().ln()).sum::<f64>();
    let explained = qr.q().tr_mul(&data).norm_squared();
    let freedom = (count - free) as f64;
    let left = (data.norm_squared() - explained).max(f64::MIN_POSITIVE);
    let coloured = coloured(influence, &lower);
    Some(Weighed {
        log_likelihood: -0.5 * (log_det + log_det_fit + freedom * left.ln()),
        covariance: coloured.tr_mul(&coloured) * (left / freedom),
    })
}

/// L⁻¹ of each axis's rows.
fn whitened(rows: &DMatrix<f64>, lower: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let mut white = rows.clone();
    for axis in 0..3 {
        let own = rows.rows_with_step(axis, lower.nrows(), 2).into_owned();
        white.rows_with_step_mut(axis, lower.nrows(), 2).copy_from(&lower.solve_lower_triangular(&own)?);
    }
    Some(white)
}

/// Lᵀ of each axis's rows.
fn coloured(rows: &DMatrix<f64>, lower: &DMatrix<f64>) -> DMatrix<f64> {
    let mut coloured = rows.clone();
    for axis in 0..3 {
        let own = rows.rows_with_step(axis, lower.nrows(), 2).into_owned();
        coloured.rows_with_step_mut(axis, lower.nrows(), 2).copy_from(&lower.tr_mul(&own));
    }
    coloured
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::SVector;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    /// Rows of three biases, for residuals from their mean.
    fn biases(drift: f64, seed: u64) -> (Rows<3>, f64) {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let mut state = [(); 3].map(|()| normal() * drift);
        let kept = (-1.0f64 / 20.0).exp();
        let values: Vec<[f64; 3]> = (0..36)
            .map(|_| {
                state = state.map(|s| s * kept + normal() * drift * (1.0 - kept * kept).sqrt());
                state.map(|s| s + normal())
            })
            .collect();
        let mean = |axis: usize| values.iter().map(|v| v[axis]).sum::<f64>() / 36.0;
        let mut rows = Rows { residuals: Vec::new(), jacobian: Vec::new() };
        for value in &values {
            for (axis, value) in value.iter().enumerate() {
                rows.residuals.push(mean(axis) - value);
                rows.jacobian.push(SVector::ith(axis, 1.0));
            }
        }
        (rows, mean(0))
    }

    #[test]
    fn white_residuals_have_the_variance_of_a_mean_and_drifting_ones_that_of_the_drift() {
        for (drift, low, high) in [(0.0, 0.9, 2.2), (2.0, 0.75, 1.35)] {
            let (mut square, mut expected) = (0.0, 0.0);
            for seed in 0..200 {
                let (rows, mean) = biases(drift, seed);
                square += mean * mean;
                expected += covariance(&rows, 108, &[]).unwrap().m11;
            }
            // 200 squares know a variance to 10 %; drift of another spectrum than assumed costs some more. That there is
            // none at all, 36 poses cannot tell: a mean's error is then said to be up to twice as large as it is.
            let ratio = (expected / square).sqrt();
            assert!((low..high).contains(&ratio), "{drift}: {ratio}");
        }
    }

    #[test]
    fn a_held_parameter_has_no_variance_and_too_few_rows_have_none_at_all() {
        let (rows, _) = biases(0.0, 1);
        let covariance_of = covariance(&rows, 108, &[1]).unwrap();
        assert_eq!(covariance_of.column(1).norm(), 0.0);
        assert!(covariance_of.m11 > 0.0);
        assert!(covariance(&rows, 3, &[]).is_none());
    }
}
