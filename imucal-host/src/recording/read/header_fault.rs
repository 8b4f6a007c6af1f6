//! What is wrong with the columns of a samples file; all of it is said at once.

/// A fault of the header; its text says what was found, what was expected and what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)] // The fields are those of each message.
pub enum HeaderFault {
    /// Columns that no comma separates.
    #[error(
        "found {found} between the columns, expected commas; separate columns by commas, and write numbers with a decimal point"
    )]
    Separator { found: &'static str },
    /// Names next to ones of the contract.
    #[error("{}; rename {}", misspelt(.columns), advice(.columns))]
    Misspelt { columns: Vec<MisspeltColumn> },
    /// No `t`.
    #[error(
        "found no column `t` among {found}, expected the sample time in a column named `t`; rename the time column, and separate columns by commas"
    )]
    NoTime { found: String },
    /// Some, but not all columns that belong together.
    #[error(
        "{} missing, found {found}, expected all of {expected} or none; add the {} (empty where not measured) or remove the others",
        columns_are(.missing),
        if .missing.len() == 1 { "column" } else { "columns" }
    )]
    Incomplete { missing: Vec<&'static str>, found: String, expected: String },
    /// Names that occur twice.
    #[error("found the column {found} twice, expected each name once; remove or rename one")]
    Duplicate { found: String },
}

/// A name and the one that it probably stands for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MisspeltColumn {
    /// Name in the header.
    pub found: String,
    /// Name of the contract.
    pub expected: &'static str,
    /// A unit stands behind the name.
    pub unit: bool,
}

fn misspelt(columns: &[MisspeltColumn]) -> String {
    match columns {
        [one] => format!("found the column {}, expected `{}`", quoted(&one.found), one.expected),
        many => {
            let pairs = many.iter().map(|each| format!("{} for `{}`", quoted(&each.found), each.expected));
            format!("found the columns {}", listed(pairs))
        }
    }
}

fn advice(columns: &[MisspeltColumn]) -> String {
    let so = if columns.len() == 1 {
        "it so, or to something less like it if it is another quantity"
    } else {
        "them so, or to something less like it where one is another quantity"
    };
    let units = if columns.iter().any(|each| each.unit) {
        "; the unit goes below [units] of the manifest"
    } else {
        ""
    };
    format!("{so}{units}")
}

fn columns_are(names: &[&str]) -> String {
    match names {
        [one] => format!("column `{one}` is"),
        many => format!("columns {} are", names_listed(many)),
    }
}

/// Names in a message, as many as can be read.
pub(crate) fn names_listed(names: &[&str]) -> String {
    listed(names.iter().map(|name| quoted(name)))
}

fn listed(items: impl ExactSizeIterator<Item = String>) -> String {
    /// No more of a foreign header than can be read.
    const MOST: usize = 24;
    let count = items.len();
    let shown: Vec<String> = items.take(MOST).collect();
    let more = count.saturating_sub(MOST);
    if more == 0 { shown.join(", ") } else { format!("{} and {more} more", shown.join(", ")) }
}

/// On one line: line ends, tabs and other control characters are shown as escapes.
fn quoted(name: &str) -> String {
    const LONGEST: usize = 60;
    let shown = |c: char| if c.is_control() { c.escape_default().to_string() } else { c.to_string() };
    let text: String = name.chars().take(LONGEST).map(shown).collect();
    let rest = if name.chars().nth(LONGEST).is_some() { "…" } else { "" };
    format!("`{text}{rest}`")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_shown_on_one_line_and_cut_where_it_is_long() {
        assert_eq!(quoted("a line\nand\tanother"), "`a line\\nand\\tanother`");
        assert_eq!(quoted(&"µ".repeat(60)), format!("`{}`", "µ".repeat(60)));
        assert_eq!(quoted(&"µ".repeat(61)), format!("`{}…`", "µ".repeat(60)));
    }
}
