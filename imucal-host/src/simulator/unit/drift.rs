//! Drift of a bias, of one of several kinds.

use nalgebra::Vector3;

use crate::simulator::random::Random;

/// How a drift moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DriftKind {
    /// A sum of first-order Gauss–Markov processes a decade apart, whose spectrum falls as 1/f between them.
    #[default]
    Flicker,
    /// One Gauss–Markov process that forgets within half a minute.
    Quick,
    /// One Gauss–Markov process that forgets within minutes.
    Slow,
    /// A random walk from zero, which reaches the drift's standard deviation within five minutes.
    Walk,
}

/// Time in which a random walk goes as far as the drift's standard deviation, s.
const WALK: f64 = 300.0;

impl DriftKind {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Flicker, Self::Quick, Self::Slow, Self::Walk];

    /// Its name in labels.
    pub fn name(self) -> &'static str {
        match self {
            Self::Flicker => "flicker",
            Self::Quick => "quick",
            Self::Slow => "slow",
            Self::Walk => "walk",
        }
    }

    /// Correlation times of its Gauss–Markov processes, s.
    fn times(self) -> &'static [f64] {
        match self {
            Self::Flicker => &[10.0, 100.0, 1000.0],
            Self::Quick => &[25.0],
            Self::Slow => &[200.0],
            Self::Walk => &[],
        }
    }
}

/// Drift of the three biases of a triad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    /// Standard deviation of the sum, SI unit.
    pub sigma: f64,
    /// How it moves.
    pub kind: DriftKind,
}

impl Drift {
    /// One course of it, at rows `interval` s apart, of these numbers; all but a walk are stationary from the beginning.
    pub(in crate::simulator) fn course(&self, interval: f64, mut random: Random) -> DriftCourse {
        if self.kind == DriftKind::Walk {
            let fresh = self.sigma * libm::sqrt(interval / WALK);
            return DriftCourse {
                processes: vec![Process { state: Vector3::zeros(), kept: 1.0, fresh }],
                random,
            };
        }
        let times = self.kind.times();
        let each = self.sigma / libm::sqrt(times.len() as f64);
        let mut process = |time: &f64| {
            let kept = libm::exp(-interval / time);
            Process { state: random.normals() * each, kept, fresh: each * libm::sqrt(1.0 - kept * kept) }
        };
        DriftCourse { processes: times.iter().map(&mut process).collect(), random }
    }

    /// How many normal numbers a course of so many rows draws.
    pub(in crate::simulator) fn numbers(&self, rows: usize) -> usize {
        match self.kind.times().len() {
            0 => 3 * rows,
            processes => 3 * processes * (1 + rows),
        }
    }

    /// Covariance of one axis between two times of the run, s.
    pub fn covariance(&self, one: f64, other: f64) -> f64 {
        let variance = self.sigma * self.sigma;
        if self.kind == DriftKind::Walk {
            return variance * one.min(other) / WALK;
        }
        let times = self.kind.times();
        let lag = (one - other).abs();
        variance / times.len() as f64 * times.iter().map(|time| libm::exp(-lag / time)).sum::<f64>()
    }
}

/// A course of the drift, row by row, without end.
#[derive(Clone, Debug)]
pub(in crate::simulator) struct DriftCourse {
    processes: Vec<Process>,
    random: Random,
}

/// A Gauss–Markov process, or a walk.
#[derive(Clone, Copy, Debug)]
struct Process {
    state: Vector3<f64>,
    /// Share of the state that the next row keeps.
    kept: f64,
    /// Standard deviation of what is added in a row.
    fresh: f64,
}

impl Iterator for DriftCourse {
    type Item = Vector3<f64>;

    fn next(&mut self) -> Option<Self::Item> {
        let here = self.processes.iter().fold(Vector3::zeros(), |sum, process| sum + process.state);
        for Process { state, kept, fresh } in &mut self.processes {
            *state = *state * *kept + self.random.normals() * *fresh;
        }
        Some(here)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::random::Purpose;

    #[test]
    fn the_drift_has_its_standard_deviation_and_is_slow() {
        let drift = Drift { sigma: 2.0, kind: DriftKind::Flicker };
        let course: Vec<_> = drift.course(1.0, Random::new(3, Purpose::Noise)).take(400_000).collect();
        let rows = course.len() as f64;
        let variance = course.iter().map(|v| v.x * v.x).sum::<f64>() / rows;
        assert!((variance.sqrt() - 2.0).abs() < 0.2, "{variance}");
        let step = course.windows(2).map(|pair| (pair[1].x - pair[0].x).powi(2)).sum::<f64>() / rows;
        // Σ 2 (1 − e^(−1/τ)) σ² / 3
        assert!((step - 0.291).abs() < 0.02, "{step}");
    }

    #[test]
    fn the_covariance_is_that_of_the_courses_drawn() {
        for kind in DriftKind::ALL {
            let drift = Drift { sigma: 1.5, kind };
            let mut random = Random::new(8, Purpose::Noise);
            let mut course = || {
                let course: Vec<_> = drift.course(2.0, random.clone()).take(61).collect();
                random.skip_normals(drift.numbers(61));
                course
            };
            let courses: Vec<_> = (0..3000).map(|_| course()).collect();
            for (one, other) in [(60, 60), (20, 60), (5, 8)] {
                let products = courses.iter().map(|course| course[one].dot(&course[other]) / 3.0);
                let found = products.sum::<f64>() / courses.len() as f64;
                let stated = drift.covariance(2.0 * one as f64, 2.0 * other as f64);
                assert!((found - stated).abs() < 0.1 * 2.25, "{kind:?} {one} {other}: {found} {stated}");
            }
        }
    }
}
