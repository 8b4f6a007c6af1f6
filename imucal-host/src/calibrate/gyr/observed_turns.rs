//! What a gyroscope is calibrated from between rests: the turns from one direction of gravity to the next, less the bias at rest.

use std::ops::Range;

use imucal_core::{
    observation::{Rest, Turn},
    session::bias::{MeanRate, RestBias},
};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use crate::{
    calibrate::{
        fit::{directions::Directions, rest_noise::AtRest},
        outcome::{BiasWander, KnownTurn},
        temperature::{Thermometry, WarmTriad, rests},
    },
    observe::turn::{BiasPath, TurnData, compress},
    recording::{Series, Triple},
};

/// What the gyroscope is calibrated from.
#[derive(Clone, Copy, Debug)]
pub struct GyrInput<'a> {
    /// The gyroscope.
    pub sensor: &'a Triple,
    /// Its rates.
    pub rates: Series<'a>,
    /// Step of the converter on each axis ([`crate::observe::quantum`]), rad/s.
    pub step: Vector3<f64>,
    /// Rows of the rests, with what was observed in each.
    pub rows: &'a [Range<usize>],
    /// The rests.
    pub rests: &'a [Rest<f64>],
    /// Rests whose direction is to be trusted.
    pub used: &'a [usize],
    /// The accelerometer's calibration, nominal SI in.
    pub acc: &'a WarmTriad,
    /// How its directions err, where that is asked for.
    pub directions: Option<&'a Directions>,
    /// Part of Earth's rotation along the vertical, rad/s, upwards positive; 0 where the latitude is not known.
    pub vertical_rate: f64,
    /// The thermometer, where terms of temperature are asked for.
    pub thermometry: Option<&'a Thermometry<'a>>,
}

/// Turns and the bias they are counted from.
pub(super) struct Turns {
    pub(super) data: Vec<TurnData>,
    pub(super) bias: Vector3<f64>,
    pub(super) wander: BiasWander,
    pub(super) left_out: Vec<String>,
    /// What the rates of each were multiplied by; none where nothing was.
    pub(super) stretches: Vec<Matrix3<f64>>,
}

impl GyrInput<'_> {
    /// Turns, less the bias of their temperature where `warm` has its terms.
    pub(super) fn turns(&self, warm: Option<&rests::Kept>) -> Turns {
        let raw = self.rest_means();
        let drift =
            |k: usize| warm.map_or_else(Vector3::zeros, |kept| kept.terms.drift(self.rests[k].temperature));
        let means: Vec<Vector3<f64>> = raw.iter().enumerate().map(|(k, mean)| mean - drift(k)).collect();
        let (mean, wander) = wander(self.rests, &means);
        let bias = warm.map_or(mean, rests::Kept::rest_bias);
        let mut turns = Turns { data: Vec::new(), bias, wander, left_out: Vec::new(), stretches: Vec::new() };
        let turn = |pair: &[usize]| {
            let (i, j) = (pair[0], pair[1]);
            let mean = |k: usize| {
                if wander.interpolated { raw[k] } else { bias + drift(k) }
            };
            let path =
                BiasPath { before: (self.rests[i].time, mean(i)), after: (self.rests[j].time, mean(j)) };
            let ends = (i, &self.rows[i], j, &self.rows[j]);
            let left_out = |gap| format!("turn from rest {} to {}: {gap}", i + 1, j + 1);
            compress(self.rates, ends, &path).map_err(left_out)
        };
        let each: Vec<Result<TurnData, String>> = self.used.par_windows(2).map(turn).collect();
        for turn in each {
            match turn {
                Ok(data) => turns.data.push(data),
                Err(left_out) => turns.left_out.push(left_out),
            }
        }
        turns
    }

    pub(super) fn at_rest(&self) -> AtRest<'_> {
        AtRest { series: self.rates, rows: self.rows, step: self.step }
    }

    /// Mean rate of each rest, less Earth's about the vertical.
    pub(super) fn rest_means(&self) -> Vec<Vector3<f64>> {
        let mean = |k: usize| self.rests[k].gyr.mean() - self.direction(k) * self.vertical_rate;
        (0..self.rests.len()).map(mean).collect()
    }

    pub(super) fn direction(&self, rest: usize) -> Vector3<f64> {
        let rest = &self.rests[rest];
        self.acc.correct(&rest.acc.mean(), rest.temperature).normalize()
    }

    pub(super) fn with_directions<'a>(&self, data: &'a [TurnData]) -> Vec<Turn<'a, f64>> {
        data.iter()
            .map(|turn| turn.between(self.direction(turn.rest_before), self.direction(turn.rest_after)))
            .collect()
    }
}

/// Mean rate at rest, and how it moved from rest to rest.
fn wander(rests: &[Rest<f64>], means: &[Vector3<f64>]) -> (Vector3<f64>, BiasWander) {
    let rates = rests.iter().zip(means).map(|(rest, mean)| MeanRate {
        mean: *mean,
        variance: rest.gyr.variance() / f64::from(rest.gyr.count().max(1)),
        count: rest.gyr.count(),
    });

    let unknown = Vector3::repeat(f64::NAN);
    let bias = RestBias::of(rates).unwrap_or(RestBias {
        mean: unknown,
        spread: unknown,
        expected: unknown,
        rests: 0,
    });
    let (spread, expected) = (bias.spread, bias.expected);
    (bias.mean, BiasWander { spread, expected, interpolated: bias.wanders() })
}

impl Turns {
    /// Takes the scale's terms off: rates as they would be at the reference temperature.
    pub(super) fn reduce(&mut self, kept: &rests::Kept) {
        let gain = Matrix3::from_fn(|i, j| kept.fit.fitted.theta[3 * i + j]);
        self.stretches = kept.temperatures.iter().map(|t| kept.terms.stretch(&gain, *t)).collect();
        for (data, stretch) in self.data.iter_mut().zip(&self.stretches) {
            *data = data.clone().stretched(stretch);
        }
    }

    /// Keeps some of the turns.
    pub(super) fn keep(&mut self, used: &[usize]) {
        self.data = used.iter().map(|k| self.data[*k].clone()).collect();
        self.stretches = used.iter().filter_map(|k| self.stretches.get(*k).copied()).collect();
    }

    /// The turns as evidence.
    pub(super) fn known(&self, known: &[Turn<'_, f64>]) -> Vec<KnownTurn> {
        let one = |(k, turn): (usize, &Turn<'_, f64>)| KnownTurn {
            data: self.data[k].clone(),
            before: turn.before,
            after: turn.after,
            stretch: self.stretches.get(k).copied().unwrap_or_else(Matrix3::identity),
        };
        known.iter().enumerate().map(one).collect()
    }
}

impl TurnData {
    pub(super) fn left_out(&self, size: f64) -> String {
        let (before, after) = (self.rest_before + 1, self.rest_after + 1);
        format!("turn from rest {before} to {after}: {size:.1} robust standard deviations")
    }
}
