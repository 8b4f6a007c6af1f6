//! What a stored triad holds beyond its first order, and what is known of its temperature terms.

use imucal_core::{
    nonlinearity::{NonlinearTerms, Nonlinearity},
    record::{CurvatureRecord, HigherOrder, NonlinearRecord, TemperatureQuality},
    temperature::TemperatureCurvature,
};
use serde::{Deserialize, Serialize};

use super::{
    StoredTriad,
    record_form::{narrow, widen},
};
use crate::calibrate::nonlinear_terms::NonlinearFinding;

/// What temperature terms were found from, and how well; see [`TemperatureQuality`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StoredTemperatureQuality {
    /// Least and greatest temperature of the calibration, °C.
    pub span: [f64; 2],
    /// Standard errors, `unit_in` per kelvin; 0 for an entry held fixed.
    pub bias_slope_std: [f64; 3],
    /// Standard errors, per kelvin.
    pub scale_slope_std: [f64; 3],
}

/// Temperature to second order; see [`CurvatureRecord`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StoredCurvature {
    /// `unit_in` per kelvin².
    pub bias: [f64; 3],
    /// Per kelvin².
    pub scale: [f64; 3],
    /// Standard errors of `bias`; 0 for an entry held fixed.
    pub bias_std: [f64; 3],
    /// Standard errors of `scale`.
    pub scale_std: [f64; 3],
}

/// Quadratic, cubic and cross terms; see [`NonlinearRecord`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StoredNonlinearity {
    /// Largest |raw − bias| of an axis that the calibration has seen, `unit_in`.
    pub range: f64,
    /// Per `unit_in`.
    pub quadratic: [f64; 3],
    /// Per `unit_in`².
    pub cubic: [f64; 3],
    /// Per `unit_in`; columns multiply xy, yz, zx.
    pub cross: [[f64; 3]; 3],
    /// Standard errors of `quadratic`; 0 for an entry held fixed.
    pub quadratic_std: [f64; 3],
    /// Standard errors of `cubic`.
    pub cubic_std: [f64; 3],
    /// Standard errors of `cross`.
    pub cross_std: [[f64; 3]; 3],
}

impl From<&NonlinearFinding> for StoredNonlinearity {
    fn from(found: &NonlinearFinding) -> Self {
        Self {
            range: found.range,
            quadratic: found.terms.quadratic,
            cubic: found.terms.cubic,
            cross: found.terms.cross,
            quadratic_std: found.std.quadratic,
            cubic_std: found.std.cubic,
            cross_std: found.std.cross,
        }
    }
}

impl StoredNonlinearity {
    /// As a device computes with it.
    pub fn nonlinearity(&self) -> Nonlinearity<f32> {
        Nonlinearity { terms: self.terms(), range: self.range as f32 }
    }

    fn terms(&self) -> NonlinearTerms<f32> {
        NonlinearTerms {
            quadratic: narrow(self.quadratic),
            cubic: narrow(self.cubic),
            cross: self.cross.map(narrow),
        }
    }
}

impl StoredTriad {
    /// What the record holds of it beyond the first order.
    pub(super) fn order(&self) -> HigherOrder {
        let temperature = self.temperature.as_ref();
        HigherOrder {
            warmth: temperature.and_then(|terms| terms.quality).map(|quality| TemperatureQuality {
                span: narrow(quality.span),
                bias_slope_std: narrow(quality.bias_slope_std),
                scale_slope_std: narrow(quality.scale_slope_std),
            }),
            curvature: temperature.and_then(|terms| terms.curvature).map(|curvature| CurvatureRecord {
                terms: TemperatureCurvature { bias: narrow(curvature.bias), scale: narrow(curvature.scale) },
                std: TemperatureCurvature {
                    bias: narrow(curvature.bias_std),
                    scale: narrow(curvature.scale_std),
                },
            }),
            nonlinearity: self.nonlinearity.map(|found| NonlinearRecord {
                range: found.range as f32,
                terms: found.terms(),
                std: NonlinearTerms {
                    quadratic: narrow(found.quadratic_std),
                    cubic: narrow(found.cubic_std),
                    cross: found.cross_std.map(narrow),
                },
            }),
        }
    }
}

impl From<&TemperatureQuality> for StoredTemperatureQuality {
    fn from(quality: &TemperatureQuality) -> Self {
        Self {
            span: widen(quality.span),
            bias_slope_std: widen(quality.bias_slope_std),
            scale_slope_std: widen(quality.scale_slope_std),
        }
    }
}

impl From<&CurvatureRecord> for StoredCurvature {
    fn from(curvature: &CurvatureRecord) -> Self {
        Self {
            bias: widen(curvature.terms.bias),
            scale: widen(curvature.terms.scale),
            bias_std: widen(curvature.std.bias),
            scale_std: widen(curvature.std.scale),
        }
    }
}

impl From<&NonlinearRecord> for StoredNonlinearity {
    fn from(found: &NonlinearRecord) -> Self {
        Self {
            range: found.range.into(),
            quadratic: widen(found.terms.quadratic),
            cubic: widen(found.terms.cubic),
            cross: found.terms.cross.map(widen),
            quadratic_std: widen(found.std.quadratic),
            cubic_std: widen(found.std.cubic),
            cross_std: found.std.cross.map(widen),
        }
    }
}
