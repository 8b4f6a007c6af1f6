//! Parameters of simulators, ROS and autopilots, by their own formulas.

use imucal_host::export::{self, Inputs, Target};
use nalgebra::{Matrix3, Vector3};

use super::{noise, plain, text};

/// Numbers of `NAME,VALUE` or of PX4's lines, by name.
fn parameter(text: &str, name: &str) -> f64 {
    let of = |line: &str| {
        let fields: Vec<&str> = line.split([',', '\t']).collect();
        let at = fields.iter().position(|field| *field == name)?;
        fields.get(at + 1)?.parse().ok()
    };
    text.lines()
        .filter(|line| !line.starts_with('#'))
        .find_map(of)
        .unwrap_or_else(|| panic!("no {name} in {text}"))
}

fn vector(text: &str, name: &str) -> Vector3<f64> {
    Vector3::from(["X", "Y", "Z"].map(|axis| parameter(text, &name.replace('*', axis))))
}

fn symmetric(diagonal: Vector3<f64>, off: Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(diagonal.x, off.x, off.y, off.x, diagonal.y, off.z, off.y, off.z, diagonal.z)
}

#[test]
fn autopilots_correct_by_their_own_formulas_but_for_what_they_cannot_say() {
    let calibration = plain();
    let (px4, ardupilot) = (text(Target::Px4, &calibration), text(Target::Ardupilot, &calibration));
    let (g, milligauss) = (9.806_65, 0.1);
    // Raw values in SI, of an axis alone: what is off the diagonal is left out.
    let acc_bias = Vector3::new(0.012, -0.03, 0.02) * g;
    for (offset, scale) in [
        (vector(&px4, "CAL_ACC0_*OFF"), vector(&px4, "CAL_ACC0_*SCALE")),
        (vector(&ardupilot, "INS_ACCOFFS_*"), vector(&ardupilot, "INS_ACCSCAL_*")),
    ] {
        assert!(
            (offset - acc_bias).norm() < 1e-8 && (scale - Vector3::new(1.01, 0.985, 1.023)).norm() < 1e-8
        );
    }
    let rate = Vector3::new(1.5, -0.7, 0.2).map(f64::to_radians);
    for offset in [vector(&px4, "CAL_GYRO0_*OFF"), vector(&ardupilot, "INS_GYROFFS_*")] {
        assert!((offset - rate).norm() < 1e-8);
    }
    // The magnetometer's lengths are right whatever the rotation: in µT, of a raw value in mG.
    let raw = Vector3::new(400.0, -250.0, 310.0);
    let bias = Vector3::new(120.0, -51.0, 33.0);
    let gain = Matrix3::new(0.101, 0.0012, -0.0007, 0.0003, 0.0985, 0.0011, -0.0002, 0.0004, 0.1023);
    let expected = (gain * (raw - bias)).norm();
    let in_px4 = symmetric(vector(&px4, "CAL_MAG0_*SCALE"), vector(&px4, "CAL_MAG0_*ODIAG"))
        * (raw / 1000.0 - vector(&px4, "CAL_MAG0_*OFF"));
    assert!((in_px4.norm() * 100.0 / expected - 1.0).abs() < 1e-7, "{in_px4} {expected}");
    let in_ardupilot = symmetric(vector(&ardupilot, "COMPASS_DIA_*"), vector(&ardupilot, "COMPASS_ODI_*"))
        * (raw + vector(&ardupilot, "COMPASS_OFS_*"));
    assert!((in_ardupilot.norm() * milligauss / expected - 1.0).abs() < 1e-7, "{in_ardupilot} {expected}");
    assert!(px4.contains("What this file cannot say") && px4.contains("off its diagonal"));
}

#[test]
fn imu_calib_takes_its_bias_after_the_matrix() {
    let text = text(Target::Ros, &plain());
    let list = |key: &str| -> Vec<f64> {
        let line = text.lines().find(|line| line.starts_with(key)).expect("a line");
        let inside = line.split(['[', ']']).nth(1).expect("a list");
        inside.split(", ").map(|value| value.parse().expect("a number")).collect()
    };
    let (sm, bias) = (Matrix3::from_row_slice(&list("SM:")), Vector3::from_vec(list("bias:")));
    let raw = Vector3::new(1.0, -9.0, 3.0);
    let stored = Matrix3::new(1.01, 0.012, -0.007, 0.003, 0.985, 0.011, -0.002, 0.004, 1.023);
    let expected = stored * (raw - Vector3::new(0.012, -0.03, 0.02) * 9.806_65);
    assert!((sm * raw - bias - expected).norm() < 1e-7);
}

#[test]
fn gazebo_s_own_formulas_give_the_noise_back_and_no_sign_is_drawn() {
    let (calibration, noise) = (plain(), noise());
    let inputs = Inputs {
        calibration: Some(&calibration),
        noise: Some(&noise),
        rate: Some(250.0),
        ..Inputs::default()
    };
    let text = export::document(Target::Sdf, &inputs).expect("a document").text;
    let all = |tag: &str| -> Vec<f64> {
        text.split(&format!("<{tag}>"))
            .skip(1)
            .map(|part| part.split('<').next().expect("text").parse().expect("a number"))
            .collect()
    };
    // Accelerometer first; white noise of a sample at 250 Hz is N·√rate.
    let deviations = all("stddev");
    for (found, density) in deviations.iter().zip([1e-3, 2e-3, 3e-3, 1e-4, 2e-4, 3e-4]) {
        assert!((found / 250f64.sqrt() / density - 1.0).abs() < 1e-6, "{found} {density}");
    }
    // A step of dt of Gazebo's bias has a variance of -d² T/2 · expm1(-2 dt/T), which is K² dt for a long T.
    let (dynamic, time) = (all("dynamic_bias_stddev"), all("dynamic_bias_correlation_time"));
    for ((density, time), walk) in dynamic.iter().zip(&time).zip([1e-4, 1e-4, 1e-4, 2e-5, 2e-5, 2e-5]) {
        let step = -density * density * time / 2.0 * (-2.0 * 0.004 / time).exp_m1();
        assert!((step / (walk * walk * 0.004) - 1.0).abs() < 1e-3, "{step}");
    }
    let means = all("mean");
    assert!(
        (means[1] + 0.03 * 9.806_65).abs() < 1e-6 && (means[3] - 1.5f64.to_radians()).abs() < 1e-6,
        "{means:?}"
    );
    assert!(all("bias_mean").iter().all(|mean| *mean == 0.0));
    let elements = |open: &str| text.matches(open).count();
    assert_eq!(elements("<noise"), elements("</noise>"));
    assert_eq!(elements("<imu>"), elements("</imu>"));
}
