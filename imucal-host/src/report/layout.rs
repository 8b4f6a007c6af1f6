//! The columns of an unknown file, and the command that reads it, or a log.

use std::path::Path;

use crate::recording::layout_guess::LayoutGuess;

/// Columns of a usual log.
const NAMES: [&str; 10] =
    ["t", "acc_x", "acc_y", "acc_z", "gyr_x", "gyr_y", "gyr_z", "mag_x", "mag_y", "mag_z"];
/// A value is shown up to here, characters.
const WIDEST: usize = 24;

/// What each column probably is, and the command with the options that say so.
pub fn guess(guess: &LayoutGuess, command: &str, path: &Path) -> String {
    let mut text = columns(guess);
    let how = if guess.unknown_units.is_empty() {
        "Then this reads it:"
    } else {
        "Then this reads it, with a unit such as g or deg/s in place of UNIT, or for counts how many make one, such as 16384/g:"
    };
    text += &format!("{how}\n  {}", line(command, path, &with_unknown_units(guess)));
    text
}

/// The command with some options, such as those that choose a topic.
pub fn command(command: &str, path: &Path, options: &[String]) -> String {
    format!("For example:\n  {}", line(command, path, options))
}

/// What a file whose first line is numbers lacks: names of so many columns, such as these.
pub fn names_wanted(fields: usize) -> String {
    // Times, and as many whole sensors as there are columns for.
    let sensors = (fields.saturating_sub(1) / 3).clamp(1, 3);
    let names = &NAMES[..1 + 3 * sensors];
    let more = if fields > names.len() { ",…" } else { "" };
    format!(
        "Its first line holds numbers, not names. Put a line with a name for each of its {fields} columns before it, such as:\n  {}{more}",
        names.join(",")
    )
}

fn line(command: &str, path: &Path, options: &[String]) -> String {
    let mut words = vec!["imucal".to_owned(), command.to_owned(), quoted(&path.display().to_string())];
    words.extend(options.iter().map(|option| quoted(option)));
    words.join(" ")
}

/// What each column probably is, a line each.
pub fn columns(guess: &LayoutGuess) -> String {
    let width = guess.columns.iter().map(|column| shown(&column.name).chars().count()).max().unwrap_or(0);
    let mut text = "Its columns are probably these:\n".to_owned();
    for column in &guess.columns {
        let name = shown(&column.name);
        let meaning = column.meaning.unwrap_or("not known, and kept as it is");
        text += &format!("  {name:<width$}  {meaning}, first {}\n", shown(&column.first));
    }
    text
}

/// The options, and a place for each unit that neither name nor numbers say.
pub fn with_unknown_units(guess: &LayoutGuess) -> Vec<String> {
    let mut options = guess.options.clone();
    let unknown: Vec<String> = guess.unknown_units.iter().map(|kind| format!("{kind}=UNIT")).collect();
    if unknown.is_empty() {
        return options;
    }
    let unknown = unknown.join(",");
    match options.iter().position(|option| option == "--unit").and_then(|at| options.get_mut(at + 1)) {
        Some(units) => *units = format!("{units},{unknown}"),
        None => options.extend(["--unit".to_owned(), unknown]),
    }
    options
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
    use crate::recording::SensorKind;

    #[test]
    fn a_unit_that_is_not_clear_has_its_place_in_the_command() {
        let of = |options: &[&str]| {
            let guess = LayoutGuess {
                columns: Vec::new(),
                options: options.iter().map(|option| (*option).to_owned()).collect(),
                unknown_units: vec![SensorKind::Gyr],
            };
            super::guess(&guess, "calibrate", Path::new("log.csv"))
        };
        assert!(of(&[]).ends_with("in place of UNIT, or for counts how many make one, such as 16384/g:\n  imucal calibrate log.csv --unit gyr=UNIT"));
        assert!(of(&["--unit", "acc=g"]).ends_with("--unit acc=g,gyr=UNIT"));
    }

    #[test]
    fn a_word_with_blanks_or_quotes_is_quoted_for_a_shell() {
        assert_eq!(quoted("acc=ax,ay,az"), "acc=ax,ay,az");
        assert_eq!(quoted("Acc X [g]"), "'Acc X [g]'");
        assert_eq!(quoted("it's"), "'it'\\''s'");
    }
}
