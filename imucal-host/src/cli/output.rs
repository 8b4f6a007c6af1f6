//! What a command prints: how much, how wide, and in which colours.
//!
//! Reports are at most 80 columns wide and coloured on a terminal, unless `NO_COLOR` is set. What was asked for as a document
//! (JSON, another program's settings) is printed as it is. In all else control characters, which names and texts of files can have, are
//! printed as escapes, since a terminal would obey them.

use std::{
    borrow::Cow,
    fmt::{Arguments, Display},
    io::{ErrorKind, Write},
    sync::OnceLock,
};

use anstyle::{AnsiColor, Style};
use anyhow::Context;

use crate::report::prose::fitted;

/// How much is printed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Volume {
    /// Errors, refusals and documents.
    Quiet,
    /// Reports and warnings too.
    #[default]
    Usual,
    /// Also each stage of the work.
    Verbose,
}

static VOLUME: OnceLock<Volume> = OnceLock::new();

/// Sets how much is printed, once.
pub(super) fn set_volume(volume: Volume) {
    let _ = VOLUME.set(volume);
}

/// How much is printed.
pub(super) fn volume() -> Volume {
    VOLUME.get().copied().unwrap_or_default()
}

/// A line of a report on standard output. A reader that has closed the pipe has read all it wanted, which is no failure.
pub(super) fn line(text: Arguments<'_>) -> anyhow::Result<()> {
    if volume() == Volume::Quiet {
        return Ok(());
    }
    let text = fitted(&visible(&text.to_string()));
    let painted: Vec<String> = text.split('\n').map(painted).collect();
    write(&painted.join("\n"))
}

/// A line on standard output, as `println!`, but a failure is an error and a closed pipe is none.
macro_rules! say {
    ($($part:tt)*) => { $crate::cli::output::line(format_args!($($part)*))? };
}
pub(super) use say;

/// A report that ends its own lines.
pub(super) fn text(text: &str) -> anyhow::Result<()> {
    line(format_args!("{}", text.strip_suffix('\n').unwrap_or(text)))
}

/// What was asked for on standard output, as it is; it ends its own lines.
pub(super) fn document(text: &str) -> anyhow::Result<()> {
    write(text.strip_suffix('\n').unwrap_or(text))
}

fn write(text: &str) -> anyhow::Result<()> {
    match writeln!(anstream::stdout(), "{text}") {
        Err(cause) if cause.kind() != ErrorKind::BrokenPipe => {
            Err(cause).context("standard output cannot be written; check where it leads")
        }
        _ => Ok(()),
    }
}

/// A line for the user on standard error; where nobody can read it, nobody is there to read.
pub(super) fn report(what: &str, message: &dyn Display) {
    let style = match what {
        "error" | "refused" => BAD,
        "warning" if volume() == Volume::Quiet => return,
        "warning" => DOUBT,
        _ => Style::new(),
    };
    let message = message.to_string();
    let _ = writeln!(anstream::stderr(), "imucal: {style}{what}{style:#}: {}", visible(&message));
}

/// A text with its control characters, but for ends of lines and tabs, as escapes; so are those that reverse the direction of a text.
fn visible(text: &str) -> Cow<'_, str> {
    let obeyed = |c: char| {
        let turns = matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
        turns || (c.is_control() && !matches!(c, '\n' | '\t'))
    };
    if !text.contains(obeyed) {
        return text.into();
    }
    let shown = |c: char| if obeyed(c) { c.escape_unicode().to_string() } else { c.to_string() };
    text.chars().map(shown).collect()
}

const GOOD: Style = AnsiColor::Green.on_default().bold();
const DOUBT: Style = AnsiColor::Yellow.on_default().bold();
const BAD: Style = AnsiColor::Red.on_default().bold();

/// Answers, where a line has one behind its first colon; the longer of two with the same beginning first.
const ANSWERS: [(&str, Style); 14] = [
    ("accepted", GOOD),
    ("SUSPECT", DOUBT),
    ("REFUSED", BAD),
    ("refused", BAD),
    ("PARTLY EXPLAINED", DOUBT),
    ("EXPLAINED", GOOD),
    ("AMBIGUOUS", DOUBT),
    ("UNKNOWN", BAD),
    ("NO GAP", GOOD),
    ("NOT TESTABLE", BAD),
    ("the calibration still fits", GOOD),
    ("the calibration no longer fits", BAD),
    ("no parameter has moved beyond chance", GOOD),
    ("moved beyond chance", DOUBT),
];

/// A line with its answer in colour.
fn painted(line: &str) -> String {
    let Some((head, rest)) = line.split_once(": ") else { return line.to_owned() };
    match ANSWERS.iter().find(|(answer, _)| rest.starts_with(answer)) {
        Some((answer, style)) => format!("{head}: {style}{answer}{style:#}{}", &rest[answer.len()..]),
        None => line.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_would_obey_is_printed_as_an_escape() {
        assert_eq!(visible("acc_x, °/s\n\tµT"), "acc_x, °/s\n\tµT");
        assert_eq!(visible("\u{1b}[2Jname\r\u{202e}"), "\\u{1b}[2Jname\\u{d}\\u{202e}");
    }

    #[test]
    fn the_answer_of_a_line_is_coloured_and_nothing_else() {
        assert_eq!(
            painted("gyroscope (K9): REFUSED, no-motion"),
            "gyroscope (K9): \u{1b}[1m\u{1b}[31mREFUSED\u{1b}[0m, no-motion"
        );
        for plain in ["no colon, accepted", "a file: that was accepted", ""] {
            assert_eq!(painted(plain), plain);
        }
    }
}
