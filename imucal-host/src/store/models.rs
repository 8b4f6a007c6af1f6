//! The models of a calibration, by which another recording of its unit is fitted alike.

use super::StoredCalibration;
use crate::{
    calibrate::{AccModel, Options, gyr::rig, known_attitudes::ladder},
    recording::SensorKind,
};

impl StoredCalibration {
    /// The same models as options of a calibration; a name that stands on no ladder is that of a field form.
    #[must_use]
    pub fn models(&self) -> Options {
        let rung = |kind: SensorKind, ladder: &[(&'static str, &str)]| {
            let model = &self.triad(kind)?.model;
            ladder.iter().find(|(name, _)| name == model).map(|(name, _)| *name)
        };
        let six = self.acc.as_ref().is_some_and(|triad| triad.model == AccModel::T6.name());
        Options {
            acc: if six { AccModel::T6 } else { AccModel::T9 },
            rig_acc: rung(SensorKind::Acc, &ladder::ACCELEROMETER),
            rig_gyr: rung(SensorKind::Gyr, &rig::MODELS),
            rig_mag: rung(SensorKind::Mag, &ladder::MAGNETOMETER),
            ..Options::default()
        }
    }
}
