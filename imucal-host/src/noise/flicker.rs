//! Flicker noise: a spectrum that falls as 1/f, as a sum of Gauss–Markov processes a decade apart.
//!
//! ```text
//! F(s, t) = 1/n Σ_τ exp(−|s − t| / τ),   τ = 10, 100, … s, the last no shorter than the recording
//! ```
//!
//! A recording cannot tell how a sensor drifts beyond its own length, nor how far its own mean is from the mean that a
//! longer one would have: that much is assumed, on the pattern of what it can tell. Source: models of flicker by
//! relaxations, van der Ziel 1950; here one a decade, which departs from 1/f by some percent.

use nalgebra::DMatrix;

use super::Span;

/// The shortest correlation time, s; a faster drift averages out in a rest, as white noise does.
const SHORTEST: f64 = 10.0;
/// Correlation times at least: drift does not end with a short recording.
const LEAST: usize = 3;

/// Correlation times for observations in time order, s.
pub fn times(spans: &[Span]) -> Vec<f64> {
    let length = spans.first().zip(spans.last()).map_or(0.0, |(first, last)| last.end - first.start);
    let mut times = vec![SHORTEST];
    while times.len() < LEAST || times.last().is_some_and(|time| *time < length) && times.len() < 8 {
        times.push(SHORTEST * 10f64.powi(times.len() as i32));
    }
    times
}

/// Covariance of the means of unit flicker over spans that do not overlap, s.
pub fn covariance(spans: &[Span]) -> DMatrix<f64> {
    covariance_over(spans, &times(spans))
}

/// The same with correlation times of one's own, in the spans' unit.
pub fn covariance_over(spans: &[Span], times: &[f64]) -> DMatrix<f64> {
    DMatrix::from_fn(spans.len(), spans.len(), |i, j| {
        let both =
            |time: &f64| if i == j { within(&spans[i], *time) } else { between(&spans[i], &spans[j], *time) };
        times.iter().map(both).sum::<f64>() / times.len() as f64
    })
}

/// Variance of a mean.
fn within(span: &Span, time: f64) -> f64 {
    let x = (span.end - span.start) / time;
    // 1 − x/3 + x²/12 … where the difference would lose its digits.
    if x < 1e-3 { 1.0 - x / 3.0 } else { 2.0 * (x - 1.0 + (-x).exp()) / (x * x) }
}

/// Covariance of two means: e^(−gap/τ) (1 − e^−a)(1 − e^−b) / ab, a and b their lengths over τ.
fn between(one: &Span, other: &Span, time: f64) -> f64 {
    let gap = (other.start - one.end).max(one.start - other.end).max(0.0);
    let share = |span: &Span| {
        let x = (span.end - span.start) / time;
        if x > 0.0 { -(-x).exp_m1() / x } else { 1.0 }
    };
    (-gap / time).exp() * share(one) * share(other)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_vary_together_as_the_double_integral_says() {
        let spans = [0.0..4.0, 6.5..9.0, 300.0..312.0];
        let found = covariance(&spans);
        let times = times(&spans);
        for i in 0..3 {
            for j in 0..3 {
                let (one, other) = (&spans[i], &spans[j]);
                let at =
                    |span: &Span, k: i32| span.start + (span.end - span.start) * (f64::from(k) + 0.5) / 200.0;
                let kernel =
                    |s: f64, t: f64| times.iter().map(|time| (-(s - t).abs() / time).exp()).sum::<f64>();
                let sum: f64 = (0..200)
                    .flat_map(|k| (0..200).map(move |l| (k, l)))
                    .map(|(k, l)| kernel(at(one, k), at(other, l)))
                    .sum();
                let expected = sum / (200.0 * 200.0 * times.len() as f64);
                assert!((found[(i, j)] - expected).abs() < 1e-5, "{i} {j}: {} {expected}", found[(i, j)]);
            }
        }
    }

    #[test]
    fn the_slowest_part_outlasts_the_recording() {
        assert_eq!(times(&[0.0..4.0, 20.0..30.0]), [10.0, 100.0, 1000.0]);
        assert_eq!(times(&[0.0..4.0, 1995.0..2000.0]), [10.0, 100.0, 1000.0, 10_000.0]);
    }
}
