//! Knots of drifts: instants at which they are estimated, and by how much each observation counts them there.
//!
//! | observations | knots | an observation's drift |
//! | --- | --- | --- |
//! | at instants | evenly spaced | on the straight line between two knots |
//! | means over spans | the spans' ends | [`Process::mean_given_ends`]; what that leaves is the observation's own |

use super::{Span, process::Process};

/// Knots in order of time, and rows that count them.
#[derive(Clone, Debug)]
pub struct Knots {
    /// Where they are.
    pub(super) spacing: Spacing,
    rows: Vec<Row>,
}

/// How far knots are from one another.
#[derive(Clone, Debug)]
pub struct Spacing {
    /// Distances from a knot to the next, s, and how many in succession are the same.
    distances: Vec<(f64, usize)>,
    /// Number of knots.
    pub count: usize,
}

/// One observation.
#[derive(Clone, Debug)]
pub(super) struct Row {
    /// The first of the two knots that it counts.
    pub knot: usize,
    /// By how much it counts the first drift at them.
    pub weights: [f64; 2],
    /// By how much more it counts each further drift, at both alike.
    pub more: Vec<f64>,
}

/// What goes on from one knot to the next: φ, q, and how many times in succession.
pub(super) type Transition = (f64, f64, usize);

impl Knots {
    /// Of observations at instants, s, increasing, on knots that are `spacing` apart, s.
    pub fn at(times: &[f64], spacing: f64) -> Self {
        let start = times.first().copied().unwrap_or(0.0);
        let length = times.last().copied().unwrap_or(0.0) - start;
        let count = ((length / spacing).ceil() as usize + 1).max(2);
        let row = |time: &f64| {
            let at = (time - start) / spacing;
            let knot = (at.floor() as usize).min(count - 2);
            let share = at - knot as f64;
            Row { knot, weights: [1.0 - share, share], more: Vec::new() }
        };
        let rows = times.iter().map(row).collect();
        Self { spacing: Spacing { distances: vec![(spacing, count - 1)], count }, rows }
    }

    /// Of means over spans in time order that do not overlap, of some drifts; one that begins where another ends shares a
    /// knot with it.
    pub fn over(spans: &[Span], drifts: &[Process]) -> Self {
        let (mut distances, mut rows) =
            (Vec::with_capacity(2 * spans.len()), Vec::with_capacity(spans.len()));
        for (k, span) in spans.iter().enumerate() {
            if k > 0 {
                let gap = span.start - spans[k - 1].end;
                distances.extend((gap > 0.0).then_some((gap, 1)));
            }
            let length = span.end - span.start;
            let mut shares = drifts.iter().map(|drift| drift.mean_given_ends(length).0);
            let first = shares.next().unwrap_or(0.0);
            let more = shares.map(|share| share - first).collect();
            rows.push(Row { knot: distances.len(), weights: [first; 2], more });
            distances.push((length, 1));
        }
        Self { spacing: Spacing { count: distances.len() + 1, distances }, rows }
    }

    pub(super) fn rows(&self) -> &[Row] {
        &self.rows
    }
}

impl Spacing {
    /// How a drift goes on from each knot to the next.
    pub(super) fn transitions(&self, drift: &Process) -> impl Iterator<Item = Transition> {
        self.distances
            .iter()
            .map(|(distance, times)| (drift.kept(*distance), drift.innovation(*distance), *times))
    }

    /// ln of the determinant of a drift's covariance at all knots.
    pub(super) fn log_determinant(&self, drift: &Process) -> f64 {
        let innovations: f64 = self.transitions(drift).map(|(_, q, times)| times as f64 * q.ln()).sum();
        innovations + 2.0 * drift.sigma.ln()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_that_touch_share_a_knot() {
        let knots = Knots::over(&[0.0..4.0, 4.0..5.0, 7.0..9.0], &[Process { time: 10.0, sigma: 1.0 }]);
        assert_eq!(knots.spacing.count, 5);
        assert_eq!(knots.rows.iter().map(|row| row.knot).collect::<Vec<_>>(), [0, 1, 3]);
        assert_eq!(knots.spacing.distances, [(4.0, 1), (1.0, 1), (2.0, 1), (2.0, 1)]);
    }

    #[test]
    fn an_instant_is_on_the_line_between_its_knots() {
        let knots = Knots::at(&[1.0, 2.0, 5.0], 2.5);
        let found: Vec<(usize, [f64; 2])> = knots.rows.iter().map(|row| (row.knot, row.weights)).collect();
        assert_eq!((knots.spacing.count, found[0], found[1]), (3, (0, [1.0, 0.0]), (0, [0.6, 0.4])));
        assert!((found[2].1[1] - 0.6).abs() < 1e-12 && found[2].0 == 1);
    }
}
