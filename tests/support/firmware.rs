//! Builds the images of `firmware-example` and runs them in QEMU.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// A microcontroller the images are built for. How cargo runs them stands in `.cargo/config.toml`.
#[derive(Clone, Copy, Debug)]
pub struct Board {
    /// Target triple.
    pub target: &'static str,
    /// Core, for people.
    pub core: &'static str,
    /// Machine of QEMU.
    pub machine: &'static str,
    /// Features that every image of it is built with: where no image takes part in a link, those of the gate, so that the core is
    /// compiled once.
    pub features: &'static [&'static str],
}

/// The boards every test goes through: two with a floating-point unit and one without.
pub const BOARDS: [Board; 3] = [
    Board { target: "thumbv7em-none-eabihf", core: "Cortex-M4F", machine: "mps2-an386", features: &[] },
    Board { target: "thumbv6m-none-eabi", core: "Cortex-M0", machine: "microbit", features: &[] },
    Board { target: "thumbv8m.main-none-eabihf", core: "Cortex-M33", machine: "mps2-an505", features: &[] },
];

/// The boards whose costs are stated.
pub const MEASURED: [Board; 2] = [BOARDS[0], BOARDS[1]];

/// Another architecture, without a floating-point unit and without a board around it: it runs what the core computes.
pub const RISC_V: Board =
    Board { target: "riscv32imac-unknown-none-elf", core: "RV32IMAC", machine: "virt", features: &["key"] };

/// An image that has not ended by then hangs: it takes milliseconds, and a wait for the build of another one a minute or two.
const PATIENCE: Duration = Duration::from_secs(300);

/// Can images be built and run here? If not, says so where nobody can overlook it.
///
/// # Panics
///
/// Where they cannot, but must: with `CI=true`, or `IMUCAL_FIRMWARE=required` as `tests/run` sets it.
///
/// Skipped loudly with `IMUCAL_FIRMWARE=elsewhere`: `tests/run` runs these tests in a process of their own, at the same time as the
/// others, since an image links on one core.
pub fn ready() -> bool {
    if std::env::var("IMUCAL_FIRMWARE").is_ok_and(|where_to| where_to == "elsewhere") {
        announce("\n*** NOT TESTED HERE: firmware. tests/run tests it in another process. ***\n");
        return false;
    }
    let missing = missing();
    if missing.is_empty() {
        return true;
    }
    let report = format!(
        "\n*** NOT TESTED: firmware. Missing: {}. `sh tests/setup` installs it. ***\n",
        missing.join(", ")
    );
    let set_to = |name, value| std::env::var(name).is_ok_and(|v| v == value);
    assert!(!set_to("CI", "true") && !set_to("IMUCAL_FIRMWARE", "required"), "{report}");
    announce(&report);
    false
}

fn missing() -> Vec<String> {
    let mut missing = Vec::new();
    for emulator in ["qemu-system-arm", "qemu-system-riscv32"] {
        if Command::new(emulator).arg("--version").output().is_err() {
            missing.push(emulator.to_owned());
        }
    }
    for board in BOARDS.into_iter().chain([RISC_V]) {
        let directory = toolchain(&mut Command::new("rustc"))
            .args(["--print", "target-libdir", "--target", board.target])
            .output();
        let found = directory.is_ok_and(|d| Path::new(String::from_utf8_lossy(&d.stdout).trim()).is_dir());
        if !found {
            missing.push(format!("Rust target {}", board.target));
        }
    }
    missing
}

/// To the terminal, past the test harness, which shows the output of failing tests only.
pub fn announce(line: &str) {
    writeln!(std::io::stderr(), "{line}").expect("stderr takes a line");
}

/// Builds one image with the profile that is flashed; the ELF file.
///
/// # Errors
///
/// What cargo said, if there is no image.
pub fn build(board: Board, image: &str, features: &[&str]) -> Result<PathBuf, String> {
    let output = cargo("build", board, image, features).output().expect("cargo runs");
    if output.status.success() {
        Ok(target_directory().join(board.target).join("firmware").join(image))
    } else {
        Err(String::from_utf8_lossy(&output.stderr).into_owned())
    }
}

/// Nanoseconds of virtual time that an instruction takes in [`counted`]: 2 to this power.
pub const SHIFT: u32 = 6;

/// Builds one image and runs it on a clock that counts instructions; what it wrote.
///
/// # Panics
///
/// Where it does not build, hangs or fails.
pub fn counted(board: Board, image: &str) -> String {
    let path = build(board, image, &[]).unwrap_or_else(|refusal| panic!("{refusal}"));
    let output = assert_cmd::Command::new("qemu-system-arm")
        .args(["-machine", board.machine, "-nographic", "-monitor", "none", "-serial", "none"])
        .args(["-chardev", "stdio,id=console", "-icount", &format!("shift={SHIFT}")])
        .args(["-semihosting-config", "enable=on,target=native,chardev=console", "-kernel"])
        .arg(path)
        .timeout(PATIENCE)
        .output()
        .expect("QEMU starts");
    assert_eq!(output.status.code(), Some(0), "{image} on {}: {output:?}", board.core);
    String::from_utf8(output.stdout).expect("the image writes text")
}

/// Builds and runs one image; its exit status and what it wrote.
///
/// # Panics
///
/// Where it does not build, or hangs.
pub fn run(board: Board, image: &str) -> Output {
    run_with(board, image, &[])
}

/// The same with features.
///
/// # Panics
///
/// As above.
pub fn run_with(board: Board, image: &str, features: &[&str]) -> Output {
    if let Err(refusal) = build(board, image, features) {
        panic!("{image} does not build for {}:\n{refusal}", board.target);
    }
    // On Unix cargo becomes its runner, so that to kill the child is to kill QEMU.
    let mut child = cargo("run", board, image, features)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("cargo runs");
    let (mut out, mut err) = (child.stdout.take().expect("piped"), child.stderr.take().expect("piped"));
    let read_out = std::thread::spawn(move || read_all(&mut out));
    let read_err = std::thread::spawn(move || read_all(&mut err));
    let end = Instant::now() + PATIENCE;
    let status = loop {
        if let Some(status) = child.try_wait().expect("the child is ours") {
            break status;
        }
        if Instant::now() > end {
            child.kill().expect("the child is ours");
            panic!("{image} hangs on {}", board.core);
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    Output {
        status,
        stdout: read_out.join().expect("reads to the end"),
        stderr: read_err.join().expect("reads to the end"),
    }
}

fn read_all(from: &mut impl Read) -> Vec<u8> {
    let mut bytes = Vec::new();
    from.read_to_end(&mut bytes).expect("a pipe can be read");
    bytes
}

fn cargo(verb: &str, board: Board, image: &str, features: &[&str]) -> Command {
    let mut command = Command::new("cargo");
    command
        .current_dir(workspace())
        .args([verb, "--quiet", "--locked", "--package", "firmware-example"])
        .args(["--profile", "firmware", "--target", board.target, "--bin", image])
        .args(["--features", &[board.features, features].concat().join(",")])
        .arg("--target-dir")
        .arg(target_directory())
        .env_remove("RUSTFLAGS")
        // Built by parts, an image has other sizes and other names at its addresses.
        .env("CARGO_INCREMENTAL", "0")
        // What only a debugger reads: without it an image is of the same size, and is linked in two thirds of the time.
        .env("CARGO_PROFILE_FIRMWARE_DEBUG", "0");
    toolchain(&mut command);
    command
}

/// The log that an image wrote: a line for each frame, its level and its text.
///
/// # Panics
///
/// Where the decoder does not build, or a frame is malformed.
pub fn decoded(image: &Path, frames: &[u8]) -> String {
    let output = assert_cmd::Command::new("cargo")
        .current_dir(workspace())
        .args(["run", "--quiet", "--locked", "--manifest-path", "tests/defmt_log/Cargo.toml"])
        .args(["--target-dir", "target/defmt_log", "--"])
        .arg(image)
        .write_stdin(frames)
        .timeout(PATIENCE)
        .output()
        .expect("cargo runs");
    let text = |bytes| String::from_utf8_lossy(bytes).into_owned();
    assert!(output.status.success(), "{}\n{}", text(&output.stderr), text(&output.stdout));
    text(&output.stdout)
}

/// Not the one of the tests, which cargo may be holding.
fn target_directory() -> PathBuf {
    workspace().join("target/tests")
}

/// The toolchain that `tests/setup` found, where it is not the pinned one: lines of `NAME=value`.
fn toolchain(command: &mut Command) -> &mut Command {
    let chosen = std::fs::read_to_string(workspace().join("target/firmware-toolchain")).unwrap_or_default();
    command.envs(chosen.lines().filter_map(|line| line.split_once('=')))
}

fn workspace() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests lie in the workspace")
}
