//! What a command prints.

use std::{
    fmt::{Arguments, Display},
    io::{ErrorKind, Write},
};

use anyhow::Context;

/// A line on standard output. A reader that has closed the pipe has read all it wanted, which is no failure.
pub(super) fn line(text: Arguments<'_>) -> anyhow::Result<()> {
    match writeln!(std::io::stdout(), "{text}") {
        Err(cause) if cause.kind() != ErrorKind::BrokenPipe => {
            Err(cause).context("standard output cannot be written; check where it leads")
        }
        _ => Ok(()),
    }
}

/// A line on standard output, as `println!`, but a failure is an error and a closed pipe is none.
macro_rules! say {
    ($($part:tt)*) => { $crate::cli::output::line(format_args!($($part)*))? };
}
pub(super) use say;

/// Text that ends its own lines.
pub(super) fn text(text: &str) -> anyhow::Result<()> {
    line(format_args!("{}", text.strip_suffix('\n').unwrap_or(text)))
}

/// A line for the user on standard error; where nobody can read it, nobody is there to read.
pub(super) fn report(what: &str, message: &dyn Display) {
    let _ = writeln!(std::io::stderr(), "imucal: {what}: {message}");
}
