//! How long `imucal diagnose` takes over nine channels at 100 Hz, reading included, and how much memory it holds: 650 s with no
//! effect and with one to three, also at 1 kHz, an hour, and four hours, these with a lever arm, too; and a robot's recording of 650 s
//! with its simulator's stream, of each machine. Times are medians of three runs. Fails above its limits, so that it needs a machine
//! with nothing else to do. `IMUCAL_BEFORE=PROGRAM` runs an older program on the same recordings and prints the ratio.

use std::{
    env,
    ffi::{OsStr, OsString},
    path::Path,
    process::{Command, ExitCode, Stdio},
    thread,
};

mod process;

/// Effects, each with those before it, in usual sizes.
const EFFECTS: [&str; 3] = ["acc.scale_quadratic=3", "mag.gimbal_hard_iron_outer=3", "gyr.temp_bias=3"];
/// An effect with which a long diagnosis holds more than with the first of these.
const LARGE: &str = "acc.lever_arm=3";
/// Machines, and the effect that their recordings have.
const ROBOTS: [&str; 3] = ["legged", "wheeled", "flying"];
const ROBOT_EFFECT: &str = "gyr.g_sensitivity=3";
/// Runs of each diagnosis.
const RUNS: usize = 3;
/// Length of a usual recording, s, its rate, Hz, and lengths of longer ones.
const USUAL: u32 = 650;
/// See [`USUAL`].
const RATE: u32 = 100;
const LONGER: [u32; 2] = [3600, 14_400];
/// Most that the diagnosis of a usual recording may take, s, and hold, MiB.
const LIMITS: (f64, f64) = (5.0, 1024.0);
/// An hour may take so many times as long.
const HOUR: f64 = 7.0;
/// Most that any may hold, MiB.
const LARGEST: f64 = 2048.0;

fn main() -> ExitCode {
    let folder = tempfile::tempdir().expect("a folder");
    let before = env::var_os("IMUCAL_BEFORE");
    let threads = thread::available_parallelism().map_or(1, usize::from);
    println!("nine channels, {threads} threads, medians of {RUNS} runs");
    let mut within = true;
    let mut usual = f64::INFINITY;
    for count in 0..=EFFECTS.len() {
        let (seconds, mebibytes) =
            measured(folder.path(), (USUAL, RATE), &EFFECTS[..count], before.as_deref());
        within &= seconds <= LIMITS.0 && mebibytes <= LIMITS.1;
        if count == 1 {
            usual = seconds;
        }
    }
    let (seconds, mebibytes) = measured(folder.path(), (USUAL, 10 * RATE), &EFFECTS[..1], before.as_deref());
    println!("        {:.1} times as long as at {RATE} Hz", seconds / usual);
    within &= mebibytes <= LARGEST;
    for length in LONGER {
        // An engine whose memory grows with the square of the length is not asked for four hours.
        let before = before.as_deref().filter(|_| length < LONGER[1]);
        let (seconds, mebibytes) = measured(folder.path(), (length, RATE), &EFFECTS[..1], before);
        println!("        {:.1} times as long as {USUAL} s", seconds / usual);
        within &= mebibytes <= LARGEST && (length > LONGER[0] || seconds <= HOUR * usual);
    }
    println!("with {LARGE}");
    within &= measured(folder.path(), (LONGER[1], RATE), &[LARGE], None).1 <= LARGEST;
    println!("with a simulator's stream at 100 Hz");
    for robot in ROBOTS {
        within &= measured_with_stream(folder.path(), robot, before.as_deref()) <= LIMITS.0;
    }
    if within { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Seconds and mebibytes of a recording of this length, s, and rate, Hz, with these effects, which are printed.
fn measured(
    folder: &Path,
    (length, rate): (u32, u32),
    effects: &[&str],
    before: Option<&OsStr>,
) -> (f64, f64) {
    let recording = folder.join("recording.csv.gz");
    simulate(&recording, (length, rate), effects);
    print!("{length:>6} s at {rate:>4} Hz, {} effects  ", effects.len());
    compared(&[&recording], before)
}

/// Seconds of a robot's recording of the usual length with its simulator's stream, which are printed.
fn measured_with_stream(folder: &Path, robot: &str, before: Option<&OsStr>) -> f64 {
    let [recording, stream] = ["real", "sim"].map(|part| folder.join(format!("{robot}-{part}.csv.gz")));
    let mut command = imucal(&this());
    command.args([
        "simulate",
        "--robot",
        robot,
        "--rate",
        "100",
        "--sim-rate",
        "100",
        "--effect",
        ROBOT_EFFECT,
    ]);
    command.arg("--duration").arg(USUAL.to_string()).arg("--out").arg(folder.join(format!("{robot}.csv.gz")));
    assert!(command.status().expect("it runs").success(), "{robot}");
    print!("{USUAL:>6} s, {robot}  ");
    compared(&[&recording, Path::new("--sim"), &stream], before).0
}

/// Seconds and mebibytes of a diagnosis, and those of an older program, which are printed.
fn compared(arguments: &[&Path], before: Option<&OsStr>) -> (f64, f64) {
    let (seconds, mebibytes) = diagnose(&this(), arguments);
    print!("{seconds:.1} s  {mebibytes:.0} MiB");
    if let Some(before) = before {
        let (other, held) = diagnose(before, arguments);
        print!("  before: {other:.1} s  {held:.0} MiB, ratio {:.2}", seconds / other);
    }
    println!();
    (seconds, mebibytes)
}

fn this() -> OsString {
    env!("CARGO_BIN_EXE_imucal").into()
}

fn imucal(program: &OsStr) -> Command {
    let mut command = Command::new(program);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    command
}

fn simulate(recording: &Path, (length, rate): (u32, u32), effects: &[&str]) {
    let mut command = imucal(&this());
    command.args(["simulate", "--programme", "mixed", "--duration"]).arg(length.to_string());
    command.arg("--rate").arg(rate.to_string());
    command.arg("--force").arg("--out").arg(recording);
    effects.iter().for_each(|effect| {
        command.args(["--effect", effect]);
    });
    assert!(command.status().expect("it runs").success(), "{effects:?}");
}

/// Seconds, the median of some runs, and mebibytes, the most.
fn diagnose(program: &OsStr, arguments: &[&Path]) -> (f64, f64) {
    let mut runs = [(); RUNS].map(|()| process::run(imucal(program).arg("diagnose").args(arguments)));
    runs.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    (runs[RUNS / 2].seconds, runs.iter().fold(0.0, |most, run| run.mebibytes.max(most)))
}
