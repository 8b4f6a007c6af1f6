//! Where a recording was made.

use serde::{Deserialize, Serialize};

use imucal_core::model::dip::LEAST_DIP;

use super::gravity::normal_gravity;

/// The magnetic equator lies within this latitude, degrees, and a field beyond it is steep.
const HEMISPHERE: f64 = 20.0;

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

    /// Whether Earth's field points down here: by the field, else by the hemisphere; `None` where neither says so, near
    /// the magnetic equator too.
    #[must_use]
    pub fn field_points_down(&self) -> Option<bool> {
        if let Some([north, east, down]) = self.field_ned_ut {
            return (down.abs() > LEAST_DIP.tan() * north.hypot(east)).then_some(down > 0.0);
        }
        self.latitude_deg.filter(|latitude| latitude.abs() > HEMISPHERE).map(|latitude| latitude > 0.0)
    }

    pub(crate) fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_field_points_down_in_the_north_and_nowhere_for_sure_at_the_equator() {
        let at = |latitude_deg| Site { latitude_deg, ..Site::default() }.field_points_down();
        assert_eq!(
            [at(Some(52.0)), at(Some(-33.0)), at(Some(8.0)), at(None)],
            [Some(true), Some(false), None, None]
        );
        // The field is known better than the hemisphere.
        let field = |down| Site {
            latitude_deg: Some(52.0),
            field_ned_ut: Some([25.0, 0.0, down]),
            ..Site::default()
        };
        assert_eq!([field(-40.0), field(1.0)].map(|site| site.field_points_down()), [Some(false), None]);
    }

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
