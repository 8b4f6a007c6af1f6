//! Import of EuRoC's folders: `mav0/imu0/data.csv` and, as the reference, `mav0/state_groundtruth_estimate0` or `mav0/vicon0`.
//!
//! Times are in ns since 1970, rates in rad/s, specific forces in m/s²; poses are those of the body in a frame whose z points up,
//! and taken to n by `z_up`. Source: Burri et al. 2016, "The EuRoC micro aerial vehicle datasets" (IJRR 35). Not read:
//! `sensor.yaml`, so that the mounting of Vicon's markers is left to whoever compares with them; velocities and biases.

use std::path::{Path, PathBuf};

use super::{
    assembly::assemble,
    columns::{POSITION, REFERENCE, slot_of},
    csv_rows::Rows,
    header_fault::{HeaderFault, names_listed},
    joined::{Series, join},
    number::{self, NotANumber},
    z_up,
};
use crate::{
    file::{Limits, limits::Size},
    recording::{
        Recording, manifest::Manifest, parts::stamped, place::Place, read_error::ReadError,
        sensor_kind::SensorKind, unit::TimeUnit, warning::Warning,
    },
};

const IMU: [&str; 6] = ["w_RS_S_x", "w_RS_S_y", "w_RS_S_z", "a_RS_S_x", "a_RS_S_y", "a_RS_S_z"];
const POSE: [&str; 7] = ["p_RS_R_x", "p_RS_R_y", "p_RS_R_z", "q_RS_w", "q_RS_x", "q_RS_y", "q_RS_z"];
/// Folders of a reference, the first that is there.
const REFERENCES: [&str; 2] = ["state_groundtruth_estimate0", "vicon0"];

/// Whether a folder is one of EuRoC's.
#[must_use]
pub fn is_folder(path: &Path) -> bool {
    inner(path).join("imu0").is_dir()
}

/// Reads a folder that has `mav0`, or `mav0` itself. The recording has the folder's path and name.
///
/// # Errors
///
/// [`ReadError`], as of a recording.
pub fn read_folder(
    folder: &Path,
    manifest: Option<Manifest>,
    limits: &Limits,
) -> Result<Recording, ReadError> {
    let mut warnings = Vec::new();
    let mut manifest = manifest.unwrap_or_default();
    manifest.check().map_err(|fault| ReadError::Manifest { path: folder.to_path_buf(), line: 1, fault })?;
    stamped(folder, TimeUnit::Nanosecond, &mut manifest, &mut warnings);
    let imu = file_of(folder, "imu0");
    let [rate, force] = [SensorKind::Gyr, SensorKind::Acc].map(slot_of);
    let mut columns = read(&imu, &IMU, limits, &mut warnings)?;
    let of_force = columns.values.split_off(3);
    let mut series = Series::new("imu0".to_owned(), columns.stamps_ns);
    series.add(rate, columns.values);
    series.add(force, of_force);
    let mut all = vec![series];
    if let Some(name) = REFERENCES.into_iter().find(|name| file_of(folder, name).exists()) {
        let mut columns = read(&file_of(folder, name), &POSE, limits, &mut warnings)?;
        let attitude = columns.values.split_off(3);
        let mut series = Series::new(name.to_owned(), columns.stamps_ns);
        series.add(REFERENCE, z_up::attitudes(&attitude));
        series.add(POSITION, z_up::positions(&columns.values));
        all.push(series);
    }
    let mut table = join(folder, all, limits)?;
    table.warnings.splice(0..0, warnings);
    assemble(folder, manifest, table)
}

fn inner(folder: &Path) -> PathBuf {
    let inner = folder.join("mav0");
    if inner.is_dir() { inner } else { folder.to_path_buf() }
}

fn file_of(folder: &Path, name: &str) -> PathBuf {
    inner(folder).join(name).join("data.csv")
}

/// Stamps and the columns behind them.
struct Columns {
    stamps_ns: Vec<i64>,
    values: Vec<Vec<f64>>,
}

fn read(
    path: &Path,
    names: &'static [&'static str],
    limits: &Limits,
    warnings: &mut Vec<Warning>,
) -> Result<Columns, ReadError> {
    let mut rows = Rows::open(path, limits)?;
    if !rows.advance()? {
        return Err(ReadError::Empty { path: path.to_path_buf() });
    }
    check_header(path, &rows, names)?;
    let mut columns = Columns { stamps_ns: Vec::new(), values: vec![Vec::new(); names.len()] };
    while rows.advance()? {
        let place = Place::Line(rows.line);
        let expected = names.len() + 1;
        if rows.len() < expected {
            let (path, found) = (path.to_path_buf(), rows.len());
            if rows.cut {
                warnings.push(Warning::TruncatedLine { path, place, found, expected });
                break;
            }
            return Err(ReadError::FieldCount { path, place, found, expected });
        }
        let text = |at: usize| String::from_utf8_lossy(rows.field(at)).trim().to_owned();
        let bad = |at: usize| ReadError::NotANumber {
            path: path.to_path_buf(),
            place,
            column: at.checked_sub(1).map_or("timestamp", |at| names[at]).to_owned(),
            found: text(at),
        };
        let stamp: i64 = text(0).parse().map_err(|_| bad(0))?;
        check_order(path, place, columns.stamps_ns.last().copied(), stamp)?;
        columns.stamps_ns.push(stamp);
        for (at, column) in columns.values.iter_mut().enumerate() {
            column.push(match number::parse(rows.field(at + 1)) {
                Err(NotANumber::Infinite) => f64::INFINITY,
                found => found.map_err(|_| bad(at + 1))?,
            });
        }
        if (columns.stamps_ns.len() * expected * size_of::<f64>()) as u64 > limits.size {
            return Err(ReadError::TooManySamples { path: path.to_path_buf(), limit: Size(limits.size) });
        }
    }
    Ok(columns)
}

/// Columns go by their places, and their names say that they do.
fn check_header(path: &Path, rows: &Rows<'_>, names: &'static [&'static str]) -> Result<(), ReadError> {
    let found: Vec<String> =
        rows.fields().map(|name| String::from_utf8_lossy(name).trim().to_owned()).collect();
    let is_there =
        |(at, name): (usize, &&str)| found.get(at + 1).is_some_and(|other| other.starts_with(*name));
    let missing: Vec<&'static str> =
        names.iter().enumerate().filter(|column| !is_there(*column)).map(|(_, name)| *name).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let listed: Vec<&str> = found.iter().map(String::as_str).collect();
    let fault =
        HeaderFault::Incomplete { missing, found: names_listed(&listed), expected: names_listed(names) };
    Err(ReadError::Header { path: path.to_path_buf(), line: Some(rows.line), faults: vec![fault] })
}

fn check_order(path: &Path, place: Place, before: Option<i64>, found: i64) -> Result<(), ReadError> {
    match before.filter(|before| found <= *before) {
        None => Ok(()),
        Some(before) => Err(ReadError::TimeOrder {
            path: path.to_path_buf(),
            place,
            found: found.to_string(),
            before: before.to_string(),
            remedy: "sort the rows by time, and remove duplicates".to_owned(),
        }),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::recording::fixture::assert_says;

    const IMU_HEAD: &str = "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";
    const TRUTH_HEAD: &str = "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], v_RS_R_x [m s^-1]\n";
    const BEGIN: i64 = 1_403_636_579_758_555_392;

    fn folder(imu: &str, truth: Option<&str>) -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| {
            let within = folder.path().join("mav0").join(name);
            fs::create_dir_all(&within).expect("room");
            fs::write(within.join("data.csv"), text).expect("room");
        };
        write("imu0", imu);
        if let Some(truth) = truth {
            write("state_groundtruth_estimate0", truth);
        }
        folder
    }

    fn imu() -> String {
        (0..4).fold(IMU_HEAD.to_owned(), |text, k| {
            text + &format!("{},0.1,0.2,0.{k},1,2,9.5\n", BEGIN + 5_000_000 * k)
        })
    }

    #[test]
    fn samples_and_truth_stand_in_rows_with_exact_times() {
        let truth = format!("{TRUTH_HEAD}{},1,2,3,1,0,0,0,0.5\n", BEGIN + 5_000_000);
        let folder = folder(&imu(), Some(&truth));
        assert!(is_folder(folder.path()) && is_folder(&folder.path().join("mav0")));
        let recording = read_folder(folder.path(), None, &Limits::default()).expect("it reads");
        assert_eq!(recording.time, [0.0, 0.005, 0.01, 0.015]);
        assert_eq!(recording.epoch.expect("absolute").picoseconds(), i128::from(BEGIN) * 1000);
        assert_eq!(recording.acc.expect("there").values[0].as_slice(), [1.0, 2.0, 9.5]);
        assert_eq!(recording.gyr.expect("there").values[3].as_slice(), [0.1, 0.2, 0.3]);
        let position = recording.position.expect("there");
        assert!(position[0][0].is_nan());
        assert_eq!(position[1], [2.0, 1.0, -3.0]);
        let half = std::f64::consts::FRAC_1_SQRT_2;
        assert_eq!(recording.reference.expect("there")[1], [0.0, half, half, 0.0]);
    }

    #[test]
    fn a_cut_line_is_dropped_and_what_is_wrong_is_said_with_its_place() {
        let error = |imu: &str| {
            let folder = folder(imu, None);
            read_folder(folder.path(), None, &Limits::default()).unwrap_err().to_string()
        };
        assert_says(&error(&imu().replace("w_RS_S_y", "gyro")), &["imu0", "`w_RS_S_y` is missing"]);
        assert_says(&error(&imu().replace(",1,2,9.5", ",1,up,9.5")), &["line 2", "`a_RS_S_y`", "`up`"]);
        assert_says(&error(&(imu() + "5,0,0,0,0,0,0\n")), &["line 6", "found 5 after", "sort"]);
        assert_says(&error(&(imu() + "5,0\n")), &["line 6", "found 2 fields", "expected 7"]);
        let cut = folder(&(imu() + "1403636579798555392,0"), None);
        let recording = read_folder(cut.path(), None, &Limits::default()).expect("it reads");
        assert_eq!(recording.rows(), 4);
        assert_says(&recording.warnings[0].to_string(), &["line 6", "cut"]);
        let none = tempfile::tempdir().expect("a folder");
        assert!(!is_folder(none.path()));
        assert!(read_folder(none.path(), None, &Limits::default()).is_err());
    }
}
