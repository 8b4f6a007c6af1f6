//! Other people's formats, into a recording and through a calibration.

use std::fmt::Write;
use std::fs;

use imucal_host::recording::{Recording, SensorKind, Triple};

use super::{Folder, imucal};

/// A sensor as imu_tk writes it: time and three values a line, in the file's unit.
fn imu_tk(time: &[f64], triple: &Triple) -> String {
    let mut text = String::new();
    for (t, value) in time.iter().zip(&triple.values) {
        let [x, y, z] = value.map(|v| triple.nominal.to_raw(v)).into();
        writeln!(text, "   {t:.7e}   {x:.7e}   {y:.7e}   {z:.7e}").expect("a String takes every line");
    }
    text
}

#[test]
fn two_files_of_imu_tk_become_a_recording_that_calibrates_as_the_original() {
    let folder = Folder::with_recording();
    let original = Recording::read(&folder.path("small.csv")).expect("it was just written");
    for (kind, name) in [(SensorKind::Acc, "acc.mat"), (SensorKind::Gyr, "gyro.mat")] {
        let text = imu_tk(&original.time, original.sensor(kind).expect("it was recorded"));
        fs::write(folder.path(name), text).expect("the folder takes files");
    }
    let [acc, gyro, manifest, out] = ["acc.mat", "gyro.mat", "small.toml", "imported.csv"]
        .map(|name| folder.path(name).display().to_string());
    imucal(&["import", &acc, &gyro, "--manifest", &manifest, "--out", &out])
        .with(0)
        .printing(&["imported.csv"]);
    for option in ["--map=acc=a,b,c", "--unit=gyr=deg/s", "--time=t", "--topic=imu=/imu"] {
        imucal(&["import", &acc, &gyro, "--manifest", &manifest, "--out", &out, "--force", option])
            .with(2)
            .telling(&["found it for imu_tk", "leave it out"]);
    }
    let imported = Recording::read(&folder.path("imported.csv")).expect("it was imported");
    assert_eq!(imported.rows(), original.rows());
    imucal(&["calibrate", &out])
        .with(0)
        .printing(&["accelerometer (T9): accepted", "gyroscope (K9): accepted"]);
}

#[test]
fn an_import_names_a_missing_file_and_keeps_what_it_reads() {
    let folder = Folder::with_recording();
    let [acc, manifest, out] =
        ["small.csv", "small.toml", "new.csv"].map(|name| folder.path(name).display().to_string());
    let missing = folder.path("gyro.mat").display().to_string();
    imucal(&["import", &missing, &acc, "--manifest", &manifest, "--out", &out])
        .with(2)
        .telling(&["gyro.mat"]);
    imucal(&["import", &acc, &acc, "--manifest", &manifest, "--out", &acc]).with(2).telling(&["small.csv"]);
}
