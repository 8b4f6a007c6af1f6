//! What a manifest may not say although it is well-formed.

use nalgebra::Vector3;

use super::{Manifest, fault::ManifestFault};
use crate::recording::{sensor_kind::SensorKind, unit::Unit};

/// Length of a field that a manifest may give, µT: Earth's has 22 to 67, a coil's may have more. Nanotesla and gauss are beyond.
const FIELD: std::ops::RangeInclusive<f64> = 1.0..=1000.0;

/// Looks for the first contradiction.
pub(crate) fn check(manifest: &Manifest) -> Result<(), ManifestFault> {
    for kind in SensorKind::ALL {
        check_sensor(manifest, kind)?;
    }
    check_site(manifest)?;
    if let Some(noise) = manifest.reference.as_ref().and_then(|reference| reference.noise) {
        number("reference", "noise", noise, "a finite rms above zero", |v| v.is_finite() && v > 0.0)?;
    }
    match manifest.rig.as_ref().and_then(|rig| rig.axes.as_ref()) {
        Some(axes) if axes.is_empty() || axes.len() > 3 => Err(ManifestFault::Axes { found: axes.len() }),
        _ => Ok(()),
    }
}

fn check_sensor(manifest: &Manifest, kind: SensorKind) -> Result<(), ManifestFault> {
    let unit = manifest.units.of(kind);
    if !Unit::of(kind).contains(&unit) {
        return Err(ManifestFault::UnitOfOtherSensor { sensor: kind, unit });
    }
    let counts = manifest.counts.of(kind);
    if unit == Unit::Counts && counts.is_none() {
        return Err(ManifestFault::CountsWithoutConversion { sensor: kind });
    }
    let key = kind.prefix();
    if let Some(counts) = counts {
        number("counts", key, counts.offset, "a finite offset", f64::is_finite)?;
        number("counts", key, counts.per_unit, "a finite per_unit that is not zero", |v| {
            v.is_finite() && v != 0.0
        })?;
    }
    if let Some(range) = manifest.ranges.of(kind) {
        number("ranges", key, range, "a finite full scale above zero", |v| v.is_finite() && v > 0.0)?;
    }
    Ok(())
}

fn check_site(manifest: &Manifest) -> Result<(), ManifestFault> {
    let site = &manifest.site;
    if let Some(value) = site.latitude_deg {
        number("site", "latitude_deg", value, "−90 to 90", |v| v.abs() <= 90.0)?;
    }
    if let Some(value) = site.height_m {
        number("site", "height_m", value, "−12 000 to 100 000 m", |v| (-12e3..=100e3).contains(&v))?;
    }
    if let Some(value) = site.gravity {
        number("site", "gravity", value, "a finite value above zero", |v| v.is_finite() && v > 0.0)?;
    }
    for value in site.field_ned_ut.iter().flatten() {
        number("site", "field_ned_ut", *value, "three finite values", f64::is_finite)?;
    }
    if let Some(field) = site.field_ned_ut {
        let length = Vector3::from(field).norm();
        number("site", "field_ned_ut", length, "a field of 1 to 1000 uT in length", |v| FIELD.contains(&v))?;
    }
    Ok(())
}

fn number(
    section: &'static str,
    key: &'static str,
    found: f64,
    expected: &'static str,
    holds: impl Fn(f64) -> bool,
) -> Result<(), ManifestFault> {
    if holds(found) { Ok(()) } else { Err(ManifestFault::BadNumber { section, key, found, expected }) }
}

#[cfg(test)]
mod tests {
    use crate::recording::fixture::{Fixture, assert_says};

    fn error(sections: &str) -> String {
        Fixture::new("run.csv", sections, "t,acc_x,acc_y,acc_z\n0,0,0,9.8\n").error()
    }

    #[test]
    fn a_unit_of_another_sensor_names_those_that_fit() {
        let message = error("[units]\nacc = \"uT\"\n");
        assert_says(
            &message,
            &["run.toml, line 3", "acc = \"uT\"", "expected m/s^2, g, mg, counts", "write"],
        );
    }

    #[test]
    fn an_unknown_unit_names_those_there_are() {
        assert_says(
            &error("[units]\nt = \"s\"\nacc = \"m/s2\"\n"),
            &["run.toml, line 4", "`m/s2`", "m/s^2, g"],
        );
        assert_says(&error("[units]\ntemp = \"K\"\n"), &["line 3", "`K`", "degC"]);
    }

    #[test]
    fn counts_without_conversion_say_what_to_add() {
        let message = error("[units]\nacc = \"counts\"\n");
        assert_says(&message, &["run.toml, line 3", "acc = \"counts\"", "below [counts]", "data sheet"]);
    }

    #[test]
    fn conversions_and_ranges_that_cannot_be_are_refused() {
        for (sections, found) in [
            ("[counts]\nacc = { offset = 0, per_unit = 0 }\n", "counts.acc = 0, expected a finite per_unit"),
            (
                "[counts]\nacc = { offset = nan, per_unit = 1 }\n",
                "counts.acc = NaN, expected a finite offset",
            ),
            ("[counts]\nacc = { per_unit = inf }\n", "counts.acc = inf"),
            ("[ranges]\nmag = -2\n", "ranges.mag = -2, expected a finite full scale above zero"),
            ("[reference]\nnoise = 0\nkind = \"pose\"\n", "reference.noise = 0, expected a finite rms"),
            ("[reference]\nnoise = inf\nkind = \"pose\"\n", "reference.noise = inf"),
            ("[site]\nlatitude_deg = 91\n", "site.latitude_deg = 91, expected −90 to 90"),
            ("[site]\nheight_m = 1e6\n", "site.height_m"),
            ("[site]\ngravity = 0\n", "site.gravity = 0"),
            ("[site]\nfield_ned_ut = [1, nan, 2]\n", "site.field_ned_ut = NaN"),
            ("[site]\nfield_ned_ut = [20000, 0, 45000]\n", "expected a field of 1 to 1000 uT in length"),
            ("[site]\nfield_ned_ut = [0.2, 0, 0.45]\n", "expected a field of 1 to 1000 uT in length"),
        ] {
            assert_says(&error(sections), &["run.toml, line 3", found, "correct it"]);
        }
    }

    #[test]
    fn more_axes_than_gimbals_are_refused() {
        let message = error("[rig]\nkind = \"turntable\"\naxes = [\"x\", \"y\", \"z\", \"x\"]\n");
        assert_says(&message, &["line 4", "found 4 axes", "one to three"]);
    }
}
