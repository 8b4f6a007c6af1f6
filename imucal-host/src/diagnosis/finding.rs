//! What a diagnosis says, in the words and order of the contract.

use serde::{Deserialize, Serialize};

use super::watched::Watched;
use crate::{effect::Effect, recording::manifest::ReferenceKind};

/// The contract's name of what [`Diagnosis`] is serialised to.
pub const FORMAT: &str = "imucal-diagnosis/1";

/// The answer in one word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// A gap, and effects that explain it.
    Explained,
    /// Explained by one of several effects that this recording cannot distinguish.
    Ambiguous,
    /// Effects explain a part; a material remainder is located, its cause unknown.
    Partly,
    /// A gap, and no effect of the catalogue explains it.
    Unknown,
    /// No gap beyond noise.
    None,
    /// The recording lacks what the question needs.
    NotTestable,
}

/// A diagnosis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    /// [`FORMAT`].
    pub format: String,
    /// Name of the recording's samples file.
    pub recording: String,
    /// The answer in one word.
    pub verdict: Verdict,
    /// What the recording was compared with, where that is neither a rig nor the sensor's own rests.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference: Option<ReferenceKind>,
    /// Why there is no better answer, where there is none; otherwise what else a reader should know.
    pub remarks: Vec<String>,
    /// What was noticed when the recording was read.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// How large the gap is, channel by channel.
    pub gap: Vec<Gap>,
    /// Where it lies, the largest share first.
    #[serde(rename = "where")]
    pub places: Vec<Place>,
    /// Effects that are asserted, most certain first.
    pub causes: Vec<Cause>,
    /// Effects that hold each cause with 95 % probability, most probable first.
    pub credible_set: Vec<String>,
    /// Share of the explainable gap that all causes close, on held-out blocks; `None` without causes.
    pub gap_closed_total: Option<f64>,
    /// Its 95 % interval.
    pub gap_closed_total_ci95: Option<[f64; 2]>,
    /// The shares are of data that the fit has not seen.
    pub held_out: bool,
    /// Effects that would have been seen at a size that matters.
    pub absent: Vec<Absent>,
    /// Effects that this recording cannot show.
    pub not_testable: Vec<NotTestable>,
    /// What to record next to part causes from their equivalents.
    pub next_experiment: Vec<Experiment>,
    /// The user's own effects among causes and equivalents, in words.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub user_effects: Vec<UserEffect>,
    /// Formulas for what no effect of the catalogue explains.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub proposals: Vec<Proposal>,
    /// What the drift watch of the unit's device has seen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub watch: Option<Watched>,
    /// For each sensor whose gap follows something, the residual over that: for drawings, and not in the JSON.
    #[serde(skip)]
    pub profiles: Vec<Profile>,
}

impl Diagnosis {
    /// The text of its file.
    #[must_use]
    pub fn text(&self) -> String {
        // Plain numbers and text: nothing that cannot be written.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// With the words of those effects of a user that it names.
    #[must_use]
    pub fn with_words_of(mut self, own: &[&'static Effect]) -> Self {
        let is_named = |effect: &&&'static Effect| {
            let of = |cause: &Cause| cause.effect == effect.id || cause.equivalents.contains(&effect.id);
            self.causes.iter().any(of) || self.credible_set.contains(&effect.id)
        };
        let words = |effect: &&'static Effect| UserEffect {
            effect: effect.id.clone(),
            cause: effect.words.cause.to_owned(),
            remedy: effect.words.remedy.to_owned(),
        };
        self.user_effects = own.iter().filter(is_named).map(words).collect();
        self
    }
}

/// An effect of a user's file, in the file's words.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct UserEffect {
    /// Its id.
    pub effect: String,
    /// What causes it.
    pub cause: String,
    /// What to do about it.
    pub remedy: String,
}

/// Whether a second recording bears a formula out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ProposalStatus {
    /// Found in this recording.
    Proposed,
    /// As it was found in another recording, it closes at least half of what is left in this one.
    Confirmed,
    /// It does not.
    Refuted,
}

/// A formula for what no effect of the catalogue explains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Proposal {
    /// `acc`, `gyr` or `mag`.
    pub sensor: String,
    /// Axes on which it acts.
    pub axes: Vec<String>,
    /// What is added to the sensor's output.
    pub formula: String,
    /// Amplitudes and shapes.
    pub parameters: Vec<Amount>,
    /// Formulas that this recording cannot distinguish from it.
    pub equivalents: Vec<String>,
    /// Share of what is left of the sensor's gap that it closes, on stretches that no fit has seen.
    pub gap_closed: f64,
    /// Its 95 % interval.
    pub gap_closed_ci95: [f64; 2],
    /// ln of the odds against noise alone, less what the number of formulas that were tried costs; of a confirmation,
    /// what the frozen formula adds.
    pub log_odds: f64,
    /// Whether a second recording bears it out.
    pub status: ProposalStatus,
    /// The formula as effects of a user's file.
    pub toml: String,
}

/// The gap of one channel: root mean squares of block means.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gap {
    /// `acc`, `gyr` or `mag`.
    pub sensor: String,
    /// `x`, `y` or `z`.
    pub axis: String,
    /// Unit of the figures.
    pub unit: String,
    /// What the baseline leaves.
    pub rms_before: f64,
    /// What is left with the causes added.
    pub rms_after: f64,
    /// What noise alone would leave.
    pub noise_floor: f64,
}

/// A driver that the gap of a sensor follows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// `acc`, `gyr` or `mag`.
    pub sensor: String,
    /// What it follows, such as `gimbal_outer`.
    pub driver: String,
    /// Share of the explainable gap that follows it; shares of drivers overlap.
    pub share: f64,
    /// Probability of as much without a gap, all tests counted.
    pub p_value: f64,
    /// How it follows.
    pub detail: String,
}

/// The residual of one axis over a driver.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// `acc`, `gyr` or `mag`.
    pub sensor: String,
    /// `x`, `y` or `z`.
    pub axis: String,
    /// Unit of the residual.
    pub unit: String,
    /// The driver that the sensor follows most.
    pub driver: String,
    /// The function of it that the axis follows most.
    pub function: String,
    /// Means, in the order of the driver.
    pub bins: Vec<ProfileBin>,
}

/// Means over the blocks in which a driver is much the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfileBin {
    /// Mean of the function, in standard deviations of it; of the time, s.
    pub driver: f64,
    /// Mean residual before the causes are added.
    pub before: f64,
    /// And after.
    pub after: f64,
    /// Standard error of both, as if the noise of blocks were independent.
    pub std: f64,
}

/// An effect that is asserted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cause {
    /// Its id.
    pub effect: String,
    /// Probability among the effects that could stand in its place.
    pub probability: f64,
    /// Effects that this recording cannot distinguish from it, likeliest first.
    pub equivalents: Vec<String>,
    /// Its parameters.
    pub parameters: Vec<Amount>,
    /// It is large enough to matter.
    pub material: bool,
    /// Share of the explainable gap that it closes, on held-out blocks; `None` for what adds none that could be closed: a
    /// burst of noise, axes or a unit that were mistaken, which the baseline takes up.
    pub gap_closed: Option<f64>,
    /// Its 95 % interval.
    pub gap_closed_ci95: Option<[f64; 2]>,
}

/// A fitted parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Amount {
    /// Its name within the effect.
    pub name: String,
    /// Value; `None` for an episode that has not ended.
    pub value: Option<f64>,
    /// Standard error.
    pub std_error: Option<f64>,
    /// Unit of both.
    pub unit: String,
}

/// An effect that is not there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Absent {
    /// Its id.
    pub effect: String,
    /// The smallest amplitude that would have been seen.
    pub minimum_detectable: f64,
    /// Its unit.
    pub unit: String,
}

/// An effect that the recording cannot show.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NotTestable {
    /// Its id.
    pub effect: String,
    /// Why.
    pub because: String,
}

/// A segment to be recorded.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Experiment {
    /// The effects that it parts.
    pub separates: Vec<String>,
    /// What to do.
    #[serde(rename = "do")]
    pub instruction: String,
    /// Square of the whitened distance between them in this recording.
    pub distinguishability_from: f64,
    /// With the segment added.
    pub to: f64,
}
