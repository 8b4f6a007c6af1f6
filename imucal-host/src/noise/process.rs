//! A drift: a first-order Gauss–Markov process, at instants and as means over spans of time.
//!
//! ```text
//! k_{i+1} = φ k_i + ε_i      φ = exp(−Δ / τ)      ε ~ N(0, q)      q = σ² (1 − φ²)      k_0 ~ N(0, σ²)
//! mean over a span = c (k_begin + k_end) + η      c = tanh(a/2) / a      η ~ N(0, 2 σ² (a − 2 tanh(a/2)) / a²)
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | Δ | time from one instant to the next, s |
//! | τ, σ | correlation time, s; standard deviation |
//! | a | length of the span over τ |
//!
//! The precision of its values in succession is tridiagonal; means over spans that do not overlap depend on each other by
//! the ends of the spans alone. Source: A. Gelb, Applied Optimal Estimation (1974), ch. 3.8.

use nalgebra::{DMatrix, DVector};

use super::Span;

/// Below this, differences of exponentials lose digits that their series keep.
const SMALL: f64 = 0.02;

/// A first-order Gauss–Markov process.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Process {
    /// τ, s.
    pub time: f64,
    /// σ, unit of the channel; positive.
    pub sigma: f64,
}

impl Process {
    /// φ over this time, s.
    pub fn kept(&self, distance: f64) -> f64 {
        libm::exp(-distance / self.time)
    }

    /// q over this time, s.
    pub fn innovation(&self, distance: f64) -> f64 {
        let kept = self.kept(distance);
        self.sigma * self.sigma * (1.0 - kept * kept)
    }

    /// The mean over a span so long, s, given the values at its ends: c and the variance of η.
    pub fn mean_given_ends(&self, length: f64) -> (f64, f64) {
        let a = length / self.time;
        let variance = self.sigma * self.sigma;
        if a < SMALL {
            let a2 = a * a;
            return (0.5 - a2 / 24.0, variance * a * (1.0 / 6.0 - a2 / 60.0 + 17.0 * a2 * a2 / 10_080.0));
        }
        let tanh = libm::tanh(0.5 * a);
        (tanh / a, 2.0 * variance * (a - 2.0 * tanh) / (a * a))
    }

    /// Variance of the mean over a span so long, s.
    pub fn variance_of_mean(&self, length: f64) -> f64 {
        let (share, left) = self.mean_given_ends(length);
        2.0 * share * share * self.sigma * self.sigma * (1.0 + self.kept(length)) + left
    }

    /// By how much the value at an end of a span so long, s, varies with the mean over it, over σ²: (1 − e^−a) / a.
    pub fn share_of_end(&self, length: f64) -> f64 {
        let a = length / self.time;
        if a > 0.0 { -libm::expm1(-a) / a } else { 1.0 }
    }

    /// Covariance of the means over two spans that do not overlap.
    pub fn covariance_of_means(&self, one: &Span, other: &Span) -> f64 {
        let [a, b] = [one, other].map(|span| span.end - span.start);
        self.sigma * self.sigma * self.kept(gap(one, other)) * self.share_of_end(a) * self.share_of_end(b)
    }

    /// Adds the covariance of the means over spans that do not overlap, below the diagonal and on it.
    pub fn add_covariance(&self, spans: &[Span], to: &mut DMatrix<f64>) {
        let variance = self.sigma * self.sigma;
        let shares: Vec<f64> = spans.iter().map(|span| self.share_of_end(span.end - span.start)).collect();
        for (j, other) in spans.iter().enumerate() {
            to[(j, j)] += self.variance_of_mean(other.end - other.start);
            for (i, one) in spans.iter().enumerate().skip(j + 1) {
                to[(i, j)] += variance * self.kept(gap(one, other)) * shares[i] * shares[j];
            }
        }
    }

    /// Aᵀ F A, F the covariance of the means over spans in time order that do not overlap; A has a row for each.
    pub fn carried(&self, spans: &[Span], influence: &DMatrix<f64>) -> DMatrix<f64> {
        let count = influence.ncols();
        let mut sum = DMatrix::zeros(count, count);
        // By what all means so far go on: Σ A_j e^(−(t − end_j)/τ) s_j.
        let (mut before, mut at) = (DVector::zeros(count), f64::NEG_INFINITY);
        for (span, row) in spans.iter().zip(influence.row_iter()) {
            let (row, length) = (row.transpose(), span.end - span.start);
            let share = self.share_of_end(length);
            before *= self.kept((span.start - at).max(0.0));
            sum.ger(share, &row, &before, 1.0);
            sum.ger(share, &before, &row, 1.0);
            sum.ger(self.variance_of_mean(length) / (self.sigma * self.sigma), &row, &row, 1.0);
            before *= self.kept(length);
            before.axpy(share, &row, 1.0);
            at = span.end;
        }
        sum * (self.sigma * self.sigma)
    }
}

/// Time between two spans, s.
fn gap(one: &Span, other: &Span) -> f64 {
    (other.start - one.end).max(one.start - other.end).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::{super::flicker, *};

    const PROCESS: Process = Process { time: 10.0, sigma: 0.7 };

    /// The double integral of the process' covariance.
    fn integrated(one: &Span, other: &Span) -> f64 {
        let at = |span: &Span, k: i32| span.start + (span.end - span.start) * (f64::from(k) + 0.5) / 400.0;
        let mut sum = 0.0;
        for k in 0..400 {
            for l in 0..400 {
                sum += PROCESS.kept((at(one, k) - at(other, l)).abs());
            }
        }
        PROCESS.sigma * PROCESS.sigma * sum / 160_000.0
    }

    #[test]
    fn means_vary_together_as_the_double_integral_says() {
        let spans = [0.0..4.0, 6.5..9.0, 12.0..52.0];
        let found = flicker::covariance_of(&spans, &[PROCESS]);
        for (i, one) in spans.iter().enumerate() {
            for (j, other) in spans.iter().enumerate() {
                let expected = integrated(one, other);
                assert!((found[(i, j)] - expected).abs() < 1e-5, "{i} {j}: {} {expected}", found[(i, j)]);
            }
        }
    }

    #[test]
    fn sums_of_means_vary_as_their_covariance_says() {
        let spans = [0.0..4.0, 4.0..9.0, 12.0..52.0, 52.5..53.0];
        let influence = DMatrix::from_fn(4, 3, |k, column| ((5 * k + column) as f64).sin());
        let covariance = flicker::covariance_of(&spans, &[PROCESS]);
        let expected = influence.tr_mul(&(covariance * &influence));
        assert!((PROCESS.carried(&spans, &influence) - expected).amax() < 1e-12);
    }

    #[test]
    fn series_go_over_into_the_closed_forms() {
        for length in [SMALL * PROCESS.time * (1.0 - 1e-9), SMALL * PROCESS.time * (1.0 + 1e-9)] {
            let a = length / PROCESS.time;
            let (share, left) = PROCESS.mean_given_ends(length);
            let (expected, tanh) = ((0.5 * a).tanh() / a, (0.5 * a).tanh());
            assert!((share - expected).abs() < 1e-8, "{share} {expected}");
            assert!((left / 0.49 - 2.0 * (a - 2.0 * tanh) / (a * a)).abs() < 1e-11, "{left}");
        }
    }
}
