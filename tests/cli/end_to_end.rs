//! From a recording to corrected samples and back.

use imucal_core::record::MAX_LEN;
use imucal_host::calibrate::{Options, calibrate};
use imucal_host::recording::{Recording, SensorKind};
use imucal_host::store::StoredCalibration;

use super::{Folder, imucal, names};

#[test]
fn the_demo_names_every_file_it_writes_and_all_commands_take_them() {
    let folder = Folder::new();
    let demo = folder
        .run("demo --out demo.d")
        .with(0)
        .printing(&["cause: acc.scale_cubic", "The diagnosis names the effect that was withheld."]);
    assert_eq!(demo.err, "");
    let (_, list) = demo.out.split_once("\nWritten to ").expect("the demo ends by naming its files");
    let mut named: Vec<&str> =
        list.lines().skip(1).filter_map(|line| line.split_whitespace().next()).collect();
    named.sort_unstable();
    assert_eq!(named, names(&folder.path("demo.d")), "{list}");

    folder
        .run("calibrate demo.d/rig.csv.gz --compare --out again.toml --record again.bin --json again.json")
        .with(0);
    for name in ["again.toml", "again.bin"] {
        let inspected = folder.run(&format!("inspect {name}")).with(0);
        inspected.printing(&["intact", "accelerometer (I14)", "gyroscope (G12)", "magnetometer (X21)"]);
    }
    for name in ["demo.d/calibration.toml", "demo.d/calibration.bin"] {
        let verified = folder.run(&format!("verify demo.d/rig.csv.gz --calibration {name}")).with(0);
        assert!(verified.out.ends_with("\nequivalent\n"), "{verified:#?}");
    }
}

#[test]
fn the_same_recording_calibrates_to_what_the_demo_wrote() {
    let folder = Folder::new();
    folder.run("demo --out demo.d").with(0);
    folder
        .run("calibrate demo.d/rig.csv.gz --compare --out again.toml --record again.bin --json again.json")
        .with(0);
    for (again, demo) in [
        ("again.toml", "demo.d/calibration.toml"),
        ("again.bin", "demo.d/calibration.bin"),
        ("again.json", "demo.d/calibration.json"),
    ] {
        assert!(folder.bytes(again) == folder.bytes(demo), "{again} is not {demo}");
    }
}

#[test]
fn nonlinear_terms_of_a_rig_s_fit_are_written_shown_applied_and_verified() {
    let folder = Folder::new();
    let bent = folder.path("bent.csv");
    let bent = bent.to_str().expect("a path in UTF-8");
    imucal(&["simulate", "--out", bent, "--effect", "acc.scale_cubic", "--seed", "5"]).with(0);
    let plain = folder.run("calibrate bent.csv").with(0);
    plain.printing(&["acc: the poses contradict I14: I20 adds cubic terms", "use --model acc=I20"]);
    folder
        .run("calibrate bent.csv --model acc=I20 --out terms.toml --record cal.bin --json cal.json")
        .with(0)
        .printing(&["nonlinear terms up to", "cubic [1/counts²]: x"]);
    for name in ["cal.bin", "terms.toml"] {
        folder
            .run(&format!("inspect {name}"))
            .with(0)
            .printing(&["nonlinear terms up to", "cubic [1/counts²]: x"]);
        folder.run(&format!("verify bent.csv --calibration {name}")).with(0).printing(&["equivalent"]);
    }
    folder
        .run("check bent.csv --calibration terms.toml")
        .with(0)
        .printing(&["accelerometer: the calibration still fits", "cubic_x"]);
    folder.run("calibrate bent.csv --out linear.toml").with(0);
    let left_out = "accelerometer: not compared; one calibration has nonlinear terms";
    folder
        .run("compare linear.toml terms.toml --html drift.html")
        .printing(&[left_out, "gyroscope: no parameter"]);
    assert!(folder.text("drift.html").contains(left_out));
    assert!(folder.bytes("cal.bin").len() <= MAX_LEN, "a message to a device holds it");
    // Terms of the other two sensors as well are more than it holds, which is said before a device is asked.
    let mut stored = StoredCalibration::load(&folder.path("terms.toml")).expect("just written");
    let terms = stored.acc.as_ref().and_then(|acc| acc.nonlinearity);
    for triad in [&mut stored.gyr, &mut stored.mag].into_iter().flatten() {
        triad.nonlinearity = terms;
    }
    let long = folder.path("long.toml");
    std::fs::write(&long, stored.toml(&long).expect("a calibration")).expect("room");
    folder
        .run("device put long.toml --device tcp:localhost:9")
        .with(1)
        .telling(&["long.toml: the record has", &format!("a message to a device holds {MAX_LEN}")]);
    let json: serde_json::Value = serde_json::from_str(&folder.text("cal.json")).expect("JSON");
    let acc = &json["sensors"]["acc"];
    assert!(acc["nonlinear"]["range"].as_f64().is_some_and(|range| range > 1000.0), "{acc}");
    assert_eq!(acc["rig"]["higher_order"]["stored"], true);
}

#[test]
fn toml_and_record_correct_to_the_same_samples() {
    let folder = Folder::with_calibration();
    folder.run("apply small.csv --calibration cal.toml --out by-toml.csv").with(0);
    folder.run("apply small.csv --calibration cal.bin --out by-record.csv").with(0);
    assert_eq!(folder.text("by-toml.csv"), folder.text("by-record.csv"));
    assert_eq!(folder.text("by-toml.toml"), folder.text("by-record.toml"));
}

#[test]
fn a_corrected_recording_calibrates_to_gains_of_one_and_no_bias() {
    let folder = Folder::with_calibration();
    folder.run("apply small.csv --calibration cal.bin --out corrected.csv").with(0);
    let corrected = Recording::read(&folder.path("corrected.csv")).expect("apply writes recordings");
    let again = calibrate(&corrected, &Options::default(), &|_| {});
    for kind in SensorKind::ALL {
        let outcome = again.sensor(kind).expect("all sensors are there");
        let fit = outcome.accepted().unwrap_or_else(|| panic!("{kind}: {:?}", outcome.verdict));
        let (triad, (gain_std, bias_std)) = (fit.raw_triad(), fit.raw_std());
        // The accelerometer's own errors turn the gyroscope's axes a little once more; half a standard error is
        // far less than what any of them knows.
        for (row, column) in (0..3).flat_map(|row| (0..3).map(move |column| (row, column))) {
            let error = triad.gain[(row, column)] - f64::from(u8::from(row == column));
            let std = gain_std[(row, column)];
            assert!(error.abs() <= 0.5 * std + 1e-6, "{kind} gain {row}{column}: {error:e} of {std:e}");
        }
        for axis in 0..3 {
            let (error, std) = (triad.bias[axis], bias_std[axis]);
            assert!(error.abs() <= 0.5 * std + 1e-6, "{kind} bias {axis}: {error:e} of {std:e}");
        }
    }
}
