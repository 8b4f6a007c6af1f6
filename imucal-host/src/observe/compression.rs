//! Rates compressed to blocks: the one loop behind turns and motions.

use std::ops::Range;

use imucal_core::observation::{Block, BlockBuilder};
use nalgebra::{Matrix3, Vector3};

/// Rates across a gap longer than this many usual intervals are not known.
const GAP: f64 = 5.0;

/// Rows compressed to blocks.
#[derive(Clone, Debug, Default)]
pub struct Compressed {
    /// The blocks.
    pub blocks: Vec<Block<f64>>,
    /// How long each lasts, s.
    pub durations: Vec<f64>,
    /// First row of each, and the one after its last.
    pub rows: Vec<Range<usize>>,
}

/// A sample in its block.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Its rate, rad/s.
    pub rate: Vector3<f64>,
    /// How long it is held, s.
    pub held: f64,
    /// Index of the block it is in.
    pub block: usize,
}

/// The block of the same rates multiplied by a matrix M: M s0, M s1, and cof(M) c.
pub fn stretched(block: &Block<f64>, by: &Matrix3<f64>) -> Block<f64> {
    let [x, y, z] = [0, 1, 2].map(|row| by.row(row).transpose());
    let cofactor = Matrix3::from_rows(&[y.cross(&z), z.cross(&x), x.cross(&y)].map(|row| row.transpose()));
    Block { s0: by * block.s0, s1: by * block.s1, c: cofactor * block.c }
}

/// The block of the same rates with a constant one added for its duration, s.
pub fn shifted(block: &Block<f64>, rate: &Vector3<f64>, duration: f64) -> Block<f64> {
    Block { s0: block.s0 + rate * duration, s1: block.s1, c: block.c + block.s1.cross(rate) }
}

/// Whether a time between samples, s, is a gap in which no rate is known.
pub fn is_jump(step: f64, interval: f64) -> bool {
    step > GAP * interval
}

/// Compresses rows to blocks of `size` samples. `rate` gives that of a row, rad/s; it is held as [`held`] says. `each` is called with
/// each sample in its turn.
pub fn compress(
    time: &[f64],
    rows: &[usize],
    size: u16,
    rate: impl Fn(usize) -> Vector3<f64>,
    each: impl FnMut(Sample),
) -> Compressed {
    let samples = rows.iter().enumerate().map(|(index, row)| (rate(*row), held(time, rows, index)));
    let (blocks, durations) = blocks(samples, size, each);
    let of_block = |rows: &[usize]| rows[0]..rows[rows.len() - 1] + 1;
    Compressed { blocks, durations, rows: rows.chunks(usize::from(size)).map(of_block).collect() }
}

/// How long the sample of one of some rows is held, s: from half-way to the sample before it to half-way to the one after (the
/// trapezoidal rule).
pub fn held(time: &[f64], rows: &[usize], index: usize) -> f64 {
    let row = rows[index];
    let from = if index == 0 { time[row] } else { time[rows[index - 1]] };
    let to = rows.get(index + 1).map_or(time[row], |next| time[*next]);
    0.5 * (to - from)
}

/// Compresses samples, each a rate, rad/s, and how long it is held, s, to blocks of so many, with their durations, s. `each` is called
/// with each sample in its turn.
pub fn blocks(
    samples: impl ExactSizeIterator<Item = (Vector3<f64>, f64)>,
    size: u16,
    mut each: impl FnMut(Sample),
) -> (Vec<Block<f64>>, Vec<f64>) {
    let last = samples.len();
    let count = last / usize::from(size) + 1;
    let (mut blocks, mut durations) = (Vec::with_capacity(count), Vec::with_capacity(count));
    let mut builder = BlockBuilder::default();
    for (index, (rate, held)) in samples.enumerate() {
        builder.push(&rate, held);
        each(Sample { rate, held, block: blocks.len() });
        if builder.count() < size && index + 1 < last {
            continue;
        }
        let (block, duration) = builder.finish();
        blocks.push(block);
        durations.push(duration);
    }
    (blocks, durations)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seven_samples_are_two_blocks_that_last_as_long_as_they() {
        let time: Vec<f64> = (0..8).map(f64::from).collect();
        let mut samples = Vec::new();
        let rate = |row| Vector3::x() * row as f64;
        let all = compress(&time, &[0, 1, 2, 4, 5, 6, 7], 5, rate, |sample| samples.push(sample));
        assert_eq!((all.rows, samples[5].block), (vec![0..6, 6..8], 1));
        assert!((all.durations.iter().sum::<f64>() - 7.0).abs() < 1e-12);
        let turned: f64 = samples.iter().map(|sample| sample.rate.x * sample.held).sum();
        assert!((turned - 24.5).abs() < 1e-12, "{turned}");
    }

    #[test]
    fn a_gap_of_six_intervals_is_one_and_a_dropout_is_none() {
        assert!(is_jump(6.0, 1.0) && !is_jump(5.0, 1.0));
    }
}
