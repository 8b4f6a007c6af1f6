//! Where the gap between simulator and recording lies, which unmodelled effect causes it, and how far it shrinks.

pub mod error;
pub mod finding;
pub mod library;
pub mod location;
pub mod mixed_model;
pub mod reference;
pub mod residual;
pub mod screening;
pub mod search;
pub mod settings;
pub mod verdict;

pub use self::{
    error::DiagnosisError,
    finding::{Diagnosis, Verdict},
};
use self::{
    library::{
        candidates::{Candidates, Setting},
        formulas,
    },
    residual::forward_model::ForwardModel,
    screening::preparation::Preparation,
    search::{motion_mismatch, stepwise},
    settings::{Settings, Source},
    verdict::answer::{answer, untestable},
};
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
    /// The user's own effects, candidates besides the catalogue's.
    pub effects: Vec<&'static Effect>,
    /// Settings; without them, the preset of the source of the movement.
    pub settings: Option<Settings>,
}

/// Diagnoses a recording; `progress` hears of each stage. Where no diagnosis can be made, a remark says why.
pub fn diagnose(recording: &Recording, options: &Options, progress: &dyn Fn(&str)) -> Diagnosis {
    try_diagnose(recording, options, progress).unwrap_or_else(|why| untestable(recording, why.to_string()))
}

/// Likewise.
///
/// # Errors
///
/// The stage that failed, and the figure that shows why.
pub fn try_diagnose(
    recording: &Recording,
    options: &Options,
    progress: &dyn Fn(&str),
) -> Result<Diagnosis, DiagnosisError> {
    let source = Source::of(recording, options.stream.as_ref());
    let own =
        if source == Source::Simulator && options.stream.is_none() { Stream::of(recording) } else { None };
    let stream = options.stream.as_ref().or(own.as_ref());
    let mut settings = options.settings.clone().unwrap_or_else(|| Settings::preset(source));
    let mut preparation = Preparation::new(recording, stream, options.model.as_ref(), &settings)?;
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
    let mut candidates = Candidates::new(&setting, &options.without, &options.effects);
    let (scene, stretches) = motion_mismatch::left_out(scene, &candidates)?;
    preparation.findings.extend(motion_mismatch::finding(&stretches));
    formulas::sift(&scene, &mut candidates)?;
    let explain = |candidates: &Candidates| {
        let explained = stepwise::search(&scene, candidates, progress)?;
        answer(recording, &preparation, &explained, progress)
    };
    loop {
        match explain(&candidates) {
            // In a shape of the search a user's formula has no value; each such effect is withdrawn once.
            Err(DiagnosisError::Formula(cause))
                if candidates.withdraw(&cause.effect, cause.without_row()) => {}
            diagnosis => {
                let reference = source.reference();
                return diagnosis
                    .map(|diagnosis| Diagnosis { reference, ..diagnosis }.with_words_of(&options.effects));
            }
        }
    }
}

#[cfg(test)]
mod tests;
