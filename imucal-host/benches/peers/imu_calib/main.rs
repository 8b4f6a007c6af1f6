//! Calibrates a recording by the crate `imu-calib`, from the file to the answer.
//!
//! `peer-imu-calib RECORDING.csv GRAVITY`: columns t, acc_x … gyr_z in SI units, without gaps; gravity in m/s².

use std::{env, error::Error, fs};

use imu_calib::estimate::{RecordingConfig, calibrate_recording};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [path, gravity] = &arguments[..] else { return Err("RECORDING.csv GRAVITY".into()) };
    let sample = |line: &str| -> Result<_, Box<dyn Error>> {
        let mut values = [0.0; 7];
        let mut cells = line.split(',');
        for value in &mut values {
            *value = cells.next().ok_or("a row ends early")?.parse()?;
        }
        let [t, ax, ay, az, gx, gy, gz] = values;
        Ok((t, [ax, ay, az], [gx, gy, gz]))
    };
    let samples = fs::read_to_string(path)?.lines().skip(1).map(sample).collect::<Result<Vec<_>, _>>()?;
    let settings = RecordingConfig { gravity: gravity.parse()?, ..RecordingConfig::default() };
    let calibration = calibrate_recording(&samples, &settings)?;
    print!("{}", calibration.report.summary());
    println!("{:?}", calibration.intrinsics);
    Ok(())
}
