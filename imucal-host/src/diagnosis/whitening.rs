//! The covariance of a channel's block means, and its inverse.
//!
//! ```text
//! Σ = D + Σ_r U_r U_rᵀ + Z K Zᵀ
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | D | white noise of each block mean |
//! | U_r | what a stretch r has in common, a column for each way the table may stand off its encoders |
//! | K | drift: first-order Gauss–Markov processes, at knots |
//! | Z | straight lines between knots |
//!
//! By Woodbury's identity, twice: what stretches have in common first, column by column, the knots after it. Not
//! modelled: drift within the distance of two knots, what the axes of a triad have in common.

use std::ops::Range;

use nalgebra::DMatrix;

use super::skyline::{Factor, Lanes, Skyline};

/// Distance between knots, s.
const SPACING: f64 = 2.5;
/// Columns that are worked on side by side.
const LANES: usize = 4;

/// A first-order Gauss–Markov process.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Process {
    /// Correlation time, s.
    pub time: f64,
    /// Standard deviation, unit of the channel; positive.
    pub sigma: f64,
}

/// Blocks of one stretch and what they share: random numbers of variance one times these courses.
#[derive(Clone, Debug, PartialEq)]
pub struct Shared {
    /// Blocks, consecutive.
    pub blocks: Range<usize>,
    /// A value for each of the blocks, channel's unit.
    pub courses: Vec<Vec<f64>>,
}

/// Most courses of a stretch: one for each gimbal.
const COURSES: usize = 3;

/// Blocks of one stretch and B, such that (D + U Uᵀ)⁻¹ = D⁻¹ − D⁻¹ B Bᵀ D⁻¹.
#[derive(Clone, Debug)]
struct Common {
    blocks: Range<usize>,
    /// Columns of B.
    courses: usize,
    /// B, row by row.
    b: Vec<f64>,
    /// First knot that its blocks lie beside.
    base: usize,
    /// Zᵀ D⁻¹ B over the knots from there on, row by row.
    beside: Vec<f64>,
}

/// Σ⁻¹ of one channel.
#[derive(Clone, Debug)]
pub struct Whitening {
    weights: Vec<f64>,
    knots: Vec<(usize, f64)>,
    shared: Vec<Common>,
    processes: usize,
    states: usize,
    factor: Option<Factor>,
    /// Natural logarithm of Σ's determinant, over blocks with a weight.
    pub log_determinant: f64,
}

impl Whitening {
    /// From the blocks' times, s, increasing; their inverse white variances, zero where a block holds nothing; what
    /// stretches share; and drifts. Drifts that make the matrix indefinite by rounding are left out.
    pub fn new(times: &[f64], weights: Vec<f64>, stretches: &[Shared], drifts: &[Process]) -> Self {
        let start = times.first().copied().unwrap_or(0.0);
        let length = times.last().copied().unwrap_or(0.0) - start;
        let count = (length / SPACING).ceil() as usize + 1;
        let knots: Vec<(usize, f64)> = times
            .iter()
            .map(|time| {
                let at = (time - start) / SPACING;
                let knot = (at.floor() as usize).min(count.saturating_sub(2));
                (knot, at - knot as f64)
            })
            .collect();
        let mut log_determinant: f64 = weights.iter().filter(|w| **w > 0.0).map(|w| -w.ln()).sum();
        let shared: Vec<Common> = stretches
            .iter()
            .filter(|stretch| !stretch.courses.is_empty())
            .map(|stretch| {
                let (common, share) = Common::new(stretch, &weights, &knots);
                log_determinant += share;
                common
            })
            .collect();
        let mut whitening = Self {
            weights,
            knots,
            shared,
            processes: drifts.len(),
            states: count.max(2) * drifts.len(),
            factor: None,
            log_determinant,
        };
        whitening.factor = whitening.factorise(count.max(2), drifts);
        if let Some(factor) = &whitening.factor {
            whitening.log_determinant += factor.log_determinant;
            for drift in drifts {
                let q = innovation(drift);
                whitening.log_determinant += (count.max(2) - 1) as f64 * q.ln() + 2.0 * drift.sigma.ln();
            }
        }
        whitening
    }

    fn factorise(&self, count: usize, drifts: &[Process]) -> Option<Factor> {
        let p = self.processes;
        if p == 0 {
            return None;
        }
        let mut first: Vec<usize> = (0..count * p).map(|state| (state / p).saturating_sub(1) * p).collect();
        for common in &self.shared {
            let (from, to) = (common.base, common.base + common.beside.len() / common.courses);
            for reach in &mut first[from * p..to * p] {
                *reach = (*reach).min(from * p);
            }
        }
        let mut matrix = Skyline::new(first);
        for (process, drift) in drifts.iter().enumerate() {
            let (kept, q) = (libm::exp(-SPACING / drift.time), innovation(drift));
            for knot in 0..count {
                let inner = if knot == 0 || knot + 1 == count { 1.0 } else { 1.0 + kept * kept };
                matrix.add(knot * p + process, knot * p + process, inner / q);
                if knot > 0 {
                    matrix.add(knot * p + process, (knot - 1) * p + process, -kept / q);
                }
            }
        }
        let mut spread = |a: usize, b: usize, value: f64| {
            for (i, j) in (0..p).flat_map(|i| (0..p).map(move |j| (i, j))) {
                let (row, column) = (a * p + i, b * p + j);
                // Each pair once: the matrix mirrors what is off its diagonal.
                if row >= column {
                    matrix.add(row, column, value);
                }
            }
        };
        for ((knot, share), w) in self.knots.iter().zip(&self.weights) {
            spread(*knot, *knot, w * (1.0 - share) * (1.0 - share));
            spread(knot + 1, *knot, w * share * (1.0 - share));
            spread(knot + 1, knot + 1, w * share * share);
        }
        for Common { courses, base, beside, .. } in &self.shared {
            for (i, one) in beside.chunks_exact(*courses).enumerate() {
                for (j, other) in beside.chunks_exact(*courses).enumerate().take(i + 1) {
                    let both: f64 = one.iter().zip(other).map(|(a, b)| a * b).sum();
                    spread(base + i, base + j, -both);
                }
            }
        }
        matrix.factorised()
    }

    /// Σ⁻¹ x of one column over the blocks.
    pub fn apply(&self, x: &[f64], out: &mut [f64]) {
        let weighted = self.weighted(x.iter().map(|x| [*x]));
        out.iter_mut().zip(weighted).for_each(|(out, [value])| *out = value);
    }

    /// Σ⁻¹ X, a column for each of X.
    pub fn apply_all(&self, x: &DMatrix<f64>) -> DMatrix<f64> {
        let (blocks, mut at) = (x.nrows(), 0);
        let mut out = DMatrix::zeros(blocks, x.ncols());
        while at < x.ncols() {
            if at + LANES <= x.ncols() {
                self.columns::<LANES>(x, at, &mut out);
                at += LANES;
            } else {
                self.columns::<1>(x, at, &mut out);
                at += 1;
            }
        }
        out
    }

    /// Columns of X from `at` on.
    fn columns<const L: usize>(&self, x: &DMatrix<f64>, at: usize, out: &mut DMatrix<f64>) {
        let (blocks, from) = (x.nrows(), at * x.nrows());
        let columns: [&[f64]; L] =
            std::array::from_fn(|lane| &x.as_slice()[from + lane * blocks..from + (lane + 1) * blocks]);
        let weighted = self.weighted((0..blocks).map(|row| columns.map(|column| column[row])));
        for (lane, out) in out.as_mut_slice()[from..].chunks_exact_mut(blocks.max(1)).take(L).enumerate() {
            out.iter_mut().zip(&weighted).for_each(|(out, row)| *out = row[lane]);
        }
    }

    /// Σ⁻¹ x of columns side by side.
    fn weighted<const L: usize>(&self, x: impl Iterator<Item = Lanes<L>>) -> Vec<Lanes<L>> {
        let mut out: Vec<Lanes<L>> = x.zip(&self.weights).map(|(x, w)| x.map(|x| x * w)).collect();
        self.share(&mut out);
        let Some(factor) = &self.factor else { return out };
        let p = self.processes;
        let mut knots = vec![[0.0; L]; self.states / p];
        for ((knot, share), out) in self.knots.iter().zip(&out) {
            for lane in 0..L {
                knots[*knot][lane] += out[lane] * (1.0 - share);
                knots[knot + 1][lane] += out[lane] * share;
            }
        }
        let mut state: Vec<Lanes<L>> = knots.iter().flat_map(|knot| std::iter::repeat_n(*knot, p)).collect();
        factor.solve(&mut state);
        for (knot, state) in knots.iter_mut().zip(state.chunks_exact(p)) {
            *knot = std::array::from_fn(|lane| state.iter().map(|state| state[lane]).sum());
        }
        let drift: Vec<Lanes<L>> = self
            .knots
            .iter()
            .zip(&self.weights)
            .map(|((knot, share), w)| {
                let (before, after) = (&knots[*knot], &knots[knot + 1]);
                std::array::from_fn(|lane| w * (before[lane] * (1.0 - share) + after[lane] * share))
            })
            .collect();
        for (out, drift) in out.iter_mut().zip(&drift) {
            out.iter_mut().zip(drift).for_each(|(out, drift)| *out -= drift);
        }
        for common in &self.shared {
            let along = common.along(&common.beside, &knots[common.base..]);
            common.take(&along.map(|sum| sum.map(|sum| -sum)), &self.weights, &mut out);
        }
        out
    }

    /// From D⁻¹ x to (D + shared)⁻¹ x.
    fn share<const L: usize>(&self, weighted: &mut [Lanes<L>]) {
        for common in &self.shared {
            let along = common.along(&common.b, &weighted[common.blocks.clone()]);
            common.take(&along, &self.weights, weighted);
        }
    }
}

impl Common {
    /// B of a stretch, one course after the other, and ln |I + Uᵀ D⁻¹ U|.
    fn new(stretch: &Shared, weights: &[f64], knots: &[(usize, f64)]) -> (Self, f64) {
        let Shared { blocks, courses } = stretch;
        let (weights, knots) = (&weights[blocks.clone()], &knots[blocks.clone()]);
        let inner =
            |a: &[f64], b: &[f64]| -> f64 { (0..weights.len()).map(|k| a[k] * b[k] * weights[k]).sum() };
        let mut columns: Vec<Vec<f64>> = Vec::with_capacity(courses.len());
        let mut log_determinant = 0.0;
        for course in courses.iter().take(COURSES) {
            let mut own = course.clone();
            for before in &columns {
                let along = inner(before, course);
                own.iter_mut().zip(before).for_each(|(own, before)| *own -= along * before);
            }
            let square = 1.0 + inner(course, &own);
            log_determinant += square.ln();
            let factor = 1.0 / square.sqrt();
            own.iter_mut().for_each(|own| *own *= factor);
            columns.push(own);
        }
        let n = columns.len();
        let (base, last) = (knots[0].0, knots[knots.len() - 1].0);
        let mut b = vec![0.0; n * weights.len()];
        let mut beside = vec![0.0; n * (last + 2 - base)];
        for (course, column) in columns.iter().enumerate() {
            for (row, value) in column.iter().enumerate() {
                b[row * n + course] = *value;
                let ((knot, share), weighted) = (knots[row], weights[row] * value);
                beside[(knot - base) * n + course] += weighted * (1.0 - share);
                beside[(knot + 1 - base) * n + course] += weighted * share;
            }
        }
        (Self { blocks: blocks.clone(), courses: n, b, base, beside }, log_determinant)
    }

    /// Sums of rows times each column of `factors`, row by row.
    fn along<const L: usize>(&self, factors: &[f64], rows: &[Lanes<L>]) -> [Lanes<L>; COURSES] {
        let mut sums = [[0.0; L]; COURSES];
        for (row, factors) in rows.iter().zip(factors.chunks_exact(self.courses)) {
            for (sum, factor) in sums.iter_mut().zip(factors) {
                sum.iter_mut().zip(row).for_each(|(sum, row)| *sum += factor * row);
            }
        }
        sums
    }

    /// Takes D⁻¹ B times these amounts from the rows of its blocks.
    fn take<const L: usize>(&self, amounts: &[Lanes<L>; COURSES], weights: &[f64], rows: &mut [Lanes<L>]) {
        let (rows, weights) = (&mut rows[self.blocks.clone()], &weights[self.blocks.clone()]);
        for ((row, w), b) in rows.iter_mut().zip(weights).zip(self.b.chunks_exact(self.courses)) {
            for (amount, b) in amounts.iter().zip(b) {
                row.iter_mut().zip(amount).for_each(|(row, amount)| *row -= w * b * amount);
            }
        }
    }
}

/// Variance of what is new in a process from one knot to the next.
fn innovation(drift: &Process) -> f64 {
    let kept = libm::exp(-SPACING / drift.time);
    drift.sigma * drift.sigma * (1.0 - kept * kept)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    /// Σ by its definition.
    fn dense(times: &[f64], weights: &[f64], shared: &[Shared], drifts: &[Process]) -> DMatrix<f64> {
        let n = times.len();
        let count = ((times[n - 1] - times[0]) / SPACING).ceil() as usize + 1;
        let z = DMatrix::from_fn(n, count, |row, knot| {
            (1.0 - ((times[row] - times[0]) / SPACING - knot as f64).abs()).max(0.0)
        });
        let mut sigma = DMatrix::from_diagonal(&DVector::from_iterator(n, weights.iter().map(|w| 1.0 / w)));
        for drift in drifts {
            let k = DMatrix::from_fn(count, count, |a, b| {
                drift.sigma.powi(2) * (-SPACING * (a as f64 - b as f64).abs() / drift.time).exp()
            });
            sigma += &z * k * z.transpose();
        }
        for Shared { blocks, courses } in shared {
            for (a, b) in blocks.clone().flat_map(|a| blocks.clone().map(move |b| (a, b))) {
                let both = |u: &Vec<f64>| u[a - blocks.start] * u[b - blocks.start];
                sigma[(a, b)] += courses.iter().map(both).sum::<f64>();
            }
        }
        sigma
    }

    #[test]
    fn it_is_the_inverse_of_the_covariance_it_stands_for() {
        let times: Vec<f64> = (0..60).map(|k| 0.37 * f64::from(k)).collect();
        let weights: Vec<f64> = (0..60).map(|k| 1.0 + 0.5 * f64::from(k % 3)).collect();
        let course =
            |count: usize, f: &dyn Fn(f64) -> f64| (0..count).map(|k| f(k as f64)).collect::<Vec<_>>();
        let shared = [
            Shared { blocks: 3..9, courses: vec![course(6, &|_| 0.6)] },
            Shared {
                blocks: 20..41,
                courses: vec![
                    course(21, &|k| (0.3 * k).sin()),
                    course(21, &|k| 0.1 * k),
                    course(21, &|_| 0.0),
                ],
            },
        ];
        let drifts = [Process { time: 8.0, sigma: 0.9 }, Process { time: 150.0, sigma: 2.0 }];
        for drifts in [&drifts[..], &drifts[..1], &[]] {
            let sigma = dense(&times, &weights, &shared, drifts);
            let whitening = Whitening::new(&times, weights.clone(), &shared, drifts);
            let log_determinant = sigma.clone().cholesky().unwrap().ln_determinant();
            assert!((whitening.log_determinant - log_determinant).abs() < 1e-8);
            let x = DVector::from_fn(60, |k, _| ((k * k) as f64).sin());
            let mut found = vec![0.0; 60];
            whitening.apply(x.as_slice(), &mut found);
            assert!((&sigma * DVector::from_vec(found) - &x).amax() < 1e-9);
            let several = DMatrix::from_fn(60, 6, |row, column| x[row] * (column as f64 - 1.5));
            assert!((sigma * whitening.apply_all(&several) - several).amax() < 1e-9);
        }
    }
}
