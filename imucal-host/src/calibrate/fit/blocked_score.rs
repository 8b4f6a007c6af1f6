//! A [score test](super::score_test) of samples that are alike in time, by sums over blocks of neighbours.
//!
//! ```text
//! s_b = Z_bᵀ l_b − Tᵀ J_bᵀ l_b,   l = r + Z c + J δ,   T = (JᵀJ)⁻¹ JᵀZ
//! T² = aᵀ (Σ s_b s_bᵀ)⁻¹ a,   a = Zᵀr − Tᵀ Jᵀr,   T² (B − q)/(q B) ~ F(q, B − q)
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | r, J, Z, c, δ | as in [`super::score_test`] |
//! | l | what is left of the residual once the q columns of Z are estimated, too |
//! | s_b | the sum over block b of B: what of it the columns take from the residual |
//!
//! All of it follows from products of J, r and Z over segments of samples that no block divides, so that rows are made once, some at a
//! time, and none is kept. A step in time takes the products that its columns have without it.
//! Source: Hotelling 1931; Liang & Zeger 1986 (blocks). Not modelled: noise that is alike over more than a block.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::{
    rows::inverse_of,
    score_test::{Optimum, Products, Regression, Score, upper_tail},
};

/// Blocks: few where noise is alike for long, many where turns change what it does. The larger probability counts.
const BLOCKS: [usize; 2] = [30, 100];
/// Parts at whose borders a step may lie.
pub const PARTS: usize = 8;
/// Rows that are made at a time: few enough to stay in a processor's cache.
const ROWS: usize = 256;

/// Some samples of a fit.
#[derive(Clone, Debug)]
pub struct Rows {
    /// Residuals.
    pub residual: DVector<f64>,
    /// Their derivatives by the parameters.
    pub jacobian: DMatrix<f64>,
    /// What is tested: columns of each test.
    pub columns: Vec<DMatrix<f64>>,
}

/// Products over samples that no block and no step divides.
struct Segment {
    samples: Range<usize>,
    /// JᵀJ, Jᵀr and rᵀr.
    model: (DMatrix<f64>, DVector<f64>, f64),
    columns: Vec<Products>,
}

/// A fit's samples, made ready for tests.
pub struct BlockedScore {
    optimum: Optimum,
    segments: Vec<Segment>,
    samples: usize,
}

impl BlockedScore {
    /// Of a fit to so many samples, as many of them independent, whose rows `made` gives. `None` where its derivatives are not
    /// of full rank.
    pub fn new(
        samples: usize,
        independent: usize,
        made: &(impl Fn(Range<usize>) -> Rows + Sync),
    ) -> Option<Self> {
        let cuts = cuts(samples);
        let segments: Vec<Segment> = cuts.par_windows(2).map(|cut| segment(cut[0]..cut[1], made)).collect();
        let (products, gradient, square) = sums(&segments)?;
        let freedom = independent as f64 - products.ncols() as f64;
        let optimum = Optimum { inverse: inverse_of(&products)?, gradient, square, freedom };
        Some(Self { optimum, segments, samples })
    }

    /// Tests columns by their index in [`Rows::columns`]. `None` where the model has them already, where samples are too few, or
    /// where the columns explain no more than `least` of the squared residual.
    pub fn test(&self, index: usize, least: f64) -> Option<Score> {
        self.weighted(index, least, |_| 1.0)
    }

    /// As [`Self::test`], of columns times a step, less its mean, where part `part` of [`PARTS`] begins.
    pub fn test_step(&self, index: usize, part: usize, least: f64) -> Option<Score> {
        let first = step_begin(part, self.samples);
        let mean = (self.samples - first) as f64 / self.samples as f64;
        self.weighted(index, least, |samples| f64::from(u8::from(samples.start >= first)) - mean)
    }

    fn weighted(&self, index: usize, least: f64, weight: impl Fn(&Range<usize>) -> f64) -> Option<Score> {
        let mut all = self.segments.first().map(|segment| zeros(&segment.columns[index]))?;
        for segment in &self.segments {
            all.add(&segment.columns[index], weight(&segment.samples));
        }
        let found = self.optimum.regress(&all).filter(|found| found.explained > least)?;
        let sums: Vec<DVector<f64>> = self
            .segments
            .iter()
            .map(|segment| segment.sum(index, weight(&segment.samples), &found))
            .collect();
        let chances: Option<Vec<f64>> =
            BLOCKS.iter().map(|blocks| self.chance(&sums, &found, *blocks)).collect();
        let p = chances?.into_iter().fold(0.0, f64::max);
        Some(Score { p, ..self.optimum.score(&found, self.optimum.freedom - all.own.ncols() as f64) })
    }

    /// Of Hotelling's T², from the segments' sums.
    fn chance(&self, sums: &[DVector<f64>], found: &Regression, blocks: usize) -> Option<f64> {
        let q = found.along.len();
        let freedom = blocks as f64 - q as f64;
        if freedom < 1.0 || self.samples < blocks {
            return None;
        }
        let mut spread = DMatrix::zeros(q, q);
        let mut of_segments = self.segments.iter().zip(sums).peekable();
        for block in 1..=blocks {
            let end = border(block, blocks, self.samples);
            let mut sum = DVector::zeros(q);
            while let Some((_, segment)) = of_segments.next_if(|(segment, _)| segment.samples.end <= end) {
                sum += segment;
            }
            spread += &sum * sum.transpose();
        }
        let t2 = found.along.dot(&spread.cholesky()?.solve(&found.along));
        upper_tail(t2 * freedom / (q as f64 * blocks as f64), q as f64, freedom)
    }
}

impl Segment {
    /// s of this segment, of columns that are so many times as large here.
    fn sum(&self, index: usize, weight: f64, found: &Regression) -> DVector<f64> {
        let Products { own, residual, model } = &self.columns[index];
        let (products, gradient, _) = &self.model;
        let by_columns = residual + own * &found.coefficients * weight + model.tr_mul(&found.shift);
        let by_model = gradient + model * &found.coefficients * weight + products * &found.shift;
        by_columns * weight - found.taken.tr_mul(&by_model)
    }
}

/// The sample at which a part of [`PARTS`] begins.
pub fn step_begin(part: usize, samples: usize) -> usize {
    border(part, PARTS, samples)
}

/// Where a part of so many begins.
fn border(part: usize, parts: usize, samples: usize) -> usize {
    part * samples / parts
}

/// Borders of all blocks and of all steps.
fn cuts(samples: usize) -> Vec<usize> {
    let borders = |parts: usize| (0..=parts).map(move |part| border(part, parts, samples));
    let mut cuts: Vec<usize> = BLOCKS.into_iter().chain([PARTS]).flat_map(borders).collect();
    cuts.sort_unstable();
    cuts.dedup();
    cuts
}

fn segment(samples: Range<usize>, made: &impl Fn(Range<usize>) -> Rows) -> Segment {
    let rows = |from: usize| made(from..(from + ROWS).min(samples.end));
    let mut starts = samples.clone().step_by(ROWS);
    let first = rows(starts.next().unwrap_or(samples.start));
    let parameters = first.jacobian.ncols();
    let mut segment = Segment {
        samples: samples.clone(),
        model: (DMatrix::zeros(parameters, parameters), DVector::zeros(parameters), 0.0),
        columns: first.columns.iter().map(|columns| Products::zeros(parameters, columns.ncols())).collect(),
    };
    segment.take(&first);
    starts.for_each(|from| segment.take(&rows(from)));
    segment
}

impl Segment {
    fn take(&mut self, rows: &Rows) {
        let Rows { residual, jacobian, columns } = rows;
        self.model.0 += jacobian.tr_mul(jacobian);
        self.model.1 += jacobian.tr_mul(residual);
        self.model.2 += residual.norm_squared();
        for (products, columns) in self.columns.iter_mut().zip(columns) {
            products.take(jacobian, residual, columns);
        }
    }
}

fn zeros(like: &Products) -> Products {
    Products::zeros(like.model.nrows(), like.model.ncols())
}

/// JᵀJ, Jᵀr and rᵀr of all segments.
fn sums(segments: &[Segment]) -> Option<(DMatrix<f64>, DVector<f64>, f64)> {
    segments.iter().map(|segment| segment.model.clone()).reduce(|a, b| (a.0 + b.0, a.1 + b.1, a.2 + b.2))
}

#[cfg(test)]
mod tests {
    use super::{
        super::{rows::influence, score_test::ScoreTest},
        *,
    };
    use crate::simulator::random::{Purpose, Random};

    const SAMPLES: usize = 2000;

    /// The residual of a line fitted to noise that is alike in time by `kept`, its derivatives, and columns to test: a harmonic, as a
    /// direction gives, and two of different periods.
    fn harmonic(kept: f64, seed: u64) -> (DVector<f64>, DMatrix<f64>, [DMatrix<f64>; 2]) {
        let mut random = Random::new(seed, Purpose::Noise);
        let x = |row: usize| row as f64 / SAMPLES as f64 - 0.5;
        let jacobian = DMatrix::from_fn(SAMPLES, 2, |row, k| x(row).powi(k as i32));
        let mut state = 0.0;
        let noisy = DVector::from_fn(SAMPLES, |_, _| {
            state = kept * state + random.normals().x;
            state
        });
        let residual = &noisy - &jacobian * influence(&jacobian).unwrap().tr_mul(&noisy);
        let wave = |row: usize| libm::cos(row as f64 / 40.0);
        let one = DMatrix::from_fn(SAMPLES, 1, |row, _| wave(row));
        let two =
            DMatrix::from_fn(SAMPLES, 2, |row, k| wave(row) * [1.0, libm::sin(row as f64 / 7.0)][k] + 0.1);
        (residual, jacobian, [one, two])
    }

    fn blocked(residual: &DVector<f64>, jacobian: &DMatrix<f64>, columns: &[DMatrix<f64>]) -> BlockedScore {
        let made = |samples: Range<usize>| {
            let part = |matrix: &DMatrix<f64>| matrix.rows(samples.start, samples.len()).into_owned();
            Rows {
                residual: residual.rows(samples.start, samples.len()).into_owned(),
                jacobian: part(jacobian),
                columns: columns.iter().map(part).collect(),
            }
        };
        BlockedScore::new(SAMPLES, SAMPLES, &made).unwrap()
    }

    #[test]
    fn blocks_hold_the_rate_where_neighbours_are_alike_and_rows_do_not() {
        let count = |blocks: bool| {
            (0..200)
                .filter(|seed| {
                    let (residual, jacobian, columns) = harmonic(0.8, *seed);
                    let score = if blocks {
                        blocked(&residual, &jacobian, &columns).test(0, 0.0)
                    } else {
                        ScoreTest::new(residual.as_slice(), jacobian, SAMPLES).unwrap().test(&columns[0], 1)
                    };
                    score.unwrap().p < 0.01
                })
                .count()
        };
        let (rows, blocks) = (count(false), count(true));
        assert!(rows > 40, "{rows}");
        assert!(blocks <= 10, "{blocks}");
    }

    /// Hotelling's T² as it is written: of what is left of the residual, block by block.
    fn by_definition(residual: &DVector<f64>, jacobian: &DMatrix<f64>, columns: &DMatrix<f64>) -> f64 {
        let inverse = (jacobian.transpose() * jacobian).try_inverse().unwrap();
        let free = columns - jacobian * (&inverse * jacobian.transpose() * columns);
        let along = free.transpose() * residual;
        let left = residual - &free * ((free.transpose() * &free).try_inverse().unwrap() * &along);
        let q = columns.ncols();
        let chance = |blocks: usize| {
            let mut spread = DMatrix::zeros(q, q);
            for block in 0..blocks {
                let (from, to) = (border(block, blocks, SAMPLES), border(block + 1, blocks, SAMPLES));
                let sum = free.rows(from, to - from).transpose() * left.rows(from, to - from);
                spread += &sum * sum.transpose();
            }
            let t2 = (along.transpose() * spread.try_inverse().unwrap() * &along)[0];
            let freedom = (blocks - q) as f64;
            upper_tail(t2 * freedom / (q * blocks) as f64, q as f64, freedom).unwrap()
        };
        BLOCKS.map(chance).into_iter().fold(0.0, f64::max)
    }

    #[test]
    fn sums_of_segments_give_the_test_of_all_rows() {
        for seed in 0..20 {
            let (residual, jacobian, columns) = harmonic(0.5, seed);
            let blocked = blocked(&residual, &jacobian, &columns);
            for (index, columns) in columns.iter().enumerate() {
                let score = blocked.test(index, 0.0).unwrap();
                let expected = by_definition(&residual, &jacobian, columns);
                assert!((score.p / expected - 1.0).abs() < 1e-8, "{} {expected}", score.p);
                let all =
                    ScoreTest::new(residual.as_slice(), jacobian.clone(), SAMPLES).unwrap().test(columns, 1);
                assert!((score.shift - all.unwrap().shift).amax() < 1e-12);
            }
        }
    }

    #[test]
    fn a_step_is_tested_as_its_own_columns_are() {
        let (residual, jacobian, columns) = harmonic(0.5, 3);
        for part in 1..PARTS {
            let first = part * SAMPLES / PARTS;
            let mean = (SAMPLES - first) as f64 / SAMPLES as f64;
            let step = |row: usize| f64::from(u8::from(row >= first)) - mean;
            let stepped = DMatrix::from_fn(SAMPLES, 2, |row, column| step(row) * columns[1][(row, column)]);
            let (with, own) =
                (blocked(&residual, &jacobian, &columns), blocked(&residual, &jacobian, &[stepped]));
            let (with, own) = (with.test_step(1, part, 0.0).unwrap(), own.test(0, 0.0).unwrap());
            assert!((with.p / own.p - 1.0).abs() < 1e-9, "{} {}", with.p, own.p);
            assert!((with.explained / own.explained - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn fewer_samples_than_blocks_are_not_tested() {
        let made = |samples: Range<usize>| {
            let value = |row: usize| libm::sin((samples.start + row) as f64);
            Rows {
                residual: DVector::from_fn(samples.len(), |row, _| value(row)),
                jacobian: DMatrix::repeat(samples.len(), 1, 1.0),
                columns: vec![DMatrix::from_fn(samples.len(), 1, |row, _| value(3 * row))],
            }
        };
        assert!(BlockedScore::new(99, 99, &made).unwrap().test(0, 0.0).is_none());
        assert!(BlockedScore::new(0, 0, &made).is_none());
    }
}
