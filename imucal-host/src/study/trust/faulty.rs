//! What becomes of recordings with a fault: refused, suspect, accepted and right, or accepted in silence and wrong.
//!
//! An accepted sensor is wrong where an entry of its calibration errs by more than [`WRONG`] of its standard errors and
//! the fault has moved it by more than one: the same recording without the fault says by how much.

use std::fmt::Write;

use imucal_core::triad::Triad;
use rayon::prelude::*;

use super::{Cell, Hand, cell::Rests, fault::Fault, score::in_gauge_of};
use crate::{
    calibrate::{Calibration, FitSummary, Options, Status, calibrate},
    recording::{Place, SensorKind, read::interval},
    simulator::random::{Purpose, Random},
};

/// Standard errors beyond which an accepted entry is wrong.
pub const WRONG: f64 = 3.0;

/// Counts of one kind of fault and one sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Count {
    /// Refused.
    pub refused: usize,
    /// Suspect.
    pub suspect: usize,
    /// Accepted, every entry within its limit.
    pub right: usize,
    /// Accepted without a word, an entry beyond its limit.
    pub wrong: usize,
}

/// A line of the table.
#[derive(Clone, Debug)]
pub struct Line {
    /// The kind of fault.
    pub fault: &'static str,
    /// The sensor.
    pub sensor: SensorKind,
    /// What became of it.
    pub count: Count,
    /// Of those accepted and wrong: seed, entry's error in standard errors.
    pub silent: Vec<(u64, f64)>,
}

/// What the sensor came to in one recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fate {
    /// Refused.
    Refused,
    /// Suspect.
    Suspect,
    /// Accepted; its largest error that the fault has made, in standard errors.
    Accepted(f64),
}

/// The cell of a seed: every noise, coverage and quality in turn, with 20 rests or more. Of fewer, `calibrate` warns that few
/// faults show in them.
pub fn cell(seed: u64) -> Cell {
    let grid: Vec<Cell> = Cell::grid().into_iter().filter(|cell| cell.rests != Rests::Few).collect();
    // 7 has no divisor in common with 40, so that all cells take their turn.
    grid[(7 * seed as usize + 3) % grid.len()]
}

/// Seeds `from..to` of the faults given, a line a sensor that the fault touches.
pub fn lines(faults: &[Fault], seeds: std::ops::Range<u64>) -> Vec<Line> {
    let healthy: Vec<(Hand, Calibration)> = seeds
        .clone()
        .into_par_iter()
        .map(|seed| {
            let hand = Hand::draw(cell(seed), seed);
            let calibration = calibrate(&hand.recording("healthy.csv"), &Options::default(), &|_| ());
            (hand, calibration)
        })
        .collect();
    let seeds: Vec<u64> = seeds.collect();
    let of_fault = |fault: &Fault| {
        let fates: Vec<Vec<Fate>> = seeds
            .par_iter()
            .zip(&healthy)
            .map(|(seed, (hand, without))| {
                let (hand, mut recording) =
                    fault.draw(hand.clone(), &mut Random::new(*seed, Purpose::Effect));
                // A file with such times is not read.
                if interval::check(&mut recording, Place::Row(1)).is_err() {
                    return vec![Fate::Refused; fault.sensors.len()];
                }
                let with = calibrate(&recording, &Options::default(), &|_| ());
                fault.sensors.iter().map(|kind| fate(&hand, *kind, &with, without)).collect()
            })
            .collect();
        let line = |(k, sensor): (usize, &SensorKind)| {
            let mut line =
                Line { fault: fault.name, sensor: *sensor, count: Count::default(), silent: Vec::new() };
            seeds.iter().zip(&fates).for_each(|(seed, fates)| line.add(*seed, fates[k]));
            line
        };
        fault.sensors.iter().enumerate().map(line).collect::<Vec<_>>()
    };
    faults.iter().flat_map(of_fault).collect()
}

impl Line {
    fn add(&mut self, seed: u64, fate: Fate) {
        match fate {
            Fate::Refused => self.count.refused += 1,
            Fate::Suspect => self.count.suspect += 1,
            Fate::Accepted(error) if error > WRONG => {
                self.count.wrong += 1;
                self.silent.push((seed, error));
            }
            Fate::Accepted(_) => self.count.right += 1,
        }
    }
}

/// What is accepted in silence and wrong, a sentence a fault and sensor: there must be none.
pub fn broken(lines: &[Line]) -> Vec<String> {
    let wrong = lines.iter().filter(|line| line.count.wrong > 0);
    let said = |line: &Line| {
        let (seed, worst) = line.silent.iter().fold((0, 0.0), |a, b| if b.1 > a.1 { *b } else { a });
        format!(
            "{}, {}: {} accepted in silence though wrong, by up to {worst:.1} standard errors (seed {seed})",
            line.fault, line.sensor, line.count.wrong
        )
    };
    wrong.map(said).collect()
}

/// The table of lines.
pub fn table(lines: &[Line]) -> String {
    let each = lines.first().map_or(0, |line| {
        let Count { refused, suspect, right, wrong } = line.count;
        refused + suspect + right + wrong
    });
    let mut text = format!(
        "Hand recordings with a fault, {each} of each kind. An accepted sensor is wrong\n\
         where an entry errs by more than {WRONG} of its standard errors and the fault has\n\
         moved it by more than one.\n\
         {:<40} {:<3} {:>7} {:>7} {:>8} {:>8}\n",
        "fault", "", "refused", "suspect", "accepted", "silently"
    );
    let _ = writeln!(text, "{:<40} {:<3} {:>7} {:>7} {:>8} {:>8}", "", "", "", "", "right", "wrong");
    for line in lines {
        let Count { refused, suspect, right, wrong } = line.count;
        let sensor = line.sensor.prefix();
        let _ =
            writeln!(text, "{:<40} {sensor:<3} {refused:>7} {suspect:>7} {right:>8} {wrong:>8}", line.fault);
    }
    text
}

fn fate(hand: &Hand, kind: SensorKind, with: &Calibration, without: &Calibration) -> Fate {
    let Some(outcome) = with.sensor(kind) else { return Fate::Refused };
    match (outcome.status(), outcome.fit.as_ref()) {
        (Status::Refused, _) | (_, None) => Fate::Refused,
        (Status::Suspect, _) => Fate::Suspect,
        (Status::Accepted, Some(fit)) => {
            let twin = without.sensor(kind).and_then(|outcome| outcome.passed());
            Fate::Accepted(largest_error(fit, twin, &hand.truth[kind as usize]))
        }
    }
}

/// The largest error of an estimated entry that the fault has moved, in standard errors.
fn largest_error(fit: &FitSummary, twin: Option<&FitSummary>, truth: &Triad<f64>) -> f64 {
    let truth = in_gauge_of(fit, truth);
    // Without the accelerometer a magnetometer is in another gauge than with it.
    let twin = twin.map(|twin| in_gauge_of(fit, &twin.triad));
    let entry =
        |triad: &Triad<f64>, k: usize| if k < 9 { triad.gain[(k / 3, k % 3)] } else { triad.bias[k - 9] };
    let std = Triad { gain: fit.gain_std, bias: fit.bias_std };
    let errors = (0..12).filter(|k| entry(&std, *k) > 0.0).map(|k| {
        let apart = |from: &Triad<f64>| (entry(&fit.triad, k) - entry(from, k)).abs() / entry(&std, k);
        if twin.is_none_or(|twin| apart(&twin) > 1.0) { apart(&truth) } else { 0.0 }
    });
    errors.fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        calibrate::Follows,
        study::trust::{
            cell::{Coverage, Noise, Quality, Rests},
            fault::FAULTS,
        },
    };

    fn hand(rests: Rests, seed: u64) -> Hand {
        let cell = Cell { noise: Noise::White, rests, coverage: Coverage::Whole, quality: Quality::Good };
        Hand::draw(cell, seed)
    }

    #[test]
    fn healthy_recordings_are_accepted_without_a_suspicion() {
        for (rests, seed) in [(Rests::Some, 1), (Rests::Some, 2), (Rests::Many, 3)] {
            let calibration =
                calibrate(&hand(rests, seed).recording("healthy.csv"), &Options::default(), &|_| ());
            for outcome in &calibration.sensors {
                assert_eq!(
                    outcome.status(),
                    Status::Accepted,
                    "{seed}: {:?} {:?}",
                    outcome.kind,
                    outcome.suspicions
                );
            }
        }
    }

    /// Each with what its sensor's residual follows, one of these; refused is as well.
    const NAMED: [(&str, &[Follows]); 9] = [
        ("acc: warm-up, temperature recorded", &[Follows::Temperature, Follows::Time]),
        ("acc: a sixth of the rests off", &[Follows::Excess, Follows::Neighbours]),
        ("acc: clips before the noise", &[Follows::Direction]),
        ("acc: cubic", &[Follows::Direction]),
        ("mag: +5 µT for half the time", &[Follows::Time]),
        ("mag: cubic", &[Follows::Direction]),
        ("mag: field differs from place to place", &[Follows::Attitude]),
        ("gyr: soft saturation", &[Follows::Rate]),
        ("samples lost under counted stamps", &[Follows::Neighbours, Follows::Excess]),
    ];

    #[test]
    fn faults_of_each_named_kind_are_suspect_for_what_they_follow() {
        for (name, follows) in NAMED {
            let fault = FAULTS.iter().find(|fault| fault.name == name).unwrap();
            let kind = *fault.sensors.last().filter(|_| fault.sensors.len() < 3).unwrap_or(&fault.sensors[0]);
            for seed in [1, 2] {
                let (_, recording) =
                    fault.draw(hand(Rests::Some, seed), &mut Random::new(seed, Purpose::Effect));
                let calibration = calibrate(&recording, &Options::default(), &|_| ());
                let outcome = calibration.sensor(kind).unwrap();
                assert_ne!(outcome.status(), Status::Accepted, "{name}, seed {seed}");
                let found = outcome.suspicions.iter().any(|found| follows.contains(&found.follows));
                let refused = outcome.status() == Status::Refused;
                assert!(refused || found, "{name}, seed {seed}: {:?}", outcome.suspicions);
            }
        }
    }
}
