//! Files that MATLAB saved: the samples of `log.csv` as variables.

use imucal_host::recording::SensorKind;
use imucal_tests::simulated;

use super::Folder;

/// An element of a MAT-file of level 5.
fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let mut bytes = [kind.to_le_bytes(), (data.len() as u32).to_le_bytes()].concat();
    bytes.extend(data);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}

/// A matrix of doubles, its columns one behind the other.
fn matrix(name: &str, rows: usize, columns: &[Vec<f64>]) -> Vec<u8> {
    let sizes = [(rows as u32).to_le_bytes(), (columns.len() as u32).to_le_bytes()].concat();
    let numbers: Vec<u8> = columns.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
    let flags = [6u32.to_le_bytes(), [0; 4]].concat();
    let parts = [element(6, &flags), element(5, &sizes), element(1, name.as_bytes()), element(9, &numbers)];
    element(14, &parts.concat())
}

/// The small recording as MATLAB would save it, with the names that it has for the sensors.
fn log(names: [&str; 3]) -> Vec<u8> {
    let small = simulated::small();
    let rows = small.time.len();
    let mut bytes = b"MATLAB 5.0 MAT-file, of a test".to_vec();
    bytes.resize(124, b' ');
    bytes.extend([0, 1, b'I', b'M']);
    bytes.extend(matrix("t", rows, std::slice::from_ref(&small.time)));
    bytes.extend(matrix("fs", 1, &[vec![100.0]]));
    for (kind, name) in SensorKind::ALL.into_iter().zip(names) {
        let values = &small.sensor(kind).expect("it has all").values;
        let columns: Vec<Vec<f64>> =
            (0..3).map(|axis| values.iter().map(|value| value[axis]).collect()).collect();
        bytes.extend(matrix(name, rows, &columns));
    }
    bytes
}

/// The same as a recording in CSV.
fn csv() -> String {
    let small = simulated::small();
    let mut text = "t,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,mag_x,mag_y,mag_z\n".to_owned();
    for (row, time) in small.time.iter().enumerate() {
        let values = SensorKind::ALL.map(|kind| small.sensor(kind).expect("it has all").values[row]);
        let fields: Vec<String> = values.iter().flat_map(|value| value.iter().map(f64::to_string)).collect();
        text += &format!("{time},{}\n", fields.join(","));
    }
    text
}

#[test]
fn a_file_of_matlab_gives_the_calibration_of_the_same_data_as_csv_to_the_last_digit() {
    let folder = Folder::new();
    folder.write("log.mat", log(["acc", "gyr", "mag"]));
    folder.write("text.csv", csv());
    for manifest in ["log.toml", "text.toml"] {
        folder.write(manifest, "format = \"imucal-recording/1\"\n");
    }
    for name in ["text.csv", "log.mat"] {
        folder.run(&format!("calibrate {name} --out {name}.cal")).with(0);
    }
    assert_eq!(folder.text("log.mat.cal").replace("log.mat", "text.csv"), folder.text("text.csv.cal"));
    folder.run("import log.mat --out again.csv").with(0).telling(&["left out `fs` (1 row)"]);
    folder.run("apply log.mat --calibration log.mat.cal").with(0).printing(&["log-calibrated.csv"]);
    folder.run("import text.csv --out no.mat").with(2).telling(&["`.mat`"]);
}

#[test]
fn variables_of_other_names_are_answered_with_the_command_that_reads_them() {
    let folder = Folder::new();
    folder.write("log.mat", log(["accel", "gyro", "mag"]));
    let first = folder.run("calibrate log.mat").with(2);
    let first = first.telling(&["accel_x  acc_x, first", "gyro_z", "Then this reads it, with a unit"]);
    let command =
        first.err.lines().last().expect("a command").trim().strip_prefix("imucal ").expect("a command");
    let arguments = command
        .replace(&folder.path("log.mat").display().to_string(), "log.mat")
        .replace('\'', "")
        .replace("UNIT", "rad/s");
    folder.run(&arguments).with(0).printing(&["accelerometer", "accepted"]);
}
