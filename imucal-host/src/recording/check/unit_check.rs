//! Whether the samples can be in the unit the manifest says.
//!
//! An error only when another unit of the contract explains the samples: a centrifuge is not at 1 g,
//! and then a warning is all that can be said.

use rayon::prelude::*;

use crate::recording::{
    Recording,
    place::{Place, Places},
    read_error::ReadError,
    sensor_kind::SensorKind,
    triple::Triple,
    unit::Unit,
    warning::Warning,
};

/// Gyroscopes for hand or vehicle end at 4000 °/s, rad/s.
const FASTEST: f64 = 70.0;

/// Bounds of a sensor's median length on the SI side.
struct Usual {
    /// Outside of it the samples are doubted.
    bounds: (f64, f64),
    /// Where another unit must bring them to be taken for the right one.
    goal: (f64, f64),
    si: &'static str,
    expected: &'static str,
}

fn usual(kind: SensorKind) -> Usual {
    match kind {
        SensorKind::Acc => {
            Usual { bounds: (4.0, 25.0), goal: (8.0, 12.0), si: "m/s²", expected: "about 9.8 m/s²" }
        }
        SensorKind::Gyr => {
            Usual { bounds: (0.0, 200.0), goal: (0.0, 35.0), si: "rad/s", expected: "below 35 rad/s" }
        }
        SensorKind::Mag => {
            Usual { bounds: (5.0, 500.0), goal: (20.0, 70.0), si: "µT", expected: "about 20 to 70 µT" }
        }
    }
}

/// Refuses samples that are clearly in another unit and notes those that are merely unusual.
pub(crate) fn check(recording: &mut Recording, places: &Places) -> Result<(), ReadError> {
    check_of(recording, places, &SensorKind::ALL)
}

/// The same of some sensors.
pub(crate) fn check_of(
    recording: &mut Recording,
    places: &Places,
    kinds: &[SensorKind],
) -> Result<(), ReadError> {
    let checked: Vec<_> = kinds.par_iter().map(|kind| check_sensor(recording, places, *kind)).collect();
    for warning in checked {
        recording.warnings.extend(warning?);
    }
    Ok(())
}

fn check_sensor(
    recording: &Recording,
    places: &Places,
    kind: SensorKind,
) -> Result<Option<Warning>, ReadError> {
    let Some(triple) = recording.sensor(kind) else { return Ok(None) };
    let measured = |value: &nalgebra::Vector3<f64>| value.iter().any(|value| !value.is_nan());
    let from = places.of(triple.values.iter().position(measured).unwrap_or(0));
    if kind == SensorKind::Acc {
        check_axes(recording, from, triple)?;
    }
    let fast = (kind == SensorKind::Gyr).then(|| check_rate(recording, from, triple)).flatten();
    let size = check_size(recording, from, kind, triple)?;
    Ok(size.or(fast))
}

fn check_size(
    recording: &Recording,
    from: Place,
    kind: SensorKind,
    triple: &Triple,
) -> Result<Option<Warning>, ReadError> {
    let usual = usual(kind);
    let Some(found) = triple.median_norm().filter(|found| !within(*found, usual.bounds)) else {
        return Ok(None);
    };
    let better = better_unit(kind, triple, found, usual.goal);
    // A magnetometer near iron or a coil is anywhere; counts are converted by a nominal value only.
    match better.filter(|_| kind != SensorKind::Mag) {
        Some(suggestion) => Err(ReadError::UnitImplausible {
            path: recording.path.clone(),
            from,
            sensor: kind,
            unit: triple.unit,
            median_norm: found,
            si: usual.si,
            expected: usual.expected,
            suggestion,
        }),
        None if kind == SensorKind::Mag && better.is_none() => Ok(None),
        None => Ok(Some(Warning::SizeUnusual {
            path: recording.path.clone(),
            from,
            sensor: kind,
            unit: triple.unit,
            found,
            si: usual.si,
            expected: usual.expected.to_owned(),
            key: match better {
                Some(unit) => format!("{kind} of [units] (`{unit}` would fit)"),
                None if triple.unit == Unit::Counts => format!("{kind} of [counts]"),
                None => format!("{kind} of [units]"),
            },
        })),
    }
}

/// A gyroscope is at rest for most of a calibration, and its fastest rates show the unit.
fn check_rate(recording: &Recording, from: Place, triple: &Triple) -> Option<Warning> {
    let mut rates: Vec<f64> =
        triple.values.iter().map(|rate| rate.norm()).filter(|rate| rate.is_finite()).collect();
    let fast = rates.len().checked_sub(1 + rates.len() / 200)?;
    let found = *rates.select_nth_unstable_by(fast, f64::total_cmp).1;
    (found > FASTEST).then(|| Warning::RateUnusual {
        path: recording.path.clone(),
        from,
        unit: triple.unit,
        found,
        remedy: match triple.unit {
            Unit::RadianPerSecond if found.to_radians() < FASTEST => {
                "the samples look like `deg/s`: write gyr = \"deg/s\" below [units] in the manifest"
                    .to_owned()
            }
            Unit::Counts => "check gyr of [counts] in the manifest".to_owned(),
            _ => "check gyr of [units] in the manifest".to_owned(),
        },
    })
}

fn within(value: f64, (low, high): (f64, f64)) -> bool {
    (low..=high).contains(&value)
}

/// The unit that brings the median length to its goal.
fn better_unit(kind: SensorKind, triple: &Triple, median: f64, goal: (f64, f64)) -> Option<Unit> {
    let own = triple.unit.per_si().filter(|_| triple.unit != Unit::Arbitrary)?;
    let fits = |unit: &&Unit| {
        **unit != triple.unit
            && **unit != Unit::Arbitrary
            && unit.per_si().is_some_and(|per_si| within(median * own / per_si, goal))
    };
    let other = Unit::of(kind).iter().find(fits).copied();
    other.or_else(|| looks_like_counts(triple, median).then_some(Unit::Counts))
}

/// Converters give integers, and those of an accelerometer at rest or a gyroscope with an offset are large.
fn looks_like_counts(triple: &Triple, median: f64) -> bool {
    let integer = |si: &f64| {
        let raw = triple.nominal.to_raw(*si);
        raw.is_nan() || (raw - raw.round()).abs() < 1e-9 * raw.abs().max(1.0)
    };
    median * triple.nominal.per_unit > 500.0 && triple.values.iter().all(|value| value.iter().all(integer))
}

/// Looks for one axis in `g` or `mg` next to others in m/s² or the like: only if rescaling that axis
/// makes a length that varies steady, and steady at gravity.
fn check_axes(recording: &Recording, from: Place, triple: &Triple) -> Result<(), ReadError> {
    let Some(own) = triple.unit.per_si() else {
        return Ok(());
    };
    let Some(before) = Steadiness::of(triple, None) else {
        return Ok(());
    };
    if before.spread < 0.2 {
        return Ok(());
    }
    for (axis, column) in SensorKind::Acc.columns().into_iter().enumerate() {
        for unit in Unit::of(SensorKind::Acc) {
            let Some(per_si) = unit.per_si().filter(|_| *unit != triple.unit) else {
                continue;
            };
            let Some(after) = Steadiness::of(triple, Some((axis, own / per_si))) else {
                continue;
            };
            if within(after.median, (8.0, 12.0)) && after.spread < 0.15 && after.spread < before.spread / 4.0
            {
                return Err(ReadError::MixedUnits {
                    path: recording.path.clone(),
                    from,
                    column,
                    found: *unit,
                    expected: triple.unit,
                    median_norm: after.median,
                });
            }
        }
    }
    Ok(())
}

/// How steady the length of the specific force is.
struct Steadiness {
    median: f64,
    /// Width from the tenth to the ninetieth percentile over the median.
    spread: f64,
}

impl Steadiness {
    /// Of the samples with one axis rescaled; thinned out, since percentiles need no more.
    fn of(triple: &Triple, scaled: Option<(usize, f64)>) -> Option<Self> {
        let step = triple.values.len() / 5000 + 1;
        let norm = |value: &nalgebra::Vector3<f64>| {
            let mut value = *value;
            if let Some((axis, factor)) = scaled {
                value[axis] *= factor;
            }
            value.norm()
        };
        let mut norms: Vec<f64> =
            triple.values.iter().step_by(step).map(norm).filter(|norm| norm.is_finite()).collect();
        let last = norms.len().checked_sub(1).filter(|last| *last >= 9)?;
        let mut at = |rank: usize| *norms.select_nth_unstable_by(rank, f64::total_cmp).1;
        let [low, median, high] = [last / 10, last / 2, last - last / 10].map(&mut at);
        Some(Self { median, spread: (high - low) / median })
    }
}

#[cfg(test)]
mod tests {
    use crate::recording::fixture::{Fixture, assert_says};

    /// Sixty attitudes of 1 g, each component printed after scaling by its axis' factor.
    fn attitudes(sensor: &str, scale: [f64; 3], decimals: usize) -> String {
        let mut text = format!("t,{sensor}_x,{sensor}_y,{sensor}_z\n");
        for row in 0..60 {
            let (a, b) = (f64::from(row) * 0.7, f64::from(row) * 0.31);
            let [x, y, z] = [a.cos() * b.cos(), a.sin() * b.cos(), b.sin()];
            let [x, y, z] = [x * scale[0], y * scale[1], z * scale[2]];
            text += &format!("{},{x:.decimals$},{y:.decimals$},{z:.decimals$}\n", f64::from(row) * 0.01);
        }
        text
    }

    fn fixture(unit: &str, samples: &str) -> Fixture {
        Fixture::new("run.csv", &format!("[units]\n{unit}\n"), samples)
    }

    #[test]
    fn samples_in_g_called_metres_are_refused_with_the_right_unit() {
        let message = fixture("acc = \"m/s^2\"", &attitudes("acc", [1.0; 3], 6)).error();
        let found = "the median length is 1.0000 m/s² when read as `m/s^2`";
        assert_says(
            &message,
            &[
                "run.csv, from line 2 on, sensor acc",
                found,
                "expected about 9.8",
                "write acc = \"g\" below [units]",
            ],
        );
    }

    #[test]
    fn milligravities_and_counts_called_metres_are_refused() {
        let milli = fixture("acc = \"m/s^2\"", &attitudes("acc", [1000.0; 3], 2)).error();
        assert_says(&milli, &["look like `mg`"]);
        let counts = fixture("acc = \"m/s^2\"", &attitudes("acc", [16384.0; 3], 0)).error();
        assert_says(&counts, &["look like `counts`"]);
    }

    #[test]
    fn metres_called_g_are_refused() {
        let message = fixture("acc = \"g\"", &attitudes("acc", [9.81; 3], 6)).error();
        assert_says(&message, &["when read as `g`", "look like `m/s^2`"]);
    }

    #[test]
    fn a_centrifuge_is_warned_about_and_read() {
        let fixture = fixture("acc = \"m/s^2\"", &attitudes("acc", [55.0; 3], 4));
        assert_says(
            &fixture.warnings()[0],
            &["run.csv, from line 2 on, sensor acc", "55.0000 m/s²", "expected about 9.8", "acc of [units]"],
        );
    }

    #[test]
    fn counts_with_a_wrong_nominal_conversion_are_warned_about() {
        let sections = "acc = \"counts\"\n[counts]\nacc = { offset = 0, per_unit = 16384 }";
        let fixture = fixture(sections, &attitudes("acc", [16384.0; 3], 0));
        assert_says(
            &fixture.warnings()[0],
            &["run.csv, from line 2 on, sensor acc", "read as `counts`", "check acc of [counts]"],
        );
    }

    #[test]
    fn degrees_called_radians_are_refused_when_they_are_beyond_any_gyroscope() {
        let message = fixture("gyr = \"rad/s\"", &attitudes("gyr", [400.0; 3], 3)).error();
        assert_says(
            &message,
            &["run.csv, from line 2 on, sensor gyr", "read as `rad/s`", "look like `deg/s`"],
        );
    }

    #[test]
    fn a_hand_s_turns_in_degrees_called_radians_are_warned_about() {
        // At rest but for one row in twenty, as in a calibration.
        let rows = (0..400).fold("t,gyr_x,gyr_y,gyr_z\n".to_owned(), |text, k| {
            let rate = if k % 20 == 0 { 120.0 } else { 0.4 };
            text + &format!("{},{rate},0.1,0.2\n", f64::from(k) * 0.01)
        });
        let warnings = fixture("gyr = \"rad/s\"", &rows).warnings();
        assert_says(
            &warnings[0],
            &["run.csv, from line 2 on, sensor gyr", "120 rad/s", "look like `deg/s`", "gyr = \"deg/s\""],
        );
        assert!(fixture("gyr = \"deg/s\"", &rows).warnings().is_empty());
    }

    #[test]
    fn a_field_in_gauss_called_microtesla_is_warned_about() {
        let fixture = fixture("mag = \"uT\"", &attitudes("mag", [0.5; 3], 5));
        assert_says(&fixture.warnings()[0], &["sensor mag", "mag of [units] (`G` would fit)"]);
    }

    #[test]
    fn one_axis_in_g_among_two_in_metres_is_named() {
        let message = fixture("acc = \"m/s^2\"", &attitudes("acc", [9.81, 1.0, 9.81], 6)).error();
        assert_says(
            &message,
            &["run.csv, from line 2 on, column `acc_y`", "look like `g`", "`m/s^2`", "convert the column"],
        );
    }

    #[test]
    fn a_scale_error_of_a_fifth_and_a_bias_pass() {
        assert!(fixture("acc = \"m/s^2\"", &attitudes("acc", [9.81, 11.7, 8.0], 6)).warnings().is_empty());
    }
}
