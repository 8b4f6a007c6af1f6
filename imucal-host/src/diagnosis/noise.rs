//! The noise of each channel: white, drifting, and what a rest or a movement has in common.
//!
//! White noise comes from neighbouring blocks. Drifts and scatter come from the restricted likelihood of the blocks'
//! residuals (Patterson and Thompson 1971), so that what the model has taken up is not missed in the noise:
//!
//! ```text
//! −2 ln L = ln|Σ| + ln|XᵀΣ⁻¹X + Λ| − ln|Λ| + rᵀΣ⁻¹r − zᵀ(XᵀΣ⁻¹X + Λ)⁻¹z      z = XᵀΣ⁻¹r
//! ```
//!
//! Each sensor has its own; the axes of a sensor share drift and scatter. Not modelled: noise that axes have in common,
//! white noise that changes in the course of the recording.

use std::sync::Arc;

use nalgebra::{DMatrix, Vector3};
use rayon::prelude::*;

use super::{
    block::Block,
    design::{Channel, CondensedChannel, CondensedDesign, Design, Normal},
    latent::Latents,
    scatter::Scattered,
    scene::Scene,
    whitening::{Process, Whitening},
};
use crate::recording::SensorKind;

/// Correlation time of the fast drift, s.
const FAST: f64 = 8.0;
/// Correlation times that the slow drift may have, s: the last is a walk, which forgets nothing while it is recorded.
const SLOW: [f64; 3] = [30.0, 120.0, WALK];
const WALK: f64 = 1200.0;
/// The one that a search begins with.
pub const USUAL: f64 = SLOW[1];
/// −ln of the odds of a walk against a drift that forgets: a walk would take up any cause that goes slowly.
const WALKS: f64 = 2.0;
/// Factors of a search that begins anywhere.
pub const FAR: [f64; 2] = [4.0, 1.7];
/// Factors of a search that begins near its end.
pub const NEAR: [f64; 1] = [2.0];
/// Rounds over all standard deviations for each factor.
const ROUNDS: usize = 4;
/// Share of drift and scatter that [`Noise::quieter`] leaves.
const QUIET: f64 = 0.2;

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
    /// Angle by which the table stands off its encoders, anew at each rest, rad.
    pub scatter: f64,
}

/// Noise of a recording, by [`SensorKind::ALL`].
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// Of each sensor.
    pub sensors: [SensorNoise; 3],
}

impl Noise {
    /// Normal equations of all columns of a condensed design, of which there are `size`.
    pub fn normal(&self, design: &CondensedDesign, size: usize) -> Normal {
        let sensor = |kind: SensorKind| &self.sensors[kind as usize];
        design.normal(size, &|channel| sensor(channel.kind).whitening(&channel.columns.latents))
    }

    /// −ln of its prior, but for a constant.
    pub fn surprise(&self) -> f64 {
        self.sensors.iter().map(SensorNoise::surprise).sum()
    }

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
    /// The scene.
    pub scene: &'s Scene<'s>,
    times: Vec<f64>,
    /// Mean output of each block, by sensor: scatter turns it.
    pub given: [Vec<Vector3<f64>>; 3],
}

impl<'s> Weighing<'s> {
    /// With the outputs of the simulator, block by block.
    pub fn new(scene: &'s Scene<'s>, given: [Vec<Vector3<f64>>; 3]) -> Self {
        Self { scene, times: scene.blocks.iter().map(|block| block.time).collect(), given }
    }

    /// The smallest scatter that is looked for, rad: a rig repeats its rests; a hand does not, nor is the field of a
    /// room the same all over it.
    pub fn least_scatter(&self) -> f64 {
        if self.scene.swings.is_some() { 1e-7 } else { 1e-5 }
    }

    /// Σ⁻¹ of each channel of a design.
    pub fn whitenings(&self, design: &Design, noise: &Noise) -> Vec<Whitening> {
        self.whitenings_within(design, noise, &|_| true)
    }

    /// Σ⁻¹ of each channel over some of the blocks, as if the others had not been measured.
    pub fn whitenings_within(
        &self,
        design: &Design,
        noise: &Noise,
        inside: &(dyn Fn(usize) -> bool + Sync),
    ) -> Vec<Whitening> {
        let whitening = |channel: &Channel| {
            let latents = self.latents(channel, noise, inside);
            noise.sensors[channel.kind as usize].whitening(&Arc::new(latents))
        };
        design.channels.par_iter().map(whitening).collect()
    }

    /// A design's columns, as white noise weighs them.
    pub fn condensed(&self, design: &Design, noise: &Noise) -> CondensedDesign {
        design.condensed(&|channel| self.latents(channel, noise, &|_| true))
    }

    /// Variance of a block's mean by noise alone.
    pub fn variance(&self, channel: &Channel, noise: &Noise, block: usize) -> f64 {
        let sensor = &noise.sensors[channel.kind as usize];
        let count = self.scene.counts[channel.kind as usize][block].max(1) as f64;
        let rest = self.scene.blocks[block].rest.is_some();
        let white = if rest { sensor.white } else { sensor.moving }[channel.axis];
        let scatter = sensor.scatter * sensor.scatter * self.scattered(channel).variance(block);
        white * white / count + sensor.drift.iter().map(|sigma| sigma * sigma).sum::<f64>() + scatter
    }

    fn scattered(&self, channel: &Channel) -> Scattered<'_> {
        let given = &self.given[channel.kind as usize];
        Scattered { scene: self.scene, kind: channel.kind, axis: channel.axis, given }
    }

    /// What the blocks of a channel have in common, by its white noise; of some of them, as if the others had not been
    /// measured.
    fn latents(&self, channel: &Channel, noise: &Noise, inside: &(dyn Fn(usize) -> bool + Sync)) -> Latents {
        let sensor = &noise.sensors[channel.kind as usize];
        let blocks = &self.scene.blocks;
        let counts = &self.scene.counts[channel.kind as usize];
        let weight = |(at, (block, count)): (usize, (&Block, &usize))| {
            let sigma = if block.rest.is_some() { sensor.white } else { sensor.moving }[channel.axis];
            let told = inside(at) && self.scene.tells(channel.kind, at, channel.axis);
            if told { *count as f64 / (sigma * sigma) } else { 0.0 }
        };
        let weights: Vec<f64> = blocks.iter().zip(counts).enumerate().map(weight).collect();
        Latents::new(&self.times, weights, &self.scattered(channel).shared())
    }

    /// The noise of a sensor under which its residual, less `columns`, is likeliest; the search begins at `start`, by
    /// whose white noise the design was condensed, and goes by these factors.
    pub fn fit(
        &self,
        design: &CondensedDesign,
        kind: SensorKind,
        columns: &[usize],
        start: &Noise,
        steps: &[f64],
    ) -> SensorNoise {
        let picked = design.picked(Some(kind), columns);
        let likelihood = |sensor: &SensorNoise| {
            let whitening = |channel: &CondensedChannel| sensor.whitening(&channel.columns.latents);
            restricted(&picked.normal(columns.len(), &whitening)) + 2.0 * sensor.surprise()
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
    /// Σ⁻¹ of one of the sensor's axes.
    fn whitening(&self, latents: &Arc<Latents>) -> Whitening {
        let drifts = [(FAST, self.drift[0]), (self.slow, self.drift[1])];
        let drifts = drifts.map(|(time, sigma)| Process { time, sigma });
        Whitening::new(Arc::clone(latents), self.scatter, &drifts)
    }

    /// −ln of its prior, but for a constant.
    fn surprise(&self) -> f64 {
        if self.slow < WALK { 0.0 } else { WALKS }
    }

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
