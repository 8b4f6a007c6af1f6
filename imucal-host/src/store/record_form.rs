//! The stored calibration as the device's record, and back.

use std::path::Path;

use imucal_core::{
    record::{
        self, CalibrationRecord, Date, FitQuality, HigherOrder, Provenance, RawUnit, Sensor, SensorIdentity,
        TriadRecord,
    },
    temperature::TemperatureTerms,
};

use super::{
    FORMAT, SaveError, StoredCalibration, StoredProvenance, StoredSensor, StoredTemperature, StoredTriad,
};
use crate::recording::{SensorKind, Unit};

pub(super) fn narrow<const N: usize>(values: [f64; N]) -> [f32; N] {
    values.map(|v| v as f32)
}

pub(super) fn widen<const N: usize>(values: [f32; N]) -> [f64; N] {
    values.map(f64::from)
}

/// Both lists spell their units as the contract does, so the symbol carries one to the other.
pub(crate) fn raw_unit(unit: Unit) -> RawUnit {
    RawUnit::from_symbol(&unit.to_string()).unwrap_or(RawUnit::Arbitrary)
}

fn unit(unit: RawUnit) -> Unit {
    unit.symbol().parse().unwrap_or(Unit::Arbitrary)
}

impl From<SensorKind> for Sensor {
    fn from(kind: SensorKind) -> Self {
        match kind {
            SensorKind::Acc => Self::Accelerometer,
            SensorKind::Gyr => Self::Gyroscope,
            SensorKind::Mag => Self::Magnetometer,
        }
    }
}

fn text<const N: usize>(
    path: &Path,
    field: &'static str,
    text: &str,
) -> Result<heapless::String<N>, SaveError> {
    text.parse().map_err(|_| SaveError::TooLong { path: path.into(), field, text: text.into(), limit: N })
}

/// Where another intact record begins behind the first byte, and when its calibration was made.
pub(super) fn another(bytes: &[u8]) -> Option<(usize, Date)> {
    (1..bytes.len()).find_map(|at| {
        let record = record::decode_as::<HigherOrder>(bytes.get(at..)?).ok()?;
        Some((at, record.date))
    })
}

impl StoredCalibration {
    /// The device's record. `path` is named in errors.
    ///
    /// # Errors
    /// [`SaveError::TooLong`] for a name, serial or model that the record has no room for.
    pub fn to_record(&self, path: &Path) -> Result<CalibrationRecord<HigherOrder>, SaveError> {
        let triad = |stored: &Option<StoredTriad>| stored.as_ref().map(|t| t.to_record(path)).transpose();
        let provenance = |stored: &Option<StoredTriad>| {
            let own = stored.as_ref().and_then(|t| t.provenance.as_ref());
            own.map(|own| {
                Ok::<_, SaveError>(Provenance { serial: text(path, "serial", &own.serial)?, date: own.date })
            })
            .transpose()
        };
        Ok(CalibrationRecord {
            sensor: SensorIdentity {
                name: text(path, "sensor name", &self.sensor.name)?,
                serial: text(path, "serial", &self.sensor.serial)?,
            },
            date: self.date,
            acc: triad(&self.acc)?,
            gyr: triad(&self.gyr)?,
            mag: triad(&self.mag)?,
            provenance: [provenance(&self.acc)?, provenance(&self.gyr)?, provenance(&self.mag)?],
        })
    }

    /// What a record holds.
    pub fn from_record(record: &CalibrationRecord<HigherOrder>) -> Self {
        let [acc, gyr, mag] = Sensor::ALL.map(|sensor| {
            let own = record.provenance[sensor as usize].as_ref();
            let provenance =
                own.map(|own| StoredProvenance { serial: own.serial.as_str().into(), date: own.date });
            record.triad(sensor).map(|triad| StoredTriad { provenance, ..StoredTriad::from_record(triad) })
        });
        Self {
            format: FORMAT.into(),
            recording: String::new(),
            date: record.date,
            sensor: StoredSensor {
                name: record.sensor.name.as_str().into(),
                serial: record.sensor.serial.as_str().into(),
            },
            acc,
            gyr,
            mag,
        }
    }
}

impl StoredTriad {
    fn to_record(&self, path: &Path) -> Result<TriadRecord<HigherOrder>, SaveError> {
        Ok(TriadRecord {
            gain: self.gain.map(narrow),
            bias: narrow(self.bias),
            unit_in: raw_unit(self.unit_in),
            unit_out: raw_unit(self.unit_out),
            model: text(path, "model", &self.model)?,
            temperature: self.temperature.map(|t| TemperatureTerms {
                reference: t.reference as f32,
                bias_slope: narrow(t.bias_slope),
                scale_slope: narrow(t.scale_slope),
            }),
            quality: FitQuality {
                gain_std: self.gain_std.map(narrow),
                bias_std: narrow(self.bias_std),
                rms: self.rms as f32,
                held_out_rms: self.held_out_rms.map(|rms| rms as f32),
                observations: self.observations,
                parameters: self.parameters,
                condition: self.condition as f32,
                coverage: self.coverage as f32,
                field_norm: self.field_norm.map(|norm| norm as f32),
            },
            order: self.order(),
        })
    }

    /// What a record's triad holds, exactly.
    pub fn from_record(record: &TriadRecord<HigherOrder>) -> Self {
        let quality = &record.quality;
        Self {
            model: record.model.as_str().into(),
            unit_in: unit(record.unit_in),
            unit_out: unit(record.unit_out),
            gain: record.gain.map(widen),
            bias: widen(record.bias),
            gain_std: quality.gain_std.map(widen),
            bias_std: widen(quality.bias_std),
            rms: quality.rms.into(),
            held_out_rms: quality.held_out_rms.map(f64::from),
            observations: quality.observations,
            parameters: quality.parameters,
            condition: quality.condition.into(),
            coverage: quality.coverage.into(),
            field_norm: quality.field_norm.map(f64::from),
            provenance: None,
            temperature: record.temperature.as_ref().map(|t| StoredTemperature {
                reference: t.reference.into(),
                bias_slope: widen(t.bias_slope),
                scale_slope: widen(t.scale_slope),
                quality: record.order.warmth.as_ref().map(Into::into),
                curvature: record.order.curvature.as_ref().map(Into::into),
            }),
            nonlinearity: record.order.nonlinearity.as_ref().map(Into::into),
        }
    }
}

/// A date as YYYY-MM-DD in text files.
pub mod date_text {
    use imucal_core::record::Date;
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    /// Writes the date.
    ///
    /// # Errors
    /// The serializer's own.
    pub fn serialize<S: Serializer>(date: &Date, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(date)
    }

    /// Reads the date.
    ///
    /// # Errors
    /// Text that is no date between 1970 and 2999.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Date, D::Error> {
        let text = String::deserialize(deserializer)?;
        parse(&text).ok_or_else(|| D::Error::custom(format!("`{text}` is no date; expected YYYY-MM-DD")))
    }

    /// The first day whose text this is: dates are few, and only one way of counting them is kept.
    fn parse(text: &str) -> Option<Date> {
        let year: u32 = text.get(..4)?.parse().ok()?;
        let first = year.checked_sub(1970)?.checked_mul(365)?;
        (first..first + 366 + year / 4).map(Date::from_days).find(|date| date.to_string() == text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use imucal_core::record::Date;

    fn stored() -> StoredCalibration {
        StoredCalibration {
            format: FORMAT.into(),
            recording: String::new(),
            date: Date::from_days(20_778),
            sensor: StoredSensor { name: "MTx".into(), serial: "00300512".into() },
            acc: Some(StoredTriad {
                model: "T9".into(),
                unit_in: Unit::Counts,
                unit_out: Unit::MetrePerSecondSquared,
                gain: [[0.25, 0.0, -0.5], [0.0, 0.25, 0.125], [0.0, 0.0, 0.5]],
                bias: [33_123.75, 33_275.125, 32_364.5],
                gain_std: [[0.0; 3]; 3],
                bias_std: [0.25; 3],
                rms: 0.001,
                held_out_rms: None,
                observations: 38,
                parameters: 9,
                condition: 16.0,
                coverage: 0.875,
                field_norm: None,
                provenance: Some(StoredProvenance { serial: String::new(), date: Date::from_days(20_000) }),
                temperature: None,
                nonlinearity: None,
            }),
            gyr: None,
            mag: None,
        }
    }

    #[test]
    fn a_calibration_survives_the_record_and_the_toml() {
        let mut original = stored();
        if let Some(acc) = &mut original.acc {
            acc.rms = 0.0009765625;
        }
        let record = original.to_record(Path::new("x.bin")).unwrap();
        assert_eq!(StoredCalibration::from_record(&record), original);
        let text = toml::to_string(&original).unwrap();
        assert!(text.contains("date = \"2026-11-21\""), "{text}");
        assert_eq!(toml::from_str::<StoredCalibration>(&text).unwrap(), original);
    }

    #[test]
    fn a_file_with_two_records_is_refused_and_one_with_an_erased_rest_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("dump.bin");
        let load = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            StoredCalibration::load(&path)
        };
        let first = stored().record(&path).unwrap();
        let erased = [first.clone(), vec![0xFF; 300]].concat();
        assert!(load(&erased).is_ok());
        let later = StoredCalibration { date: Date::from_days(20_800), ..stored() };
        let message = load(&[erased.clone(), later.record(&path).unwrap()].concat()).unwrap_err().to_string();
        for part in ["dump.bin", "2026-11-21", &format!("byte {}", erased.len()), "2026-12-13"] {
            assert!(message.contains(part), "{message}");
        }
    }

    #[test]
    fn every_unit_of_a_recording_is_one_of_the_record_and_back() {
        for kind in SensorKind::ALL {
            for each in Unit::of(kind) {
                assert_eq!(unit(raw_unit(*each)), *each);
            }
        }
    }

    #[test]
    fn a_serial_longer_than_the_record_s_room_is_an_error_that_says_so() {
        let mut long = stored();
        long.sensor.serial = "x".repeat(33);
        let message = long.to_record(Path::new("x.bin")).unwrap_err().to_string();
        assert!(
            message.contains("x.bin") && message.contains("serial") && message.contains("32"),
            "{message}"
        );
    }
}
