//! Runs the program, as its users do.

use std::ffi::OsStr;
use std::time::Duration;
use std::{env, process};

/// A command that has not ended by then hangs: the slowest takes seconds.
const PATIENCE: Duration = Duration::from_secs(120);

/// How a command ended, and what it wrote.
#[derive(Debug)]
pub struct Ended {
    /// Exit status; −1 where a signal ended it.
    pub status: i32,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
}

/// Runs a program that has to end, without a terminal, in the folder of the test.
///
/// # Panics
///
/// Where it does not start, hangs, or writes something that is not UTF-8.
pub fn run<A: AsRef<OsStr>>(program: &str, variables: &[(&str, &str)], arguments: &[A]) -> Ended {
    let output = assert_cmd::Command::new(program)
        .args(arguments)
        .env_remove("SOURCE_DATE_EPOCH")
        .envs(variables.iter().copied())
        .timeout(PATIENCE)
        .output()
        .expect("the program starts");
    let text = |bytes| String::from_utf8(bytes).expect("the program writes UTF-8");
    Ended { status: output.status.code().unwrap_or(-1), out: text(output.stdout), err: text(output.stderr) }
}

/// Whether a program is there; without it the test is skipped, loudly, and where it is `needed` it fails under `CI=true`.
///
/// # Panics
///
/// Where it is needed under `CI=true`, and missing.
pub fn available(program: &str, arguments: &[&str], what: &str, needed: bool) -> bool {
    if process::Command::new(program).args(arguments).output().is_ok_and(|output| output.status.success()) {
        return true;
    }
    assert!(!needed || env::var_os("CI").is_none_or(|ci| ci != "true"), "no {what}");
    eprintln!("\n*** SKIPPED: no {what} ***\n");
    false
}

/// Text on one line, with one blank where there were more.
fn on_one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

impl Ended {
    /// Asserts the exit status.
    ///
    /// # Panics
    ///
    /// Where it is another, or the program panicked.
    pub fn with(self, status: i32) -> Self {
        assert!(!self.err.contains("panicked"), "{self:#?}");
        assert_eq!(self.status, status, "{self:#?}");
        self
    }

    /// Asserts that standard error holds all of the parts.
    ///
    /// # Panics
    ///
    /// Where one is missing.
    pub fn telling(self, parts: &[&str]) -> Self {
        for part in parts {
            assert!(self.err.contains(part), "`{part}` is missing in {self:#?}");
        }
        self
    }

    /// Asserts that standard output holds all of the parts, wherever its lines are broken.
    ///
    /// # Panics
    ///
    /// Where one is missing.
    pub fn printing(self, parts: &[&str]) -> Self {
        let flat = on_one_line(&self.out);
        for part in parts {
            assert!(
                self.out.contains(part) || flat.contains(&on_one_line(part)),
                "`{part}` is missing in {self:#?}"
            );
        }
        self
    }
}
