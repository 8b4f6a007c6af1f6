//! Samples through a device.

use imucal_core::{
    link::{Reply, Request, Values},
    record::Sensor,
};
use nalgebra::Vector3;

use super::{DeviceError, Session};
use crate::recording::SensorKind;

impl Session {
    /// Has samples of one triad corrected, raw unit of the record in use; `temperature` in °C, NaN where unknown.
    ///
    /// # Errors
    /// [`DeviceError`], where the device has no calibration of the sensor among others.
    pub fn correct(
        &mut self,
        sensor: Sensor,
        temperature: f32,
        raw: &[Vector3<f32>],
    ) -> Result<Vec<Vector3<f32>>, DeviceError> {
        let mut corrected = Vec::with_capacity(raw.len());
        for batch in raw.chunks(Values::new().capacity()) {
            let raw: Values = batch.iter().map(|sample| <[f32; 3]>::from(*sample)).collect();
            let request = Request::Correct { sensor, temperature, raw };
            let values = self.ask(&request, "corrected samples", |reply| match reply {
                Reply::Corrected(values) if values.len() == batch.len() => Some(values.clone()),
                _ => None,
            })?;
            corrected.extend(values.into_iter().map(Vector3::from));
        }
        Ok(corrected)
    }

    /// The same where each sample has a temperature.
    ///
    /// # Errors
    /// As above.
    pub fn correct_at(
        &mut self,
        kind: SensorKind,
        raw: &[Vector3<f32>],
        temperature: &[f32],
    ) -> Result<Vec<Vector3<f32>>, DeviceError> {
        let mut corrected = Vec::with_capacity(raw.len());
        let mut left = raw;
        for alike in temperature.chunk_by(|a, b| a.to_bits() == b.to_bits()) {
            let (now, later) = left.split_at(alike.len().min(left.len()));
            corrected.extend(self.correct(kind.into(), alike.first().copied().unwrap_or(f32::NAN), now)?);
            left = later;
        }
        Ok(corrected)
    }
}
