//! Which terms are kept, by slices of one iteration each.

use heapless::Vec;
use nalgebra::SMatrix;

use super::evidence::{Evidence, FORM, Groups, P, Part, Theta};
use crate::{
    accept::{f_score::f_score, outlier},
    model::{Model, SquaredSum},
    session::{evidence::Used, judgement::wider},
    solver::{LevenbergMarquardt, lm::Settings},
    temperature::TemperatureTerms,
};

/// Standard normal score of the chance with which a group is kept that is none: 1e-3.
const SCORE: f32 = 3.09;

/// Steps of a fit of terms of the order.
const ORDER_ITERATIONS: u16 = 8;

/// A fit with some terms, and what speaks for it.
#[derive(Clone, Copy, Debug)]
struct Level {
    groups: Groups,
    theta: Theta,
    /// Sum of squared residuals, of terms of temperature and of terms of the order.
    squares: f32,
    by_order: f32,
    /// Sum of squared residuals at temperatures held out.
    held_out: f32,
    /// Every fit of it ended at a minimum.
    whole: bool,
}

impl Level {
    fn new(groups: Groups, theta: Theta) -> Self {
        Self { groups, theta, squares: 0.0, by_order: f32::INFINITY, held_out: 0.0, whole: true }
    }
}

/// Terms of temperature of one sensor, under way.
#[derive(Clone, Debug)]
pub(super) struct Ladder<const N: usize> {
    pub(super) evidence: Evidence<N>,
    pub(super) solver: LevenbergMarquardt<f32, P>,
    best: Option<Level>,
    trial: Level,
    part: Part,
    start: Theta,
    /// Outliers have been left out.
    refined: bool,
    /// The terms that are kept are fitted once more, for their errors.
    last: bool,
    /// Nothing is left to be done.
    done: bool,
}

impl<const N: usize> Ladder<N> {
    pub(super) fn new(evidence: Evidence<N>, start: Theta) -> Self {
        Self {
            evidence,
            solver: LevenbergMarquardt::new(start, Default::default()),
            best: None,
            trial: Level::new(Groups::NONE, start),
            part: Part::Whole,
            start,
            refined: false,
            last: false,
            done: false,
        }
    }

    /// One iteration, or the choice of what is fitted next; false once all is done.
    #[inline(never)]
    pub(super) fn step(&mut self) -> bool {
        if self.done {
            return false;
        }
        let stopped = self.solver.step(&self.evidence.model(self.trial.groups, self.part));
        if let Some(stopped) = stopped {
            self.take(stopped.was_successful());
        }
        true
    }

    /// Terms that are kept, once all is done.
    pub(super) fn kept(&self) -> Option<Groups> {
        self.best.map(|best| best.groups).filter(|groups| self.done && *groups != Groups::NONE)
    }

    fn take(&mut self, ended: bool) {
        if self.last {
            return self.end(ended);
        }
        // Terms of the order are compared as far as they came.
        self.trial.whole &= ended || self.part == Part::Order;
        match self.part {
            Part::Whole => {
                self.trial.theta = *self.solver.theta();
                self.trial.squares = self.solver.factor().squared_sum();
            }
            Part::Order => self.trial.by_order = self.solver.factor().squared_sum(),
            Part::Without(block) => self.trial.held_out += self.squares_of(Part::Block(block)),
            Part::Block(_) | Part::Rest(_) => {}
        }
        match self.next() {
            Some(part) => self.begin(part),
            None => self.weigh(),
        }
    }

    /// What is fitted next of the trial. One whose fit has failed is not tried further.
    fn next(&self) -> Option<Part> {
        if !self.trial.whole {
            return None;
        }
        let from = match self.part {
            Part::Whole if self.trial.groups != Groups::NONE => return Some(Part::Order),
            Part::Whole | Part::Order => 0,
            Part::Without(block) => block.saturating_add(1),
            Part::Block(_) | Part::Rest(_) => return None,
        };
        (from..self.evidence.blocks()).find(|block| self.evidence.in_block(*block) > 0).map(Part::Without)
    }

    fn begin(&mut self, part: Part) {
        let (mut from, mut settings) = (self.trial.theta, Settings::default());
        if part == Part::Order {
            // From the triad alone, and not far from it: the order has no reason to fit.
            (from, settings.iterations) = (FORM.theta(&FORM.cold(&from)), ORDER_ITERATIONS);
        }
        (self.part, self.solver) = (part, LevenbergMarquardt::new(from, settings));
    }

    /// The trial is compared with the best so far; the next one begins.
    #[inline(never)]
    fn weigh(&mut self) {
        let trial = self.trial;
        let better = match &self.best {
            None => trial.whole,
            Some(best) => self.is_borne_out(&trial, best),
        };
        if better {
            self.best = Some(trial);
        }
        let Some(best) = self.best else {
            self.done = true;
            return;
        };
        match self.after(trial.groups, best.groups) {
            Some(groups) => self.trial = Level::new(groups, best.theta),
            None if best.groups == Groups::NONE => {
                self.done = true;
                return;
            }
            None => (self.trial, self.last) = (best, true),
        }
        self.begin(Part::Whole);
    }

    /// What is tried after some terms: those of the bias, those of the scale next to what is kept, and both, since either alone may hide
    /// behind the other.
    fn after(&self, tried: Groups, kept: Groups) -> Option<Groups> {
        let (bias, scale) = (Groups::BIAS, Groups::SCALE);
        if tried == Groups::NONE {
            return Some(bias);
        }
        let offered = self.evidence.offered();
        let next = if tried.has(scale) { bias.and(scale) } else { kept.and(scale) };
        (offered.has(scale) && next != tried && next != kept && !tried.has(offered)).then_some(next)
    }

    /// Chance hardly explains it, the order explains it less, and temperatures held out are predicted better.
    fn is_borne_out(&self, trial: &Level, best: &Level) -> bool {
        let freedom = self.evidence.rows().saturating_sub(self.evidence.parameters(trial.groups));
        let added = trial.groups.count().saturating_sub(best.groups.count());
        let f = (best.squares - trial.squares) / added as f32 / (trial.squares / freedom as f32);
        let score = f_score(f, added as f32, freedom as f32);
        let by_temperature = trial.squares < trial.by_order;
        trial.whole && score > SCORE && by_temperature && trial.held_out < best.held_out
    }

    /// The terms kept are fitted; once, gross outliers are left out and all is weighed without them.
    fn end(&mut self, ended: bool) {
        if !ended {
            self.best = None;
        }
        let left = self.without_outliers();
        self.done = !ended || self.refined || left == self.evidence.used;
        if !self.done {
            self.evidence.used = left;
            let start = self.start;
            (self.best, self.refined, self.last) = (None, true, false);
            self.trial = Level::new(Groups::NONE, start);
            self.begin(Part::Whole);
        }
    }

    /// Sum of squared residuals of some rests at the solver's parameters.
    fn squares_of(&self, part: Part) -> f32 {
        let mut sum = SquaredSum(0.0);
        self.evidence.model(self.trial.groups, part).rows(self.solver.theta(), &mut sum);
        sum.0
    }

    fn without_outliers(&self) -> Used {
        let all = self.evidence.used;
        let mut left = all;
        let mut sizes: Vec<f32, N> = Vec::new();
        let used = |at: &usize| all.has(*at);
        for at in (0..self.evidence.means.len()).filter(used) {
            let _room = sizes.push(libm::sqrtf(self.squares_of(Part::Rest(at))));
        }
        if let Some(limit) = outlier::gross(&sizes) {
            let found = (0..self.evidence.means.len()).filter(used).zip(&sizes);
            found.filter(|(_, size)| **size > limit).for_each(|(at, _)| left.leave_out(at));
        }
        left
    }

    /// Without the terms that are not kept.
    pub(super) fn only_kept(&self, terms: TemperatureTerms<f32>) -> TemperatureTerms<f32> {
        let keep =
            |group: Groups, slope: [f32; 3]| if self.trial.groups.has(group) { slope } else { [0.0; 3] };
        TemperatureTerms {
            bias_slope: keep(Groups::BIAS, terms.bias_slope),
            scale_slope: keep(Groups::SCALE, terms.scale_slope),
            ..terms
        }
    }

    /// Covariance of all parameters: of the residuals' variance, and wider by what few of them leave open.
    #[inline(never)]
    pub(super) fn covariance(&self) -> Option<SMatrix<f32, P, P>> {
        let parameters = self.evidence.parameters(self.trial.groups);
        let freedom = self.evidence.rows().checked_sub(parameters).filter(|left| *left > 0)? as f32;
        let wider = wider(freedom);
        self.solver.factor().covariance(self.solver.factor().squared_sum() / freedom * wider * wider)
    }
}
