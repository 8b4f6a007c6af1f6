//! Files for other programs, read back: the C header by a compiler, the Python module by Python, parameters by their own formulas.

use imucal_host::export::{self, ExportError, Inputs, Target};
use imucal_host::recording::{SensorKind, Unit};
use imucal_host::store::{
    StoredCalibration, StoredCurvature, StoredNonlinearity, StoredTemperature, StoredTriad,
    noise_file::{NoiseFile, NoiseOfSensor},
};

mod code;
mod corrupted;
mod fed_back;
mod parameters;

fn triad(unit_in: Unit, unit_out: Unit, scale: f64, bias: [f64; 3]) -> StoredTriad {
    StoredTriad {
        model: "T9".into(),
        unit_in,
        unit_out,
        gain: [
            [1.01 * scale, 0.012 * scale, -0.007 * scale],
            [0.003 * scale, 0.985 * scale, 0.011 * scale],
            [-0.002 * scale, 0.004 * scale, 1.023 * scale],
        ],
        bias,
        gain_std: [[1e-4 * scale; 3]; 3],
        bias_std: [1e-3 / scale; 3],
        rms: 1e-3,
        held_out_rms: None,
        observations: 30,
        parameters: 9,
        condition: 4.0,
        coverage: 0.9,
        field_norm: None,
        provenance: None,
        temperature: None,
        nonlinearity: None,
    }
}

fn warm(order: bool) -> StoredTemperature {
    let curved = StoredCurvature {
        bias: [1e-4, -2e-4, 3e-5],
        scale: [1e-6, 2e-6, -1e-6],
        bias_std: [1e-5; 3],
        scale_std: [1e-7; 3],
    };
    StoredTemperature {
        reference: 24.3,
        bias_slope: [0.011, -0.007, 0.003],
        scale_slope: [2e-4, -1e-4, 3e-4],
        quality: None,
        curvature: order.then_some(curved),
    }
}

fn bent(cross: f64) -> StoredNonlinearity {
    StoredNonlinearity {
        range: 25.0,
        quadratic: [3e-4, -2e-4, 1e-4],
        cubic: [1e-6, 2e-6, -1e-6],
        cross: [[cross, -cross, 0.0], [0.0, cross, 0.0], [cross, 0.0, cross]],
        quadratic_std: [1e-5; 3],
        cubic_std: [1e-7; 3],
        cross_std: [[1e-6; 3]; 3],
    }
}

/// A unit with every term that a record can hold: the accelerometer in SI, the gyroscope in deg/s, the magnetometer in counts.
fn everything() -> StoredCalibration {
    let mut acc = triad(Unit::MetrePerSecondSquared, Unit::MetrePerSecondSquared, 1.0, [0.12, -0.3, -0.0]);
    (acc.temperature, acc.nonlinearity) = (Some(warm(true)), Some(bent(2e-4)));
    let mut gyr = triad(Unit::DegreePerSecond, Unit::RadianPerSecond, 0.017_453_29, [1.5, -0.7, 0.2]);
    gyr.temperature = Some(warm(false));
    let mut mag = triad(Unit::Counts, Unit::MicroTesla, 0.15, [320.0, -51.0, 2048.0]);
    mag.nonlinearity = Some(StoredNonlinearity { range: 700.0, ..bent(0.0) });
    if let Some(bent) = &mut mag.nonlinearity {
        (bent.quadratic, bent.cubic) = ([3e-6, -2e-6, 1e-6], [1e-10, 2e-10, -1e-10]);
    }
    let json = serde_json::json!({
        "format": "imucal-calibration/1", "date": "2026-03-01", "sensor": {"name": "board", "serial": "7"}
    });
    let base: StoredCalibration = serde_json::from_value(json).expect("a calibration without sensors");
    StoredCalibration { acc: Some(acc), gyr: Some(gyr), mag: Some(mag), ..base }
}

/// The same in SI units and to first order, as autopilots take it.
fn plain() -> StoredCalibration {
    let mut all = everything();
    all.acc = Some(triad(Unit::Gravity, Unit::MetrePerSecondSquared, 9.806_65, [0.012, -0.03, 0.02]));
    all.gyr = Some(triad(
        Unit::DegreePerSecond,
        Unit::RadianPerSecond,
        0.017_453_292_519_943_295,
        [1.5, -0.7, 0.2],
    ));
    all.mag = Some(triad(Unit::MilliGauss, Unit::MicroTesla, 0.1, [120.0, -51.0, 33.0]));
    all
}

fn text(target: Target, calibration: &StoredCalibration) -> String {
    let inputs = Inputs { calibration: Some(calibration), ..Inputs::default() };
    export::document(target, &inputs).expect("a document").text
}

/// Noise of known coefficients, as `imucal noise` would have kept it.
fn noise() -> NoiseFile {
    let known = |value: f64| serde_json::json!({"value": value, "interval": [value, value], "edf": 100.0, "unit": "", "reason": null, "at_most": null});
    let hidden = serde_json::json!({"value": null, "interval": null, "edf": null, "unit": "", "reason": "hidden", "at_most": 1e-9});
    let axis = |white: f64, walk: f64| {
        serde_json::json!({
            "mean": 0.0, "white": known(white), "bias_instability": hidden, "random_walk": known(walk),
            "quantisation": hidden, "correlation_time": hidden, "bias_std": hidden, "least_deviation": 1.0, "least_at": 1.0,
            "fit": {"chi_square": 1.0, "freedom": 1, "p_value": 0.5, "from": 0.01, "std_inflation": 1.0}, "allan": []
        })
    };
    let sensor = |white: f64, walk: f64| {
        serde_json::json!({"status": "estimated", "reason": null, "detail": null, "unit": "", "samples": 1, "rate": 100.0,
            "axes": [axis(white, walk), axis(2.0 * white, walk), axis(3.0 * white, walk)]})
    };
    serde_json::from_value(serde_json::json!({
        "format": "imucal-noise/1", "recording": "still.csv", "name": "", "serial": "", "duration": 3600.0,
        "acc": sensor(1e-3, 1e-4), "gyr": sensor(1e-4, 2e-5), "warnings": []
    }))
    .expect("a file of noise")
}

#[test]
fn the_table_holds_every_number() {
    let text = text(Target::Csv, &everything());
    let value = |row: &str| -> f64 {
        let line = text.lines().find(|line| line.starts_with(row)).unwrap_or_else(|| panic!("no {row}"));
        line.split(',').nth(4).and_then(|value| value.parse().ok()).expect("a number")
    };
    assert_eq!((value("acc,gain,0,1,"), value("gyr,bias,2,,")), (0.012, 0.2));
    assert_eq!(
        (value("acc,scale_quadratic,1,,"), value("mag,range,,,"), value("acc,cross,2,0,")),
        (2e-6, 700.0, 2e-4)
    );
}

#[test]
fn what_a_target_needs_and_does_not_get_is_refused() {
    let counts = everything();
    let given = Inputs { calibration: Some(&counts), ..Inputs::default() };
    let refused = |target, inputs: &Inputs<'_>| export::document(target, inputs).expect_err("refused");
    assert!(matches!(refused(Target::Px4, &given), ExportError::WrongUnit { sensor: SensorKind::Mag, .. }));
    assert!(matches!(refused(Target::Kalibr, &given), ExportError::NoNoise { .. }));
    assert!(matches!(refused(Target::Csv, &Inputs::default()), ExportError::NoCalibration { .. }));
    let acc = StoredCalibration { acc: None, ..plain() };
    let given = Inputs { calibration: Some(&acc), ..Inputs::default() };
    assert!(matches!(refused(Target::Ros, &given), ExportError::NoSensor { .. }));
    let arbitrary =
        NoiseFile { mag: noise().acc.map(|of| NoiseOfSensor { unit: "a.u.".into(), ..of }), ..noise() };
    let plain = plain();
    let given = Inputs { calibration: Some(&plain), noise: Some(&arbitrary), ..Inputs::default() };
    for target in [Target::Sdf, Target::Python] {
        assert!(matches!(refused(target, &given), ExportError::NoiseUnit { sensor: SensorKind::Mag, .. }));
    }
    let mut mirrored = plain.clone();
    let mag = mirrored.mag.as_mut().expect("a magnetometer");
    mag.gain = [[0.0, -0.1, 0.0], [0.1, 0.0, 0.0], [0.0, 0.0, -0.1]];
    let given = Inputs { calibration: Some(&mirrored), ..Inputs::default() };
    for target in [Target::Px4, Target::Ardupilot] {
        assert!(matches!(refused(target, &given), ExportError::OtherAxes { sensor: SensorKind::Mag, .. }));
    }
}

#[test]
fn an_axis_whose_noise_is_hidden_is_named_and_is_not_perfect() {
    let mut hidden = noise();
    hidden.acc.as_mut().expect("noise").axes[1] = None;
    let plain = plain();
    let inputs = Inputs { calibration: Some(&plain), noise: Some(&hidden), ..Inputs::default() };
    for target in [Target::Kalibr, Target::Sdf, Target::Python, Target::Ros] {
        let document = export::document(target, &inputs).expect("a document");
        assert!(document.cannot.iter().any(|line| line.contains("axis")), "{:?}", document.cannot);
        assert!(!document.text.contains("0.000000e0, 0, 0, 0"), "{}", document.text);
    }
    let text = export::document(Target::Ros, &inputs).expect("a document").text;
    assert!(
        text.contains("angular_velocity_covariance: [")
            && !text.contains("linear_acceleration_covariance: [")
    );
}

#[test]
fn noise_in_microtesla_is_added_in_the_unit_of_calibrated_values() {
    let mut in_gauss = plain();
    in_gauss.mag = Some(triad(Unit::Gauss, Unit::Gauss, 1.0, [0.1, -0.05, 0.03]));
    let noise = NoiseFile { mag: noise().acc, ..noise() };
    let inputs = Inputs { calibration: Some(&in_gauss), noise: Some(&noise), ..Inputs::default() };
    let text = export::document(Target::Python, &inputs).expect("a document").text;
    assert!(text.contains("\"white\": [1e-5, 2e-5, 3e-5],  # N, G/sqrt(Hz)"), "{text}");
}
