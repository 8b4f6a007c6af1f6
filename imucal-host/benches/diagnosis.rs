//! How long `imucal diagnose` takes over 650 s of nine channels at 100 Hz, reading included, and how much memory it holds:
//! with no effect and with one to three. Fails above 5 s or 1 GiB, so that it wants a machine with nothing else to do.

use std::{
    path::Path,
    process::{Child, Command, ExitCode, Stdio},
    thread,
    time::{Duration, Instant},
};

/// Most that a diagnosis may take, s.
const LONGEST: f64 = 5.0;
/// Most that it may hold, MiB.
const LARGEST: f64 = 1024.0;
/// Effects, each with those before it, in usual sizes.
const EFFECTS: [&str; 3] = ["acc.scale_quadratic=3", "mag.gimbal_hard_iron_outer=3", "gyr.temp_bias=3"];

fn main() -> ExitCode {
    let folder = tempfile::tempdir().expect("a folder");
    let threads = thread::available_parallelism().map_or(1, usize::from);
    println!("650 s at 100 Hz, nine channels, {threads} threads");
    let mut within = true;
    for count in 0..=EFFECTS.len() {
        let recording = folder.path().join(format!("{count}.csv.gz"));
        simulate(&recording, &EFFECTS[..count]);
        let (seconds, mebibytes) = diagnose(&recording);
        println!("{count} effects  {seconds:.1} s  {mebibytes:.0} MiB");
        within &= seconds <= LONGEST && mebibytes <= LARGEST;
    }
    if within { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn imucal() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_imucal"));
    command.stdout(Stdio::null()).stderr(Stdio::null());
    command
}

fn simulate(recording: &Path, effects: &[&str]) {
    let mut command = imucal();
    command.args(["simulate", "--programme", "mixed", "--duration", "650", "--out"]).arg(recording);
    effects.iter().for_each(|effect| {
        command.args(["--effect", effect]);
    });
    assert!(command.status().expect("it runs").success(), "{effects:?}");
}

/// Seconds and mebibytes.
fn diagnose(recording: &Path) -> (f64, f64) {
    let start = Instant::now();
    let mut child = imucal().arg("diagnose").arg(recording).spawn().expect("it runs");
    let mut most = 0.0;
    loop {
        most = held(&child).unwrap_or(most);
        if let Some(status) = child.try_wait().expect("it was started") {
            assert!(status.success(), "{status}");
            return (start.elapsed().as_secs_f64(), most);
        }
        thread::sleep(Duration::from_millis(10));
    }
}

/// The most memory that a program has held so far, MiB, where the system tells.
fn held(child: &Child) -> Option<f64> {
    let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kibibytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kibibytes / 1024.0)
}
