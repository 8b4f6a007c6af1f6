//! From a table in file units to a recording in SI units, with the checks all formats share.

use std::path::Path;

use nalgebra::Vector3;
use rayon::prelude::*;

use super::{
    clock::Clock,
    columns::{
        GIMBAL, POSITION, REFERENCE, SEGMENT, SIM_TEMPERATURE, TEMPERATURE, TIME, Table, simulated_slot_of,
        slot_of,
    },
    interval,
};
use crate::recording::{
    Recording,
    check::{absurd, unit_check},
    manifest::Manifest,
    order_statistics::median,
    place::Places,
    read_error::ReadError,
    sensor_kind::SensorKind,
    simulated::Simulated,
    triple::{Nominal, Triple},
    unit::TimeUnit,
    warning::Warning,
};

/// Makes a recording of a table, or says what is wrong with it.
pub(crate) fn assemble(path: &Path, manifest: Manifest, table: Table) -> Result<Recording, ReadError> {
    let (recording, places) = converted(path, manifest, table)?;
    checked(recording, &places)
}

/// A recording whose intervals and sizes can be in the units of its manifest; numbers that nothing measures are masked.
pub(crate) fn checked(mut recording: Recording, places: &Places) -> Result<Recording, ReadError> {
    interval::check(&mut recording, places.of(0))?;
    unit_check::check(&mut recording, places)?;
    absurd::mask(&mut recording, places);
    Ok(recording)
}

/// The same of rows that follow others of one file. Units were judged by those, but for sensors that had not begun; a few rows at the
/// end show none.
pub(crate) fn continued(
    path: &Path,
    manifest: Manifest,
    table: Table,
    begins: &[SensorKind],
) -> Result<Recording, ReadError> {
    let (mut recording, places) = converted(path, manifest, table)?;
    unit_check::check_of(&mut recording, &places, begins)?;
    absurd::mask(&mut recording, &places);
    Ok(recording)
}

/// A table in SI units, and the places of its rows.
fn converted(path: &Path, manifest: Manifest, mut table: Table) -> Result<(Recording, Places), ReadError> {
    let time = std::mem::take(&mut table.columns[TIME]);
    if time.is_empty() {
        return Err(ReadError::NoRows { path: path.to_path_buf() });
    }
    check_time(path, &time, (&table.places, &table.clock), manifest.units.t)?;
    let segment = segments(path, &table)?;
    // Columns are freed one sensor after the other. All are converted before the first fault is looked for: which one is reported does not
    // depend on threads.
    let parts = SensorKind::ALL.map(|kind| (kind, taken::<3>(&mut table.columns[slot_of(kind)..])));
    let of = |(kind, columns)| triple(path, &manifest, columns, kind);
    let sensors: Vec<_> = parts.into_par_iter().map(of).collect();
    let sensors = sensors.into_iter().collect::<Result<Vec<_>, _>>()?;
    let [acc, gyr, mag] = <[Option<Triple>; 3]>::try_from(sensors).unwrap_or_default();
    let angle = 1.0 / manifest.units.gimbal.per_si();
    let mut recording = Recording {
        name: name_of(path),
        path: path.to_path_buf(),
        time: scaled(time, table.clock.per_si()),
        epoch: table.clock.epoch,
        acc,
        gyr,
        mag,
        gimbal: rows(taken::<3>(&mut table.columns[GIMBAL..]))
            .map(|rows| rows.into_iter().map(|row| row.map(|value| value * angle)).collect()),
        reference: rows(taken::<4>(&mut table.columns[REFERENCE..])),
        position: rows(taken::<3>(&mut table.columns[POSITION..])),
        simulated: simulated(&mut table),
        temperature: Some(std::mem::take(&mut table.columns[TEMPERATURE]))
            .filter(|column| !column.is_empty()),
        segment,
        extra: table.extra,
        warnings: table.warnings,
        manifest,
    };
    keep_assumed(&mut recording, !table.clock.is_dated());
    note_columns(&mut recording, table.header);
    Ok((recording, table.places))
}

/// Refuses times that are missing or do not increase.
pub(crate) fn check_time(
    path: &Path,
    time: &[f64],
    (places, clock): (&Places, &Clock),
    unit: TimeUnit,
) -> Result<(), ReadError> {
    if let Some(row) = time.iter().position(|t| t.is_nan()) {
        return Err(ReadError::TimeMissing { path: path.to_path_buf(), place: places.of(row) });
    }
    let Some(at) = time.windows(2).position(|pair| pair[1] <= pair[0]) else {
        return Ok(());
    };
    Err(ReadError::TimeOrder {
        path: path.to_path_buf(),
        place: places.of(at + 1),
        found: clock.text(time[at + 1]),
        before: clock.text(time[at]),
        remedy: order_remedy(time, at, clock.per_si(), unit),
    })
}

fn order_remedy(time: &[f64], at: usize, per_si: f64, unit: TimeUnit) -> String {
    let mut remedy = if time[at + 1] < time[at] {
        "sort the rows by time, or split the file where the clock was reset".to_owned()
    } else {
        "remove the duplicate row, or export the times with more decimals".to_owned()
    };
    let steps = time.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect();
    let interval = median(steps).map(|step| step / per_si);
    if interval.is_some_and(interval::is_unusual) {
        remedy.push_str(&format!("; check the unit of t too, with `{unit}` most intervals are unusual"));
    }
    remedy
}

fn scaled(mut time: Vec<f64>, per_si: f64) -> Vec<f64> {
    if per_si != 1.0 {
        time.iter_mut().for_each(|t| *t /= per_si);
    }
    time
}

fn triple(
    path: &Path,
    manifest: &Manifest,
    [x, y, z]: [Vec<f64>; 3],
    kind: SensorKind,
) -> Result<Option<Triple>, ReadError> {
    if x.is_empty() {
        return Ok(None);
    }
    let manifest_path = || Manifest::path_for(path).unwrap_or_else(|| path.to_path_buf());
    let fault = |fault| ReadError::Manifest { path: manifest_path(), line: 1, fault };
    let nominal = manifest.nominal(kind).map_err(fault)?;
    let raw = x.iter().zip(&y).zip(&z).map(|((x, y), z)| Vector3::new(*x, *y, *z));
    let values = if nominal == Nominal::IDENTITY {
        raw.collect()
    } else {
        raw.map(|value| value.map(|component| nominal.to_si(component))).collect()
    };
    manifest.triple(kind, values).map(Some).map_err(fault)
}

/// The simulator's columns, which are in SI units whatever the sensors' are in.
fn simulated(table: &mut Table) -> Option<Simulated> {
    let values = |kind| {
        let columns = taken::<3>(&mut table.columns[simulated_slot_of(kind)..]);
        rows(columns).map(|rows| rows.into_iter().map(Vector3::from).collect())
    };
    let [acc, gyr, mag] = SensorKind::ALL.map(values);
    let temperature = std::mem::take(&mut table.columns[SIM_TEMPERATURE]);
    let temperature = Some(temperature).filter(|column| !column.is_empty());
    Some(Simulated { acc, gyr, mag, temperature }).filter(|simulated| !simulated.is_empty())
}

/// The first of some columns, which are empty from then on.
fn taken<const N: usize>(columns: &mut [Vec<f64>]) -> [Vec<f64>; N] {
    std::array::from_fn(|k| std::mem::take(&mut columns[k]))
}

fn rows<const N: usize>(columns: [Vec<f64>; N]) -> Option<Vec<[f64; N]>> {
    let count = columns.first()?.len();
    let row = |row: usize| std::array::from_fn(|column| columns[column][row]);
    (count > 0).then(|| (0..count).map(row).collect())
}

fn segments(path: &Path, table: &Table) -> Result<Option<Vec<Option<i64>>>, ReadError> {
    /// Above, neighbouring integers are one f64.
    const LARGEST: f64 = 9_007_199_254_740_992.0;
    let column = &table.columns[SEGMENT];
    let whole = |label: f64| label.is_nan() || (label.fract() == 0.0 && label.abs() <= LARGEST);
    if let Some(row) = column.iter().position(|label| !whole(*label)) {
        return Err(ReadError::SegmentNotInteger {
            path: path.to_path_buf(),
            place: table.places.of(row),
            found: column[row],
        });
    }
    let label = |label: &f64| (!label.is_nan()).then_some(*label as i64);
    Ok((!column.is_empty()).then(|| column.iter().map(label).collect()))
}

/// A unit that is left out is assumed only where there is a column in it; times may have none.
pub(crate) fn keep_assumed(recording: &mut Recording, times_have_a_unit: bool) {
    let measured: Vec<&str> = [
        ("t", times_have_a_unit),
        ("acc", recording.acc.is_some()),
        ("gyr", recording.gyr.is_some()),
        ("mag", recording.mag.is_some()),
        ("gimbal", recording.gimbal.is_some()),
    ]
    .into_iter()
    .filter_map(|(key, there)| there.then_some(key))
    .collect();
    recording.warnings.retain_mut(|warning| match warning {
        Warning::UnitsAssumed { assumed, .. } => {
            assumed.retain(|(key, _)| measured.contains(key));
            !assumed.is_empty()
        }
        _ => true,
    });
}

/// What is odd about the columns, whose names stand in a line of a text.
pub(crate) fn note_columns(recording: &mut Recording, line: Option<u64>) {
    for column in &recording.extra {
        recording.warnings.push(Warning::UnknownColumn {
            path: recording.path.clone(),
            line,
            column: column.name.clone(),
        });
    }
    if recording.position.is_some() && recording.reference.is_none() && recording.gimbal.is_none() {
        recording.warnings.push(Warning::PositionAlone { path: recording.path.clone(), line });
    }
    let has_axes = recording.manifest.rig.as_ref().is_some_and(|rig| rig.axes.is_some());
    if has_axes && recording.gimbal.is_none() && recording.simulated.is_none() {
        recording.warnings.push(Warning::RigWithoutAngles { path: recording.path.clone(), line });
    }
    if SensorKind::ALL.iter().all(|kind| recording.sensor(*kind).is_none()) {
        let path = recording.path.clone();
        recording.warnings.push(match recording.simulated {
            Some(_) => Warning::SimulatorAlone { path, line },
            None => Warning::NoSensor { path, line },
        });
    }
}

/// A file's name; of a folder that is given as `.` its own.
fn name_of(path: &Path) -> String {
    let named = |path: &Path| path.file_name().map(|name| name.to_string_lossy().into_owned());
    named(path).or_else(|| named(&path.canonicalize().ok()?)).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use crate::recording::fixture::{Fixture, assert_says, csv};

    fn with_times(times: &[&str]) -> Fixture {
        csv(times.iter().fold("t,acc_x,acc_y,acc_z\n".to_owned(), |text, t| text + t + ",0,0,9.8\n"))
    }

    #[test]
    fn time_that_runs_back_names_the_line_and_both_times() {
        let message = with_times(&["0", "0.02", "0.01"]).error();
        assert_says(
            &message,
            &["run.csv, line 4, column `t`", "found 0.01 after 0.02", "increasing", "sort"],
        );
        assert!(!message.contains("unit of t"), "{message}");
    }

    #[test]
    fn time_that_repeats_advises_to_remove_the_duplicate() {
        let message = with_times(&["0", "0.01", "0.01"]).error();
        assert_says(&message, &["line 4", "found 0.01 after 0.01", "remove the duplicate", "more decimals"]);
    }

    #[test]
    fn odd_intervals_with_a_wrong_order_hint_at_the_unit() {
        assert_says(&with_times(&["0", "10", "20", "20"]).error(), &["check the unit of t", "`s`"]);
    }

    #[test]
    fn a_row_without_time_is_refused() {
        let message = with_times(&["0", "", "1"]).error();
        assert_says(&message, &["run.csv, line 3, column `t`", "no time", "in each row", "remove the row"]);
    }

    #[test]
    fn times_are_converted_to_seconds() {
        let samples = "t,acc_x,acc_y,acc_z\n1000,0,0,9.8\n1010,0,0,9.8\n";
        let fixture = Fixture::new("run.csv", "[units]\nt = \"ms\"\n", samples);
        assert_eq!(fixture.read().time, [1.0, 1.01]);
        assert_says(&csv(samples).warnings()[0], &["median interval is 1e1 s", "`s`", "check t of [units]"]);
    }

    #[test]
    fn a_label_that_is_no_integer_is_refused() {
        let message = csv("t,segment\n0,1\n1,1.5\n").error();
        assert_says(
            &message,
            &["run.csv, line 3, column `segment`", "1.5", "expected an integer", "correct"],
        );
    }

    #[test]
    fn a_file_without_sensors_is_warned_about() {
        assert_says(&csv("t,temp\n0,20\n1,20\n").warnings()[0], &["no sensor columns", "acc_x"]);
    }

    #[test]
    fn a_simulator_s_file_is_read_without_a_sensor_and_a_position_alone_is_warned_about() {
        let samples = "t,sim_gyr_x,sim_gyr_y,sim_gyr_z,sim_temp\n0,0,0,90,20\n0.01,,,,\n";
        let fixture = Fixture::new("run.csv", "[units]\ngyr = \"deg/s\"\n", samples);
        let simulated = fixture.read().simulated.unwrap();
        assert_eq!((simulated.gyr.unwrap()[0].z, simulated.temperature.unwrap()[0]), (90.0, 20.0));
        assert!(simulated.acc.is_none());
        assert_says(&fixture.warnings()[0], &["a simulator's columns", "no sensor's", "--sim"]);

        let with = |columns: &str, row: &str| {
            csv(format!("t,sim_temp,ref_px,ref_py,ref_pz{columns}\n0,20,1,,inf{row}\n"))
        };
        let alone = with("", "");
        assert_says(
            &alone.warnings()[0],
            &["run.csv, line 1, column `ref_px`", "without an attitude", "not used", "ref_qw"],
        );
        let position = alone.read().position.unwrap()[0];
        assert!(position[0] == 1.0 && position[1].is_nan() && position[2].is_nan());
        assert_eq!(with(",ref_qw,ref_qx,ref_qy,ref_qz", ",1,0,0,0").warnings().len(), 1);
    }

    #[test]
    fn a_rig_s_axes_without_angles_are_warned_about() {
        let warnings = |rig: &str, columns: &str, row: &str| {
            let samples = format!("t,acc_x,acc_y,acc_z{columns}\n0,0,0,9.8{row}\n");
            Fixture::new("run.csv", rig, samples).warnings()
        };
        let rig = "[rig]\nkind = \"flight-motion-simulator\"\naxes = [\"z\", \"y\", \"x\"]\n";
        let without = warnings(rig, "", "");
        assert_says(&without[0], &["run.csv, line 1", "[rig]", "gimbal_outer", "without a rig"]);
        assert!(warnings(rig, ",gimbal_outer,gimbal_middle,gimbal_inner", ",0,0,0").is_empty());
        assert!(warnings("[rig]\nkind = \"hand\"\n", "", "").is_empty());
    }

    #[test]
    fn absolute_times_that_run_back_are_reported_as_the_file_has_them() {
        let message = with_times(&["1700000000.000001", "1700000000.01", "1700000000.000002"]).error();
        assert_says(&message, &["line 4", "found 1700000000.000002 after 1700000000.01", "sort"]);
        let recording = with_times(&["1700000000.000001", "1700000000.010002"]).read();
        assert_eq!(recording.time, [0.0, 0.010_001]);
        assert_eq!(recording.epoch.unwrap().picoseconds(), 1_700_000_000_000_001_000_000);
    }

    #[test]
    fn units_that_are_left_out_are_said_to_be_assumed_where_they_matter() {
        let samples = "t,acc_x,acc_y,acc_z,mag_x,mag_y,mag_z\n0,0,0,9.8,40,0,0\n0.01,0,0,9.8,40,0,0\n";
        let assumed = |sections: &str| -> Vec<String> {
            let warnings = Fixture::new("run.csv", sections, samples).read().warnings;
            warnings.iter().map(ToString::to_string).filter(|text| text.contains("does not state")).collect()
        };
        assert_says(&assumed("")[0], &["run.toml", "t = \"s\", acc = \"m/s^2\", mag = \"uT\""]);
        assert_says(&assumed("[units]\nt = \"s\"\nacc = \"m/s^2\"\n")[0], &["assumed: mag = \"uT\";"]);
        assert!(assumed("[units]\nt = \"s\"\nacc = \"m/s^2\"\nmag = \"uT\"\n").is_empty());
    }

    #[test]
    fn each_unit_arrives_as_si() {
        let sections = "[units]\nacc = \"g\"\ngyr = \"counts\"\nmag = \"G\"\n[ranges]\nacc = 2\n
            [counts]\ngyr = { offset = 100, per_unit = 50 }\n";
        let samples = "t,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,mag_x,mag_y,mag_z\n0,0,0,1,150,100,50,0.5,0,0\n";
        let recording = Fixture::new("run.csv", sections, samples).read();
        let acc = recording.acc.unwrap();
        assert_eq!(acc.values[0].z, 9.80665);
        assert!((acc.full_scale_si().unwrap() - 2.0 * 9.80665).abs() < 1e-12);
        assert_eq!(recording.gyr.unwrap().values[0].as_slice(), [1.0, 0.0, -1.0]);
        assert!((recording.mag.unwrap().values[0].x - 50.0).abs() < 1e-12);
    }
}
