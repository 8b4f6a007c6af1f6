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
            "{healthy} healthy and {afflicted} afflicted recordings; 95 % intervals of Clopper and Pearson.\n\n"
        );
        text += &head();
        self.shares.iter().for_each(|share| text += &line(share));
        let [_, bound] = self.shares.first().map_or([0.0, 1.0], Share::interval);
        let _ = writeln!(
            text,
            "{:<58}{:>9}{:>8}  {:<14}{:>8}{:>9}{}",
            "  upper bound of false alarms",
            "",
            percent(bound),
            "",
            "≤ 6.5 %",
            "",
            missed(bound > ALARM_BOUND)
        );
        if let Some((mean, error, count)) = self.closed_bias {
            let _ = writeln!(
                text,
                "{:<58}{count:>9}{mean:>+8.3}  ± {error:<12.3}{:>8}{:>9}{}",
                "closed share, said less true",
                format!("≤ {}", CLOSED_BIAS[0]),
                format!("≤ {}", CLOSED_BIAS[1]),
                missed(mean.abs() > CLOSED_BIAS[0])
            );
        }
        text += "\nBesides the contract's figures:\n";
        self.further.iter().for_each(|share| text += &line(share));
        text += "\nProbability of a cause, where all that is there is of the catalogue: said, and how often it was there.\n";
        for bin in self.calibration.iter().filter(|bin| bin.causes > 0) {
            let [low, high] = clopper_pearson(bin.hits, bin.causes);
            let _ = writeln!(
                text,
                "{:<58}{:>9}{:>8}  {}",
                format!("  {} to {}: {:.3}", bin.bin.0, bin.bin.1, bin.said),
                format!("{}/{}", bin.hits, bin.causes),
                percent(bin.hits as f64 / bin.causes as f64),
                interval([low, high])
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

/// The heads of the columns.
pub(super) fn head() -> String {
    format!("{:<58}{:>9}{:>8}  {:<14}{:>8}{:>9}\n", "", "trials", "", "interval", "must", "aim")
}

/// A figure.
pub(super) fn line(share: &Share) -> String {
    let counts = format!("{}/{}", share.hits, share.trials);
    let (estimate, interval) = match share.estimate() {
        Some(estimate) => (percent(estimate), interval(share.interval())),
        None => ("–".to_owned(), String::new()),
    };
    let goal = |goal: Option<Goal>| goal.map(words).unwrap_or_default();
    let text = format!(
        "{:<58}{counts:>9}{estimate:>8}  {interval:<14}{:>8}{:>9}{}",
        share.name,
        goal(share.must),
        goal(share.aim),
        missed(share.trials > 0 && !share.meets_must())
    );
    text.trim_end().to_owned() + "\n"
}

fn missed(missed: bool) -> &'static str {
    if missed { "  missed" } else { "" }
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
