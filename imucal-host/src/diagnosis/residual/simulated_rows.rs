//! What the simulator puts out at the rows of a recording, and recorded less that, block by block.
//!
//! Rows are simulated in parts of a few blocks, which stay in the processor's cache, unless an effect looks at other rows
//! than its own: then the run is simulated as a whole.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::{
    block::{Block, Means},
    forward_model::ForwardModel,
};
use crate::{
    diagnosis::error::DiagnosisError,
    recording::SensorKind,
    simulator::{Dose, chain::Chain},
};

/// Rows of a part, at least.
const PART: usize = 2048;

/// What sensors put out, row by row.
type Outputs = Vec<(SensorKind, Vec<Vector3<f64>>)>;

impl ForwardModel<'_> {
    /// What the simulator puts out at each row, by sensor.
    ///
    /// # Errors
    ///
    /// [`DiagnosisError::Simulation`], where a triad is singular, and [`DiagnosisError::Formula`], where one has no value.
    pub fn simulated(&self, doses: &[Dose]) -> Result<Outputs, DiagnosisError> {
        let chain = Chain::new(doses);
        let input = chain.inputs(self.motion, &self.recording.time);
        let of = |kind: &SensorKind| Ok((*kind, self.output(&chain, *kind, &input)?));
        self.kinds.par_iter().map(of).collect()
    }

    /// Recorded less simulated, block by block.
    ///
    /// # Errors
    ///
    /// As [`Self::simulated`].
    pub fn residual(&self, doses: &[Dose]) -> Result<Means, DiagnosisError> {
        let chain = Chain::new(doses);
        let parts = if chain.remembers() { vec![&self.cuts[..]] } else { parts(&self.cuts) };
        let of = |blocks: &&[Block]| self.residual_of(&chain, blocks);
        let residuals: Vec<Means> = parts.par_iter().map(of).collect::<Result<_, DiagnosisError>>()?;
        let mut means: Means = Default::default();
        for kind in &self.kinds {
            let of_parts = residuals.iter().filter_map(|part| part[*kind as usize].as_ref());
            means[*kind as usize] = Some(of_parts.flatten().copied().collect());
        }
        Ok(self.seen(means))
    }

    /// That of consecutive blocks.
    fn residual_of(&self, chain: &Chain<'_>, blocks: &[Block]) -> Result<Means, DiagnosisError> {
        let ends = blocks.first().zip(blocks.last());
        let (from, to) = ends.map_or((0, 0), |(first, last)| (first.rows.start, last.rows.end));
        let input = chain.inputs(self.motion, &self.recording.time[from..to]);
        // A sensor's output is let go before the next one's is made: it may be as long as the recording.
        let of = |kind: &SensorKind| {
            let output = self.output(chain, *kind, &input)?;
            Ok((*kind, self.difference(*kind, blocks, &output, from)))
        };
        let differences: Vec<_> = self.kinds.par_iter().map(of).collect::<Result<_, DiagnosisError>>()?;
        let mut means: Means = Default::default();
        differences.into_iter().for_each(|(kind, difference)| means[kind as usize] = difference);
        Ok(means)
    }

    /// Of a sensor's output from a row on.
    fn difference(
        &self,
        kind: SensorKind,
        blocks: &[Block],
        output: &[Vector3<f64>],
        from: usize,
    ) -> Option<Vec<Vector3<f64>>> {
        let sharp = self.acc_as_sharp.as_ref().filter(|_| kind == SensorKind::Acc);
        let samples = sharp.unwrap_or(&self.recording.sensor(kind)?.values);
        let usable = &self.usable[kind as usize];
        let mean = |block: &Block| {
            let mut sum = Vector3::zeros();
            let mut count = 0.0;
            for row in block.rows.clone().filter(|row| usable[*row]) {
                sum += samples[row] - output[row - from];
                count += 1.0;
            }
            if count > 0.0 { sum / count } else { sum }
        };
        Some(blocks.iter().map(mean).collect())
    }
}

/// Consecutive blocks, those of a part together.
fn parts(blocks: &[Block]) -> Vec<&[Block]> {
    let mut parts = Vec::new();
    let mut first = 0;
    for (at, block) in blocks.iter().enumerate() {
        if block.rows.end - blocks[first].rows.start >= PART || at + 1 == blocks.len() {
            parts.push(&blocks[first..=at]);
            first = at + 1;
        }
    }
    parts
}
