//! `imucal capture`: the session of a device, guided, over a recording.

use super::Folder;

#[test]
fn a_session_is_guided_to_its_targets_and_its_record_corrects_the_recording() {
    let folder = Folder::with_recording();
    let parts = [
        "keep it still",
        "point up, then keep it still for 2 s",
        "enough: every sensor has reached its target",
        "accelerometer  accepted, expected error",
        "% of the directions by",
    ];
    folder.run("capture small.csv --target 1,1,1 --record own.bin --out own.toml").with(0).printing(&parts);
    folder.run("inspect own.bin").with(0).printing(&["intact", "accelerometer (T9)", "gyroscope (K9)"]);
    folder.run("apply small.csv --calibration own.bin").with(0);
    let (own, toml) = (folder.bytes("own.bin"), folder.bytes("own.toml"));
    assert!(!own.is_empty() && toml.starts_with(b"format"));
}

#[test]
fn a_gyroscope_with_two_axes_swapped_is_refused_with_the_columns_to_mend() {
    let folder = Folder::with_recording();
    let text = folder.text("small.csv");
    let (head, rows) = text.split_once('\n').expect("a header");
    let head = head.replace("gyr_x,gyr_y", "gyr_y,gyr_x");
    folder.write("swapped.csv", format!("{head}\n{rows}"));
    folder.write("swapped.toml", folder.text("small.toml"));
    folder.run("capture swapped.csv --target 1,1,1 --record own.bin").with(1).printing(&[
        "end here: the sensors disagree on the axes",
        "gyroscope is not calibrated: gyr.axis_swap (gyr_x and gyr_y are swapped)",
        "turns go against",
    ]);
}

#[test]
fn a_target_that_is_not_reached_is_a_refusal_that_says_how_far_it_is() {
    let folder = Folder::with_recording();
    folder.run("capture small.csv --target 1e-3,1e-3,1e-3").with(1).printing(&["target 0.001000 %"]);
}

#[test]
fn targets_and_speeds_that_mean_nothing_are_bad_usage() {
    let folder = Folder::with_recording();
    folder.run("capture small.csv --target 1,1,101").with(2);
    folder.run("capture small.csv --target 1,1").with(2);
    folder.run("capture small.csv --speed 0").with(2);
}
