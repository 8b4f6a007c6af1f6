//! What shakes the sensors of a real machine and no simulator has: it grows with speed and thrust.
//!
//! ```text
//! n = e σ (√(1 − s) white + √s ring)      e: effort;  ring: y_k = 2 r cos ω y_(k−1) − r² y_(k−2) + white, of unit size
//! ```

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::trajectory::{RobotKind, Trajectory};
use crate::{recording::SensorKind, simulator::random::Random};

/// How a machine shakes its sensors at its utmost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vibration {
    /// Root mean square of an axis by sensor, m/s², rad/s, µT.
    pub size: [f64; 3],
    /// Share of the power that rings.
    pub ringing: f64,
    /// Of the ring, Hz.
    pub frequency: f64,
    /// Time in which the ring dies down, s.
    pub decay: f64,
}

impl Vibration {
    /// Of a machine of a kind, in multiples of the usual.
    pub fn draw(kind: RobotKind, level: f64, random: &mut Random) -> Self {
        let usual = match kind {
            RobotKind::Legged => [0.15, 0.01, 0.02],
            RobotKind::Wheeled => [0.25, 0.008, 0.02],
            RobotKind::Flying => [0.4, 0.015, 0.05],
        };
        Self {
            size: usual.map(|size| level * size * random.between(0.5, 1.5)),
            ringing: random.between(0.1, 0.8),
            frequency: random.between(20.0, 90.0),
            decay: random.between(0.03, 0.3),
        }
    }

    /// What it adds to one sensor's rows, whose times are of the simulator's clock, s.
    pub fn rows(
        &self,
        kind: SensorKind,
        trajectory: &Trajectory,
        times: &[f64],
        rate: f64,
        random: &mut Random,
    ) -> Vec<Vector3<f64>> {
        // A ring beyond half the rate is seen folded.
        let angle = TAU * self.frequency / rate;
        let kept = libm::exp(-1.0 / (self.decay * rate));
        let square = kept * kept;
        let of_ring = (1.0 + square)
            / ((1.0 - square) * (1.0 - 2.0 * square * libm::cos(2.0 * angle) + square * square));
        let (one, two) = (2.0 * kept * libm::cos(angle), -square);
        let (white, ring) = (libm::sqrt(1.0 - self.ringing), libm::sqrt(self.ringing / of_ring));
        let mut rings = [Vector3::zeros(); 2];
        let row = |time: &f64| {
            let shake = rings[0] * one + rings[1] * two + random.normals();
            rings = [shake, rings[0]];
            let effort = self.size[kind as usize] * trajectory.effort(*time);
            (random.normals() * white + shake * ring) * effort
        };
        times.iter().map(row).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::random::Purpose;

    #[test]
    fn it_grows_with_speed_and_is_not_there_at_rest() {
        for kind in RobotKind::ALL {
            let trajectory = Trajectory::draw(kind, 300.0, &mut Random::new(8, Purpose::Route));
            let mut random = Random::new(8, Purpose::Vibration);
            let vibration = Vibration::draw(kind, 1.0, &mut random);
            let times: Vec<f64> = (0..60_000).map(|k| 5e-3 * f64::from(k)).collect();
            let rows = vibration.rows(SensorKind::Acc, &trajectory, &times, 200.0, &mut random);
            let efforts: Vec<f64> = times.iter().map(|time| trajectory.effort(*time)).collect();
            let rms = |low: f64, high: f64| {
                let of = rows.iter().zip(&efforts).filter(|(_, effort)| (low..high).contains(*effort));
                let squares: Vec<f64> = of.map(|(row, _)| row.norm_squared() / 3.0).collect();
                (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
            };
            assert!(rms(0.0, 1e-12) < 1e-9);
            let most = efforts.iter().copied().fold(0.0, f64::max);
            let (slow, fast) = (rms(1e-3, 0.4 * most), rms(0.8 * most, 2.0));
            assert!(fast > 1.5 * slow && slow > 0.0, "{kind:?} {slow} {fast}");
            assert!((0.6..1.4).contains(&(rms(0.9 * most, 2.0) / (0.95 * most * vibration.size[0]))));
        }
    }
}
