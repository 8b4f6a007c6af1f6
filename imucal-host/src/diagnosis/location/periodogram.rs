//! A beat that a residual may follow: the period that stands out most from its neighbours.
//!
//! ```text
//! P(f) = |Σ w e^{2πift}|²      w = Σ⁻¹ r, block by block, f = k / 2T; over the axes of a sensor
//! ```
//!
//! Against the median of its neighbours, since noise that is taken for drift is not alike at all frequencies. Not looked
//! for: periods shorter than a few blocks, and those so long that half-waves of the recording follow them.

use crate::noise::precision::ChannelPrecision;
use std::{f64::consts::TAU, ops::Range};

use nalgebra::DVector;
use rayon::prelude::*;

use super::covariate::{Covariate, Function};
use crate::{
    diagnosis::search::linearisation::Linearisation,
    effect::Effect,
    recording::{SensorKind, median},
};

/// Lowest frequency, half-waves in the recording.
const LOWEST: usize = 7;
/// Frequencies of a run.
const RUN: usize = 64;
/// Neighbours to each side.
const ABOUT: usize = 12;

/// The beat of a sensor that stands out most, if any does, and among how many it was looked for.
pub fn beat(
    linear: &Linearisation<'_>,
    set: &[&'static Effect],
    precisions: &[ChannelPrecision],
    kind: SensorKind,
) -> Option<(Covariate, usize)> {
    let weighed = weighed_residual(linear, set, precisions, kind)?;
    let times: Vec<f64> = linear.scene.blocks.iter().map(|block| block.time).collect();
    let duration = linear.scene.duration();
    let last = (2.0 * duration / linear.scene.settings.location.shortest_period) as usize;
    let powers: Vec<f64> = (LOWEST..last)
        .step_by(RUN)
        .collect::<Vec<_>>()
        .par_iter()
        .flat_map(|from| powers(&weighed, &times, 0.5 * TAU / duration, *from..(*from + RUN).min(last)))
        .collect();
    let height = |at: usize| {
        let about = at.saturating_sub(ABOUT)..(at + ABOUT + 1).min(powers.len());
        powers[at] / median(powers[about].to_vec()).unwrap_or(f64::INFINITY).max(f64::MIN_POSITIVE)
    };
    let (most, highest) = (0..powers.len()).map(|at| (at, height(at))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    if highest < linear.scene.settings.location.peak {
        return None;
    }
    let period = 2.0 * duration / (LOWEST + most) as f64;
    let wave = |of: fn(f64) -> f64| {
        let values = times.iter().map(|time| of(TAU * time / period)).collect();
        Function::new(format!("period {period:.1} s"), values)
    };
    let functions = vec![wave(libm::cos), wave(libm::sin)];
    Some((Covariate { name: "frequency".into(), functions }, powers.len()))
}

/// P at successive multiples of a frequency, `half_wave` in rad/s. Each wave is the one before turned by a half-wave's
/// angle, which is cheaper than a sine and exact for a run.
fn powers(weighed: &[DVector<f64>], times: &[f64], half_wave: f64, multiples: Range<usize>) -> Vec<f64> {
    let turned = |by: f64| -> Vec<(f64, f64)> { times.iter().map(|time| libm::sincos(by * time)).collect() };
    let (mut waves, steps) = (turned(half_wave * multiples.start as f64), turned(half_wave));
    let next = |_: usize| {
        let of = |w: &DVector<f64>| {
            let along = |(c, s), (w, (sin, cos)): (&f64, &(f64, f64))| (c + w * cos, s + w * sin);
            let sum = w.iter().zip(&waves).fold((0.0, 0.0), along);
            sum.0 * sum.0 + sum.1 * sum.1
        };
        let power = weighed.iter().map(of).sum();
        for ((sin, cos), (by_sin, by_cos)) in waves.iter_mut().zip(&steps) {
            (*sin, *cos) = (*sin * by_cos + *cos * by_sin, *cos * by_cos - *sin * by_sin);
        }
        power
    };
    multiples.map(next).collect()
}

/// Σ⁻¹ r of each axis of a sensor, r what baseline and set leave.
fn weighed_residual(
    linear: &Linearisation<'_>,
    set: &[&'static Effect],
    precisions: &[ChannelPrecision],
    kind: SensorKind,
) -> Option<Vec<DVector<f64>>> {
    let fitted = linear.fitted(set);
    let amounts = linear.design.normal(precisions, &fitted).amounts()?;
    let channels = linear.design.channels.iter().zip(precisions).filter(|(channel, _)| channel.kind == kind);
    let left = channels.map(|(channel, precision)| {
        let residual = channel.less(&fitted, &amounts);
        DVector::from_vec(precision.apply(residual.as_slice()))
    });
    Some(left.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_are_those_of_their_definition() {
        let times: Vec<f64> = (0..50).map(|k| 0.1 * f64::from(k) + 0.03 * f64::from(k % 3)).collect();
        let weighed = [3.0, 5.0].map(|f| DVector::from_fn(50, |k, _| (f * k as f64).sin()));
        let found = powers(&weighed, &times, 0.6, 7..7 + RUN);
        for (at, found) in found.into_iter().enumerate() {
            let sum = |w: &DVector<f64>, of: fn(f64) -> f64| -> f64 {
                times.iter().zip(w.iter()).map(|(time, w)| w * of(0.6 * (7 + at) as f64 * time)).sum()
            };
            let expected: f64 =
                weighed.iter().map(|w| sum(w, f64::cos).powi(2) + sum(w, f64::sin).powi(2)).sum();
            assert!((found - expected).abs() < 1e-9 * expected.max(1.0), "{at}: {found} {expected}");
        }
    }
}
