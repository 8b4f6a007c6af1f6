//! `imucal batch`: many recordings at once, whatever becomes of one of them, and whenever the program is killed.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use imucal_host::recording::{Recording, Triple};
use imucal_tests::program::Ended;
use imucal_tests::simulated;
use nalgebra::{Matrix3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::Value;

use super::{Folder, imucal_on_a_day};

const PATIENCE: Duration = Duration::from_secs(600);
const DAY: (&str, &str) = ("SOURCE_DATE_EPOCH", "1790000000");

/// The small recording as a unit of another seed would have made it: gains and biases are its own, motion and noise are shared.
fn unit(seed: usize) -> Recording {
    static BASE: OnceLock<Recording> = OnceLock::new();
    let mut unit = BASE.get_or_init(simulated::small).clone();
    let mut rng = ChaCha8Rng::seed_from_u64(seed as u64);
    for (sensor, gain, bias) in
        [(&mut unit.acc, 0.005, 0.05), (&mut unit.gyr, 0.005, 0.002), (&mut unit.mag, 0.01, 1.0)]
    {
        let mut normal = |size: f64| -> f64 { size * Distribution::<f64>::sample(&StandardNormal, &mut rng) };
        let gain = Matrix3::identity() + Matrix3::from_fn(|_, _| normal(gain));
        let bias = Vector3::from_fn(|_, _| normal(bias));
        changed(sensor.as_mut().expect("recorded"), &gain, &bias);
    }
    unit.manifest.sensor.serial = Some(format!("{seed:04}"));
    unit
}

/// Samples of a sensor with another gain and bias, in whole counts as before.
fn changed(sensor: &mut Triple, gain: &Matrix3<f64>, bias: &Vector3<f64>) {
    let nominal = sensor.nominal;
    for value in &mut sensor.values {
        *value = (gain * *value + bias).map(|si| nominal.to_si(nominal.to_raw(si).round()));
    }
}

/// A folder with so many units in `in.d`.
pub(super) fn units(count: usize) -> Folder {
    let folder = Folder::new();
    fs::create_dir(folder.path("in.d")).expect("the folder takes folders");
    for seed in 0..count {
        unit(seed).write(&folder.path(&format!("in.d/u{seed:04}.csv"))).expect("room");
    }
    folder
}

impl Folder {
    /// Runs it on a day that stands still.
    fn batch(&self, line: &str) -> Ended {
        imucal_on_a_day(&self.arguments(&format!("batch {line}")))
    }

    fn json(&self, name: &str) -> Value {
        serde_json::from_str(&self.text(name)).expect("JSON")
    }
}

/// All files below a folder by their paths, hidden ones too.
fn tree(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut left = vec![folder.to_path_buf()];
    while let Some(next) = left.pop() {
        for entry in fs::read_dir(&next).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                left.push(path);
            } else {
                let name = path.strip_prefix(folder).expect("below").to_path_buf();
                files.insert(name, fs::read(&path).expect("a file"));
            }
        }
    }
    files
}

/// The files are the same, byte for byte.
fn assert_same(a: &Path, b: &Path) {
    let (a, b) = (tree(a), tree(b));
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
    for (name, content) in &a {
        assert!(b[name] == *content, "{}", name.display());
    }
}

/// Starts a batch and kills it once so many recordings are done.
fn kill_after(folder: &Folder, line: &str, out: &str, done: usize) {
    let mut program = Command::new(env!("CARGO_BIN_EXE_imucal-under-test"))
        .args(folder.arguments(&format!("batch {line}")))
        .env(DAY.0, DAY.1)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    let entries = folder.path(out).join(".imucal-batch");
    let count = || {
        let entries = fs::read_dir(&entries).into_iter().flatten().flatten();
        entries.filter(|entry| entry.file_name().to_string_lossy().ends_with(".json")).count()
    };
    let end = Instant::now() + PATIENCE;
    while count() < done {
        let ended = program.try_wait().expect("it is ours");
        assert!(Instant::now() < end && ended.is_none(), "{} done, {ended:?}", count());
        std::thread::sleep(Duration::from_millis(5));
    }
    program.kill().expect("it runs");
    program.wait().expect("it was killed");
}

/// Spoils seven of the recordings, each in another way.
fn spoil(folder: &Folder) {
    let name = |k: usize, ending: &str| format!("in.d/u{k:04}.{ending}");
    let text = folder.text(&name(0, "csv"));
    let half = &text[..text.len() / 2];
    folder.write(&name(10, "csv"), "");
    folder.write(&name(20, "csv"), "these,are,no,columns\n1,2,3,4\n");
    folder.write(&name(30, "csv"), half.replacen(",", ",not a number,", 40));
    fs::remove_file(folder.path(&name(40, "toml"))).expect("it was there");
    folder.write(&name(50, "toml"), "format = \"imucal-recording/99\"\n");
    let mut lines: Vec<&str> = text.lines().collect();
    lines[1..].reverse();
    folder.write(&name(60, "csv"), lines.join("\n") + "\n");
    fs::remove_file(folder.path(&name(70, "csv"))).expect("it was there");
    folder.write(&name(70, "csv.gz"), b"\x1f\x8b\x08 and no more");
}

const SPOILT: [usize; 7] = [10, 20, 30, 40, 50, 60, 70];

#[test]
fn the_json_on_the_screen_is_printed_in_quiet_too() {
    let folder = units(1);
    let loud = folder.batch("in.d --out out.d --json -").with(0);
    let quiet = folder.batch("in.d --out out.d --json - --quiet").with(0);
    let json: Value = serde_json::from_str(&quiet.out).expect("JSON alone");
    assert!(json["recordings"].is_array() && loud.out == quiet.out, "{}", loud.out);
}

#[test]
fn of_a_hundred_files_the_seven_broken_ones_are_named_and_the_others_done() {
    let folder = units(100);
    spoil(&folder);
    let ended = folder.batch("in.d --out out.d --summary all.csv --json all.json").with(2);
    assert!(ended.out.ends_with("100 recordings: 93 calibrated, 0 refused, 7 unreadable\n"), "{}", ended.out);
    let json = folder.json("all.json");
    let all = json["recordings"].as_array().expect("recordings");
    for (k, recording) in all.iter().enumerate() {
        let name = format!("u{k:04}");
        assert_eq!(recording["name"], name.as_str());
        let spoilt = SPOILT.contains(&k);
        assert_eq!(recording["exit_status"], if spoilt { 2 } else { 0 }, "{recording}");
        assert_eq!(ended.err.contains(&format!("{name}.")), spoilt, "{name}");
        for ending in ["json", "toml", "bin"] {
            assert_eq!(folder.path(&format!("out.d/{name}.{ending}")).exists(), !spoilt);
        }
    }
    // What it writes of a recording is what `calibrate` writes.
    imucal_on_a_day(&folder.arguments("calibrate in.d/u0007.csv --out c.toml --record c.bin --json c.json"))
        .with(0);
    for ending in ["json", "toml", "bin"] {
        let own = folder.bytes(&format!("out.d/u0007.{ending}"));
        assert!(own == folder.bytes(&format!("c.{ending}")), "{ending}");
    }
    let summary = folder.text("all.csv");
    assert_eq!(summary.lines().count(), 1 + 3 * 93 + 7);
}

#[test]
fn killed_and_resumed_or_in_shards_the_result_is_that_of_one_run() {
    let folder = units(24);
    // One is unlike the others, by its gyroscope's bias.
    let mut planted = unit(17);
    let bias = Vector3::new(0.0, 0.1, 0.0);
    changed(planted.gyr.as_mut().expect("recorded"), &Matrix3::identity(), &bias);
    planted.write(&folder.path("in.d/u0017.csv")).expect("room");

    let files = |name: &str| format!("--summary {name}.parquet --json {name}.json");
    let one = folder.batch(&format!("in.d --out one.d {}", files("one"))).with(0);
    assert!(one.out.ends_with("24 recordings: 24 calibrated, 0 refused, 0 unreadable\n"), "{}", one.out);
    let found = &folder.json("one.json")["outliers"];
    let found: Vec<_> = found.as_array().expect("outliers").iter().collect();
    assert_eq!(found.len(), 1, "{found:#?}");
    assert_eq!((&found[0]["name"], &found[0]["parameter"]), (&"u0017".into(), &"offset_y".into()));
    assert!(one.out.contains("outlier: u0017: gyroscope: offset_y is"), "{}", one.out);

    let line = format!("in.d --out killed.d {}", files("killed"));
    kill_after(&folder, &line, "killed.d", 5);
    assert!(!folder.path("killed.json").exists());
    let resumed = folder.batch(&line).with(0).telling(&["of 24 recordings were already done"]);
    assert_eq!(resumed.out, one.out);
    assert_same(&folder.path("one.d"), &folder.path("killed.d"));

    folder.batch("in.d --out shards.d --shard 2/2 --jobs 1 --summary shards.parquet").with(0);
    assert_eq!(tree(&folder.path("shards.d")).keys().filter(|path| path.ends_with("u0000.bin")).count(), 0);
    folder.batch("in.d --out shards.d --shard 1/2 --jobs 3").with(0);
    let all = folder.batch(&format!("in.d --out shards.d {}", files("shards"))).with(0);
    let all = all.telling(&["24 of 24 recordings were already done"]);
    assert_eq!(all.out, one.out);
    assert_same(&folder.path("one.d"), &folder.path("shards.d"));
    for ending in ["parquet", "json"] {
        let one = folder.bytes(&format!("one.{ending}"));
        assert!(one == folder.bytes(&format!("killed.{ending}")), "{ending}");
        assert!(one == folder.bytes(&format!("shards.{ending}")), "{ending}");
    }
}

#[test]
#[ignore = "minutes: cargo test --release -p imucal-tests --test cli -- --ignored a_thousand_units"]
fn a_thousand_units_killed_and_resumed_give_the_result_of_one_run() {
    let folder = units(1000);
    let files = |name: &str| format!("in.d --out {name}.d --summary {name}.csv --json {name}.json");
    kill_after(&folder, &files("one"), "one.d", 1000);
    folder.batch(&files("one")).with(0);
    for done in [10, 200, 700] {
        kill_after(&folder, &files("killed"), "killed.d", done);
    }
    kill_after(&folder, &files("killed"), "killed.d", 999);
    folder.batch(&files("killed")).with(0).telling(&["of 1000 recordings were already done"]);
    assert_same(&folder.path("one.d"), &folder.path("killed.d"));
    for ending in ["csv", "json"] {
        assert!(
            folder.bytes(&format!("one.{ending}")) == folder.bytes(&format!("killed.{ending}")),
            "{ending}"
        );
    }
}

#[test]
fn what_has_changed_is_done_again_and_that_is_said() {
    let folder = units(3);
    let line = "in.d --out out.d";
    folder.batch(line).with(0);
    let before = tree(&folder.path("out.d"));
    folder.batch(line).with(0).telling(&["3 of 3 recordings were already done"]);
    assert!(before == tree(&folder.path("out.d")));

    unit(77).write(&folder.path("in.d/u0001.csv")).expect("room");
    folder.batch(line).with(0).telling(&["again: 1 (u0001): the recording has changed", "2 of 3"]);
    folder.write("out.d/u0002.toml", "");
    folder.batch(line).with(0).telling(&["again: 1 (u0002): an output is missing or was changed", "2 of 3"]);

    let again = "again: 3 (u0000, u0001, u0002): the options have changed";
    folder.batch(&format!("{line} --model mag=E9")).with(0).telling(&[again]);
    // A model that needs a rig refuses them all, and takes former calibrations away.
    let refused = folder.batch(&format!("{line} --model acc=I14")).with(2).telling(&[again, "needs a rig"]);
    assert!(
        refused.out.ends_with("3 recordings: 0 calibrated, 0 refused, 3 unreadable\n"),
        "{}",
        refused.out
    );
    assert_eq!(super::names(&folder.path("out.d")), [".imucal-batch"]);
}

#[test]
fn a_recording_that_is_refused_is_named_with_its_reason() {
    let folder = units(1);
    simulated::tumbled(3, 9).write(&folder.path("in.d/few.csv")).expect("room");
    let ended = folder.batch("in.d --out out.d").with(1).telling(&["refused: few.csv: acc refused ("]);
    assert!(ended.out.ends_with("2 recordings: 1 calibrated, 1 refused, 0 unreadable\n"), "{}", ended.out);
    assert!(folder.path("out.d/few.json").exists() && !folder.path("out.d/few.bin").exists());
}

#[test]
fn recordings_of_one_name_in_two_folders_and_those_of_a_list_keep_apart() {
    let folder = Folder::new();
    for (name, seed) in [("a.d", 1), ("b.d", 2)] {
        fs::create_dir(folder.path(name)).expect("the folder takes folders");
        unit(seed).write(&folder.path(&format!("{name}/x.csv"))).expect("room");
    }
    folder.batch("a.d b.d --out out.d --jobs 1").with(0);
    assert!(folder.bytes("out.d/a.d/x.json") != folder.bytes("out.d/b.d/x.json"));
    folder.batch("*.d/x.csv --out pattern.d").with(0);
    assert!(folder.bytes("out.d/a.d/x.bin") == folder.bytes("pattern.d/a.d/x.bin"));

    folder.write("list.csv", "path,name,model\na.d/x.csv,board 7,gyr=K9\nb.d/none.csv,,\n");
    let ended = folder.batch("list.csv --out list.d").with(2).telling(&["none.csv", "no such file"]);
    assert!(ended.out.ends_with("2 recordings: 1 calibrated, 0 refused, 1 unreadable\n"), "{}", ended.out);
    assert!(folder.bytes("list.d/board 7.bin") == folder.bytes("out.d/a.d/x.bin"));
}

#[test]
fn outputs_that_cannot_be_written_or_would_replace_others_are_refused() {
    let folder = units(1);
    folder.write("taken.txt", "a file");
    folder.batch("in.d --out taken.txt").with(2).telling(&["taken.txt", "choose another --out"]);
    folder.batch("in.d --out in.d").with(2).telling(&["a recording's manifest", "choose another --out"]);
    folder
        .batch("in.d --out out.d --summary missing.d/all.csv")
        .with(2)
        .telling(&["missing.d", "check the folder"]);
    folder.batch("in.d --out out.d --summary all.txt").with(2).telling(&["FILE.csv or FILE.parquet"]);
    folder.batch("in.d --out out.d --summary taken.csv --shard 3/2").with(2).telling(&["expected i/n"]);
    assert_eq!(super::names(&folder.path("in.d")).len(), 2 + 1);
    assert_eq!(super::names(&folder.path("out.d")), [".imucal-batch"]);

    folder.write("out.d/u0000.toml", "title = \"notes\"\n");
    let ended = folder.batch("in.d --out out.d").with(2).telling(&[
        "failed: ",
        "u0000.toml: found a file",
        "--force",
    ]);
    assert!(ended.out.ends_with("0 calibrated, 0 refused, 0 unreadable, 1 failed\n"), "{}", ended.out);
    assert_eq!(folder.text("out.d/u0000.toml"), "title = \"notes\"\n");
    // It is tried again by the next run.
    folder.batch("in.d --out out.d --force --summary all.csv").with(0);
    folder.batch("in.d --out out.d --summary all.csv").with(0);
    folder.write("all.csv", "another's\n");
    folder.batch("in.d --out out.d --summary all.csv").with(2).telling(&["all.csv", "--force"]);
}
