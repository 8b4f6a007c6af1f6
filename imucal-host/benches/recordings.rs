//! How long and in how much memory recordings are simulated, brought in, corrected and looked at for noise, by their rows. Prints the
//! tables of docs/performance.md; figures are ratios within one run.
//!
//! `imucal apply` is compared with the same arithmetic by Polars and DuckDB, each a process of its own as ours is, where
//! Python has them: `IMUCAL_PYTHON=PROGRAM` names it. `IMUCAL_ROWS=N` asks for one more row count for them, as 10000000.

use std::{
    env,
    ffi::OsString,
    fs,
    io::{BufWriter, Write},
    path::{Path, PathBuf},
    process::Command,
};

use imucal_host::simulator::random::{Purpose, Random};
use nalgebra::Vector3;
use process::Run;

mod process;

/// Rows of the recordings that are corrected and looked at.
const ROWS: [usize; 3] = [10_000, 100_000, 1_000_000];
/// Lengths of the simulated recordings at 100 Hz, s.
const LENGTHS: [usize; 3] = [100, 1000, 10_000];
/// How often each is run; the median counts.
const REPEATS: usize = 3;
/// Engines of the script, by the name that a table gives them.
const PEERS: [(&str, &str); 3] =
    [("polars", "Polars"), ("polars-streaming", "streaming"), ("duckdb", "DuckDB")];

fn main() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    println!("Recordings of three sensors at 100 Hz, `imucal simulate`:\n");
    heading(LENGTHS[0] * 100);
    let mut first = None;
    for length in LENGTHS {
        let out = folder.join("simulated.csv");
        let length_s = length.to_string();
        let ours = imucal(
            &["simulate", "--programme", "mixed", "--force", "--duration", &length_s, "--out"],
            &[&out],
        );
        line(100 * length, &ours, &mut first);
    }
    println!("\nRecordings of two sensors, `imucal noise`:\n");
    heading(ROWS[0]);
    let mut first = None;
    for rows in ROWS {
        let path = recording(folder, rows);
        line(rows, &imucal(&["noise"], &[&path]), &mut first);
    }
    println!("\nRecordings of two sensors, `imucal import`:\n");
    heading(ROWS[0]);
    let mut first = None;
    for rows in ROWS {
        let (path, out) = (recording(folder, rows), folder.join("imported.csv"));
        line(rows, &imucal(&["import", "--force"], &[&path, Path::new("--out"), &out]), &mut first);
    }
    let more = env::var("IMUCAL_ROWS").ok().and_then(|rows| rows.parse().ok());
    let calibration = folder.join("calibration.toml");
    fs::write(&calibration, CALIBRATION).expect("room");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/peers/apply.py");
    let there: Vec<_> = PEERS.into_iter().filter(|(engine, _)| is_there(&script, engine)).collect();
    println!(
        "\nRecordings of two sensors, `imucal apply`, and the time and memory of others over its own:\n"
    );
    let names = there.iter().map(|(_, name)| format!(" {name} | MiB |")).collect::<String>();
    println!(
        "| format | rows | s | MiB |{names}\n| --- | --- | --- | --- |{}",
        " --- | --- |".repeat(there.len())
    );
    for rows in ROWS.into_iter().chain(more) {
        let text = recording(folder, rows);
        let columns = folder.join(format!("columns-{rows}.parquet"));
        correct(&text, &calibration, &columns);
        for source in [text, columns] {
            compared(rows, &source, &calibration, &script, &there);
            fs::remove_file(&source).expect("it is there");
        }
    }
}

/// Corrects a recording by this program and by others, and prints a line.
fn compared(rows: usize, source: &Path, calibration: &Path, script: &Path, peers: &[(&str, &str)]) {
    let format = source.extension().expect("it has one").to_string_lossy().into_owned();
    let out = source.with_file_name(format!("out.{format}"));
    let ours = correct(source, calibration, &out);
    print!("| {format} | {rows} | {:.2} | {:.0} |", ours.seconds, ours.mebibytes);
    for (engine, _) in peers {
        let theirs = median(|| process::run(python(script).arg(engine).args([source, &out])));
        print!(" {:.2} | {:.1} |", theirs.seconds / ours.seconds, theirs.mebibytes / ours.mebibytes);
    }
    println!();
    fs::remove_file(&out).expect("it is there");
}

fn correct(source: &Path, calibration: &Path, out: &Path) -> Run {
    let source = source.to_string_lossy();
    imucal(&["apply", "--force", &source, "--calibration"], &[calibration, Path::new("--out"), out])
}

/// Runs this program with some words and then some paths.
fn imucal(words: &[&str], paths: &[&Path]) -> Run {
    median(|| process::run(Command::new(env!("CARGO_BIN_EXE_imucal")).args(words).args(paths)))
}

fn python(script: &Path) -> Command {
    let mut command = Command::new(env::var_os("IMUCAL_PYTHON").unwrap_or_else(|| OsString::from("python3")));
    command.arg(script);
    command
}

/// Whether the script has an engine; that it has not is said.
fn is_there(script: &Path, engine: &str) -> bool {
    match python(script).arg(engine).output() {
        Ok(ended) if ended.status.success() => true,
        Ok(ended) => {
            eprintln!("*** SKIPPED: {} ***", String::from_utf8_lossy(&ended.stderr).trim());
            false
        }
        Err(fault) => {
            eprintln!("*** SKIPPED: {engine}: {fault} ***");
            false
        }
    }
}

/// The run of median time.
fn median(run: impl Fn() -> Run) -> Run {
    let mut runs: Vec<Run> = (0..REPEATS).map(|_| run()).collect();
    runs.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    runs[REPEATS / 2]
}

fn heading(first: usize) {
    println!("| rows | s | s a row over that of {first} | MiB |\n| --- | --- | --- | --- |");
}

fn line(rows: usize, run: &Run, first: &mut Option<f64>) {
    let each = run.seconds / rows as f64;
    let growth = each / *first.get_or_insert(each);
    println!("| {rows} | {:.2} | {growth:.2} | {:.0} |", run.seconds, run.mebibytes);
}

/// A recording of a table that lies still, with noise.
fn recording(folder: &Path, rows: usize) -> PathBuf {
    let path = folder.join(format!("{rows}.csv"));
    let mut file = BufWriter::new(fs::File::create(&path).expect("room"));
    writeln!(file, "t,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z").expect("room");
    let mut random = Random::new(1, Purpose::Noise);
    for k in 0..rows {
        let f = Vector3::new(0.1, -0.2, 9.8) + random.normals() * 0.05;
        let w = random.normals() * 0.02;
        writeln!(
            file,
            "{},{:.5},{:.5},{:.5},{:.6},{:.6},{:.6}",
            k as f64 / 128.0,
            f.x,
            f.y,
            f.z,
            w.x,
            w.y,
            w.z
        )
        .expect("room");
    }
    let manifest = "format = \"imucal-recording/1\"\n[units]\nt = \"s\"\nacc = \"m/s^2\"\ngyr = \"rad/s\"\n";
    fs::write(path.with_extension("toml"), manifest).expect("room");
    path
}

/// The calibration that the script of other engines holds too.
const CALIBRATION: &str = r#"format = "imucal-calibration/1"
recording = "still.csv"
date = "2026-01-01"
[sensor]
name = ""
serial = ""
[acc]
model = "T9"
unit_in = "m/s^2"
unit_out = "m/s^2"
gain = [[1.01, 0.002, 0.003], [0.0, 0.99, 0.001], [0.0, 0.0, 1.02]]
bias = [0.1, -0.2, 0.3]
gain_std = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
bias_std = [0.001, 0.001, 0.001]
rms = 0.001
observations = 38
parameters = 9
condition = 16.0
coverage = 0.875
[gyr]
model = "T9"
unit_in = "rad/s"
unit_out = "rad/s"
gain = [[1.01, 0.002, 0.003], [0.0, 0.99, 0.001], [0.0, 0.0, 1.02]]
bias = [0.01, -0.02, 0.03]
gain_std = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
bias_std = [0.001, 0.001, 0.001]
rms = 0.001
observations = 38
parameters = 9
condition = 16.0
coverage = 0.875
"#;
