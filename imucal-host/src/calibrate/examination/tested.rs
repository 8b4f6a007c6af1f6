//! Score tests of one sensor and which of them are suspicions: those that chance hardly passes and that are material.

use super::{
    examine::{CHANCE, MATERIAL},
    gyr_residual::Columns,
};
use crate::calibrate::{
    fit::score_test::Score,
    outcome::entry_name,
    suspicion::{Follows, Suspicion},
};

/// A test and what it came to.
pub(super) struct Tested {
    pub(super) follows: Follows,
    pub(super) name: String,
    pub(super) score: Score,
}

impl Tested {
    pub(super) fn of(columns: &Columns, score: Score) -> Self {
        Self { follows: columns.follows, name: columns.name.clone(), score }
    }

    /// The entry that would move furthest, by how much, and in standard errors.
    fn furthest(&self, entries: &[u8], std: &[f64]) -> Option<(u8, f64, f64)> {
        let moved = self.score.shift.iter().zip(std).zip(entries);
        moved
            .filter(|((_, std), _)| **std > 0.0)
            .map(|((shift, std), entry)| (*entry, *shift, shift.abs() / (std * self.score.tighter)))
            .max_by(|a, b| a.2.total_cmp(&b.2))
    }
}

/// Of each thing that is followed, the test that chance passes least, where it is material.
pub(super) fn judged(mut tests: Vec<Tested>, entries: &[u8], std: &[f64]) -> Vec<Suspicion> {
    let count = tests.len() as f64;
    tests.sort_by(|a, b| a.score.p.total_cmp(&b.score.p));
    let mut found: Vec<Suspicion> = Vec::new();
    for test in tests {
        let chance = test.score.p * count;
        let Some((entry, shift, errors)) = test.furthest(entries, std) else { continue };
        if chance >= CHANCE || errors < MATERIAL || found.iter().any(|s| s.follows == test.follows) {
            continue;
        }
        found.push(Suspicion {
            follows: test.follows,
            detail: format!(
                "its residual follows {} (p = {:.0e}), which explains {:.0} % of the residual's square; \
                 with it {} would change by {:.2e}, {:.0} standard errors",
                test.name,
                chance.max(1e-99),
                100.0 * test.score.explained,
                entry_name(entry),
                shift,
                errors
            ),
        });
    }
    found
}
