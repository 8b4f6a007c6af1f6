//! A beat that a residual may follow: the period that stands out most from its neighbours.
//!
//! ```text
//! P(f) = |Σ w e^{2πift}|²      w = Σ⁻¹ r, block by block, f = k / 2T; over the axes of a sensor
//! ```
//!
//! Against the median of its neighbours, since noise that is taken for drift is not alike at all frequencies. Not looked
//! for: periods shorter than a few blocks, and those so long that half-waves of the recording follow them.

use std::f64::consts::TAU;

use nalgebra::DVector;
use rayon::prelude::*;

use super::covariate::{Covariate, Function};
use crate::{
    diagnosis::{mixed_model::precision::Precision, search::linearisation::Linearisation},
    effect::Effect,
    recording::{SensorKind, median},
};

/// Shortest period, s.
const SHORTEST: f64 = 4.0;
/// Lowest frequency, half-waves in the recording.
const LOWEST: usize = 7;
/// Neighbours to each side.
const ABOUT: usize = 12;
/// A peak this many times as high as its neighbours is looked at.
const PEAK: f64 = 12.0;

/// The beat of a sensor that stands out most, if any does, and among how many it was looked for.
pub fn beat(
    linear: &Linearisation<'_>,
    set: &[&'static Effect],
    precisions: &[Precision],
    kind: SensorKind,
) -> Option<(Covariate, usize)> {
    let weighed = weighed_residual(linear, set, precisions, kind)?;
    let times: Vec<f64> = linear.scene.blocks.iter().map(|block| block.time).collect();
    let duration = linear.scene.duration();
    let last = (2.0 * duration / SHORTEST) as usize;
    let power = |half_waves: usize| -> f64 {
        let turn = 0.5 * TAU * half_waves as f64 / duration;
        let waves: Vec<(f64, f64)> = times.iter().map(|time| libm::sincos(turn * time)).collect();
        let of = |w: &DVector<f64>| {
            let along = |(c, s), (w, (sin, cos)): (&f64, &(f64, f64))| (c + w * cos, s + w * sin);
            let sum = w.iter().zip(&waves).fold((0.0, 0.0), along);
            sum.0 * sum.0 + sum.1 * sum.1
        };
        weighed.iter().map(of).sum()
    };
    let powers: Vec<f64> = (LOWEST..last).into_par_iter().map(power).collect();
    let height = |at: usize| {
        let about = at.saturating_sub(ABOUT)..(at + ABOUT + 1).min(powers.len());
        powers[at] / median(powers[about].to_vec()).unwrap_or(f64::INFINITY).max(f64::MIN_POSITIVE)
    };
    let (most, highest) = (0..powers.len()).map(|at| (at, height(at))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    if highest < PEAK {
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

/// Σ⁻¹ r of each axis of a sensor, r what baseline and set leave.
fn weighed_residual(
    linear: &Linearisation<'_>,
    set: &[&'static Effect],
    precisions: &[Precision],
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
