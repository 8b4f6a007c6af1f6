//! Noise of means over spans of time, white and drift, without a matrix of as many rows as there are means.
//!
//! ```text
//! V = D + ρ F,   F_ij = w_iᵀ w_j Σ_τ Cov(k̄_i, k̄_j),   V = L Lᵀ
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | D | white noise of each mean |
//! | w | by how much each of three like drifts, one an axis, counts in a mean |
//! | k̄ | mean of a Gauss–Markov process of correlation time τ over the span ([`super::process`]) |
//! | ρ | variance of the drift over what the processes have |
//!
//! Below the diagonal F is semiseparable: a span depends on those before it by what the processes keep of them, so that
//! factor and whitening are one recursion in time. Its cost is linear in the means and quadratic in the processes. Source:
//! Foreman-Mackey, Agol, Ambikasaran and Angus, Astronomical Journal 154 (2017) 220, section 5, there for instants.

use nalgebra::{DMatrix, DVector, Vector3};

use super::{Span, interval::Whitening, process::Process};

/// A mean over a span.
#[derive(Clone, Debug)]
pub struct Mean {
    /// The row that it is in.
    pub row: usize,
    /// The time that it is a mean over; spans do not overlap.
    pub span: Span,
    /// D.
    pub white: f64,
    /// w.
    pub drifts: Vector3<f64>,
}

/// D and F of means that are independent between chains; within one, they share their drifts.
#[derive(Clone, Debug)]
pub struct Semiseparable {
    /// The means of each chain in time order.
    chains: Vec<Vec<Mean>>,
    processes: Vec<Process>,
}

/// What a span keeps of a process and gives to it.
struct Passage {
    /// From the end of the span before to the start of this one.
    to_start: DVector<f64>,
    /// From the start to the end.
    to_end: DVector<f64>,
    /// By how much the mean depends on a process' value at an end of the span, for each process and axis.
    counts: DVector<f64>,
    /// The mean's own variance: the diagonal of V.
    variance: f64,
}

impl Semiseparable {
    /// Of chains of means; the processes are those of one axis.
    pub fn new(mut chains: Vec<Vec<Mean>>, processes: Vec<Process>) -> Self {
        for chain in &mut chains {
            chain.sort_by(|a, b| a.span.start.total_cmp(&b.span.start));
        }
        Self { chains, processes }
    }

    fn passage(&self, mean: &Mean, before: Option<&Mean>, ratio: f64) -> Passage {
        let length = mean.span.end - mean.span.start;
        let gap = before.map_or(0.0, |before| (mean.span.start - before.span.end).max(0.0));
        let of_states = |value: &dyn Fn(&Process, f64) -> f64| {
            DVector::from_iterator(
                3 * self.processes.len(),
                self.processes.iter().flat_map(|p| mean.drifts.iter().map(|w| value(p, *w))),
            )
        };
        let drift: f64 = self.processes.iter().map(|p| p.variance_of_mean(length)).sum();
        Passage {
            to_start: of_states(&|p, _| p.kept(gap)),
            to_end: of_states(&|p, _| p.kept(length)),
            counts: of_states(&|p, w| w * ratio.sqrt() * p.sigma * p.share_of_end(length)),
            variance: mean.white + ratio * drift * mean.drifts.norm_squared(),
        }
    }

    /// Whitens the rows of a chain in place; ln of its determinant.
    fn whiten(&self, chain: &[Mean], ratio: f64, columns: &mut [DMatrix<f64>; 2]) -> Option<f64> {
        let states = 3 * self.processes.len();
        // Covariance of the states' prediction, and what it leaves to predict of each column.
        let mut explained = DMatrix::<f64>::zeros(states, states);
        let mut predicted = columns.each_ref().map(|x| DMatrix::<f64>::zeros(states, x.ncols()));
        let mut log_determinant = 0.0;
        for (at, mean) in chain.iter().enumerate() {
            let before = at.checked_sub(1).map(|before| &chain[before]);
            let passage = self.passage(mean, before, ratio);
            scale_both(&mut explained, &passage.to_start);
            let known = &explained * &passage.counts;
            let pivot = passage.variance - passage.counts.dot(&known);
            if pivot.is_nan() || pivot <= 0.0 {
                return None;
            }
            log_determinant += pivot.ln();
            let innovation = &passage.counts - known.component_mul(&passage.to_end);
            scale_both(&mut explained, &passage.to_end);
            explained.ger(1.0 / pivot, &innovation, &innovation, 1.0);
            for (x, predicted) in columns.iter_mut().zip(&mut predicted) {
                for (mut column, mut state) in x.column_iter_mut().zip(predicted.column_iter_mut()) {
                    state.component_mul_assign(&passage.to_start);
                    let left = column[mean.row] - passage.counts.dot(&state);
                    state.component_mul_assign(&passage.to_end);
                    state.axpy(left / pivot, &innovation, 1.0);
                    column[mean.row] = left / pivot.sqrt();
                }
            }
        }
        Some(log_determinant)
    }
}

/// S A S, S diagonal.
fn scale_both(a: &mut DMatrix<f64>, s: &DVector<f64>) {
    for (mut column, scale) in a.column_iter_mut().zip(s) {
        column.component_mul_assign(s);
        column *= *scale;
    }
}

impl Whitening for Semiseparable {
    fn whitened(&self, ratio: f64, mut columns: [DMatrix<f64>; 2]) -> Option<([DMatrix<f64>; 2], f64)> {
        let logs: Option<Vec<f64>> =
            self.chains.iter().map(|chain| self.whiten(chain, ratio, &mut columns)).collect();
        Some((columns, logs?.iter().sum()))
    }

    fn carried(&self, influence: &DMatrix<f64>) -> [DMatrix<f64>; 2] {
        let count = influence.ncols();
        let mut sums = [DMatrix::zeros(count, count), DMatrix::zeros(count, count)];
        for chain in &self.chains {
            let spans: Vec<Span> = chain.iter().map(|mean| mean.span.clone()).collect();
            let of_rows = |weight: &dyn Fn(&Mean) -> f64| {
                DMatrix::from_fn(chain.len(), count, |k, column| {
                    weight(&chain[k]) * influence[(chain[k].row, column)]
                })
            };
            let white = of_rows(&|mean| mean.white.sqrt());
            sums[0] += white.tr_mul(&white);
            for axis in 0..3 {
                let own = of_rows(&|mean| mean.drifts[axis]);
                sums[1] += self
                    .processes
                    .iter()
                    .fold(DMatrix::zeros(count, count), |sum, process| sum + process.carried(&spans, &own));
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::{flicker, interval::tests::assert_is_as_written_out},
        *,
    };

    /// Means of two chains, out of order in their rows.
    fn means() -> Semiseparable {
        let spans = [0.0..4.0, 4.0..9.0, 12.0..52.0, 52.5..53.0, 900.0..930.0];
        let of_chain = |chain: usize| {
            let mean = |k: usize| Mean {
                row: 2 * k + chain,
                span: spans[k].clone(),
                white: 0.3 / (k + 1) as f64,
                drifts: Vector3::new(0.3, -0.8, 0.5 * (k as f64).sin()),
            };
            [3, 0, 1, 4, 2].map(mean).to_vec()
        };
        Semiseparable::new((0..2).map(of_chain).collect(), flicker::of_times(&[10.0, 100.0, 1e3], 0.7))
    }

    /// D and F, written out.
    fn dense(of: &Semiseparable) -> [DMatrix<f64>; 2] {
        let mut parts = [DMatrix::zeros(10, 10), DMatrix::zeros(10, 10)];
        for chain in &of.chains {
            let spans: Vec<Span> = chain.iter().map(|mean| mean.span.clone()).collect();
            let between = flicker::covariance_of(&spans, &of.processes);
            for (i, one) in chain.iter().enumerate() {
                parts[0][(one.row, one.row)] = one.white;
                for (j, other) in chain.iter().enumerate() {
                    parts[1][(one.row, other.row)] = one.drifts.dot(&other.drifts) * between[(i, j)];
                }
            }
        }
        parts
    }

    #[test]
    fn whitening_and_what_is_carried_are_those_of_the_matrix_written_out() {
        let means = means();
        assert_is_as_written_out(&means, &dense(&means));
    }

    #[test]
    fn means_without_noise_have_no_factor() {
        let mean =
            |k: usize| Mean { row: k, span: k as f64..(k + 1) as f64, white: 0.0, drifts: Vector3::zeros() };
        let means = Semiseparable::new(vec![vec![mean(0), mean(1)]], Vec::new());
        assert!(means.whitened(1.0, [DMatrix::zeros(2, 1), DMatrix::zeros(2, 0)]).is_none());
    }
}
