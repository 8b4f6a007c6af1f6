//! Where on Earth a movement takes place.

use nalgebra::Vector3;

/// Earth's rotation, rad/s (IERS conventions 2010).
pub const EARTH_RATE: f64 = 7.292_115e-5;

/// Where the rig stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Geodetic latitude, degrees, north positive.
    pub latitude_deg: f64,
    /// Height above the ellipsoid, m.
    pub height: f64,
    /// Gravity, m/s².
    pub gravity: f64,
    /// Earth's field in n, µT.
    pub field_n: Vector3<f64>,
}

impl Place {
    /// Ankara, where the paper's rig stood (models.md 7).
    pub fn ankara() -> Self {
        Self { latitude_deg: 39.87, height: 938.0, gravity: 9.7997, field_n: Vector3::new(25.3, 2.6, 40.1) }
    }

    /// Earth's rotation in n, rad/s.
    pub fn earth_rate_n(&self) -> Vector3<f64> {
        let latitude = self.latitude_deg.to_radians();
        Vector3::new(libm::cos(latitude), 0.0, -libm::sin(latitude)) * EARTH_RATE
    }
}
