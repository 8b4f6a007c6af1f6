//! Turns: the gyroscope's samples from inside one rest to inside the next, compressed to blocks.
//!
//! A rest ends where motion is seen, not where it begins; a turn that is cut there loses its slow start and end,
//! and the gyroscope's gain comes out 2 to 4 % wrong. So a turn begins a margin before its first rest ends and
//! ends a margin after its second begins.

use std::ops::Range;

use imucal_core::observation::{Block, Durations, Turn};
use nalgebra::{Matrix3, Vector3};

use crate::recording::Series;

use super::{
    block_change::BlockChange,
    compression,
    compression::{Compressed, is_jump},
};

/// Samples a block. Five at 100 Hz differ from the product over samples by about 1e-5° in 100 s (models.md 3).
pub const BLOCK: u16 = 5;
/// How far into a rest a turn reaches, s; a quarter of the rest where that is shorter.
pub const MARGIN: f64 = 0.25;

/// A turn's blocks, owned.
#[derive(Clone, Debug)]
pub struct TurnData {
    /// Index of the rest before, among the segmentation's.
    pub rest_before: usize,
    /// Index of the rest after.
    pub rest_after: usize,
    /// Rows whose rates were integrated.
    pub rows: Range<usize>,
    /// The bias they were taken less of.
    pub bias: BiasPath,
    blocks: Vec<Block<f64>>,
    durations: Vec<f64>,
}

impl TurnData {
    /// The turn between two known directions, calibrated axes.
    pub fn between(&self, before: Vector3<f64>, after: Vector3<f64>) -> Turn<'_, f64> {
        Turn { blocks: &self.blocks, durations: Durations::Each(&self.durations), before, after }
    }

    /// Sum of the rates' integrals, bias taken off, rad, nominal: near to the rotation vector of a turn about one axis.
    pub fn angle(&self) -> Vector3<f64> {
        self.blocks.iter().map(|block| block.s0).sum()
    }

    /// The same turn with its rates, bias taken off, multiplied: s0 and s1 by the matrix, c by its cofactors.
    pub fn stretched(mut self, stretch: &Matrix3<f64>) -> Self {
        self.blocks.iter_mut().for_each(|block| *block = compression::stretched(block, stretch));
        self
    }

    /// Blocks and durations as a device holds them.
    pub fn narrow(&self) -> (Vec<Block<f32>>, Vec<f32>) {
        let blocks = self.blocks.iter().map(|b| Block { s0: b.s0.cast(), s1: b.s1.cast(), c: b.c.cast() });
        (blocks.collect(), self.durations.iter().map(|d| *d as f32).collect())
    }
}

/// The gyroscope's bias as it wanders from rest to rest: linear between the middles of two rests, rad/s.
#[derive(Clone, Copy, Debug)]
pub struct BiasPath {
    /// Middle of the rest before, s, and its mean rate.
    pub before: (f64, Vector3<f64>),
    /// The same of the rest after.
    pub after: (f64, Vector3<f64>),
}

impl BiasPath {
    /// Bias at a time, rad/s.
    pub fn at(&self, time: f64) -> Vector3<f64> {
        let share = (time - self.before.0) / (self.after.0 - self.before.0);
        self.before.1 + (self.after.1 - self.before.1) * share
    }
}

/// Why a turn is left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TurnGap {
    /// Samples are missing, saturated or stuck in it.
    Unusable {
        /// First such row.
        row: usize,
    },
    /// Time jumps in it.
    Jump {
        /// Row after the jump.
        row: usize,
    },
    /// No encoder or reference gives the attitude in it.
    NoAttitude {
        /// First row without one.
        row: usize,
    },
}

impl std::fmt::Display for TurnGap {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Unusable { row } => write!(f, "samples missing, clipped or stuck from row {row}"),
            Self::Jump { row } => write!(f, "time jumps at row {row}"),
            Self::NoAttitude { row } => write!(f, "no attitude is known from row {row}"),
        }
    }
}

/// Rows of the turn between two rests.
fn turn_rows(time: &[f64], before: &Range<usize>, after: &Range<usize>) -> Range<usize> {
    let margin = |rest: &Range<usize>| MARGIN.min(0.25 * (time[rest.end - 1] - time[rest.start]));
    let (leave, arrive) = (time[before.end - 1] - margin(before), time[after.start] + margin(after));
    let first = before.start + time[before.clone()].partition_point(|t| *t < leave);
    let last = after.start + time[after.clone()].partition_point(|t| *t <= arrive);
    first..last
}

/// Compresses the motion between two rests. Rates are taken less the bias path.
///
/// # Errors
/// [`TurnGap`], with the row, where the motion was not wholly recorded.
pub fn compress(
    rates: Series<'_>,
    (rest_before, before, rest_after, after): (usize, &Range<usize>, usize, &Range<usize>),
    bias: &BiasPath,
) -> Result<TurnData, TurnGap> {
    let rows = turn_rows(rates.time, before, after);
    let measured = measured(rates, &rows)?;
    let rate = |k: usize| rates.values[k] - bias.at(rates.time[k]);
    let Compressed { blocks, durations, rows: _ } =
        compression::compress(rates.time, &measured, BLOCK, rate, |_| ());
    Ok(TurnData { rest_before, rest_after, rows, bias: *bias, blocks, durations })
}

/// The samples of some rows that are integrated: those of a dropout are bridged by their neighbours.
///
/// # Errors
/// [`TurnGap`], with the row, where the motion was not wholly recorded.
pub(super) fn measured(rates: Series<'_>, rows: &Range<usize>) -> Result<Vec<usize>, TurnGap> {
    let Series { time, values, usable, interval } = rates;
    let mut measured = Vec::with_capacity(rows.len());
    let mut jumped = None;
    for row in rows.clone().filter(|row| values[*row].iter().all(|w| w.is_finite())) {
        // What was clipped or stuck is not what was turned.
        if !usable[row] {
            return Err(TurnGap::Unusable { row });
        }
        let jumps = measured.last().is_some_and(|before| is_jump(time[row] - time[*before], interval));
        jumped = jumped.or(jumps.then_some(row));
        measured.push(row);
    }
    match jumped {
        _ if measured.len() < 2 => Err(TurnGap::Unusable { row: rows.start }),
        Some(row) => Err(TurnGap::Jump { row }),
        None => Ok(measured),
    }
}

/// The rates of a turn, bias taken off, of which something else may be made.
#[derive(Clone, Debug)]
pub struct TurnSamples {
    /// Rates, rad/s, and how long each is held, s.
    samples: Vec<(Vector3<f64>, f64)>,
}

impl TurnSamples {
    /// Of a turn.
    ///
    /// # Errors
    /// [`TurnGap`], as of [`compress`].
    pub fn of(rates: Series<'_>, turn: &TurnData) -> Result<Self, TurnGap> {
        let measured = measured(rates, &turn.rows)?;
        let sample = |(index, row): (usize, &usize)| {
            let rate = rates.values[*row] - turn.bias.at(rates.time[*row]);
            (rate, compression::held(rates.time, &measured, index))
        };
        Ok(Self { samples: measured.iter().enumerate().map(sample).collect() })
    }

    /// Whether any rate is not zero.
    pub fn moves(&self) -> bool {
        self.samples.iter().any(|(rate, _)| rate.amax() > 0.0)
    }

    /// How each block changes where rates w become w + ε f(w_j) e_j, to first order in ε, by function and axis j.
    pub fn changes<const N: usize>(&self, of: [fn(f64) -> f64; N]) -> Vec<[BlockChange; N]> {
        self.samples.chunks(usize::from(BLOCK)).map(|samples| BlockChange::of(samples, of)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use imucal_core::{model::turn::attitude, triad::Triad};

    #[test]
    fn a_quarter_turn_comes_out_as_one_though_it_starts_and_ends_slowly() {
        let dt = 0.01;
        let time: Vec<f64> = (0..600).map(|k| k as f64 * dt).collect();
        // Rate rises and falls as a raised cosine between 2 s and 4 s; its integral is a quarter turn.
        let rate = |t: f64| {
            if (2.0..4.0).contains(&t) {
                (1.0 - (std::f64::consts::PI * (t - 2.0)).cos()) * std::f64::consts::FRAC_PI_4
            } else {
                0.0
            }
        };
        let bias = Vector3::new(0.01, -0.02, 0.03);
        let gyr: Vec<_> = time.iter().map(|t| bias + Vector3::x() * rate(*t)).collect();
        let usable = vec![true; 600];
        // The rests as a coarse threshold would find them: the turn's ends are cut off.
        let (before, after) = (0..215, 385..600);
        let path = BiasPath { before: (1.0, bias), after: (5.0, bias) };
        let rates = Series { time: &time, values: &gyr, usable: &usable, interval: dt };
        let data = compress(rates, (0, &before, 1, &after), &path).unwrap();
        let turn = data.between(Vector3::z(), Vector3::y());
        let c = attitude(&Triad::identity(), &turn);
        assert!((c.tr_mul(&Vector3::z()) - Vector3::y()).norm() < 2e-4, "{c}");
    }

    #[test]
    fn a_turn_with_a_saturated_row_is_left_out_by_name() {
        let time: Vec<f64> = (0..300).map(|k| f64::from(k) * 0.01).collect();
        let gyr = vec![Vector3::zeros(); 300];
        let mut usable = vec![true; 300];
        usable[150] = false;
        let path = BiasPath { before: (0.5, Vector3::zeros()), after: (2.5, Vector3::zeros()) };
        let rates = Series { time: &time, values: &gyr, usable: &usable, interval: 0.01 };
        let result = compress(rates, (0, &(0..100), 1, &(200..300)), &path);
        assert_eq!(result.unwrap_err(), TurnGap::Unusable { row: 150 });
    }
}
