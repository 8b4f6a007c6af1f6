//! Stretches in which the real machine moved otherwise than its simulator: `ref.motion_mismatch`.
//!
//! What the baseline leaves there is far beyond what it leaves wherever the movement is as brisk, in two sensors at once,
//! and the sensors agree on what moved: the turn that the gyroscope's residual integrates to explains that of the
//! magnetometer,
//!
//! ```text
//! dθ/dt = r_w − w × θ      r_b = b × θ
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | r_w, r_b | residuals of rate, rad/s, and field, µT |
//! | θ | turn that the simulator lacks, rad |
//! | w, b | rate and field of the simulator |
//!
//! A fault of one sensor is seen by no other, and what depends on the movement is there whenever it is as brisk. These
//! stretches are left out of all that follows. Not recognised: another movement that only the accelerometer shows, and one that
//! goes on for more than half of the recording.

use std::ops::Range;

use nalgebra::Vector3;
use rayon::prelude::*;

use super::refit::{Fit, refit};
use crate::{
    diagnosis::{
        error::DiagnosisError,
        finding::Amount,
        library::candidates::Candidates,
        mixed_model::noise::{Noise, Weighing},
        residual::{base_run::Reference, forward_model::ForwardModel, vibration},
        screening::conventions::Finding,
    },
    effect::{self, Truth, motion_mismatch},
    recording::SensorKind,
    simulator::Dose,
};

/// Rounds of fitting and leaving out.
const ROUNDS: usize = 4;
/// Residuals are averaged over so many blocks to each side.
const SIDE: usize = 2;
/// So many of the blocks that move most alike say what is usual, of so many that are looked at, none nearer than this, s.
const ALIKE: usize = 60;
const COMPARED: usize = 1500;
const APART: f64 = 5.0;
/// A residual is beyond the usual from so many times the third quartile of those blocks on, in whitened squares.
const BEYOND: f64 = 8.0;
/// Stretches that are no further apart than this, s, are one; it is longer by this on both sides, s.
const BETWEEN: f64 = 1.0;
const MARGIN: f64 = 0.3;
/// Blocks beyond the usual in a stretch, at least.
const FEWEST: usize = 3;
/// A movement that is another one for more than this share of the recording has no usual.
const MOST: f64 = 0.5;
/// Share of the magnetometer's residual that the gyroscope's turn explains where the machine moved.
const AGREES: f64 = 0.3;

/// A stretch in which the machine moved otherwise.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch {
    /// When, s.
    pub time: Range<f64>,
    /// Root mean square of the specific force that the simulator lacks, m/s²; `None` without an accelerometer.
    pub force: Option<f64>,
    /// Root mean square of the rate that it lacks, rad/s; `None` without a gyroscope.
    pub rate: Option<f64>,
    /// Whitened squared size of what the baseline leaves there, by sensor.
    pub energy: [f64; 3],
}

/// The scene without such stretches and with the noise that vibration makes, and the stretches.
///
/// # Errors
///
/// [`DiagnosisError`], when the baseline cannot be fitted.
pub fn left_out<'a>(
    mut scene: ForwardModel<'a>,
    candidates: &Candidates,
) -> Result<(ForwardModel<'a>, Vec<Stretch>), DiagnosisError> {
    let by = &scene.settings.residual;
    if !by.weighs_vibration && !by.leaves_out_mismatch {
        return Ok((scene, Vec::new()));
    }
    let baseline = candidates.baseline.iter();
    let mut doses: Vec<Dose> =
        baseline.map(|effect| Dose { effect, values: vec![0.0; effect.parameters.len()] }).collect();
    let mut found: Vec<Stretch> = Vec::new();
    for _ in 0..ROUNDS {
        let fit = refit(&scene, doses, None)?;
        if by.weighs_vibration {
            scene.vibration = vibration::ratios(&scene, &fit.doses)?;
        }
        let new = if by.leaves_out_mismatch { stretches(&scene, &fit)? } else { Vec::new() };
        doses = fit.doses;
        if new.is_empty() {
            break;
        }
        scene.leave_out(&new.iter().map(|stretch| stretch.time.clone()).collect::<Vec<_>>());
        found.extend(new);
    }
    Ok((scene, merged(found)))
}

/// Stretches that a fit of the baseline shows.
fn stretches(scene: &ForwardModel<'_>, fit: &Fit) -> Result<Vec<Stretch>, DiagnosisError> {
    let reference = Reference::new(scene, fit.doses.clone(), &scene.coarse)?;
    let weighing = Weighing::new(scene, SensorKind::ALL.map(|kind| reference.output(kind)));
    let noise = weighing.white(&fit.residual);
    let truth = scene.plain();
    let energies = SensorKind::ALL.map(|kind| energies(scene, fit, &noise, kind));
    let like = usual_of(scene, &truth, &energies);
    let beyond = |block: usize| {
        let is_beyond = |kind: &SensorKind| {
            let (own, usual) = (smoothed(&energies[*kind as usize], block), like[block][*kind as usize]);
            own.zip(usual).is_some_and(|(own, usual)| own > BEYOND * usual.max(1.0))
        };
        scene.kinds.iter().filter(|kind| is_beyond(kind)).count() > 1
    };
    let blocks: Vec<usize> = (0..scene.blocks.len()).into_par_iter().filter(|block| beyond(*block)).collect();
    if blocks.len() as f64 > MOST * scene.blocks.len() as f64 {
        return Ok(Vec::new());
    }
    let near = |a: &usize, b: &usize| scene.blocks[*b].time - scene.blocks[*a].time < BETWEEN;
    let runs = blocks.chunk_by(near).filter(|run| run.len() >= FEWEST);
    let found = runs.filter_map(|run| {
        let within = run[0]..run[run.len() - 1] + 1;
        agree(scene, fit, &truth, within.clone()).then(|| stretch(scene, fit, within, &energies))
    });
    Ok(found.collect())
}

/// Whitened mean square of each block's residual, one where noise alone is there; `None` where nothing was measured.
fn energies(scene: &ForwardModel<'_>, fit: &Fit, noise: &Noise, kind: SensorKind) -> Vec<Option<f64>> {
    let Some(residual) = fit.residual[kind as usize].as_ref() else { return vec![None; scene.blocks.len()] };
    let sensor = &noise.sensors[kind as usize];
    let energy = |(at, left): (usize, &Vector3<f64>)| {
        let sigma = if scene.blocks[at].rest.is_some() { &sensor.white } else { &sensor.moving };
        let square: f64 = left.iter().zip(sigma).map(|(left, sigma)| (left / sigma).powi(2)).sum();
        let worth = scene.worth(kind, at);
        (worth > 0.0).then(|| worth * square / 3.0)
    };
    residual.iter().enumerate().map(energy).collect()
}

/// Mean over the blocks about one.
fn smoothed(energies: &[Option<f64>], block: usize) -> Option<f64> {
    let about = energies.get(block.saturating_sub(SIDE)..(block + SIDE + 1).min(energies.len()))?;
    let known: Vec<f64> = about.iter().flatten().copied().collect();
    (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64)
}

/// How brisk the movement is in a block: turning, its change, and force besides gravity, in logarithms.
fn briskness(truth: &Truth, gravity: f64) -> Vector3<f64> {
    let floor = |value: f64, least: f64| (value + least).ln();
    Vector3::new(
        floor(truth.w_it_t.norm(), 0.02),
        floor(truth.dw_it_t.norm(), 0.2),
        floor((truth.f_t.norm() - gravity).abs(), 0.1),
    )
}

/// What the blocks leave, by sensor, that move most like each.
fn usual_of(
    scene: &ForwardModel<'_>,
    truth: &[Truth],
    energies: &[Vec<Option<f64>>; 3],
) -> Vec<[Option<f64>; 3]> {
    let gravity = truth.iter().map(|row| row.f_t.norm()).sum::<f64>() / truth.len().max(1) as f64;
    let brisk: Vec<Vector3<f64>> = truth.iter().map(|row| briskness(row, gravity)).collect();
    let stride = brisk.len().div_ceil(COMPARED).max(1);
    let compared: Vec<usize> = (0..brisk.len()).step_by(stride).collect();
    let of = |block: usize| {
        let time = scene.blocks[block].time;
        let apart = compared.iter().filter(|other| (scene.blocks[**other].time - time).abs() > APART);
        let mut near: Vec<(f64, usize)> =
            apart.map(|other| ((brisk[*other] - brisk[block]).norm_squared(), *other)).collect();
        let count = ALIKE.min(near.len());
        if count == 0 {
            return [None; 3];
        }
        near.select_nth_unstable_by(count - 1, |a, b| a.0.total_cmp(&b.0));
        SensorKind::ALL.map(|kind| {
            let alike = near[..count].iter();
            let mut known: Vec<f64> =
                alike.filter_map(|(_, at)| smoothed(&energies[kind as usize], *at)).collect();
            known.sort_by(f64::total_cmp);
            known.get(3 * known.len() / 4).copied()
        })
    };
    (0..brisk.len()).into_par_iter().map(of).collect()
}

/// Whether the turn of the gyroscope's residual explains the magnetometer's; true where one of them is missing.
fn agree(scene: &ForwardModel<'_>, fit: &Fit, truth: &[Truth], blocks: Range<usize>) -> bool {
    let [_, gyr, mag] = &fit.residual;
    let (Some(gyr), Some(mag)) = (gyr, mag) else { return true };
    let (mut turn, mut left, mut all) = (Vector3::<f64>::zeros(), 0.0, 0.0);
    let mut last = scene.blocks[blocks.start].time;
    for at in blocks {
        let (step, row) = (scene.blocks[at].time - last, &truth[at]);
        last = scene.blocks[at].time;
        turn += (gyr[at] - row.w_it_t.cross(&turn)) * step;
        left += (mag[at] - row.b_t.cross(&turn)).norm_squared();
        all += mag[at].norm_squared();
    }
    left < (1.0 - AGREES) * all
}

fn stretch(
    scene: &ForwardModel<'_>,
    fit: &Fit,
    blocks: Range<usize>,
    energies: &[Vec<Option<f64>>; 3],
) -> Stretch {
    let rms = |kind: SensorKind| {
        let values = fit.residual[kind as usize].as_ref()?.get(blocks.clone())?;
        Some((values.iter().map(Vector3::norm_squared).sum::<f64>() / values.len() as f64).sqrt())
    };
    let energy =
        |kind: SensorKind| energies[kind as usize][blocks.clone()].iter().flatten().sum::<f64>() * 3.0;
    Stretch {
        time: scene.blocks[blocks.start].time - MARGIN..scene.blocks[blocks.end - 1].time + MARGIN,
        force: rms(SensorKind::Acc),
        rate: rms(SensorKind::Gyr),
        energy: SensorKind::ALL.map(energy),
    }
}

/// Stretches in their order, those that touch as one.
fn merged(mut stretches: Vec<Stretch>) -> Vec<Stretch> {
    stretches.sort_by(|a, b| a.time.start.total_cmp(&b.time.start));
    let mut merged: Vec<Stretch> = Vec::new();
    for next in stretches {
        match merged.last_mut().filter(|last| next.time.start <= last.time.end) {
            Some(last) => {
                last.time.end = last.time.end.max(next.time.end);
                let most = |a: Option<f64>, b: Option<f64>| a.into_iter().chain(b).reduce(f64::max);
                (last.force, last.rate) = (most(last.force, next.force), most(last.rate, next.rate));
                for (own, more) in last.energy.iter_mut().zip(next.energy) {
                    *own += more;
                }
            }
            None => merged.push(next),
        }
    }
    merged
}

/// The stretches as a fault of the recording; `None` without one.
pub fn finding(stretches: &[Stretch]) -> Option<Finding> {
    let effect = effect::find(motion_mismatch::ID).filter(|_| !stretches.is_empty())?;
    let mut parameters = Vec::new();
    for (at, stretch) in stretches.iter().enumerate() {
        let name = |name: &str| if at == 0 { name.to_owned() } else { format!("{name}_{}", at + 1) };
        let mut add = |own: &str, value: Option<f64>, std_error: Option<f64>, unit: &str| {
            parameters.push(Amount { name: name(own), value, std_error, unit: unit.to_owned() });
        };
        add("t_start", Some(stretch.time.start), Some(MARGIN), "s");
        add("t_end", Some(stretch.time.end), Some(MARGIN), "s");
        stretch.rate.into_iter().for_each(|rate| add("lacking_rate", Some(rate), None, "rad/s"));
        stretch.force.into_iter().for_each(|force| add("lacking_force", Some(force), None, "m/s^2"));
    }
    // Two sensors are as far beyond the usual at once by chance only as often as their whitened squares say.
    let most = stretches.iter().map(|stretch| stretch.energy.iter().sum::<f64>()).fold(0.0, f64::max);
    Some(Finding { effect, parameters, p_value: libm::exp(-0.25 * most) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(time: Range<f64>, rate: f64) -> Stretch {
        Stretch { time, force: None, rate: Some(rate), energy: [1.0; 3] }
    }

    #[test]
    fn stretches_that_touch_are_one() {
        let all = merged(vec![found(9.0..11.0, 0.2), found(3.0..4.0, 0.1), found(10.5..12.0, 0.4)]);
        assert_eq!(all.len(), 2);
        assert_eq!((all[1].time.clone(), all[1].rate, all[1].energy), (9.0..12.0, Some(0.4), [2.0; 3]));
    }
}
