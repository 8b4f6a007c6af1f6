//! Parquet as other programs write it.

use std::sync::Arc;

use ::parquet::{
    basic::{Compression, Repetition},
    data_type::{DoubleType, FixedLenByteArrayType, FloatType, Int64Type},
    file::{properties::WriterProperties, writer::SerializedFileWriter},
    schema::types::Type,
};

use super::*;
use crate::recording::{
    Recording,
    fixture::{Fixture, assert_says},
    layout_guess::guess,
    write::parquet_writer::ParquetWriter,
};

/// Nullable floats, integers and a text, as other programs write them.
fn foreign() -> Vec<u8> {
    let field = |name, physical| {
        Arc::new(
            Type::primitive_type_builder(name, physical)
                .with_repetition(Repetition::OPTIONAL)
                .build()
                .unwrap(),
        )
    };
    let fields = vec![
        field("t", Physical::INT64),
        field("acc_x", Physical::FLOAT),
        field("acc_y", Physical::FLOAT),
        field("acc_z", Physical::INT64),
    ];
    let schema = Arc::new(Type::group_type_builder("schema").with_fields(fields).build().unwrap());
    let mut bytes = Vec::new();
    let mut writer = SerializedFileWriter::new(&mut bytes, schema, Arc::default()).unwrap();
    for start in [0i64, 2] {
        let mut group = writer.next_row_group().unwrap();
        for at in 0..4 {
            let mut column = group.next_column().unwrap().unwrap();
            match at {
                0 => column.typed::<Int64Type>().write_batch(&[start, start + 1], Some(&[1, 1]), None),
                3 => column.typed::<Int64Type>().write_batch(&[10, 9], Some(&[1, 1]), None),
                _ => column.typed::<FloatType>().write_batch(&[0.5], Some(&[0, 1]), None),
            }
            .unwrap();
            column.close().unwrap();
        }
        group.close().unwrap();
    }
    writer.close().unwrap();
    bytes
}

#[test]
fn nullable_floats_and_integers_in_several_groups_are_read() {
    let recording = Fixture::new("run.parquet", "", foreign()).read();
    assert_eq!(recording.time, [0.0, 1.0, 2.0, 3.0]);
    let acc = recording.acc.unwrap().values;
    assert!(acc[0].x.is_nan() && acc[2].y.is_nan());
    assert_eq!((acc[1].x, acc[3].y, acc[2].z), (0.5, 0.5, 10.0));
}

/// What the writer makes of a table.
fn write(table: &Table, bytes: &mut Vec<u8>) {
    let mut writer = ParquetWriter::begin(bytes, table, [false; KNOWN]).unwrap();
    writer.append(table, Path::new("run.parquet"), 0).unwrap().unwrap();
    writer.finish().unwrap();
}

/// Required columns of doubles, but for `t` if it is to be of integers.
fn of_numbers(columns: &[(&str, &[f64])], whole: &[i64]) -> Vec<u8> {
    of_numbers_by(columns, whole, WriterProperties::default())
}

fn of_numbers_by(columns: &[(&str, &[f64])], whole: &[i64], properties: WriterProperties) -> Vec<u8> {
    let physical = |name: &str| match name {
        "t" if !whole.is_empty() => Physical::INT64,
        _ => Physical::DOUBLE,
    };
    let field = |name: &str| Arc::new(Type::primitive_type_builder(name, physical(name)).build().unwrap());
    let fields = columns.iter().map(|(name, _)| field(name)).collect();
    let schema = Arc::new(Type::group_type_builder("schema").with_fields(fields).build().unwrap());
    let mut bytes = Vec::new();
    let mut writer = SerializedFileWriter::new(&mut bytes, schema, Arc::new(properties)).unwrap();
    let mut group = writer.next_row_group().unwrap();
    for (name, values) in columns {
        let levels = vec![1; values.len()];
        let mut column = group.next_column().unwrap().unwrap();
        match physical(name) {
            Physical::INT64 => column.typed::<Int64Type>().write_batch(whole, Some(&levels), None),
            _ => column.typed::<DoubleType>().write_batch(values, Some(&levels), None),
        }
        .unwrap();
        column.close().unwrap();
    }
    group.close().unwrap();
    writer.close().unwrap();
    bytes
}

#[test]
fn integers_since_1970_are_exact_and_a_lost_position_is_not_measured() {
    let columns: [(&str, &[f64]); 4] =
        [("t", &[0.0; 2]), ("ref_px", &[1.0, f64::INFINITY]), ("ref_py", &[0.0; 2]), ("ref_pz", &[0.0; 2])];
    let whole = [1_700_000_000_123_456_789, 1_700_000_000_133_456_790];
    let recording = Fixture::new("run.parquet", "[units]\nt = \"ns\"\n", of_numbers(&columns, &whole)).read();
    assert_eq!(recording.time, [0.0, 0.010_000_001]);
    assert_eq!(recording.epoch.unwrap().picoseconds(), 1_700_000_000_123_456_789_000);
    assert!(recording.position.unwrap()[1][0].is_nan());
    let message =
        Fixture::new("run.parquet", "", of_numbers(&[("t", &[0.0]), ("temp", &[f64::INFINITY])], &[]));
    assert_says(&message.error(), &["column `temp`", "infinite"]);
}

/// Times, a temperature, a list of numbers in each row, and bytes of fixed length.
fn with_list(name_of_list: &str) -> Vec<u8> {
    let number = |name| Arc::new(Type::primitive_type_builder(name, Physical::DOUBLE).build().unwrap());
    let list =
        Type::primitive_type_builder(name_of_list, Physical::DOUBLE).with_repetition(Repetition::REPEATED);
    let bytes = Type::primitive_type_builder("id", Physical::FIXED_LEN_BYTE_ARRAY).with_length(2);
    let fields =
        vec![number("t"), Arc::new(list.build().unwrap()), number("temp"), Arc::new(bytes.build().unwrap())];
    let schema = Arc::new(Type::group_type_builder("schema").with_fields(fields).build().unwrap());
    let mut file = Vec::new();
    let mut writer = SerializedFileWriter::new(&mut file, schema, Arc::default()).unwrap();
    for start in [0.0, 2.0] {
        let mut group = writer.next_row_group().unwrap();
        for at in 0..4 {
            let mut column = group.next_column().unwrap().unwrap();
            match at {
                0 => column.typed::<DoubleType>().write_batch(&[start, start + 1.0], Some(&[1; 2]), None),
                1 => column.typed::<DoubleType>().write_batch(
                    &[7.0, 8.0, 9.0],
                    Some(&[1; 3]),
                    Some(&[0, 1, 0]),
                ),
                2 => column.typed::<DoubleType>().write_batch(&[20.0, 21.0], Some(&[1; 2]), None),
                _ => {
                    let ids = [vec![1, 2], vec![3, 4]].map(|id| ByteArray::from(id).into());
                    column.typed::<FixedLenByteArrayType>().write_batch(&ids, Some(&[1; 2]), None)
                }
            }
            .unwrap();
            column.close().unwrap();
        }
        group.close().unwrap();
    }
    writer.close().unwrap();
    file
}

#[test]
fn a_column_without_a_value_of_its_own_in_each_row_is_left_out_once_and_refused_as_a_sensors() {
    let fixture = Fixture::new("run.parquet", "", with_list("samples"));
    let recording = fixture.read();
    assert_eq!(recording.time, [0.0, 1.0, 2.0, 3.0]);
    assert_eq!(recording.temperature.unwrap()[3], 21.0);
    assert!(recording.extra.is_empty());
    let left_out: Vec<String> =
        fixture.warnings().into_iter().filter(|warning| warning.contains("left out")).collect();
    assert_eq!(left_out.len(), 1, "{left_out:?}");
    assert_says(&left_out[0], &["`samples` (list of DOUBLE)", "`id` (FIXED_LEN_BYTE_ARRAY)", "run.parquet"]);
    let message = Fixture::new("run.parquet", "", with_list("segment")).error();
    assert_says(&message, &["column `segment`", "list of DOUBLE"]);
}

#[test]
fn other_names_are_guessed() {
    let columns: [(&str, &[f64]); 4] =
        [("stamp_ms", &[0.0, 10.0]), ("ax", &[0.0; 2]), ("ay", &[0.5; 2]), ("az", &[9.8; 2])];
    let fixture = Fixture::new("run.parquet", "", of_numbers(&columns, &[]));
    assert_says(&fixture.error(), &["run.parquet: ", "`ax` for `acc_x`"]);
    let guess = guess(&fixture.path, &Limits::default()).unwrap();
    assert_eq!(guess.options.join(" "), "--time stamp_ms --map acc=ax,ay,az --unit acc=m/s^2");
    let names: Vec<_> = guess.columns.iter().map(|column| (column.meaning, column.first.as_str())).collect();
    assert_eq!(names[3], (Some("acc_z"), "9.8"));
}

#[test]
fn a_damaged_file_and_text_for_numbers_are_refused() {
    let mut bytes = foreign();
    bytes.truncate(40);
    let message = Fixture::new("run.parquet", "", bytes).error();
    assert_says(&message, &["run.parquet", "damaged", "expected an intact Parquet file", "copy"]);

    let layout = Layout::new(&["t", "speed"], Path::new("a"), None).unwrap();
    let mut table = layout.table(1, Places::WHOLE, Clock::new(TimeUnit::Second));
    table.columns[0].push(0.0);
    table.extra[0].name = "temp".to_owned();
    table.extra[0].values.push("warm".to_owned());
    let mut bytes = Vec::new();
    write(&table, &mut bytes);
    let message = Fixture::new("run.parquet", "", bytes).error();
    assert_says(&message, &["run.parquet, column `temp`", "BYTE_ARRAY", "expected floating-point", "f64"]);
}

#[test]
fn more_than_the_limits_allow_is_refused_before_it_is_read() {
    let fixture = Fixture::new("run.parquet", "", foreign());
    let error = |limits| Recording::read_within(&fixture.path, &limits).unwrap_err().to_string();
    assert_says(
        &error(Limits { columns: 3, ..Limits::default() }),
        &["more than 3 columns", "--max-columns"],
    );
    let layout = Layout::new(&["t", "note"], Path::new("a"), None).unwrap();
    let mut table = layout.table(0, Places::WHOLE, Clock::new(TimeUnit::Second));
    table.columns[0] = (0..300).map(f64::from).collect();
    table.extra[0].values = vec!["long ".repeat(300); 300];
    let mut bytes = Vec::new();
    write(&table, &mut bytes);
    assert!(bytes.len() < 1 << 16, "the dictionary keeps one text: {}", bytes.len());
    let fixture = Fixture::new("run.parquet", "", bytes);
    let limits = Limits { size: 1 << 16, ..Limits::default() };
    let message = Recording::read_within(&fixture.path, &limits).unwrap_err().to_string();
    assert_says(&message, &["run.parquet", "samples that take more than 64 KiB", "--max-size"]);
}

#[test]
fn columns_compressed_in_usual_ways_are_read_as_those_that_are_not() {
    let whole: Vec<i64> = (0..5000).map(|k| 1_700_000_000_000_000_000 + 10_000_000 * k).collect();
    let values: Vec<f64> = (0..5000).map(|k| 9.8 + f64::from(k % 17) * 1e-3).collect();
    let columns: [(&str, &[f64]); 4] =
        [("t", &values), ("acc_x", &values), ("acc_y", &values), ("acc_z", &values)];
    let read = |compression| {
        let properties = WriterProperties::builder().set_compression(compression).build();
        let bytes = of_numbers_by(&columns, &whole, properties);
        (bytes.len(), Fixture::new("run.parquet", "[units]\nt = \"ns\"\n", bytes).read())
    };
    let (plain, expected) = read(Compression::UNCOMPRESSED);
    let usual = [Compression::SNAPPY, Compression::LZ4_RAW];
    let deflated = [Compression::ZSTD(Default::default()), Compression::GZIP(Default::default())];
    for compression in usual.into_iter().chain(deflated) {
        let (length, found) = read(compression);
        assert!(length < plain, "{compression}: {length} of {plain}");
        assert_eq!(found.acc, expected.acc);
        assert_eq!((found.time, found.epoch), (expected.time.clone(), expected.epoch));
    }
}

#[test]
fn stamps_are_in_the_unit_of_their_type_whatever_the_manifest_says() {
    let field = |name, physical, logical| {
        let built = Type::primitive_type_builder(name, physical).with_repetition(Repetition::REQUIRED);
        Arc::new(built.with_logical_type(logical).build().unwrap())
    };
    for (unit, name, per_second) in
        [(Stamp::MILLIS, "ms", 1_000), (Stamp::MICROS, "us", 1_000_000), (Stamp::NANOS, "ns", 1_000_000_000)]
    {
        let axes = ["acc_x", "acc_y", "acc_z"].map(|name| field(name, Physical::DOUBLE, None));
        let mut fields = vec![field("t", Physical::INT64, Some(LogicalType::timestamp(true, unit)))];
        fields.extend(axes);
        let schema = Arc::new(Type::group_type_builder("schema").with_fields(fields).build().unwrap());
        let mut bytes = Vec::new();
        let mut writer = SerializedFileWriter::new(&mut bytes, schema, Arc::default()).unwrap();
        let mut group = writer.next_row_group().unwrap();
        let times: Vec<i64> = (0..200).map(|k| 1_700_000_000 * per_second + k * per_second / 100).collect();
        for column in 0..4 {
            let mut writer = group.next_column().unwrap().unwrap();
            if column == 0 {
                writer.typed::<Int64Type>().write_batch(&times, None, None).unwrap();
            } else {
                writer.typed::<DoubleType>().write_batch(&[9.8; 200], None, None).unwrap();
            }
            writer.close().unwrap();
        }
        group.close().unwrap();
        writer.close().unwrap();
        let stated = if name == "us" { "ms" } else { "us" };
        let manifest = format!("[units]\nt = \"{stated}\"\nacc = \"m/s^2\"\n");
        let recording = Fixture::new("run.parquet", &manifest, bytes).read();
        assert!((recording.time[199] - 1.99).abs() < 1e-9, "{name}: {}", recording.time[199]);
        let said = recording
            .warnings
            .iter()
            .map(ToString::to_string)
            .find(|warning| warning.contains("stamps are in"));
        assert_says(&said.expect("said"), &[&format!("the stamps are in {name}"), "ignored"]);
    }
}
