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
//! | q | share of all impacts that are absent, such as lie between two samples |
//!
//! Impacts that are in step with the samples are absent in a row as well: where, outside of the stretches that would be
//! asserted, one that is absent is followed by another more often than q says, q is that share. P is given.

use std::ops::Range;

use super::scan::Events;

/// P.
const WITHIN: f64 = 0.8;
/// A share that few impacts show is drawn to q, or to this one, as by so many impacts.
const PRIOR: f64 = 4.0;
const USUAL: f64 = 0.02;
/// Of fewer impacts that can be seen it is not known what is usual.
const FEWEST: usize = 20;

/// Stretches of impacts that are absent, with their s: from whether each is absent, `None` where that cannot be seen, and from
/// whether no stretch reaches to it from the one before.
pub fn absent_stretches(absent: &[Option<bool>], begins: &[bool]) -> Vec<(Range<usize>, f64)> {
    let known: Vec<usize> = (0..absent.len()).filter(|at| absent[*at].is_some()).collect();
    if known.len() < FEWEST {
        return Vec::new();
    }
    let is_absent: Vec<bool> = known.iter().map(|at| absent[*at] == Some(true)).collect();
    let share = share_of_all(&is_absent);
    let events = Events { known: &known, begins };
    let stretches = events.largest(scores(&is_absent, share));
    let usual = share.max(share_that_follows(&is_absent, &stretches, share));
    events.asserted(scores(&is_absent, usual))
}

/// Share of impacts that are absent.
fn share_of_all(is_absent: &[bool]) -> f64 {
    let absent = is_absent.iter().filter(|absent| **absent).count() as f64;
    (absent + PRIOR * USUAL) / (is_absent.len() as f64 + PRIOR)
}

/// Share of impacts that are absent after one that is, outside of these stretches; `share` of all are absent.
fn share_that_follows(is_absent: &[bool], stretches: &[(Range<usize>, f64)], share: f64) -> f64 {
    let is_outside = |at: &usize| !stretches.iter().any(|(stretch, _)| stretch.contains(at));
    let absent: Vec<usize> = (0..is_absent.len()).filter(|at| is_absent[*at]).filter(is_outside).collect();
    let followed = absent.windows(2).filter(|pair| pair[1] == pair[0] + 1).count();
    (followed as f64 + PRIOR * share) / (absent.len() as f64 + PRIOR)
}

/// What each impact adds to s; nothing where as many are absent as in a stretch.
fn scores(is_absent: &[bool], usual: f64) -> Vec<f64> {
    let usual = usual.min(WITHIN);
    let score =
        |absent: &bool| if *absent { (WITHIN / usual).ln() } else { ((1.0 - WITHIN) / (1.0 - usual)).ln() };
    is_absent.iter().map(score).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::random::{Purpose, Random};

    fn found(absent: &[Option<bool>]) -> Vec<(Range<usize>, f64)> {
        absent_stretches(absent, &vec![false; absent.len()])
    }

    /// Impacts of which this share is absent, each group of `alike` as a whole.
    fn impacts(count: usize, share: f64, alike: usize, seed: u64) -> Vec<Option<bool>> {
        let mut random = Random::new(seed, Purpose::Route);
        let groups: Vec<bool> = (0..=count / alike).map(|_| random.share() < share).collect();
        (0..count).map(|at| Some(groups[at / alike])).collect()
    }

    #[test]
    fn seven_absent_ones_in_a_row_are_a_stretch_where_hardly_any_is_absent() {
        let mut absent = impacts(200, 0.03, 1, 3);
        absent[60..67].fill(Some(true));
        let found = found(&absent);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].0.start <= 60 && found[0].0.end >= 67 && found[0].0.len() < 9, "{found:?}");
    }

    #[test]
    fn impacts_that_lie_between_samples_by_chance_or_in_step_are_no_stretch() {
        let mut stretches = 0;
        for seed in 0..200 {
            for (share, alike) in [(0.03, 1), (0.2, 1), (0.5, 1), (0.15, 3)] {
                stretches += found(&impacts(300, share, alike, seed)).len();
                if alike == 1 {
                    stretches += found(&impacts(80, share, alike, seed)).len();
                }
            }
        }
        assert_eq!(stretches, 0);
    }

    #[test]
    fn nothing_is_found_among_impacts_that_cannot_be_seen() {
        assert_eq!(found(&[]), []);
        assert_eq!(found(&[None; 40]), []);
        assert_eq!(found(&[Some(true); 40]), []);
        assert_eq!(found(&[Some(true); 5]), []);
    }
}
