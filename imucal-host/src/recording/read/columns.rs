//! The columns of a recording: their names, and what a header makes of them.

use std::{collections::HashMap, ops::Range, path::Path};

use super::{
    clock::Clock,
    column_guess::meant,
    header_fault::{HeaderFault, MisspeltColumn, names_listed},
};
use crate::recording::{
    ExtraColumn, place::Places, read_error::ReadError, sensor_kind::SensorKind, topic, warning::Warning,
};

/// Number of columns the contract knows.
pub(crate) const KNOWN: usize = 32;

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
    "ref_px",
    "ref_py",
    "ref_pz",
    "sim_acc_x",
    "sim_acc_y",
    "sim_acc_z",
    "sim_gyr_x",
    "sim_gyr_y",
    "sim_gyr_z",
    "sim_mag_x",
    "sim_mag_y",
    "sim_mag_z",
    "sim_temp",
    "segment",
];

pub(crate) const TIME: usize = 0;
pub(crate) const TEMPERATURE: usize = 10;
pub(crate) const GIMBAL: usize = 11;
pub(crate) const REFERENCE: usize = 14;
pub(crate) const POSITION: usize = 18;
pub(crate) const SIM_TEMPERATURE: usize = 30;
pub(crate) const SEGMENT: usize = 31;

/// First slot of the simulator's sensors, which stand in the order of the real ones.
pub(crate) const SIMULATED: usize = 21;

/// Slots that are there all or not at all.
const GROUPS: [Range<usize>; 9] = [
    1..4,
    4..7,
    7..10,
    GIMBAL..REFERENCE,
    REFERENCE..POSITION,
    POSITION..SIMULATED,
    SIMULATED..24,
    24..27,
    27..SIM_TEMPERATURE,
];

/// First slot of a sensor.
pub(crate) fn slot_of(kind: SensorKind) -> usize {
    match kind {
        SensorKind::Acc => 1,
        SensorKind::Gyr => 4,
        SensorKind::Mag => 7,
    }
}

/// First slot of what a simulator says that a sensor would read.
pub(crate) fn simulated_slot_of(kind: SensorKind) -> usize {
    slot_of(kind) - 1 + SIMULATED
}

/// Whether an infinite number in a slot is one that was not measured. Trackers write so where they lost the body.
pub(crate) fn infinite_is_missing(slot: usize) -> bool {
    (POSITION..SIMULATED).contains(&slot)
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
    /// Line of the header, where the file is a text that has one.
    line: Option<u64>,
}

/// Samples as read, in file units, one vector a slot; those of absent columns stay empty.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    pub(crate) columns: Vec<Vec<f64>>,
    pub(crate) extra: Vec<ExtraColumn>,
    /// Line of the header, where the file is a text that has one.
    pub(crate) header: Option<u64>,
    pub(crate) places: Places,
    /// What the column `t` counts.
    pub(crate) clock: Clock,
    pub(crate) warnings: Vec<Warning>,
}

impl Table {
    /// An infinite number is a fault, but where it says that nothing was measured.
    pub(crate) fn refuse_infinite(&self, path: &Path) -> Result<(), ReadError> {
        for (slot, column) in self.columns.iter().enumerate() {
            if let Some(row) = column.iter().position(|value| value.is_infinite()) {
                return Err(ReadError::Infinite {
                    path: path.to_path_buf(),
                    place: self.places.of(row),
                    column: NAMES[slot].to_owned(),
                    found: column[row].to_string(),
                });
            }
        }
        Ok(())
    }
}

impl Layout {
    /// Understands a header, which stands at `line` of a text; blanks around names do not count. All that is wrong with it is said at
    /// once.
    pub(crate) fn new(header: &[&str], path: &Path, line: Option<u64>) -> Result<Self, ReadError> {
        let (names, mut faults) = separated(header);
        let layout = Self { line, ..Self::of(&names) };
        faults.extend(duplicates(&names));
        let misspelt = layout.misspelt();
        let mut present = layout.present;
        for column in &misspelt {
            NAMES
                .iter()
                .position(|name| *name == column.expected)
                .into_iter()
                .for_each(|slot| present[slot] = true);
        }
        if !misspelt.is_empty() {
            faults.push(HeaderFault::Misspelt { columns: misspelt });
        }
        if !present[TIME] {
            faults.push(HeaderFault::NoTime { found: names_listed(&names) });
        }
        faults.extend(incomplete(&present));
        if faults.is_empty() {
            Ok(layout)
        } else {
            Err(ReadError::Header { path: path.to_path_buf(), line, faults })
        }
    }

    /// What names mean, each for itself.
    fn of(names: &[&str]) -> Self {
        let mut layout = Self { targets: Vec::new(), extra: Vec::new(), present: [false; KNOWN], line: None };
        for name in names {
            let slot = NAMES.iter().position(|known| known == name);
            layout.targets.push(slot.map_or(Target::Extra(layout.extra.len()), Target::Known));
            match slot {
                Some(slot) => layout.present[slot] = true,
                None => layout.extra.push((*name).to_owned()),
            }
        }
        layout
    }

    /// A table with room for `rows` rows in the columns that are there, and times by `clock`.
    pub(crate) fn table(&self, rows: usize, places: Places, clock: Clock) -> Table {
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
            header: self.line,
            places,
            clock,
            warnings: Vec::new(),
        }
    }

    /// A misspelt column kept as an unknown one would lose a sensor in silence.
    fn misspelt(&self) -> Vec<MisspeltColumn> {
        let absent: Vec<&'static str> =
            NAMES.iter().zip(self.present).filter(|(_, present)| !present).map(|(name, _)| *name).collect();
        let guess = |found: &String| {
            let (expected, unit) = meant(found, &absent)?;
            Some(MisspeltColumn { found: found.clone(), expected, unit })
        };
        self.extra.iter().filter(|name| topic::split(name).is_none()).filter_map(guess).collect()
    }

    /// Bytes that a row takes in memory, but for the text of unknown columns.
    pub(crate) fn row_size(&self) -> usize {
        let known = self.present.iter().filter(|present| **present).count();
        known * size_of::<f64>() + self.extra.len() * size_of::<String>()
    }
}

/// The names of a header, apart also where something else than a comma separates them.
fn separated<'a>(header: &[&'a str]) -> (Vec<&'a str>, Vec<HeaderFault>) {
    const SEPARATORS: [(char, &str); 4] =
        [(';', "semicolons"), ('\t', "tabs"), ('|', "bars"), (' ', "blanks")];
    if let [one] = header {
        let one = one.trim();
        if let Some((separator, found)) =
            SEPARATORS.into_iter().find(|(separator, _)| one.contains(*separator))
        {
            let names = one.split(separator).map(str::trim).filter(|name| !name.is_empty());
            return (names.collect(), vec![HeaderFault::Separator { found }]);
        }
    }
    (header.iter().map(|name| name.trim()).collect(), Vec::new())
}

/// Groups of which some columns are there and others are not.
fn incomplete(present: &[bool; KNOWN]) -> Vec<HeaderFault> {
    let names = |group: &Range<usize>, there: bool| -> Vec<&'static str> {
        group.clone().filter(|slot| present[*slot] == there).map(|slot| NAMES[slot]).collect()
    };
    let fault = |group: Range<usize>| {
        let (found, missing) = (names(&group, true), names(&group, false));
        (!found.is_empty() && !missing.is_empty()).then(|| HeaderFault::Incomplete {
            missing,
            found: names_listed(&found),
            expected: names_listed(&NAMES[group]),
        })
    };
    GROUPS.into_iter().filter_map(fault).collect()
}

fn duplicates(names: &[&str]) -> Option<HeaderFault> {
    let mut counts = HashMap::new();
    names.iter().for_each(|name| *counts.entry(*name).or_insert(0) += 1);
    let mut twice: Vec<&str> =
        counts.into_iter().filter(|(_, count)| *count > 1).map(|(name, _)| name).collect();
    twice.sort_unstable();
    (!twice.is_empty()).then(|| HeaderFault::Duplicate { found: names_listed(&twice) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(header: &str) -> Result<Layout, String> {
        let names: Vec<&str> = header.split(',').collect();
        Layout::new(&names, Path::new("a.csv"), Some(1)).map_err(|error| error.to_string())
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
        for (found, expected) in
            [("accx", "acc_x"), ("ax", "acc_x"), ("temperature", "temp"), ("temp_c", "temp")]
        {
            let text = message(&format!("t,{found}"));
            assert!(text.contains("a.csv, line 1"), "{text}");
            assert!(text.contains(&format!("`{found}`, expected `{expected}`; rename")), "{text}");
        }
        assert!(message("Time,acc_x,acc_y,acc_z").contains("`Time`, expected `t`"));
    }

    #[test]
    fn all_faults_of_a_header_are_said_at_once() {
        let text = message("time,ax,ay,az,gyr_x,gyr_z,temp_c,mag_x,mag_x");
        for part in [
            "a.csv, line 1: ",
            "`time` for `t`, `ax` for `acc_x`, `ay` for `acc_y`, `az` for `acc_z`, `temp_c` for `temp`; rename them so",
            "below [units]",
            "column `gyr_y` is missing",
            "columns `mag_y`, `mag_z` are missing",
            "the column `mag_x` twice",
        ] {
            assert!(text.contains(part), "`{part}` is missing in: {text}");
        }
        assert!(!text.contains("no column `t`") && !text.contains("`acc_x`, `acc_y` are missing"), "{text}");
    }

    #[test]
    fn other_separators_are_said_with_the_names_between_them() {
        for (header, separator) in
            [("t;ax;ay;az", "semicolons"), ("t\tax\tay\taz", "tabs"), ("t  ax  ay  az", "blanks")]
        {
            let text = message(header);
            assert!(
                text.contains(&format!("found {separator} between the columns, expected commas")),
                "{text}"
            );
            assert!(text.contains("`ax` for `acc_x`") && !text.contains("no column `t`"), "{text}");
        }
        assert!(message("t;acc_x;acc_y;acc_z").ends_with("write numbers with a decimal point"));
    }

    #[test]
    fn a_foreign_header_is_not_repeated_at_length() {
        let long = "n".repeat(5000);
        let names: Vec<String> = (0..500).map(|index| format!("{index}{long}")).collect();
        let text = message(&names.join(","));
        assert!(text.len() < 3000 && text.contains("and 476 more"), "{text}");
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
        assert!(message("t,ref_px,ref_pz").contains("`ref_py` is missing"));
        assert!(message("t,sim_mag_x,sim_mag_y").contains("`sim_mag_z` is missing"));
    }

    #[test]
    fn a_column_twice_is_refused() {
        let text = message("t,acc_x,acc_y,acc_z,acc_x");
        assert!(text.contains("line 1: found the column `acc_x` twice, expected each name once"), "{text}");
        assert!(message("t,volts,volts").contains("`volts` twice"));
    }

    #[test]
    fn a_header_without_time_lists_what_it_has() {
        let text = message("stamp,acc_x,acc_y,acc_z");
        assert!(text.contains("no column `t` among `stamp`, `acc_x`, `acc_y`, `acc_z`"), "{text}");
        assert!(text.contains("separate columns by commas"), "{text}");
    }
}
