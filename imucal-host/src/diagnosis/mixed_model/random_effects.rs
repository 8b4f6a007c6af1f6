//! What the blocks of a channel have in common beside white noise, and what columns show of it.
//!
//! ```text
//! x = U t + Z k + e      e ~ N(0, D)
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | D | white noise of each block mean |
//! | t | what a stretch has in common, a number for each way the table may stand off its encoders |
//! | U | their courses |
//! | k | drift at knots |
//! | Z | straight lines between knots |
//!
//! None of it depends on how large t and k are (`whitening`): columns are condensed once, and weighed by as many
//! drifts and scatters as are asked for. Not modelled: drift within the distance of two knots, what the axes of a triad
//! have in common.

use std::{ops::Range, sync::Arc};

use nalgebra::{DMatrix, Matrix3};

use super::symmetric_product;

/// Distance between knots, s.
pub const SPACING: f64 = 2.5;
/// Most courses of a stretch: one for each gimbal.
pub const COURSES: usize = 3;

/// Blocks of one stretch and what they share: random numbers times these courses.
#[derive(Clone, Debug, PartialEq)]
pub struct Shared {
    /// Blocks, consecutive.
    pub blocks: Range<usize>,
    /// A value for each of the blocks, channel's unit; of more than [`COURSES`] the last ones are left out.
    pub courses: Vec<Vec<f64>>,
}

/// Columns that are zero but for a few blocks: for each block their places and values there.
#[derive(Clone, Debug)]
pub struct Sparse {
    /// Number of columns.
    pub count: usize,
    /// Places and values, block by block.
    pub rows: Vec<Vec<(usize, f64)>>,
}

impl Sparse {
    /// None at all.
    pub fn none() -> Self {
        Self { count: 0, rows: Vec::new() }
    }
}

/// A stretch as white noise weighs it. Courses that it does not have are zero.
#[derive(Clone, Debug)]
pub struct Stretch {
    /// Its blocks.
    pub blocks: Range<usize>,
    /// Place of its first course among those of all stretches.
    pub first: usize,
    /// Number of its courses.
    pub count: usize,
    /// U, a row a block.
    pub u: Vec<[f64; COURSES]>,
    /// Uᵀ D⁻¹ U.
    pub gram: Matrix3<f64>,
    /// First knot that its blocks lie beside.
    pub base: usize,
    /// Zᵀ D⁻¹ U over the knots from there on.
    pub beside: Vec<[f64; COURSES]>,
}

/// The blocks of one channel, as white noise weighs them.
#[derive(Clone, Debug)]
pub struct RandomEffects {
    /// Inverse white variance of each block, zero where it holds nothing.
    pub weights: Vec<f64>,
    /// The knot before each block and how far it lies on the way to the next, 0 to 1.
    pub places: Vec<(usize, f64)>,
    /// Number of knots.
    pub knots: usize,
    /// Zᵀ D⁻¹ Z: of each knot with itself and with the next.
    pub between: Vec<(f64, f64)>,
    /// What stretches share.
    pub stretches: Vec<Stretch>,
    /// Number of courses of all stretches.
    pub courses: usize,
    /// ln |D|, over blocks that hold something.
    pub log_determinant: f64,
}

/// Columns of a channel, as white noise weighs them.
#[derive(Clone, Debug)]
pub struct CrossProducts {
    /// The blocks.
    pub latents: Arc<RandomEffects>,
    /// Xᵀ D⁻¹ X.
    pub plain: DMatrix<f64>,
    /// Xᵀ D⁻¹ U, a column for each course of each stretch.
    pub along: DMatrix<f64>,
    /// Xᵀ D⁻¹ Z, a column a knot.
    pub beside: DMatrix<f64>,
}

impl RandomEffects {
    /// From the blocks' times, s, increasing; their inverse white variances; and what stretches share.
    pub fn new(times: &[f64], weights: Vec<f64>, shared: &[Shared]) -> Self {
        let start = times.first().copied().unwrap_or(0.0);
        let length = times.last().copied().unwrap_or(0.0) - start;
        let knots = ((length / SPACING).ceil() as usize + 1).max(2);
        let place = |time: &f64| {
            let at = (time - start) / SPACING;
            let knot = (at.floor() as usize).min(knots - 2);
            (knot, at - knot as f64)
        };
        let places: Vec<(usize, f64)> = times.iter().map(place).collect();
        let mut between = vec![(0.0, 0.0); knots];
        for ((knot, share), w) in places.iter().zip(&weights) {
            between[*knot].0 += w * (1.0 - share) * (1.0 - share);
            between[*knot].1 += w * share * (1.0 - share);
            between[knot + 1].0 += w * share * share;
        }
        let mut courses = 0;
        let stretches = shared
            .iter()
            .filter(|shared| !shared.courses.is_empty())
            .map(|shared| {
                let stretch = Stretch::new(shared, courses, &weights, &places);
                courses += stretch.count;
                stretch
            })
            .collect();
        let log_determinant = weights.iter().filter(|w| **w > 0.0).map(|w| -w.ln()).sum();
        Self { weights, places, knots, between, stretches, courses, log_determinant }
    }

    /// (D⁻¹X)ᵀ.
    pub fn weighted(&self, x: &DMatrix<f64>) -> DMatrix<f64> {
        let mut weighted = x.transpose();
        for (mut row, w) in weighted.column_iter_mut().zip(&self.weights) {
            row *= *w;
        }
        weighted
    }

    /// Some columns over the blocks.
    pub fn condensed(self: &Arc<Self>, x: &DMatrix<f64>) -> CrossProducts {
        let columns = x.ncols();
        let weighted = self.weighted(x);
        let mut beside = DMatrix::zeros(columns, self.knots);
        for ((knot, share), row) in self.places.iter().zip(weighted.column_iter()) {
            beside.column_mut(*knot).axpy(1.0 - share, &row, 1.0);
            beside.column_mut(knot + 1).axpy(*share, &row, 1.0);
        }
        let mut along = DMatrix::zeros(columns, self.courses);
        for stretch in &self.stretches {
            for (block, u) in stretch.blocks.clone().zip(&stretch.u) {
                for (course, u) in u.iter().enumerate().take(stretch.count) {
                    along.column_mut(stretch.first + course).axpy(*u, &weighted.column(block), 1.0);
                }
            }
        }
        let plain = symmetric_product::with_product(DMatrix::zeros(columns, columns), 1.0, &weighted, x);
        CrossProducts { latents: Arc::clone(self), plain, along, beside }
    }

    /// Sparse columns, and behind them some others.
    pub fn condensed_beside(self: &Arc<Self>, sparse: &Sparse, x: &DMatrix<f64>) -> CrossProducts {
        let dense = self.condensed(x);
        let (n, own) = (sparse.count, x.ncols());
        if n == 0 {
            return dense;
        }
        let mut plain = DMatrix::zeros(n + own, n + own);
        plain.view_mut((n, n), (own, own)).copy_from(&dense.plain);
        let mut beside = DMatrix::zeros(n + own, self.knots);
        beside.rows_mut(n, own).copy_from(&dense.beside);
        let mut along = DMatrix::zeros(n + own, self.courses);
        along.rows_mut(n, own).copy_from(&dense.along);
        let mut across = DMatrix::zeros(own, n);
        let rows = x.transpose();
        let blocks = sparse.rows.iter().zip(self.weights.iter().zip(&self.places));
        for (block, (row, (w, (knot, share)))) in blocks.enumerate() {
            for (place, value) in row {
                beside[(*place, *knot)] += w * value * (1.0 - share);
                beside[(*place, knot + 1)] += w * value * share;
                across.column_mut(*place).axpy(w * value, &rows.column(block), 1.0);
                row.iter().for_each(|(other, also)| plain[(*place, *other)] += w * value * also);
            }
        }
        for stretch in &self.stretches {
            for (block, u) in stretch.blocks.clone().zip(&stretch.u) {
                for (place, value) in &sparse.rows[block] {
                    for (course, u) in u.iter().enumerate().take(stretch.count) {
                        along[(*place, stretch.first + course)] += self.weights[block] * value * u;
                    }
                }
            }
        }
        plain.view_mut((n, 0), (own, n)).copy_from(&across);
        plain.view_mut((0, n), (n, own)).copy_from(&across.transpose());
        CrossProducts { latents: Arc::clone(self), plain, along, beside }
    }
}

impl Stretch {
    fn new(shared: &Shared, first: usize, weights: &[f64], places: &[(usize, f64)]) -> Self {
        let blocks = shared.blocks.clone();
        let course = |course: usize, at: usize| shared.courses.get(course).map_or(0.0, |course| course[at]);
        let u: Vec<[f64; COURSES]> =
            (0..blocks.len()).map(|at| std::array::from_fn(|k| course(k, at))).collect();
        let (weights, places) = (&weights[blocks.clone()], &places[blocks.clone()]);
        let (base, last) = (places[0].0, places[places.len() - 1].0);
        let mut beside = vec![[0.0; COURSES]; last + 2 - base];
        let mut gram = Matrix3::zeros();
        for ((u, w), (knot, share)) in u.iter().zip(weights).zip(places) {
            for (k, one) in u.iter().enumerate() {
                beside[knot - base][k] += w * one * (1.0 - share);
                beside[knot + 1 - base][k] += w * one * share;
                for (l, other) in u.iter().enumerate() {
                    gram[(k, l)] += w * one * other;
                }
            }
        }
        Self { blocks, first, count: shared.courses.len().min(COURSES), u, gram, base, beside }
    }
}

impl CrossProducts {
    /// Some of the columns, by their place.
    pub fn picked(&self, places: &[usize]) -> Self {
        let rows = |matrix: &DMatrix<f64>| matrix.select_rows(places);
        Self {
            latents: Arc::clone(&self.latents),
            plain: rows(&self.plain).select_columns(places),
            along: rows(&self.along),
            beside: rows(&self.beside),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sparse_columns_are_condensed_as_the_same_columns_with_their_zeros() {
        let blocks = 40;
        let times: Vec<f64> = (0..blocks).map(|k| 0.7 * k as f64).collect();
        let weights = (0..blocks).map(|k| 1.0 + (k % 3) as f64).collect();
        let courses = vec![(0..9).map(|k| f64::from(k) - 3.5).collect(), vec![0.4; 9]];
        let latents = Arc::new(RandomEffects::new(&times, weights, &[Shared { blocks: 5..14, courses }]));
        let value = |block: usize, column: usize| (block as f64 + 2.0 * column as f64).sin();
        let held = |block: usize, column: usize| column == block / 10 || column == 3 - block / 10;
        let rows = (0..blocks).map(|block| {
            (0..4)
                .filter(|column| held(block, *column))
                .map(|column| (column, value(block, column)))
                .collect()
        });
        let sparse = Sparse { count: 4, rows: rows.collect() };
        let x = DMatrix::from_fn(blocks, 3, |block, column| value(block, column + 7));
        let whole = DMatrix::from_fn(blocks, 7, |block, column| match column {
            0..4 if held(block, column) => value(block, column),
            0..4 => 0.0,
            _ => x[(block, column - 4)],
        });
        let (found, expected) = (latents.condensed_beside(&sparse, &x), latents.condensed(&whole));
        assert!((found.plain - expected.plain).amax() < 1e-12);
        assert!((found.along - expected.along).amax() < 1e-12);
        assert!((found.beside - expected.beside).amax() < 1e-12);
    }
}
