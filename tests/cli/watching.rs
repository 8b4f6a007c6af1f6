//! The summary of a device's drift watch: `inspect`, and next to a diagnosis.

use imucal_core::{
    record::{self, CalibrationRecord},
    watch::{Look, MAX_LEN, Mean, Watch, WatchSettings, encode},
};
use nalgebra::Vector3;
use serde_json::Value;

use super::Folder;

/// Ten minutes of rest in which the first axis of the gyroscope steps in the middle.
fn summary(record: &CalibrationRecord) -> Vec<u8> {
    let mut watch = Watch::new(record, WatchSettings::default());
    for time in 0..600u32 {
        // Without noise a sensor would be stuck.
        let small = if time % 2 == 0 { 1e-4 } else { -1e-4 };
        let mean = |value: Vector3<f32>, scale: f32| Mean {
            value: value + Vector3::repeat(scale * small),
            variance: Vector3::repeat(scale * scale * 1e-8),
        };
        let step = if time < 300 { 0.0 } else { 0.05 };
        watch.push(&Look {
            time,
            acc: mean(Vector3::new(0.0, 0.0, -9.806_65), 10.0),
            gyr: Some(mean(Vector3::new(step, 0.0, 0.0), 1.0)),
            mag: None,
            temperature: 25.0,
            moved: time == 0,
        });
    }
    encode(&watch.summary(), &mut [0; MAX_LEN]).expect("room for it").to_vec()
}

/// With the small recording, and the summary of a watch of its unit, `watch.bin`.
fn folder() -> Folder {
    let folder = Folder::with_calibration();
    let record = record::decode(&folder.bytes("cal.bin")).expect("a record");
    folder.write("watch.bin", summary(&record));
    folder
}

#[test]
fn inspect_prints_what_a_watch_has_seen() {
    let folder = folder();
    let parts =
        ["intact", "10 min of rest", "gyr: has moved", "mag: not seen enough", "acc: as its record says"];
    folder.run("inspect watch.bin").with(0).printing(&parts);
    let mut damaged = folder.bytes("watch.bin");
    damaged[40] ^= 1;
    folder.write("damaged.bin", damaged);
    folder.run("inspect damaged.bin").with(1).printing(&["damaged.bin", "checksum"]);
}

#[test]
fn a_diagnosis_has_the_watch_next_to_it_and_stays_what_it_was() {
    let folder = folder();
    let json = |line: &str| {
        let ended = folder.run(line);
        serde_json::from_str::<Value>(&ended.out).unwrap_or_else(|cause| panic!("{cause}: {ended:#?}"))
    };
    let without = json("diagnose small.csv --json -");
    let mut with = json("diagnose small.csv --watch watch.bin --json -");
    let watch = with.as_object_mut().and_then(|diagnosis| diagnosis.remove("watch")).expect("the watch");
    assert_eq!(with, without);
    assert_eq!((&watch["watched"], &watch["triads"][1]["state"]), (&Value::from(600), &Value::from("moved")));
    let shift = &watch["triads"][1]["shifts"][0];
    assert_eq!((&shift["statistic"], &shift["compared_with"]), (&Value::from("x"), &Value::from("itself")));
    assert!(shift["since"].as_u64().is_some_and(|since| since.abs_diff(300) <= 10), "{shift}");
    assert!(shift["by"].as_f64().is_some_and(|by| (by - 0.05).abs() < 1e-3), "{shift}");
    let page = folder.run("diagnose small.csv --watch watch.bin").out;
    assert!(page.contains("drift watch:") && page.contains("gyr: has moved"), "{page}");
}

#[test]
fn a_watch_that_is_no_watch_or_of_another_unit_ends_with_2() {
    let folder = folder();
    folder
        .run("diagnose small.csv --watch cal.bin")
        .with(2)
        .telling(&["cal.bin", "not a summary of a watch"]);
    folder.run("diagnose small.csv --watch none.bin").with(2).telling(&["none.bin", "check the path"]);
    let mut record = record::decode(&folder.bytes("cal.bin")).expect("a record");
    record.sensor.serial = "another".parse().expect("short");
    folder.write("other.bin", summary(&record));
    folder.run("diagnose small.csv --watch other.bin").with(2).telling(&["another", "SIM-0001"]);
}
