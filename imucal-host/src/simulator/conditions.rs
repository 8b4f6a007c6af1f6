//! What a recording is made under: where, how noisy, how exactly the gimbals stand.

use super::{
    place::Place,
    unit::{DriftKind, UnitUnderTest},
};

/// Noise of one sensor against its sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseLevel {
    /// White noise, in multiples of the sheet's.
    pub white: f64,
    /// Drift, in multiples of the sheet's.
    pub drift: f64,
    /// How it drifts.
    pub kind: DriftKind,
}

impl Default for NoiseLevel {
    fn default() -> Self {
        Self { white: 1.0, drift: 1.0, kind: DriftKind::default() }
    }
}

/// Conditions of a recording other than unit and programme. By default a quiet laboratory in Ankara and the sheet's noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditions {
    /// Where the rig stands.
    pub place: Place,
    /// Noise, by [`SensorKind::ALL`](crate::recording::SensorKind::ALL).
    pub noise: [NoiseLevel; 3],
    /// Standard deviation of where gimbals come to rest against their encoders, rad.
    pub scatter: f64,
}

impl Default for Conditions {
    fn default() -> Self {
        Self {
            place: Place::ankara(),
            noise: [NoiseLevel::default(); 3],
            // Thousandths of a degree.
            scatter: 0.002f64.to_radians(),
        }
    }
}

impl Conditions {
    /// The unit with the noise it has under these conditions.
    pub(super) fn applied_to(&self, mut unit: UnitUnderTest) -> UnitUnderTest {
        unit.apply(self.noise);
        unit
    }
}
