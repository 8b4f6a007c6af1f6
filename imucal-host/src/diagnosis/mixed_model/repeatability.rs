//! Pointing errors of a table: what the blocks of a stretch have in common because it does not stand where its encoders say.
//!
//! ```text
//! s = Σ_g δ_g u_g      at rest u_g = e_g × v, in motion u_g the simulator's derivative along gimbal g      δ_g ~ N(0, σ²)
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | v | what the sensor is given at rest, mean output |
//! | e_g | three directions at right angles: at rest a single axis cannot distinguish one turn from another |
//! | σ | scatter, rad |
//!
//! A gimbal does not come to rest where its encoder says, and takes some of that along until it rests again. Axis by axis:
//! that the error turns all sensors together, and that a stretch begins where the last one ended, is modelled by
//! `shared_offsets`. Not modelled: that the gyroscope sees it change.

use crate::noise::sparse_rows::SparseRows;
use std::ops::Range;

use nalgebra::Vector3;

use crate::{
    diagnosis::residual::{
        block::Block, forward_model::ForwardModel, gimbal_derivatives::gimbal_derivatives,
    },
    recording::SensorKind,
};

/// One axis of a sensor and what it is given.
pub struct PointingErrors<'a> {
    /// The scene.
    pub scene: &'a ForwardModel<'a>,
    /// The sensor.
    pub kind: SensorKind,
    /// Its axis.
    pub axis: usize,
    /// Mean output of each block.
    pub given: &'a [Vector3<f64>],
}

impl PointingErrors<'_> {
    /// The number of errors, and by how much each counts in each block for a scatter of 1 rad: one for each rest, and one
    /// for each gimbal and stretch of a movement.
    pub fn offsets(&self) -> (usize, SparseRows) {
        let blocks = &self.scene.blocks;
        if self.kind == SensorKind::Gyr || !self.scene.settings.noise.scatters {
            return (0, SparseRows::empty(blocks.len()));
        }
        let (mut count, mut rows) = (0, SparseRows::default());
        for stretch in stretches(blocks, self.scene.settings.noise.longest_stretch) {
            let courses = self.courses(stretch.clone());
            for block in 0..stretch.len() {
                rows.push(courses.iter().enumerate().map(|(course, u)| (count + course, u[block])));
            }
            count += courses.len();
        }
        (count, rows)
    }

    fn courses(&self, blocks: Range<usize>) -> Vec<Vec<f64>> {
        if self.scene.blocks[blocks.start].rest.is_some() {
            let middle = (blocks.start + blocks.end) / 2;
            let given = self.given[middle];
            let across = (given.norm_squared() - given[self.axis].powi(2)).sqrt();
            return vec![vec![across; blocks.len()]];
        }
        let turned = gimbal_derivatives(self.scene).iter();
        let along = turned.filter_map(|means| means[self.kind as usize].as_ref());
        along.map(|means| means[blocks.clone()].iter().map(|u| u[self.axis]).collect()).collect()
    }

    /// Variance that a scatter of 1 rad gives a block.
    pub fn variance(&self, block: usize) -> f64 {
        if self.kind == SensorKind::Gyr || !self.scene.settings.noise.scatters {
            return 0.0;
        }
        self.courses(block..block + 1).iter().map(|course| course[0] * course[0]).sum()
    }
}

/// Blocks that share their pointing errors: a rest, or a part of a movement that lasts no longer than `longest`, s.
pub fn stretches(blocks: &[Block], longest: f64) -> Vec<Range<usize>> {
    let goes_on = |first: &Block, block: &Block| {
        block.rest == first.rest && (block.rest.is_some() || block.time - first.time < longest)
    };
    let (mut stretches, mut from) = (Vec::new(), 0);
    for at in 1..=blocks.len() {
        if at == blocks.len() || !goes_on(&blocks[from], &blocks[at]) {
            stretches.push(from..at);
            from = at;
        }
    }
    stretches
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blocks(count: usize, apart: f64, rest: Option<usize>, after: f64) -> impl Iterator<Item = Block> {
        let time = move |k: usize| after + apart * (k as f64 + 0.5);
        (0..count).map(move |k| Block { rows: k..k + 1, time: time(k), rest })
    }

    #[test]
    fn a_rest_is_a_stretch_and_a_long_movement_is_several() {
        let blocks: Vec<Block> = blocks(6, 0.5, Some(1), 0.0)
            .chain(blocks(500, 0.1, None, 3.0))
            .chain(blocks(4, 0.5, Some(2), 53.0))
            .collect();
        let lengths: Vec<usize> = stretches(&blocks, 20.0).into_iter().map(|blocks| blocks.len()).collect();
        assert_eq!(lengths, [6, 200, 200, 100, 4]);
    }
}
