//! How much a machine shakes a sensor, block by block: vibration that no simulator has is noise, which comes and goes with
//! the movement.
//!
//! ```text
//! v = ⟨|e_{k+1} − e_k|²⟩ / ⟨…⟩ usual      e: recorded less simulated, sample by sample
//! ```
//!
//! The usual is the median over the blocks at rest and over those in motion, each for its own, so that white noise is
//! estimated as if nothing shook, and a block weighs by its samples over v. Not modelled: noise that is alike from one
//! sample to the next, which white noise of blocks holds.

use nalgebra::Vector3;

use super::{block::Block, forward_model::ForwardModel};
use crate::{
    diagnosis::error::DiagnosisError,
    recording::{SensorKind, median},
    simulator::Dose,
};

/// So many blocks to each side are averaged, no further away than this, s.
const SIDE: usize = 2;
const NEAR: f64 = 0.6;
/// Blocks are alike where nine in ten are below so many times the tenth.
const ALIKE: f64 = 1.6;
/// A block counts no more than so many times its samples, and no less than this share.
const BOUNDS: (f64, f64) = (0.25, 1e4);

/// Variance of a sample in each block against the usual one, by sensor; `None` where all are alike. The simulator is given
/// these effects.
pub fn ratios(scene: &ForwardModel<'_>, doses: &[Dose]) -> Result<[Option<Vec<f64>>; 3], DiagnosisError> {
    let mut ratios: [Option<Vec<f64>>; 3] = Default::default();
    for (kind, output) in scene.simulated(doses)? {
        let Some(triple) = scene.recording.sensor(kind) else { continue };
        let left: Vec<Vector3<f64>> =
            triple.values.iter().zip(&output).map(|(real, ideal)| real - ideal).collect();
        ratios[kind as usize] = of_sensor(scene, kind, &left);
    }
    Ok(ratios)
}

fn of_sensor(scene: &ForwardModel<'_>, kind: SensorKind, left: &[Vector3<f64>]) -> Option<Vec<f64>> {
    let usable = &scene.usable[kind as usize];
    let steps = |block: &Block| {
        let rows: Vec<usize> = block.rows.clone().filter(|row| usable[*row]).collect();
        let step = |pair: &[usize]| (left[pair[1]] - left[pair[0]]).norm_squared();
        rows.windows(2).fold((0.0, 0.0), |(sum, count), pair| (sum + step(pair), count + 1.0))
    };
    let own: Vec<(f64, f64)> = scene.blocks.iter().map(steps).collect();
    let mean = |at: usize| {
        let block = &scene.blocks[at];
        let about = at.saturating_sub(SIDE)..(at + SIDE + 1).min(own.len());
        let alike = about.filter(|other| {
            let other = &scene.blocks[*other];
            other.rest.is_some() == block.rest.is_some() && (other.time - block.time).abs() < NEAR
        });
        let (sum, count) = alike.fold((0.0, 0.0), |(s, n), other| (s + own[other].0, n + own[other].1));
        (count > 0.0).then(|| sum / count)
    };
    let mut levels: Vec<Option<f64>> = (0..own.len()).map(mean).collect();
    for resting in [false, true] {
        let of_state = |at: &usize| scene.blocks[*at].rest.is_some() == resting;
        let own: Vec<usize> = (0..levels.len()).filter(of_state).collect();
        let Some(usual) =
            median(own.iter().filter_map(|at| levels[*at]).collect()).filter(|usual| *usual > 0.0)
        else {
            continue;
        };
        own.iter().for_each(|at| levels[*at] = levels[*at].map(|level| level / usual));
    }
    let ratios: Vec<f64> =
        levels.into_iter().map(|level| level.unwrap_or(1.0).clamp(BOUNDS.0, BOUNDS.1)).collect();
    let mut ranked = ratios.clone();
    ranked.sort_by(f64::total_cmp);
    let at = |share: f64| ranked.get((share * ranked.len() as f64) as usize).copied().unwrap_or(1.0);
    (at(0.9) > ALIKE * at(0.1)).then_some(ratios)
}
