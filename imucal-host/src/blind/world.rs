//! Of what world the trials of a set are: how its cases are drawn, sealed, recorded and answered.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    time::Instant,
};

use serde::{Deserialize, Serialize};

use super::{
    answer::{Answer, truly_closed},
    case::{Case, draw_among},
    proposal,
    seal::Nonce,
    trial::OwnEffects,
};
use crate::{diagnosis::Diagnosis, recording::Recording, simulator::SimulationError};

/// Worlds there are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum WorldKind {
    /// A rig with encoders.
    #[default]
    Rig,
    /// A robot and its simulator.
    Robot,
}

impl WorldKind {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Rig, Self::Robot];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rig => "rig",
            Self::Robot => "robot",
        }
    }

    /// The world of a name.
    pub fn find(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    pub(super) fn is_rig(&self) -> bool {
        *self == Self::Rig
    }
}

/// A source of trials.
pub trait World: Sync {
    /// Which it is.
    fn kind(&self) -> WorldKind;

    /// Draws a case of the set of a nonce.
    ///
    /// # Errors
    ///
    /// [`SimulationError`], where it cannot be simulated.
    fn draw(&self, nonce: &Nonce, case: Case) -> Result<Pending<'_>, SimulationError>;
}

/// What is left to do with a case once its label is sealed.
pub type Finish<'a> = Box<dyn FnOnce() -> Result<Outcome, SimulationError> + 'a>;

/// A case that is drawn and not recorded yet.
#[allow(missing_debug_implementations)] // What is left to do has no text.
pub struct Pending<'a> {
    /// Text of its label, to be sealed.
    pub label: String,
    /// Records and diagnoses it.
    pub finish: Finish<'a>,
}

/// What came of a case.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// What was answered.
    pub answer: Answer,
    /// Share of the gap that the causes truly close, where that is known.
    pub truly_closed: Option<f64>,
    /// Time of the diagnosis, s.
    pub seconds: f64,
}

/// Recordings of the rig, and what diagnoses them.
#[allow(missing_debug_implementations)] // A function has no text.
pub struct RigWorld<'d> {
    /// The diagnosis.
    pub diagnose: &'d (dyn Fn(&Recording) -> Diagnosis + Sync),
    /// A user's own effects.
    pub own: &'d OwnEffects,
}

impl World for RigWorld<'_> {
    fn kind(&self) -> WorldKind {
        WorldKind::Rig
    }

    fn draw(&self, nonce: &Nonce, case: Case) -> Result<Pending<'_>, SimulationError> {
        let drawn = draw_among(nonce, case, self.own.drawn())?;
        let label = serde_json::to_string(&drawn.label).unwrap_or_default();
        let finish = move || {
            let recording = drawn.simulation.record(&format!("{}.csv", case.name()))?;
            let (diagnosis, seconds) = timed(|| (self.diagnose)(&recording));
            let mut answer = Answer::of(diagnosis.as_ref());
            if let Some(diagnosis) = &diagnosis {
                answer.proposals = proposal::of_rig(&drawn, diagnosis)?;
            }
            let truly_closed = truly_closed(&drawn, &answer, &self.own.effects).unwrap_or(None);
            Ok(Outcome { answer, truly_closed, seconds })
        };
        Ok(Pending { label, finish: Box::new(finish) })
    }
}

/// A diagnosis and how long it took, s; none where it came to no end: that fails its trial, and not the set.
pub fn timed(diagnose: impl FnOnce() -> Diagnosis) -> (Option<Diagnosis>, f64) {
    let start = Instant::now();
    let diagnosis = catch_unwind(AssertUnwindSafe(diagnose)).ok();
    (diagnosis, start.elapsed().as_secs_f64())
}
