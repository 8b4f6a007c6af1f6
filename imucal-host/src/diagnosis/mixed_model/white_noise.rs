//! White noise of each axis, from neighbouring tenths of a second, at rest and in motion apart.

use nalgebra::Vector3;

use super::noise::{Noise, SensorNoise, USUAL, Weighing};
use crate::{
    diagnosis::residual::block::{Block, Means},
    noise::white,
    recording::{
        SensorKind,
        order_statistics::{MEDIAN_SQUARE, median, variance_without_largest_tenth},
    },
    simulator::replay::readings_noise,
};

/// Pieces of which neighbours are compared, s.
const PIECE: f64 = 0.1;
/// Noise that is so many times that of a sample is not the sensor's.
pub const MISFIT: f64 = 10.0;

impl Noise {
    /// With white noise that is no more than another's: a misfit that a fit has gone through is no noise.
    #[must_use]
    pub fn at_most(mut self, other: &Self) -> Self {
        for (own, other) in self.sensors.iter_mut().zip(&other.sensors) {
            for axis in 0..3 {
                own.white[axis] = own.white[axis].min(other.white[axis]);
                own.moving[axis] = own.moving[axis].min(other.moving[axis]);
            }
        }
        self
    }
}

impl Weighing<'_> {
    /// Noise from what samples do within a tenth of a second, and a first guess of the drift.
    pub fn white(&self, residual: &Means) -> Noise {
        let scatter = 100.0 * self.least_scatter();
        let sensors = SensorKind::ALL.map(|kind| {
            let still = self.still(kind, residual);
            let moving = self.moving(kind, residual, &still);
            // Without a rest nothing is known of it, and nothing is asked.
            let white = if still.iter().all(|sigma| *sigma > f64::MIN_POSITIVE) { still } else { moving };
            let typical = white.iter().fold(0.0f64, |a, b| a.max(*b));
            let drift = [0.05 * typical, 0.1 * typical];
            SensorNoise { white, moving, drift, slow: USUAL, scatter, breadth: 0.0 }
        });
        Noise { sensors }
    }

    /// Whether a sensor's white noise is far more than that of its samples, so that a part of the gap is in it. Along a stream alone:
    /// a hand's tremor is noise of the movement.
    pub fn holds_misfit(&self, noise: &Noise, kind: SensorKind) -> bool {
        let sensor = self.scene.recording.sensor(kind).filter(|_| self.scene.settings.source.followed);
        let sample = sensor.map_or(0.0, |triple| readings_noise(&triple.values));
        sample > 0.0 && noise.largest(kind) > MISFIT * sample
    }

    /// A noise whose drift begins again, from what the samples do, where it is many times all that a fit leaves: it was estimated
    /// without the effects of that fit, and a descent of a few steps would not leave it.
    pub fn drift_begun_again(&self, mut noise: Noise, residual: &Means) -> Noise {
        let white = self.white(residual);
        for kind in SensorKind::ALL {
            let Some(left) = &residual[kind as usize] else { continue };
            let square = left.iter().map(Vector3::norm_squared).sum::<f64>() / (3 * left.len().max(1)) as f64;
            let sensor = &mut noise.sensors[kind as usize];
            if sensor.drift.iter().any(|drift| *drift > MISFIT * square.sqrt()) {
                let begun = white.sensors[kind as usize];
                (sensor.drift, sensor.slow, sensor.breadth) = (begun.drift, begun.slow, begun.breadth);
            }
        }
        noise
    }

    /// At rest: what the samples do, and on no rig what the residual does as well, since a reference trembles with the hand.
    fn still(&self, kind: SensorKind, residual: &Means) -> [f64; 3] {
        let mut white = self.resting(kind);
        let Some(values) = residual[kind as usize].as_ref() else { return white };
        for length in self.scene.settings.noise.sway {
            let bends = self.bends(kind, values, *length, |first, other| {
                first.rest.is_some() && first.rest == other.rest
            });
            for (white, bends) in white.iter_mut().zip(bends) {
                *white = white.max(variance_without_largest_tenth(bends).sqrt());
            }
        }
        white
    }

    /// From the differences of neighbouring pieces of a rest.
    fn resting(&self, kind: SensorKind) -> [f64; 3] {
        let Some(triple) = self.scene.recording.sensor(kind) else { return [1.0; 3] };
        let interval = self.scene.recording.median_interval().unwrap_or(PIECE);
        let length = ((PIECE / interval).round() as usize).max(1);
        let usable = &self.scene.usable[kind as usize];
        let rests = self.scene.blocks.iter().filter(|block| block.rest.is_some());
        let variances = white::at_rest(&triple.values, usable, rests.map(|block| block.rows.clone()), length);
        variances.map(|variance| variance.sqrt().max(f64::MIN_POSITIVE))
    }

    /// From second differences of the residuals of neighbouring moving blocks; at least as at rest. What a hand adds is
    /// no white noise: where no rig guides the sensor, groups of blocks count as well, and that which scatters most.
    fn moving(&self, kind: SensorKind, residual: &Means, resting: &[f64; 3]) -> [f64; 3] {
        let Some(values) = &residual[kind as usize] else { return [1.0; 3] };
        let sway = self.scene.settings.noise.sway;
        let in_motion = |_: &Block, other: &Block| other.rest.is_none();
        let bends = |length: usize| self.bends(kind, values, length, in_motion);
        let most: Vec<[f64; 3]> = match sway {
            [] => vec![bends(1).map(|b| median(b).unwrap_or(0.0) / MEDIAN_SQUARE)],
            _ => sway.iter().map(|length| bends(*length).map(variance_without_largest_tenth)).collect(),
        };
        std::array::from_fn(|axis| {
            let square = most.iter().map(|squares| squares[axis]).fold(0.0, f64::max);
            square.sqrt().max(resting[axis])
        })
    }

    /// Squared second differences of neighbouring groups of blocks, as variances of one sample; `alike` says whether a
    /// block belongs to groups that begin with another.
    fn bends(
        &self,
        kind: SensorKind,
        values: &[Vector3<f64>],
        length: usize,
        alike: impl Fn(&Block, &Block) -> bool,
    ) -> [Vec<f64>; 3] {
        let counts = &self.scene.counts[kind as usize];
        let whole_blocks = self.scene.settings.noise.whole_blocks;
        let mut squares: [Vec<f64>; 3] = Default::default();
        for from in (0..(values.len() + 1).saturating_sub(3 * length)).step_by(length) {
            // On a rig a block with fewer rows is one that it has just left or reached.
            let full = |k: usize| {
                if whole_blocks { counts[k] == counts[from] } else { 2 * counts[k] > counts[from] }
            };
            let blocks = &self.scene.blocks;
            let whole = |k: usize| alike(&blocks[from], &blocks[k]) && counts[k] > 0 && full(k);
            if !(from..from + 3 * length).all(whole) {
                continue;
            }
            let group = |which: usize| {
                let blocks = from + which * length..from + (which + 1) * length;
                blocks.fold((Vector3::zeros(), 0.0), |(sum, count), k| {
                    let n = self.scene.worth(kind, k);
                    (sum + values[k] * n, count + n)
                })
            };
            let bends = white::second_differences([0, 1, 2].map(group));
            squares.iter_mut().zip(bends.iter()).for_each(|(squares, bend)| squares.push(*bend));
        }
        squares
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(white: f64, drift: f64) -> Noise {
        let sensor = SensorNoise {
            white: [white; 3],
            moving: [2.0 * white; 3],
            drift: [drift; 2],
            slow: 120.0,
            scatter: 0.0,
            breadth: 0.0,
        };
        Noise { sensors: [sensor; 3] }
    }

    #[test]
    fn white_noise_is_lowered_by_a_better_fit_and_never_raised() {
        let (old, better, worse) = (noise(1.0, 0.5), noise(0.25, 0.1), noise(4.0, 9.0));
        let found = old.clone().at_most(&better).sensors[0];
        assert_eq!((found.white, found.moving, found.drift), ([0.25; 3], [0.5; 3], [0.5; 2]));
        assert_eq!(old.clone().at_most(&worse), old);
    }
}
