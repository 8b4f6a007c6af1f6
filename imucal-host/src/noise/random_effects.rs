//! What the blocks of one channel, or of several, have in common beyond white noise.
//!
//! ```text
//! y = X β + Z u + e      e ~ N(0, D)      u: offsets of stretches ~ N(0, σ²), drift of each channel at knots
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | D | white noise of each block mean |
//! | Z | by how much each random number counts in each block: an offset by its course, drift by straight lines between knots |
//!
//! Nothing here depends on σ or on how large the drifts are ([`super::precision`]): cross-products are computed once for a
//! white noise. Several channels share their offsets; each has a drift of its own. The random numbers are ordered in
//! time, an offset before the knots of the blocks that share it, so that Zᵀ D⁻¹ Z is banded (A. George, J. Liu, Computer
//! Solution of Large Sparse Positive Definite Systems, 1981, ch. 4).
//!
//! The states of a knot are all drifts but the first, and their sum: the blocks see the sum alone, so that few rows of the
//! factor are long.
//!
//! Not modelled: drift within the distance of two knots, drift that channels share.

use std::{iter, ops::Range, sync::Arc};

use nalgebra::DMatrix;

use super::{
    knots::{Knots, Row, Spacing},
    skyline::Skyline,
    sparse_rows::SparseRows,
    symmetric_product::{add_upper, by_columns},
};

/// Blocks that are multiplied at a time: few enough to stay in a processor's cache.
const PART: usize = 512;

/// One channel: what one axis of a sensor reads.
#[derive(Clone, Debug)]
pub struct ChannelBlocks {
    /// Inverse white variance of each block, zero where it holds nothing.
    pub weights: Vec<f64>,
    /// By how much each offset counts in each block.
    pub offsets: SparseRows,
}

/// D⁻¹ and Z of some channels.
#[derive(Clone, Debug)]
pub struct RandomEffects {
    channels: Vec<Rows>,
    /// The random numbers.
    pub states: Arc<States>,
}

/// The random numbers of some channels, in the order of their elimination: all that a covariance needs of them, a
/// small part of what the rows of Z take.
#[derive(Clone, Debug)]
pub struct States {
    channels: usize,
    /// Drifts of a channel.
    pub(super) processes: usize,
    /// Knots of the drifts; their rows are in Z.
    pub(super) knots: Spacing,
    /// The first state of each knot.
    pub(super) of_knots: Vec<usize>,
    /// The state of each offset.
    pub(super) offsets: Vec<usize>,
    /// Zᵀ D⁻¹ Z, with room for the precision of the drifts.
    pub(super) gram: Skyline,
    /// ln |D|, over blocks that hold something.
    pub(super) log_determinant: f64,
}

/// D⁻¹ and Z of one channel.
#[derive(Clone, Debug)]
struct Rows {
    weights: Vec<f64>,
    z: SparseRows,
}

/// Cross-products of columns with themselves and with the random effects.
#[derive(Clone, Debug)]
pub struct CrossProducts {
    /// The random numbers.
    pub effects: Arc<States>,
    /// Xᵀ D⁻¹ X.
    pub plain: DMatrix<f64>,
    /// Xᵀ D⁻¹ Z, a column a state.
    pub states: DMatrix<f64>,
}

/// Columns of a channel, block by block; one without a value is zero.
pub type Columns<'a> = Vec<&'a [f64]>;

impl RandomEffects {
    /// From the knots of the blocks; the channels; and the number of offsets and of a channel's drifts.
    pub fn new(knots: Knots, channels: Vec<ChannelBlocks>, offsets: usize, processes: usize) -> Self {
        let (of_knots, offsets) = states(&knots, &channels, offsets, channels.len() * processes);
        let rows = |(at, channel): (usize, ChannelBlocks)| {
            let entries = |(block, row): (usize, _)| {
                let shared = channel.offsets.row(block).map(|(offset, u)| (offsets[offset], u));
                drift_entries(row, &of_knots, at * processes, processes).chain(shared)
            };
            let count = knots.rows().iter().enumerate().map(|row| entries(row).count()).sum();
            let mut z = SparseRows::with_capacity(knots.rows().len(), count);
            knots.rows().iter().enumerate().for_each(|row| z.push(entries(row)));
            Rows { weights: channel.weights, z }
        };
        let channels: Vec<Rows> = channels.into_iter().enumerate().map(rows).collect();
        let mut gram = Skyline::new(envelope(&channels, &of_knots, &offsets, processes));
        for (weight, row) in channels.iter().flat_map(Rows::iter).filter(|(weight, _)| *weight > 0.0) {
            for (at, (one, a)) in row.clone().enumerate() {
                row.clone().take(at + 1).for_each(|(other, b)| gram.add(one, other, weight * a * b));
            }
        }
        let weights = channels.iter().flat_map(|rows| &rows.weights);
        let log_determinant = weights.filter(|w| **w > 0.0).map(|w| -w.ln()).sum();
        let (knots, count) = (knots.spacing, channels.len());
        let states = States { channels: count, processes, knots, of_knots, offsets, gram, log_determinant };
        Self { channels, states: Arc::new(states) }
    }

    /// Of some columns, channel by channel.
    pub fn cross_products(&self, columns: &[Columns<'_>]) -> CrossProducts {
        let count = columns.first().map_or(0, Vec::len);
        let mut products = CrossProducts::zeros(&self.states, count);
        for (rows, columns) in self.channels.iter().zip(columns) {
            rows.for_each_part(columns, |part, weighted, x| products.add(rows, part, weighted, x));
        }
        products.complete()
    }

    /// Of some columns of a single channel, and Fᵀ D⁻¹ X of these with others, which are given in parts.
    pub fn cross_products_with(
        &self,
        columns: &Columns<'_>,
        others: &[DMatrix<f64>],
    ) -> (CrossProducts, DMatrix<f64>) {
        let mut products = CrossProducts::zeros(&self.states, columns.len());
        let mut across = DMatrix::zeros(columns.len(), others.first().map_or(0, DMatrix::ncols));
        for rows in &self.channels {
            let mut others = others.iter();
            rows.for_each_part(columns, |part, weighted, x| {
                if let Some(other) = others.next() {
                    across.rows_mut(0, weighted.nrows()).gemm(1.0, weighted, other, 1.0);
                }
                products.add(rows, part, weighted, x);
            });
        }
        (products.complete(), across)
    }

    /// D⁻¹ (x − Z u) of one column of a single channel; puts it in the place of x.
    pub(super) fn weighted_remainder(&self, u: &[f64], x: &mut [f64]) {
        for (x, (weight, row)) in x.iter_mut().zip(self.channels.iter().flat_map(Rows::iter)) {
            let shared: f64 = row.map(|(state, z)| z * u[state]).sum();
            *x = weight * (*x - shared);
        }
    }
}

impl States {
    /// Number of random numbers.
    pub fn count(&self) -> usize {
        self.gram.size()
    }

    /// Those of all drifts.
    pub(super) fn of_drifts(&self) -> impl Iterator<Item = usize> {
        let width = self.channels * self.processes;
        self.of_knots.iter().flat_map(move |knot| *knot..knot + width)
    }

    /// Whether blocks share more than drift.
    pub fn has_offsets(&self) -> bool {
        !self.offsets.is_empty()
    }
}

impl Rows {
    /// Hears of some blocks at a time, so that no copy of all columns is held: (D⁻¹X)ᵀ and X over them. Columns that have not
    /// begun there, and have none behind them that has, are left out: those of effects with an instant come in its order.
    fn for_each_part(
        &self,
        columns: &Columns<'_>,
        mut hear: impl FnMut(Range<usize>, &DMatrix<f64>, &DMatrix<f64>),
    ) {
        let begins = |column: &&[f64]| column.iter().position(|value| *value != 0.0).unwrap_or(usize::MAX);
        let begins: Vec<usize> = columns.iter().map(begins).collect();
        for from in (0..self.weights.len()).step_by(PART) {
            let part = from..(from + PART).min(self.weights.len());
            let begun = begins.iter().rposition(|begins| *begins < part.end).map_or(0, |last| last + 1);
            let x = gathered(&columns[..begun], part.clone());
            let mut weighted = x.transpose();
            weighted.column_iter_mut().zip(&self.weights[part.clone()]).for_each(|(mut row, w)| row *= *w);
            hear(part, &weighted, &x);
        }
    }

    fn iter(&self) -> impl Iterator<Item = (f64, impl Iterator<Item = (usize, f64)> + Clone)> {
        self.weights.iter().enumerate().map(|(block, weight)| (*weight, self.z.row(block)))
    }
}

/// Columns in parts, for [`RandomEffects::cross_products_with`].
pub fn in_parts(columns: &Columns<'_>, blocks: usize) -> Vec<DMatrix<f64>> {
    (0..blocks).step_by(PART).map(|from| gathered(columns, from..(from + PART).min(blocks))).collect()
}

/// Some blocks of columns.
fn gathered(columns: &[&[f64]], part: Range<usize>) -> DMatrix<f64> {
    let mut x = DMatrix::zeros(part.len(), columns.len());
    for (mut to, column) in x.column_iter_mut().zip(columns).filter(|(_, column)| !column.is_empty()) {
        to.copy_from_slice(&column[part.clone()]);
    }
    x
}

impl CrossProducts {
    fn zeros(effects: &Arc<States>, count: usize) -> Self {
        Self {
            effects: Arc::clone(effects),
            plain: DMatrix::zeros(count, count),
            states: DMatrix::zeros(count, effects.count()),
        }
    }

    /// Adds some blocks of a channel's first columns, of D⁻¹X those on and above the diagonal.
    fn add(&mut self, rows: &Rows, part: Range<usize>, weighted: &DMatrix<f64>, x: &DMatrix<f64>) {
        let (all, count) = (self.plain.ncols(), x.ncols());
        let states = self.states.as_mut_slice();
        for (block, row) in part.zip(weighted.as_slice().chunks_exact(count.max(1))) {
            for (state, z) in rows.z.row(block) {
                let own = &mut states[state * all..(state + 1) * all];
                own.iter_mut().zip(row).for_each(|(own, value)| *own += z * value);
            }
        }
        let (weighted, x) = (by_columns(weighted.as_slice(), count), by_columns(x.as_slice(), x.nrows()));
        add_upper(&mut self.plain.view_mut((0, 0), (count, count)), 1.0, &weighted, &x);
    }

    /// With what is below the diagonal.
    fn complete(mut self) -> Self {
        self.plain.fill_lower_triangle_with_upper_triangle();
        self
    }

    /// Some of the columns, by their place.
    pub fn picked(&self, places: &[usize]) -> Self {
        let rows = |matrix: &DMatrix<f64>| matrix.select_rows(places);
        Self {
            effects: Arc::clone(&self.effects),
            plain: rows(&self.plain).select_columns(places),
            states: rows(&self.states),
        }
    }
}

/// The states of a channel's drifts that a block counts; `first` is the channel's first at a knot. A knot's last state is
/// the sum of the drifts, the others are all drifts but the first.
fn drift_entries(
    row: &Row,
    of_knots: &[usize],
    first: usize,
    processes: usize,
) -> impl Iterator<Item = (usize, f64)> {
    let ends = [(row.knot, row.weights[0]), (row.knot + 1, row.weights[1])];
    ends.into_iter().take(2 * processes.min(1)).flat_map(move |(knot, weight)| {
        let start = of_knots[knot] + first;
        let more = row.more.iter().enumerate().map(move |(drift, more)| (start + drift, *more));
        more.chain([(start + processes - 1, weight)])
    })
}

/// The first state of each knot and the state of each offset, in time; `width` states belong to a knot.
fn states(
    knots: &Knots,
    channels: &[ChannelBlocks],
    offsets: usize,
    width: usize,
) -> (Vec<usize>, Vec<usize>) {
    let mut before = vec![knots.spacing.count - 1; offsets];
    for channel in channels {
        for (block, row) in knots.rows().iter().enumerate() {
            let shared = channel.offsets.row(block);
            shared.for_each(|(offset, _)| before[offset] = before[offset].min(row.knot));
        }
    }
    let mut ordered: Vec<usize> = (0..offsets).collect();
    ordered.sort_by_key(|offset| before[*offset]);
    let mut of_offsets = vec![0; offsets];
    let (mut of_knots, mut state, mut next) =
        (Vec::with_capacity(knots.spacing.count), 0, ordered.iter().peekable());
    for knot in 0..knots.spacing.count {
        for offset in iter::from_fn(|| next.next_if(|offset| before[**offset] == knot)) {
            of_offsets[*offset] = state;
            state += 1;
        }
        of_knots.push(state);
        state += width;
    }
    (of_knots, of_offsets)
}

/// The first state that each state meets, in a block or in the precision of the drifts.
fn envelope(channels: &[Rows], knots: &[usize], offsets: &[usize], processes: usize) -> Vec<usize> {
    let width = channels.len() * processes;
    let mut first: Vec<usize> = (0..knots.len() * width + offsets.len()).collect();
    for (knot, start) in knots.iter().enumerate() {
        let before = knots[knot.saturating_sub(1)];
        for state in 0..width {
            first[start + state] = before + state / processes * processes;
        }
    }
    for (_, row) in channels.iter().flat_map(Rows::iter) {
        let lowest = row.clone().map(|(state, _)| state).min().unwrap_or(0);
        row.for_each(|(state, _)| first[state] = first[state].min(lowest));
    }
    first
}
