//! `--effects`: a user's own effects in simulation and diagnosis.

use std::fs;

use imucal_tests::program;

use super::{Folder, causes, rates};

const MINE: &str = r#"
[[effect]]
id = "gyr.squeeze"
sensor = "gyr"
formula = "a_x * abs(a_y)"
unit = "rad/s"
amplitude = { typical = 1e-5, material = 2e-6 }
cause = "a housing that is squeezed"
remedy = "loosen its screws"
like = ["gyr.g2_sensitivity"]
"#;

fn folder() -> Folder {
    let folder = Folder::of(rates(5).record("run.csv"));
    fs::write(folder.path("mine.toml"), MINE).expect("the folder takes files");
    folder
}

#[test]
fn an_effect_of_a_file_is_simulated_listed_and_named() {
    let folder = folder();
    let line =
        "simulate --out squeezed.csv --programme full --rate 25 --effects mine.toml --effect gyr.squeeze=20";
    folder.run(line).with(0).printing(&["gyr.squeeze: x = ", "rad/s"]);
    let ended = folder.run("diagnose squeezed.csv --effects mine.toml --json out.json").with(0);
    let json: serde_json::Value = serde_json::from_str(&folder.text("out.json")).expect("JSON");
    assert!(causes(&json).contains(&"gyr.squeeze"), "{ended:#?}");
    assert_eq!(json["user_effects"][0]["remedy"], "loosen its screws");
    ended.printing(&["gyr.squeeze", "a housing that is squeezed", "loosen its screws"]);
    for command in ["diagnose", "simulate"] {
        let listed = folder.run(&format!("{command} --list --effects mine.toml")).with(0).out;
        assert!(listed.contains("gyr.squeeze\n  acts on:  the triad's response; seen by gyr"), "{listed}");
        assert!(listed.contains("or else:  gyr.g2_sensitivity\n"), "{listed}");
        assert!(!folder.run(&format!("{command} --list")).with(0).out.contains("gyr.squeeze"));
    }
}

#[test]
fn what_is_wrong_with_a_file_or_a_name_is_said_before_anything_is_done() {
    let folder = folder();
    fs::write(folder.path("bad.toml"), MINE.replace("abs(a_y)", "abs(a_q)")).expect("the folder takes files");
    for command in ["diagnose run.csv", "diagnose --list", "simulate --out new.csv", "blind --out new.d"] {
        let parts = ["bad.toml, line 2: effect `gyr.squeeze`: formula", "the name `a_q` at column 11"];
        folder.run(&format!("{command} --effects bad.toml")).with(2).telling(&parts);
        let parts = ["none.toml: cannot be read"];
        folder.run(&format!("{command} --effects none.toml")).with(2).telling(&parts);
    }
    let parts = ["--effect: there is no effect `gyr.squeze`; did you mean `gyr.squeeze`"];
    folder.run("simulate --out new.csv --effects mine.toml --effect gyr.squeze").with(2).telling(&parts);
    let parts = ["--without: there is no effect or term `gyr.squeeze`"];
    folder.run("diagnose run.csv --without gyr.squeeze").with(2).telling(&parts);
    assert!(!folder.path("new.csv").exists() && !folder.path("new.d").exists());
}

#[test]
fn drawn_effects_belong_to_the_set() {
    let folder = folder();
    let set = folder.path("set.d");
    let run = |more: &[&str]| {
        let set = set.to_string_lossy().into_owned();
        let mine = folder.path("mine.toml").to_string_lossy().into_owned();
        let line = ["blind", "--healthy", "1", "--cases", "0", "--nonce", "b11d", "--out", &set];
        let effects = if more.is_empty() { Vec::new() } else { vec!["--effects", &mine] };
        program::run(env!("CARGO_BIN_EXE_imucal-under-test"), &[], &[&line[..], &effects, more].concat())
    };
    run(&["--draw-effects"]).with(0);
    run(&[]).with(2).telling(&["found a set drawn without these effects or with others"]);
}
