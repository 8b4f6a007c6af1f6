//! Cholesky's factor of a symmetric, positive definite matrix within its envelope.
//!
//! ```text
//! A = L Lᵀ      L has no entry left of A's first in each row
//! ```
//!
//! A. George, J. Liu, Computer Solution of Large Sparse Positive Definite Systems (1981), ch. 4. nalgebra's sparse
//! factor lacks the envelope, and a dense one would be zeros for the most part.

use std::ops::Range;

/// Rows that are taken from another at a time, so that it is read and written less often.
const ROWS: usize = 4;

/// A symmetric matrix of which each row is kept from its first entry to the diagonal.
#[derive(Clone, Debug)]
pub struct Skyline {
    first: Vec<usize>,
    /// Where each row begins in `values`, and where the last one ends.
    begins: Vec<usize>,
    values: Vec<f64>,
}

impl Skyline {
    /// Zeros, with room in row i from column `first[i]` ≤ i on.
    pub fn new(first: Vec<usize>) -> Self {
        let mut begins = vec![0];
        for (row, first) in first.iter().enumerate() {
            begins.push(begins[row] + row + 1 - first.min(&row));
        }
        let values = vec![0.0; begins[first.len()]];
        Self { first, begins, values }
    }

    /// Adds to the entry at (row, column) and its mirror; outside of the envelope it is lost, which `debug` refuses.
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        let (row, column) = (row.max(column), row.min(column));
        debug_assert!(column >= self.first[row]);
        self.values[self.begins[row] + column - self.first[row]] += value;
    }

    /// The entries of a row in some columns, none beyond the diagonal and all within the envelope.
    pub fn entries(&mut self, row: usize, columns: Range<usize>) -> &mut [f64] {
        let zero = self.begins[row] - self.first[row];
        &mut self.values[zero + columns.start..zero + columns.end]
    }

    /// Number of its rows.
    pub fn size(&self) -> usize {
        self.first.len()
    }

    /// S A S, S diagonal.
    pub fn scaled(&self, scales: &[f64]) -> Self {
        let mut scaled = self.clone();
        for (row, first) in self.first.iter().enumerate() {
            let own = &mut scaled.values[self.begins[row]..self.begins[row + 1]];
            own.iter_mut().zip(&scales[*first..]).for_each(|(value, scale)| *value *= scale * scales[row]);
        }
        scaled
    }

    /// Factorises in place. `None` where the matrix is not positive definite.
    pub fn factorised(mut self) -> Option<Factor> {
        let mut log_determinant = 0.0;
        for i in 0..self.first.len() {
            let (above, rest) = self.values.split_at_mut(self.begins[i]);
            let (row, from) = (&mut rest[..self.begins[i + 1] - self.begins[i]], self.first[i]);
            for j in from..i {
                let start = self.first[j].max(from);
                let left = &row[start - from..j - from];
                let other = &above[self.begins[j] + start - self.first[j]..self.begins[j + 1]];
                row[j - from] = (row[j - from] - dot(left, other)) / other[j - start];
            }
            let pivot = row[i - from] - dot(&row[..i - from], &row[..i - from]);
            if pivot.is_nan() || pivot <= 0.0 {
                return None;
            }
            row[i - from] = pivot.sqrt();
            log_determinant += pivot.ln();
        }
        Some(Factor { skyline: self, log_determinant })
    }

    /// The entries of a row to the left of the diagonal, and that on it.
    fn row(&self, row: usize) -> (&[f64], f64) {
        let row = &self.values[self.begins[row]..self.begins[row + 1]];
        (&row[..row.len() - 1], row[row.len() - 1])
    }
}

/// A factorised matrix.
#[derive(Clone, Debug)]
pub struct Factor {
    skyline: Skyline,
    /// Natural logarithm of the matrix' determinant.
    pub log_determinant: f64,
}

impl Factor {
    /// Of the identity.
    pub fn identity(size: usize) -> Self {
        let mut skyline = Skyline::new((0..size).collect());
        skyline.values.fill(1.0);
        Self { skyline, log_determinant: 0.0 }
    }

    /// Puts A⁻¹ x in the place of x.
    pub fn solve(&self, x: &mut [f64]) {
        self.forward(x, 1);
        for (i, from) in self.skyline.first.iter().enumerate().rev() {
            let (left, diagonal) = self.skyline.row(i);
            let value = x[i] / diagonal;
            x[i] = value;
            x[*from..i].iter_mut().zip(left).for_each(|(x, a)| *x -= a * value);
        }
    }

    /// Puts L⁻¹ X in the place of X, of which each row has `width` entries.
    pub fn forward(&self, x: &mut [f64], width: usize) {
        for (i, from) in self.skyline.first.iter().enumerate() {
            let (left, diagonal) = self.skyline.row(i);
            let (above, below) = x.split_at_mut(i * width);
            let own = &mut below[..width];
            let above = &above[from * width..];
            let whole = left.len() - left.len() % ROWS;
            for (at, a) in left.chunks_exact(ROWS).enumerate() {
                let rows = &above[at * ROWS * width..(at + 1) * ROWS * width];
                let (first, second) = rows.split_at(2 * width);
                let ((p, q), (r, s)) = (first.split_at(width), second.split_at(width));
                for (own, ((p, q), (r, s))) in own.iter_mut().zip(p.iter().zip(q).zip(r.iter().zip(s))) {
                    *own -= (a[0] * p + a[1] * q) + (a[2] * r + a[3] * s);
                }
            }
            for (a, other) in left[whole..].iter().zip(above[whole * width..].chunks_exact(width.max(1))) {
                own.iter_mut().zip(other).for_each(|(own, other)| *own -= a * other);
            }
            own.iter_mut().for_each(|own| *own /= diagonal);
        }
    }
}

/// Σ a b over the shorter of both, in partial sums that a processor adds side by side.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    const LANES: usize = 8;
    let (a, b) = (&a[..a.len().min(b.len())], &b[..a.len().min(b.len())]);
    let mut sums = [0.0; LANES];
    let (whole, others) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest: f64 = whole.remainder().iter().zip(others.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in whole.zip(others) {
        (0..LANES).for_each(|lane| sums[lane] += a[lane] * b[lane]);
    }
    sums.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn it_solves_as_a_dense_factor_does(
            reach in prop::collection::vec(0usize..6, 20),
            entries in prop::collection::vec(-1.0f64..1.0, 120),
            x in prop::collection::vec(-1.0f64..1.0, 20),
        ) {
            let first: Vec<usize> = reach.iter().enumerate().map(|(row, reach)| row.saturating_sub(*reach)).collect();
            let mut dense = DMatrix::zeros(20, 20);
            let mut skyline = Skyline::new(first.clone());
            let mut entries = entries.into_iter();
            for row in 0..20 {
                for column in first[row]..=row {
                    let value = if row == column { 12.0 } else { entries.next().unwrap_or(0.5) };
                    dense[(row, column)] = value;
                    dense[(column, row)] = value;
                    skyline.add(row, column, value);
                }
            }
            let factor = skyline.factorised().unwrap();
            let expected = dense.clone().lu().solve(&DVector::from_vec(x.clone())).unwrap();
            let mut found = x.clone();
            factor.solve(&mut found);
            prop_assert!((DVector::from_vec(found) - &expected).amax() < 1e-10);
            let mut halves: Vec<f64> = x.iter().flat_map(|x| [*x, -2.0 * x]).collect();
            factor.forward(&mut halves, 2);
            for (one, twice) in [(0, 1.0), (1, 4.0)] {
                let square: f64 = halves.iter().skip(one).step_by(2).map(|y| y * y).sum();
                prop_assert!((square - twice * DVector::from_vec(x.clone()).dot(&expected)).abs() < 1e-9);
            }
            prop_assert!((factor.log_determinant - dense.determinant().ln()).abs() < 1e-9);
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_has_no_factor() {
        let mut skyline = Skyline::new(vec![0, 0]);
        skyline.add(0, 0, 1.0);
        skyline.add(1, 0, 2.0);
        skyline.add(1, 1, 1.0);
        assert!(skyline.factorised().is_none());
    }
}
