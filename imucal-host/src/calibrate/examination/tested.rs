//! Score tests of one sensor and which of them are suspicions: those that chance hardly passes and that are material.

use nalgebra::DVector;

use super::{
    examine::{CHANCE, MATERIAL},
    gyr_residual::Columns,
};
use crate::calibrate::{
    fit::score_test::{Score, ScoreTest},
    suspicion::{Follows, Suspicion},
};

/// Share of the squared residual of a cloud's samples below which nothing is said: of so many any slow noise passes a test, and what
/// follows time is slow; what follows direction comes back with it.
pub(super) fn least_of_many(follows: Follows) -> f64 {
    if follows == Follows::Direction { 0.015 } else { 0.04 }
}

/// A test and what it came to.
pub(super) struct Tested {
    pub(super) follows: Follows,
    pub(super) name: String,
    pub(super) score: Score,
    /// By how much the entries change over the observations, to either side of the mean; `None` where the term is no change of
    /// them, or slow noise may change them alike.
    pub(super) change: Option<DVector<f64>>,
}

impl Tested {
    pub(super) fn new(follows: Follows, name: String, score: Score) -> Self {
        Self { follows, name, score, change: None }
    }

    pub(super) fn of(columns: &Columns, score: Score) -> Self {
        Self::new(columns.follows, columns.name.clone(), score)
    }

    /// Each observation of so many rows, of which `rank` are independent, against all others.
    pub(super) fn alone(
        test: &ScoreTest,
        each: usize,
        rank: usize,
        rows: usize,
        name: &dyn Fn(usize) -> String,
    ) -> Vec<Self> {
        let alone = |k: usize| {
            let score = test.test_alone(each * k..each * (k + 1), rank)?;
            let name = format!("{} alone, against its neighbours", name(k));
            Some(Self::new(Follows::Neighbours, name, score))
        };
        (0..rows / each).filter_map(alone).collect()
    }

    /// The entry that would move or changes furthest, by how much, and in standard errors.
    fn furthest(&self, entries: &[u8], std: &[f64]) -> Option<(u8, f64, f64)> {
        let moved = self.score.shift.iter().zip(std).zip(entries);
        let changed = self.change.iter().flatten().zip(std).zip(entries);
        moved
            .chain(changed)
            .filter(|((_, std), _)| **std > 0.0)
            .map(|((shift, std), entry)| (*entry, *shift, shift.abs() / (std * self.score.tighter)))
            .max_by(|a, b| a.2.total_cmp(&b.2))
    }
}

/// Of each thing that is followed, the test that chance passes least, where it is material; `name` names an entry.
pub(super) fn judged(
    tests: Vec<Tested>,
    entries: &[u8],
    std: &[f64],
    name: fn(u8) -> String,
) -> Vec<Suspicion> {
    judged_by(CHANCE, tests, entries, std, name)
}

/// The same by a probability of one's own.
pub(super) fn judged_by(
    most: f64,
    mut tests: Vec<Tested>,
    entries: &[u8],
    std: &[f64],
    name: fn(u8) -> String,
) -> Vec<Suspicion> {
    let count = tests.len() as f64;
    tests.sort_by(|a, b| a.score.p.total_cmp(&b.score.p));
    let mut found: Vec<Suspicion> = Vec::new();
    for test in tests {
        let chance = test.score.p * count;
        let Some((entry, shift, errors)) = test.furthest(entries, std) else { continue };
        if chance >= most || errors < MATERIAL || found.iter().any(|s| s.follows == test.follows) {
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
                name(entry),
                shift,
                errors
            ),
        });
    }
    found
}
