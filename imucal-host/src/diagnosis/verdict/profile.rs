//! The residual over the driver that a sensor follows most: what a drawing shows of a gap before and after it is explained.
//!
//! Blocks are sorted by the driver and cut into bins of equal count; a bin has the means of both residuals, weighed by samples, and
//! the standard error that the noise of blocks gives them. That drifting noise is alike in neighbouring blocks is not in that error.

use nalgebra::DVector;

use super::shares::{self, Left};
use crate::{
    diagnosis::{
        error::DiagnosisError,
        finding::{Place, Profile, ProfileBin},
        location::{covariate::Covariate, covariates::TIME},
        mixed_model::{design::Channel, noise::Noise},
        search::linearisation::Linearisation,
    },
    effect::{Effect, si},
    recording::SensorKind,
};

/// Bins of a profile, at most.
const BINS: usize = 24;

/// A profile of each sensor that follows something: over what comes first among its places.
///
/// # Errors
///
/// [`DiagnosisError::Score`].
pub fn profiles(
    linear: &Linearisation<'_>,
    set: &[&'static Effect],
    noise: &Noise,
    drivers: &[Covariate],
    places: &[Place],
) -> Result<Vec<Profile>, DiagnosisError> {
    let left = shares::left(linear, set, noise)?;
    let of = |kind: SensorKind| {
        let place = places.iter().find(|place| place.sensor == kind.prefix())?;
        let driver = drivers.iter().find(|driver| driver.name == place.driver)?;
        profile(linear, noise, &left, kind, driver)
    };
    Ok(SensorKind::ALL.into_iter().filter_map(of).collect())
}

fn profile(
    linear: &Linearisation<'_>,
    noise: &Noise,
    left: &[Left],
    kind: SensorKind,
    driver: &Covariate,
) -> Option<Profile> {
    let counts = &linear.scene.counts[kind as usize];
    let weight = |block: usize| counts.get(block).map_or(0.0, |count| *count as f64);
    let channels = || linear.design.channels.iter().zip(left).filter(|(channel, _)| channel.kind == kind);
    let mut most: Option<(f64, usize, &Channel, &Left)> = None;
    for (function, axis) in driver.columns(kind) {
        let Some((channel, left)) = channels().find(|(channel, _)| channel.axis == axis) else { continue };
        let follows = correlation(&driver.functions[function].values, &left.before, &weight).abs();
        if most.is_none_or(|(before, ..)| follows > before) {
            most = Some((follows, function, channel, left));
        }
    }
    let (_, function, channel, left) = most?;
    // Half-waves of the time are for the test; a reader looks at the time.
    let is_time = driver.name == TIME;
    let value = |block: usize| match is_time {
        true => linear.scene.blocks[block].time,
        false => driver.functions[function].values[block],
    };
    let mut blocks: Vec<usize> = (0..left.before.len()).filter(|block| weight(*block) > 0.0).collect();
    blocks.sort_by(|a, b| value(*a).total_cmp(&value(*b)));
    let bin = |blocks: &[usize]| {
        let total: f64 = blocks.iter().map(|block| weight(*block)).sum();
        let mean =
            |of: &dyn Fn(usize) -> f64| blocks.iter().map(|k| weight(*k) * of(*k)).sum::<f64>() / total;
        let variance = |block: usize| weight(block) * linear.weighing.variance(channel, noise, block);
        ProfileBin {
            driver: mean(&value),
            before: mean(&|block| left.before[block]),
            after: mean(&|block| left.after[block]),
            std: (mean(&variance) / total).sqrt(),
        }
    };
    let size = blocks.len().div_ceil(BINS).max(1);
    Some(Profile {
        sensor: kind.prefix().to_owned(),
        axis: linear.scene.axis(kind, channel.axis).to_owned(),
        unit: si(kind),
        driver: driver.name.clone(),
        function: if is_time { "s".to_owned() } else { driver.functions[function].detail.clone() },
        bins: blocks.chunks(size).map(bin).collect(),
    })
}

/// Weighted correlation of a function, which has no mean to speak of, with a residual; zero where there is none.
fn correlation(values: &[f64], residual: &DVector<f64>, weight: &dyn Fn(usize) -> f64) -> f64 {
    let sum = |of: &dyn Fn(usize) -> f64| (0..residual.len()).map(|k| weight(k) * of(k)).sum::<f64>();
    let product = sum(&|k| values[k] * residual[k]);
    let size = sum(&|k| values[k] * values[k]) * sum(&|k| residual[k] * residual[k]);
    if size > 0.0 { product / size.sqrt() } else { 0.0 }
}
