//! What a session on a device makes of raw samples, against what the host makes of the whole recording.

use imucal_core::{record::Sensor, session::estimate::Estimate, triad::Triad};
use imucal_host::{
    calibrate::{Calibration, Options, calibrate, outcome::FitSummary},
    capture::{self, Capture},
    recording::{Recording, SensorKind},
};
use imucal_tests::{data, simulated};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

fn read(name: &str) -> Option<Recording> {
    Some(Recording::read(&data::real(name)?).expect("a good recording"))
}

/// A session over a whole recording.
fn session(recording: &Recording) -> Box<Capture> {
    let task = capture::task(&recording.manifest, capture::targets(recording)).expect("units");
    capture::replay(recording, &task, &mut |_, _| {}).expect("figures that can be")
}

/// Differences of gain and bias in standard errors of the device.
fn apart(device: &Estimate, host: &Triad<f64>) -> Vec<f64> {
    let pairs = |own: &[f32], std: &[f32], other: &[f64]| -> Vec<f64> {
        let all = own.iter().zip(std).zip(other).filter(|((_, std), _)| **std > 0.0);
        all.map(|((own, std), other)| (f64::from(*own) - other) / f64::from(*std)).collect()
    };
    let mut all = pairs(device.triad.gain.as_slice(), device.std.gain.as_slice(), host.gain.as_slice());
    all.extend(pairs(device.triad.bias.as_slice(), device.std.bias.as_slice(), host.bias.as_slice()));
    all
}

/// Share of some differences that are at most so large, and their number.
fn within<'a>(sessions: impl Iterator<Item = &'a [f64]>, most: f64) -> (f64, usize) {
    let all: Vec<f64> = sessions.flatten().copied().collect();
    (all.iter().filter(|off| off.abs() <= most).count() as f64 / all.len() as f64, all.len())
}

/// A gain without its rotation: the upper triangular one of the same length of every vector.
fn without_rotation(triad: &Triad<f64>) -> Triad<f64> {
    let r = triad.gain.qr().r();
    let signs = Matrix3::from_diagonal(&r.diagonal().map(f64::signum));
    Triad { gain: signs * r, bias: triad.bias }
}

/// The fit that the host accepts, with suspicions or without.
fn fit(calibration: &Calibration, kind: SensorKind) -> Option<&FitSummary> {
    calibration.sensor(kind).and_then(|outcome| outcome.passed())
}

/// Differences of one sensor in standard errors of the device, where both accept it. They must agree on that.
fn compared(name: &str, calibration: &Calibration, device: &Capture, kind: SensorKind) -> Vec<f64> {
    let sensor = Sensor::ALL[kind as usize];
    let host = fit(calibration, kind);
    let own = device.estimate(sensor).filter(|estimate| estimate.verdict.is_ok());
    assert_eq!(host.is_some(), own.is_some(), "{name}, {kind:?}: {:?}", device.estimate(sensor));
    let (Some(host), Some(own)) = (host, own) else { return Vec::new() };
    let triad = if kind == SensorKind::Mag { without_rotation(&host.triad) } else { host.triad };
    let apart = apart(own, &triad);
    let within = apart.iter().filter(|off| off.abs() <= 1.0).count();
    let most = apart.iter().fold(0.0, |most: f64, off| most.max(off.abs()));
    println!("{name}, {kind:?}: {within} of {} within one standard error, {most:.2} at most", apart.len());
    apart
}

#[test]
fn a_session_s_accelerometer_and_gyroscope_are_the_host_s_within_a_standard_error() {
    let mut all = Vec::new();
    for name in ["xsens-mti.csv.gz", "mpu9150-0.csv.gz", "mpu9150-1.csv.gz"] {
        let Some(recording) = read(name) else { return };
        let calibration = calibrate(&recording, &Options::default(), &|_| {});
        let device = session(&recording);
        let found = calibration.segmentation.as_ref().expect("rests").rests.len();
        println!("{name}: {} rests, the host {found}", device.guide().rests);
        assert!(device.poses().list().len().abs_diff(found) <= 4, "{name}");
        for kind in [SensorKind::Acc, SensorKind::Gyr] {
            all.extend(compared(name, &calibration, &device, kind));
        }
    }
    let within = all.iter().filter(|off| off.abs() <= 1.0).count();
    println!("{within} of {} parameters within one standard error", all.len());
    assert!(all.len() == 63 && within as f64 >= 0.95 * all.len() as f64, "{all:.2?}");
}

/// The recording with nothing but its magnetometer: what is fitted is the cloud alone.
fn cloud_alone(recording: &Recording) -> Recording {
    let mut alone = Recording::new("cloud.csv", recording.manifest.clone(), recording.time.clone());
    alone.mag = recording.mag.clone();
    alone
}

#[test]
fn a_session_accepts_and_refuses_clouds_as_the_host_does() {
    // Where the host suspects a cloud to be no ellipsoid (those of broad), the two need not agree.
    for name in ["px4-mag.csv", "hamagure-mag-2.csv.gz"] {
        let Some(recording) = read(name) else { return };
        let recording = cloud_alone(&recording);
        let calibration = calibrate(&recording, &Options::default(), &|_| {});
        let device = session(&recording);
        let apart = compared(name, &calibration, &device, SensorKind::Mag);
        // Of 64 slots instead of all samples: apart by what the device itself states, and not by the host's errors.
        let square = apart.iter().map(|off| off * off).sum::<f64>() / apart.len().max(1) as f64;
        assert!(square.sqrt() < 2.0, "{name}: {apart:.2?}");
    }
}

#[test]
fn a_session_refuses_what_cannot_be_observed() {
    let Some(recording) = read("mpu6050-unobservable.csv.gz") else { return };
    let device = session(&recording);
    let accepted = device.guide().accepted;
    println!("{:?}", device.guide());
    assert_eq!(accepted, [false; 3]);
}

/// Gain and bias of a simulated sensor, nominal SI in.
fn truth(kind: SensorKind) -> Triad<f64> {
    let unit = simulated::unit();
    let sensor = unit.sensor(kind);
    let (truth, counts) = (sensor.truth, sensor.counts);
    Triad {
        gain: truth.gain * counts.per_unit,
        bias: (truth.bias - Vector3::repeat(counts.offset)) / counts.per_unit,
    }
}

#[test]
fn a_hundred_simulated_sessions_agree_with_the_host_and_their_intervals_cover() {
    // In the axes of the accelerometer's upper triangular gain.
    let acc = truth(SensorKind::Acc);
    let turned = without_rotation(&acc).gain * acc.gain.try_inverse().expect("regular");
    let truths = [without_rotation(&acc), {
        let gyr = truth(SensorKind::Gyr);
        Triad { gain: turned * gyr.gain, bias: gyr.bias }
    }];
    let sessions: Vec<[Vec<f64>; 4]> = (0..100u64)
        .into_par_iter()
        .map(|seed| {
            let recording = simulated::tumbled(20, 1000 + 7 * seed);
            let calibration = calibrate(&recording, &Options::default(), &|_| {});
            let device = session(&recording);
            let mut all = [const { Vec::new() }; 4];
            for (k, kind) in [SensorKind::Acc, SensorKind::Gyr].into_iter().enumerate() {
                let own = device.estimate(Sensor::ALL[k]).filter(|own| own.verdict.is_ok());
                let host = fit(&calibration, kind);
                assert_eq!(own.is_some(), host.is_some(), "seed {seed}, {kind:?}");
                let (Some(own), Some(host)) = (own, host) else { continue };
                all[k] = apart(own, &host.triad);
                all[2 + k] = apart(own, &truths[k]);
            }
            all
        })
        .collect();
    let share = |k: usize, most: f64| within(sessions.iter().map(|session| session[k].as_slice()), most);
    for (k, kind) in [SensorKind::Acc, SensorKind::Gyr].into_iter().enumerate() {
        let ((near, count), (covered, _)) = (share(k, 1.0), share(2 + k, 1.96));
        println!(
            "{kind:?}: {:.1} % of {count} within a standard error of the host's, intervals cover {:.1} %",
            100.0 * near,
            100.0 * covered
        );
        assert!(near >= 0.95 && (0.93..0.97).contains(&covered), "{kind:?}: {near}, {covered}");
    }
}

#[test]
fn a_session_s_magnetometer_lies_as_the_host_s_does_and_its_intervals_cover() {
    let acc = truth(SensorKind::Acc);
    let turned = without_rotation(&acc).gain * acc.gain.try_inverse().expect("regular");
    let mag = truth(SensorKind::Mag);
    // A session does not know the field's length: its gain has determinant 1.
    let in_gauge = |triad: Triad<f64>| Triad { gain: triad.gain / triad.gain.determinant().cbrt(), ..triad };
    let own = in_gauge(Triad { gain: turned * mag.gain, bias: mag.bias });
    let sessions: Vec<[Vec<f64>; 2]> = (0..50u64)
        .into_par_iter()
        .map(|seed| {
            let recording = simulated::tumbled(24, 4000 + 7 * seed);
            let calibration = calibrate(&recording, &Options::default(), &|_| {});
            let device = session(&recording);
            let host = fit(&calibration, SensorKind::Mag).expect("accepted");
            let estimate = device.estimate(Sensor::Magnetometer).expect("an estimate");
            assert!(host.alignment.is_some() && estimate.alignment_error.is_some(), "seed {seed}");
            [apart(estimate, &in_gauge(host.triad)), apart(estimate, &own)]
        })
        .collect();
    for (k, of, least) in [(0, "the host's", 0.95), (1, "the truth", 0.93)] {
        let (share, count) = within(sessions.iter().map(|session| session[k].as_slice()), 1.96);
        println!("Mag: {:.1} % of {count} within 1.96 standard errors of {of}", 100.0 * share);
        assert!(share >= least, "{of}: {share}");
    }
}
