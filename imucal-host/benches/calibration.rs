//! How long a calibration takes: `imucal calibrate` by rests and by samples of a magnetometer; all of it next to the crate `imu-calib`;
//! and the fit of an accelerometer alone by the core, next to the crate `levenberg-marquardt` and to SciPy where Python has it. Prints
//! the tables of docs/performance.md; figures are ratios within one run.
//!
//! `IMUCAL_PYTHON=PROGRAM` names the Python that has SciPy, `IMUCAL_DATA` the folder of real recordings. The crates are compiled by this
//! Cargo, with their own lock files. Where one of them is missing, its column is empty, and that is said.

use std::{
    env,
    ffi::OsString,
    fmt::Write,
    fs,
    hint::black_box,
    iter,
    path::{Path, PathBuf},
    process::Command,
    time::Instant,
};

use imucal_core::{
    model::{norm::NormModel, parameterisation::UPPER_TRIANGULAR},
    observation::ShellPoint,
    solver::{LevenbergMarquardt, lm::Settings},
    triad::Triad,
};
use imucal_host::{
    recording::{Nominal, Recording, SensorKind, Triple, Unit, unit::STANDARD_GRAVITY},
    simulator::{
        SimulatedUnit, Tumble,
        random::{Purpose, Random},
        record,
    },
};
use nalgebra::{Matrix3, Vector3};

mod process;

/// Rests of a hand's recordings, and samples of clouds.
const RESTS: [usize; 4] = [30, 100, 300, 1000];
const SAMPLES: [usize; 3] = [10_000, 100_000, 1_000_000];
/// Points of a fit alone, and how often it is done; the quickest counts.
const POINTS: [(usize, usize); 3] = [(38, 300), (1000, 50), (100_000, 5)];
/// Length of what is measured, in its unit.
const LENGTH: f64 = 9.8;

fn main() {
    let folder = tempfile::tempdir().expect("a folder");
    println!("Rests of a recording at 50 Hz, `imucal calibrate`:\n");
    table("rest", &RESTS, |rests| {
        let unit = SimulatedUnit { interval: 0.02, ..SimulatedUnit::mtx() };
        let recording = record("rests.csv", &Tumble::new(rests, 1), &unit, 1);
        let path = folder.path().join("rests.csv");
        recording.write(&path).expect("room");
        (path, recording.rows())
    });
    println!("\nSamples of a magnetometer, `imucal calibrate`:\n");
    table("sample", &SAMPLES, |samples| {
        let path = folder.path().join("cloud.csv");
        cloud(&path, samples);
        (path, samples)
    });
    println!("\nAccelerometer and gyroscope, from a file to the answer, and the time of another over it:\n");
    compare_with_imu_calib(folder.path());
    println!(
        "\nAn accelerometer's nine parameters by the core in f64, and the time of others over its own:\n"
    );
    println!("| points | s | SciPy's least_squares | crate levenberg-marquardt |\n| --- | --- | --- | --- |");
    for (count, repeats) in POINTS {
        let points = points(count, 0.003, LENGTH);
        let ours = fit(&points, repeats);
        let path = written(folder.path(), &points);
        let others = [(scipy(), repeats.min(50)), (levenberg_marquardt(), repeats)];
        let ratio = |(mut program, repeats): (Command, usize)| {
            program.arg(&path).arg(LENGTH.to_string()).arg(repeats.to_string());
            seconds(program).map_or_else(|| "–".to_owned(), |theirs| format!("{:.2}", theirs / ours))
        };
        println!("| {count} | {ours:.2e} | {} |", others.map(ratio).join(" | "));
    }
}

/// Calibrates a recording of each length, which `made` gives with its rows, and prints how time grows.
fn table(what: &str, counts: &[usize], made: impl Fn(usize) -> (PathBuf, usize)) {
    println!("| {what}s | rows | s | s a {what} over that of {} | MiB |", counts[0]);
    println!("| --- | --- | --- | --- | --- |");
    let mut first = None;
    for count in counts {
        let (path, rows) = made(*count);
        let run = process::run(Command::new(env!("CARGO_BIN_EXE_imucal")).arg("calibrate").arg(&path));
        let each = run.seconds / *count as f64;
        let growth = each / *first.get_or_insert(each);
        println!("| {count} | {rows} | {:.2} | {growth:.2} | {:.0} |", run.seconds, run.mebibytes);
    }
}

/// Prints the time of `imucal calibrate` and of the crate `imu-calib` for the same files: two sensors, SI units, no gaps.
fn compare_with_imu_calib(folder: &Path) {
    let built = built("imu_calib");
    let path = folder.join("both.csv");
    println!("| recording | rows | s | crate imu-calib |\n| --- | --- | --- | --- |");
    let real = env::var_os("IMUCAL_DATA").unwrap_or_else(|| OsString::from("../../shared/data"));
    let real = Path::new(&real).join("real/xsens-mti.csv.gz");
    let recordings = iter::once(("xsens-mti".to_owned(), Recording::read(&real).map_err(|e| e.to_string())))
        .chain(RESTS.map(|rests| {
            let unit = SimulatedUnit { interval: 0.02, ..SimulatedUnit::mtx() };
            (format!("{rests} rests"), Ok(record("both.csv", &Tumble::new(rests, 1), &unit, 1)))
        }));
    for (name, recording) in recordings {
        let Ok(recording) = recording.inspect_err(|fault| eprintln!("*** SKIPPED: {name}: {fault} ***"))
        else {
            continue;
        };
        let recording = inertial(recording);
        recording.write(&path).expect("room");
        let ours = quickest(Command::new(env!("CARGO_BIN_EXE_imucal")).arg("calibrate").arg(&path));
        let gravity = recording.manifest.site.gravity().unwrap_or(STANDARD_GRAVITY).to_string();
        let theirs = built.as_ref().map(|program| quickest(Command::new(program).arg(&path).arg(&gravity)));
        let ratio = theirs.map_or_else(|| "–".to_owned(), |theirs| format!("{:.2}", theirs / ours));
        println!("| {name} | {} | {ours:.3} | {ratio} |", recording.rows());
    }
}

/// What a crate that knows accelerometers and gyroscopes alone takes of a recording.
fn inertial(recording: Recording) -> Recording {
    let Recording { name, mut manifest, time, acc, gyr, .. } = recording;
    // The default is SI.
    (manifest.units, manifest.counts) = Default::default();
    let in_si = |kind, triple: Option<Triple>| {
        triple.map(|triple| Triple { unit: Unit::si(kind), nominal: Nominal::IDENTITY, ..triple })
    };
    Recording {
        acc: in_si(SensorKind::Acc, acc),
        gyr: in_si(SensorKind::Gyr, gyr),
        ..Recording::new(name, manifest, time)
    }
}

/// Seconds of a program's quickest run of five.
fn quickest(command: &mut Command) -> f64 {
    (0..5).map(|_| process::run(command).seconds).fold(f64::INFINITY, f64::min)
}

/// Points near a sphere of a length, as a sensor with errors and noise gives them.
fn points(count: usize, noise: f64, length: f64) -> Vec<ShellPoint<f64>> {
    let mut random = Random::new(1, Purpose::Noise);
    let gain = Matrix3::new(1.01, 0.003, -0.002, 0.004, 0.99, 0.005, 0.001, -0.003, 1.02);
    let bias = Vector3::new(0.1, -0.2, 0.3) * (0.1 * length);
    (0..count)
        .map(|_| {
            let direction = random.normals().normalize() * length;
            ShellPoint { value: gain * direction + bias + random.normals() * noise, excess: 0.0 }
        })
        .collect()
}

/// A recording of a magnetometer alone.
fn cloud(path: &Path, samples: usize) {
    let mut text = "t,mag_x,mag_y,mag_z\n".to_owned();
    for (k, point) in points(samples, 0.2, 48.0).iter().enumerate() {
        let value = point.value;
        writeln!(text, "{:.2},{:.3},{:.3},{:.3}", k as f64 / 100.0, value.x, value.y, value.z).expect("text");
    }
    fs::write(path, text).expect("room");
    let manifest = "format = \"imucal-recording/1\"\n[units]\nt = \"s\"\nmag = \"uT\"\n[site]\nlatitude_deg = 39.87\nheight_m = 938.0\n";
    fs::write(path.with_extension("toml"), manifest).expect("room");
}

/// Seconds of a fit from the nominal triad, the quickest of so many.
fn fit(points: &[ShellPoint<f64>], repeats: usize) -> f64 {
    let model = NormModel { points, norm: LENGTH, form: UPPER_TRIANGULAR };
    let start = UPPER_TRIANGULAR.theta(&Triad::identity());
    let timed = |_| {
        let begun = Instant::now();
        let mut solver = LevenbergMarquardt::new(start, Settings::default());
        let report = black_box(solver.run(black_box(&model)));
        assert!(report.termination.was_successful(), "{report:?}");
        begun.elapsed().as_secs_f64()
    };
    (0..repeats).map(timed).fold(f64::INFINITY, f64::min)
}

/// The points as a file of three columns.
fn written(folder: &Path, points: &[ShellPoint<f64>]) -> PathBuf {
    let path = folder.join("points.csv");
    let lines = points.iter().map(|point| format!("{},{},{}\n", point.value.x, point.value.y, point.value.z));
    fs::write(&path, lines.collect::<String>()).expect("room");
    path
}

fn peers() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/peers")
}

/// MINPACK with numerical derivatives.
fn scipy() -> Command {
    let mut python = Command::new(env::var_os("IMUCAL_PYTHON").unwrap_or_else(|| OsString::from("python3")));
    python.arg(peers().join("norm_fit.py"));
    python
}

/// MINPACK's algorithm in Rust, with derivatives; a command that fails where the crate cannot be built.
fn levenberg_marquardt() -> Command {
    Command::new(built("levenberg_marquardt").unwrap_or_else(|| PathBuf::from("peer-levenberg-marquardt")))
}

/// A crate's program, if it can be built.
fn built(name: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["build", "--quiet", "--release", "--locked", "--target-dir"]).arg(folder);
    cargo.arg("--manifest-path").arg(peers().join(name).join("Cargo.toml"));
    let ended = cargo.output().expect("Cargo runs");
    if !ended.status.success() {
        eprintln!("*** SKIPPED: {} ***", String::from_utf8_lossy(&ended.stderr).trim());
    }
    let program = folder.join("release").join(format!("peer-{}", name.replace('_', "-")));
    ended.status.success().then_some(program)
}

/// What a program says that it took, if it runs.
fn seconds(mut program: Command) -> Option<f64> {
    match program.output() {
        Ok(ended) if ended.status.success() => String::from_utf8_lossy(&ended.stdout).trim().parse().ok(),
        Ok(ended) => {
            eprintln!("*** SKIPPED: {} ***", String::from_utf8_lossy(&ended.stderr).trim());
            None
        }
        Err(fault) => {
            eprintln!("*** SKIPPED: {}: {fault} ***", program.get_program().to_string_lossy());
            None
        }
    }
}
