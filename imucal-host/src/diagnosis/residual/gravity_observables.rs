//! What is looked at of block means where rests alone give the attitude: a row a rest.
//!
//! | sensor | component | meaning |
//! | --- | --- | --- |
//! | acc | 0 | u · δa: along gravity |
//! | acc | 1, 2 | across gravity: δa less what the gyroscope has carried from the rest before, and g ψ × u |
//! | gyr | 0, 1, 2 | δω at rest |
//!
//! ψ is the error of the turn, δω over its time less what it is at the two rests between. All are linear in the error,
//! and what they make of a residual they make of a signature too. One row more holds the rotation that the errors of
//! all rests have in common: the table's axes are those in which the accelerometer has none. White noise of the gyroscope, σ a sample,
//! makes
//!
//! ```text
//! Var ψ = σ² (Δt T + ¼ T² (1/n + 1/n'))
//! ```
//!
//! of a turn that takes T between rests of n and n' samples. Not modelled: that two neighbouring turns share the error of the rest
//! between them.

use std::ops::Range;

use nalgebra::{DMatrix, Matrix3, Vector3};

use super::block::{Block, Means};
use crate::{
    diagnosis::reference::rest_to_rest::RestToRest,
    recording::{SensorKind, median},
};

/// How block means become rows.
#[derive(Clone, Debug)]
pub struct GravityObservables {
    /// A block for each rest, and an empty one that holds the common rotation.
    pub blocks: Vec<Block>,
    /// Usable rows of each, by sensor.
    pub counts: [Vec<usize>; 3],
    rests: Vec<Rest>,
    gains: [Matrix3<f64>; 2],
    /// Takes forces along the rests to their best linear function's coefficients.
    common: DMatrix<f64>,
    gravity: f64,
}

/// A rest and the turn to it.
#[derive(Clone, Debug)]
struct Rest {
    /// Blocks within it, with their usable rows, by accelerometer and gyroscope.
    inside: Vec<(usize, [f64; 2])>,
    /// Direction of the specific force, table.
    along: Vector3<f64>,
    across: [Vector3<f64>; 2],
    /// From the table's axes at the rest before to those at this one; `None` where no turn is known.
    from_before: Option<Matrix3<f64>>,
    /// Blocks of the turn: axes there to those at this rest, length in time, s, share of the way.
    turn: Vec<(usize, Matrix3<f64>, f64, f64)>,
    /// Standard deviation of ψ by white noise over that of the usual turn.
    spread: f64,
}

impl Rest {
    /// Of these rows and this attitude; no turn leads to it yet.
    fn new(rows: &Range<usize>, c_t_p: &Matrix3<f64>, cuts: &[Block], counts: &[Vec<usize>; 3]) -> Self {
        let within = |cut: &usize| cuts[*cut].rows.start >= rows.start && cuts[*cut].rows.end <= rows.end;
        let count = |cut: usize| [0, 1].map(|kind: usize| counts[kind].get(cut).copied().unwrap_or(0) as f64);
        let along = c_t_p.tr_mul(&-Vector3::z());
        let first = along.cross(&Vector3::ith(along.iamin(), 1.0)).normalize();
        Self {
            inside: (0..cuts.len()).filter(within).map(|cut| (cut, count(cut))).collect(),
            along,
            across: [first, along.cross(&first)],
            from_before: None,
            turn: Vec::new(),
            spread: 1.0,
        }
    }

    /// Samples of the gyroscope in it.
    fn rates(&self) -> f64 {
        self.inside.iter().map(|(_, [_, rates])| rates).sum()
    }

    /// Variance of ψ for white noise of variance 1, s²; `counts` are samples of the gyroscope in each block. `None` where no turn is known.
    fn variance(&self, before: &Self, counts: &[usize]) -> Option<f64> {
        self.from_before?;
        let seconds: f64 = self.turn.iter().map(|(_, _, duration, _)| duration).sum();
        let white = |(cut, _, duration, _): &(usize, Matrix3<f64>, f64, f64)| {
            duration * duration / counts.get(*cut).map_or(1.0, |count| (*count).max(1) as f64)
        };
        let of_rests = 1.0 / self.rates().max(1.0) + 1.0 / before.rates().max(1.0);
        let variance = self.turn.iter().map(white).sum::<f64>() + 0.25 * seconds * seconds * of_rests;
        (variance > 0.0).then_some(variance)
    }
}

/// Weighs each turn by what white noise makes of it.
fn spread(rests: &mut [Rest], counts: &[usize]) {
    let variances: Vec<Option<f64>> =
        rests.windows(2).map(|pair| pair[1].variance(&pair[0], counts)).collect();
    let Some(usual) = median(variances.iter().copied().flatten().collect()) else { return };
    for (rest, variance) in rests.iter_mut().skip(1).zip(variances) {
        rest.spread = variance.map_or(1.0, |variance| (variance / usual).sqrt());
    }
}

impl GravityObservables {
    /// Of a movement whose means are over `cuts`, with usable rows `counts`; attitudes in the middle of the cuts are `of`.
    pub fn new(
        held: &RestToRest,
        time: &[f64],
        cuts: &[Block],
        counts: &[Vec<usize>; 3],
        of: &dyn Fn(f64) -> Matrix3<f64>,
        gravity: f64,
    ) -> Self {
        let mut rests: Vec<Rest> = Vec::new();
        let mut blocks = Vec::new();
        for (at, rows) in held.rests.iter().enumerate() {
            let c_t_p = held.attitudes[at];
            let middle = |rows: &Range<usize>| 0.5 * (time[rows.start] + time[rows.end - 1]);
            let mut rest = Rest::new(rows, &c_t_p, cuts, counts);
            if let Some(before) = at.checked_sub(1).filter(|_| held.turned[at]) {
                rest.from_before = Some(c_t_p.tr_mul(&held.attitudes[before]));
                let (start, end) = (middle(&held.rests[before]), middle(rows));
                let on_the_way =
                    |cut: &Block| cut.rows.start >= held.rests[before].end && cut.rows.end <= rows.start;
                for (index, cut) in cuts.iter().enumerate().filter(|(_, cut)| on_the_way(cut)) {
                    let until = time.get(cut.rows.end).copied().unwrap_or(time[cut.rows.end - 1]);
                    let share = (cut.time - start) / (end - start);
                    rest.turn.push((index, c_t_p.tr_mul(&of(cut.time)), until - time[cut.rows.start], share));
                }
            }
            blocks.push(Block { rows: rows.clone(), time: middle(rows), rest: Some(at + 1) });
            rests.push(rest);
        }
        spread(&mut rests, &counts[SensorKind::Gyr as usize]);
        let usable =
            |kind: usize, rest: &Rest| rest.inside.iter().map(|(_, n)| n[kind] as usize).sum::<usize>();
        let mut rows: [Vec<usize>; 3] = [
            rests.iter().map(|r| usable(0, r)).collect(),
            rests.iter().map(|r| usable(1, r)).collect(),
            vec![0; rests.len()],
        ];
        let last = blocks.last().map_or(0.0, |block| block.time);
        blocks.push(Block { rows: 0..0, time: last, rest: Some(rests.len() + 1) });
        let all = rows[0].iter().sum();
        rows[0].push(all);
        rows[1].push(0);
        rows[2].push(0);
        let design =
            DMatrix::from_fn(
                rests.len(),
                4,
                |row, column| {
                    if column < 3 { rests[row].along[column] } else { 1.0 }
                },
            );
        let common = design.pseudo_inverse(1e-9).unwrap_or_else(|_| DMatrix::zeros(4, rests.len()));
        let gains = [0, 1].map(|kind: usize| held.triads[kind].gain);
        Self { blocks, counts: rows, rests, gains, common, gravity }
    }

    /// Rows from means over the cuts.
    pub fn of(&self, means: &Means) -> Means {
        let over = |kind: SensorKind, rest: &Rest| -> Vector3<f64> {
            let Some(values) = &means[kind as usize] else { return Vector3::zeros() };
            let sum = |(s, n): (Vector3<f64>, f64), (cut, counts): &(usize, [f64; 2])| {
                (s + values[*cut] * counts[kind as usize], n + counts[kind as usize])
            };
            let (sum, count) = rest.inside.iter().fold((Vector3::zeros(), 0.0), sum);
            sum / f64::max(count, 1.0)
        };
        let forces: Vec<Vector3<f64>> =
            self.rests.iter().map(|rest| self.gains[0] * over(SensorKind::Acc, rest)).collect();
        let rates: Vec<Vector3<f64>> = self.rests.iter().map(|rest| over(SensorKind::Gyr, rest)).collect();
        let mut acc = Vec::with_capacity(self.blocks.len());
        for (at, rest) in self.rests.iter().enumerate() {
            let Some((c, before)) = rest.from_before.zip(at.checked_sub(1)) else {
                acc.push(Vector3::new(rest.along.dot(&forces[at]), 0.0, 0.0));
                continue;
            };
            let mut error = Vector3::zeros();
            if let Some(values) = &means[SensorKind::Gyr as usize] {
                for (cut, to_end, duration, share) in &rest.turn {
                    let wander = rates[before] * (1.0 - share) + rates[at] * *share;
                    error += to_end * (self.gains[1] * (values[*cut] - wander)) * *duration;
                }
            }
            let across = forces[at] - c * forces[before] + error.cross(&rest.along) * self.gravity;
            acc.push(Vector3::new(
                rest.along.dot(&forces[at]),
                rest.across[0].dot(&across),
                rest.across[1].dot(&across),
            ));
        }
        acc.push(self.rotation(&forces));
        let mut gyr = rates;
        gyr.push(Vector3::zeros());
        let [with_acc, with_gyr, _] = means.each_ref().map(Option::is_some);
        [(with_acc || with_gyr).then_some(acc), with_gyr.then_some(gyr), None]
    }

    /// g times the rotation that errors of the rests' forces have in common.
    fn rotation(&self, forces: &[Vector3<f64>]) -> Vector3<f64> {
        let linear = Matrix3::from_fn(|axis, column| {
            forces.iter().enumerate().map(|(rest, f)| self.common[(column, rest)] * f[axis]).sum()
        });
        let skew = (linear - linear.transpose()) * 0.5;
        Vector3::new(skew[(2, 1)], skew[(0, 2)], skew[(1, 0)])
    }

    /// What a sensor is given in each row: scatter of the turns shows across gravity, more of it after a longer turn, and not along it.
    pub fn given(&self, kind: SensorKind) -> Vec<Vector3<f64>> {
        let along = if kind == SensorKind::Acc { self.gravity } else { 0.0 };
        let rest = |rest: &Rest| Vector3::new(along * rest.spread, 0.0, 0.0);
        self.rests.iter().map(rest).chain([Vector3::zeros()]).collect()
    }

    /// A row measures something on an axis.
    pub fn measures(&self, kind: SensorKind, block: usize, axis: usize) -> bool {
        let turned = |rest: &Rest| rest.from_before.is_some();
        kind != SensorKind::Acc || axis == 0 || self.rests.get(block).is_none_or(turned)
    }
}
