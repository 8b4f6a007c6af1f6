//! What is said of a gap, from all that was found: the one place where a verdict is decided.

use super::shares::Closed;
use crate::diagnosis::{
    finding::{Cause, Verdict},
    location::score_test::Following,
    settings::VerdictSettings,
};

/// What was found.
#[derive(Debug)]
pub struct Evidence<'a> {
    /// Causes of the search that held-out data confirm.
    pub causes: &'a [Cause],
    /// The offset of the reference's clock, where it is a cause.
    pub clock: Option<&'a Cause>,
    /// Shares of the gap that the causes close.
    pub closed: &'a Closed,
    /// The covariate that the residual still depends on most clearly.
    pub left: Option<&'a Following>,
    /// Held-out data have refuted a cause of the search: the noise model does not hold there.
    pub refuted: bool,
    /// All causes are within the standard errors of the given model.
    pub within_model: bool,
    /// The recording itself is faulty, and the fault is named.
    pub faulty: bool,
}

impl Evidence<'_> {
    /// The verdict.
    pub fn verdict(&self, by: &VerdictSettings) -> Verdict {
        let of_search = match (self.refuted, self.causes, self.clock) {
            (true, [], None) => Verdict::Unknown,
            (true, ..) => Verdict::Partly,
            (false, [], Some(clock)) => self.judged(std::slice::from_ref(clock), by),
            (false, causes, _) => self.judged(causes, by),
        };
        let beyond_model = match of_search {
            Verdict::Explained | Verdict::Ambiguous if self.within_model => Verdict::None,
            _ if self.within_model => Verdict::Unknown,
            verdict => verdict,
        };
        match beyond_model {
            Verdict::None if self.faulty => Verdict::Explained,
            verdict => verdict,
        }
    }

    fn judged(&self, causes: &[Cause], by: &VerdictSettings) -> Verdict {
        let remainder = self.left.map_or(0.0, |left| left.size) / self.closed.explainable;
        match (causes, self.left) {
            ([], None) => Verdict::None,
            ([], Some(_)) => Verdict::Unknown,
            (_, Some(_)) if self.closed.total.value < by.explains => Verdict::Unknown,
            (_, Some(_)) if remainder > by.remainder => Verdict::Partly,
            _ if causes.iter().any(|cause| !cause.equivalents.is_empty()) => Verdict::Ambiguous,
            _ => Verdict::Explained,
        }
    }
}
