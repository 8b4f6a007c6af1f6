//! Where on Earth a movement takes place.

use nalgebra::Vector3;

use super::random::Random;
use crate::recording::manifest::{Site, gravity::normal_gravity};

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

    /// Somewhere on Earth; the field is that of a dipole, give or take.
    pub fn draw(random: &mut Random) -> Self {
        let latitude_deg = random.between(-60.0, 65.0);
        let height = random.between(0.0, 1500.0);
        let (sin, cos) = libm::sincos(f64::to_radians(latitude_deg));
        let declination = random.between(-0.25, 0.25);
        let strength = random.between(28.0, 32.0);
        let level = strength * cos;
        let field_n = Vector3::new(
            level * libm::cos(declination),
            level * libm::sin(declination),
            2.0 * strength * sin,
        );
        Self { latitude_deg, height, gravity: normal_gravity(latitude_deg, height), field_n }
    }

    /// As a manifest has it.
    pub fn site(&self) -> Site {
        Site {
            latitude_deg: Some(self.latitude_deg),
            height_m: Some(self.height),
            gravity: Some(self.gravity),
            field_ned_ut: Some(self.field_n.into()),
        }
    }

    /// Earth's rotation in n, rad/s.
    pub fn earth_rate_n(&self) -> Vector3<f64> {
        let latitude = self.latitude_deg.to_radians();
        Vector3::new(libm::cos(latitude), 0.0, -libm::sin(latitude)) * EARTH_RATE
    }
}
