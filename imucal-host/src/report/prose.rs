//! Sentences and lists that fit a terminal.

/// Widest line, characters.
const WIDTH: usize = 80;

/// Words behind `head`, broken at blanks, further lines indented as far; ends its last line.
pub fn hanging(head: &str, words: &str) -> String {
    let indent = head.chars().count();
    let mut text = head.to_owned();
    let mut column = indent;
    for (index, word) in words.split_whitespace().enumerate() {
        let length = word.chars().count();
        if index > 0 && column + 1 + length > WIDTH {
            text.push('\n');
            text.push_str(&" ".repeat(indent));
            column = indent;
        } else if index > 0 {
            text.push(' ');
            column += 1;
        }
        text.push_str(word);
        column += length;
    }
    text.push('\n');
    text
}

/// Text whose long lines are broken at blanks, further lines indented by two more than the line; short lines stay.
pub fn fitted(text: &str) -> String {
    let one = |line: &str| {
        if line.chars().count() <= WIDTH {
            return line.to_owned();
        }
        let words = line.trim_start();
        let indent = " ".repeat(line.len() - words.len());
        let (first, rest) = words.split_once(' ').unwrap_or((words, ""));
        // The first word stands where it stood; the others hang two further in.
        let broken = hanging(&format!("{indent}  "), &format!("{first} {rest}"));
        format!("{indent}{}", broken.trim_start().trim_end())
    };
    text.split('\n').map(one).collect::<Vec<_>>().join("\n")
}

/// `a, b and c`.
pub fn listed(names: &[&str]) -> String {
    match names {
        [] => String::new(),
        [one] => (*one).to_owned(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_broken_at_blanks_and_hang() {
        let text = hanging("  - ", &"word ".repeat(40));
        assert!(text.lines().count() == 3 && text.lines().all(|line| line.len() <= WIDTH));
        assert!(text.lines().skip(1).all(|line| line.starts_with("    word")) && text.ends_with("word\n"));
        assert_eq!(hanging("a: ", "b"), "a: b\n");
    }

    #[test]
    fn lists_end_in_and() {
        assert_eq!(listed(&["a"]), "a");
        assert_eq!(listed(&["a", "b", "c"]), "a, b and c");
    }
}
