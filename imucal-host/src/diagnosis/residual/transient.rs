//! Blocks in which something is brought near a sensor or taken away: a magnet, by a hand.
//!
//! At rest samples then scatter far beyond their noise; and what the simulator leaves changes within half a second by far
//! more than it usually does, at rest or in motion. The mean of such a block is no more than that of a passage, and shows
//! nothing that a step or an episode could be held to. A rig's own movement brings nothing near.

use nalgebra::Vector3;

use super::block::{Block, Means};
use crate::{
    diagnosis::settings::ResidualSettings,
    recording::{Recording, SensorKind, median},
};

/// Within twice this time, s.
const PASSAGE: f64 = 0.25;
/// Between two abrupt changes no further apart, s, a hand stops on its way: that belongs to the same passage.
const STOP: f64 = 0.5;

/// Takes the rows of blocks in which `residual` changes abruptly, or between two such, out of `counts`, usable rows of
/// each block by sensor.
pub fn leave_out_passages(
    residual: &Means,
    blocks: &[Block],
    by: &ResidualSettings,
    counts: &mut [Vec<usize>; 3],
) {
    for (values, counts) in residual.iter().zip(counts).filter_map(|(v, c)| Some((v.as_ref()?, c))) {
        let measured: Vec<usize> = (0..blocks.len()).filter(|k| counts[*k] > 0).collect();
        let abrupt = abrupt(values, blocks, &measured, by.passage_change);
        let time = |at: usize| blocks[measured[at]].time;
        abrupt.iter().for_each(|at| counts[measured[*at]] = 0);
        for stop in abrupt.windows(2).filter(|pair| time(pair[1]) - time(pair[0]) <= STOP) {
            measured[stop[0]..stop[1]].iter().for_each(|block| counts[*block] = 0);
        }
    }
}

/// Places among the blocks `measured` of those about which a sensor's residual changes abruptly, in their order.
fn abrupt(values: &[Vector3<f64>], blocks: &[Block], measured: &[usize], usual_times: f64) -> Vec<usize> {
    let change = |at: usize| -> f64 {
        let time = blocks[measured[at]].time;
        let before = measured[..at].iter().rev().take_while(|k| time - blocks[**k].time <= PASSAGE).last();
        let after = measured[at..].iter().take_while(|k| blocks[**k].time - time <= PASSAGE).last();
        let (before, after) = (before.unwrap_or(&measured[at]), after.unwrap_or(&measured[at]));
        (values[*after] - values[*before]).norm()
    };
    let changes: Vec<f64> = (0..measured.len()).map(change).collect();
    let rests = |at: &usize| blocks[measured[*at]].rest.is_some();
    let usual = [false, true].map(|resting| {
        // A block with no other near has no change.
        let alike = (0..measured.len()).filter(|at| rests(at) == resting && changes[*at] > 0.0);
        median(alike.map(|at| changes[at]).collect())
    });
    let is_abrupt =
        |at: &usize| usual[usize::from(rests(at))].is_some_and(|usual| changes[*at] > usual_times * usual);
    (0..measured.len()).filter(is_abrupt).collect()
}

/// Takes the rows of such blocks out of `counts`, usable rows of each block by sensor.
pub fn leave_out(
    recording: &Recording,
    usable: &[Vec<bool>; 3],
    blocks: &[Block],
    by: &ResidualSettings,
    counts: &mut [Vec<usize>; 3],
) {
    for kind in SensorKind::ALL {
        let Some(triple) = recording.sensor(kind) else { continue };
        let spread = |block: &Block| -> f64 {
            let rows: Vec<usize> = block.rows.clone().filter(|row| usable[kind as usize][*row]).collect();
            let n = rows.len() as f64;
            let mean = rows.iter().map(|row| triple.values[*row]).sum::<Vector3<f64>>() / n;
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
            if spread.is_some_and(|spread| spread > by.passage_scatter * usual) {
                *count = 0;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::settings::Settings;

    #[test]
    fn a_passage_is_left_out_with_its_stop_and_nothing_far_from_it() {
        let time = |k: usize| 0.1 * k as f64;
        let blocks: Vec<Block> =
            (0..400).map(|k| Block { rows: 3 * k..3 * k + 3, time: time(k), rest: None }).collect();
        // Brought near from 20.0 to 20.4 s, held there, and laid down from 20.8 to 21.2 s.
        let field = |t: f64| 30.0 * (((t - 20.0) / 0.4).clamp(0.0, 1.0) + ((t - 20.8) / 0.4).clamp(0.0, 1.0));
        let noise = |k: usize| 0.5 * ((k * k) as f64).sin();
        let values = (0..400).map(|k| Vector3::new(field(time(k)), noise(k), noise(k + 7))).collect();
        let mut counts = [Vec::new(), Vec::new(), vec![3; 400]];
        leave_out_passages(&[None, None, Some(values)], &blocks, &Settings::default().residual, &mut counts);
        for (k, count) in counts[2].iter().enumerate() {
            match time(k) {
                t if (20.0..21.2).contains(&t) => assert_eq!(*count, 0, "{t}"),
                t if !(19.0..22.2).contains(&t) => assert_eq!(*count, 3, "{t}"),
                _ => {}
            }
        }
    }
}
