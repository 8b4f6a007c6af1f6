//! What no record may hold, neither written nor read.

use core::fmt;

use super::{CalibrationRecord, Sensor, TriadRecord};

/// A group of figures of a [`TriadRecord`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Figures {
    /// The 3×3 gain.
    Gain,
    /// The bias.
    Bias,
    /// Reference and slopes of the temperature terms.
    Temperature,
    /// Standard errors and other marks of the fit.
    Quality,
}

/// Why a record cannot be used, although it is intact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
    /// a gain whose columns are dependent: see [`is_singular`](crate::triad::Triad::is_singular).
    Singular {
        /// Whose.
        sensor: Sensor,
    },
}

impl fmt::Display for Defect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (sensor, what) = match self {
            Self::NotFinite { sensor, figures } => (
                sensor,
                match figures {
                    Figures::Gain => ": the gain is not finite",
                    Figures::Bias => ": the bias is not finite",
                    Figures::Temperature => ": the temperature terms are not finite",
                    Figures::Quality => ": the figures of quality are not finite",
                },
            ),
            Self::Singular { sensor } => (sensor, ": the gain is singular"),
        };
        f.write_str(sensor.symbol())?;
        f.write_str(what)
    }
}

impl core::error::Error for Defect {}

impl CalibrationRecord {
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

impl TriadRecord {
    #[inline(never)]
    fn check(&self, sensor: Sensor) -> Result<(), Defect> {
        let not_finite = |figures| Err(Defect::NotFinite { sensor, figures });
        if !finite(self.gain.as_flattened()) {
            return not_finite(Figures::Gain);
        }
        if !finite(&self.bias) {
            return not_finite(Figures::Bias);
        }
        if self.temperature.as_ref().is_some_and(|terms| !terms.is_finite()) {
            return not_finite(Figures::Temperature);
        }
        let quality = &self.quality;
        if !finite(quality.gain_std.as_flattened())
            || !finite(&quality.bias_std)
            || !finite(&[quality.rms, quality.condition, quality.coverage])
            || !finite(quality.held_out_rms.as_slice())
            || !finite(quality.field_norm.as_slice())
        {
            return not_finite(Figures::Quality);
        }
        if self.triad::<f32>().is_singular() {
            return Err(Defect::Singular { sensor });
        }
        Ok(())
    }
}

#[inline(never)]
fn finite(figures: &[f32]) -> bool {
    figures.iter().all(|figure| figure.is_finite())
}
