//! The manifest: what the samples of a recording are.

pub mod check;
pub mod fault;
pub mod gravity;
mod keys;
mod per_sensor;
mod reference;
mod rig;
pub(crate) mod site;
pub(crate) mod spelling;

use std::{
    io,
    path::{Path, PathBuf},
};

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

pub use self::{
    fault::FORMAT,
    per_sensor::PerSensor,
    reference::{ReferenceInfo, ReferenceKind},
    rig::{Axis, Rig, RigKind},
    site::Site,
};
use self::{fault::ManifestFault, keys::KeyMap};
use super::{
    format::{COLUMNS, LOGS, is_bag_folder},
    read_error::ReadError,
    sensor_kind::SensorKind,
    triple::{Nominal, Triple},
    unit::{AngleUnit, TemperatureUnit, TimeUnit, Unit},
    warning::Warning,
};
use crate::file::{Limits, ReadFault};

/// A recording's manifest; each section may be left out of the file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Always [`FORMAT`].
    pub format: String,
    /// Units of the file's columns.
    #[serde(default)]
    pub units: Units,
    /// Where it was recorded.
    #[serde(default, skip_serializing_if = "Site::is_empty")]
    pub site: Site,
    /// What turned the sensor; `None` is a field recording without a reference attitude.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rig: Option<Rig>,
    /// What the reference columns are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference: Option<ReferenceInfo>,
    /// Full scales.
    #[serde(default, skip_serializing_if = "PerSensor::is_empty")]
    pub ranges: PerSensor<f64>,
    /// Nominal conversions of counts.
    #[serde(default, skip_serializing_if = "PerSensor::is_empty")]
    pub counts: PerSensor<Counts>,
    /// By which calibrations the samples have been corrected, the first one first.
    #[serde(default, skip_serializing_if = "PerSensor::is_empty")]
    pub calibrated: PerSensor<Vec<String>>,
    /// Which unit was recorded.
    #[serde(default, skip_serializing_if = "Identity::is_empty")]
    pub sensor: Identity,
}

/// Units of a recording's columns. The default is the SI side.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Units {
    /// Of `t`.
    pub t: TimeUnit,
    /// Of the accelerometer.
    #[serde(deserialize_with = "Unit::deserialize_acc")]
    pub acc: Unit,
    /// Of the gyroscope.
    #[serde(deserialize_with = "Unit::deserialize_gyr")]
    pub gyr: Unit,
    /// Of the magnetometer.
    #[serde(deserialize_with = "Unit::deserialize_mag")]
    pub mag: Unit,
    /// Of `temp`.
    pub temp: TemperatureUnit,
    /// Of the encoder angles.
    pub gimbal: AngleUnit,
}

impl Default for Units {
    fn default() -> Self {
        Self {
            t: TimeUnit::Second,
            acc: Unit::MetrePerSecondSquared,
            gyr: Unit::RadianPerSecond,
            mag: Unit::MicroTesla,
            temp: TemperatureUnit::Celsius,
            gimbal: AngleUnit::Radian,
        }
    }
}

impl Units {
    /// Keys that are not given, with the units that stand for them; `temp` has no other.
    fn without(&self, given: impl Fn(&str) -> bool) -> Vec<(&'static str, String)> {
        let all = [
            ("t", self.t.to_string()),
            ("acc", self.acc.to_string()),
            ("gyr", self.gyr.to_string()),
            ("mag", self.mag.to_string()),
            ("gimbal", self.gimbal.to_string()),
        ];
        all.into_iter().filter(|(key, _)| !given(key)).collect()
    }

    /// Unit of a sensor's columns.
    #[must_use]
    pub fn of(&self, kind: SensorKind) -> Unit {
        match kind {
            SensorKind::Acc => self.acc,
            SensorKind::Gyr => self.gyr,
            SensorKind::Mag => self.mag,
        }
    }
}

/// Nominal conversion of counts: value = (raw − offset) / per_unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Counts {
    /// Counts at zero; finite.
    #[serde(default)]
    pub offset: f64,
    /// Counts per m/s², rad/s or µT; finite, not zero.
    pub per_unit: f64,
}

/// Which unit was recorded.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// Name or type.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Serial number as text.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub serial: Option<String>,
}

impl Identity {
    fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

impl Default for Manifest {
    /// SI units and nothing known of site, rig and sensor.
    fn default() -> Self {
        Self {
            format: FORMAT.to_owned(),
            units: Units::default(),
            site: Site::default(),
            rig: None,
            reference: None,
            ranges: PerSensor::default(),
            counts: PerSensor::default(),
            calibrated: PerSensor::default(),
            sensor: Identity::default(),
        }
    }
}

impl Manifest {
    /// The manifest's path next to a samples file: `NAME.toml` for `NAME.csv`, `NAME.csv.gz`,
    /// `NAME.parquet`, `NAME.mat`, robots' logs and the folder `NAME` of one; `None` for a file of another ending.
    #[must_use]
    pub fn path_for(samples: &Path) -> Option<PathBuf> {
        let name = samples.file_name()?.to_str()?;
        if is_bag_folder(samples) {
            return Some(samples.with_file_name(format!("{name}.toml")));
        }
        let stem = COLUMNS.iter().chain(&LOGS).find_map(|ending| {
            let at = name.len().checked_sub(ending.len())?;
            let (stem, end) = name.split_at_checked(at)?;
            end.eq_ignore_ascii_case(ending).then_some(stem)
        })?;
        Some(samples.with_file_name(format!("{stem}.toml")))
    }

    /// Reads and checks a manifest; with it come warnings about keys it does not know.
    ///
    /// # Errors
    ///
    /// [`ReadError::ManifestMissing`] and the other manifest errors of [`ReadError`].
    pub fn read(path: &Path) -> Result<(Self, Vec<Warning>), ReadError> {
        Self::read_within(path, &Limits::default())
    }

    /// As [`Manifest::read`], with limits other than the default.
    ///
    /// # Errors
    ///
    /// As [`Manifest::read`].
    pub fn read_within(path: &Path, limits: &Limits) -> Result<(Self, Vec<Warning>), ReadError> {
        let bytes = limits.read_small(path).map_err(|fault| match fault {
            ReadFault::System(cause) if cause.kind() == io::ErrorKind::NotFound => {
                ReadError::ManifestMissing {
                    path: path.to_path_buf(),
                    recording: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
                }
            }
            fault => ReadError::of(path, fault),
        })?;
        let text = String::from_utf8(bytes).map_err(|cause| ReadError::NotUtf8 {
            path: path.to_path_buf(),
            line: KeyMap::line_at(
                &String::from_utf8_lossy(cause.as_bytes()),
                cause.utf8_error().valid_up_to(),
            ) as u64,
        })?;
        Self::parse(&text, path)
    }

    /// Whether a file is a manifest, of any version and whatever else is in it.
    #[must_use]
    pub fn is_manifest(path: &Path) -> bool {
        let text = Limits::default().read_small(path).ok().and_then(|bytes| String::from_utf8(bytes).ok());
        let table = text.and_then(|text| text.parse::<toml::Table>().ok());
        let format = table.as_ref().and_then(|table| table.get("format")?.as_str());
        format.is_some_and(|format| format.starts_with("imucal-recording/"))
    }

    /// Understands a manifest's text; `path` is for messages only.
    ///
    /// # Errors
    ///
    /// The manifest errors of [`ReadError`].
    pub fn parse(text: &str, path: &Path) -> Result<(Self, Vec<Warning>), ReadError> {
        let syntax = |error: &toml::de::Error| ReadError::ManifestSyntax {
            path: path.to_path_buf(),
            line: KeyMap::line_at(text, error.span().map_or(0, |span| span.start)),
            found: error.message().replace('\n', ", "),
        };
        let keys = KeyMap::parse(text).map_err(|error| syntax(&error))?;
        keys.check_format(FORMAT, path)?;
        let manifest: Self = toml::from_str(text).map_err(|error| syntax(&error))?;
        manifest.check().map_err(|fault| ReadError::Manifest {
            path: path.to_path_buf(),
            line: keys.line_of(fault.key().0, fault.key().1),
            fault,
        })?;
        let mut warnings = keys.unknown(path);
        let assumed = manifest.units.without(|key| keys.has("units", key));
        if !assumed.is_empty() {
            let line = keys.has_section("units").then(|| keys.line_of("units", ""));
            warnings.push(Warning::UnitsAssumed { path: path.to_path_buf(), line, assumed });
        }
        if let Some(found) = manifest.site.gravity.filter(|g| !(9.76..=9.84).contains(g)) {
            let line = keys.line_of("site", "gravity");
            warnings.push(Warning::GravityUnusual { path: path.to_path_buf(), line, found });
        }
        Ok((manifest, warnings))
    }

    /// Looks for contradictions: a unit of another sensor, counts without a conversion, numbers out of
    /// their range.
    ///
    /// # Errors
    ///
    /// The first one found.
    pub fn check(&self) -> Result<(), ManifestFault> {
        check::check(self)
    }

    /// A sensor's samples have been corrected by the calibration of this identity.
    #[must_use]
    pub fn is_calibrated_by(&self, kind: SensorKind, identity: &str) -> bool {
        self.calibrated.of_ref(kind).into_iter().flatten().any(|own| own == identity)
    }

    /// The manifest as TOML text.
    ///
    /// # Errors
    ///
    /// Whatever the TOML writer objects to; a manifest of this type gives it no cause.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        toml::to_string(self)
    }

    /// The same of a log, without units: its messages have those of ROS.
    pub(crate) fn to_toml_of_log(&self) -> Result<String, toml::ser::Error> {
        let mut sections = toml::Table::try_from(self)?;
        sections.retain(|section, _| section != "units" && section != "counts");
        toml::to_string(&sections)
    }

    /// Conversion between a sensor's columns and the SI side.
    ///
    /// # Errors
    ///
    /// [`ManifestFault::CountsWithoutConversion`].
    pub fn nominal(&self, kind: SensorKind) -> Result<Nominal, ManifestFault> {
        match (self.units.of(kind).per_si(), self.counts.of(kind)) {
            (Some(per_unit), _) => Ok(Nominal { offset: 0.0, per_unit }),
            (None, Some(counts)) => Ok(Nominal { offset: counts.offset, per_unit: counts.per_unit }),
            (None, None) => Err(ManifestFault::CountsWithoutConversion { sensor: kind }),
        }
    }

    /// Samples in SI units (m/s², rad/s, µT) with the unit, conversion and range this manifest gives.
    ///
    /// # Errors
    ///
    /// As [`Manifest::nominal`].
    pub fn triple(&self, kind: SensorKind, values: Vec<Vector3<f64>>) -> Result<Triple, ManifestFault> {
        Ok(Triple {
            values,
            unit: self.units.of(kind),
            nominal: self.nominal(kind)?,
            full_scale: self.ranges.of(kind),
            single: false,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_manifest_lies_in_the_folder_of_the_samples() {
        for (samples, manifest) in [
            ("d/a.csv", Some("d/a.toml")),
            ("a.b.csv.gz", Some("a.b.toml")),
            ("a.parquet", Some("a.toml")),
            ("a.mat", Some("a.toml")),
            ("a.mcap", Some("a.toml")),
            ("a.bag", Some("a.toml")),
            ("a_0.DB3", Some("a_0.toml")),
            ("a.txt", None),
        ] {
            assert_eq!(Manifest::path_for(Path::new(samples)), manifest.map(PathBuf::from));
        }
    }

    #[test]
    fn a_manifest_reads_back_what_it_writes() {
        let mut manifest = Manifest::default();
        manifest.units.acc = Unit::Counts;
        manifest.counts.acc = Some(Counts { offset: 32768.0, per_unit: 415.0 });
        manifest.site.field_ned_ut = Some([25.3, 2.6, 40.1]);
        manifest.rig = Some(Rig { kind: RigKind::FlightMotionSimulator, axes: Some(vec![Axis::Z, Axis::Y]) });
        manifest.reference = Some(ReferenceInfo {
            kind: ReferenceKind::Simulator,
            noise: Some(1e-3),
            name: Some("gazebo".to_owned()),
        });
        manifest.calibrated.acc = Some(vec!["0badcafe".to_owned(), "01234567".to_owned()]);
        manifest.sensor.serial = Some("00300512".to_owned());
        for manifest in [manifest, Manifest::default()] {
            let text = manifest.to_toml().unwrap();
            let (back, warnings) = Manifest::parse(&text, Path::new("a.toml")).unwrap();
            assert_eq!((back, warnings), (manifest, Vec::new()), "{text}");
        }
    }
}
