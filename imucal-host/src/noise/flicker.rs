//! Flicker noise: a spectrum that falls as 1/f, as a sum of Gauss–Markov processes a decade apart.
//!
//! ```text
//! F(s, t) = 1/n Σ_τ exp(−|s − t| / τ),   τ = 10, 100, … s, the last no shorter than the recording
//! ```
//!
//! A recording cannot show how a sensor drifts beyond its own length, nor how far its own mean is from the mean that a
//! longer one would have: that much is assumed, on the pattern of what it can show. Source: models of flicker by
//! relaxations, van der Ziel 1950; here one a decade, which departs from 1/f by some percent.

use nalgebra::DMatrix;

use super::{Span, process::Process};

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

/// The processes of flicker of so large a variance, of a length of time as the observations have.
pub fn processes(spans: &[Span], variance: f64) -> Vec<Process> {
    of_times(&times(spans), variance)
}

/// The same with correlation times of one's own, in the spans' unit; none where there is no variance.
pub fn of_times(times: &[f64], variance: f64) -> Vec<Process> {
    let sigma = (variance / times.len() as f64).sqrt();
    let times = if sigma > 0.0 { times } else { &[] };
    times.iter().map(|time| Process { time: *time, sigma }).collect()
}

/// Covariance of the means of a sum of processes over spans that do not overlap.
pub fn covariance_of(spans: &[Span], processes: &[Process]) -> DMatrix<f64> {
    let mut covariance = DMatrix::zeros(spans.len(), spans.len());
    for process in processes {
        process.add_covariance(spans, &mut covariance);
    }
    covariance.fill_upper_triangle_with_lower_triangle();
    covariance
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slowest_part_outlasts_the_recording() {
        assert_eq!(times(&[0.0..4.0, 20.0..30.0]), [10.0, 100.0, 1000.0]);
        assert_eq!(times(&[0.0..4.0, 1995.0..2000.0]), [10.0, 100.0, 1000.0, 10_000.0]);
    }
}
