//! What a triad adds by chance: white noise, and drift of its bias.

use nalgebra::Vector3;

use super::{
    random::Random,
    unit::{DriftCourse, TriadUnderTest},
};

/// Noise of a triad, row by row. Each triad has numbers of its own, so that all go on at the same time and in parts.
#[derive(Clone, Debug)]
pub(super) struct TriadNoise {
    white: Random,
    /// Standard deviation of the white noise, SI unit.
    sigma: f64,
    drift: DriftCourse,
}

impl TriadNoise {
    /// The noise of a run of so many rows, `interval` s apart: `random` gives the numbers of all white noise, then those of the drift, and
    /// goes on behind them.
    pub(super) fn of(random: &mut Random, triad: &TriadUnderTest, rows: usize, interval: f64) -> Self {
        let white = random.clone();
        random.skip_normals(3 * rows);
        let drift = triad.drift.course(interval, random.clone());
        random.skip_normals(triad.drift.numbers(rows));
        Self { white, sigma: triad.noise, drift }
    }

    /// White noise of the next rows, SI unit.
    pub(super) fn white(&mut self, rows: usize) -> Vec<Vector3<f64>> {
        (0..rows).map(|_| self.white.normals() * self.sigma).collect()
    }

    /// Drift at the next rows, SI unit.
    pub(super) fn drift(&mut self, rows: usize) -> impl Iterator<Item = Vector3<f64>> {
        self.drift.by_ref().take(rows)
    }
}
