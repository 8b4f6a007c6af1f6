//! Real recordings along an optical reference with positions: the accelerometer follows the position's second derivative, and
//! what a hand or a room does is not taken for an effect of a sensor.

use std::sync::OnceLock;

use imucal_host::{
    diagnosis::{Diagnosis, Options, Verdict, diagnose},
    effect::class::class,
    recording::Recording,
};
use imucal_tests::{data, golden, part::part};
use serde_json::Value;

/// Recordings with positions.
const PLACED: [&str; 3] = ["broad-02-rotation", "broad-10-translation", "broad-24-tapping"];

/// Each is made once.
static DIAGNOSES: [OnceLock<Diagnosis>; 3] = [const { OnceLock::new() }; 3];

fn read(name: &str) -> Option<Recording> {
    Some(Recording::read(&data::real(&format!("{name}.csv.gz"))?).expect("a good recording"))
}

fn diagnosed(at: usize) -> Option<&'static Diagnosis> {
    let recording = read(PLACED[at])?;
    Some(DIAGNOSES[at].get_or_init(|| diagnose(&recording, &Options::default(), &|_| ())))
}

fn names(diagnosis: &Diagnosis) -> Vec<&str> {
    diagnosis.causes.iter().map(|cause| cause.effect.as_str()).collect()
}

#[test]
fn the_accelerometer_follows_the_position_to_a_quarter_of_a_metre_per_second_squared() {
    for (at, name) in PLACED.iter().enumerate().take(2) {
        let Some(diagnosis) = diagnosed(at) else { return };
        let gaps: Vec<f64> =
            diagnosis.gap.iter().filter(|gap| gap.sensor == "acc").map(|gap| gap.rms_after).collect();
        println!("{name} acc {gaps:.3?} m/s^2 {:?}", names(diagnosis));
        assert!(gaps.len() == 3 && gaps.iter().all(|gap| *gap < 0.25), "{name}: {gaps:?}");
        assert_ne!(diagnosis.verdict, Verdict::NotTestable);
    }
}

#[test]
fn an_arm_is_found_where_the_position_confirms_it_and_nothing_of_the_magnetometer() {
    for (at, name) in PLACED.iter().enumerate() {
        let Some(diagnosis) = diagnosed(at) else { return };
        let found = names(diagnosis);
        assert!(found.iter().any(|id| class(id) == "acc.lever_arm"), "{name}: {found:?}");
        assert!(found.iter().all(|id| !id.starts_with("mag.")), "{name}: {found:?}");
        // The chips were read 4 ms apart from the cameras.
        assert!(found.contains(&"clk.time_offset"), "{name}: {found:?}");
    }
}

/// Values and standard errors of the arm that a diagnosis asserts, m.
fn arm(diagnosis: &Diagnosis) -> [(f64, f64); 3] {
    let cause = diagnosis.causes.iter().find(|cause| class(&cause.effect) == "acc.lever_arm");
    let amounts = &cause.expect("an arm").parameters;
    [0, 1, 2].map(|axis| (amounts[axis].value.expect("known"), amounts[axis].std_error.expect("known")))
}

/// The unit lay otherwise on the board from one of these recordings to another: at rest it leans by up to 2.6°, and the arms
/// differ by millimetres in every band and in either half. Each is compared with an estimate of its own.
#[test]
fn the_arms_are_those_of_an_independent_fit_within_their_errors() {
    let golden = golden::golden("lever_arm_broad");
    for (at, name) in PLACED.iter().enumerate() {
        let Some(diagnosis) = diagnosed(at) else { return };
        let bands = golden[name]["bands"].as_array().expect("bands");
        let of = |band: &Value, what: &str, axis: usize| band[what][axis].as_f64().expect("a number");
        for (axis, (value, error)) in arm(diagnosis).into_iter().enumerate() {
            let (theirs, std) = (of(&bands[0], "arm_m", axis), of(&bands[0], "std_m", axis));
            // What the cameras are off by goes with the frequency: no block of time shows it.
            let each = || bands.iter().map(|band| of(band, "arm_m", axis));
            let spread = 0.5 * (each().fold(f64::MIN, f64::max) - each().fold(f64::MAX, f64::min));
            let all = (error * error + std * std + spread * spread).sqrt();
            println!(
                "{name} {axis}: {value:.5} ± {error:.5}, theirs {theirs:.5} ± {std:.5}, bands ± {spread:.5}"
            );
            assert!((value - theirs).abs() < 3.0 * all, "{name} {axis}: {value} for {theirs}, {all}");
        }
    }
}

/// Half a recording is sure of its arm by up to twice too much: errors of the cameras last longer than the parts of a jackknife.
#[test]
#[ignore = "minutes"]
fn the_arms_of_both_halves_agree_within_twice_their_errors() {
    let (mut square, mut count) = (0.0, 0.0);
    for name in PLACED {
        let Some(recording) = read(name) else { return };
        let middle = recording.rows() / 2;
        let halves = [0..middle, middle..recording.rows()]
            .map(|rows| arm(&diagnose(&part(&recording, rows), &Options::default(), &|_| ())));
        for (early, late) in halves[0].iter().zip(halves[1]) {
            square += (early.0 - late.0).powi(2) / (early.1 * early.1 + late.1 * late.1);
            count += 1.0;
        }
        println!("{name} {halves:.5?}");
    }
    println!("{square:.1} of {count}");
    assert!(square < 4.0 * count, "{square} of {count}");
}

#[test]
fn taps_are_passages_and_no_effects() {
    let Some(diagnosis) = diagnosed(2) else { return };
    let allowed = ["acc.stuck_samples", "gyr.stuck_samples", "clk.time_offset"];
    for id in names(diagnosis) {
        assert!(allowed.contains(&id) || class(id) == "acc.lever_arm", "{id}");
    }
}

#[test]
fn without_the_position_no_arm_is_asserted() {
    for name in ["broad-01-undisturbed", "broad-02-rotation"] {
        let Some(mut recording) = read(name) else { return };
        recording.position = None;
        let diagnosis = diagnose(&recording, &Options::default(), &|_| ());
        let found = names(&diagnosis);
        assert!(found.iter().all(|id| class(id) != "acc.lever_arm"), "{found:?}");
        // Nothing disturbs these recordings; what would bend a gyroscope by gravity in one does not in the other.
        assert!(found.iter().all(|id| !id.starts_with("gyr.") || *id == "gyr.stuck_samples"), "{found:?}");
        let because = diagnosis.not_testable.iter().find(|effect| effect.effect == "acc.lever_arm");
        assert!(because.is_some_and(|why| why.because.contains("linear acceleration")), "{because:?}");
    }
}
