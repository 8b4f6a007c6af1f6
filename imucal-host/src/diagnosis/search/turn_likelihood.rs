//! Whether the residuals of gyroscope and magnetometer are one turn of the sensor, or a fault of either.
//!
//! ```text
//! turn of the sensor    r_w = u + e_w     θ' = u − w × θ     r_b = b × θ + c + e_b    u ~ N(0, s)
//! fault of gyroscope    r_w = u + e_w                        r_b = c + e_b
//! fault of magnetometer r_w = e_w                            r_b = c(t) + e_b         c' ~ N(0, d)
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | r_w, r_b | residuals of rate, rad/s, and field, µT, with noise e_w and e_b |
//! | u, θ | rate and turn that the simulator lacks, rad/s and rad |
//! | w, b | rate and field of the simulator |
//! | c | what the field's residual is anyhow, µT |
//! | s, d | powers, of which the likeliest are taken |
//!
//! The likelihood is that of a Kalman filter over blocks with the states θ and c. Not modelled: noise that is alike from one
//! block to the next. Source: Harvey, Forecasting, Structural Time Series Models and the Kalman Filter (1989), section 3.4.

use nalgebra::{Matrix3, Matrix6, SMatrix, Vector3, Vector6};

/// Standard deviations of u, in those of a block's noise.
const RATES: [f64; 7] = [0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 64.0];
/// Standard deviations that c gains in a second, in those of a block's noise.
const WANDERS: [f64; 6] = [0.0, 0.3, 1.0, 3.0, 10.0, 40.0];
/// Standard deviation of c before anything was seen, µT.
const UNKNOWN: f64 = 100.0;

/// What a block shows.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Its time, s.
    pub time: f64,
    /// r_w, rad/s.
    pub rate: Vector3<f64>,
    /// r_b, µT.
    pub field: Vector3<f64>,
    /// Variances of their noise by axis, infinite where nothing was measured.
    pub variances: [f64; 2],
    /// w, rad/s.
    pub w: Vector3<f64>,
    /// b, µT.
    pub b: Vector3<f64>,
}

/// ln of the odds of a turn of the sensor against the likelier of the two faults.
pub fn log_odds(seen: &[Seen]) -> f64 {
    let likeliest = |of: &dyn Fn(f64) -> f64, among: &[f64]| {
        among.iter().map(|size| of(*size)).fold(f64::NEG_INFINITY, f64::max)
    };
    let rates = |size: f64| seen.iter().map(|block| block.log_density_of_rate(size)).sum::<f64>();
    let turn = likeliest(&|size| rates(size) + fields(seen, Some(size), 0.0), &RATES);
    let gyroscope = likeliest(&rates, &RATES) + fields(seen, None, 0.0);
    let magnetometer = rates(0.0) + likeliest(&|wander| fields(seen, None, wander), &WANDERS);
    turn - gyroscope.max(magnetometer)
}

impl Seen {
    /// ln of the density of the rate's residual, where u is of so many standard deviations of its noise.
    fn log_density_of_rate(&self, size: f64) -> f64 {
        let variance = self.variances[0] * (1.0 + size * size);
        if !variance.is_finite() {
            return 0.0;
        }
        -0.5 * (self.rate.norm_squared() / variance + 3.0 * variance.ln())
    }
}

/// ln of the density of the field's residuals given the rates': with a turn by u of so many standard deviations or none,
/// and with c that wanders.
fn fields(seen: &[Seen], turns: Option<f64>, wander: f64) -> f64 {
    let mut state = Vector6::zeros();
    let mut covariance = Matrix6::zeros();
    covariance.fixed_view_mut::<3, 3>(3, 3).copy_from(&(Matrix3::identity() * (UNKNOWN * UNKNOWN)));
    let Some(mut last) = seen.first().map(|block| block.time) else { return 0.0 };
    let mut sum = 0.0;
    for block in seen {
        let step = block.time - last;
        last = block.time;
        if let Some(size) = turns {
            turn(&mut state, &mut covariance, block, size, step);
        }
        let [_, variance] = block.variances;
        if !variance.is_finite() {
            continue;
        }
        for axis in 3..6 {
            covariance[(axis, axis)] += wander * wander * variance * step;
        }
        let mut shown = SMatrix::<f64, 3, 6>::zeros();
        if turns.is_some() {
            shown.fixed_view_mut::<3, 3>(0, 0).copy_from(&block.b.cross_matrix());
        }
        shown.fixed_view_mut::<3, 3>(0, 3).copy_from(&Matrix3::identity());
        let across = covariance * shown.transpose();
        let Some(factor) = (shown * across + Matrix3::identity() * variance).cholesky() else {
            return f64::NEG_INFINITY;
        };
        let innovation = block.field - shown * state;
        let solved = factor.solve(&innovation);
        sum -= 0.5 * (innovation.dot(&solved) + factor.ln_determinant());
        state += across * solved;
        covariance -= across * factor.solve(&across.transpose());
    }
    sum
}

/// The states a step later: the turn goes on by what the gyroscope shows of u.
fn turn(state: &mut Vector6<f64>, covariance: &mut Matrix6<f64>, block: &Seen, size: f64, step: f64) {
    let share = if block.variances[0].is_finite() { size * size / (1.0 + size * size) } else { 0.0 };
    let mut moved = Matrix6::identity();
    moved.fixed_view_mut::<3, 3>(0, 0).copy_from(&(Matrix3::identity() - block.w.cross_matrix() * step));
    *state = moved * *state;
    *covariance = moved * *covariance * moved.transpose();
    if share > 0.0 {
        let shown = block.rate * (share * step);
        for axis in 0..3 {
            state[axis] += shown[axis];
            covariance[(axis, axis)] += share * block.variances[0] * step * step;
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    const NOISE: [f64; 2] = [4e-3, 0.05];

    /// A hundred blocks of a tenth of a second; the rate's and the field's residuals apart from noise by time.
    fn seen(
        rate: impl Fn(f64) -> Vector3<f64>,
        field: impl Fn(f64, &Vector3<f64>) -> Vector3<f64>,
    ) -> Vec<Seen> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut noise =
            |sigma: f64| Vector3::from_fn(|_, _| -> f64 { StandardNormal.sample(&mut rng) }) * sigma;
        let of = |at: i32| {
            let time = 0.1 * f64::from(at);
            let b = Vector3::new(20.0 * (0.3 * time).cos(), 20.0 * (0.3 * time).sin(), 40.0);
            Seen {
                time,
                rate: rate(time) + noise(NOISE[0]),
                field: field(time, &b) + Vector3::new(0.3, -0.2, 0.1) + noise(NOISE[1]),
                variances: NOISE.map(|sigma| sigma * sigma),
                w: Vector3::zeros(),
                b,
            }
        };
        (0..100).map(of).collect()
    }

    /// A turn that comes and goes within 3 to 7 s, rad, and its rate, rad/s.
    fn turned(time: f64) -> (Vector3<f64>, Vector3<f64>) {
        let phase = ((time - 3.0) / 4.0).clamp(0.0, 1.0) * std::f64::consts::TAU;
        let size = Vector3::new(5e-3, -8e-3, 2e-2);
        (size * (1.0 - phase.cos()) * 0.5, size * (phase.sin() * std::f64::consts::TAU / 8.0))
    }

    #[test]
    fn a_turn_that_both_show_is_no_fault_of_either() {
        let both = seen(|time| turned(time).1, |time, b| b.cross(&turned(time).0));
        let (gyroscope, magnetometer) = (
            seen(|time| turned(time).1, |_, _| Vector3::zeros()),
            seen(|_| Vector3::zeros(), |time, b| b.cross(&turned(time).0)),
        );
        assert!(log_odds(&both) > 15.0, "{}", log_odds(&both));
        assert!(log_odds(&gyroscope) < 0.0 && log_odds(&magnetometer) < 0.0);
    }

    #[test]
    fn noise_alone_is_no_turn() {
        let odds = log_odds(&seen(|_| Vector3::zeros(), |_, _| Vector3::zeros()));
        assert!(odds < 0.0, "{odds}");
    }
}
