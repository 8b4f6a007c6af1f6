//! Axes that are negated or swapped: every norm fits, and nothing but handedness shows it.

use imucal_core::record::{Date, Sensor};
use imucal_host::{
    calibrate::{Calibration, Options, Status, calibrate},
    capture,
    effect::axis_swap::{columns, signed_permutation},
    recording::{Recording, SensorKind},
};
use imucal_tests::{data, simulated::tumbled};
use nalgebra::Matrix3;

use super::{Bad, GYR};

/// One axis negated, then two swapped, by the code of the effect `axis_swap`.
const MIRRORS: [usize; 6] = [1, 2, 4, 8, 16, 40];

fn swapped(mut recording: Recording, kind: SensorKind, code: usize) -> Recording {
    let p = signed_permutation(code).expect("a code");
    let sensor = match kind {
        SensorKind::Acc => &mut recording.acc,
        SensorKind::Gyr => &mut recording.gyr,
        SensorKind::Mag => &mut recording.mag,
    };
    sensor.as_mut().expect("recorded").values.iter_mut().for_each(|value| *value = p * *value);
    recording
}

fn calibrated(recording: &Recording) -> Calibration {
    calibrate(recording, &Options::default(), &|_| {})
}

/// The statuses of acc, gyr, mag: `a` accepted, `s` suspect, `r` refused.
fn statuses(calibration: &Calibration) -> String {
    let letter = |outcome: &imucal_host::calibrate::SensorOutcome| match outcome.status() {
        Status::Accepted => 'a',
        Status::Suspect => 's',
        Status::Refused => 'r',
    };
    calibration.sensors.iter().map(letter).collect()
}

/// The sensor is refused, and both what was found and what to do name its columns.
fn assert_named(calibration: &Calibration, kind: SensorKind, code: usize) {
    let outcome = calibration.sensor(kind).expect("recorded");
    let (detail, advice) = (outcome.detail().unwrap_or_default(), &outcome.verdict);
    let advice = advice.as_ref().err().map(|refused| refused.advice.clone()).unwrap_or_default();
    let (name, columns) = (format!("{kind}.axis_swap"), columns(kind, code));
    for text in [&detail, &advice] {
        assert!(text.contains(&name) && text.contains(&columns), "{name}, {columns}: {detail}; {advice}");
    }
    assert_eq!(outcome.verdict.as_ref().expect_err("refused").refusal.reason(), "implausible");
}

#[test]
fn a_mirrored_sensor_is_refused_with_the_columns_to_mend() {
    for seed in [5, 21] {
        assert_eq!(statuses(&calibrated(&tumbled(14, seed))), "aaa", "seed {seed}");
        for code in MIRRORS {
            for (kind, expected) in
                [(SensorKind::Acc, "rrr"), (SensorKind::Gyr, "ara"), (SensorKind::Mag, "aar")]
            {
                let calibration = calibrated(&swapped(tumbled(14, seed), kind, code));
                assert_eq!(statuses(&calibration), expected, "seed {seed}, {kind}, code {code}");
                assert_named(&calibration, kind, code);
            }
        }
    }
}

/// Without the gyroscope; without what the site says of the field.
fn without_gyroscope(mut recording: Recording) -> Recording {
    recording.gyr = None;
    recording
}

fn without_site(mut recording: Recording) -> Recording {
    recording.manifest.site.latitude_deg = None;
    recording.manifest.site.field_ned_ut = None;
    recording
}

/// The field reversed, which is what the other hemisphere does to its dip.
fn in_the_south(mut recording: Recording) -> Recording {
    let site = &mut recording.manifest.site;
    site.latitude_deg = site.latitude_deg.map(|latitude| -latitude);
    site.field_ned_ut = site.field_ned_ut.map(|field| field.map(|x| -x));
    swapped(recording, SensorKind::Mag, 7)
}

fn warnings(calibration: &Calibration) -> String {
    calibration.warnings.join("\n")
}

#[test]
fn a_mirrored_magnetometer_is_refused_in_the_south_too() {
    let south = in_the_south(tumbled(14, 5));
    assert_eq!(statuses(&calibrated(&south)), "aaa");
    for code in MIRRORS {
        let calibration = calibrated(&swapped(south.clone(), SensorKind::Mag, code));
        assert_eq!(statuses(&calibration), "aar", "code {code}");
        assert_named(&calibration, SensorKind::Mag, code);
    }
    // The hemisphere alone tells the sign as well.
    let mut by_latitude = tumbled(14, 5);
    by_latitude.manifest.site.field_ned_ut = None;
    assert_eq!(statuses(&calibrated(&by_latitude)), "aaa");
    assert_named(&calibrated(&swapped(by_latitude, SensorKind::Mag, 2)), SensorKind::Mag, 2);
}

#[test]
fn without_a_gyroscope_either_mirrored_sensor_refuses_both() {
    let clean = without_gyroscope(tumbled(14, 5));
    assert_eq!(statuses(&calibrated(&clean)), "aa");
    for code in MIRRORS {
        for kind in [SensorKind::Acc, SensorKind::Mag] {
            let calibration = calibrated(&swapped(clean.clone(), kind, code));
            assert_eq!(statuses(&calibration), "rr", "{kind}, code {code}");
            assert_named(&calibration, kind, code);
        }
    }
}

#[test]
fn without_a_site_the_sign_of_the_dip_is_said_to_be_assumed() {
    let clean = without_site(tumbled(14, 5));
    let calibration = calibrated(&clean);
    assert_eq!(statuses(&calibration), "aaa");
    assert!(warnings(&calibration).contains("58° is assumed"), "{}", warnings(&calibration));
    for code in MIRRORS {
        // Mirrored, or mounted so: nobody can say, and the site would.
        let calibration = calibrated(&swapped(clean.clone(), SensorKind::Mag, code));
        assert_eq!(statuses(&calibration), "aar", "code {code}");
        assert_named(&calibration, SensorKind::Mag, code);
        let refused = calibration.sensor(SensorKind::Mag).and_then(|mag| mag.verdict.as_ref().err());
        assert!(
            refused.is_some_and(|refused| refused.advice.contains("add [site] latitude_deg")),
            "{refused:?}"
        );
        // The accelerometer is the odd one of three, site or not.
        assert_named(&calibrated(&swapped(clean.clone(), SensorKind::Acc, code)), SensorKind::Acc, code);
    }
}

#[test]
fn a_magnetometer_that_is_mounted_turned_is_accepted_and_said_to_be() {
    // As the AK8975 sits in an MPU-9150: y, x and z of it along x, y and −z.
    let turn = Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
    let code = imucal_host::effect::axis_swap::nearest(&turn).0;
    let calibration = calibrated(&swapped(tumbled(14, 5), SensorKind::Mag, code));
    assert_eq!(statuses(&calibration), "aaa", "{}", warnings(&calibration));
    assert!(warnings(&calibration).contains("mag_x holds +y"), "{}", warnings(&calibration));
    let plain = calibrated(&tumbled(14, 5));
    let gain = |calibration: &Calibration| {
        calibration.sensor(SensorKind::Mag).and_then(|mag| mag.accepted()).expect("accepted").triad.gain
    };
    // The gain takes it up: raw = turn · field.
    let apart = gain(&calibration) * turn - gain(&plain);
    assert!(apart.amax() < 2e-3, "{apart}");
}

#[test]
fn accelerometer_and_gyroscope_that_are_mirrored_alike_are_refused() {
    for code in [1, 16] {
        let both = swapped(swapped(tumbled(14, 5), SensorKind::Acc, code), SensorKind::Gyr, code);
        let calibration = calibrated(&both);
        assert_eq!(statuses(&calibration), "rrr", "code {code}");
        let advice = &calibration.sensors[0].verdict.as_ref().expect_err("refused").advice;
        assert!(advice.contains("both mirrored alike") && advice.contains("gyr is negated"), "{advice}");
    }
}

#[test]
fn an_accelerometer_that_reads_gravity_instead_of_force_is_refused() {
    // All axes reversed: turns do not show it, the dip does.
    let calibration = calibrated(&swapped(tumbled(14, 5), SensorKind::Acc, 7));
    assert_eq!(statuses(&calibration), "rar");
    assert_named(&calibration, SensorKind::Acc, 7);
}

#[test]
fn what_nothing_can_check_is_said() {
    let mut alone = without_gyroscope(tumbled(14, 5));
    alone.mag = None;
    let calibration = calibrated(&alone);
    assert!(
        warnings(&calibration)
            .contains("acc: this recording does not show whether its axes are negated or swapped")
    );
}

/// Real recordings, each with one sensor's axes spoilt.
#[test]
fn real_recordings_with_a_mirrored_sensor_are_refused_by_name() {
    for file in ["xsens-mti.csv.gz", "mpu9150-0.csv.gz"] {
        let Some(path) = data::real(file) else { return };
        let recording = Recording::read(&path).expect("a good recording");
        for code in [2, 16] {
            let gyr = calibrated(&swapped(recording.clone(), SensorKind::Gyr, code));
            assert_eq!(statuses(&gyr), "ar", "{file}, code {code}");
            assert_named(&gyr, SensorKind::Gyr, code);
            let acc = calibrated(&swapped(recording.clone(), SensorKind::Acc, code));
            assert_eq!(statuses(&acc), "rr", "{file}, code {code}");
            assert_named(&acc, SensorKind::Acc, code);
        }
    }
}

#[test]
fn a_mirrored_magnetometer_along_a_real_reference_is_refused_by_name() {
    let Some(path) = data::real("broad-01-undisturbed.csv.gz") else { return };
    let mut recording = Recording::read(&path).expect("a good recording");
    recording.gyr = None;
    // One row in sixteen tells it as well, in a tenth of the time.
    let every = |row: &usize| row.is_multiple_of(16);
    let rows: Vec<usize> = (0..recording.rows()).filter(every).collect();
    recording.time = rows.iter().map(|row| recording.time[*row]).collect();
    recording.reference = recording.reference.map(|all| rows.iter().map(|row| all[*row]).collect());
    for sensor in [&mut recording.acc, &mut recording.mag].into_iter().flatten() {
        sensor.values = rows.iter().map(|row| sensor.values[*row]).collect();
    }
    assert!(calibrated(&recording).sensor(SensorKind::Mag).is_some_and(|mag| mag.accepted().is_some()));
    for code in [4, 8] {
        let calibration = calibrated(&swapped(recording.clone(), SensorKind::Mag, code));
        assert_named(&calibration, SensorKind::Mag, code);
    }
}

#[test]
fn the_program_names_swapped_axes_in_table_and_json() {
    let mut bad = Bad::new();
    bad.rows.iter_mut().skip(1).for_each(|row| row.swap(GYR, GYR + 1));
    bad.calibrate().with(0).printing(&[
        "gyroscope (K9): REFUSED, implausible",
        "gyr.axis_swap",
        "gyr_x and gyr_y are swapped",
        "correct its columns",
    ]);
    let gyr = &bad.json()["sensors"]["gyr"];
    assert_eq!(gyr["reason"], "implausible");
    assert!(gyr["detail"].as_str().is_some_and(|text| text.contains("gyr_x and gyr_y are swapped")), "{gyr}");
}

/// What a session accepts of a recording, in the letters of [`statuses`]; its magnetometer in the accelerometer's axes, or `o` in its own.
fn of_a_session(recording: &Recording) -> String {
    let task = capture::task(&recording.manifest, capture::targets(recording)).expect("units");
    let session = capture::replay(recording, &task, &mut |_, _| {}).expect("a possible task");
    let (stored, _) = capture::calibration(&session, &task, recording, Date::from_days(20_000));
    let is_aligned = session.estimate(Sensor::Magnetometer).is_some_and(|mag| mag.alignment_error.is_some());
    let letter = |kind: SensorKind| match stored.triad(kind) {
        Some(_) if kind == SensorKind::Mag && !is_aligned => 'o',
        Some(_) => 'a',
        None => 'r',
    };
    SensorKind::ALL.into_iter().filter(|kind| recording.sensor(*kind).is_some()).map(letter).collect()
}

#[test]
fn a_session_refuses_a_mirrored_sensor_as_the_host_does() {
    assert_eq!(of_a_session(&tumbled(20, 5)), "aaa");
    for code in MIRRORS {
        // Next to an accelerometer that is refused, a magnetometer stays in its own axes, which depend on no other sensor.
        for (kind, expected) in [(SensorKind::Acc, "rro"), (SensorKind::Gyr, "ara"), (SensorKind::Mag, "aar")]
        {
            let swapped = swapped(tumbled(20, 5), kind, code);
            assert_eq!(of_a_session(&swapped), expected, "{kind}, code {code}");
        }
        let blind = swapped(without_site(tumbled(20, 5)), SensorKind::Mag, code);
        assert_eq!(of_a_session(&blind), "aar", "code {code}");
        let alone = swapped(without_gyroscope(tumbled(20, 5)), SensorKind::Mag, code);
        assert_eq!(of_a_session(&alone), "rr", "code {code}");
    }
    assert_eq!(of_a_session(&without_site(tumbled(20, 5))), "aaa");
    assert_eq!(of_a_session(&in_the_south(tumbled(20, 5))), "aaa");
    assert_eq!(of_a_session(&swapped(tumbled(20, 5), SensorKind::Acc, 7)), "rar");
}

#[test]
fn a_session_of_a_real_recording_refuses_a_mirrored_sensor() {
    for file in ["xsens-mti.csv.gz", "mpu9150-0.csv.gz"] {
        let Some(path) = data::real(file) else { return };
        let recording = Recording::read(&path).expect("a good recording");
        assert_eq!(of_a_session(&recording), "aa", "{file}");
        for code in [2, 16] {
            let by = |kind: SensorKind| of_a_session(&swapped(recording.clone(), kind, code));
            assert_eq!([SensorKind::Acc, SensorKind::Gyr].map(by), ["rr", "ar"], "{file}, code {code}");
        }
    }
}
