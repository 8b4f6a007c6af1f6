use std::fs;

use super::*;
use crate::{
    batch::{entry::Standing, outlier::Outliers},
    recording::SensorKind,
};

/// A calibrated recording with one sensor, and one that cannot be read.
fn entries() -> Vec<Entry> {
    let parameter = |name: &str, value| Parameter { name: name.into(), value: Some(value), std_error: None };
    let sensor = Sensor {
        sensor: SensorKind::Gyr,
        status: "suspect".into(),
        reason: Some("time, \"rate\"".into()),
        model: "K9".into(),
        passed: true,
        kind: None,
        unit_in: Some("deg/s".into()),
        unit_out: Some("rad/s".into()),
        observations: Some(24),
        rms: Some(0.1 + 0.2),
        held_out_rms: None,
        stored: vec![parameter("gain_xy", -1.5e-9)],
        of_sensor: vec![parameter("offset_z", 1.0 / 3.0)],
    };
    let unreadable = Entry::for_tests("b", Standing::Unreadable, Vec::new());
    vec![
        Entry::for_tests("a", Standing::Refused, vec![sensor]),
        unreadable.without(Standing::Unreadable, "b.csv: line 7: found `x`".into()),
    ]
}

fn outliers() -> Outliers {
    let outlier = |parameter| Outlier {
        name: "a".into(),
        sensor: SensorKind::Gyr,
        parameter,
        value: 1.0 / 3.0,
        std_error: 0.0,
        median: 0.0,
        spread: 1e-3,
        z: 333.0,
        limit: 20.0,
    };
    Outliers { populations: Vec::new(), outliers: vec![outlier("skew_xy"), outlier("offset_z")] }
}

/// The file as text: rows of fields by name.
fn csv_rows(table: &Table) -> (Vec<String>, Vec<Vec<String>>) {
    let bytes = SummaryFormat::Csv.bytes(table).unwrap();
    let mut reader = csv::Reader::from_reader(&bytes[..]);
    let names = reader.headers().unwrap().iter().map(str::to_owned).collect();
    let rows = reader.records().map(|row| row.unwrap().iter().map(str::to_owned).collect()).collect();
    (names, rows)
}

#[test]
fn a_row_holds_what_is_known_of_a_sensor_and_a_number_reads_back_exactly() {
    let (names, rows) = csv_rows(&table(&entries(), &outliers()));
    let at =
        |row: usize, name: &str| rows[row][names.iter().position(|other| other == name).unwrap()].as_str();
    assert_eq!(rows.len(), 2);
    assert_eq!(
        [at(0, "name"), at(0, "sensor"), at(0, "standing"), at(0, "status")],
        ["a", "gyr", "refused", "suspect"]
    );
    assert_eq!([at(0, "reason"), at(0, "observations")], ["time, \"rate\"", "24"]);
    assert_eq!(at(0, "rms").parse(), Ok(0.1 + 0.2));
    assert_eq!(at(0, "gain_xy").parse(), Ok(-1.5e-9));
    assert_eq!(at(0, "offset_z").parse(), Ok(1.0 / 3.0));
    assert_eq!([at(0, "gain_xx"), at(0, "offset_z_std"), at(0, "held_out_rms")], ["", "", ""]);
    assert_eq!(at(0, "outlier"), "skew_xy offset_z");
    assert_eq!(
        [at(1, "standing"), at(1, "sensor"), at(1, "reason")],
        ["unreadable", "", "b.csv: line 7: found `x`"]
    );
}

#[cfg(feature = "parquet")]
#[test]
fn parquet_holds_what_csv_holds() {
    use ::parquet::{
        file::reader::{FileReader, SerializedFileReader},
        record::Field,
    };
    let folder = tempfile::tempdir().unwrap();
    let table = table(&entries(), &outliers());
    let (names, rows) = csv_rows(&table);
    let path = folder.path().join("units.parquet");
    fs::write(&path, SummaryFormat::Parquet.bytes(&table).unwrap()).unwrap();
    let reader = SerializedFileReader::new(File::open(&path).unwrap()).unwrap();
    let read: Vec<_> = reader.get_row_iter(None).unwrap().map(Result::unwrap).collect();
    assert_eq!(read.len(), rows.len());
    for (row, expected) in read.iter().zip(&rows) {
        let fields: Vec<(&String, String)> = row
            .get_column_iter()
            .map(|(name, field)| match field {
                Field::Null => (name, String::new()),
                Field::Str(text) => (name, text.clone()),
                Field::Double(value) => (name, format!("{value:?}")),
                Field::Long(value) => (name, value.to_string()),
                other => panic!("{name}: {other:?}"),
            })
            .collect();
        assert_eq!(fields, names.iter().zip(expected.iter().cloned()).collect::<Vec<_>>());
    }
}

#[test]
fn a_summary_is_known_by_its_content() {
    let folder = tempfile::tempdir().unwrap();
    let table = table(&entries(), &outliers());
    for (name, format) in [("a.csv", SummaryFormat::Csv), ("a.parquet", SummaryFormat::Parquet)] {
        let Ok(known) = SummaryFormat::of(name.as_ref()) else { continue };
        assert_eq!(known, format);
        let path = folder.path().join(name);
        fs::write(&path, format.bytes(&table).unwrap()).unwrap();
        assert!(format.is_summary(&path));
        fs::write(&path, "t,acc_x\n0,1\n").unwrap();
        assert!(!format.is_summary(&path) && !format.is_summary(&folder.path().join("none")));
    }
    assert!(SummaryFormat::of("a.txt".as_ref()).is_err());
}
