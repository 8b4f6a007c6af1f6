//! Signals and kills: nothing half-written is left, and what a kill has left is swept.

use std::fs;
use std::io::Read;
use std::os::unix::process::ExitStatusExt;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use super::Folder;

const PATIENCE: Duration = Duration::from_secs(60);

/// A program that has its manifest under way, and waits for somebody to read the FIFO of its samples.
struct Waiting {
    folder: Folder,
    program: Child,
}

impl Waiting {
    /// Started by a shell after these words.
    fn after(words: &str) -> Self {
        let folder = Folder::with_calibration();
        let made = Command::new("mkfifo").arg(folder.path("out.csv")).status().expect("mkfifo starts");
        assert!(made.success());
        // A test run in the background of a shell ignores INT, and so would the program.
        let mut program = Command::new("env")
            .args(["--default-signal=INT,TERM,HUP", "sh"])
            .args(["-c", &format!("{words} exec \"$0\" \"$@\""), env!("CARGO_BIN_EXE_imucal-under-test")])
            .args(folder.arguments("apply small.csv --calibration cal.bin --out out.csv"))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the program starts");
        let end = Instant::now() + PATIENCE;
        while parts(&folder) == 0 {
            assert!(Instant::now() < end && program.try_wait().expect("it is ours").is_none());
            std::thread::sleep(Duration::from_millis(10));
        }
        Self { folder, program }
    }

    fn signal(&self, name: &str) {
        let sent = Command::new("kill").args([&format!("-{name}"), &self.program.id().to_string()]).status();
        assert!(sent.expect("kill starts").success());
    }

    fn end(&mut self) -> ExitStatus {
        let end = Instant::now() + PATIENCE;
        while Instant::now() < end {
            if let Some(status) = self.program.try_wait().expect("it is ours") {
                return status;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        let _ = self.program.kill();
        panic!("the program has not ended within {PATIENCE:?}")
    }

    /// Reads what it waits to send.
    fn read(&self) -> String {
        let mut text = String::new();
        let mut fifo = fs::File::open(self.folder.path("out.csv")).expect("the FIFO is there");
        fifo.read_to_string(&mut text).expect("text");
        text
    }
}

fn parts(folder: &Folder) -> usize {
    folder.names().iter().filter(|name| name.ends_with(".part")).count()
}

const WITHOUT_IT: [&str; 5] = ["cal.bin", "cal.toml", "out.csv", "small.csv", "small.toml"];

#[test]
fn a_signal_that_ends_the_program_leaves_no_part() {
    for (name, number) in [("INT", 2), ("TERM", 15), ("HUP", 1)] {
        let mut waiting = Waiting::after("");
        waiting.signal(name);
        assert_eq!(waiting.end().signal(), Some(number));
        assert_eq!(waiting.folder.names(), WITHOUT_IT, "{name}");
    }
}

#[test]
fn the_part_of_a_killed_program_is_swept_by_the_next() {
    let mut waiting = Waiting::after("");
    waiting.signal("KILL");
    waiting.end();
    assert_eq!(parts(&waiting.folder), 1);
    waiting.folder.run("calibrate small.csv --json new.json").with(0);
    assert_eq!(parts(&waiting.folder), 0);
}

#[test]
fn the_part_of_a_running_program_is_left_to_it() {
    let mut waiting = Waiting::after("");
    waiting.folder.run("calibrate small.csv --json new.json").with(0);
    assert_eq!(parts(&waiting.folder), 1);
    assert!(waiting.read().starts_with("t,acc_x"));
    assert!(waiting.end().success() && waiting.folder.path("out.toml").exists());
    assert_eq!(parts(&waiting.folder), 0);
}

#[test]
fn a_hangup_that_nohup_switched_off_stays_off() {
    let mut waiting = Waiting::after("trap '' HUP;");
    waiting.signal("HUP");
    std::thread::sleep(Duration::from_millis(300));
    assert!(waiting.program.try_wait().expect("it is ours").is_none());
    assert!(waiting.read().starts_with("t,acc_x"));
    assert!(waiting.end().success());
}
