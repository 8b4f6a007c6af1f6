//! Rows at which a run of signatures is simulated: fewer than were recorded, since a derivative need not hold what a
//! residual must.

use nalgebra::Vector3;

use super::block::Block;

/// Rows at which a run is simulated.
#[derive(Clone, Debug, Default)]
pub struct SamplePoints {
    /// Their times, s.
    pub times: Vec<f64>,
    blocks: Vec<usize>,
}

impl SamplePoints {
    /// So many rows of each block, evenly over it, of those where the movement is known.
    pub fn choose(
        time: &[f64],
        blocks: &[Block],
        count: impl Fn(&Block) -> usize,
        known: impl Fn(usize) -> bool,
    ) -> Self {
        let mut nodes = Self::default();
        for (index, block) in blocks.iter().enumerate() {
            let (rows, count) = (block.rows.len(), count(block).max(1));
            let evenly = (0..count).map(|k| block.rows.start + (2 * k + 1) * rows / (2 * count));
            for row in evenly.filter(|row| known(*row)) {
                nodes.times.push(time[row]);
                nodes.blocks.push(index);
            }
        }
        nodes
    }

    /// Means over the blocks; a block without a node takes the value before it.
    pub fn averaged(&self, values: &[Vector3<f64>], blocks: usize) -> Vec<Vector3<f64>> {
        let mut sums = vec![(Vector3::zeros(), 0.0); blocks];
        for (block, value) in self.blocks.iter().zip(values) {
            sums[*block].0 += value;
            sums[*block].1 += 1.0;
        }
        let mut last = Vector3::zeros();
        sums.iter()
            .map(|(sum, count)| {
                if *count > 0.0 {
                    last = sum / *count;
                }
                last
            })
            .collect()
    }
}
