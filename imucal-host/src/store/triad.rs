//! One sensor of a stored calibration.

use imucal_core::{
    record,
    temperature::{TemperatureCurvature, TemperatureTerms, Warmth},
    triad::Triad,
};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::{StoredCalibration, StoredCurvature, StoredNonlinearity, StoredTemperatureQuality, record_form};
use crate::{file::digest::sha256_of, recording::Unit};

/// One sensor's calibration: `calibrated = gain · (raw − bias)` and how good it was.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StoredTriad {
    /// Model's name.
    pub model: String,
    /// Unit of raw values.
    pub unit_in: Unit,
    /// Unit of calibrated values.
    pub unit_out: Unit,
    /// `unit_out` per `unit_in`, by rows.
    pub gain: [[f64; 3]; 3],
    /// `unit_in`.
    pub bias: [f64; 3],
    /// Standard errors of the gain; 0 for an entry that is not estimated.
    pub gain_std: [[f64; 3]; 3],
    /// Standard errors of the bias.
    pub bias_std: [f64; 3],
    /// Rms residual, `unit_out`; rad a turn for the gyroscope.
    pub rms: f64,
    /// The same for observations left out of the fit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub held_out_rms: Option<f64>,
    /// Observations used.
    pub observations: u32,
    /// Parameters estimated.
    pub parameters: u8,
    /// Condition of the normalised Jacobian.
    pub condition: f64,
    /// Share of the sphere of directions seen.
    pub coverage: f64,
    /// Length of the field where it was not known beforehand, `unit_in`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub field_norm: Option<f64>,
    /// Serial of the unit and day of the calibration, where they are not the file's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub provenance: Option<StoredProvenance>,
    /// Temperature terms, where they were calibrated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature: Option<StoredTemperature>,
    /// Quadratic, cubic and cross terms, where they were calibrated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nonlinearity: Option<StoredNonlinearity>,
}

impl StoredTriad {
    /// Gain and bias to compute with.
    #[must_use]
    pub fn triad(&self) -> Triad<f64> {
        let gain = Matrix3::from_fn(|row, column| self.gain[row][column]);
        Triad { gain, bias: Vector3::from(self.bias) }
    }

    /// What it is known by in the manifests of what it has corrected: the first 16 digits of the SHA-256 of gain, by rows, and bias as
    /// the device holds them. A file for people and its record have the same.
    #[must_use]
    pub fn identity(&self) -> String {
        let numbers = self.gain.as_flattened().iter().chain(&self.bias);
        let bytes: Vec<u8> = numbers.flat_map(|number| (*number as f32).to_le_bytes()).collect();
        let mut digits = sha256_of(&bytes);
        digits.truncate(16);
        digits
    }

    /// Itself, with the serial and the day of the calibration that it is taken from.
    #[must_use]
    pub fn from_day(&self, of: &StoredCalibration) -> Self {
        let own = || StoredProvenance { serial: of.sensor.serial.clone(), date: of.date };
        Self { provenance: Some(self.provenance.clone().unwrap_or_else(own)), ..self.clone() }
    }
}

impl StoredTriad {
    /// As it is at another reference temperature, °C, without terms of temperature: gain and bias, with standard errors that those of
    /// the terms bring over the difference. Correlations between entries and terms are not kept, and not taken into account.
    #[must_use]
    pub fn at_temperature(&self, temperature: f64) -> Self {
        let Some(terms) = &self.temperature else { return self.clone() };
        let Warmth { bias, factor } = terms.warmth(&self.triad(), temperature);
        let change = temperature - terms.reference;
        let brought = |slope: [f64; 3], square: [f64; 3]| -> [f64; 3] {
            std::array::from_fn(|axis| (change * slope[axis]).hypot(change * change * square[axis]))
        };
        let (quality, curvature) = (terms.quality.unwrap_or_default(), terms.curvature.unwrap_or_default());
        let by_bias = brought(quality.bias_slope_std, curvature.bias_std);
        let by_scale = brought(quality.scale_slope_std, curvature.scale_std);
        let entries = |of: &dyn Fn(usize, usize) -> f64| -> [[f64; 3]; 3] {
            std::array::from_fn(|row| std::array::from_fn(|column| of(row, column)))
        };
        Self {
            gain: entries(&|row, column| factor[row] * self.gain[row][column]),
            bias: bias.into(),
            gain_std: entries(&|row, column| match self.gain_std[row][column] {
                std if std > 0.0 => (factor[row] * std).hypot(self.gain[row][column] * by_scale[row]),
                not_estimated => not_estimated,
            }),
            bias_std: std::array::from_fn(|axis| self.bias_std[axis].hypot(by_bias[axis])),
            temperature: None,
            ..self.clone()
        }
    }
}

/// Where a triad comes from; see [`imucal_core::record::Provenance`].
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StoredProvenance {
    /// Serial number, empty where unknown.
    #[serde(default)]
    pub serial: String,
    /// Day it was made; in TOML as YYYY-MM-DD.
    #[serde(with = "record_form::date_text")]
    pub date: record::Date,
}

/// Temperature terms; see [`imucal_core::temperature`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StoredTemperature {
    /// °C.
    pub reference: f64,
    /// `unit_in` per kelvin.
    pub bias_slope: [f64; 3],
    /// Per kelvin.
    pub scale_slope: [f64; 3],
    /// How well they are known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quality: Option<StoredTemperatureQuality>,
    /// The second order.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curvature: Option<StoredCurvature>,
}

impl StoredTemperature {
    fn warmth(&self, triad: &Triad<f64>, temperature: f64) -> Warmth<f64> {
        let Self { reference, bias_slope, scale_slope, .. } = *self;
        let curvature = self.curvature.unwrap_or_default();
        let curvature = TemperatureCurvature { bias: curvature.bias, scale: curvature.scale };
        TemperatureTerms { reference, bias_slope, scale_slope }.at_curved(&curvature, triad, temperature)
    }
}
