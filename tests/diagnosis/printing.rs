//! What goes to standard output, to standard error, and to files.

use imucal_host::effect::CATALOGUE;
use serde_json::Value;

use super::{Folder, afflicted, rates, without_rig};

#[test]
fn the_report_is_all_that_is_printed_and_the_json_file_says_the_same() {
    let folder = Folder::of(afflicted(rates(5), "clk.time_offset", 3.0).record("run.csv"));
    let ended = folder.run("diagnose run.csv --json out.json").with(0);
    assert_eq!(ended.err, "");
    assert!(!ended.out.contains(['\u{1b}', '\r', '\u{8}']), "{ended:#?}");
    let json: Value = serde_json::from_str(&folder.text("out.json")).expect("JSON");
    assert!(ended.out.starts_with("run.csv: "), "{ended:#?}");
    for cause in json["causes"].as_array().unwrap() {
        assert!(ended.out.contains(cause["effect"].as_str().unwrap()), "{ended:#?}");
    }
    assert!(ended.out.contains("gap, rms of means over blocks") && !ended.out.contains("NaN"), "{ended:#?}");
    assert!(ended.out.lines().all(|line| line.chars().count() <= 80), "{ended:#?}");
}

#[test]
fn json_on_standard_output_stands_alone() {
    let folder = Folder::with(&rates(5), without_rig);
    let ended = folder.run("diagnose run.csv --json -").with(1);
    let value: Value = serde_json::from_str(&ended.out).expect("JSON and nothing else");
    assert_eq!((&value["format"], ended.err.as_str()), (&"imucal-diagnosis/1".into(), ""));
}

#[test]
fn the_list_names_every_effect_of_the_catalogue_and_of_the_contract() {
    let folder = Folder::of(rates(5).record("run.csv"));
    let out = folder.run("diagnose --list").with(0).out;
    let ids: Vec<&str> = out.lines().filter(|line| line.contains('.') && !line.starts_with(' ')).collect();
    assert!(CATALOGUE.iter().all(|effect| ids.contains(&effect.id.as_str())), "{ids:?}");
    for id in ["rig.level_tilt", "acc.scale_cubic", "gyr.earth_rate", "mag.eddy_current", "clk.rate_error"] {
        assert!(ids.contains(&id), "{id}");
    }
    for part in ["what:", "to do:", "needs:", "usually", "matters from", "distinguish by:"] {
        assert!(out.contains(part), "{part}");
    }
}
