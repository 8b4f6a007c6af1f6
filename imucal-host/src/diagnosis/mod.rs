//! Where the gap between simulator and recording lies, which unmodelled effect causes it, and how far it shrinks.

pub mod error;
pub mod finding;
pub mod library;
pub mod location;
pub mod mixed_model;
pub mod proposal;
pub mod reference;
pub mod residual;
pub mod screening;
pub mod search;
pub mod settings;
pub mod verdict;
pub mod watched;

pub use self::{
    error::DiagnosisError,
    finding::{Diagnosis, Verdict},
};
use self::{
    library::{
        candidates::{Candidates, Setting},
        formulas,
    },
    proposal::{confirmation, proposer},
    residual::forward_model::ForwardModel,
    screening::{first_time, preparation::Preparation, recorded_values},
    search::{
        motion_mismatch::{self, LeftOut, Stretch},
        stepwise,
    },
    settings::{Settings, Source},
    verdict::answer::{Answer, answer, untestable},
    watched::Watched,
};
use imucal_core::watch::WatchSummary;

use crate::{
    effect::Effect,
    recording::{Recording, Stream},
    store::StoredCalibration,
};

/// What is known before a diagnosis.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Catalogue entries to be withheld from the candidates, and terms to be taken out of the baseline.
    pub without: Vec<String>,
    /// The simulator's present model of the unit; without it, the baseline is calibrated from the recording.
    pub model: Option<StoredCalibration>,
    /// A simulator's stream for the recording, on a clock of its own; without it, the recording's own reference.
    pub stream: Option<Stream>,
    /// The user's own effects, candidates in addition to the catalogue's.
    pub effects: Vec<&'static Effect>,
    /// Text of the user's file where its effects are no candidates: their amplitudes are as the file has found them, and the
    /// diagnosis says whether the recording confirms them.
    pub frozen: Option<String>,
    /// What the drift watch of the unit's device has seen.
    pub watch: Option<WatchSummary>,
    /// Settings; without them, the preset of the source of the movement.
    pub settings: Option<Settings>,
}

/// Diagnoses a recording; `progress` hears of each stage. Where no diagnosis can be made, a remark says why.
pub fn diagnose(recording: &Recording, options: &Options, progress: &dyn Fn(&str)) -> Diagnosis {
    let diagnosed = try_diagnose(recording, options, progress);
    let diagnosis = diagnosed.unwrap_or_else(|why| untestable(recording, why.to_string()));
    let watch = options.watch.as_ref().map(|summary| Watched::of(summary, &diagnosis.causes));
    Diagnosis { watch, ..diagnosis }
}

/// Likewise, without the drift watch.
///
/// # Errors
///
/// The stage that failed, and the figure that shows why.
pub fn try_diagnose(
    recording: &Recording,
    options: &Options,
    progress: &dyn Fn(&str),
) -> Result<Diagnosis, DiagnosisError> {
    let (fresh, repeated) = recorded_values::fresh(recording);
    let (fresh, moved, begins) = first_time::from_zero(fresh, options.stream.as_ref());
    let (recording, given) = (&*fresh, moved.as_ref().or(options.stream.as_ref()));
    let source = Source::of(recording, given);
    let own = if source == Source::Simulator && given.is_none() { Stream::of(recording) } else { None };
    let stream = given.or(own.as_ref());
    let mut settings = options.settings.clone().unwrap_or_else(|| Settings::preset(source));
    let mut preparation = Preparation::new(recording, stream, options.model.as_ref(), &settings)?;
    preparation.remarks.extend(repeated);
    preparation.remarks.extend(begins);
    if preparation.noisy_stream {
        // Noise of the stream is averaged over a block only where it is taken row by row, at rest too.
        settings.residual.resting_points = settings.residual.moving_points;
    }
    if preparation.without_position {
        (settings.source.placed, settings.source.position) = (false, false);
    }
    let (usable, movement) = (preparation.usable.clone(), &*preparation.movement);
    let mut scene = ForwardModel::new(recording, usable, movement, preparation.triads, &settings);
    if let Some(held) = &preparation.held {
        scene = scene.through(held);
    }
    scene = scene.without_passages();
    let setting = Setting {
        kinds: &scene.kinds,
        thermometer: recording.temperature.is_some(),
        calibrated: &preparation.model.calibrated,
        provided: settings.source,
        // A stream holds the field itself.
        field_known: recording.manifest.site.field_ned_ut.is_some() || stream.is_some(),
    };
    let own = if options.frozen.is_some() { &[][..] } else { &options.effects };
    let mut candidates = Candidates::new(&setting, &options.without, own);
    let LeftOut { mut scene, mut stretches, jolts } = motion_mismatch::left_out(scene, &candidates)?;
    preparation.remarks.extend(motion_mismatch::remark(jolts));
    let screened = preparation.findings.clone();
    preparation.findings.extend(motion_mismatch::finding(stretches.clone(), &preparation.unmatched));
    formulas::sift(&scene, &mut candidates)?;
    let explain = |scene: &ForwardModel<'_>, preparation: &Preparation, candidates: &Candidates| {
        let explained = stepwise::search(scene, candidates, progress)?;
        if let Some(stretch) = motion_mismatch::turned_for_a_while(&explained) {
            return Ok(Explained::Otherwise(stretch));
        }
        let Answer { mut diagnosis, following } = answer(recording, preparation, &explained, progress)?;
        let (proposals, remarks) = match &options.frozen {
            Some(toml) => confirmation::confirmed(&explained, &diagnosis, &options.effects, toml)?,
            None => proposer::proposed(&explained, &diagnosis, &following, progress)?,
        };
        diagnosis.proposals = proposals;
        diagnosis.remarks.extend(remarks);
        Ok(Explained::Diagnosed(Box::new(diagnosis)))
    };
    loop {
        match explain(&scene, &preparation, &candidates) {
            Ok(Explained::Otherwise(stretch)) => {
                scene.leave_out(std::slice::from_ref(&stretch.time));
                stretches.push(stretch);
                preparation.findings.clone_from(&screened);
                let finding = motion_mismatch::finding(stretches.clone(), &preparation.unmatched);
                preparation.findings.extend(finding);
            }
            // In a shape of the search a user's formula has no value; each such effect is withdrawn once.
            Err(DiagnosisError::Formula(cause))
                if candidates.withdraw(&cause.effect, cause.without_row()) => {}
            Ok(Explained::Diagnosed(diagnosis)) => {
                let reference = source.reference();
                return Ok(Diagnosis { reference, ..*diagnosis }.with_words_of(&options.effects));
            }
            Err(why) => return Err(why),
        }
    }
}

/// What a search comes to.
enum Explained {
    /// A diagnosis.
    Diagnosed(Box<Diagnosis>),
    /// A stretch in which the machine moved otherwise, which is left out of another search.
    Otherwise(Stretch),
}

#[cfg(test)]
mod tests;
