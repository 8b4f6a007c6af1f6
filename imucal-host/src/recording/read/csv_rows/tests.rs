use proptest::prelude::*;

use super::{
    super::{number, text::tests::packed},
    Rows,
};
use crate::{
    file::Limits,
    recording::{
        Recording,
        fixture::{Fixture, assert_says, csv},
    },
};

const SMALL: Limits = Limits { size: 1 << 14, columns: 10 };

/// A row by its line and its fields, read as a recording's are.
type Row = (u64, Vec<Option<u64>>);

fn bits(field: &[u8]) -> Option<u64> {
    number::parse(field).ok().map(f64::to_bits)
}

fn rows_of(text: &[u8], columns: usize) -> Vec<Row> {
    let fixture = csv(text);
    let mut rows = Rows::open(&fixture.path, &SMALL).unwrap();
    let (mut read, mut values) = (Vec::new(), vec![0.0; columns]);
    loop {
        let of_numbers = rows
            .numbers(&mut values)
            .unwrap()
            .map(|line| (0..columns).map(|k| bits(line.field(k))).collect::<Vec<_>>());
        if let Some(fields) = of_numbers {
            assert_eq!(fields, values.iter().map(|value| Some(value.to_bits())).collect::<Vec<_>>());
            read.push((rows.line, fields));
        } else if rows.advance().unwrap() {
            read.push((rows.line, rows.fields().map(bits).collect()));
        } else {
            return read;
        }
    }
}

/// The same by the parser alone, whose lines end with a line feed or a carriage return.
fn rows_of_parser(text: &[u8]) -> Vec<Row> {
    let mut reader = ::csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(text);
    let row = |record: ::csv::ByteRecord| {
        let start = record.position().map_or(0, |position| position.byte() as usize);
        let skipped = text[start..].iter().take_while(|byte| matches!(byte, b'\n' | b'\r')).count();
        let line = 1 + super::count_lines(&text[..start + skipped]);
        (line, record.iter().map(bits).collect())
    };
    reader.byte_records().map(|record| row(record.unwrap())).collect()
}

proptest! {
    #[test]
    fn rows_and_their_lines_are_those_of_the_parser(
        lines in prop::collection::vec("([0-9]{1,2}(\\.[0-9]{1,18})?,){2}-?[0-9]{1,3}(e-?[0-9])?|[0-9.,\" e-]{0,12}", 0..12),
        ends in prop::collection::vec(prop::sample::select(vec!["\n", "\r\n", "\r", "\n\n"]), 12),
    ) {
        let text: String = lines.iter().zip(&ends).flat_map(|(line, end)| [line.as_str(), end]).collect();
        // More fields than the limit are refused.
        prop_assume!(lines.iter().all(|line| line.matches(',').count() < 9));
        prop_assert_eq!(rows_of(text.as_bytes(), 3), rows_of_parser(text.as_bytes()));
    }
}

fn error(fixture: &Fixture) -> String {
    Recording::read_within(&fixture.path, &SMALL).unwrap_err().to_string()
}

#[test]
fn comments_before_the_header_are_passed_over_with_a_warning_and_lines_still_counted() {
    let samples = "0,0,0,9.8\n1,0,0,9.8\n";
    let commented = csv(format!("# made by a logger\n#\n\n% 100 Hz, raw\nt,acc_x,acc_y,acc_z\n{samples}"));
    assert_eq!(commented.read().rows(), 2);
    assert_says(
        &commented.warnings().join("\n"),
        &["run.csv: comments before the header were passed over", "# or %: 3"],
    );
    let bad = csv(format!("# made by a logger\nt,acc_x,acc_y,acc_z\n{samples}2,0,x,9.8\n"));
    assert_says(&bad.error(), &["line 5"]);
    // What NumPy writes; then a header that begins as a comment, and a comment behind the header.
    let marked = csv(format!("# run 7\n# t,acc_x,acc_y,acc_z\n{samples}"));
    assert_eq!(marked.read().rows(), 2);
    assert_says(&marked.warnings().join("\n"), &["# or %: 1)"]);
    assert_says(&csv(format!("#t,acc_x,acc_y,acc_z\n{samples}")).error(), &["line 1", "#t"]);
    assert_says(&csv(format!("t,acc_x,acc_y,acc_z\n# late\n{samples}")).error(), &["line 2"]);
    // What is said of the header names its own line.
    let odd = csv("# run 7\n\nt,acc_x,acc_y,acc_z,lamp\n0,0,0,9.8,1\n");
    assert_says(&odd.warnings().join("\n"), &["run.csv, line 3, column `lamp`"]);
    assert_says(&csv(format!("# run 7\nt,acc_x,acc_y\n{samples}")).error(), &["line 2: "]);
}

#[test]
fn a_line_that_does_not_end_is_refused_at_its_limit() {
    for text in ["0".repeat(700), format!("t,temp\n\n0,{}\n", "0".repeat(700))] {
        assert_says(&error(&csv(&text)), &["longer than 640 bytes", "raise the limit with --max-columns"]);
    }
    assert_says(&error(&csv(format!("t\n\n{}", "0".repeat(700)))), &["run.csv, line 3"]);
}

#[test]
fn more_columns_than_allowed_are_refused() {
    let message = error(&csv(",".repeat(10)));
    assert_says(&message, &["run.csv, line 1", "more than 10 columns", "--max-columns"]);
    let known = "t,acc_x,acc_y,acc_z,a,b,c,d,e,f\n0,0,0,9.8,,,,,,\n";
    assert_eq!(Recording::read_within(&csv(known).path, &SMALL).unwrap().extra.len(), 6);
}

#[test]
fn a_text_beyond_its_limit_is_refused_also_when_compressed() {
    let text = "\n".repeat(1 << 15);
    let found = ["more than 16 KiB", "raise the limit with --max-size"];
    assert_says(&error(&csv(&text)), &found);
    assert_says(&error(&Fixture::new("run.csv.gz", "", packed(&text))), &found);
}

#[test]
fn samples_are_counted_by_the_memory_that_they_take() {
    // 5 bytes of text a row, and 40 bytes of numbers and line.
    let rows: String = (0..1000).map(|row| format!("{}{:02},,,\n", row / 100, row % 100)).collect();
    let text = format!("t,acc_x,acc_y,acc_z\n{rows}");
    assert!(text.len() < 1 << 14);
    assert_says(&error(&csv(&text)), &["samples", "more than 16 KiB", "--max-size"]);
    let half = &text[..text.len() / 3];
    assert!(Recording::read_within(&csv(half).path, &SMALL).is_ok());
    // An empty text has no character, and takes memory all the same.
    let extra: String = (0..200).map(|row| format!("{row},,,\n")).collect();
    assert_says(&error(&csv(format!("t,a,b,c\n{extra}"))), &["samples", "more than 16 KiB"]);
}
