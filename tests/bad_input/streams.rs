//! A simulator's stream, or a reference's pose, that holds something else than it should: each is refused or reported in words
//! that name what was found and what to do, and nothing of it is taken for an effect of a sensor.

use std::{f64::consts::PI, fs, path::Path, sync::OnceLock};

use imucal_host::{
    diagnosis::{Diagnosis, Options, Verdict, diagnose},
    recording::{Simulated, Stream},
    simulator::robot::{RobotKind, RobotPair, RobotScene},
};
use imucal_tests::{
    program::{self, Ended},
    simulated,
};
use nalgebra::{Matrix3, Rotation3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// A flying robot and its simulator's stream, without a fault.
fn pair() -> &'static RobotPair {
    static PAIR: OnceLock<RobotPair> = OnceLock::new();
    PAIR.get_or_init(|| {
        let scene =
            RobotScene { kind: RobotKind::Flying, duration: 60.0, real_rate: 100.0, ..RobotScene::default() };
        scene.record("flight").expect("a scene")
    })
}

fn diagnosed(spoil: impl Fn(&mut Stream)) -> Diagnosis {
    let mut stream = Stream::of_pair(&pair().simulated, &pair().real).expect("a stream");
    spoil(&mut stream);
    diagnose(&pair().real, &Options { stream: Some(stream), ..Options::default() }, &|_| ())
}

fn each(values: &mut Option<Vec<Vector3<f64>>>, change: impl Fn(&Vector3<f64>) -> Vector3<f64>) {
    values.iter_mut().flatten().for_each(|value| *value = change(value));
}

/// Some of the samples.
fn thin(stream: &mut Stream, of: usize) {
    let rows: Vec<usize> = (0..stream.time.len()).step_by(of).collect();
    stream.time = rows.iter().map(|row| stream.time[*row]).collect();
    stream.values = Simulated::at(&stream.values, &rows);
}

#[track_caller]
fn assert_refused(diagnosis: &Diagnosis, words: &[&str]) {
    assert_eq!(diagnosis.verdict, Verdict::NotTestable, "{:?}", diagnosis.causes);
    words
        .iter()
        .for_each(|word| assert!(diagnosis.remarks[0].contains(word), "{word}: {:?}", diagnosis.remarks));
}

/// Nothing but `names` is asserted, and a remark has all of the words.
#[track_caller]
fn assert_reported(diagnosis: &Diagnosis, names: &[&str], words: &[&str]) {
    let found: Vec<&str> = diagnosis.causes.iter().map(|cause| cause.effect.as_str()).collect();
    assert_eq!(found, names, "{:?}", diagnosis.remarks);
    let has_all = |remark: &String| words.iter().all(|word| remark.contains(word));
    assert!(diagnosis.remarks.iter().any(has_all), "{words:?} in {:?}", diagnosis.remarks);
}

#[test]
fn the_pair_that_the_others_are_made_of_is_good() {
    let diagnosis = diagnosed(|_| ());
    assert_eq!((diagnosis.verdict, diagnosis.causes.len()), (Verdict::None, 0));
}

#[test]
fn coordinate_acceleration_is_no_specific_force() {
    let diagnosis = diagnosed(|stream| {
        // Gravity is a constant of the levelled frame: what the machine has on average, in its axes at rest, is removed.
        let gravity = stream.values.acc.as_ref().expect("there")[0];
        let rates = stream.values.gyr.clone().expect("there");
        let mut attitude = Matrix3::identity();
        let times = stream.time.clone();
        for (row, value) in stream.values.acc.iter_mut().flatten().enumerate() {
            *value -= attitude.tr_mul(&gravity);
            let step = times.get(row + 1).map_or(0.0, |next| next - times[row]);
            attitude *= Rotation3::new(rates[row] * step).into_inner();
        }
    });
    assert_refused(&diagnosis, &["coordinate acceleration instead of specific force", "subtract gravity"]);
}

#[test]
fn another_unit_is_named_with_where_to_write_it() {
    let degrees = diagnosed(|stream| each(&mut stream.values.gyr, |rate| rate * 57.3));
    assert_refused(&degrees, &["simulated gyr", "deg/s instead of rad/s", "[units]"]);
    for (factor, unit) in [(1.0 / 9.80665, "looks like g "), (1000.0 / 9.80665, "looks like mg ")] {
        let scaled = diagnosed(|stream| each(&mut stream.values.acc, |force| force * factor));
        assert_refused(&scaled, &["simulated acc", unit, "about 9.8"]);
    }
    for (factor, unit) in [(0.01, "looks like G "), (1000.0, "looks like nT ")] {
        let scaled = diagnosed(|stream| each(&mut stream.values.mag, |field| field * factor));
        assert_refused(&scaled, &["simulated mag", unit, "20 to 70"]);
    }
}

#[test]
fn frames_with_y_or_z_up_are_turned_axes() {
    let y_up = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0);
    for (turn, words) in [(y_up, "y up"), (Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0)), "z up")] {
        let diagnosis = diagnosed(|stream| {
            let Simulated { acc, gyr, mag, .. } = &mut stream.values;
            [acc, gyr, mag].into_iter().for_each(|values| each(values, |value| turn * value));
        });
        assert_reported(
            &diagnosis,
            &["acc.axis_swap", "gyr.axis_swap", "mag.axis_swap"],
            &["right angle", words],
        );
        assert_eq!(diagnosis.verdict, Verdict::Explained);
    }
}

#[test]
fn a_left_handed_frame_and_reversed_gravity_are_reported() {
    let mirror = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, 1.0));
    let mirrored = diagnosed(|stream| {
        each(&mut stream.values.acc, |force| mirror * force);
        // Rates and fields are axial.
        each(&mut stream.values.gyr, |rate| -mirror * rate);
        each(&mut stream.values.mag, |field| -mirror * field);
    });
    assert!(mirrored.remarks.iter().any(|remark| remark.contains("left-handed")), "{:?}", mirrored.remarks);
    let reversed = diagnosed(|stream| each(&mut stream.values.acc, |force| -force));
    assert_reported(&reversed, &["acc.axis_swap"], &["gravity minus acceleration"]);
}

#[test]
fn an_oblique_mount_is_reported_and_estimated() {
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), 0.5);
    let diagnosis = diagnosed(|stream| {
        let Simulated { acc, gyr, mag, .. } = &mut stream.values;
        [acc, gyr, mag].into_iter().for_each(|values| each(values, |value| turn * value));
    });
    assert_reported(&diagnosis, &[], &["turned against the simulator's axes by 2", "mounting"]);
}

#[test]
fn noise_and_steps_of_the_stream_are_reported() {
    let noisy = diagnosed(|stream| {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut add = |values: &mut Option<Vec<Vector3<f64>>>, size: f64| {
            let normal = Normal::new(0.0, size).expect("a size");
            values.iter_mut().flatten().for_each(|value| {
                *value += Vector3::from_fn(|_, _| normal.sample(&mut random));
            });
        };
        add(&mut stream.values.gyr, 0.003);
        add(&mut stream.values.mag, 0.2);
    });
    assert_reported(&noisy, &[], &["noise of its own", "gyr", "before the simulator's noise model"]);
    assert_reported(&noisy, &[], &["the mag is left out"]);
    let stepped =
        diagnosed(|stream| each(&mut stream.values.gyr, |rate| rate.map(|w| (w / 0.012).round() * 0.012)));
    assert_reported(&stepped, &[], &["rounded to steps", "gyr 1.20e-2 rad/s", "more digits"]);
}

#[test]
fn a_stream_that_is_too_slow_or_repeats_its_values_is_reported() {
    let slow = diagnosed(|stream| thin(stream, 20));
    let left_out = slow.remarks.iter().filter(|remark| remark.contains("10 samples a second"));
    assert!(left_out.count() > 0 && slow.causes.is_empty(), "{:?} {:?}", slow.remarks, slow.causes);
    let held = diagnosed(|stream| {
        let Simulated { acc, gyr, mag, .. } = &mut stream.values;
        for values in [acc, gyr, mag].into_iter().flatten() {
            (0..values.len()).for_each(|row| values[row] = values[row / 4 * 4]);
        }
    });
    assert_reported(&held, &[], &["stands in 4 rows", "at their own rate"]);
}

#[test]
fn streams_that_share_no_time_or_movement_are_refused() {
    let short = diagnosed(|stream| {
        stream.time.truncate(2000);
        stream.values = Simulated::at(&stream.values, &(0..2000).collect::<Vec<_>>());
    });
    assert_refused(&short, &["lasts 10.0 s", "simulate the movement of this recording"]);
    let other = diagnosed(|stream| {
        let rows: Vec<usize> = (0..stream.time.len()).map(|row| (row * 7919) % stream.time.len()).collect();
        stream.values = Simulated::at(&stream.values, &rows);
    });
    assert_refused(&other, &["does not follow", "at any lag"]);
    let in_milliseconds = diagnosed(|stream| stream.time.iter_mut().for_each(|time| *time *= 1e3));
    assert_refused(&in_milliseconds, &["look like milliseconds", "[units]"]);
}

#[test]
fn a_sensor_that_is_late_in_the_stream_is_no_filter_of_no_size() {
    let late = diagnosed(|stream| {
        let acc = stream.values.acc.as_mut().expect("a stream of it");
        let rows = acc.len();
        acc.copy_within(0..rows - 4, 4);
    });
    assert_reported(&late, &[], &["the opposite of acc.bandwidth", "late in the simulator"]);
    assert_eq!(late.verdict, Verdict::Unknown);
}

/// What an arm is given that holds the unit on its side for 70 s, then upright: specific force, rate and field.
fn put_upright(t: f64) -> [Vector3<f64>; 3] {
    let on_side = |t: f64| 0.25 * PI * (1.0 + (PI * ((t - 70.0) / 4.0).clamp(0.0, 1.0)).cos());
    let attitude = |t: f64| {
        let pitch = Rotation3::from_axis_angle(&Vector3::y_axis(), on_side(t) + 0.3 * (1.1 * t).sin());
        pitch * Rotation3::from_axis_angle(&Vector3::x_axis(), 0.3 * (0.7 * t).sin())
    };
    let step = 1e-5;
    let rate = (attitude(t - step).inverse() * attitude(t + step)).scaled_axis() / (2.0 * step);
    let seen = |of: Vector3<f64>| attitude(t).inverse() * of;
    [seen(Vector3::new(0.0, 0.0, -9.80665)), rate, seen(Vector3::new(25.0, 2.0, 40.0))]
}

#[test]
fn a_stream_that_begins_late_shows_no_other_axes() {
    let real = simulated::recorded(100.0, put_upright);
    let time: Vec<f64> = (0..2600).map(|row| 74.0 + 0.01 * f64::from(row)).collect();
    let of = |sensor: usize| Some(time.iter().map(|t| put_upright(*t)[sensor]).collect::<Vec<_>>());
    let values = Simulated { acc: of(0), gyr: of(1), mag: of(2), ..Simulated::default() };
    let stream = Stream { name: "arm".to_owned(), time: time.clone(), values };
    let diagnosis = diagnose(&real, &Options { stream: Some(stream), ..Options::default() }, &|_| ());
    let swaps = diagnosis.causes.iter().filter(|cause| cause.effect.ends_with("axis_swap")).count();
    assert!(diagnosis.verdict != Verdict::NotTestable && swaps == 0, "{:?}", diagnosis.causes);
}

#[test]
fn a_stream_of_one_sensor_is_compared_with_that_alone() {
    let nothing = |values: &mut Option<Vec<Vector3<f64>>>| each(values, |_| Vector3::repeat(f64::NAN));
    let diagnosis = diagnosed(|stream| {
        nothing(&mut stream.values.acc);
        nothing(&mut stream.values.mag);
        stream.values = std::mem::take(&mut stream.values).without_empty();
    });
    assert_reported(&diagnosis, &[], &["the acc is left out: the simulator gives no stream of it"]);
}

/// Runs `imucal diagnose` on the pair written to a folder, the stream's file with another header.
fn run(folder: &Path, header: impl Fn(&str) -> String, more: &[&str]) -> Ended {
    let path = |name: &str| folder.join(name);
    if !path("real.csv").exists() {
        pair().real.write(&path("real.csv")).expect("the folder takes files");
        pair().simulated.write(&path("plain.csv")).expect("the folder takes files");
    }
    let text = fs::read_to_string(path("plain.csv")).expect("text");
    let (first, rows) = text.split_once('\n').expect("a header");
    fs::write(path("sim.csv"), format!("{}\n{rows}", header(first))).expect("the folder takes files");
    fs::copy(path("plain.toml"), path("sim.toml")).expect("a manifest");
    let (real, sim) = (path("real.csv").display().to_string(), path("sim.csv").display().to_string());
    let line = ["diagnose", &real, "--sim", &sim];
    program::run(env!("CARGO_BIN_EXE_imucal-under-test"), &[], &[&line[..], more].concat())
}

#[test]
fn one_of_several_streams_is_chosen_by_its_topic() {
    let folder = tempfile::tempdir().expect("there is room for a folder");
    let named = |header: &str| header.replace("sim_", "sim_torso_");
    run(folder.path(), named, &["--sim-topic", "torso"]).with(0).printing(&["NO GAP"]);
    let unknown = run(folder.path(), named, &["--sim-topic", "foot"]);
    unknown.with(2).telling(&["no topic `foot`, expected one of torso"]);
    run(folder.path(), named, &[]).with(2).telling(&["choose a topic with --sim-topic: torso"]);
    run(folder.path(), str::to_owned, &["--sim-topic", "torso"]).with(2).telling(&["leave --sim-topic out"]);
}

#[test]
fn a_stream_of_another_sensor_ends_with_the_status_of_a_refusal() {
    let folder = tempfile::tempdir().expect("there is room for a folder");
    // Each of two sensors under the name of the other.
    let swapped = |header: &str| {
        header.replace("sim_acc", "sim_tmp").replace("sim_mag", "sim_acc").replace("sim_tmp", "sim_mag")
    };
    run(folder.path(), swapped, &[]).with(1).printing(&["simulated acc reads 4", "sim_acc_*"]);
}
