//! Random damage: reading and calibrating end, in an error or an answer, but never in a panic.

use std::fs;

use imucal_host::calibrate::{AccModel, Options, calibrate};
use imucal_host::recording::Recording;
use imucal_host::simulator::{SimulatedUnit, Tumble, record};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Recordings to be damaged.
const CASES: u64 = 300;
/// Fields that are hard on arithmetic.
const ABSURD: [&str; 14] = [
    "", "NaN", "0", "-0", "1e308", "-1e308", "1e160", "1e-308", "5e-324", "1e18", "65535", "-1", "inf", "\"",
];

struct Damage {
    rng: ChaCha8Rng,
}

impl Damage {
    fn below(&mut self, limit: usize) -> usize {
        self.rng.next_u32() as usize % limit.max(1)
    }

    fn lines(text: &str) -> Vec<Vec<String>> {
        text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
    }

    fn csv(&mut self, text: &str) -> Vec<u8> {
        let mut rows = Self::lines(text);
        match self.below(7) {
            0 => return self.flipped(text),
            1 => {
                let (from, count) = (self.below(rows.len()), self.below(rows.len()));
                rows.drain(from..(from + count).min(rows.len()));
            }
            2 => {
                let (a, b) = (self.below(rows.len()), self.below(rows.len()));
                rows.swap(a, b);
            }
            3 => {
                for _ in 0..1 + self.below(5) {
                    let (row, a, b) = (self.below(rows.len()), self.below(10), self.below(10));
                    rows[row].swap(a, b);
                }
            }
            4 => {
                for _ in 0..1 + self.below(8) {
                    let (row, column) = (1 + self.below(rows.len() - 1), 1 + self.below(9));
                    rows[row][column] = ABSURD[self.below(ABSURD.len())].into();
                }
            }
            5 => {
                // A whole column.
                let (column, value) = (self.below(10), ABSURD[self.below(ABSURD.len())]);
                rows.iter_mut().skip(1).for_each(|row| row[column] = value.into());
            }
            _ => {
                // Times as they might be: another unit, or hardly rising.
                let factor = [1e-300, 1e-12, 1e-3, 1e3, 1e9, 1e300][self.below(6)];
                for row in rows.iter_mut().skip(1) {
                    row[0] = (row[0].parse::<f64>().expect("a number") * factor).to_string();
                }
            }
        }
        let text: String = rows.iter().map(|row| row.join(",") + "\n").collect();
        text.into_bytes()
    }

    fn toml(&mut self, text: &str) -> Vec<u8> {
        let mut lines: Vec<&str> = text.lines().collect();
        match self.below(3) {
            0 => return self.flipped(text),
            1 => drop(lines.remove(self.below(lines.len()))),
            _ => {
                let number = ["0.0", "-1.0", "nan", "1e-308", "1e308", "\"counts\""][self.below(6)];
                let line = self.below(lines.len());
                let key = lines[line].split('=').next().unwrap_or_default();
                let changed = format!("{key}= {number}");
                lines[line] = &changed;
                return lines.join("\n").into_bytes();
            }
        }
        lines.join("\n").into_bytes()
    }

    fn flipped(&mut self, text: &str) -> Vec<u8> {
        let mut bytes = text.as_bytes().to_vec();
        for _ in 0..1 + self.below(4) {
            let (at, bit) = (self.below(bytes.len()), self.below(8));
            bytes[at] ^= 1 << bit;
        }
        bytes
    }
}

#[test]
fn random_damage_ends_in_an_error_or_an_answer() {
    let unit = SimulatedUnit { interval: 0.1, ..SimulatedUnit::mtx() };
    let folder = tempfile::tempdir().expect("there is room for a folder");
    record("base.csv", &Tumble::new(12, 5), &unit, 6)
        .write(&folder.path().join("base.csv"))
        .expect("writable");
    let csv = fs::read_to_string(folder.path().join("base.csv")).expect("text");
    let toml = fs::read_to_string(folder.path().join("base.toml")).expect("text");
    let answers: usize = (0..CASES)
        .into_par_iter()
        .map(|case| {
            let mut damage = Damage { rng: ChaCha8Rng::seed_from_u64(case) };
            let (samples, manifest) = match case % 4 {
                0 => (csv.clone().into_bytes(), damage.toml(&toml)),
                1 => (damage.csv(&csv), damage.toml(&toml)),
                _ => (damage.csv(&csv), toml.clone().into_bytes()),
            };
            let path = folder.path().join(format!("case-{case}.csv"));
            fs::write(&path, samples).expect("writable");
            fs::write(path.with_extension("toml"), manifest).expect("writable");
            let Ok(recording) = Recording::read(&path) else { return 0 };
            let acc = if case % 8 == 7 { AccModel::T6 } else { AccModel::T9 };
            let calibration = calibrate(&recording, &Options { acc, ..Options::default() }, &|_| {});
            for fit in calibration.sensors.iter().filter_map(|outcome| outcome.accepted()) {
                let triad = fit.raw_triad();
                let figures = triad.gain.iter().chain(triad.bias.iter());
                assert!(figures.copied().all(f64::is_finite), "case {case}: accepted {triad:?}");
            }
            1
        })
        .sum();
    assert!(
        answers > 50 && answers < 300,
        "{answers} of {CASES} could be read: the damage tests one side only"
    );
}
