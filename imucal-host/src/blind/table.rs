//! The score as a table for people.

use std::fmt::Write;

use super::{
    interval::clopper_pearson,
    score::{ALARM_BOUND, CLOSED_BIAS, Goal, Score, Share},
};

impl Score {
    /// The table, its lines ended.
    pub fn table(&self) -> String {
        let [healthy, afflicted] = self.trials;
        let mut text = format!(
            "{healthy} healthy and {afflicted} afflicted recordings;\n95 % intervals of Clopper and Pearson.\n\n"
        );
        text += &head();
        self.shares.iter().for_each(|share| text += &line(share));
        let [_, bound] = self.shares.first().map_or([0.0, 1.0], Share::interval);
        let aim = if bound > ALARM_BOUND { MISSED } else { "" };
        text += &row("upper bound of false alarms", "", &percent(bound), "", ["≤ 6.5 %", aim]);
        if let Some((mean, error, count)) = self.closed_bias {
            let [must, aim] = CLOSED_BIAS.map(|bias| format!("≤ {bias}"));
            let aim = if mean.abs() > CLOSED_BIAS[0] { MISSED } else { &aim };
            text += &row(
                "closed share, stated minus true",
                &count.to_string(),
                &format!("{mean:+.3}"),
                &format!("± {error:.3}"),
                [&must, aim],
            );
        }
        text += "\nFurther figures:\n";
        self.further.iter().for_each(|share| text += &line(share));
        text += "\nProbability of a cause, where all that is there is of the catalogue: said, and\nhow often it was there.\n";
        for bin in self.calibration.iter().filter(|bin| bin.causes > 0) {
            let [low, high] = clopper_pearson(bin.hits, bin.causes);
            text += &row(
                &format!("{} to {}: {:.3}", bin.bin.0, bin.bin.1, bin.said),
                &format!("{}/{}", bin.hits, bin.causes),
                &percent(bin.hits as f64 / bin.causes as f64),
                &interval([low, high]),
                ["", ""],
            );
        }
        let [median, largest] = self.seconds;
        let _ = writeln!(
            text,
            "\nTime of a diagnosis on one thread: median {median:.1} s, largest {largest:.1} s."
        );
        text
    }
}

/// Stands in place of an aim where not even what must be is reached.
const MISSED: &str = "missed";
/// Columns of a figure's name, which goes on in the next line where it is longer.
const NAME: usize = 31;

/// The heads of the columns.
pub(super) fn head() -> String {
    row("", "trials", "", "interval", ["must", "aim"])
}

/// A figure.
pub(super) fn line(share: &Share) -> String {
    let counts = format!("{}/{}", share.hits, share.trials);
    let (estimate, interval) = match share.estimate() {
        Some(estimate) => (percent(estimate), interval(share.interval())),
        None => ("–".to_owned(), String::new()),
    };
    let [must, aim] = [share.must, share.aim].map(|goal| goal.map(words).unwrap_or_default());
    let is_missed = share.trials > 0 && !share.meets_must();
    row(share.name, &counts, &estimate, &interval, [&must, if is_missed { MISSED } else { &aim }])
}

/// One line of the table, or several: the figures stand behind the last words of the name.
fn row(name: &str, counts: &str, estimate: &str, interval: &str, [must, aim]: [&str; 2]) -> String {
    let mut lines = vec![String::new()];
    // A condition such as `λ ≥ 100` stays together.
    let name = ["λ ≥ ", "λ > ", "λ < "]
        .iter()
        .fold(name.to_owned(), |name, sign| name.replace(sign, &sign.replace(' ', "\u{a0}")));
    for word in name.split(' ') {
        let last = lines.last_mut().filter(|last| last.is_empty() || width(last) + 1 + width(word) <= NAME);
        match last {
            Some(last) if last.is_empty() => last.push_str(word),
            Some(last) => *last = format!("{last} {word}"),
            None => lines.push(format!("  {word}")),
        }
    }
    lines.iter_mut().for_each(|line| *line = line.replace('\u{a0}', " "));
    let name = lines.pop().unwrap_or_default();
    let figures = format!("{name:<NAME$} {counts:>8} {estimate:>7} {interval:<13} {must:>7} {aim:>7}");
    lines.push(figures.trim_end().to_owned());
    lines.join("\n") + "\n"
}

fn width(text: &str) -> usize {
    text.chars().count()
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

fn interval([low, high]: [f64; 2]) -> String {
    format!("{:.1} to {:.1}", 100.0 * low, 100.0 * high)
}

fn words(goal: Goal) -> String {
    let percent = |share: f64| format!("{:.0}", 100.0 * share);
    match goal {
        Goal::AtLeast(least) => format!("≥ {} %", percent(least)),
        Goal::AtMost(most) => format!("≤ {} %", percent(most)),
        Goal::Within(least, most) => format!("{}–{} %", percent(least), percent(most)),
    }
}
