//! The noise of each channel: white, drifting, and what a rest has in common.
//!
//! White noise comes from neighbouring tenths of a second, at rest and in motion apart. Drifts and the scatter of rests
//! come from the restricted likelihood of the blocks' residuals (Patterson and Thompson 1971), so that what the model
//! has taken up is not missed in the noise:
//!
//! ```text
//! −2 ln L = ln|Σ| + ln|XᵀΣ⁻¹X + Λ| − ln|Λ| + rᵀΣ⁻¹r − zᵀ(XᵀΣ⁻¹X + Λ)⁻¹z      z = XᵀΣ⁻¹r
//! ```
//!
//! Each sensor has its own; the axes of a sensor share drift and scatter. Not modelled: noise that axes have in common,
//! white noise that changes in the course of the recording.

use nalgebra::{DMatrix, Vector3};
use rayon::prelude::*;

use super::{
    block::Block,
    design::{Channel, Design, Gathered, Normal},
    scene::{Means, Scene},
    whitening::{Process, Shared, Whitening},
};
use crate::recording::SensorKind;

/// Correlation time of the fast drift, s.
const FAST: f64 = 8.0;
/// Correlation times that the slow drift may have, s: a walk forgets nothing while it is recorded.
const SLOW: [f64; 2] = [120.0, 1200.0];
/// Factors of a search that begins anywhere.
pub const FAR: [f64; 2] = [4.0, 1.7];
/// Factors of a search that begins near its end.
pub const NEAR: [f64; 1] = [2.0];
/// Rounds over all standard deviations for each factor.
const ROUNDS: usize = 4;
/// Lengths of groups of moving blocks that are compared where no rig guides the sensor; what is slower is drift.
const SWAY: [usize; 6] = [1, 2, 4, 8, 16, 32];
/// Share of drift and scatter that [`Noise::quieter`] leaves.
const QUIET: f64 = 0.2;
/// Pieces of which neighbours are compared, s.
const PIECE: f64 = 0.1;

/// Noise of one sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorNoise {
    /// White noise of a sample at rest, by axis; unit of the sensor.
    pub white: [f64; 3],
    /// White noise of a sample in motion, by axis.
    pub moving: [f64; 3],
    /// Standard deviations of the fast and the slow drift.
    pub drift: [f64; 2],
    /// Correlation time of the slow drift, s.
    pub slow: f64,
    /// Angle by which a rest stands off its encoders, rad.
    pub scatter: f64,
}

/// Noise of a recording, by [`SensorKind::ALL`].
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// Of each sensor.
    pub sensors: [SensorNoise; 3],
}

impl Noise {
    /// With smaller drifts and scatter: what an unmodelled effect has put into them comes to light.
    #[must_use]
    pub fn quieter(&self) -> Self {
        let mut quiet = self.clone();
        for sensor in &mut quiet.sensors {
            sensor.drift = sensor.drift.map(|sigma| QUIET * sigma);
            sensor.scatter *= QUIET;
        }
        quiet
    }

    /// As noisy at rest as in motion: a quiet rest does not outweigh all else before an instant is known to a block.
    #[must_use]
    pub fn even(mut self) -> Self {
        for sensor in &mut self.sensors {
            for axis in 0..3 {
                sensor.white[axis] = sensor.white[axis].max(sensor.moving[axis]);
            }
        }
        self
    }

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

/// What weighs the blocks: the scene, and what each sensor is given there.
pub struct Weighing<'s> {
    scene: &'s Scene<'s>,
    times: Vec<f64>,
    /// Mean output of each block, by sensor: scatter turns it.
    pub given: [Vec<Vector3<f64>>; 3],
}

impl<'s> Weighing<'s> {
    /// With the outputs of the simulator, block by block.
    pub fn new(scene: &'s Scene<'s>, given: [Vec<Vector3<f64>>; 3]) -> Self {
        Self { scene, times: scene.blocks.iter().map(|block| block.time).collect(), given }
    }

    /// Noise from what samples do within a tenth of a second, and drift yet to be told.
    pub fn white(&self, residual: &Means) -> Noise {
        let scatter = 100.0 * self.least_scatter();
        let sensors = SensorKind::ALL.map(|kind| {
            let white = self.still(kind, residual);
            let moving = self.moving(kind, residual, &white);
            let typical = white.iter().fold(0.0f64, |a, b| a.max(*b));
            SensorNoise { white, moving, drift: [0.05 * typical, 0.1 * typical], slow: SLOW[0], scatter }
        });
        Noise { sensors }
    }

    /// The smallest scatter that is looked for, rad: a rig repeats its rests; a hand does not, nor is the field of a
    /// room the same all over it.
    fn least_scatter(&self) -> f64 {
        if self.scene.swings.is_some() { 1e-7 } else { 1e-5 }
    }

    /// At rest: what the samples do, and on no rig what the residual does as well, since a reference trembles with the hand.
    fn still(&self, kind: SensorKind, residual: &Means) -> [f64; 3] {
        let mut white = self.resting(kind);
        let Some(values) = residual[kind as usize].as_ref().filter(|_| self.scene.swings.is_none()) else {
            return white;
        };
        for length in SWAY {
            let bends = self
                .bends(kind, values, length, |first, other| first.rest.is_some() && first.rest == other.rest);
            for (white, bends) in white.iter_mut().zip(bends) {
                *white = white.max(usual_square(bends).sqrt());
            }
        }
        white
    }

    /// From the differences of neighbouring pieces of a rest.
    fn resting(&self, kind: SensorKind) -> [f64; 3] {
        let Some(triple) = self.scene.recording.sensor(kind) else { return [1.0; 3] };
        let interval = self.scene.recording.median_interval().unwrap_or(PIECE);
        let length = ((PIECE / interval).round() as usize).max(1);
        let mut squares: [Vec<f64>; 3] = Default::default();
        let usable = &self.scene.usable[kind as usize];
        for block in self.scene.blocks.iter().filter(|block| block.rest.is_some()) {
            // A sensor may be slower than the recording: then some rows hold nothing of it.
            let rows: Vec<usize> = block.rows.clone().collect();
            let pieces: Vec<(Vector3<f64>, f64)> = rows
                .chunks_exact(length)
                .filter_map(|rows| {
                    let measured = rows.iter().filter(|row| usable[**row]);
                    let (sum, count) = measured
                        .fold((Vector3::zeros(), 0.0), |(s, n), row| (s + triple.values[*row], n + 1.0));
                    (count > 0.0).then(|| (sum / count, count))
                })
                .collect();
            for pair in pieces.windows(2) {
                let ((before, m), (after, n)) = (pair[0], pair[1]);
                let step = after - before;
                let samples = 1.0 / (1.0 / m + 1.0 / n);
                squares.iter_mut().zip(step.iter()).for_each(|(s, step)| s.push(step * step * samples));
            }
        }
        squares.map(|squares| trimmed_mean(squares).sqrt().max(f64::MIN_POSITIVE))
    }

    /// From second differences of the residuals of neighbouring moving blocks; at least as at rest. What a hand adds is
    /// no white noise: where no rig guides the sensor, groups of blocks count as well, and that which scatters most.
    fn moving(&self, kind: SensorKind, residual: &Means, resting: &[f64; 3]) -> [f64; 3] {
        let Some(values) = &residual[kind as usize] else { return [1.0; 3] };
        let guided = self.scene.swings.is_some();
        let in_motion = |_: &Block, other: &Block| other.rest.is_none();
        let bends = |length: usize| self.bends(kind, values, length, in_motion);
        let most: Vec<[f64; 3]> = match guided {
            // The median of a χ² of one degree is 0.455.
            true => vec![bends(1).map(|b| crate::recording::median(b).unwrap_or(0.0) / 0.455)],
            false => SWAY.iter().map(|length| bends(*length).map(usual_square)).collect(),
        };
        std::array::from_fn(|axis| {
            let square = most.iter().map(|squares| squares[axis]).fold(0.0, f64::max);
            square.sqrt().max(resting[axis])
        })
    }

    /// Squared second differences of neighbouring groups of blocks, as variances of one sample; `alike` tells whether a
    /// block belongs to groups that begin with another.
    fn bends(
        &self,
        kind: SensorKind,
        values: &[Vector3<f64>],
        length: usize,
        alike: impl Fn(&Block, &Block) -> bool,
    ) -> [Vec<f64>; 3] {
        let counts = &self.scene.counts[kind as usize];
        let guided = self.scene.swings.is_some();
        let mut squares: [Vec<f64>; 3] = Default::default();
        for from in (0..(values.len() + 1).saturating_sub(3 * length)).step_by(length) {
            // On a rig a block with fewer rows is one that it has just left or reached.
            let full =
                |k: usize| if guided { counts[k] == counts[from] } else { 2 * counts[k] > counts[from] };
            let blocks = &self.scene.blocks;
            let whole = |k: usize| alike(&blocks[from], &blocks[k]) && counts[k] > 0 && full(k);
            if !(from..from + 3 * length).all(whole) {
                continue;
            }
            let group = |which: usize| {
                let blocks = from + which * length..from + (which + 1) * length;
                blocks.fold((Vector3::zeros(), 0.0), |(sum, count), k| {
                    let n = counts[k] as f64;
                    (sum + values[k] * n, count + n)
                })
            };
            let [(a, l), (b, m), (c, n)] = [0, 1, 2].map(group);
            let bend = a / l - 2.0 * b / m + c / n;
            let share = 1.0 / l + 4.0 / m + 1.0 / n;
            squares.iter_mut().zip(bend.iter()).for_each(|(s, bend)| s.push(bend * bend / share));
        }
        squares
    }

    /// Σ⁻¹ of each channel of a design.
    pub fn whitenings(&self, design: &Design, noise: &Noise) -> Vec<Whitening> {
        design.channels.par_iter().map(|channel| self.whitening(channel, noise)).collect()
    }

    /// Σ⁻¹ of each channel over some of the blocks, as if the others had not been measured.
    pub fn whitenings_within(
        &self,
        design: &Design,
        noise: &Noise,
        inside: &(dyn Fn(usize) -> bool + Sync),
    ) -> Vec<Whitening> {
        design.channels.par_iter().map(|channel| self.whitening_within(channel, noise, inside)).collect()
    }

    fn whitening(&self, channel: &Channel, noise: &Noise) -> Whitening {
        self.whitening_within(channel, noise, &|_| true)
    }

    /// Variance of a block's mean by noise alone.
    pub fn variance(&self, channel: &Channel, noise: &Noise, block: usize) -> f64 {
        let sensor = &noise.sensors[channel.kind as usize];
        let count = self.scene.counts[channel.kind as usize][block].max(1) as f64;
        let rest = self.scene.blocks[block].rest.is_some();
        let white = if rest { sensor.white } else { sensor.moving }[channel.axis];
        let scatter = if rest { self.scatter(channel, sensor, block) } else { 0.0 };
        white * white / count + sensor.drift.iter().map(|sigma| sigma * sigma).sum::<f64>() + scatter
    }

    /// Variance that the scatter of a rest gives a channel.
    fn scatter(&self, channel: &Channel, sensor: &SensorNoise, block: usize) -> f64 {
        if channel.kind == SensorKind::Gyr {
            return 0.0;
        }
        let given = self.given[channel.kind as usize][block];
        sensor.scatter * sensor.scatter * (given.norm_squared() - given[channel.axis].powi(2))
    }

    fn whitening_within(
        &self,
        channel: &Channel,
        noise: &Noise,
        inside: &(dyn Fn(usize) -> bool + Sync),
    ) -> Whitening {
        let sensor = &noise.sensors[channel.kind as usize];
        let blocks = &self.scene.blocks;
        let counts = &self.scene.counts[channel.kind as usize];
        let weight = |(at, (block, count)): (usize, (&Block, &usize))| {
            let sigma = if block.rest.is_some() { sensor.white } else { sensor.moving }[channel.axis];
            let told = inside(at) && self.scene.tells(channel.kind, at, channel.axis);
            if told { *count as f64 / (sigma * sigma) } else { 0.0 }
        };
        let weights: Vec<f64> = blocks.iter().zip(counts).enumerate().map(weight).collect();
        let mut rests: Vec<Shared> = Vec::new();
        let mut from = 0;
        for at in 1..=blocks.len() {
            if at == blocks.len() || blocks[at].rest != blocks[from].rest {
                if blocks[from].rest.is_some() {
                    let variance = self.scatter(channel, sensor, (from + at) / 2);
                    rests.push(Shared { blocks: from..at, variance });
                }
                from = at;
            }
        }
        let drifts: Vec<Process> = [FAST, sensor.slow]
            .into_iter()
            .zip(sensor.drift)
            .map(|(time, sigma)| Process { time, sigma })
            .collect();
        Whitening::new(&self.times, weights, &rests, &drifts)
    }

    /// The noise of a sensor under which its residual, less `columns`, is likeliest; the search begins at `start`
    /// and goes by these factors.
    pub fn fit(
        &self,
        design: &Design,
        kind: SensorKind,
        columns: &[usize],
        start: &Noise,
        steps: &[f64],
    ) -> SensorNoise {
        let channels: Vec<&Channel> = design.channels.iter().filter(|channel| channel.kind == kind).collect();
        let gathered: Vec<(Gathered, Vec<usize>)> = channels
            .iter()
            .map(|channel| {
                let place = |id: &usize| columns.iter().position(|column| column == id);
                let (from, to): (Vec<usize>, Vec<usize>) = (0..channel.ids.len())
                    .filter_map(|at| place(&channel.ids[at]).map(|to| (at, to)))
                    .unzip();
                (channel.gathered(&from), to)
            })
            .collect();
        let likelihood = |sensor: &SensorNoise| {
            let mut noise = start.clone();
            noise.sensors[kind as usize] = *sensor;
            let parts: Vec<Normal> = channels
                .par_iter()
                .zip(&gathered)
                .map(|(channel, (columns, _))| columns.normal(&self.whitening(channel, &noise)))
                .collect();
            let mut normal = Normal::zeros(columns.len());
            parts.iter().zip(&gathered).for_each(|(part, (_, to))| normal.add(part, to));
            restricted(&normal)
        };
        let mut best = start.sensors[kind as usize];
        let mut least = likelihood(&best);
        for factor in steps {
            let mut improved = true;
            let mut rounds = 0;
            while improved && rounds < ROUNDS {
                improved = false;
                rounds += 1;
                for tried in best.otherwise_slow() {
                    let found = likelihood(&tried);
                    if found < least - 0.05 {
                        (best, least, improved) = (tried, found, true);
                    }
                }
                for coordinate in 0..if kind == SensorKind::Gyr { 2 } else { 3 } {
                    for step in [*factor, 1.0 / factor] {
                        loop {
                            let mut tried = best;
                            let value = tried.coordinate(coordinate);
                            *value *= step;
                            let value = *value;
                            let floor = 1e-3 * best.white[0].min(best.white[1]).min(best.white[2]);
                            let smallest = if coordinate == 2 { self.least_scatter() } else { floor };
                            if value < smallest || value > 1e4 * smallest {
                                break;
                            }
                            let found = likelihood(&tried);
                            if found >= least - 0.05 {
                                break;
                            }
                            (best, least, improved) = (tried, found, true);
                        }
                    }
                }
            }
        }
        best
    }
}

impl SensorNoise {
    /// With other correlation times of the slow drift, which goes as far from one moment to the next.
    fn otherwise_slow(self) -> impl Iterator<Item = Self> {
        let with = move |slow: f64| {
            let drift = [self.drift[0], self.drift[1] * libm::sqrt(slow / self.slow)];
            Self { slow, drift, ..self }
        };
        SLOW.into_iter().filter(move |slow| *slow != self.slow).map(with)
    }

    fn coordinate(&mut self, index: usize) -> &mut f64 {
        match index {
            0 | 1 => &mut self.drift[index],
            _ => &mut self.scatter,
        }
    }
}

/// Prior information on a column: a usual size is one, and this many of them would be no surprise.
const LOOSE: f64 = 30.0;

/// −2 ln of the restricted likelihood, but for a constant.
pub fn restricted(normal: &Normal) -> f64 {
    let n = normal.score.len();
    let prior = 1.0 / (LOOSE * LOOSE);
    let loosened = &normal.information + DMatrix::identity(n, n) * prior;
    let Some(factor) = loosened.cholesky() else { return f64::INFINITY };
    let explained = normal.score.dot(&factor.solve(&normal.score));
    normal.log_determinant + factor.ln_determinant() - n as f64 * prior.ln() + normal.energy - explained
}

/// The mean square of normal numbers from their squares without the largest tenth: a hand's jolts, and the beginning and
/// end of an episode, are no noise.
fn usual_square(mut squares: Vec<f64>) -> f64 {
    squares.sort_unstable_by(f64::total_cmp);
    let kept = squares.len() - squares.len() / 10;
    // The mean of a χ² of one degree below its ninth decile is 0.623.
    squares[..kept].iter().sum::<f64>() / (0.623 * kept.max(1) as f64)
}

/// The mean without the largest hundredth.
fn trimmed_mean(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let kept = values.len() - values.len() / 100;
    values[..kept].iter().sum::<f64>() / kept.max(1) as f64
}
