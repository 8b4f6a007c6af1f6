//! Trials with robots, as a folder of sealed trials runs them.

use super::case::draw;
use crate::{
    blind::{
        answer::Answer,
        case::Case,
        proposal,
        seal::Nonce,
        world::{Outcome, Pending, World, WorldKind, timed},
    },
    diagnosis::Diagnosis,
    simulator::{SimulationError, robot::RobotPair},
};

/// Pairs of robots, and what diagnoses them.
#[allow(missing_debug_implementations)] // A function has no text.
pub struct RobotWorld<'d>(pub &'d (dyn Fn(&RobotPair) -> Diagnosis + Sync));

impl World for RobotWorld<'_> {
    fn kind(&self) -> WorldKind {
        WorldKind::Robot
    }

    fn draw(&self, nonce: &Nonce, case: Case) -> Result<Pending<'_>, SimulationError> {
        let drawn = draw(nonce, case)?;
        let label = serde_json::to_string(&drawn.label).unwrap_or_default();
        let finish = move || {
            let pair = drawn.scene.record(&case.name())?;
            let (diagnosis, seconds) = timed(|| (self.0)(&pair));
            let mut answer = Answer::of(diagnosis.as_ref());
            if let Some(diagnosis) = &diagnosis {
                answer.proposals = proposal::of_robot(&drawn, diagnosis)?;
            }
            Ok(Outcome { answer, truly_closed: None, seconds })
        };
        Ok(Pending { label, finish: Box::new(finish) })
    }
}
