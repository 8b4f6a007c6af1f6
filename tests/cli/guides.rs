//! The guides: what they tell a reader to run is run, as it stands there.

use std::path::Path;
use std::process::Command;

use imucal_tests::simulated;

use super::{Folder, mapping};

/// Blocks of a guide in a language, in their order.
fn blocks(guide: &str, language: &str) -> Vec<String> {
    let fence = format!("```{language}\n");
    guide
        .split(&fence)
        .skip(1)
        .map(|rest| rest.split("```").next().expect("a block ends").to_owned())
        .collect()
}

fn guide(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../imucal-host/docs/guides").join(name);
    std::fs::read_to_string(path).expect("a guide")
}

/// Runs each line of a guide's shell blocks in the folder; returns what each wrote. A line that says another exit status
/// behind `#` ends with that.
fn follow(folder: &Folder, name: &str) -> Vec<(String, String)> {
    let programs = folder.path("programs");
    std::fs::create_dir_all(&programs).expect("room");
    let program = programs.join("imucal");
    if !program.exists() {
        std::os::unix::fs::symlink(env!("CARGO_BIN_EXE_imucal-under-test"), &program).expect("a link");
    }
    let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap_or_default());
    let guide = guide(name);
    let blocks = blocks(&guide, "sh");
    let lines = blocks.iter().flat_map(|block| block.lines()).filter(|line| !line.trim().is_empty());
    let run = |line: &str| {
        let (command, comment) = line.split_once('#').unwrap_or((line, ""));
        let status =
            comment.trim().strip_prefix("exit status ").map_or(0, |text| text.parse().expect("a number"));
        let output = Command::new("sh")
            .args(["-c", command])
            .current_dir(folder.path(""))
            .env("PATH", &path)
            .output()
            .expect("a shell");
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        let all = text(&output.stdout) + &text(&output.stderr);
        assert_eq!(output.status.code(), Some(status), "{name}: {command}\n{all}");
        (command.trim().to_owned(), all)
    };
    let ran: Vec<(String, String)> = lines.map(run).collect();
    assert!(!ran.is_empty(), "{name} has nothing to run");
    ran
}

#[test]
fn the_firmware_guide_ends_with_a_corrected_sample_on_the_screen() {
    let folder = Folder::new();
    folder.write("log.csv", mapping::log(','));
    folder.write("main.c", blocks(&guide("firmware.md"), "c").remove(0));
    let ran = follow(&folder, "firmware.md");
    let guessed = ran[1].0.replace(" --out unit.toml --html unit.html", "");
    assert!(ran[0].1.contains(&guessed), "the first command does not answer with the second: {}", ran[0].1);
    let corrected: Vec<f64> = ran
        .last()
        .expect("a program")
        .1
        .split_whitespace()
        .map(|word| word.parse().expect("a number"))
        .collect();
    assert_eq!(corrected.len(), 3);
    // The unit is not calibrated by then: a tenth of its scale.
    assert!((corrected[2] - 9.80665).abs() < 1.0, "{corrected:?}");
}

#[test]
fn the_laboratory_guide_prints_a_certificate_a_drift_and_a_tray() {
    let folder = Folder::with_recording();
    for name in ["unit", "last-year"] {
        folder.write(&format!("{name}.csv"), folder.bytes("small.csv"));
        folder.write(&format!("{name}.toml"), folder.bytes("small.toml"));
    }
    std::fs::create_dir(folder.path("tray")).expect("room");
    for seed in [1, 2] {
        let unit = simulated::tumbled(simulated::RESTS, seed);
        unit.write(&folder.path("tray").join(format!("unit-{seed}.csv"))).expect("room");
    }
    let ran = follow(&folder, "laboratory.md");
    assert!(folder.text("cal-2026.html").contains("k = 2"));
    assert!(folder.text("drift.html").contains("No parameter has moved"));
    assert!(ran.iter().any(|(_, said)| said.contains("the calibration still fits")), "{ran:#?}");
    assert!(ran.last().expect("a batch").1.contains("2 recordings: 2 calibrated"), "{ran:#?}");
}

#[test]
fn the_robotics_guide_names_what_its_simulator_lacks() {
    let folder = Folder::new();
    let ran = follow(&folder, "robotics.md");
    assert!(ran.last().expect("a diagnosis").1.contains("clk.time_offset"), "{ran:#?}");
    assert!(folder.text("gap.html").contains("What to change in the simulator"));
}

#[test]
fn the_guide_to_effects_sees_its_effect_where_it_is_and_only_there() {
    let folder = Folder::new();
    folder.write("mine.toml", blocks(&guide("effects.md"), "toml").remove(0));
    let ran = follow(&folder, "effects.md");
    let diagnoses: Vec<&String> = ran
        .iter()
        .filter(|(command, _)| command.starts_with("imucal diagnose"))
        .map(|(_, said)| said)
        .collect();
    let [with, healthy] = diagnoses[..] else { panic!("two diagnoses: {ran:#?}") };
    assert!(with.contains("cause: gyr.cable_torque"), "{with}");
    assert!(!healthy.contains("cause: "), "{healthy}");
}
