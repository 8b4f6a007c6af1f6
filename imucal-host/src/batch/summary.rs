//! The table of a batch: a row a recording and sensor, as CSV or Parquet.

use std::{
    fs::File,
    io::{self, BufRead, BufReader},
    path::Path,
};

use super::{
    entry::{Entry, Sensor},
    outlier::{Outlier, Outliers},
    parameter::{OF_SENSOR, Parameter},
};
use crate::{calibrate::outcome::entry_name, file::Limits};

#[cfg(feature = "parquet")]
mod parquet;

/// What the header begins with.
const HEAD: [&str; 4] = ["name", "recording", "sha256", "sensor"];

/// A column.
#[derive(Clone, Debug, PartialEq)]
pub enum Column {
    /// Words.
    Text(Vec<Option<String>>),
    /// Numbers.
    Number(Vec<Option<f64>>),
    /// Whole numbers.
    Whole(Vec<Option<i64>>),
}

/// Columns of one length with their names.
pub type Table = Vec<(String, Column)>;

/// Format of a summary, by the name's ending.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SummaryFormat {
    /// Comma-separated, as doubles are spelt shortest.
    Csv,
    /// Parquet.
    Parquet,
}

/// A recording and one of its sensors; none where it has none.
type Row<'a> = (&'a Entry, Option<&'a Sensor>);

/// The table of these recordings, in the order given.
#[must_use]
pub fn table(entries: &[Entry], outliers: &Outliers) -> Table {
    let rows: Vec<Row<'_>> = entries.iter().flat_map(rows).collect();
    let text = |of: &dyn Fn(&Row<'_>) -> Option<String>| Column::Text(rows.iter().map(of).collect());
    let number = |of: &dyn Fn(&Sensor) -> Option<f64>| {
        Column::Number(rows.iter().map(|(_, sensor)| sensor.and_then(of)).collect())
    };
    let sensors = |of: &dyn Fn(&Sensor) -> Option<String>| text(&|(_, sensor)| sensor.and_then(of));
    let mut table: Vec<(String, Column)> = vec![
        (HEAD[0].into(), text(&|(entry, _)| Some(entry.name.clone()))),
        (HEAD[1].into(), text(&|(entry, _)| Some(entry.recording.clone()))),
        (HEAD[2].into(), text(&|(entry, _)| Some(entry.input.as_ref()?.sha256.clone()))),
        (HEAD[3].into(), sensors(&|sensor| Some(sensor.sensor.to_string()))),
        ("standing".into(), text(&|(entry, _)| Some(entry.standing.name().into()))),
        ("status".into(), sensors(&|sensor| Some(sensor.status.clone()))),
        (
            "reason".into(),
            text(&|(entry, sensor)| match sensor {
                Some(sensor) => sensor.reason.clone(),
                // In one line: many programs read a table by lines.
                None => Some(entry.error.as_ref()?.split_whitespace().collect::<Vec<_>>().join(" ")),
            }),
        ),
        ("model".into(), sensors(&|sensor| Some(sensor.model.clone()))),
        ("unit_in".into(), sensors(&|sensor| sensor.unit_in.clone())),
        ("unit_out".into(), sensors(&|sensor| sensor.unit_out.clone())),
        (
            "observations".into(),
            Column::Whole(
                rows.iter().map(|(_, sensor)| i64::try_from((*sensor)?.observations?).ok()).collect(),
            ),
        ),
        ("rms".into(), number(&|sensor| sensor.rms)),
        ("held_out_rms".into(), number(&|sensor| sensor.held_out_rms)),
    ];
    for name in (0..12).map(entry_name) {
        table.extend(measured(&rows, &name, |sensor| &sensor.stored));
    }
    for name in OF_SENSOR {
        table.extend(measured(&rows, name, |sensor| &sensor.of_sensor));
    }
    let unlike = |(entry, sensor): &Row<'_>| {
        let sensor = (*sensor)?.sensor;
        let own = |outlier: &&Outlier| outlier.name == entry.name && outlier.sensor == sensor;
        let names: Vec<&str> =
            outliers.outliers.iter().filter(own).map(|outlier| outlier.parameter).collect();
        (!names.is_empty()).then(|| names.join(" "))
    };
    table.push(("outlier".into(), text(&unlike)));
    table
}

fn rows(entry: &Entry) -> Vec<Row<'_>> {
    match entry.sensors.is_empty() {
        true => vec![(entry, None)],
        false => entry.sensors.iter().map(|sensor| (entry, Some(sensor))).collect(),
    }
}

/// A parameter and its standard error.
fn measured(rows: &[Row<'_>], name: &str, of: impl Fn(&Sensor) -> &[Parameter]) -> [(String, Column); 2] {
    let found: Vec<Option<&Parameter>> = rows
        .iter()
        .map(|(_, sensor)| of((*sensor)?).iter().find(|parameter| parameter.name == name))
        .collect();
    let column = |value: fn(&Parameter) -> Option<f64>| {
        Column::Number(found.iter().map(|parameter| parameter.and_then(value)).collect())
    };
    [
        (name.to_owned(), column(|parameter| parameter.value)),
        (format!("{name}_std"), column(|parameter| parameter.std_error)),
    ]
}

impl SummaryFormat {
    /// By the ending; what is expected if it is another, or was not built.
    ///
    /// # Errors
    ///
    /// What is expected.
    pub fn of(path: &Path) -> Result<Self, &'static str> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("csv") => Ok(Self::Csv),
            Some("parquet") if cfg!(feature = "parquet") => Ok(Self::Parquet),
            Some("parquet") => Err("a program that was built with the feature parquet, or FILE.csv"),
            _ => Err("FILE.csv or FILE.parquet"),
        }
    }

    /// The file's content.
    ///
    /// # Errors
    ///
    /// Those of the writer.
    pub fn bytes(self, table: &Table) -> io::Result<Vec<u8>> {
        match self {
            Self::Csv => csv_bytes(table),
            #[cfg(feature = "parquet")]
            Self::Parquet => parquet::bytes(table),
            #[cfg(not(feature = "parquet"))]
            Self::Parquet => Err(io::ErrorKind::Unsupported.into()),
        }
    }

    /// A file that is such a summary, which the next may replace.
    #[must_use]
    pub fn is_summary(self, path: &Path) -> bool {
        match self {
            Self::Csv => is_csv_summary(path),
            #[cfg(feature = "parquet")]
            Self::Parquet => parquet::is_summary(path),
            #[cfg(not(feature = "parquet"))]
            Self::Parquet => false,
        }
    }
}

fn is_csv_summary(path: &Path) -> bool {
    let mut line = String::new();
    let limit = Limits::default().line() as u64;
    let read =
        File::open(path).and_then(|file| BufReader::new(io::Read::take(file, limit)).read_line(&mut line));
    read.is_ok() && line.starts_with(&(HEAD.join(",") + ","))
}

fn csv_bytes(table: &Table) -> io::Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(table.iter().map(|(name, _)| name))?;
    let rows = table.first().map_or(0, |(_, column)| column.len());
    for row in 0..rows {
        writer.write_record(table.iter().map(|(_, column)| column.text(row)))?;
    }
    writer.into_inner().map_err(csv::IntoInnerError::into_error)
}

impl Column {
    fn len(&self) -> usize {
        match self {
            Self::Text(values) => values.len(),
            Self::Number(values) => values.len(),
            Self::Whole(values) => values.len(),
        }
    }

    /// A row's value, empty where there is none; a number reads back to the last bit.
    fn text(&self, row: usize) -> String {
        let text = match self {
            Self::Text(values) => values.get(row).cloned().flatten(),
            Self::Number(values) => values.get(row).copied().flatten().map(|value| format!("{value:?}")),
            Self::Whole(values) => values.get(row).copied().flatten().map(|value| value.to_string()),
        };
        text.unwrap_or_default()
    }
}

#[cfg(test)]
mod tests;
