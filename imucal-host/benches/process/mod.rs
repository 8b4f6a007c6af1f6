//! A program's time and memory.

use std::{
    fs,
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

/// What a run took.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    /// By the clock, s.
    pub seconds: f64,
    /// The most memory that it held, MiB; 0 where the system does not say it.
    pub mebibytes: f64,
}

/// Runs a command to its end, which must be a success.
pub fn run(command: &mut Command) -> Run {
    command.stdout(Stdio::null()).stderr(Stdio::null());
    let start = Instant::now();
    let mut child = command.spawn().expect("it runs");
    let mut mebibytes = 0.0;
    loop {
        mebibytes = held(&child).unwrap_or(mebibytes);
        if let Some(status) = child.try_wait().expect("it was started") {
            assert!(status.success(), "{status}: {command:?}");
            return Run { seconds: start.elapsed().as_secs_f64(), mebibytes };
        }
        thread::sleep(Duration::from_millis(2));
    }
}

/// The most memory that a program has held so far, MiB, where the system says it.
fn held(child: &Child) -> Option<f64> {
    let status = fs::read_to_string(format!("/proc/{}/status", child.id())).ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kibibytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kibibytes / 1024.0)
}
