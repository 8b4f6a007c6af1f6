//! Trials with robots, as a folder of sealed trials runs them.

use super::{
    case::{Content, draw},
    own,
};
use crate::{
    blind::{
        answer::Answer,
        case::Case,
        proposal,
        seal::Nonce,
        trial::OwnEffects,
        world::{Outcome, Pending, World, WorldKind, timed},
    },
    diagnosis::Diagnosis,
    effect::Effect,
    simulator::{SimulationError, robot::RobotPair},
};

/// Diagnoses a pair with a user's own effects as candidates.
pub type DiagnosePair<'d> = &'d (dyn Fn(&RobotPair, &[&'static Effect]) -> Diagnosis + Sync);

/// Pairs of robots, and what diagnoses them.
#[allow(missing_debug_implementations)] // A function has no text.
pub struct RobotWorld<'d> {
    /// The diagnosis.
    pub diagnose: DiagnosePair<'d>,
    /// A user's own effects.
    pub own: &'d OwnEffects,
}

impl World for RobotWorld<'_> {
    fn kind(&self) -> WorldKind {
        WorldKind::Robot
    }

    fn draw(&self, nonce: &Nonce, case: Case) -> Result<Pending<'_>, SimulationError> {
        let drawn = draw(nonce, case, self.own)?;
        let candidates = match drawn.label.content {
            Content::Own => own::drawn(self.own),
            _ => &self.own.effects,
        };
        let label = serde_json::to_string(&drawn.label).unwrap_or_default();
        let finish = move || {
            let pair = drawn.scene.record(&case.name())?;
            let (diagnosis, seconds) = timed(|| (self.diagnose)(&pair, candidates));
            let mut answer = Answer::of(diagnosis.as_ref());
            if let Some(diagnosis) = &diagnosis {
                answer.proposals = proposal::of_robot(&drawn, diagnosis)?;
            }
            Ok(Outcome { answer, truly_closed: None, seconds })
        };
        Ok(Pending { label, finish: Box::new(finish) })
    }
}
