//! Import of imu_tk's text files: one line a sample, `t x y z` between blanks, a file a sensor.

use std::path::Path;

use super::{
    assembly::assemble,
    clock::Clock,
    columns::{Layout, TIME, Table, slot_of},
    number::{self, NotANumber},
    text::Text,
};
use crate::{
    file::{Limits, limits::Size},
    recording::{
        Recording,
        manifest::Manifest,
        order_statistics::median,
        place::{Place, Places},
        read_error::ReadError,
        sensor_kind::SensorKind,
    },
};

const NAMES: [&str; 4] = ["t", "x", "y", "z"];

/// Reads an accelerometer's and a gyroscope's file of one run (as `xsens_acc.mat`, `xsens_gyro.mat`)
/// in the units of `manifest`. The recording has the accelerometer's times, path and name. Empty lines
/// and those that begin with `#` or `%` do not count.
///
/// # Errors
///
/// [`ReadError`]; those of a recording, and when the files differ in their number of rows or a
/// sample's times differ by more than half the median interval.
pub fn read_pair(
    acc: &Path,
    gyr: &Path,
    manifest: Manifest,
    limits: &Limits,
) -> Result<Recording, ReadError> {
    manifest.check().map_err(|fault| ReadError::Manifest { path: acc.to_path_buf(), line: 1, fault })?;
    let header = [["t"].as_slice(), &SensorKind::Acc.columns(), &SensorKind::Gyr.columns()].concat();
    let mut table = Layout::new(&header, acc, None)?.table(0, Places::WHOLE, Clock::new(manifest.units.t));
    let acc_file = TextFile::read(acc, limits)?;
    let gyr_file = TextFile::read(gyr, limits)?;
    compare_times(acc, &acc_file, gyr, &gyr_file, manifest.units.t.per_si())?;
    place_axes(&mut table, SensorKind::Acc, &acc_file);
    place_axes(&mut table, SensorKind::Gyr, &gyr_file);
    let [time, ..] = acc_file.columns;
    table.columns[TIME] = time.into_iter().map(|time| table.clock.take_number(time)).collect();
    table.places = Places::Lines(acc_file.lines);
    assemble(acc, manifest, table)
}

fn place_axes(table: &mut Table, kind: SensorKind, file: &TextFile) {
    for (axis, column) in file.columns[1..].iter().enumerate() {
        table.columns[slot_of(kind) + axis].clone_from(column);
    }
}

struct TextFile {
    columns: [Vec<f64>; 4],
    lines: Vec<u64>,
}

impl TextFile {
    fn read(path: &Path, limits: &Limits) -> Result<Self, ReadError> {
        let mut text = Text::open(path, limits)?;
        let mut file = Self { columns: Default::default(), lines: Vec::new() };
        let mut line = Vec::new();
        for number in 1.. {
            if !text.line_into(&mut line, number, limits)? {
                break;
            }
            let fields = line.trim_ascii();
            if !fields.is_empty() && !fields.starts_with(b"#") && !fields.starts_with(b"%") {
                file.push(path, number, fields)?;
                file.refuse_too_many(path, limits)?;
            }
        }
        if text.truncated {
            let (path, found) = (path.to_path_buf(), "it ends early".to_owned());
            return Err(ReadError::Damaged { path, found, expected: "an intact gzip stream" });
        }
        if file.lines.is_empty() {
            return Err(ReadError::Empty { path: path.to_path_buf() });
        }
        Ok(file)
    }

    fn refuse_too_many(&self, path: &Path, limits: &Limits) -> Result<(), ReadError> {
        let row = size_of::<[f64; 4]>() + size_of::<u64>();
        if (self.lines.len() * row) as u64 <= limits.size {
            return Ok(());
        }
        Err(ReadError::TooManySamples { path: path.to_path_buf(), limit: Size(limits.size) })
    }

    fn push(&mut self, path: &Path, line: u64, text: &[u8]) -> Result<(), ReadError> {
        let place = Place::Line(line);
        let fields = || text.split(u8::is_ascii_whitespace).filter(|field| !field.is_empty());
        let found = fields().count();
        if found != NAMES.len() {
            let expected = NAMES.len();
            return Err(ReadError::FieldCount { path: path.to_path_buf(), place, found, expected });
        }
        for ((field, column), name) in fields().zip(&mut self.columns).zip(NAMES) {
            column
                .push(number::parse(field).map_err(|problem| bad_field(path, place, name, field, problem))?);
        }
        self.lines.push(line);
        Ok(())
    }
}

fn bad_field(path: &Path, place: Place, column: &str, field: &[u8], problem: NotANumber) -> ReadError {
    let path = path.to_path_buf();
    let column = column.to_owned();
    let found = String::from_utf8_lossy(field).chars().take(40).collect();
    match problem {
        NotANumber::Unparsable => ReadError::NotANumber { path, place, column, found },
        NotANumber::Infinite => ReadError::Infinite { path, place, column, found },
    }
}

fn compare_times(
    acc: &Path,
    acc_file: &TextFile,
    gyr: &Path,
    gyr_file: &TextFile,
    per_si: f64,
) -> Result<(), ReadError> {
    let (times, others) = (&gyr_file.columns[TIME], &acc_file.columns[TIME]);
    let steps = others.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    let tolerance = median(steps).unwrap_or(0.0) / 2.0;
    // A missing time is near nothing.
    let near = |(a, b): (&f64, &f64)| (a - b).abs() <= tolerance;
    if let Some(row) = times.iter().zip(others).position(|pair| !near(pair)) {
        return Err(ReadError::TimesDiffer {
            path: gyr.to_path_buf(),
            place: Place::Line(gyr_file.lines[row]),
            found: times[row] / per_si,
            other: acc.to_path_buf(),
            other_time: others[row] / per_si,
            tolerance: tolerance / per_si,
        });
    }
    if times.len() != others.len() {
        return Err(ReadError::RowsDiffer {
            path: gyr.to_path_buf(),
            found: times.len(),
            other: acc.to_path_buf(),
            expected: others.len(),
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::recording::{fixture::assert_says, manifest::Counts, unit::Unit};

    fn manifest() -> Manifest {
        let mut manifest = Manifest::default();
        manifest.units.acc = Unit::Counts;
        manifest.counts.acc = Some(Counts { offset: 32768.0, per_unit: 415.0 });
        manifest
    }

    fn pair(acc: &str, gyr: &str) -> Result<Recording, String> {
        let folder = tempfile::tempdir().unwrap();
        let paths = ["xsens_acc.mat", "xsens_gyro.mat"].map(|name| folder.path().join(name));
        fs::write(&paths[0], acc).unwrap();
        fs::write(&paths[1], gyr).unwrap();
        let limits = Limits { size: 1 << 12, columns: 4 };
        read_pair(&paths[0], &paths[1], manifest(), &limits).map_err(|error| error.to_string())
    }

    const ACC: &str = "  2.9840e-02  3.3183000e+04 32768\t36836\r\n\n0.039840 33183 32768 36836\n";

    #[test]
    fn two_files_of_a_run_become_one_recording() {
        let recording = pair(ACC, "0.02984 0.1 0.2 0.3\n0.03984 0 0 0").unwrap();
        assert_eq!(recording.time, [0.02984, 0.03984]);
        assert_eq!(recording.name, "xsens_acc.mat");
        assert_eq!(recording.acc.unwrap().values[0].x, 1.0);
        assert_eq!(recording.gyr.unwrap().values[0].z, 0.3);
    }

    #[test]
    fn times_that_differ_name_both_files_and_the_line() {
        let message = pair(ACC, "0.02984 0 0 0\n0.04684 0 0 0\n").unwrap_err();
        assert_says(
            &message,
            &["xsens_gyro.mat, line 2", "0.04684 s against 0.03984 s", "xsens_acc.mat", "one run"],
        );
    }

    #[test]
    fn files_of_different_length_and_damaged_lines_are_refused() {
        let short = pair(ACC, "0.02984 0 0 0\n").unwrap_err();
        assert_says(&short, &["xsens_gyro.mat", "found 1 rows against 2", "one run"]);
        assert_says(&pair(ACC, "0.02984 0 0\n").unwrap_err(), &["line 1", "found 3 fields, expected 4"]);
        assert_says(&pair(ACC, "# gyr\n0 0 x 0\n").unwrap_err(), &["line 2, column `y`", "`x`"]);
        assert_says(&pair("", "").unwrap_err(), &["xsens_acc.mat", "empty"]);
        let backwards = pair("1 0 0 0\n0.5 0 0 0\n", "1 0 0 0\n0.5 0 0 0\n").unwrap_err();
        assert!(backwards.contains("line 2"), "{backwards}");
    }

    #[test]
    fn lines_and_files_beyond_the_limits_are_refused() {
        let zeros = "0".repeat(300);
        assert_says(
            &pair(&format!("1 0 0 0\n{zeros}"), "").unwrap_err(),
            &["line 2", "longer than 256 bytes"],
        );
        assert_says(&pair(&"#\n".repeat(3000), "").unwrap_err(), &["more than 4 KiB", "--max-size"]);
        let many: String = (0..200).map(|row| format!("{row} 0 0 0\n")).collect();
        assert_says(&pair(&many, "").unwrap_err(), &["samples that take more than 4 KiB", "--max-size"]);
    }
}
