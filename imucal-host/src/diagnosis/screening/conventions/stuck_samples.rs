//! Rows that repeat the one before them in all axes: `P.stuck_samples`.
//!
//! By chance a quantised noise repeats itself in all axes as often as the product of what each axis does; that is taken
//! piece by piece, since a rest may be quieter than a motion. The number of repetitions beyond is judged as Poisson's.

use statrs::distribution::{DiscreteCDF, Poisson};

use super::{Conventions, Finding, SURE};
use crate::recording::{Triple, check::integrity::SensorIntegrity};

/// Rows of a piece.
const PIECE: usize = 100;
/// A sensor that repeats more than this share of its rows is slower than the recording.
const SLOW: f64 = 0.45;
/// So does one whose distances between repetitions vary by less than this share of what chance would give, where there
/// are this many of them.
const EVEN: f64 = 0.25;
const EVEN_FROM: f64 = 20.0;

/// Looks at one sensor; dead and clipped stretches, which have checks of their own, do not count.
pub(crate) fn check(triple: &Triple, sensor: &SensorIntegrity, found: &mut Conventions) {
    let repeats: Vec<[bool; 4]> = triple
        .values
        .windows(2)
        .zip(sensor.usable.windows(2))
        .filter(|(_, usable)| usable[0] && usable[1])
        .map(|(pair, _)| {
            let [x, y, z] = [0, 1, 2].map(|axis| pair[0][axis] == pair[1][axis]);
            [x, y, z, x && y && z]
        })
        .collect();
    let mut expected = 0.0;
    for piece in repeats.chunks(PIECE) {
        let rows = piece.len() as f64;
        let shares: [f64; 3] = [0, 1, 2].map(|axis| piece.iter().filter(|r| r[axis]).count() as f64 / rows);
        expected += rows * shares.iter().product::<f64>();
    }
    let rows = repeats.iter().filter(|r| r[3]).count() as f64;
    let starts = repeats.chunk_by(|a, b| a[3] == b[3]).filter(|run| run[0][3]).count() as f64;
    let total = repeats.len() as f64;
    let kind = sensor.sensor;
    // A quarter of a count: without noise nothing is expected, and nothing is seen.
    let Ok(by_chance) = Poisson::new(expected + 0.25) else { return };
    let p_value = if rows > 0.0 { by_chance.sf(rows as u64 - 1) } else { 1.0 };
    if p_value > SURE || rows < 2.0 * expected {
        return;
    }
    if rows > SLOW * total || is_even(&repeats) {
        found.remarks.push(format!(
            "{kind} repeats {:.0} % of its rows: it is slower than the recording, or its transport repeats samples",
            100.0 * rows / total
        ));
        return;
    }
    let share = (rows - expected) / total;
    let std_error = share / starts.sqrt();
    let values = [(Some(share), Some(std_error))];
    found.findings.extend(Finding::new(&format!("{kind}.stuck_samples"), &values, p_value));
}

/// Stretches of repetitions come at even distances: a slower sensor's, where a transport's come by chance.
fn is_even(repeats: &[[bool; 4]]) -> bool {
    let starts = |row: &usize| repeats[*row][3] && (*row == 0 || !repeats[*row - 1][3]);
    let at: Vec<usize> = (0..repeats.len()).filter(starts).collect();
    let apart: Vec<f64> = at.windows(2).map(|pair| (pair[1] - pair[0]) as f64).collect();
    let n = apart.len() as f64;
    if n < EVEN_FROM {
        return false;
    }
    let mean = apart.iter().sum::<f64>() / n;
    let variance = apart.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / n;
    // Distances of events by chance are geometric.
    variance < EVEN * mean * (mean - 1.0)
}
