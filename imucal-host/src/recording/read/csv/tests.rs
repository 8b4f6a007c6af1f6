use nalgebra::Vector3;

use crate::recording::{
    Warning,
    fixture::{Fixture, assert_says, csv},
};

const HEADER: &str = "t,acc_x,acc_y,acc_z\n";

fn rows(lines: &str) -> String {
    format!("{HEADER}{lines}")
}

#[test]
fn a_file_with_mark_blanks_and_windows_line_ends_is_read() {
    let recording = csv("\u{feff}acc_x, t ,acc_y,acc_z\r\n1,0.5,2,9.5\r\n\r\n 1 , 1.5 ,NaN,9\r\n").read();
    assert_eq!(recording.time, [0.5, 1.5]);
    let acc = recording.acc.unwrap().values;
    assert_eq!(acc[0], Vector3::new(1.0, 2.0, 9.5));
    assert!(acc[1].y.is_nan() && acc[1].x == 1.0);
    let assumed = |warning: &Warning| matches!(warning, Warning::UnitsAssumed { .. });
    assert!(recording.warnings.iter().all(assumed), "{:?}", recording.warnings);
    assert_eq!(recording.name, "run.csv");
}

#[test]
fn gimbal_reference_segment_and_temperature_are_read() {
    let header = "t,gimbal_outer,gimbal_middle,gimbal_inner,ref_qw,ref_qx,ref_qy,ref_qz,segment,temp";
    let text = format!("{header}\n0,180,0,-90,1,0,0,0,3,21.5\n1,,,,,,,,,\n");
    let recording = Fixture::new("run.csv", "[units]\ngimbal = \"deg\"\n", text).read();
    let gimbal = recording.gimbal.unwrap();
    assert!((gimbal[0][0] - std::f64::consts::PI).abs() < 1e-15 && gimbal[1][2].is_nan());
    assert_eq!(recording.reference.unwrap()[0], [1.0, 0.0, 0.0, 0.0]);
    assert_eq!(recording.segment.unwrap(), [Some(3), None]);
    assert_eq!(recording.temperature.unwrap()[0], 21.5);
}

#[test]
fn unknown_columns_are_kept_as_they_are_and_reported() {
    let fixture = csv("t,acc_x,acc_y,acc_z,note\n0,0,0,9.8,\"a, b\"\n1,0,0,9.8,007\n");
    assert_eq!(fixture.read().extra[0].values, ["a, b", "007"]);
    assert_says(&fixture.warnings()[0], &["run.csv, line 1, column `note`", "kept as it is", "rename"]);
}

#[test]
fn text_in_a_number_column_names_line_column_and_text() {
    let message = csv(rows("0,0,0,9.8\n1,0,zero,9.8\n2,0,0,9.8\n")).error();
    assert_says(&message, &["run.csv, line 3, column `acc_y`", "`zero`", "expected a number", "correct it"]);
}

#[test]
fn text_in_place_of_a_time_says_which_are_understood() {
    let message = csv(rows("05/01/2026 12:00:00,0,0,9.8\n")).error();
    assert_says(&message, &["line 2, column `t`", "`05/01/2026 12:00:00`", "ISO 8601", "12:00:00.125"]);
    let mixed = csv(rows("2026-05-01T12:00:00Z,0,0,9.8\n0.5,0,0,9.8\n")).error();
    assert_says(&mixed, &["line 3, column `t`", "`0.5`", "all times of the column in one of these ways"]);
}

#[test]
fn lines_are_counted_with_the_blank_ones() {
    assert_says(&csv(rows("0,0,0,9.8\n\n\n1,0,x,9.8\n")).error(), &["line 5"]);
    let windows = "t,acc_x,acc_y,acc_z\r\n0,0,0,9.8\r\n\r\n1,0,x,9.8\r\n";
    assert_says(&csv(windows).error(), &["line 4"]);
    assert_says(&csv(windows.replace("\r\n\r\n", "\r\n")).error(), &["line 3"]);
}

#[test]
fn infinity_is_refused() {
    let message = csv(rows("0,0,0,9.8\n1,0,0,-inf\n")).error();
    assert_says(&message, &["line 3, column `acc_z`", "`-inf`", "expected a finite", "leave it empty"]);
}

#[test]
fn a_line_with_another_number_of_fields_is_refused() {
    let few = csv(rows("0,0,0,9.8\n1,0,0\n2,0,0,9.8\n")).error();
    assert_says(&few, &["run.csv, line 3", "found 3 fields, expected 4", "correct or remove"]);
    assert_says(&csv(rows("0,0,0,9.8,5\n")).error(), &["line 2", "found 5 fields"]);
    // A line end says that the line was meant so.
    assert_says(&csv(rows("0,0,0,9.8\n1,0\n")).error(), &["line 3", "found 2 fields"]);
}

#[test]
fn a_cut_last_line_is_dropped_with_a_warning() {
    for cut in ["1,0", "1,0,0,", "1,0,0,-", "1", "1,0,0,9e"] {
        let fixture = csv(rows(&format!("0,0,0,9.8\n{cut}")));
        assert_eq!(fixture.read().rows(), 1, "{cut}");
        assert_says(&fixture.warnings()[0], &["run.csv, line 3", "of 4 whole fields", "dropped", "again"]);
    }
}

#[test]
fn a_whole_last_line_without_line_end_is_kept_with_a_warning() {
    let fixture = csv(rows("0,0,0,9.8\n1,0,0,9.8"));
    assert_eq!(fixture.read().rows(), 2);
    assert_says(&fixture.warnings()[0], &["line 3", "no line end", "`9.8`", "column `acc_z`"]);
}

#[test]
fn a_stray_quote_that_swallows_lines_is_no_cut_line() {
    let message = csv(rows("0,0,0,9.8\n1,0,0,\"9.8\n2,0,0,9.8\n3,0,0,9.8")).error();
    assert_says(&message, &["line 3"]);
}

#[test]
fn a_missing_file_and_another_ending_are_refused() {
    let fixture = csv(rows("0,0,0,9.8\n"));
    let read = |name: &str| {
        crate::recording::Recording::read(&fixture.folder.path().join(name)).unwrap_err().to_string()
    };
    assert_says(&read("none.csv"), &["none.csv", "no such file", "check the path"]);
    assert_says(&read("run.toml"), &["run.toml", "`.toml`", "expected .csv", "give the samples file"]);
}
