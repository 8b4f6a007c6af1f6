//! What no record may hold, neither written nor read.

use core::fmt;

use serde::{Deserialize, Serialize};

use super::{CalibrationRecord, Order, RawUnit, Sensor};

/// Figures of a [`TriadRecord`](super::TriadRecord). The order of the variants is the messages' format: append only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Figures {
    /// The 3×3 gain; out of range, the length of one of its columns: calibrated units of an axis' raw unit.
    Gain,
    /// Length of the gain's longest column against that of the shortest.
    AxisRatio,
    /// The bias.
    Bias,
    /// Reference temperature.
    Reference,
    /// Growth of the bias a kelvin.
    BiasSlope,
    /// Growth of the scale a kelvin.
    ScaleSlope,
    /// Standard errors of the gain.
    GainStd,
    /// Standard errors of the bias.
    BiasStd,
    /// Root mean square residual.
    Rms,
    /// The same of observations held out.
    HeldOutRms,
    /// Condition of the Jacobian.
    Condition,
    /// Share of directions seen.
    Coverage,
    /// Magnitude of the field.
    FieldNorm,
    /// Least and greatest temperature of the calibration.
    TemperatureSpan,
    /// Standard errors of the bias slope.
    BiasSlopeStd,
    /// Standard errors of the scale slope.
    ScaleSlopeStd,
    /// Growth of the bias a kelvin².
    BiasCurvature,
    /// Growth of the scale a kelvin².
    ScaleCurvature,
    /// Standard errors of the bias curvature.
    BiasCurvatureStd,
    /// Standard errors of the scale curvature.
    ScaleCurvatureStd,
    /// Range that the nonlinear terms hold in.
    NonlinearRange,
    /// Nonlinear terms; out of range, their slope over that range.
    Nonlinearity,
    /// Standard errors of the nonlinear terms; out of range, the slope of these.
    NonlinearityStd,
}

/// Why a record cannot be used, although it is intact. The order of the variants is the messages' format: append only.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Defect {
    /// An infinite figure or a NaN.
    NotFinite {
        /// Whose.
        sensor: Sensor,
        /// Where.
        figures: Figures,
    },
    /// A gain whose columns are dependent: see [`is_singular`](crate::triad::Triad::is_singular).
    Singular {
        /// Whose.
        sensor: Sensor,
    },
    /// A unit that such a sensor has not.
    ForeignUnit {
        /// Whose.
        sensor: Sensor,
        /// The unit, of raw or of calibrated values.
        unit: RawUnit,
    },
    /// No sensor and no fit is like that.
    OutOfRange {
        /// Whose.
        sensor: Sensor,
        /// Where.
        figures: Figures,
        /// The figure, in the unit that the record has it in.
        value: f32,
        /// The least that would pass.
        least: f32,
        /// The most that would pass.
        most: f32,
    },
    /// Figures of temperature terms that the triad has not.
    WithoutTerms {
        /// Whose.
        sensor: Sensor,
        /// Which.
        figures: Figures,
    },
}

impl Defect {
    /// Whose figures cannot be used.
    pub fn sensor(&self) -> Sensor {
        match self {
            Self::NotFinite { sensor, .. }
            | Self::Singular { sensor }
            | Self::ForeignUnit { sensor, .. }
            | Self::OutOfRange { sensor, .. }
            | Self::WithoutTerms { sensor, .. } => *sensor,
        }
    }
}

impl Figures {
    /// Their name in a sentence.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gain => "gain",
            Self::AxisRatio => "ratio of the axes' gains",
            Self::Bias => "bias",
            Self::Reference => "reference temperature",
            Self::BiasSlope => "bias slope",
            Self::ScaleSlope => "scale slope",
            Self::GainStd => "gain's standard error",
            Self::BiasStd => "bias' standard error",
            Self::Rms => "rms residual",
            Self::HeldOutRms => "held-out rms residual",
            Self::Condition => "condition",
            Self::Coverage => "coverage",
            Self::FieldNorm => "field's magnitude",
            Self::TemperatureSpan => "temperature span",
            Self::BiasSlopeStd => "bias slope's standard error",
            Self::ScaleSlopeStd => "scale slope's standard error",
            Self::BiasCurvature => "bias curvature",
            Self::ScaleCurvature => "scale curvature",
            Self::BiasCurvatureStd => "bias curvature's standard error",
            Self::ScaleCurvatureStd => "scale curvature's standard error",
            Self::NonlinearRange => "range of the nonlinear terms",
            Self::Nonlinearity => "slope of the nonlinear terms",
            Self::NonlinearityStd => "slope of the nonlinear terms' standard errors",
        }
    }
}

impl fmt::Display for Defect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.sensor().symbol())?;
        match self {
            Self::NotFinite { figures, .. } => write!(f, "the {} is not finite", figures.name()),
            Self::Singular { .. } => f.write_str("the gain is singular"),
            Self::ForeignUnit { unit, .. } => write!(f, "no such sensor has the unit {}", unit.symbol()),
            Self::WithoutTerms { figures, .. } => {
                write!(f, "there is a {}, and no temperature terms that it belongs to", figures.name())
            }
            Self::OutOfRange { figures, value, least, most, .. } => {
                let [value, least, most] = [value, least, most].map(|figure| Written(*figure));
                write!(f, "the {} is {value}, expected {least} to {most}", figures.name())
            }
        }
    }
}

impl core::error::Error for Defect {}

/// A figure to four digits, with a power of ten where it is large or small.
struct Written(f32);

impl fmt::Display for Written {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let size = if self.0 < 0.0 { -self.0 } else { self.0 };
        match size {
            0.0 => f.write_str("0"),
            0.1..1e5 => write!(f, "{:.3}", self.0),
            _ => write!(f, "{:.3e}", self.0),
        }
    }
}

impl<O: Order> CalibrationRecord<O> {
    /// Can the record be used? [`encode`](super::encode) and [`decode`](super::decode) both ask.
    ///
    /// # Errors
    ///
    /// The first [`Defect`], in the order of [`Sensor::ALL`].
    pub fn check(&self) -> Result<(), Defect> {
        let check = |sensor| self.triad(sensor).map_or(Ok(()), |triad| triad.check(sensor));
        check(Sensor::Accelerometer)?;
        check(Sensor::Gyroscope)?;
        check(Sensor::Magnetometer)
    }
}
