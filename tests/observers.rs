//! What the core's observers find in samples as they arrive, against what the host finds in the whole recording.

use imucal_core::{
    observation::Rest,
    observer::{
        Sample,
        rest::{ObservedRest, RestObserver},
    },
    triad::Triad,
};
use imucal_host::{
    calibrate::{Options, acc::rests, calibrate},
    recording::{Recording, SensorKind, check::integrity, unit::STANDARD_GRAVITY},
};
use imucal_tests::data;
use nalgebra::Vector3;

fn read(name: &str) -> Option<Recording> {
    Some(Recording::read(&data::real(name)?).expect("a good recording"))
}

/// The rests that a device sees: single precision, sample by sample.
fn observed(recording: &Recording) -> Vec<ObservedRest<f32>> {
    let integrity = integrity::inspect(recording);
    let usable =
        |kind: SensorKind, row: usize| integrity.sensor(kind).is_none_or(|sensor| sensor.usable[row]);
    let value = |kind: SensorKind, row: usize| -> Option<Vector3<f32>> {
        let missed = Vector3::repeat(f32::NAN);
        let value = recording.sensor(kind)?.values[row].cast();
        Some(if usable(kind, row) { value } else { missed })
    };
    let mut observer = RestObserver::default();
    let mut rests = Vec::new();
    for (row, time) in recording.time.iter().enumerate() {
        let temperature = recording.temperature.as_ref().map(|rows| rows[row] as f32);
        let acc = value(SensorKind::Acc, row).expect("an accelerometer");
        let time = ((time - recording.time[0]) * 1e6).round() as u64;
        rests.extend(observer.push(&Sample { time, acc, gyr: value(SensorKind::Gyr, row), temperature }));
    }
    rests.extend(observer.finish());
    // Those that a quieter window, which came later, shows to be none.
    let most = observer.threshold().expect("windows");
    rests.retain(|rest| rest.noise <= most);
    rests
}

fn wide(rests: &[ObservedRest<f32>], recording: &Recording) -> Vec<Rest<f64>> {
    // The means are what a fit takes; spread and time are not used here.
    let of = |rest: &ObservedRest<f32>| {
        let mut wide = Rest { time: f64::from(rest.rest.time) + recording.time[0], ..Rest::default() };
        wide.acc.push(&rest.rest.acc.mean().cast());
        wide
    };
    rests.iter().map(of).collect()
}

/// Largest difference of two calibrations in standard errors of the first.
fn apart(own: &Triad<f64>, other: &Triad<f64>, std: (nalgebra::Matrix3<f64>, Vector3<f64>)) -> f64 {
    let gains = own.gain.iter().zip(other.gain.iter()).zip(std.0.iter());
    let biases = own.bias.iter().zip(other.bias.iter()).zip(std.1.iter());
    gains
        .chain(biases)
        .filter(|(_, std)| **std > 0.0)
        .map(|((own, other), std)| (own - other).abs() / std)
        .fold(0.0, f64::max)
}

#[test]
fn an_accelerometer_s_calibration_from_observed_rests_is_within_its_errors_of_the_host_s() {
    for name in ["xsens-mti.csv.gz", "mpu9150-0.csv.gz", "mpu9150-1.csv.gz"] {
        let Some(recording) = read(name) else { return };
        let calibration = calibrate(&recording, &Options::default(), &|_| {});
        let host =
            calibration.sensor(SensorKind::Acc).and_then(|outcome| outcome.accepted()).expect("accepted");
        let rests = observed(&recording);
        let gravity = recording.manifest.site.gravity().unwrap_or(STANDARD_GRAVITY);
        let (triad, rms) = rests::trial(&wide(&rests, &recording), gravity).expect("enough rests");
        let found = calibration.segmentation.as_ref().expect("rests").rests.len();
        let off = apart(&host.triad, &triad, (host.gain_std, host.bias_std));
        println!(
            "{name}: {} rests, the host {found}; rms {rms:.6}; {off:.2} standard errors apart",
            rests.len()
        );
        assert!(rests.len().abs_diff(found) <= 4 && off < 1.0, "{name}: {off}");
    }
}
