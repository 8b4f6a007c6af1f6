//! What is known of one recording once it is done: kept in a file, so that a batch can be resumed.

use std::{
    collections::BTreeMap,
    io,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use super::{
    parameter::{self, Parameter},
    source::Source,
};
use crate::{
    calibrate::{Calibration, SensorOutcome, Status, request::Request},
    file::{
        Limits,
        digest::{sha256, sha256_of},
    },
    recording::{Manifest, SensorKind, files_of},
    store::form::Form,
};

/// What an entry begins with.
const FORMAT: &str = "imucal-batch-unit/1";
/// The program and its version, whose results these are.
const PROGRAM: &str = concat!("imucal ", env!("CARGO_PKG_VERSION"));
/// The folder of entries within that of the outputs. No recording has a hidden name.
pub(super) const FOLDER: &str = ".imucal-batch";

/// How a recording ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Standing {
    /// At least one sensor was accepted, and all that were asked for.
    Calibrated,
    /// It was read, and the answer is no.
    Refused,
    /// It cannot be read.
    Unreadable,
    /// The program failed, or could not write: done again by the next run.
    Failed,
}

impl Standing {
    /// As `imucal calibrate` would end.
    #[must_use]
    pub fn exit_status(self) -> u8 {
        match self {
            Self::Calibrated => 0,
            Self::Refused => 1,
            Self::Unreadable | Self::Failed => 2,
        }
    }

    /// Its word in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Calibrated => "calibrated",
            Self::Refused => "refused",
            Self::Unreadable => "unreadable",
            Self::Failed => "failed",
        }
    }
}

/// One recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    format: String,
    program: String,
    /// What its outputs are called.
    pub name: String,
    /// Its samples, from the folder that all recordings have in common.
    pub recording: String,
    /// What was read; `None` where it could not be.
    pub input: Option<Input>,
    /// What else it depends on.
    options: String,
    /// How it ended.
    pub standing: Standing,
    /// Why it is unreadable or failed.
    pub error: Option<String>,
    /// SHA-256 of each output by its ending.
    outputs: BTreeMap<String, String>,
    /// Its sensors, accelerometer first.
    pub sensors: Vec<Sensor>,
}

/// The files of a recording.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// Bytes of the samples.
    pub size: u64,
    /// SHA-256 of the samples, in hexadecimal digits.
    pub sha256: String,
    /// The same of the manifest next to them; `None` without one.
    pub manifest_sha256: Option<String>,
}

/// One sensor of a recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensor {
    /// Which.
    pub sensor: SensorKind,
    /// `accepted`, `suspect` or `refused`.
    pub status: String,
    /// Why it was refused, or what its residual follows.
    pub reason: Option<String>,
    /// Its model.
    pub model: String,
    /// Its calibration is among the outputs.
    pub passed: bool,
    /// Sensors are compared where this is the same: model, units, nominal conversion, axes.
    pub kind: Option<String>,
    /// Unit of raw values.
    pub unit_in: Option<String>,
    /// Unit of calibrated values.
    pub unit_out: Option<String>,
    /// Observations used.
    pub observations: Option<usize>,
    /// Rms residual, calibrated unit; rad a turn of a gyroscope.
    pub rms: Option<f64>,
    /// The same of observations left out of the fit.
    pub held_out_rms: Option<f64>,
    /// Gain and bias of raw values; none where it was refused.
    pub stored: Vec<Parameter>,
    /// What these say of the sensor.
    pub of_sensor: Vec<Parameter>,
}

impl Entry {
    /// Of a recording that is being worked on.
    pub(super) fn begun(source: &Source, input: Option<Input>) -> Self {
        Self {
            format: FORMAT.into(),
            program: PROGRAM.into(),
            name: source.name.clone(),
            recording: source.from_root.clone(),
            input,
            options: source.method.options(),
            standing: Standing::Failed,
            error: None,
            outputs: BTreeMap::new(),
            sensors: Vec::new(),
        }
    }

    /// Of a recording that was never there.
    #[cfg(test)]
    pub(super) fn for_tests(name: &str, standing: Standing, sensors: Vec<Sensor>) -> Self {
        let (format, program, options) = (FORMAT.into(), PROGRAM.into(), String::new());
        let recording = format!("{name}.csv");
        let (input, error, outputs) = (None, None, BTreeMap::new());
        Self {
            format,
            program,
            name: name.into(),
            recording,
            input,
            options,
            standing,
            error,
            outputs,
            sensors,
        }
    }

    /// Without sensors, for this reason.
    pub(super) fn without(mut self, standing: Standing, error: String) -> Self {
        self.outputs.clear();
        self.sensors.clear();
        self.standing = standing;
        self.error = Some(error);
        self
    }

    pub(super) fn add_output(&mut self, form: Form, content: &[u8]) {
        self.outputs.insert(ending(form).to_owned(), sha256_of(content));
    }

    /// Where the entry of a name is kept.
    pub(super) fn path(out: &Path, name: &str) -> PathBuf {
        out.join(FOLDER).join(format!("{name}.json"))
    }

    /// The entry of an earlier run; what cannot be understood is none.
    pub(super) fn read(out: &Path, name: &str) -> Option<Self> {
        let bytes = Limits::default().read_small(&Self::path(out, name)).ok()?;
        serde_json::from_slice::<Self>(&bytes).ok().filter(|entry| entry.format == FORMAT)
    }

    /// The file's text. What is read back is the same entry, to the last bit of each number.
    pub(super) fn text(&self) -> String {
        // Serialising plain numbers and text into a string cannot fail.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// Why the recording must be done again though this says that it is done; `None` where it need not.
    pub(super) fn outdated(&self, now: &Self, out: &Path) -> Option<&'static str> {
        let output = |(ending, sum): (&String, &String)| {
            let content = Limits::default().read_large(&output_path(out, &self.name, ending));
            content.is_ok_and(|content| sha256_of(&content) == *sum)
        };
        if self.input != now.input || self.recording != now.recording {
            Some("the recording has changed")
        } else if self.options != now.options {
            Some("the options have changed")
        } else if self.program != now.program {
            Some("the program has another version")
        } else if !self.outputs.iter().all(output) {
            Some("an output is missing or was changed")
        } else {
            None
        }
    }
}

/// The ending of an output.
pub(super) fn ending(form: Form) -> &'static str {
    match form {
        Form::Json => "json",
        Form::Toml => "toml",
        Form::Record => "bin",
    }
}

/// A recording's output.
pub(super) fn output_path(out: &Path, name: &str, ending: &str) -> PathBuf {
    out.join(format!("{name}.{ending}"))
}

impl Input {
    /// Of the files of a recording.
    pub(super) fn of(samples: &Path) -> io::Result<Self> {
        let files = files_of(samples).map_err(io::Error::other)?;
        let (size, of_samples) = sha256(&files)?;
        let manifest = Manifest::path_for(samples).filter(|path| path.is_file());
        let manifest_sha256 = manifest.map(|path| sha256(&[path])).transpose()?.map(|(_, sum)| sum);
        Ok(Self { size, sha256: of_samples, manifest_sha256 })
    }
}

/// The sensors of a calibration.
pub(super) fn sensors(calibration: &Calibration, request: &Request) -> Vec<Sensor> {
    let axes = calibration.sensor(SensorKind::Acc).and_then(frame).unwrap_or_default();
    calibration.sensors.iter().map(|outcome| sensor(outcome, request, &axes)).collect()
}

fn sensor(outcome: &SensorOutcome, request: &Request, axes: &str) -> Sensor {
    let status = outcome.status();
    let reason = match (&outcome.verdict, status) {
        (Err(refused), _) => Some(refused.refusal.reason().to_owned()),
        (Ok(()), Status::Suspect) => {
            let follows: Vec<&str> = outcome.suspicions.iter().map(|found| found.follows.name()).collect();
            Some(follows.join(" "))
        }
        _ => None,
    };
    let fit = outcome.fit.as_ref();
    let finite = |value: Option<f64>| value.filter(|value| value.is_finite());
    // The other sensors are in the axes of the accelerometer.
    let kind = frame(outcome)
        .map(|own| if outcome.kind == SensorKind::Acc { own } else { format!("{own}; {axes}") });
    Sensor {
        sensor: outcome.kind,
        status: status.name().into(),
        reason,
        model: outcome.model.into(),
        passed: request.passes(status),
        kind,
        unit_in: fit.map(|fit| fit.unit_in.to_string()),
        unit_out: fit.map(|fit| fit.unit_out.to_string()),
        observations: fit.map(|fit| fit.observations),
        rms: finite(fit.map(|fit| fit.rms)),
        held_out_rms: finite(fit.and_then(|fit| fit.held_out_rms)),
        stored: outcome.passed().map(parameter::stored).unwrap_or_default(),
        of_sensor: outcome.passed().map(parameter::of_sensor).unwrap_or_default(),
    }
}

/// What gains must have in common to be compared: model, unit and nominal conversion, entries, a known field or not.
fn frame(outcome: &SensorOutcome) -> Option<String> {
    let fit = outcome.passed()?;
    let entries: Vec<String> = fit.covariance_of.iter().map(ToString::to_string).collect();
    Some(format!(
        "{} in {} of {:?} and {:?}, entries {}, {}",
        outcome.model,
        fit.unit_in,
        fit.nominal.offset,
        fit.nominal.per_unit,
        entries.join(" "),
        if fit.field_norm.is_some() { "field unknown" } else { "field known" }
    ))
}
