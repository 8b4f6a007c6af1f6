//! What is wrong with a file of effects, or with a formula.

use std::{io, path::PathBuf};

use crate::file::ReadFault;

/// Why a formula cannot be understood. Columns count characters from one.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)] // The fields are those of each message.
pub enum FormulaFault {
    /// Of text.
    #[error("found {found} characters, expected at most {most}; shorten it")]
    TooLong { found: usize, most: usize },
    /// Of parentheses, functions and signs.
    #[error("found more than {most} parts within one another, expected at most {most}; write it flatter")]
    TooDeep { most: usize },
    /// Of operators and functions.
    #[error("found more than {most} operators and functions, expected at most {most}; shorten it")]
    TooManyOperations { most: usize },
    /// `lag` and `mean`.
    #[error(
        "found more than {most} of `lag` and `mean` within one another, expected at most {most}; write it flatter"
    )]
    HistoryTooDeep { most: usize },
    /// Something else than what can stand there.
    #[error("found {found} at column {column}, expected {expected}; correct it there")]
    Unexpected { column: usize, found: String, expected: &'static str },
    /// No number.
    #[error(
        "found `{found}` at column {column}, expected a finite number such as 0.5 or 1e-3; correct it there"
    )]
    Number { column: usize, found: String },
    /// No input, shape or constant.
    #[error(
        "found the name `{found}` at column {column}, expected an input, a shape of the entry or `pi`; {}",
        advice(nearest.as_deref(), "name a shape in `shape`, or use a_x, w_x, wd_x, B_x, y_x (and y, z), temp, temp_rate, t, outer, middle, inner and their rates")
    )]
    UnknownName { column: usize, found: String, nearest: Option<String> },
    /// No function.
    #[error(
        "found the function `{found}` at column {column}, expected one that there is; {}",
        advice(nearest.as_deref(), "use for instance sin, tanh, exp, sqrt, abs, sign, min, max, lag or mean")
    )]
    UnknownFunction { column: usize, found: String, nearest: Option<String> },
    /// Of a function.
    #[error(
        "found {found} argument(s) of `{function}` at column {column}, expected {expected}; correct it there"
    )]
    Arguments { column: usize, function: String, found: usize, expected: usize },
    /// Of `lag` or `mean`.
    #[error(
        "found no positive time as the second argument of `{function}` at column {column}, expected a number of seconds above zero or a shape; correct it there"
    )]
    Time { column: usize, function: String },
}

fn advice(nearest: Option<&str>, else_say: &str) -> String {
    nearest.map_or_else(|| else_say.to_owned(), |name| format!("did you mean `{name}`?"))
}

/// Why an entry is no effect.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)] // The fields are those of each message.
pub enum EntryFault {
    /// Of its formula.
    #[error("formula `{text}`: {cause}")]
    Formula { text: String, cause: FormulaFault },
    /// Of a key.
    #[error("`{key}` is {found}, expected {expected}; correct it")]
    Value { key: String, found: String, expected: &'static str },
    /// An id that the catalogue has.
    #[error("`id` is that of an effect of the program, expected one of your own; choose another name")]
    Taken,
    /// Twice, with different content.
    #[error("`id` is that of line {line} too, where the entry is another, expected each once; rename one")]
    Twice { line: usize },
    /// A shape that its formula does not contain.
    #[error("the shape `{name}` is not in the formula, expected all of them to be; leave it out or use it")]
    Unused { name: String },
}

/// A file of effects that cannot be used; its text says what was found, what was expected and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)] // The fields are those of each message.
pub enum UserEffectError {
    /// The system refuses.
    #[error("{}: cannot be read: {cause}; check the path", path.display())]
    File { path: PathBuf, cause: io::Error },
    /// Too long a file.
    #[error("{}: found {found}, expected a file of effects; check the path", path.display())]
    TooLarge { path: PathBuf, found: String },
    /// No text.
    #[error("{}, line {line}: found bytes that are no UTF-8 text, expected TOML; save it as UTF-8", path.display())]
    NotUtf8 { path: PathBuf, line: usize },
    /// No TOML, or other keys.
    #[error("{}, line {line}: found {found}, expected [[effect]] entries; correct it there", path.display())]
    Syntax { path: PathBuf, line: usize, found: String },
    /// Too many entries, or none.
    #[error("{}: found {found} effects, expected 1 to {most}; split the file", path.display())]
    Count { path: PathBuf, found: usize, most: usize },
    /// Of one entry.
    #[error("{}, line {line}: effect `{id}`: {cause}", path.display())]
    Entry { path: PathBuf, line: usize, id: String, cause: Box<EntryFault> },
}

impl UserEffectError {
    pub(super) fn of(path: PathBuf, fault: ReadFault) -> Self {
        match fault {
            ReadFault::System(cause) => Self::File { path, cause },
            fault @ ReadFault::TooLarge { .. } => Self::TooLarge { path, found: fault.to_string() },
        }
    }
}
