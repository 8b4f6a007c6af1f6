//! A batch as JSON and in words.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::{
    entry::{Entry, Standing},
    outlier::{LEAST_UNITS, Outlier, Outliers, Population},
};
use crate::report::{
    measure::{measure, plain},
    table::words,
};

/// What the JSON begins with.
pub const FORMAT: &str = "imucal-batch/1";

/// How many recordings ended how.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// All of them.
    pub recordings: usize,
    /// At least one sensor accepted, and all that were asked for.
    pub calibrated: usize,
    /// The answer is no.
    pub refused: usize,
    /// Cannot be read.
    pub unreadable: usize,
    /// The program failed, or could not write.
    pub failed: usize,
}

impl Counts {
    /// Of these recordings.
    #[must_use]
    pub fn of(entries: &[Entry]) -> Self {
        let count = |standing| entries.iter().filter(|entry| entry.standing == standing).count();
        Self {
            recordings: entries.len(),
            calibrated: count(Standing::Calibrated),
            refused: count(Standing::Refused),
            unreadable: count(Standing::Unreadable),
            failed: count(Standing::Failed),
        }
    }

    /// In one line.
    #[must_use]
    pub fn line(&self) -> String {
        let Self { recordings, calibrated, refused, unreadable, failed } = self;
        let s = if *recordings == 1 { "" } else { "s" };
        let failed = if *failed > 0 { format!(", {failed} failed") } else { String::new() };
        format!(
            "{recordings} recording{s}: {calibrated} calibrated, {refused} refused, {unreadable} unreadable{failed}"
        )
    }
}

/// Names of recordings that hold the same samples, a list for each.
#[must_use]
pub fn copies(entries: &[Entry]) -> Vec<Vec<&str>> {
    let mut by_samples: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for entry in entries {
        if let Some(input) = &entry.input {
            by_samples.entry(&input.sha256).or_default().push(&entry.name);
        }
    }
    let mut copies: Vec<Vec<&str>> = by_samples.into_values().filter(|names| names.len() > 1).collect();
    copies.sort_unstable();
    copies
}

/// The whole document.
#[must_use]
pub fn json(entries: &[Entry], outliers: &Outliers) -> Value {
    let counts = Counts::of(entries);
    json!({
        "format": FORMAT,
        "counts": {
            "recordings": counts.recordings,
            "calibrated": counts.calibrated,
            "refused": counts.refused,
            "unreadable": counts.unreadable,
            "failed": counts.failed,
        },
        "recordings": entries.iter().map(recording).collect::<Vec<_>>(),
        "copies": copies(entries),
        "populations": outliers.populations,
        "outliers": outliers.outliers,
    })
}

fn recording(entry: &Entry) -> Value {
    json!({
        "name": entry.name,
        "recording": entry.recording,
        "standing": entry.standing.name(),
        "exit_status": entry.standing.exit_status(),
        "error": entry.error,
        "input": entry.input,
        "sensors": entry.sensors,
    })
}

/// What was compared and what is unlike the others, in words; ends its lines.
#[must_use]
pub fn text(outliers: &Outliers) -> String {
    let populations = outliers.populations.iter().map(population);
    populations.chain(outliers.outliers.iter().map(outlier)).collect()
}

fn population(population: &Population) -> String {
    let Population { sensor, model, unit_in, units, limit, spreads: _ } = population;
    let judged = match limit {
        Some(limit) => format!("compared, limit {limit:.1}"),
        None => format!("not compared, fewer than {LEAST_UNITS}"),
    };
    format!("{} by {model} from {unit_in}: {units} alike, {judged}\n", words(*sensor))
}

fn outlier(outlier: &Outlier) -> String {
    let Outlier { name, sensor, parameter, value, std_error, median, z, .. } = outlier;
    let measured = measure(*value, *std_error);
    format!(
        "outlier: {name}: {}: {parameter} is {measured}, the others' median {}; z = {z:+.1}\n",
        words(*sensor),
        plain(*median)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::entry::Input;

    #[test]
    fn recordings_of_the_same_samples_are_named_together_whatever_their_manifests() {
        let entry = |name: &str, sha256: &str| {
            let mut entry = Entry::for_tests(name, Standing::Calibrated, Vec::new());
            entry.input =
                Some(Input { size: 7, sha256: sha256.to_owned(), manifest_sha256: Some(name.to_owned()) });
            entry
        };
        let unread = Entry::for_tests("e", Standing::Unreadable, Vec::new());
        let entries = [
            entry("a", "0c"),
            entry("b", "01"),
            entry("c", "0c"),
            entry("d", "02"),
            unread.clone(),
            unread,
            entry("g", "01"),
        ];
        assert_eq!(copies(&entries), [["a", "c"], ["b", "g"]]);
        assert!(copies(&entries[..2]).is_empty());
    }
}
