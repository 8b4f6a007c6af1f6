//! Where in a file something was found.

use std::fmt;

/// A place in a samples file, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Place {
    /// Line of a text file; its header counts.
    Line(u64),
    /// Row of a file without lines.
    Row(u64),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Row(row) => write!(f, "row {row}"),
        }
    }
}

/// Where a message is about a line, if the file has lines.
pub(super) fn at_line(line: &Option<impl fmt::Display>) -> String {
    line.as_ref().map(|line| format!(", line {line}")).unwrap_or_default()
}

/// The places of a table's rows.
#[derive(Clone, Debug)]
pub(crate) enum Places {
    /// The line of each row; blank lines and quoted line ends make it more than a count.
    Lines(Vec<u64>),
    /// Rows are numbered, after so many of the parts before.
    Rows { before: u64 },
}

impl Places {
    /// Rows of a whole file.
    pub(crate) const WHOLE: Self = Self::Rows { before: 0 };

    /// Place of a row counted from 0.
    pub(crate) fn of(&self, row: usize) -> Place {
        let numbered = row as u64 + 1;
        match self {
            Self::Lines(lines) => Place::Line(lines.get(row).copied().unwrap_or(numbered)),
            Self::Rows { before } => Place::Row(before + numbered),
        }
    }
}
