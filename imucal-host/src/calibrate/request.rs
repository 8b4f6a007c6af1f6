//! What a user asks of a calibration: models by sensor, which a recording must allow and whose sensors must pass.

use std::str::FromStr;

use super::{
    AccModel, Calibration, Options, Status,
    gyr::{rig, turns},
    known_attitudes::ladder,
    mag::samples,
};
use crate::{
    observe::pose,
    recording::{Recording, SensorKind},
};

/// What is asked for.
#[derive(Clone, Debug, Default)]
pub struct Request {
    /// Models of the sensors that must pass, one a sensor.
    models: Vec<ModelOf>,
    /// The only multiple of the initial rest's variance to try; above 0.
    pub threshold: Option<f64>,
    /// Climb the ladders and say which rung to use.
    pub compare: bool,
    /// Do not estimate how bias and scale follow the temperature.
    pub no_temperature: bool,
    /// A suspect sensor passes.
    pub accept_suspect: bool,
}

/// A sensor and the model that is asked for, read from text such as `acc=T9`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ModelOf {
    kind: SensorKind,
    choice: Choice,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Choice {
    /// A field form of the accelerometer.
    Acc(AccModel),
    /// A rung of the sensor's ladder on a rig.
    Rig(&'static str),
    /// The sensor's field form, where it has but one.
    Field,
}

/// A request that contradicts itself or the recording; its text says what was found, what was expected and what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)] // The fields are those of each message.
pub enum RequestFault {
    /// Text that names no model.
    #[error("`{found}` is no model; expected {expected}")]
    Model { found: String, expected: String },
    /// Two models of one sensor.
    #[error("--model: found {kind} twice, expected one model a sensor; leave one out")]
    Twice { kind: SensorKind },
    /// A sensor that the recording has not.
    #[error(
        "{file}: --model names {sensors}, but the recording has no columns {columns}; leave it out of --model"
    )]
    Sensor { file: String, sensors: String, columns: String },
    /// Hard iron on gimbals that are not there.
    #[error(
        "{file}: --model mag={model} has hard iron on gimbals, and a reference attitude has no gimbals; \
         use mag=M15, or mag=M12 where the reference's frame is north, east, down"
    )]
    Gimbals { file: String, model: &'static str },
    /// Earth's field is not stated.
    #[error(
        "{file}: --model mag={model} needs Earth's field, expected [site] field_ned_ut = [north, east, down] \
         in its TOML; add it, or leave --model out for the field form"
    )]
    Field { file: String, model: &'static str },
    /// The recording has no rig.
    #[error("{file}: --model {kind}={model} needs a rig: {why}; leave it out for the field form")]
    Rig { file: String, kind: SensorKind, model: &'static str, why: String },
}

impl FromStr for ModelOf {
    type Err = RequestFault;

    fn from_str(text: &str) -> Result<Self, RequestFault> {
        let rung = |ladder: &[(&'static str, &str)], name: &str| {
            ladder.iter().find(|(known, _)| *known == name).map(|(known, _)| Choice::Rig(known))
        };
        let found = match text.split_once('=') {
            Some(("acc", "T9")) => Some((SensorKind::Acc, Choice::Acc(AccModel::T9))),
            Some(("acc", "T6")) => Some((SensorKind::Acc, Choice::Acc(AccModel::T6))),
            Some(("acc", name)) => rung(&ladder::ACCELEROMETER, name).map(|choice| (SensorKind::Acc, choice)),
            Some(("gyr", name)) if name == turns::MODEL => Some((SensorKind::Gyr, Choice::Field)),
            Some(("gyr", name)) => rung(&rig::MODELS, name).map(|choice| (SensorKind::Gyr, choice)),
            Some(("mag", name)) if name == samples::MODEL => Some((SensorKind::Mag, Choice::Field)),
            Some(("mag", name)) => rung(&ladder::MAGNETOMETER, name).map(|choice| (SensorKind::Mag, choice)),
            _ => None,
        };
        found
            .map(|(kind, choice)| Self { kind, choice })
            .ok_or_else(|| RequestFault::Model { found: text.to_owned(), expected: known_models() })
    }
}

/// All models, for a message.
fn known_models() -> String {
    let names = |ladder: &[(&str, &str)]| ladder.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    format!(
        "acc=T9 or acc=T6, on a rig acc= {}; gyr={}, on a rig gyr= {}; mag={}, on a rig mag= {}",
        names(&ladder::ACCELEROMETER),
        turns::MODEL,
        names(&rig::MODELS),
        samples::MODEL,
        names(&ladder::MAGNETOMETER)
    )
}

impl Request {
    /// Asks for these models.
    ///
    /// # Errors
    ///
    /// [`RequestFault::Twice`].
    pub fn with_models(self, models: &[ModelOf]) -> Result<Self, RequestFault> {
        let twice = models
            .iter()
            .enumerate()
            .find(|(index, model)| models[..*index].iter().any(|other| other.kind == model.kind));
        match twice {
            Some((_, model)) => Err(RequestFault::Twice { kind: model.kind }),
            None => Ok(Self { models: models.to_vec(), ..self }),
        }
    }

    /// What the calibration is to do.
    #[must_use]
    pub fn options(&self) -> Options {
        let mut options =
            Options { compare: self.compare, temperature: !self.no_temperature, ..Options::default() };
        for ModelOf { kind, choice } in &self.models {
            match (kind, *choice) {
                (SensorKind::Acc, Choice::Acc(field)) => (options.acc, options.rig_acc) = (field, None),
                (SensorKind::Acc, Choice::Rig(name)) => options.rig_acc = Some(name),
                (SensorKind::Gyr, Choice::Rig(name)) => options.rig_gyr = Some(name),
                (SensorKind::Gyr, Choice::Field) => options.rig_gyr = None,
                (SensorKind::Mag, Choice::Rig(name)) => options.rig_mag = Some(name),
                (SensorKind::Mag, Choice::Field) => options.rig_mag = None,
                _ => {}
            }
        }
        if let Some(threshold) = self.threshold {
            options.multipliers = vec![threshold];
        }
        options
    }

    /// The recording has the sensors that are named, and what their models need.
    ///
    /// # Errors
    ///
    /// What it lacks.
    pub fn check(&self, recording: &Recording) -> Result<(), RequestFault> {
        let missing: Vec<SensorKind> =
            self.named().filter(|kind| recording.sensor(*kind).is_none()).collect();
        if !missing.is_empty() {
            let list = |words: Vec<String>| words.join(", ");
            return Err(RequestFault::Sensor {
                file: recording.name.clone(),
                sensors: list(missing.iter().map(ToString::to_string).collect()),
                columns: list(missing.iter().map(|kind| kind.columns().join(", ")).collect()),
            });
        }
        self.models.iter().try_for_each(|model| model.check(recording))
    }

    /// Something has passed, everything that was named has, and nothing is suspect that may not be.
    #[must_use]
    pub fn is_met(&self, calibration: &Calibration) -> bool {
        let has =
            |kind: SensorKind| calibration.sensor(kind).is_some_and(|outcome| self.passes(outcome.status()));
        let suspect = calibration.sensors.iter().any(|outcome| outcome.status() == Status::Suspect);
        let any = SensorKind::ALL.into_iter().any(has);
        any && self.named().all(has) && (self.accept_suspect || !suspect)
    }

    /// A sensor of this status goes into the outputs.
    #[must_use]
    pub fn passes(&self, status: Status) -> bool {
        match status {
            Status::Accepted => true,
            Status::Suspect => self.accept_suspect,
            Status::Refused => false,
        }
    }

    fn named(&self) -> impl Iterator<Item = SensorKind> {
        self.models.iter().map(|model| model.kind)
    }
}

impl ModelOf {
    /// A rung of a rig's ladder needs the rig.
    fn check(self, recording: &Recording) -> Result<(), RequestFault> {
        let Choice::Rig(model) = self.choice else { return Ok(()) };
        let file = || recording.name.clone();
        let along_reference = recording.gimbal.is_none() && recording.reference.is_some();
        match (self.kind, model) {
            (SensorKind::Gyr, _) | (SensorKind::Mag, "M15") if along_reference => return Ok(()),
            (SensorKind::Mag, "X18" | "X21") if along_reference => {
                return Err(RequestFault::Gimbals { file: file(), model });
            }
            (SensorKind::Mag, _) if along_reference => {}
            _ => {
                pose::axes_and_encoders(recording).map_err(|why| RequestFault::Rig {
                    file: file(),
                    kind: self.kind,
                    model,
                    why: why.to_string(),
                })?;
            }
        }
        if self.kind == SensorKind::Mag && recording.manifest.site.field_ned_ut.is_none() {
            return Err(RequestFault::Field { file: file(), model });
        }
        Ok(())
    }
}
