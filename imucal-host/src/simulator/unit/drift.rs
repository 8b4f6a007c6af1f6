//! Drift of a bias: a sum of first-order Gauss–Markov processes a decade apart, whose spectrum falls as 1/f between
//! them.

use nalgebra::Vector3;

use crate::simulator::random::Random;

/// Correlation times of the processes, s.
const TIMES: [f64; 3] = [10.0, 100.0, 1000.0];

/// Drift of the three biases of a triad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    /// Standard deviation of the sum, SI unit.
    pub sigma: f64,
}

impl Drift {
    /// One course of the drift, stationary from the beginning.
    pub fn draw(&self, rows: usize, interval: f64, random: &mut Random) -> Vec<Vector3<f64>> {
        let each = self.sigma / libm::sqrt(TIMES.len() as f64);
        let kept = TIMES.map(|time| libm::exp(-interval / time));
        let fresh = kept.map(|kept| each * libm::sqrt(1.0 - kept * kept));
        let mut states = TIMES.map(|_| random.normals() * each);
        let mut course = Vec::with_capacity(rows);
        for _ in 0..rows {
            course.push(states[0] + states[1] + states[2]);
            for ((state, kept), fresh) in states.iter_mut().zip(kept).zip(fresh) {
                *state = *state * kept + random.normals() * fresh;
            }
        }
        course
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::random::Purpose;

    #[test]
    fn the_drift_has_its_standard_deviation_and_is_slow() {
        let mut random = Random::new(3, Purpose::Noise);
        let course = Drift { sigma: 2.0 }.draw(400_000, 1.0, &mut random);
        let rows = course.len() as f64;
        let variance = course.iter().map(|v| v.x * v.x).sum::<f64>() / rows;
        assert!((variance.sqrt() - 2.0).abs() < 0.2, "{variance}");
        let step = course.windows(2).map(|pair| (pair[1].x - pair[0].x).powi(2)).sum::<f64>() / rows;
        // Σ 2 (1 − e^(−1/τ)) σ² / 3
        assert!((step - 0.291).abs() < 0.02, "{step}");
    }
}
