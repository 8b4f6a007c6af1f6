//! Velocity and acceleration of noisy positions: a fixed-interval smoother of a twice integrated random walk.
//!
//! ```text
//! x = (p, v, a)      da = dβ, ⟨dβ²⟩ = q dt      z = p + e, ⟨e²⟩ = σ²      ω⁶ = q / (σ² Δ)
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | p, v, a | position, m; velocity, m/s; acceleration, m/s² |
//! | q | density of the jerk, (m/s³)²·s |
//! | σ, Δ | noise of a reading, m; usual interval, s |
//! | ω | bandwidth, rad/s: what is faster is taken for noise |
//!
//! The estimate depends on ω alone, its error on σ as well, which follows from what the readings leave. A tracker's
//! readings are often smoothed or resampled, so that nothing in them says what is noise: ω is for whoever compares the
//! acceleration with an accelerometer to choose. Source: A. Gelb, Applied Optimal Estimation (1974), ch. 5.2 (Rauch, Tung and
//! Striebel). Not modelled: jumps, and impacts, which are faster than any reading.

use nalgebra::{Matrix3, Vector3};

use crate::recording::order_statistics::std_of_median;

/// Variances before the first reading, in units of a reading's: position, velocity, acceleration.
const BEFORE: [f64; 3] = [1e8, 1e10, 1e12];

/// One axis at each row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoothed {
    /// Position, velocity, acceleration.
    pub state: Vector3<f64>,
    /// Standard deviation of the acceleration, m/s².
    pub error: f64,
}

/// Readings of one axis.
#[derive(Clone, Copy, Debug)]
pub struct Readings<'a> {
    /// Times, s, increasing.
    pub time: &'a [f64],
    /// Positions, m; NaN where there is none.
    pub position: &'a [f64],
    /// Usual interval Δ, s.
    pub interval: f64,
    /// ω, rad/s.
    pub bandwidth: f64,
}

/// What the filter knows at a row: before its reading and after.
#[derive(Clone, Copy)]
struct Step {
    predicted: (Vector3<f64>, Matrix3<f64>),
    filtered: (Vector3<f64>, Matrix3<f64>),
}

impl Readings<'_> {
    /// The axis smoothed.
    pub fn smoothed(&self) -> Vec<Smoothed> {
        let mut smoothed = self.backwards(&self.filtered());
        let left = smoothed.iter().zip(self.position).map(|(row, reading)| (reading - row.state.x).abs());
        let sigma = std_of_median(left.filter(|left| left.is_finite()).collect()).unwrap_or(0.0);
        smoothed.iter_mut().for_each(|row| row.error *= sigma);
        smoothed
    }

    /// The filter forwards; covariances in units of σ².
    fn filtered(&self) -> Vec<Step> {
        let density = libm::pow(self.bandwidth, 6.0) * self.interval;
        let start = self.position.iter().copied().find(|p| p.is_finite()).unwrap_or(0.0);
        let mut state = Vector3::new(start, 0.0, 0.0);
        let mut covariance = Matrix3::from_diagonal(&Vector3::from(BEFORE));
        let mut steps = Vec::with_capacity(self.time.len());
        for row in 0..self.time.len() {
            if let Some(before) = row.checked_sub(1) {
                let dt = self.time[row] - self.time[before];
                let f = transition(dt);
                state = f * state;
                covariance = f * covariance * f.transpose() + jerk(dt, density);
            }
            let predicted = (state, covariance);
            if self.position[row].is_finite() {
                let gain = covariance.column(0) / (covariance[(0, 0)] + 1.0);
                state += gain * (self.position[row] - state.x);
                let kept = Matrix3::identity() - gain * Vector3::x().transpose();
                covariance = kept * covariance * kept.transpose() + gain * gain.transpose();
            }
            steps.push(Step { predicted, filtered: (state, covariance) });
        }
        steps
    }

    /// The smoother backwards.
    fn backwards(&self, steps: &[Step]) -> Vec<Smoothed> {
        let Some(last) = steps.last() else { return Vec::new() };
        let (mut state, mut covariance) = last.filtered;
        let of = |state: Vector3<f64>, covariance: &Matrix3<f64>| Smoothed {
            state,
            error: covariance[(2, 2)].max(0.0).sqrt(),
        };
        let mut smoothed = vec![of(state, &covariance)];
        for row in (0..steps.len() - 1).rev() {
            let f = transition(self.time[row + 1] - self.time[row]);
            let (own, next) = (steps[row].filtered, steps[row + 1].predicted);
            let Some(inverse) = next.1.try_inverse() else {
                smoothed.push(of(own.0, &own.1));
                continue;
            };
            let gain = own.1 * f.transpose() * inverse;
            state = own.0 + gain * (state - next.0);
            covariance = own.1 + gain * (covariance - next.1) * gain.transpose();
            smoothed.push(of(state, &covariance));
        }
        smoothed.reverse();
        smoothed
    }
}

fn transition(dt: f64) -> Matrix3<f64> {
    Matrix3::new(1.0, dt, 0.5 * dt * dt, 0.0, 1.0, dt, 0.0, 0.0, 1.0)
}

/// What the jerk adds to the covariance within dt.
fn jerk(dt: f64, density: f64) -> Matrix3<f64> {
    let (d2, d3) = (dt * dt, dt * dt * dt);
    let (d4, d5) = (d2 * d2, d2 * d3);
    Matrix3::new(d5 / 20.0, d4 / 8.0, d3 / 6.0, d4 / 8.0, d3 / 3.0, d2 / 2.0, d3 / 6.0, d2 / 2.0, dt)
        * density
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::random::{Purpose, Random};

    fn smoothed(position: &[f64], bandwidth: f64) -> Vec<Smoothed> {
        let time: Vec<f64> = (0..position.len()).map(|k| 0.01 * k as f64).collect();
        Readings { time: &time, position, interval: 0.01, bandwidth }.smoothed()
    }

    #[test]
    fn the_acceleration_is_that_of_the_movement_within_its_errors() {
        let noise = 5e-4;
        let mut random = Random::new(3, Purpose::Noise);
        let time: Vec<f64> = (0..4000).map(|k| 0.01 * f64::from(k)).collect();
        let position: Vec<f64> =
            time.iter().map(|t| 0.2 * (3.0 * t).sin().powi(3) + noise * random.normal()).collect();
        let smoothed = smoothed(&position, 40.0);
        let truth = |t: f64| {
            let (s, c) = (3.0 * t).sin_cos();
            0.2 * 9.0 * (6.0 * s * c * c - 3.0 * s * s * s)
        };
        let (mut left, mut stated) = (0.0, 0.0);
        for (row, t) in time.iter().enumerate().take(3900).skip(100) {
            left += (smoothed[row].state.z - truth(*t)).powi(2) / 3800.0;
            stated += smoothed[row].error.powi(2) / 3800.0;
        }
        // A movement that is smoother than the random walk is known better than stated.
        assert!((0.02..1.2).contains(&(left / stated)), "{} stated {}", left.sqrt(), stated.sqrt());
        assert!(left.sqrt() < 0.3, "{}", left.sqrt());
    }

    #[test]
    fn a_wider_bandwidth_follows_more_of_the_movement_and_of_the_noise() {
        let mut random = Random::new(7, Purpose::Noise);
        let noise: Vec<f64> = (0..2000).map(|_| 1e-3 * random.normal()).collect();
        let felt = |bandwidth: f64| {
            let squares = smoothed(&noise, bandwidth).iter().map(|row| row.state.z.powi(2)).sum::<f64>();
            (squares / 2000.0).sqrt()
        };
        assert!(felt(40.0) > 5.0 * felt(15.0));
        let brisk: Vec<f64> = (0..2000).map(|k| 0.01 * (0.3 * f64::from(k)).sin()).collect();
        let most =
            |bandwidth: f64| smoothed(&brisk, bandwidth).iter().map(|row| row.state.z).fold(0.0, f64::max);
        assert!(most(15.0) < 0.5 * 9.0 && (most(200.0) - 9.0).abs() < 0.5, "{} {}", most(15.0), most(200.0));
    }

    #[test]
    fn missing_readings_make_it_less_sure_and_nothing_else() {
        let mut random = Random::new(9, Purpose::Noise);
        let mut position: Vec<f64> =
            (0..1000).map(|k| 0.3 * (0.02 * f64::from(k)).sin() + 1e-3 * random.normal()).collect();
        position[480..500].fill(f64::NAN);
        let smoothed = smoothed(&position, 20.0);
        assert!(smoothed.iter().all(|row| row.state.iter().all(|value| value.is_finite())));
        assert!(smoothed[490].error > smoothed[300].error);
    }
}
