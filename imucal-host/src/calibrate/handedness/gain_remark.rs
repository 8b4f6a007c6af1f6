//! Gains that a unit, a range or a convention explains better than a sensor.

use nalgebra::Matrix3;

use crate::recording::{SensorKind, Unit, unit::STANDARD_GRAVITY};

/// Factors by which gains are wrong for a reason, each way, and the reason.
pub const FACTORS: [(f64, &str); 9] = [
    (180.0 / std::f64::consts::PI, "180/π: degrees and radians taken for one another"),
    (STANDARD_GRAVITY, "g in m/s²: g and m/s² taken for one another"),
    (1000.0, "a thousand: a unit and its thousandth taken for one another, or the unit of t"),
    (1e6, "a million: the unit of t"),
    (2.0, "two: another full scale of the sensor than the conversion is for"),
    (4.0, "four: another full scale of the sensor than the conversion is for"),
    (8.0, "eight: another full scale of the sensor than the conversion is for"),
    (16.0, "sixteen: another full scale of the sensor than the conversion is for"),
    (100.0, "a hundred: gauss and µT taken for one another"),
];

/// A raw sensor's gain is off by no more than this, as a ratio.
const RAW: f64 = 1.25;
/// A factor is one of the list within this, as a ratio.
const LIKE: f64 = 1.1;

/// What is to be said of a gain (calibrated by nominal SI) that is no raw sensor's; `None` where it is one.
pub fn remark(kind: SensorKind, unit: Unit, gain: &Matrix3<f64>) -> Option<String> {
    let size = gain.determinant().abs().cbrt();
    let off = |factor: f64| (size / factor).ln().abs();
    if unit == Unit::Arbitrary || !size.is_finite() || size <= 0.0 || off(1.0) < RAW.ln() {
        return None;
    }
    let key = if unit == Unit::Counts { "[counts]" } else { "[units]" };
    Some(format!("{kind}: its gain is {size:.4} times nominal; {}; check {kind} of {key}", reason(size)))
}

/// Why a gain may be that many times nominal.
pub fn reason(size: f64) -> String {
    let both = FACTORS.iter().flat_map(|(factor, why)| [(*factor, why), (factor.recip(), why)]);
    let off = |factor: f64| (size / factor).ln().abs();
    let nearest =
        both.min_by(|a, b| off(a.0).total_cmp(&off(b.0))).filter(|(factor, _)| off(*factor) < LIKE.ln());
    match nearest {
        Some((factor, why)) if factor < 1.0 => format!("that is like one over {why}"),
        Some((_, why)) => format!("that is like {why}"),
        None => "no unit explains it".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(kind: SensorKind, unit: Unit, gain: f64) -> String {
        remark(kind, unit, &(Matrix3::identity() * gain)).unwrap_or_default()
    }

    #[test]
    fn gains_that_a_unit_explains_are_named_with_it() {
        let gyr = said(SensorKind::Gyr, Unit::RadianPerSecond, 0.01745);
        assert!(gyr.contains("one over 180/π") && gyr.contains("[units]"), "{gyr}");
        assert!(said(SensorKind::Gyr, Unit::DegreePerSecond, 57.3).contains("like 180/π"));
        assert!(said(SensorKind::Acc, Unit::Counts, 0.5).contains("one over two: another full scale"));
        assert!(said(SensorKind::Acc, Unit::Counts, 9.81).contains("g in m/s²"));
        assert!(said(SensorKind::Acc, Unit::Counts, 1.5).contains("no unit explains it"));
    }

    #[test]
    fn a_raw_sensor_s_gain_needs_no_remark() {
        assert_eq!(said(SensorKind::Acc, Unit::Counts, 1.2), "");
        assert_eq!(said(SensorKind::Mag, Unit::Arbitrary, 500.0), "");
    }
}
