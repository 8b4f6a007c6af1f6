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
//! The residual itself says how large the noise is, so that no noise is assumed. Samples that are alike in time are
//! counted in blocks: the sums of `zᵢ rᵢ` over blocks, of the residual that is left, give their covariance (T²).
//! Source: Rao 1948 (score test); Hotelling 1931; Liang & Zeger 1986 (blocks). Not modelled: noise that differs
//! from observation to observation, and what the parameters do beyond first order.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::rows::{influence, parts};

/// A column is distinguished from the model's own where this share of its length is left by their projection.
const LEAST_LEFT: f64 = 1e-4;

/// A fit's residuals and derivatives, made ready for tests.
#[derive(Clone, Debug)]
pub struct ScoreTest {
    residual: DVector<f64>,
    jacobian: DMatrix<f64>,
    /// J (JᵀJ)⁻¹.
    influence: DMatrix<f64>,
    /// Independent residuals less parameters.
    freedom: f64,
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
        let freedom = independent as f64 - jacobian.ncols() as f64;
        let influence = influence(&jacobian)?;
        Some(Self { residual: DVector::from_column_slice(residuals), jacobian, influence, freedom })
    }

    /// Tests columns of which `rank` are independent of each other, by the residual's own variance. `None` where the
    /// model has them already, or too few residuals are left.
    pub fn test(&self, columns: &DMatrix<f64>, rank: usize) -> Option<Score> {
        let left = self.freedom - rank as f64;
        if left < 1.0 {
            return None;
        }
        let found = self.regress(columns)?;
        let score = self.score(&found, left);
        let f = (score.explained / rank as f64) / ((1.0 - score.explained) / left);
        Some(Score { p: upper_tail(f, rank as f64, left)?, ..score })
    }

    /// Tests columns of residuals that are alike in time, by what is left over in blocks of neighbours, as many as
    /// each of `blocks` says: the largest probability counts.
    pub fn test_in_blocks(&self, columns: &DMatrix<f64>, blocks: &[usize]) -> Option<Score> {
        let found = self.regress(columns)?;
        let chances: Option<Vec<f64>> = blocks.iter().map(|blocks| found.chance_in_blocks(*blocks)).collect();
        let p = chances?.into_iter().fold(0.0, f64::max);
        Some(Score { p, ..self.score(&found, self.freedom - columns.ncols() as f64) })
    }

    fn score(&self, found: &Regression, left: f64) -> Score {
        let (before, after) = (self.residual.norm_squared(), found.left.norm_squared());
        Score {
            p: 1.0,
            coefficients: found.coefficients.clone(),
            explained: 1.0 - after / before,
            shift: -(&found.taken * &found.coefficients),
            tighter: ((after / left) / (before / self.freedom)).sqrt(),
        }
    }

    /// Regresses the residual on what the model leaves of columns.
    fn regress(&self, columns: &DMatrix<f64>) -> Option<Regression> {
        let (rows, count) = columns.shape();
        let mut taken = DMatrix::zeros(self.jacobian.ncols(), count);
        for part in parts(rows) {
            let (from, length) = (part.start, part.len());
            taken += self.influence.rows(from, length).tr_mul(&columns.rows(from, length));
        }
        let mut projected = columns.clone();
        let (mut products, mut along) = (DMatrix::zeros(count, count), DVector::zeros(count));
        for part in parts(rows) {
            let (from, length) = (part.start, part.len());
            let mut own = projected.rows_mut(from, length);
            own.gemm(-1.0, &self.jacobian.rows(from, length), &taken, 1.0);
            products += own.tr_mul(&own);
            along += own.tr_mul(&self.residual.rows(from, length));
        }
        let length = products.diagonal().map(f64::sqrt);
        let distinguished =
            length.iter().zip(columns.column_iter()).all(|(length, b)| *length > LEAST_LEFT * b.norm());
        if !distinguished {
            return None;
        }
        // Columns at unit length: parameters of different units would spoil the factorisation.
        let unit = DMatrix::from_fn(count, count, |i, j| products[(i, j)] / (length[i] * length[j]));
        let coefficients = -unit.cholesky()?.solve(&along.component_div(&length)).component_div(&length);
        if !coefficients.iter().all(|c| c.is_finite()) {
            return None;
        }
        let mut left = self.residual.clone();
        for part in parts(rows) {
            let own = projected.rows(part.start, part.len());
            left.rows_mut(part.start, part.len()).gemv(1.0, &own, &coefficients, 1.0);
        }
        Some(Regression { projected, along, coefficients, taken, left })
    }
}

/// The residual by what the model leaves of some columns.
struct Regression {
    /// M Z.
    projected: DMatrix<f64>,
    /// (M Z)ᵀ r.
    along: DVector<f64>,
    /// c.
    coefficients: DVector<f64>,
    /// (JᵀJ)⁻¹ Jᵀ Z.
    taken: DMatrix<f64>,
    /// r + M Z c.
    left: DVector<f64>,
}

impl Regression {
    /// Hotelling's T² of the whole sum of `zᵢ rᵢ`, by the covariance that the blocks' sums have once Z is estimated.
    fn chance_in_blocks(&self, blocks: usize) -> Option<f64> {
        let (rows, q) = self.projected.shape();
        let freedom = blocks as f64 - q as f64;
        if freedom < 1.0 || rows < blocks {
            return None;
        }
        let mut spread = DMatrix::zeros(q, q);
        for block in 0..blocks {
            let (from, to) = (block * rows / blocks, (block + 1) * rows / blocks);
            let sum = self.projected.rows(from, to - from).tr_mul(&self.left.rows(from, to - from));
            spread += &sum * sum.transpose();
        }
        let t2 = self.along.dot(&spread.cholesky()?.solve(&self.along));
        // T² (B − q) / (q B) is Fisher–Snedecor's (q, B − q).
        upper_tail(t2 * freedom / (q as f64 * blocks as f64), q as f64, freedom)
    }
}

/// Probability that a ratio of variances exceeds `f`; `None` where it is not one.
pub fn upper_tail(f: f64, above: f64, below: f64) -> Option<f64> {
    (f >= 0.0).then_some(())?;
    Some(FisherSnedecor::new(above, below).ok()?.sf(f))
}

#[cfg(test)]
mod tests {
    use super::*;
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
    fn blocks_hold_the_rate_where_neighbours_are_alike_and_rows_do_not() {
        // One long harmonic of a quickly changing column, as a direction is.
        let count = |blocks: bool| {
            (0..200)
                .filter(|seed| {
                    let (test, _) = parabola(0.0, 0.8, *seed);
                    let columns = DMatrix::from_fn(ROWS, 1, |row, _| libm::cos(row as f64 / 40.0));
                    let score =
                        if blocks { test.test_in_blocks(&columns, &[20]) } else { test.test(&columns, 1) };
                    score.unwrap().p < 0.01
                })
                .count()
        };
        let (rows, blocks) = (count(false), count(true));
        assert!(rows > 40, "{rows}");
        assert!(blocks <= 12, "{blocks}");
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
    fn columns_that_the_model_has_are_not_tested() {
        let (test, _) = parabola(0.0, 0.0, 1);
        assert!(test.test(&DMatrix::repeat(ROWS, 1, 3.0), 1).is_none());
    }
}
