//! Rests of the movement that are none for a sensor: a magnet that is brought near while nothing turns.
//!
//! Within such a block samples scatter far beyond their noise, and its mean is no more than that of a passage. A rig's
//! rests are its own; where a hand moves things, those blocks tell nothing that a step or an episode could be held to.

use super::block::Block;
use crate::recording::{Recording, SensorKind, median};

/// Samples scatter by so many times what is usual at rest.
const FAR: f64 = 5.0;

/// Takes the rows of such blocks out of `counts`, usable rows of each block by sensor.
pub fn leave_out(
    recording: &Recording,
    usable: &[Vec<bool>; 3],
    blocks: &[Block],
    counts: &mut [Vec<usize>; 3],
) {
    for kind in SensorKind::ALL {
        let Some(triple) = recording.sensor(kind) else { continue };
        let spread = |block: &Block| -> f64 {
            let rows: Vec<usize> = block.rows.clone().filter(|row| usable[kind as usize][*row]).collect();
            let n = rows.len() as f64;
            let mean = rows.iter().map(|row| triple.values[*row]).sum::<nalgebra::Vector3<f64>>() / n;
            (rows.iter().map(|row| (triple.values[*row] - mean).norm_squared()).sum::<f64>() / n).sqrt()
        };
        let resting = |block: &Block, count: usize| block.rest.is_some() && count > 1;
        let spreads: Vec<Option<f64>> = blocks
            .iter()
            .zip(&counts[kind as usize])
            .map(|(block, count)| resting(block, *count).then(|| spread(block)))
            .collect();
        let Some(usual) = median(spreads.iter().flatten().copied().collect()) else { continue };
        for (count, spread) in counts[kind as usize].iter_mut().zip(spreads) {
            if spread.is_some_and(|spread| spread > FAR * usual) {
                *count = 0;
            }
        }
    }
}
