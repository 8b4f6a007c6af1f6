//! Whether a fit's residual follows something that the model leaves out: a score test by regression.
//!
//! ```text
//! M = I − J (JᵀJ)⁻¹ Jᵀ,   c = −(Zᵀ M Z)⁻¹ Zᵀ r,   F = (rᵀr − |r + M Z c|²)/q : |r + M Z c|²/(n − p − q)
//! δ = −(JᵀJ)⁻¹ Jᵀ Z c
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | r, J | residuals at the optimum, n of them independent, and their derivatives by the p parameters |
//! | Z | derivatives of the residuals by q further parameters, zero in the model |
//! | F | Fisher–Snedecor (q, n − p − q) where those parameters are zero and the noise is white |
//! | δ | by how much the p parameters would move if the q were estimated with them |
//!
//! The residual itself says how large the noise is, so that no noise is assumed; samples that are alike in time are
//! tested in [blocks](super::blocked_score). Source: Rao 1948. Not modelled: noise that differs from observation to
//! observation, and what the parameters do beyond first order.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::rows::{inverse, parts};

/// A column is distinguished from the model's own where this share of its length is left by their projection.
const LEAST_LEFT: f64 = 1e-4;
/// One of several is distinguished from all others where this share of its square is left: of less, noise makes anything.
const LEAST_DISTINCT: f64 = 1e-4;

/// A fit's residuals and derivatives, made ready for tests.
#[derive(Clone, Debug)]
pub struct ScoreTest {
    residual: DVector<f64>,
    jacobian: DMatrix<f64>,
    optimum: Optimum,
}

/// What a test came to.
#[derive(Clone, Debug)]
pub struct Score {
    /// Probability of as much where the parameters are zero.
    pub p: f64,
    /// What the columns' parameters come to.
    pub coefficients: DVector<f64>,
    /// Share of the squared residual that they take.
    pub explained: f64,
    /// By how much the model's parameters would move.
    pub shift: DVector<f64>,
    /// Factor on standard errors once they are estimated.
    pub tighter: f64,
}

impl ScoreTest {
    /// Of a fit with so many independent residuals; `None` where its derivatives are not of full rank.
    pub fn new(residuals: &[f64], jacobian: DMatrix<f64>, independent: usize) -> Option<Self> {
        let residual = DVector::from_column_slice(residuals);
        let optimum = Optimum {
            freedom: independent as f64 - jacobian.ncols() as f64,
            inverse: inverse(&jacobian)?,
            gradient: jacobian.tr_mul(&residual),
            square: residual.norm_squared(),
        };
        Some(Self { residual, jacobian, optimum })
    }

    /// Tests columns of which `rank` are independent of each other, by the residual's own variance. `None` where the
    /// model has them already, or too few residuals are left.
    pub fn test(&self, columns: &DMatrix<f64>, rank: usize) -> Option<Score> {
        self.judged(&self.optimum.regress(&self.products(columns))?, rank)
    }

    /// Those of some columns that neither the model has nor others of them.
    pub fn distinct(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let Products { own, model, .. } = self.products(columns);
        let mut left = &own - model.tr_mul(&(&self.optimum.inverse * &model));
        let mut kept = Vec::new();
        // The column that has most left is taken, and what is like it goes from the others.
        while let Some((_, next)) = (0..columns.ncols())
            .filter(|k| !kept.contains(k) && own[(*k, *k)] > 0.0)
            .map(|k| (left[(k, k)] / own[(k, k)], k))
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .filter(|(share, _)| *share > LEAST_DISTINCT)
        {
            let along = left.column(next) / left[(next, next)];
            left -= along * left.row(next).into_owned();
            kept.push(next);
        }
        kept.sort_unstable();
        columns.select_columns(&kept)
    }

    /// Tests whether some residuals, which lie next to each other, follow nothing but themselves: a column for each.
    pub fn test_alone(&self, rows: Range<usize>, rank: usize) -> Option<Score> {
        let (from, count) = (rows.start, rows.len());
        let products = Products {
            own: DMatrix::identity(count, count),
            residual: self.residual.rows(from, count).into_owned(),
            model: self.jacobian.rows(from, count).transpose(),
        };
        self.judged(&self.optimum.regress(&products)?, rank)
    }

    fn judged(&self, found: &Regression, rank: usize) -> Option<Score> {
        let left = self.optimum.freedom - rank as f64;
        if left < 1.0 {
            return None;
        }
        let score = self.optimum.score(found, left);
        let f = (score.explained / rank as f64) / ((1.0 - score.explained) / left);
        Some(Score { p: upper_tail(f, rank as f64, left)?, ..score })
    }

    fn products(&self, columns: &DMatrix<f64>) -> Products {
        let mut products = Products::zeros(self.jacobian.ncols(), columns.ncols());
        for part in parts(columns.nrows()) {
            let rows = |matrix: &DMatrix<f64>| matrix.rows(part.start, part.len()).into_owned();
            let residual = self.residual.rows(part.start, part.len()).into_owned();
            products.take(&rows(&self.jacobian), &residual, &rows(columns));
        }
        products
    }
}

/// What a regression needs of a fit at its optimum.
#[derive(Clone, Debug)]
pub(super) struct Optimum {
    /// (JᵀJ)⁻¹.
    pub inverse: DMatrix<f64>,
    /// Jᵀr: at the optimum, what rounding leaves.
    pub gradient: DVector<f64>,
    /// rᵀr.
    pub square: f64,
    /// Independent residuals less parameters.
    pub freedom: f64,
}

impl Optimum {
    /// Regresses the residual on what the model leaves of columns: at least [`LEAST_LEFT`] of them, whose square loses half
    /// of the digits.
    pub fn regress(&self, of: &Products) -> Option<Regression> {
        let taken = &self.inverse * &of.model;
        let products = &of.own - of.model.tr_mul(&taken);
        let along = &of.residual - taken.tr_mul(&self.gradient);
        let length = products.diagonal().map(|square| square.max(0.0).sqrt());
        let whole = of.own.diagonal().map(f64::sqrt);
        if !length.iter().zip(&whole).all(|(length, whole)| *length > LEAST_LEFT * whole) {
            return None;
        }
        // Columns at unit length: parameters of different units would spoil the factorisation.
        let unit = products.map_with_location(|i, j, product| product / (length[i] * length[j]));
        let coefficients = -unit.cholesky()?.solve(&along.component_div(&length)).component_div(&length);
        let explained = -along.dot(&coefficients) / self.square;
        let shift = -(&taken * &coefficients);
        let finite = coefficients.iter().all(|c| c.is_finite());
        finite.then_some(Regression { along, coefficients, taken, shift, explained })
    }

    /// A score whose probability is not known yet, where so many degrees of freedom are left.
    pub fn score(&self, found: &Regression, left: f64) -> Score {
        Score {
            p: 1.0,
            coefficients: found.coefficients.clone(),
            explained: found.explained,
            shift: found.shift.clone(),
            tighter: ((1.0 - found.explained) * self.freedom / left).sqrt(),
        }
    }
}

/// What a regression needs of columns.
#[derive(Clone, Debug)]
pub(super) struct Products {
    /// ZᵀZ.
    pub own: DMatrix<f64>,
    /// Zᵀr.
    pub residual: DVector<f64>,
    /// JᵀZ.
    pub model: DMatrix<f64>,
}

impl Products {
    pub fn zeros(parameters: usize, columns: usize) -> Self {
        Self {
            own: DMatrix::zeros(columns, columns),
            residual: DVector::zeros(columns),
            model: DMatrix::zeros(parameters, columns),
        }
    }

    /// Adds those of further rows.
    pub fn take(&mut self, jacobian: &DMatrix<f64>, residual: &DVector<f64>, columns: &DMatrix<f64>) {
        self.own += columns.tr_mul(columns);
        self.residual += columns.tr_mul(residual);
        self.model += jacobian.tr_mul(columns);
    }

    /// Adds those of other rows, whose columns are so many times as large.
    pub fn add(&mut self, others: &Self, weight: f64) {
        self.own += &others.own * (weight * weight);
        self.residual += &others.residual * weight;
        self.model += &others.model * weight;
    }
}

/// The residual by what the model leaves of some columns.
pub(super) struct Regression {
    /// (M Z)ᵀ r.
    pub along: DVector<f64>,
    /// c.
    pub coefficients: DVector<f64>,
    /// (JᵀJ)⁻¹ Jᵀ Z.
    pub taken: DMatrix<f64>,
    /// δ.
    pub shift: DVector<f64>,
    /// Share of the squared residual that it takes.
    pub explained: f64,
}

/// Probability that a ratio of variances exceeds `f`; `None` where it is not one.
pub fn upper_tail(f: f64, above: f64, below: f64) -> Option<f64> {
    (f >= 0.0).then_some(())?;
    Some(FisherSnedecor::new(above, below).ok()?.sf(f))
}

#[cfg(test)]
mod tests {
    use super::{super::rows::influence, *};
    use crate::simulator::random::{Purpose, Random};

    const ROWS: usize = 400;

    /// A line fitted to noise, alike in time by `kept`, with a parabola of a size in it; its test against a parabola.
    fn parabola(size: f64, kept: f64, seed: u64) -> (ScoreTest, DMatrix<f64>) {
        let mut random = Random::new(seed, Purpose::Noise);
        let x = |row: usize| row as f64 / ROWS as f64 - 0.5;
        let jacobian = DMatrix::from_fn(ROWS, 2, |row, k| x(row).powi(k as i32));
        let mut state = 0.0;
        let noisy = DVector::from_fn(ROWS, |row, _| {
            state = kept * state + random.normals().x;
            state + size * x(row).powi(2)
        });
        let residual = &noisy - &jacobian * influence(&jacobian).unwrap().tr_mul(&noisy);
        let columns = DMatrix::from_fn(ROWS, 1, |row, _| x(row).powi(2));
        (ScoreTest::new(residual.as_slice(), jacobian, ROWS).unwrap(), columns)
    }

    #[test]
    fn white_noise_follows_a_parabola_as_often_as_stated() {
        let found = (0..400).filter(|seed| {
            let (test, columns) = parabola(0.0, 0.0, *seed);
            test.test(&columns, 1).unwrap().p < 0.05
        });
        let found = found.count();
        assert!((8..=34).contains(&found), "{found} of 400 at 5 %");
    }

    #[test]
    fn a_parabola_is_found_and_moves_the_line_by_what_it_took_of_it() {
        let (test, columns) = parabola(5.0, 0.0, 1);
        let score = test.test(&columns, 1).unwrap();
        assert!(score.p < 1e-6 && score.tighter < 1.0, "{score:?}");
        // Until the parabola is estimated, the line is too high by its mean, 1/12 of it; parameters lower the residual.
        assert!((score.shift[0] - 5.0 / 12.0).abs() < 0.2, "{score:?}");
        assert!(score.shift[1].abs() < 0.05, "{score:?}");
    }

    #[test]
    fn residuals_alone_are_tested_as_by_their_columns() {
        let (test, _) = parabola(1.0, 0.0, 2);
        let columns = DMatrix::from_fn(ROWS, 2, |row, k| f64::from(u8::from(row == 30 + k)));
        let (alone, by_columns) = (test.test_alone(30..32, 2).unwrap(), test.test(&columns, 2).unwrap());
        assert!((alone.p / by_columns.p - 1.0).abs() < 1e-9, "{alone:?} {by_columns:?}");
        assert!((alone.shift - by_columns.shift).amax() < 1e-12);
    }

    #[test]
    fn of_columns_that_are_alike_one_is_kept_and_of_the_model_s_own_none() {
        let (test, parabola) = parabola(0.0, 0.0, 1);
        let columns = DMatrix::from_fn(ROWS, 4, |row, k| match k {
            0 => 3.0,
            1 => 0.0,
            2 => parabola[(row, 0)],
            _ => 2.0 * parabola[(row, 0)] + 1.0,
        });
        let kept = test.distinct(&columns);
        assert_eq!(kept.ncols(), 1);
        assert!(test.test(&kept, 1).is_some());
        assert_eq!(test.distinct(&columns.columns(0, 2).into_owned()).ncols(), 0);
    }

    #[test]
    fn columns_that_the_model_has_are_not_tested() {
        let (test, _) = parabola(0.0, 0.0, 1);
        assert!(test.test(&DMatrix::repeat(ROWS, 1, 3.0), 1).is_none());
    }
}
