//! The columns of an unknown file, and the command that reads it.

use std::path::Path;

use crate::recording::layout_guess::LayoutGuess;

/// A value is shown up to here, characters.
const WIDEST: usize = 24;

/// What each column probably is, and the command with the options that say so.
pub fn guess(guess: &LayoutGuess, command: &str, path: &Path) -> String {
    let width = guess.columns.iter().map(|column| shown(&column.name).chars().count()).max().unwrap_or(0);
    let mut text = "Its columns are probably these:\n".to_owned();
    for column in &guess.columns {
        let name = shown(&column.name);
        let meaning = column.meaning.unwrap_or("not known, and kept as it is");
        text += &format!("  {name:<width$}  {meaning}, first {}\n", shown(&column.first));
    }
    for kind in &guess.unknown_units {
        text += &format!(
            "  The unit of {kind} is not clear: add it to --unit, such as {kind}={}\n",
            if *kind == crate::recording::SensorKind::Gyr {
                "deg/s, or 16.4/deg/s for counts"
            } else {
                "g, or 16384/g for counts"
            }
        );
    }
    let mut words = vec!["imucal".to_owned(), command.to_owned(), quoted(&path.display().to_string())];
    words.extend(guess.options.iter().map(|option| quoted(option)));
    text + &format!("Then this reads it:\n  {}", words.join(" "))
}

fn shown(text: &str) -> String {
    let cut: String = text.chars().take(WIDEST).collect();
    if cut.len() < text.len() { cut + "…" } else { cut }
}

/// As a shell takes it for one word.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=,:@%+".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_with_blanks_or_quotes_is_quoted_for_a_shell() {
        assert_eq!(quoted("acc=ax,ay,az"), "acc=ax,ay,az");
        assert_eq!(quoted("Acc X [g]"), "'Acc X [g]'");
        assert_eq!(quoted("it's"), "'it'\\''s'");
    }
}
