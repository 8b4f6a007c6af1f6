//! The side from which a sensor's output came to a pose: what hysteresis follows.
//!
//! ```text
//! f follows m only where it is more than d behind (play);      s = (f − m) / d
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | m | output at each sample, between poses as well: two gimbals that turn at once bring it back on its way |
//! | d | play: small next to what lies between most poses, large next to the noise |
//! | s | side, mean over a pose: −1 where m came from below, 1 from above |
//!
//! Source: the play operator, P. Krejčí, Hysteresis, Convexity and Dissipation in Hyperbolic Equations (1996), chapter II; as
//! `acc.hysteresis` has it. Not taken into account: forces of the movement.

use nalgebra::Vector3;

use crate::noise::Span;

/// Play, of the longest output.
const PLAY: f64 = 0.05;

/// Sides at poses that were held in these spans, by samples and their times, s, in order.
pub fn sides(time: &[f64], values: &[Vector3<f64>], spans: &[Span]) -> Vec<Vector3<f64>> {
    let known = || time.iter().zip(values).filter(|(_, value)| value.iter().all(|part| part.is_finite()));
    let play = PLAY * known().map(|(_, value)| value.norm()).fold(f64::MIN_POSITIVE, f64::max);
    let mut follower = known().next().map_or_else(Vector3::zeros, |(_, value)| *value);
    let mut sums = vec![(Vector3::zeros(), 0.0); spans.len()];
    let mut at = 0;
    for (time, value) in known() {
        follower = follower.zip_map(value, |f, m| f.clamp(m - play, m + play));
        while spans.get(at).is_some_and(|span| span.end < *time) {
            at += 1;
        }
        if spans.get(at).is_some_and(|span| span.start <= *time) {
            sums[at].0 += (follower - value) / play;
            sums[at].1 += 1.0;
        }
    }
    sums.into_iter().map(|(sum, count): (Vector3<f64>, f64)| sum / count.max(1.0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_is_reached_from_below_or_above_whatever_the_pose_before() {
        // Up from 0 to 5; then beyond 8 and back to 5.
        let path = [0.0, 2.0, 5.0, 5.0, 8.0, 5.0, 5.0, f64::NAN, 0.0, 0.0];
        let time: Vec<f64> = (0..path.len()).map(|k| k as f64).collect();
        let values: Vec<Vector3<f64>> = path.iter().map(|m| Vector3::new(*m, -m, 0.0)).collect();
        let span = |start: f64, end: f64| Span { start, end };
        let found = sides(&time, &values, &[span(2.0, 3.0), span(5.0, 6.0), span(8.0, 9.0)]);
        let expected = [-1.0, 1.0, 1.0].map(|side| Vector3::new(side, -side, 0.0));
        assert!(found.iter().zip(expected).all(|(found, side)| (found - side).norm() < 1e-12), "{found:?}");
    }
}
