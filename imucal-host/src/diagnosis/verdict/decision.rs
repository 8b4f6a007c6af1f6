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
    /// Terms of the reference's clock that are causes.
    pub clock: &'a [Cause],
    /// Shares of the gap that the causes close.
    pub closed: &'a Closed,
    /// Whitened square of what can be explained of the gap that a remainder is held against: along a stream without its clock,
    /// since any other cause is small against an offset of the clock.
    pub explainable: f64,
    /// The covariate that the residual still depends on most clearly.
    pub left: Option<&'a Following>,
    /// Held-out data have refuted a cause of the search: the noise model does not hold there.
    pub refuted: bool,
    /// What the data show is the opposite of an effect, which it cannot be.
    pub opposite: bool,
    /// All causes are within the standard errors of the given model.
    pub within_model: bool,
    /// The recording itself is faulty, and the fault is named.
    pub faulty: bool,
    /// What no effect explains was taken for noise, far above that of the samples.
    pub swallowed: bool,
}

impl Evidence<'_> {
    /// The verdict.
    pub fn verdict(&self, by: &VerdictSettings) -> Verdict {
        let of_search = match (self.refuted, self.causes, self.clock) {
            (true, [], []) => Verdict::Unknown,
            (true, ..) => Verdict::Partly,
            (false, [], clock) => self.judged(clock, by),
            (false, causes, _) => self.judged(causes, by),
        };
        let beyond_model = match of_search {
            Verdict::Explained | Verdict::Ambiguous if self.within_model => Verdict::None,
            _ if self.within_model => Verdict::Unknown,
            verdict => verdict,
        };
        match beyond_model {
            Verdict::None if self.swallowed => Verdict::Unknown,
            Verdict::Explained | Verdict::Ambiguous if self.swallowed => Verdict::Partly,
            Verdict::None if self.faulty => Verdict::Explained,
            verdict => verdict,
        }
    }

    fn judged(&self, causes: &[Cause], by: &VerdictSettings) -> Verdict {
        let remainder = self.left.map_or(0.0, |left| left.size) / self.explainable;
        match (causes, self.left) {
            ([], None) if !self.opposite => Verdict::None,
            ([], _) => Verdict::Unknown,
            (_, Some(_)) if self.closed.total.value < by.explains => Verdict::Unknown,
            (_, Some(_)) if remainder > by.remainder => Verdict::Partly,
            _ if causes.iter().any(|cause| !cause.equivalents.is_empty()) => Verdict::Ambiguous,
            _ => Verdict::Explained,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        diagnosis::{settings::Settings, verdict::shares::Share},
        recording::SensorKind,
    };

    fn cause(equivalents: &[&str]) -> Cause {
        Cause {
            effect: "mag.bias_step".into(),
            probability: 0.9,
            equivalents: equivalents.iter().map(|name| (*name).to_owned()).collect(),
            parameters: Vec::new(),
            material: true,
            gap_closed: Some(0.9),
            gap_closed_ci95: None,
        }
    }

    fn closed(share: f64) -> Closed {
        Closed { total: Share { value: share, interval: [share; 2] }, each: Vec::new(), explainable: 100.0 }
    }

    fn left(size: f64) -> Following {
        let (driver, detail) = ("rate".to_owned(), String::new());
        Following { kind: SensorKind::Mag, driver, detail, size, p_value: 1e-9 }
    }

    /// By causes, the share that they close, and the size of what still follows a covariate, of 100.
    fn verdict(causes: &[Cause], share: f64, size: Option<f64>) -> Verdict {
        decided(causes, share, size, |_| {})
    }

    fn decided(
        causes: &[Cause],
        share: f64,
        size: Option<f64>,
        alter: impl Fn(&mut Evidence<'_>),
    ) -> Verdict {
        let (closed, left) = (closed(share), size.map(left));
        let mut evidence = Evidence {
            causes,
            clock: &[],
            closed: &closed,
            explainable: closed.explainable,
            left: left.as_ref(),
            refuted: false,
            opposite: false,
            within_model: false,
            faulty: false,
            swallowed: false,
        };
        alter(&mut evidence);
        evidence.verdict(&Settings::default().verdict)
    }

    #[test]
    fn without_a_cause_it_is_the_residual_that_decides() {
        assert_eq!(verdict(&[], 0.0, None), Verdict::None);
        assert_eq!(verdict(&[], 0.0, Some(50.0)), Verdict::Unknown);
        assert_eq!(decided(&[], 0.0, None, |evidence| evidence.faulty = true), Verdict::Explained);
    }

    #[test]
    fn a_cause_explains_as_much_as_it_leaves_nothing() {
        let causes = [cause(&[])];
        assert_eq!(verdict(&causes, 0.95, None), Verdict::Explained);
        assert_eq!(verdict(&causes, 0.95, Some(60.0)), Verdict::Partly);
        assert_eq!(verdict(&causes, 0.0, Some(60.0)), Verdict::Unknown);
        assert_eq!(verdict(&[cause(&["mag.bias_drift"])], 0.95, None), Verdict::Ambiguous);
    }

    #[test]
    fn a_gap_that_was_taken_for_noise_is_not_explained() {
        let swallowed = |evidence: &mut Evidence<'_>| evidence.swallowed = true;
        assert_eq!(decided(&[], 0.0, None, swallowed), Verdict::Unknown);
        assert_eq!(decided(&[cause(&[])], 0.95, None, swallowed), Verdict::Partly);
    }

    #[test]
    fn a_refuted_cause_leaves_no_sure_answer() {
        let refuted = |evidence: &mut Evidence<'_>| evidence.refuted = true;
        assert_eq!(decided(&[], 0.0, None, refuted), Verdict::Unknown);
        assert_eq!(decided(&[cause(&[])], 0.95, None, refuted), Verdict::Partly);
    }

    #[test]
    fn the_opposite_of_an_effect_is_a_gap_without_a_cause() {
        let opposite = |evidence: &mut Evidence<'_>| evidence.opposite = true;
        assert_eq!(decided(&[], 0.0, None, opposite), Verdict::Unknown);
        assert_eq!(decided(&[cause(&[])], 0.95, None, opposite), Verdict::Explained);
    }

    #[test]
    fn what_a_given_model_may_err_by_is_no_gap() {
        let within = |evidence: &mut Evidence<'_>| evidence.within_model = true;
        assert_eq!(decided(&[cause(&[])], 0.95, None, within), Verdict::None);
        assert_eq!(decided(&[cause(&[])], 0.95, Some(60.0), within), Verdict::Unknown);
    }

    #[test]
    fn the_clock_of_the_reference_is_a_cause_where_no_other_is() {
        let clock = [cause(&[])];
        let decided = |size: Option<f64>| {
            let left = size.map(left);
            let evidence = Evidence {
                causes: &[],
                clock: &clock,
                closed: &closed(0.9),
                explainable: 1.0,
                left: left.as_ref(),
                refuted: false,
                opposite: false,
                within_model: false,
                faulty: false,
                swallowed: false,
            };
            evidence.verdict(&Settings::default().verdict)
        };
        assert_eq!(decided(None), Verdict::Explained);
        // A hundredth of the gap that the clock makes, and all of the gap that it does not.
        assert_eq!(decided(Some(1.0)), Verdict::Partly);
    }
}
