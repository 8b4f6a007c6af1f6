//! Where the gap between simulator and recording lies, which unmodelled effect causes it, and how far it shrinks.

pub mod finding;
pub mod library;
pub mod location;
pub mod mixed_model;
pub mod reference;
pub mod residual;
pub mod screening;
pub mod search;
pub mod verdict;

pub use self::finding::{Diagnosis, Verdict};
use self::{
    library::candidates::{Candidates, Setting},
    residual::forward_model::ForwardModel,
    screening::preparation::Preparation,
    search::stepwise,
    verdict::answer::{answer, untestable},
};
use crate::{recording::Recording, store::StoredCalibration};

/// What a diagnosis may be told beforehand.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Catalogue entries to be withheld from the candidates, and terms to be taken out of the baseline.
    pub without: Vec<String>,
    /// The simulator's present model of the unit; without it, the baseline is calibrated from the recording.
    pub model: Option<StoredCalibration>,
}

/// Diagnoses a recording; `progress` hears of each stage.
pub fn diagnose(recording: &Recording, options: &Options, progress: &dyn Fn(&str)) -> Diagnosis {
    let preparation = match Preparation::new(recording, options.model.as_ref()) {
        Ok(preparation) => preparation,
        Err(why) => return untestable(recording, why),
    };
    let mut scene =
        ForwardModel::new(recording, preparation.usable.clone(), &*preparation.movement, preparation.triads);
    if let Some(held) = &preparation.held {
        scene = scene.through(held);
    }
    scene = scene.without_passages();
    let setting = Setting {
        kinds: &scene.kinds,
        thermometer: recording.temperature.is_some(),
        calibrated: &preparation.model.calibrated,
        gimbals: scene.swings.is_some(),
        hand: preparation.held.is_some(),
        field_known: recording.manifest.site.field_ned_ut.is_some(),
    };
    let candidates = Candidates::new(&setting, &options.without);
    let explained = stepwise::search(&scene, &candidates, progress);
    let answered = explained.and_then(|explained| answer(recording, &preparation, &explained, progress));
    answered.unwrap_or_else(|| {
        untestable(recording, "the baseline cannot be fitted to this recording".to_owned())
    })
}

#[cfg(test)]
mod tests;
