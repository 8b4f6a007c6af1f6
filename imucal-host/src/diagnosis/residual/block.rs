//! Stretches of rows that are averaged: what the diagnosis looks at instead of samples.
//!
//! A block is short while a gimbal moves, so that nothing brisk is averaged away, and longer at rest. Blocks of one rest
//! share a group, since the table stands a little off its encoders for as long as it stands.

use std::ops::Range;

use nalgebra::Vector3;

use crate::diagnosis::settings::ResidualSettings;

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

/// Cuts rows into blocks as [`cut`] does, into longer ones where there would be too many.
pub fn cut_at_most(time: &[f64], moves: &[bool], interval: f64, by: &ResidualSettings) -> Vec<Block> {
    let blocks = cut(time, moves, interval, by);
    if blocks.len() <= by.most_blocks {
        return blocks;
    }
    let longer = blocks.len() as f64 / by.most_blocks as f64;
    let (moving_block, resting_block) = (longer * by.moving_block, longer * by.resting_block);
    cut(time, moves, interval, &ResidualSettings { moving_block, resting_block, ..by.clone() })
}

/// Cuts rows into blocks; `moves` says where a gimbal does. `interval` is the usual one between rows, s; a gap of more than five of them ends a block.
pub fn cut(time: &[f64], moves: &[bool], interval: f64, by: &ResidualSettings) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    let (mut from, mut rest, mut rest_from) = (0, 0, 0.0);
    for row in 1..=time.len() {
        let longest = if moves[from] { by.moving_block } else { by.resting_block };
        let ends = row == time.len()
            || moves[row] != moves[from]
            || time[row] - time[row - 1] > 5.0 * interval
            || time[row] - time[from] > longest - 0.5 * interval;
        if !ends {
            continue;
        }
        let resting = !moves[from];
        let goes_on =
            blocks.last().is_some_and(|b| b.rest.is_some()) && time[from] - rest_from < by.longest_rest;
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
    use crate::diagnosis::settings::Settings;

    #[test]
    fn blocks_of_a_recording_that_would_have_too_many_are_longer() {
        let time: Vec<f64> = (0..10_000).map(|k| 0.01 * f64::from(k)).collect();
        let by = ResidualSettings { most_blocks: 250, ..Settings::default().residual };
        let blocks = cut_at_most(&time, &vec![true; 10_000], 0.01, &by);
        assert!((200..=250).contains(&blocks.len()), "{}", blocks.len());
        assert_eq!(blocks.iter().map(|b| b.rows.len()).sum::<usize>(), 10_000);
        let few = ResidualSettings { most_blocks: 1000, ..by };
        assert_eq!(cut_at_most(&time, &vec![true; 10_000], 0.01, &few).len(), 1000);
    }

    #[test]
    fn blocks_are_short_in_motion_and_end_where_it_begins() {
        let time: Vec<f64> = (0..300).map(|k| 0.01 * f64::from(k)).collect();
        let moves: Vec<bool> = (0..300).map(|k| k >= 120).collect();
        let blocks = cut(&time, &moves, 0.01, &Settings::default().residual);
        assert_eq!(blocks.iter().map(|b| b.rows.len()).sum::<usize>(), 300);
        assert_eq!(blocks[0].rows, 0..50);
        assert_eq!(blocks[2].rows, 100..120);
        assert_eq!(blocks[3].rows, 120..130);
        assert_eq!((blocks[2].rest, blocks[3].rest), (Some(1), None));
    }
}
