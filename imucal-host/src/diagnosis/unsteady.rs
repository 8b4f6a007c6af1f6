//! Blocks in which something is brought near a sensor or taken away: a magnet, by a hand.
//!
//! At rest samples then scatter far beyond their noise; and what the simulator leaves changes within half a second by far
//! more than it usually does, at rest or in motion. The mean of such a block is no more than that of a passage, and tells
//! nothing that a step or an episode could be held to. A rig's own movement brings nothing near.

use super::{block::Block, scene::Means};
use crate::recording::{Recording, SensorKind, median};

/// Samples scatter by so many times what is usual at rest.
const FAR: f64 = 5.0;

/// What is left changes by so many times what is usual.
const ABRUPT: f64 = 8.0;
/// Within twice this time, s.
const PASSAGE: f64 = 0.25;

/// Takes the rows of blocks during which `residual` changes abruptly out of `counts`, usable rows of each block by sensor.
pub fn leave_out_passages(residual: &Means, blocks: &[Block], counts: &mut [Vec<usize>; 3]) {
    for (values, counts) in residual.iter().zip(counts).filter_map(|(v, c)| Some((v.as_ref()?, c))) {
        let told: Vec<usize> = (0..blocks.len()).filter(|k| counts[*k] > 0).collect();
        let change = |at: usize| -> f64 {
            let time = blocks[told[at]].time;
            let before = told[..at].iter().rev().take_while(|k| time - blocks[**k].time <= PASSAGE).last();
            let after = told[at..].iter().take_while(|k| blocks[**k].time - time <= PASSAGE).last();
            let (before, after) = (before.unwrap_or(&told[at]), after.unwrap_or(&told[at]));
            (values[*after] - values[*before]).norm()
        };
        let changes: Vec<f64> = (0..told.len()).map(change).collect();
        for resting in [true, false] {
            let alike = || (0..told.len()).filter(|at| blocks[told[*at]].rest.is_some() == resting);
            let Some(usual) = median(alike().map(|at| changes[at]).collect()) else { continue };
            alike().filter(|at| changes[*at] > ABRUPT * usual).for_each(|at| counts[told[at]] = 0);
        }
    }
}

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
