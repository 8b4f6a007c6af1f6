//! The healthy half of the study: hand recordings over the whole grid, and how often their 95 % intervals hold.

use std::fmt::Write;

use rayon::prelude::*;

use super::{
    Cell, Hand,
    cell::{Coverage, Noise, Quality, Rests},
    score::{self, Score},
};
use crate::{calibrate::Status, recording::SensorKind};

/// Half width of a 95 % interval, standard errors.
const HALF_WIDTH: f64 = 1.96;

/// A recording's cell, seed and scores.
pub type Trial = (Cell, u64, Vec<Score>);

/// `each` recordings of every cell of the grid, from a seed on.
pub fn trials(each: u64, seed: u64) -> Vec<Trial> {
    let cells = Cell::grid();
    let all: Vec<(Cell, u64)> = (0..each)
        .flat_map(|k| cells.iter().enumerate().map(move |(cell, c)| (*c, k * 1000 + cell as u64)))
        .map(|(cell, k)| (cell, seed.wrapping_mul(1 << 32).wrapping_add(k)))
        .collect();
    all.into_par_iter().map(|(cell, seed)| (cell, seed, score::scores(&Hand::draw(cell, seed)))).collect()
}

/// How often intervals hold.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Held {
    /// Sensors recorded.
    pub recorded: usize,
    /// Sensors accepted.
    pub accepted: usize,
    /// Sensors called suspect.
    pub suspect: usize,
    /// Parameters of the accepted ones.
    pub parameters: usize,
    /// Of these, within their interval.
    pub held: usize,
    /// Largest error, standard errors.
    pub worst: f64,
}

impl Held {
    /// Of some scores.
    pub fn of<'a>(scores: impl Iterator<Item = &'a Score>) -> Self {
        let mut held = Self::default();
        for score in scores {
            held.recorded += 1;
            match score.status {
                Status::Refused => continue,
                Status::Suspect => {
                    held.suspect += 1;
                    continue;
                }
                Status::Accepted => held.accepted += 1,
            }
            held.parameters += score.errors.len();
            held.held += score.errors.iter().filter(|error| error.abs() <= HALF_WIDTH).count();
            held.worst = held.worst.max(score.worst());
        }
        held
    }

    /// Share of the parameters within their interval.
    pub fn share(&self) -> f64 {
        self.held as f64 / self.parameters as f64
    }
}

/// Of one sensor in the trials that a test picks.
pub fn held(trials: &[Trial], kind: SensorKind, pick: impl Fn(&Cell) -> bool) -> Held {
    let scores = trials.iter().filter(|trial| pick(&trial.0)).flat_map(|trial| &trial.2);
    Held::of(scores.filter(|score| score.kind == kind))
}

/// What the healthy half must keep: shares of intervals that hold, over all and in each cell, the largest error in
/// standard errors, and the share of recordings with a suspect sensor.
const LIMITS: Limits = Limits { over_all: (0.93, 0.97), cell: 0.90, worst: 5.0, suspect: 0.02 };

struct Limits {
    over_all: (f64, f64),
    cell: f64,
    worst: f64,
    suspect: f64,
}

/// Limits that are not kept, a sentence each.
pub fn broken(trials: &[Trial]) -> Vec<String> {
    let mut broken = Vec::new();
    for kind in SensorKind::ALL {
        let all = held(trials, kind, |_| true);
        let (least, most) = LIMITS.over_all;
        if !(least..=most).contains(&all.share()) {
            broken.push(format!("{kind}: {:.1} % of all 95 % intervals hold", 100.0 * all.share()));
        }
        if all.worst > LIMITS.worst {
            broken.push(format!("{kind}: an accepted one is wrong by {:.1} standard errors", all.worst));
        }
        for (name, pick) in groups() {
            let of_cell = held(trials, kind, pick);
            if of_cell.parameters > 0 && of_cell.share() < LIMITS.cell {
                broken
                    .push(format!("{kind}, {name}: {:.1} % of 95 % intervals hold", 100.0 * of_cell.share()));
            }
        }
    }
    let share = suspects(trials) as f64 / trials.len() as f64;
    if share > LIMITS.suspect {
        broken.push(format!("{:.1} % of healthy recordings have a suspect sensor", 100.0 * share));
    }
    broken
}

/// Recordings with a suspect sensor.
fn suspects(trials: &[Trial]) -> usize {
    trials.iter().filter(|trial| trial.2.iter().any(|score| score.status == Status::Suspect)).count()
}

/// A cell of the table: a name and which recordings are in it.
type Group = (String, Box<dyn Fn(&Cell) -> bool>);

/// Noise × coverage × quality, and the numbers of rests over those.
fn groups() -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for noise in Noise::ALL {
        for coverage in [Coverage::Whole, Coverage::Cap] {
            for quality in [Quality::Good, Quality::Poor] {
                let name = format!("{}, {}, {}", noise.name(), coverage.name(), quality.name());
                let pick = move |c: &Cell| (c.noise, c.coverage, c.quality) == (noise, coverage, quality);
                groups.push((name, Box::new(pick)));
            }
        }
    }
    for rests in [Rests::Few, Rests::Some, Rests::Many] {
        groups.push((format!("{} rests", rests.name()), Box::new(move |c: &Cell| c.rests == rests)));
    }
    groups
}

/// The table.
pub fn table(trials: &[Trial]) -> String {
    let mut text = format!(
        "{} healthy hand recordings: how many sensors are accepted, which share of the\n\
         95 % intervals of these hold, in %, and the largest error in standard errors.\n",
        trials.len()
    );
    let _ = writeln!(
        text,
        "{:<27}{:>5}{:>16}{:>16}{:>16}",
        "", "of", "accelerometer", "gyroscope", "magnetometer"
    );
    for (name, pick) in groups() {
        line(&mut text, &name, trials, &pick);
    }
    line(&mut text, "all", trials, &|_| true);
    let count = suspects(trials);
    let _ = writeln!(
        text,
        "Recordings with a suspect sensor: {count}, {:.1} %.",
        100.0 * count as f64 / trials.len() as f64
    );
    text
}

fn line(text: &mut String, name: &str, trials: &[Trial], pick: &dyn Fn(&Cell) -> bool) {
    let recorded = held(trials, SensorKind::Acc, pick).recorded;
    let _ = write!(text, "{name:<27}{recorded:>5}");
    for kind in SensorKind::ALL {
        let held = held(trials, kind, pick);
        let _ = match held.parameters {
            0 => write!(text, "{:>6}{:>10}", held.accepted, "–"),
            _ => write!(text, "{:>6}{:>6.1}{:>4.1}", held.accepted, 100.0 * held.share(), held.worst),
        };
    }
    text.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trial(errors: &[f64], status: Status) -> Trial {
        let score = Score { kind: SensorKind::Acc, status, why: Vec::new(), errors: errors.to_vec() };
        (Cell::grid()[0], 0, vec![score])
    }

    #[test]
    fn limits_are_broken_by_what_exceeds_them_and_by_nothing_else() {
        // Nineteen of twenty hold.
        let mut errors = [0.5; 20];
        errors[0] = 3.0;
        let acc = |trials: &[Trial]| broken(trials).iter().filter(|said| said.starts_with("acc")).count();
        assert_eq!(acc(&[trial(&errors, Status::Accepted)]), 0);
        errors[0] = 6.0;
        assert_eq!(acc(&[trial(&errors, Status::Accepted)]), 1);
        // Too few hold: over all, in the cell, and for the number of rests.
        assert_eq!(acc(&[trial(&[0.5, 2.5], Status::Accepted)]), 3);
        assert!(broken(&[trial(&[], Status::Suspect)]).iter().any(|said| said.contains("suspect")));
    }

    /// A small selection of the study, whose figures are printed by `imucal study trust`.
    #[test]
    fn intervals_of_twenty_healthy_recordings_hold() {
        let cells = Cell::grid();
        let trials: Vec<Trial> = (0..20)
            .map(|k| (cells[3 * k], 77 + k as u64))
            .map(|(cell, seed)| (cell, seed, score::scores(&Hand::draw(cell, seed))))
            .collect();
        for kind in SensorKind::ALL {
            let held = held(&trials, kind, |_| true);
            // Parameters of one sensor err together: 20 recordings know a share to some 2 %.
            assert!(
                held.accepted >= 13 && held.share() > 0.9 && held.worst < LIMITS.worst,
                "{kind}: {held:?}"
            );
        }
    }
}
