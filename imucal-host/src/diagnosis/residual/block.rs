//! Stretches of rows that are averaged: what the diagnosis looks at instead of samples.
//!
//! A block is short while a gimbal moves, so that nothing brisk is averaged away, and longer at rest. Blocks of one rest
//! share a group, since the table stands a little off its encoders for as long as it stands.

use std::ops::Range;

use nalgebra::Vector3;

/// Longest block while a gimbal moves, s.
const MOVING: f64 = 0.1;
/// Longest block at rest, s.
const RESTING: f64 = 0.5;
/// A rest of a single group lasts no longer, s: the group's offset may creep.
const LONGEST_REST: f64 = 10.0;

/// Consecutive rows that are averaged.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// Its rows.
    pub rows: Range<usize>,
    /// Middle of its rows, s.
    pub time: f64,
    /// Number of the rest that it belongs to; `None` in motion.
    pub rest: Option<usize>,
}

/// Block means of each sensor, by [`SensorKind::ALL`](crate::recording::SensorKind::ALL); `None` without the sensor.
pub type Means = [Option<Vec<Vector3<f64>>>; 3];

/// Cuts rows into blocks; `moves` tells where a gimbal does. `interval` is the usual one between rows, s; a gap of more than five of them ends a block.
pub fn cut(time: &[f64], moves: &[bool], interval: f64) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    let (mut from, mut rest, mut rest_from) = (0, 0, 0.0);
    for row in 1..=time.len() {
        let longest = if moves[from] { MOVING } else { RESTING };
        let ends = row == time.len()
            || moves[row] != moves[from]
            || time[row] - time[row - 1] > 5.0 * interval
            || time[row] - time[from] > longest - 0.5 * interval;
        if !ends {
            continue;
        }
        let resting = !moves[from];
        let goes_on =
            blocks.last().is_some_and(|b| b.rest.is_some()) && time[from] - rest_from < LONGEST_REST;
        if resting && !goes_on {
            (rest, rest_from) = (rest + 1, time[from]);
        }
        blocks.push(Block {
            rows: from..row,
            time: 0.5 * (time[from] + time[row - 1]),
            rest: resting.then_some(rest),
        });
        from = row;
    }
    blocks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_short_in_motion_and_end_where_it_begins() {
        let time: Vec<f64> = (0..300).map(|k| 0.01 * f64::from(k)).collect();
        let moves: Vec<bool> = (0..300).map(|k| k >= 120).collect();
        let blocks = cut(&time, &moves, 0.01);
        assert_eq!(blocks.iter().map(|b| b.rows.len()).sum::<usize>(), 300);
        assert_eq!(blocks[0].rows, 0..50);
        assert_eq!(blocks[2].rows, 100..120);
        assert_eq!(blocks[3].rows, 120..130);
        assert_eq!((blocks[2].rest, blocks[3].rest), (Some(1), None));
    }
}
