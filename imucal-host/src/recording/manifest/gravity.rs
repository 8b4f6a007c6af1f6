//! Normal gravity of the Earth's ellipsoid.

/// Normal gravity in m/s² at a geodetic latitude (degrees, −90 to 90) and a height above the ellipsoid
/// (m; meant for −500 to 10 000).
///
/// Somigliana's closed form on the ellipsoid and the free-air correction to second order in height:
/// NIMA TR8350.2, *Department of Defense World Geodetic System 1984*, third edition, amendment 1
/// (2000), equations 4-1 and 4-3 with the constants of tables 3.1, 3.3 and 3.4. Real gravity departs
/// from it by up to about 0.001 m/s².
#[must_use]
pub fn normal_gravity(latitude_deg: f64, height_m: f64) -> f64 {
    /// Gravity at the equator, m/s².
    const EQUATOR: f64 = 9.780_325_335_9;
    /// Somigliana's constant.
    const K: f64 = 0.001_931_852_652_41;
    /// First eccentricity squared.
    const E2: f64 = 0.006_694_379_990_14;
    /// Semi-major axis, m.
    const A: f64 = 6_378_137.0;
    /// Flattening.
    const F: f64 = 1.0 / 298.257_223_563;
    /// ω²a²b / GM.
    const M: f64 = 0.003_449_786_506_84;

    let s2 = latitude_deg.to_radians().sin().powi(2);
    let surface = EQUATOR * (1.0 + K * s2) / (1.0 - E2 * s2).sqrt();
    let h = height_m / A;
    surface * (1.0 - 2.0 * (1.0 + F + M - 2.0 * F * s2) * h + 3.0 * h * h)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equator_and_pole_are_those_of_wgs84() {
        assert!((normal_gravity(0.0, 0.0) - 9.780_325_335_9).abs() < 1e-10);
        assert!((normal_gravity(90.0, 0.0) - 9.832_184_937_8).abs() < 1e-9);
        assert_eq!(normal_gravity(-35.0, 10.0), normal_gravity(35.0, 10.0));
    }

    #[test]
    fn a_kilometre_of_height_costs_three_milligravities() {
        let drop = normal_gravity(45.0, 0.0) - normal_gravity(45.0, 1000.0);
        assert!((drop - 3.086e-3).abs() < 2e-6, "{drop}");
    }

    #[test]
    fn the_value_of_the_contract_s_example_is_met_within_the_anomaly() {
        // Ankara; the example's figure is of the site itself.
        assert!((normal_gravity(39.87, 938.0) - 9.7997).abs() < 2.5e-3);
    }
}
