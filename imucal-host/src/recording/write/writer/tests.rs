use std::fs;

use nalgebra::Vector3;
use proptest::prelude::*;

use super::*;
use crate::recording::{
    Epoch, ExtraColumn, Simulated,
    fixture::{Fixture, assert_says},
    unit::{AngleUnit, TimeUnit, Unit},
};

/// Three rows in SI units with everything a recording can hold.
fn full() -> Recording {
    let mut recording = Recording::new("run.csv", Manifest::default(), vec![0.0, 0.01, 0.02]);
    recording.manifest.units.t = TimeUnit::Millisecond;
    recording.manifest.units.acc = Unit::Gravity;
    recording.manifest.units.gimbal = AngleUnit::Degree;
    let values = vec![Vector3::new(0.1, f64::NAN, 9.7), Vector3::new(0.2, 0.0, 9.8), Vector3::z() * 9.9];
    recording.acc = recording.manifest.triple(SensorKind::Acc, values).ok();
    recording.temperature = Some(vec![20.0, f64::NAN, 21.5]);
    recording.gimbal = Some(vec![[0.1, -0.2, 3.0]; 3]);
    recording.reference = Some(vec![[1.0, 0.0, 0.0, 0.0]; 3]);
    recording.position = Some(vec![[1.0, -2.5, 0.1], [f64::NAN; 3], [1.1, -2.5, 0.125]]);
    let values = |value| Some(vec![Vector3::new(value, 0.0, -9.81), Vector3::repeat(f64::NAN), Vector3::x()]);
    recording.simulated = Some(Simulated {
        acc: values(0.1),
        gyr: values(1.0 / 3.0),
        mag: values(40.0),
        temperature: Some(vec![25.0, f64::NAN, 25.5]),
    });
    recording.segment = Some(vec![Some(1), None, Some(-2)]);
    let values = ["a", "b, \"c\"", ""].map(str::to_owned).to_vec();
    recording.extra = vec![ExtraColumn { name: "note".to_owned(), values }];
    recording
}

fn near(a: f64, b: f64) -> bool {
    (a.is_nan() && b.is_nan()) || (a - b).abs() <= 1e-12 * b.abs()
}

fn absolute(recording: &Recording) -> Vec<f64> {
    let start = recording.epoch.map_or(0.0, |epoch| epoch.since(Epoch::of_picoseconds(0)));
    recording.time.iter().map(|time| start + time).collect()
}

fn assert_same(back: &Recording, recording: &Recording) {
    assert_eq!(back.manifest, recording.manifest);
    assert!(absolute(back).iter().zip(absolute(recording)).all(|(a, b)| near(*a, b)));
    for kind in SensorKind::ALL {
        let components = |recording: &Recording| -> Option<Vec<f64>> {
            Some(
                recording.sensor(kind)?.values.iter().flat_map(|value| [value.x, value.y, value.z]).collect(),
            )
        };
        let (back, recording) = (components(back), components(recording));
        assert_eq!(back.as_ref().map(Vec::len), recording.as_ref().map(Vec::len));
        assert!(back.into_iter().flatten().zip(recording.into_iter().flatten()).all(|(a, b)| near(a, b)));
    }
    let angles = |recording: &Recording| recording.gimbal.clone().unwrap_or_default().concat();
    assert!(angles(back).iter().zip(angles(recording)).all(|(a, b)| near(*a, b)));
    assert_eq!((&back.segment, &back.extra), (&recording.segment, &recording.extra));
    assert_eq!(back.reference, recording.reference);
    // NaN is not itself, but its text is.
    let text = |recording: &Recording| format!("{:?} {:?}", recording.position, recording.simulated);
    assert_eq!(text(back), text(recording));
}

fn round_trip(name: &str) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    full().write(&path).unwrap();
    assert_same(&Recording::read(&path).unwrap(), &full());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn a_recording_reads_back_what_it_writes() {
    round_trip("run.csv");
    round_trip("run.csv.gz");
}

#[cfg(feature = "parquet")]
#[test]
fn a_recording_reads_back_what_it_writes_as_parquet() {
    round_trip("run.parquet");
}

#[cfg(not(feature = "parquet"))]
#[test]
fn without_parquet_both_ways_say_what_to_do() {
    let fixture = Fixture::new("run.parquet", "", "");
    assert_says(&fixture.error(), &["run.parquet", "expected .csv", "--features parquet"]);
    let message = full().write(&fixture.path).unwrap_err().to_string();
    assert_says(&message, &["run.parquet", "expected .csv", "--features parquet"]);
}

#[test]
fn counts_stay_integers_and_the_text_the_same() {
    let sections =
        "\n[units]\nt = \"us\"\nacc = \"counts\"\n[counts]\nacc = { offset = 32768.0, per_unit = 415.0 }\n";
    let samples = "t,acc_x,acc_y,acc_z\n29840,33108,33329,36429\n39857,33096,,36437\n";
    let fixture = Fixture::new("run.csv", sections, samples);
    let copy = fixture.folder.path().join("copy.csv");
    fixture.read().write(&copy).unwrap();
    assert_eq!(fs::read_to_string(copy).unwrap(), samples);
}

/// What is written, read, written and read again.
fn twice(recording: &Recording, name: &str) -> [Recording; 2] {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    recording.write(&path).unwrap();
    let once = Recording::read(&path).unwrap();
    once.write(&path).unwrap();
    [once, Recording::read(&path).unwrap()]
}

#[test]
fn absolute_times_are_written_as_they_were() {
    for (unit, samples) in [
        ("s", "t,temp\n1700000000.123456,20\n1700000000.133457,20\n"),
        ("ms", "t,temp\n1700000000123.456,20\n1700000000133.457,20\n"),
        ("us", "t,temp\n1700000000123456,20\n1700000000133457,20\n"),
        ("ns", "t,temp\n1700000000123456789,20\n1700000000123556790,20\n"),
    ] {
        let fixture = Fixture::new("run.csv", &format!("[units]\nt = \"{unit}\"\n"), samples);
        let copy = fixture.folder.path().join("copy.csv");
        fixture.read().write(&copy).unwrap();
        assert_eq!(fs::read_to_string(copy).unwrap(), samples);
    }
}

#[cfg(feature = "parquet")]
#[test]
fn absolute_times_too_fine_for_a_double_are_not_written_as_one() {
    let mut recording = Recording::new("run.parquet", Manifest::default(), vec![0.0, 1e-7]);
    recording.epoch = Some(Epoch::of_picoseconds(1_700_000_000 * 10i128.pow(12)));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.parquet");
    let message = recording.write(&path).unwrap_err().to_string();
    assert_says(&message, &["run.parquet, row 2, column `t`", "t = \"ns\"", "write CSV"]);
    recording.manifest.units.t = TimeUnit::Nanosecond;
    recording.write(&path).unwrap();
    let back = Recording::read(&path).unwrap();
    assert_eq!((back.time, back.epoch), (recording.time, recording.epoch));
}

#[test]
fn a_place_that_cannot_be_written_is_named_and_nothing_is_left() {
    let folder = tempfile::tempdir().unwrap();
    let missing = full().write(&folder.path().join("none/run.csv")).unwrap_err().to_string();
    assert_says(&missing, &["none/run.csv", "cannot be written", "check the folder"]);
    fs::create_dir(folder.path().join("run.csv")).unwrap();
    let taken = full().write(&folder.path().join("run.csv")).unwrap_err().to_string();
    assert_says(&taken, &["run.csv", "a folder of this name"]);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    let ending = full().write(&folder.path().join("run.txt")).unwrap_err().to_string();
    assert_says(&ending, &["run.txt", "`.txt`", "expected .csv", "give the file such a name"]);
}

#[test]
fn a_recording_that_contradicts_itself_is_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.csv");
    let refused = |change: fn(&mut Recording)| {
        let mut recording = full();
        change(&mut recording);
        recording.write(&path).unwrap_err().to_string()
    };
    let short = refused(|recording| recording.segment = Some(vec![None]));
    assert_says(&short, &["run.csv, column `segment`", "found 1 rows, expected 3", "correct"]);
    let order = refused(|recording| recording.time[2] = 0.01);
    assert_says(&order, &["run.csv, row 3, column `t`", "strictly increasing", "sort"]);
    let position = refused(|recording| recording.position = Some(vec![[0.0; 3]]));
    assert_says(&position, &["column `ref_px`", "found 1 rows, expected 3"]);
    let simulated = refused(|recording| {
        recording.simulated = Some(Simulated { mag: Some(Vec::new()), ..Simulated::default() });
    });
    assert_says(&simulated, &["column `sim_mag_x`", "found 0 rows, expected 3"]);
    let infinite = refused(|recording| recording.temperature = Some(vec![0.0, f64::INFINITY, 0.0]));
    assert_says(&infinite, &["row 2, column `temp`", "infinite", "NaN for not measured"]);
    let unit = refused(|recording| recording.manifest.units.gyr = Unit::Gauss);
    assert_says(&unit, &["run.csv", "gyr = \"G\"", "expected rad/s"]);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// As many rows, each that of [`full`] with other times.
fn long(rows: usize) -> Recording {
    fn cycled<T: Clone>(column: &[T], rows: usize) -> Vec<T> {
        column.iter().cycle().take(rows).cloned().collect()
    }
    let (mut long, short) = (full(), full());
    long.time = (0..rows).map(|row| row as f64 / 128.0).collect();
    let values = cycled(&short.acc.unwrap().values, rows);
    long.acc = long.manifest.triple(SensorKind::Acc, values).ok();
    long.temperature = short.temperature.map(|column| cycled(&column, rows));
    long.gimbal = short.gimbal.map(|column| cycled(&column, rows));
    long.reference = short.reference.map(|column| cycled(&column, rows));
    long.position = short.position.map(|column| cycled(&column, rows));
    long.simulated =
        short.simulated.map(|simulated| simulated.at(&(0..rows).map(|row| row % 3).collect::<Vec<_>>()));
    long.segment = short.segment.map(|column| cycled(&column, rows));
    long.extra[0].values = cycled(&short.extra[0].values, rows);
    long
}

#[test]
fn a_long_text_is_the_same_by_parts_and_as_a_whole() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["run.csv", "run.csv.gz"] {
        let recording = long(2 * ROWS + 5);
        let [by_parts, whole] = ["parts", "whole"].map(|part| folder.path().join(part).join(name));
        for path in [&by_parts, &whole] {
            fs::create_dir_all(path.parent().unwrap()).unwrap();
        }
        assert_eq!(recording.write(&by_parts).unwrap().rows, 2 * ROWS + 5);
        let mut files = OutputSet::default();
        write([&recording], &whole, &mut files).unwrap();
        files.commit().unwrap();
        assert!(fs::read(&by_parts).unwrap() == fs::read(&whole).unwrap(), "{name}");
    }
}

#[test]
fn a_fault_far_down_in_a_long_text_is_named_and_nothing_is_left() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.csv");
    let refused = |change: fn(&mut Recording)| {
        let mut recording = long(ROWS + 5);
        change(&mut recording);
        recording.write(&path).unwrap_err().to_string()
    };
    let short = refused(|recording| recording.segment.as_mut().unwrap().truncate(ROWS + 4));
    assert_says(&short, &["column `segment`", "found 65540 rows, expected 65541"]);
    let order = refused(|recording| recording.time[ROWS] = 0.0);
    assert_says(&order, &["run.csv, row 65537, column `t`", "strictly increasing"]);
    let infinite = refused(|recording| recording.temperature.as_mut().unwrap()[ROWS + 1] = f64::INFINITY);
    assert_says(&infinite, &["row 65538, column `temp`"]);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn parts_that_do_not_follow_each_other_are_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.csv");
    let refused = |change: fn(&mut Recording)| {
        let mut second = full();
        second.time.iter_mut().for_each(|time| *time += 0.03);
        change(&mut second);
        Recording::write_parts([full(), second], &path, &mut OutputSet::default()).unwrap_err().to_string()
    };
    let order = refused(|second| second.time[0] = 0.02);
    assert_says(&order, &["run.csv, row 4, column `t`", "strictly increasing"]);
    for change in [
        |second: &mut Recording| second.gimbal = None,
        |second: &mut Recording| second.extra[0].name.push('s'),
        |second: &mut Recording| second.manifest.units.acc = Unit::MetrePerSecondSquared,
    ] {
        assert_says(&refused(change), &["run.csv, row 4", "those of the first part"]);
    }
    let infinite = refused(|second| second.temperature = Some(vec![0.0, f64::INFINITY, 0.0]));
    assert_says(&infinite, &["row 5, column `temp`"]);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[cfg(feature = "parquet")]
#[test]
fn a_column_of_whole_times_takes_no_other() {
    let [first, second] = [vec![0.0, 1e-6], vec![1.5e-6]].map(|time| {
        let mut part = Recording::new("run.parquet", Manifest::default(), time);
        part.manifest.units.t = TimeUnit::Microsecond;
        part.epoch = Some(Epoch::of_picoseconds(1_700_000_000 * 10i128.pow(12)));
        part
    });
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.parquet");
    let error = Recording::write_parts([first, second], &path, &mut OutputSet::default()).unwrap_err();
    assert_says(&error.to_string(), &["run.parquet, row 3, column `t`", "with decimals", "t = \"ns\""]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn any_samples_survive_the_round_trip(
        values in proptest::collection::vec(prop::array::uniform3(-400.0..400.0f64), 1..20),
        unit in prop::sample::select(Unit::of(SensorKind::Gyr).to_vec()),
        start in -1e3..2e9f64,
    ) {
        let time = (0..values.len()).map(|row| start.floor() + row as f64 * 0.0625).collect();
        let mut recording = Recording::new("run.csv", Manifest::default(), time);
        recording.manifest.units.gyr = unit;
        recording.manifest.counts.gyr = Some(crate::recording::manifest::Counts { offset: 0.0, per_unit: 7505.75 });
        let vectors = values.into_iter().map(|value| Vector3::from(value) * 0.1).collect();
        recording.gyr = recording.manifest.triple(SensorKind::Gyr, vectors).ok();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.csv");
        recording.write(&path).unwrap();
        assert_same(&Recording::read(&path).unwrap(), &recording);
    }

    #[test]
    fn exact_times_survive_every_round_trip(
        start in 1_000_000_000_000_001i64..1_900_000_000_000_000_000,
        steps in proptest::collection::vec(50_000i64..20_000_000, 1..30),
        unit in prop::sample::select(TimeUnit::ALL.to_vec()),
    ) {
        let elapsed = steps.iter().scan(0, |sum, step| { *sum += step; Some(*sum) });
        let time: Vec<f64> = std::iter::once(0).chain(elapsed).map(|ns| ns as f64 / 1e9).collect();
        let mut recording = Recording::new("run.csv", Manifest::default(), time);
        recording.manifest.units.t = unit;
        recording.epoch = Some(Epoch::of_picoseconds(i128::from(start) * 1000));
        for back in twice(&recording, "run.csv") {
            prop_assert_eq!((&back.time, back.epoch), (&recording.time, recording.epoch));
        }
        #[cfg(feature = "parquet")]
        if unit == TimeUnit::Nanosecond {
            for back in twice(&recording, "run.parquet") {
                prop_assert_eq!((&back.time, back.epoch), (&recording.time, recording.epoch));
            }
        }
    }
}
