//! Where a recording was made.

use serde::{Deserialize, Serialize};

use super::gravity::normal_gravity;

/// Where it was recorded.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Site {
    /// Geodetic latitude, degrees, −90 to 90, north positive.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub latitude_deg: Option<f64>,
    /// Height above the ellipsoid, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height_m: Option<f64>,
    /// Gravity, m/s², positive, if it is known better than from latitude and height.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gravity: Option<f64>,
    /// Earth's field in n (north, east, down), µT.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub field_ned_ut: Option<[f64; 3]>,
}

impl Site {
    /// Gravity of the site, m/s²: as given, else normal gravity at the latitude and height (0 m if not
    /// given), else `None`.
    #[must_use]
    pub fn gravity(&self) -> Option<f64> {
        self.gravity.or_else(|| {
            self.latitude_deg.map(|latitude| normal_gravity(latitude, self.height_m.unwrap_or(0.0)))
        })
    }

    pub(crate) fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gravity_is_as_given_or_normal_or_unknown() {
        let mut site = Site::default();
        assert_eq!(site.gravity(), None);
        site.latitude_deg = Some(45.0);
        assert_eq!(site.gravity(), Some(normal_gravity(45.0, 0.0)));
        site.gravity = Some(9.81);
        assert_eq!(site.gravity(), Some(9.81));
    }
}
