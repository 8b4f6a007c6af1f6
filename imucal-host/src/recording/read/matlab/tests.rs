use std::io::Write;

use flate2::{Compression, write::ZlibEncoder};

use super::*;
use crate::recording::{
    Recording,
    fixture::{Fixture, assert_says},
    layout_guess::guess,
};

/// An element with its tag, padded.
fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let mut bytes = [kind.to_le_bytes(), (data.len() as u32).to_le_bytes()].concat();
    bytes.extend(data);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}

fn array(class: u32, name: &str, sizes: &[u32], numbers: &[u8]) -> Vec<u8> {
    let sizes: Vec<u8> = sizes.iter().flat_map(|size| size.to_le_bytes()).collect();
    let flags = [class.to_le_bytes(), [0; 4]].concat();
    element(
        14,
        &[element(6, &flags), element(5, &sizes), element(1, name.as_bytes()), numbers.to_vec()].concat(),
    )
}

fn doubles(name: &str, sizes: &[u32], values: &[f64]) -> Vec<u8> {
    let data: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    array(6, name, sizes, &element(9, &data))
}

/// An object, whose content MATLAB does not publish.
fn object(name: &str, class: &str) -> Vec<u8> {
    let flags = [17u32.to_le_bytes(), [0; 4]].concat();
    let texts = [name, "MCOS", class].map(|text| element(1, text.as_bytes())).concat();
    element(14, &[element(6, &flags), texts].concat())
}

fn file(variables: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = b"MATLAB 5.0 MAT-file".to_vec();
    bytes.resize(HEADER - 4, b' ');
    bytes.extend([0, 1, b'I', b'M']);
    bytes.extend(variables.concat());
    bytes
}

fn packed(variable: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(variable).unwrap();
    let data = encoder.finish().unwrap();
    [&15u32.to_le_bytes()[..], &(data.len() as u32).to_le_bytes(), &data].concat()
}

const TIMES: [f64; 4] = [0.0, 0.01, 0.02, 0.03];
const FORCES: [f64; 12] = [0.0, 1.0, 2.0, 3.0, 0.5, 0.0, 0.0, 0.0, 9.8, 9.7, 9.6, 9.5];

fn times() -> Vec<u8> {
    doubles("t", &[4, 1], &TIMES)
}

fn recording(variables: &[Vec<u8>]) -> Fixture {
    Fixture::new("run.mat", "", file(variables))
}

#[test]
fn what_scipy_saves_is_read() {
    for name in ["plain.mat", "packed.mat", "structure.mat"] {
        let bytes: &[u8] = match name {
            "plain.mat" => include_bytes!("fixtures/plain.mat"),
            "packed.mat" => include_bytes!("fixtures/packed.mat"),
            _ => include_bytes!("fixtures/structure.mat"),
        };
        let read = Fixture::new("run.mat", "[units]\nt = \"ns\"\n", bytes).read();
        assert_eq!(read.rows(), 50, "{name}");
        assert_eq!(read.epoch.unwrap().text(TimeUnit::Nanosecond), "1700000000123456789", "{name}");
        assert!((read.time[49] - 0.49).abs() < 1e-12, "{name}");
        let (acc, gyr) = (read.acc.unwrap().values, read.gyr.unwrap().values);
        assert_eq!((acc[7].x, acc[7].y, acc[7].z), (0.07, -0.14, 9.75), "{name}");
        // Rates are saved as singles, side by side.
        assert_eq!((gyr[3].x, gyr[3].z), (f64::from(0.03f32), f64::from(-0.5f32)), "{name}");
        assert!(read.temperature.unwrap()[5].is_nan(), "{name}");
        let warning =
            read.warnings.iter().find(|warning| matches!(warning, Warning::LeftOut { .. })).unwrap();
        assert_says(
            &warning.to_string(),
            &["run.mat: left out", "fs` (1 row)", "note` (char)", "in 50 rows"],
        );
    }
}

#[test]
fn samples_one_below_the_other_and_side_by_side_are_the_same() {
    let below = recording(&[times(), doubles("acc", &[4, 3], &FORCES)]).read().acc;
    let turned: Vec<f64> = (0..4).flat_map(|row| [0, 4, 8].map(|column| FORCES[row + column])).collect();
    assert_eq!(recording(&[times(), doubles("acc", &[3, 4], &turned)]).read().acc, below);
    assert_eq!(recording(&[times(), doubles("acc", &[3, 1, 4], &turned)]).read().acc, below);
    assert_eq!(recording(&[packed(&times()), packed(&doubles("acc", &[4, 3], &FORCES))]).read().acc, below);
    assert_eq!(below.unwrap().values[2], nalgebra::Vector3::new(2.0, 0.0, 9.6));
}

#[test]
fn the_order_of_bytes_is_that_of_the_file() {
    let element = |kind: u32, data: &[u8]| {
        let mut bytes = [&kind.to_be_bytes()[..], &(data.len() as u32).to_be_bytes(), data].concat();
        bytes.resize(bytes.len().next_multiple_of(8), 0);
        bytes
    };
    let column = |name: &str, values: &[f64; 4]| {
        let data: Vec<u8> = values.iter().flat_map(|value| value.to_be_bytes()).collect();
        let (flags, sizes) =
            ([6u32.to_be_bytes(), [0; 4]].concat(), [4u32, 1].map(u32::to_be_bytes).concat());
        let parts = [element(6, &flags), element(5, &sizes), element(1, name.as_bytes()), element(9, &data)];
        element(14, &parts.concat())
    };
    let mut bytes = file(&[column("t", &TIMES), column("temp", &[20.0, 20.5, 21.0, 21.5])]);
    bytes[HEADER - 4..HEADER].copy_from_slice(&[1, 0, b'M', b'I']);
    let read = Fixture::new("run.mat", "", bytes).read();
    assert_eq!((read.time, read.temperature.unwrap()), (TIMES.to_vec(), vec![20.0, 20.5, 21.0, 21.5]));
}

#[test]
fn other_names_are_mapped_and_guessed() {
    let log = file(&[doubles("time", &[1, 4], &TIMES), doubles("accel", &[4, 3], &FORCES)]);
    let fixture = Fixture::new("run.mat", "", log);
    assert_says(&fixture.error(), &["run.mat: ", "`accel_x` for `acc_x`", "`time` for `t`"]);
    let options = guess(&fixture.path, &Limits::default()).unwrap().options.join(" ");
    assert_eq!(options, "--time time --map acc=accel_x,accel_y,accel_z --unit acc=m/s^2");
    let map = ["acc=accel_x,accel_y,accel_z".to_owned()];
    let mapping = Mapping::parse(&map, &[], Some("time")).unwrap();
    let read = Recording::read_as(&fixture.path, &mapping, &Limits::default()).unwrap();
    assert_eq!((read.rows(), read.acc.unwrap().values[3].z), (4, 9.5));
}

#[test]
fn a_column_of_another_length_than_the_times_is_refused_or_left_out() {
    let of = |name| [times(), doubles("acc", &[4, 3], &FORCES), doubles(name, &[3, 1], &[1.0; 3])];
    assert_says(&recording(&of("temp")).error(), &["run.mat, column `temp`", "found 3 rows, expected 4"]);
    assert_says(&recording(&of("gps")).warnings().join(" "), &["left out `gps` (3 rows)"]);
    // A sensor whose variable was never filled is not lost in silence.
    let empty = [times(), doubles("acc", &[4, 3], &FORCES), doubles("gyr", &[0, 0], &[])];
    assert_says(&recording(&empty).warnings().join(" "), &["left out `gyr` (empty)"]);
}

#[test]
fn objects_of_matlab_are_named_with_what_to_do() {
    let error = recording(&[object("log", "timetable")]).error();
    assert_says(&error, &["`log` (timetable)", "expected vectors or matrices", "table2struct"]);
    let error = recording(&[object("t", "datetime"), doubles("acc", &[4, 3], &FORCES)]).error();
    assert_says(&error, &["no column `t`", "`t` (datetime)", "`t = seconds(T - T(1))`"]);
    assert_says(&recording(&[]).error(), &["found no variable"]);
    let constants = ["a", "b", "c", "d", "e"].map(|name| doubles(name, &[1, 1], &[1.0]));
    let file = [constants.concat(), doubles("acc", &[4, 3], &FORCES)];
    assert_says(&recording(&file).error(), &["no column `t` among `acc_x`", "`a` (1 row)"]);
    assert_says(&recording(&[object("a\x1b[31m", "table")]).error(), &["`a?[31m` (table)"]);
}

#[test]
fn other_levels_are_named_with_what_to_do() {
    let mut hdf5 = file(&[]);
    hdf5[HEADER - 3] = 2;
    let said = |bytes: Vec<u8>| Fixture::new("run.mat", "", bytes).error();
    assert_says(&said(hdf5), &["level 7.3, which is HDF5", "`save -v7 FILE.mat`"]);
    assert_says(&said(b"# Created by Octave 8.4\n# name: t\n".to_vec()), &["Octave's text", "-v7"]);
    assert_says(&said(b"0.01  0.1  0.2  9.8\n".to_vec()), &["found text", ".csv", "imucal import"]);
    assert_says(&said(vec![0; 200]), &["another file or one of level 4"]);
    assert_says(&said(Vec::new()), &["empty file"]);
}

#[test]
fn a_damaged_file_is_an_error_wherever_it_is_damaged() {
    let whole = file(&[packed(&times()), doubles("acc", &[4, 3], &FORCES), object("log", "table")]);
    let (mut refused, mut read) = (0, 0);
    for at in HEADER..whole.len() {
        for bit in [0x01, 0x80] {
            let mut bytes = whole.clone();
            bytes[at] ^= bit;
            match Recording::read(&Fixture::new("run.mat", "", bytes).path) {
                Ok(_) => read += 1,
                Err(error) => {
                    assert_says(&error.to_string(), &["run.mat"]);
                    refused += 1;
                }
            }
        }
        let _ = Recording::read(&Fixture::new("run.mat", "", &whole[..at]).path);
    }
    // Numbers and names may be other ones without being wrong.
    assert!(refused > 100 && read > 100, "{refused} {read}");
}

#[test]
fn an_array_that_inflates_beyond_the_limit_is_refused() {
    let long = doubles("t", &[100_000, 1], &vec![0.0; 100_000]);
    let fixture = recording(&[packed(&long)]);
    let limits = Limits { size: 1 << 16, ..Limits::default() };
    let error = Recording::read_within(&fixture.path, &limits).unwrap_err();
    assert!(matches!(error, ReadError::TooManySamples { .. }), "{error}");
    // Bytes become doubles.
    let bytes = recording(&[array(9, "t", &[20_000, 1], &element(2, &[0; 20_000]))]);
    let error = Recording::read_within(&bytes.path, &limits).unwrap_err();
    assert!(matches!(error, ReadError::TooManySamples { .. }), "{error}");
}
