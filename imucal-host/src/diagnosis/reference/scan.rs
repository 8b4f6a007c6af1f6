//! Stretches of a row of events over which a sum of logarithms of odds is largest.
//!
//! A stretch that is asserted must gain more than what it costs to have looked at all of them, ln N for N events, and as much
//! again as would be asked of a single one. Source: Kulldorff, A spatial scan statistic (1997); the largest sum by Kadane's algorithm.

use std::ops::Range;

/// A stretch is asserted from this sum on, beyond ln N.
const ASSERTED: f64 = 6.5;

/// Events in the order of time.
pub struct Events<'a> {
    /// Those that are looked at, as places in the whole row.
    pub known: &'a [usize],
    /// Whether no stretch reaches from the event before to this one, for the whole row.
    pub begins: &'a [bool],
}

impl Events<'_> {
    /// Stretches over which `scores`, one a known event, add up to enough, as places in the whole row, the largest first.
    pub fn asserted(&self, scores: Vec<f64>) -> Vec<(Range<usize>, f64)> {
        let whole = |(stretch, sum): (Range<usize>, f64)| {
            let last = stretch.end.checked_sub(1)?;
            Some((*self.known.get(stretch.start)?..self.known.get(last)? + 1, sum))
        };
        self.largest(scores).into_iter().filter_map(whole).collect()
    }

    /// The same as places among the known events; they do not overlap.
    pub fn largest(&self, mut scores: Vec<f64>) -> Vec<(Range<usize>, f64)> {
        let least = (self.known.len() as f64).ln() + ASSERTED;
        let begins: Vec<bool> = (0..self.known.len()).map(|at| self.begins(at)).collect();
        let mut found = Vec::new();
        loop {
            let (stretch, sum) = largest_sum(&scores, &begins);
            if sum <= least {
                return found;
            }
            scores[stretch.clone()].fill(f64::NEG_INFINITY);
            found.push((stretch, sum));
        }
    }

    fn begins(&self, at: usize) -> bool {
        let from = at.checked_sub(1).map_or(0, |before| self.known[before] + 1);
        self.begins[from..=self.known[at]].contains(&true)
    }
}

/// The stretch with the largest sum.
fn largest_sum(scores: &[f64], begins: &[bool]) -> (Range<usize>, f64) {
    let (mut best, mut largest) = (0..0, 0.0);
    let (mut from, mut sum) = (0, 0.0);
    for (at, score) in scores.iter().enumerate() {
        if begins[at] {
            (from, sum) = (at, 0.0);
        }
        sum += score;
        if sum <= 0.0 {
            (from, sum) = (at + 1, 0.0);
        } else if sum > largest {
            (best, largest) = (from..at + 1, sum);
        }
    }
    (best, largest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stretch_ends_where_a_new_one_begins_and_skips_what_is_not_known() {
        let mut begins = vec![false; 12];
        begins[6] = true;
        let known = [0, 2, 4, 5, 6, 8, 10, 11];
        let events = Events { known: &known, begins: &begins };
        let found = events.asserted(vec![-1.0, 5.0, 5.0, 5.0, 9.0, 9.0, -1.0, -1.0]);
        assert_eq!(found, [(6..9, 18.0), (2..6, 15.0)]);
    }
}
