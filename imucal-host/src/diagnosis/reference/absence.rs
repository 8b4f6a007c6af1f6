//! Impacts in a row that one side has and the other does not show at all.
//!
//! ```text
//! s = Σ over a stretch of   ln (P / q)         for an impact that is absent on the other side
//!                           ln ((1 − P)/(1 − q)) for one that is there
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | P | share of impacts that are absent within such a stretch |
//! | q | share of impacts that are absent outside of it: those that lie between two samples |
//!
//! Impacts that are in step with the samples are absent in a row as well: where one that is absent is followed by another
//! more often than q says, q is that share. The stretch with the largest s is found as the one with the largest sum, q is
//! estimated again without it, and so on. Source of the statistic: Kulldorff, A spatial scan statistic (1997), for a share
//! P that is given.

use std::ops::Range;

/// P.
const WITHIN: f64 = 0.8;
/// A share that few impacts show is drawn to q, or to this one, as by so many impacts.
const PRIOR: f64 = 4.0;
const USUAL: f64 = 0.02;
/// A stretch is asserted from this s on, over what the number of impacts costs.
const ASSERTED: f64 = 8.0;
/// Rounds of finding stretches and estimating q without them, and most stretches in one.
const ROUNDS: usize = 4;
const MOST: usize = 16;

/// Stretches of impacts that are absent, with their s: from whether each is absent, `None` where that cannot be seen.
pub fn absent_stretches(absent: &[Option<bool>]) -> Vec<(Range<usize>, f64)> {
    let known: Vec<usize> = (0..absent.len()).filter(|at| absent[*at].is_some()).collect();
    let is_absent: Vec<bool> = known.iter().map(|at| absent[*at] == Some(true)).collect();
    let cost = (known.len().max(1) as f64).ln();
    let mut found: Vec<(Range<usize>, f64)> = Vec::new();
    for round in 0..ROUNDS {
        let mut usual = share_outside(&is_absent, &found);
        if round > 0 {
            usual = usual.max(share_that_follows(&is_absent, &found, usual));
        }
        found = largest_sums(&is_absent, usual, cost);
    }
    let of = |(stretch, sum): (Range<usize>, f64)| {
        let last = stretch.end.checked_sub(1)?;
        Some((*known.get(stretch.start)?..known.get(last)? + 1, sum))
    };
    found.into_iter().filter(|(_, sum)| *sum > cost + ASSERTED).filter_map(of).collect()
}

/// Impacts outside of these stretches.
fn outside(count: usize, stretches: &[(Range<usize>, f64)]) -> impl Iterator<Item = usize> {
    (0..count).filter(|at| !stretches.iter().any(|(stretch, _)| stretch.contains(at)))
}

/// Share of impacts that are absent, without these stretches.
fn share_outside(is_absent: &[bool], stretches: &[(Range<usize>, f64)]) -> f64 {
    let all = outside(is_absent.len(), stretches);
    let (count, absent) = all.fold((0.0, 0.0), |(count, absent), at| {
        (count + 1.0, absent + if is_absent[at] { 1.0 } else { 0.0 })
    });
    (absent + PRIOR * USUAL) / (count + PRIOR)
}

/// Share of impacts that are absent after one that is, without these stretches; `share` of them all are absent.
fn share_that_follows(is_absent: &[bool], stretches: &[(Range<usize>, f64)], share: f64) -> f64 {
    let absent: Vec<usize> = outside(is_absent.len(), stretches).filter(|at| is_absent[*at]).collect();
    let followed = absent.windows(2).filter(|pair| pair[1] == pair[0] + 1).count();
    (followed as f64 + PRIOR * share) / (absent.len() as f64 + PRIOR)
}

/// Stretches whose sums are larger than `least`, the largest first; they do not overlap.
fn largest_sums(is_absent: &[bool], usual: f64, least: f64) -> Vec<(Range<usize>, f64)> {
    if usual >= WITHIN {
        return Vec::new();
    }
    let score =
        |absent: bool| if absent { (WITHIN / usual).ln() } else { ((1.0 - WITHIN) / (1.0 - usual)).ln() };
    let mut scores: Vec<f64> = is_absent.iter().map(|absent| score(*absent)).collect();
    let mut found = Vec::new();
    while found.len() < MOST {
        let (stretch, sum) = largest_sum(&scores);
        if sum <= least {
            break;
        }
        scores[stretch.clone()].fill(f64::NEG_INFINITY);
        found.push((stretch, sum));
    }
    found
}

/// The stretch with the largest sum (Kadane).
fn largest_sum(scores: &[f64]) -> (Range<usize>, f64) {
    let (mut best, mut largest) = (0..0, 0.0);
    let (mut from, mut sum) = (0, 0.0);
    for (at, score) in scores.iter().enumerate() {
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
    use crate::simulator::random::{Purpose, Random};

    /// Impacts of which this share is absent, each group of `alike` as a whole.
    fn impacts(count: usize, share: f64, alike: usize, seed: u64) -> Vec<Option<bool>> {
        let mut random = Random::new(seed, Purpose::Route);
        let groups: Vec<bool> = (0..=count / alike).map(|_| random.share() < share).collect();
        (0..count).map(|at| Some(groups[at / alike])).collect()
    }

    #[test]
    fn six_absent_ones_in_a_row_are_a_stretch_where_hardly_any_is_absent() {
        let mut absent = impacts(200, 0.03, 1, 3);
        absent[60..66].fill(Some(true));
        let found = absent_stretches(&absent);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].0.start <= 60 && found[0].0.end >= 66 && found[0].0.len() < 9, "{found:?}");
    }

    #[test]
    fn impacts_that_lie_between_samples_by_chance_or_in_step_are_no_stretch() {
        let mut stretches = 0;
        for seed in 0..200 {
            for (share, alike) in [(0.03, 1), (0.2, 1), (0.5, 1), (0.15, 3)] {
                stretches += absent_stretches(&impacts(300, share, alike, seed)).len();
            }
        }
        assert_eq!(stretches, 0);
    }

    #[test]
    fn nothing_is_found_among_impacts_that_cannot_be_seen() {
        assert_eq!(absent_stretches(&[]), []);
        assert_eq!(absent_stretches(&[None; 40]), []);
        assert_eq!(absent_stretches(&[Some(true); 40]), []);
    }
}
