//! The noise of each channel: white, drifting, and what a rest or a movement has in common.
//!
//! White noise comes from neighbouring blocks. Drifts and scatter come from the restricted likelihood of the blocks'
//! residuals ([`super::likelihood`]), so that what the model has taken up is not missed in the noise.
//!
//! Each sensor has its own; the axes of a sensor share drift and scatter. Not modelled: noise that axes have in common,
//! white noise that changes in the course of the recording.

use crate::noise::{
    knots::Knots,
    precision::{ChannelPrecision, Precision},
    process::Process,
    random_effects::{ChannelBlocks, RandomEffects, States},
    sparse_rows::SparseRows,
};
use std::sync::Arc;

use nalgebra::Vector3;
use rayon::prelude::*;

use super::{
    design::{Channel, ChannelGroup, Design, DesignProducts, Normal},
    likelihood::Likelihood,
    repeatability::PointingErrors,
};
use crate::{
    diagnosis::residual::{block::Block, forward_model::ForwardModel},
    recording::SensorKind,
};

/// A fast drift and a slow one.
const DRIFTS: usize = 2;
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
/// −2 ln of the likelihood must fall by this for a step to be gone.
const WORTH: f64 = 0.05;
/// A beginning near an end that is so much worse than what has been found leads nowhere better.
const HOPELESS: f64 = 15.0;
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
    /// Angle between the table and what its encoders show, another at each rest, standard deviation, rad.
    pub scatter: f64,
    /// ln of how many noises about this one are as likely.
    pub breadth: f64,
}

/// Noise of a recording, by [`SensorKind::ALL`].
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// Of each sensor.
    pub sensors: [SensorNoise; 3],
}

impl Noise {
    /// Normal equations of all columns of a design, of which there are `size`, axis by axis.
    pub fn normal(&self, design: &DesignProducts, size: usize) -> Normal {
        design.normal(size, &|group| {
            let scatter = group.kinds.first().map_or(0.0, |kind| self.sensors[*kind as usize].scatter);
            self.precision(&group.kinds, &group.columns.effects, scatter)
        })
    }

    /// Σ⁻¹ of channels of these sensors, with a scatter of their offsets, rad.
    pub fn precision(&self, kinds: &[SensorKind], effects: &States, scatter: f64) -> Precision {
        let drifts: Vec<[Process; 2]> =
            kinds.iter().map(|kind| self.sensors[*kind as usize].drifts()).collect();
        let drifts: Vec<&[Process]> = drifts.iter().map(|drifts| &drifts[..]).collect();
        Precision::new(effects, scatter, &drifts)
    }

    /// White noise of a sensor in a sample, the mean of its axes.
    pub fn usual(&self, kind: SensorKind) -> f64 {
        self.sensors[kind as usize].white.iter().sum::<f64>() / 3.0
    }

    /// White noise of a sensor's sample in motion, that of the noisiest axis.
    pub fn largest(&self, kind: SensorKind) -> f64 {
        self.sensors[kind as usize].moving.iter().copied().fold(0.0, f64::max)
    }

    /// With all of it smaller by a factor.
    #[must_use]
    pub fn scaled(mut self, by: f64) -> Self {
        for sensor in &mut self.sensors {
            for sigma in sensor.white.iter_mut().chain(&mut sensor.moving).chain(&mut sensor.drift) {
                *sigma *= by;
            }
            sensor.scatter *= by;
        }
        self
    }

    /// −ln of the prior of all that are as likely, but for a constant.
    pub fn neg_log_prior(&self) -> f64 {
        self.sensors.iter().map(SensorNoise::neg_log_prior).sum()
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
}

/// What weighs the blocks: the scene, and what each sensor is given there.
pub struct Weighing<'s> {
    /// The scene.
    pub scene: &'s ForwardModel<'s>,
    times: Vec<f64>,
    /// Mean output of each block, by sensor: scatter turns it.
    pub given: [Vec<Vector3<f64>>; 3],
}

impl<'s> Weighing<'s> {
    /// With the outputs of the simulator, block by block.
    pub fn new(scene: &'s ForwardModel<'s>, given: [Vec<Vector3<f64>>; 3]) -> Self {
        Self { scene, times: scene.blocks.iter().map(|block| block.time).collect(), given }
    }

    /// The smallest scatter that is looked for, rad: a rig repeats its rests; a hand does not, nor is the field of a
    /// room the same all over it.
    pub fn least_scatter(&self) -> f64 {
        self.scene.settings.noise.least_scatter
    }

    /// Σ⁻¹ of each channel of a design.
    pub fn precisions(&self, design: &Design, noise: &Noise) -> Vec<ChannelPrecision> {
        self.precisions_within(design, noise, &|_| true)
    }

    /// Σ⁻¹ of each channel over some of the blocks, as if the others had not been measured.
    pub fn precisions_within(
        &self,
        design: &Design,
        noise: &Noise,
        inside: &(dyn Fn(usize) -> bool + Sync),
    ) -> Vec<ChannelPrecision> {
        let precision = |channel: &Channel| {
            let effects = Arc::new(self.effects_alone(channel, noise, inside));
            let scatter = noise.sensors[channel.kind as usize].scatter;
            let precision = noise.precision(&[channel.kind], &effects.states, scatter);
            ChannelPrecision { effects, precision }
        };
        design.channels.par_iter().map(precision).collect()
    }

    /// Random effects of some channels of a design that share their offsets: so many, with a row a block for each channel.
    pub fn effects_shared(
        &self,
        design: &Design,
        noise: &Noise,
        channels: Vec<usize>,
        count: usize,
        offsets: &dyn Fn(&Channel) -> SparseRows,
    ) -> ChannelGroup {
        let rows = |at: &usize| {
            let channel = &design.channels[*at];
            ChannelBlocks { weights: self.weights(channel, noise, &|_| true), offsets: offsets(channel) }
        };
        let rows = channels.iter().map(rows).collect();
        let effects = Arc::new(RandomEffects::new(
            Knots::at(&self.times, self.scene.settings.noise.knots),
            rows,
            count,
            DRIFTS,
        ));
        ChannelGroup { channels, effects }
    }

    /// Cross-products of some columns of a design, axis by axis.
    pub fn products(&self, design: &Design, noise: &Noise, wanted: &[usize]) -> DesignProducts {
        let alone = |(at, channel): (usize, &Channel)| ChannelGroup {
            channels: vec![at],
            effects: Arc::new(self.effects_alone(channel, noise, &|_| true)),
        };
        let groups: Vec<ChannelGroup> = design.channels.par_iter().enumerate().map(alone).collect();
        design.products(&groups, wanted)
    }

    /// Variance of a block's mean by noise alone.
    pub fn variance(&self, channel: &Channel, noise: &Noise, block: usize) -> f64 {
        let sensor = &noise.sensors[channel.kind as usize];
        let count = self.scene.worth(channel.kind, block);
        let count = if count > 0.0 { count } else { 1.0 };
        let rest = self.scene.blocks[block].rest.is_some();
        let white = if rest { sensor.white } else { sensor.moving }[channel.axis];
        let scatter = sensor.scatter * sensor.scatter * self.scattered(channel).variance(block);
        white * white / count + sensor.drift.iter().map(|sigma| sigma * sigma).sum::<f64>() + scatter
    }

    fn scattered(&self, channel: &Channel) -> PointingErrors<'_> {
        self.pointing_errors(channel.kind, channel.axis)
    }

    pub(super) fn pointing_errors(&self, kind: SensorKind, axis: usize) -> PointingErrors<'_> {
        PointingErrors { scene: self.scene, kind, axis, given: &self.given[kind as usize] }
    }

    /// Random effects of a channel by itself; of some of its blocks, as if the others had not been measured.
    fn effects_alone(
        &self,
        channel: &Channel,
        noise: &Noise,
        inside: &(dyn Fn(usize) -> bool + Sync),
    ) -> RandomEffects {
        let weights = self.weights(channel, noise, inside);
        let (count, offsets) = self.scattered(channel).offsets();
        RandomEffects::new(
            Knots::at(&self.times, self.scene.settings.noise.knots),
            vec![ChannelBlocks { weights, offsets }],
            count,
            DRIFTS,
        )
    }

    fn weights(&self, channel: &Channel, noise: &Noise, inside: &(dyn Fn(usize) -> bool + Sync)) -> Vec<f64> {
        let sensor = &noise.sensors[channel.kind as usize];
        let weight = |(at, block): (usize, &Block)| {
            let sigma = if block.rest.is_some() { sensor.white } else { sensor.moving }[channel.axis];
            let measured = inside(at) && self.scene.measures(channel.kind, at, channel.axis);
            if measured { self.scene.worth(channel.kind, at) / (sigma * sigma) } else { 0.0 }
        };
        self.scene.blocks.iter().enumerate().map(weight).collect()
    }

    /// The noise of a sensor under which its residual, less `columns`, is likeliest; the search begins at `start`, by
    /// whose white noise the products were taken, and goes by these factors.
    pub fn fit(
        &self,
        design: &DesignProducts,
        kind: SensorKind,
        columns: &[usize],
        start: &Noise,
        steps: &[f64],
    ) -> SensorNoise {
        let asked = Likelihood::new(design, kind, columns);
        let likelihood =
            |sensor: &SensorNoise| asked.of(sensor.scatter, sensor.drifts()) + 2.0 * sensor.neg_log_prior();
        let start = SensorNoise { breadth: 0.0, ..start.sensors[kind as usize] };
        // Between two correlation times lies a hill: each is searched by itself.
        let mut starts = SLOW.map(|slow| start.with_slow(slow)).map(|start| (start, likelihood(&start)));
        starts.sort_by(|(_, a), (_, b)| a.total_cmp(b));
        let mut ends: Vec<(SensorNoise, f64)> = Vec::with_capacity(starts.len());
        for tried in starts {
            let hopeless = |end: &(SensorNoise, f64)| tried.1 >= end.1 + HOPELESS;
            if steps.len() > NEAR.len() || !ends.iter().any(hopeless) {
                ends.push(self.descended(kind, tried, steps, &likelihood));
            }
        }
        ends.sort_by(|(_, a), (_, b)| a.total_cmp(b));
        let (best, least) = ends[0];
        let mut breadth = log_sum(least, ends.iter().map(|(_, end)| *end));
        for coordinate in self.coordinates(kind) {
            let near = [NEAR[0], 1.0 / NEAR[0]].into_iter();
            let tried = near.filter_map(|factor| self.scaled(best, coordinate, factor));
            breadth += log_sum(least, tried.map(|tried| likelihood(&tried)).chain([least]));
        }
        SensorNoise { breadth, ..best }
    }

    /// Standard deviations of a sensor that are searched; a gyroscope does not see how the table stands, nor has a stream a
    /// table.
    fn coordinates(&self, kind: SensorKind) -> std::ops::Range<usize> {
        0..if kind == SensorKind::Gyr || !self.scene.settings.noise.scatters { 2 } else { 3 }
    }

    /// Standard deviations changed one by one while `objective` falls, and its end.
    fn descended(
        &self,
        kind: SensorKind,
        (mut best, mut least): (SensorNoise, f64),
        steps: &[f64],
        objective: &dyn Fn(&SensorNoise) -> f64,
    ) -> (SensorNoise, f64) {
        for factor in steps {
            for _ in 0..ROUNDS {
                let before = least;
                for coordinate in self.coordinates(kind) {
                    for step in [*factor, 1.0 / factor] {
                        while let Some(tried) = self.scaled(best, coordinate, step) {
                            let found = objective(&tried);
                            if found >= least - WORTH {
                                break;
                            }
                            (best, least) = (tried, found);
                        }
                    }
                }
                if least == before {
                    break;
                }
            }
        }
        (best, least)
    }

    /// With one standard deviation scaled; `None` beyond what is looked for.
    fn scaled(&self, mut sensor: SensorNoise, coordinate: usize, factor: f64) -> Option<SensorNoise> {
        let floor = 1e-3 * sensor.white.into_iter().fold(f64::INFINITY, f64::min);
        let (value, smallest) = match coordinate {
            0 | 1 => (&mut sensor.drift[coordinate], floor),
            _ => (&mut sensor.scatter, self.least_scatter()),
        };
        *value *= factor;
        (smallest..=1e4 * smallest).contains(value).then_some(sensor)
    }
}

impl SensorNoise {
    /// The fast and the slow drift.
    pub(super) fn drifts(&self) -> [Process; DRIFTS] {
        [(FAST, self.drift[0]), (self.slow, self.drift[1])].map(|(time, sigma)| Process { time, sigma })
    }

    /// −ln of the prior of all that are as likely, but for a constant.
    fn neg_log_prior(&self) -> f64 {
        if self.slow < WALK { -self.breadth } else { WALKS - self.breadth }
    }

    /// With another correlation time of the slow drift, which goes as far from one moment to the next.
    fn with_slow(self, slow: f64) -> Self {
        let drift = [self.drift[0], self.drift[1] * libm::sqrt(slow / self.slow)];
        Self { slow, drift, ..self }
    }
}

/// ln of a sum of likelihoods, each −2 ln of it, over the greatest.
fn log_sum(least: f64, each: impl Iterator<Item = f64>) -> f64 {
    each.map(|value| (-0.5 * (value - least)).exp()).sum::<f64>().ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noises_that_are_as_likely_count_and_others_do_not() {
        assert!((log_sum(7.0, [7.0, 7.0, 900.0].into_iter()) - 2f64.ln()).abs() < 1e-12);
        assert!((log_sum(7.0, [7.0, 9.0].into_iter()) - (1.0 + (-1f64).exp()).ln()).abs() < 1e-12);
    }
}
