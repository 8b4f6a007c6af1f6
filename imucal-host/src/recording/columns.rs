//! The columns of a recording: their names, and what a header makes of them.

use std::collections::HashSet;
use std::ops::Range;
use std::path::Path;

use super::ExtraColumn;
use super::place::Places;
use super::read_error::ReadError;
use super::sensor_kind::SensorKind;
use super::spelling;
use super::warning::Warning;

/// Number of columns the contract knows.
pub(crate) const KNOWN: usize = 19;

/// Their names; an index into this is a column's slot.
pub(crate) const NAMES: [&str; KNOWN] = [
    "t",
    "acc_x",
    "acc_y",
    "acc_z",
    "gyr_x",
    "gyr_y",
    "gyr_z",
    "mag_x",
    "mag_y",
    "mag_z",
    "temp",
    "gimbal_outer",
    "gimbal_middle",
    "gimbal_inner",
    "ref_qw",
    "ref_qx",
    "ref_qy",
    "ref_qz",
    "segment",
];

pub(crate) const TIME: usize = 0;
pub(crate) const TEMPERATURE: usize = 10;
pub(crate) const GIMBAL: usize = 11;
pub(crate) const REFERENCE: usize = 14;
pub(crate) const SEGMENT: usize = 18;

/// Slots that are there all or not at all.
const GROUPS: [Range<usize>; 5] = [1..4, 4..7, 7..10, GIMBAL..REFERENCE, REFERENCE..SEGMENT];

/// First slot of a sensor.
pub(crate) fn slot_of(kind: SensorKind) -> usize {
    match kind {
        SensorKind::Acc => 1,
        SensorKind::Gyr => 4,
        SensorKind::Mag => 7,
    }
}

/// Where a column of the file goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    /// A slot of [`NAMES`].
    Known(usize),
    /// An unknown column, by its number among these.
    Extra(usize),
}

/// What a header means.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    /// Of each column of the file, in its order.
    pub(crate) targets: Vec<Target>,
    /// Names of the unknown columns.
    pub(crate) extra: Vec<String>,
    /// Which slots are there.
    pub(crate) present: [bool; KNOWN],
}

/// Samples as read, in file units, one vector a slot; those of absent columns stay empty.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    pub(crate) columns: Vec<Vec<f64>>,
    pub(crate) extra: Vec<ExtraColumn>,
    pub(crate) places: Places,
    pub(crate) warnings: Vec<Warning>,
}

impl Layout {
    /// Understands a header; blanks around names do not count.
    pub(crate) fn new(header: &[&str], path: &Path) -> Result<Self, ReadError> {
        let names: Vec<&str> = header.iter().map(|name| name.trim()).collect();
        refuse_duplicates(&names, path)?;
        let mut layout = Self { targets: Vec::new(), extra: Vec::new(), present: [false; KNOWN] };
        for name in &names {
            let slot = NAMES.iter().position(|known| known == name);
            layout.targets.push(slot.map_or(Target::Extra(layout.extra.len()), Target::Known));
            match slot {
                Some(slot) => layout.present[slot] = true,
                None => layout.extra.push((*name).to_owned()),
            }
        }
        layout.refuse_misspelt(path)?;
        if !layout.present[TIME] {
            return Err(ReadError::NoTime { path: path.to_path_buf(), found: list(&names) });
        }
        layout.refuse_incomplete(path)?;
        Ok(layout)
    }

    /// A table with room for `rows` rows in the columns that are there.
    pub(crate) fn table(&self, rows: usize, places: Places) -> Table {
        let room = |present: &bool| {
            if *present { Vec::with_capacity(rows) } else { Vec::new() }
        };
        Table {
            columns: self.present.iter().map(room).collect(),
            extra: self
                .extra
                .iter()
                .map(|name| ExtraColumn { name: name.clone(), values: Vec::new() })
                .collect(),
            places,
            warnings: Vec::new(),
        }
    }

    /// A misspelt column kept as an unknown one would lose a sensor in silence.
    fn refuse_misspelt(&self, path: &Path) -> Result<(), ReadError> {
        let absent: Vec<&'static str> =
            NAMES.iter().zip(self.present).filter(|(_, present)| !present).map(|(name, _)| *name).collect();
        for found in &self.extra {
            if let Some(expected) = meant(found, &absent) {
                return Err(ReadError::MisspeltColumn {
                    path: path.to_path_buf(),
                    found: found.clone(),
                    expected,
                });
            }
        }
        Ok(())
    }

    fn refuse_incomplete(&self, path: &Path) -> Result<(), ReadError> {
        for group in GROUPS {
            let found: Vec<&str> =
                group.clone().filter(|slot| self.present[*slot]).map(|slot| NAMES[slot]).collect();
            let missing = group.clone().find(|slot| !self.present[*slot]);
            if let (false, Some(missing)) = (found.is_empty(), missing) {
                return Err(ReadError::IncompleteGroup {
                    path: path.to_path_buf(),
                    missing: NAMES[missing],
                    found: list(&found),
                    expected: list(&NAMES[group]),
                });
            }
        }
        Ok(())
    }
}

fn refuse_duplicates(names: &[&str], path: &Path) -> Result<(), ReadError> {
    let mut seen = HashSet::new();
    match names.iter().find(|name| !seen.insert(**name)) {
        Some(column) => {
            Err(ReadError::DuplicateColumn { path: path.to_path_buf(), column: (*column).to_owned() })
        }
        None => Ok(()),
    }
}

fn list(names: &[&str]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

/// The absent column that an unknown name probably means.
fn meant(name: &str, absent: &[&'static str]) -> Option<&'static str> {
    let plain = plain(name);
    if let Some(same) = absent.iter().find(|known| self::plain(known) == plain) {
        return Some(same);
    }
    // In a short name two edits make anything of anything.
    let near = |shortest: usize, edits| {
        let long = absent.iter().copied().filter(move |known| known.len() >= shortest);
        spelling::nearest(name, long, edits)
    };
    near(4, 1).or_else(|| near(5, 2))
}

/// A name without case, separators and the long forms of its first word.
fn plain(name: &str) -> String {
    const LONG: [(&str, &str); 9] = [
        ("accelerometer", "acc"),
        ("acceleration", "acc"),
        ("accel", "acc"),
        ("gyroscope", "gyr"),
        ("gyro", "gyr"),
        ("magnetometer", "mag"),
        ("magn", "mag"),
        ("temperature", "temp"),
        ("quat", "refq"),
    ];
    const WHOLE: [(&str, &str); 11] = [
        ("time", "t"),
        ("timestamp", "t"),
        ("ax", "accx"),
        ("ay", "accy"),
        ("az", "accz"),
        ("gx", "gyrx"),
        ("gy", "gyry"),
        ("gz", "gyrz"),
        ("mx", "magx"),
        ("my", "magy"),
        ("mz", "magz"),
    ];
    let bare: String = name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect();
    if let Some((_, short)) = WHOLE.iter().find(|(long, _)| *long == bare) {
        return (*short).to_owned();
    }
    for (long, short) in LONG {
        if let Some(rest) = bare.strip_prefix(long) {
            return format!("{short}{rest}");
        }
    }
    bare
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(header: &str) -> Result<Layout, String> {
        let names: Vec<&str> = header.split(',').collect();
        Layout::new(&names, Path::new("a.csv")).map_err(|error| error.to_string())
    }

    fn message(header: &str) -> String {
        layout(header).unwrap_err()
    }

    #[test]
    fn columns_are_found_by_name_in_any_order() {
        let layout = layout("acc_z, t ,volts,acc_x,acc_y").unwrap();
        assert_eq!(
            layout.targets,
            [Target::Known(3), Target::Known(0), Target::Extra(0), Target::Known(1), Target::Known(2)]
        );
        assert_eq!(layout.extra, ["volts"]);
    }

    #[test]
    fn a_misspelt_column_names_the_expected_one() {
        for (found, expected) in [
            ("accx", "acc_x"),
            ("Acc_X", "acc_x"),
            ("gyro_x", "gyr_x"),
            ("gyr-y", "gyr_y"),
            ("ax", "acc_x"),
            ("magnetometer_z", "mag_z"),
            ("temperature", "temp"),
            ("gimbal_outter", "gimbal_outer"),
            ("Segment", "segment"),
        ] {
            let text = message(&format!("t,{found}"));
            assert!(text.contains("a.csv, line 1"), "{text}");
            assert!(text.contains(&format!("`{found}`, expected `{expected}`; rename")), "{text}");
        }
        assert!(message("Time,acc_x,acc_y,acc_z").contains("`Time`, expected `t`"));
    }

    #[test]
    fn a_name_near_to_one_that_is_there_is_another_quantity() {
        let layout = layout("t,acc_x,acc_y,acc_z,acc2_x,time").unwrap();
        assert_eq!(layout.extra, ["acc2_x", "time"]);
    }

    #[test]
    fn a_sensor_without_one_of_its_columns_names_that_column() {
        let text = message("t,acc_x,acc_z");
        assert!(text.contains("a.csv, line 1: column `acc_y` is missing"), "{text}");
        assert!(text.contains("found `acc_x`, `acc_z`, expected all of `acc_x`, `acc_y`, `acc_z`"), "{text}");
        assert!(text.contains("add the column"), "{text}");
        assert!(message("t,ref_qw,ref_qx,ref_qy").contains("`ref_qz` is missing"));
    }

    #[test]
    fn a_column_twice_is_refused() {
        let text = message("t,acc_x,acc_y,acc_z,acc_x");
        assert!(text.contains("line 1: found the column `acc_x` twice, expected each name once"), "{text}");
        assert!(message("t,volts,volts").contains("`volts` twice"));
    }

    #[test]
    fn a_header_without_time_lists_what_it_has() {
        let text = message("stamp;acc_x;acc_y");
        assert!(text.contains("no column `t` among `stamp;acc_x;acc_y`"), "{text}");
        assert!(text.contains("separate columns by commas"), "{text}");
    }
}
