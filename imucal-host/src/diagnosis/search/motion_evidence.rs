//! Where the sensors agree on a movement that the simulator lacks.
//!
//! What the baseline leaves of the gyroscope or of the magnetometer is far beyond what it leaves wherever the movement is as
//! brisk, and the two are likelier to be one turn of the sensor than a fault of either ([`turn_likelihood`]). Where one of
//! them is missing, two sensors must be beyond the usual at once. A stretch goes on as long as any sensor shows it. A fault
//! of one sensor is seen by no other, and what depends on the movement is there whenever it is as brisk.
//!
//! A single block that stands alone is a jolt between two samples of the stream, which nothing is said of.
//!
//! Not recognised: another movement that only the accelerometer shows, and one that goes on for more than half of the
//! recording.

use std::ops::Range;

use nalgebra::Vector3;
use rayon::prelude::*;

use super::{
    motion_mismatch::Stretch,
    refit::Fit,
    turn_likelihood::{self, Seen},
};
use crate::{
    diagnosis::{
        error::DiagnosisError,
        mixed_model::noise::{Noise, Weighing},
        residual::{base_run::Reference, forward_model::ForwardModel},
    },
    effect::Truth,
    recording::SensorKind,
};

/// Residuals are averaged over so many blocks to each side.
const SIDE: usize = 2;
/// So many of the blocks that move most alike say what is usual, of so many that are looked at, none nearer than this, s.
const ALIKE: usize = 60;
const COMPARED: usize = 1500;
const APART: f64 = 5.0;
/// A residual is beyond the usual from so many times the third quartile of those blocks on, in whitened squares; a stretch
/// goes on from so many times.
const BEYOND: f64 = 5.0;
const GOES_ON: f64 = 2.0;
/// Stretches that are no further apart than this, s, are one; it is longer by this on both sides, s.
const BETWEEN: f64 = 1.0;
const MARGIN: f64 = 0.5;
/// Blocks beyond the usual in a stretch, at least.
const FEWEST: usize = 3;
/// A movement that is another one for more than this share of the recording has no usual.
const MOST: f64 = 0.5;
/// What remains of a stretch is no further from it than this, s.
const REMAINS: f64 = 3.0;
/// A block is a jolt from so many times the usual on, where so many blocks before and behind it are not beyond it.
const JOLTS: f64 = 12.0;
const APART_JOLTS: usize = 5;
/// ln of the odds of a turn of the sensor against a fault of one sensor, at least; the accelerometer, which feels what moves
/// the machine as well as what shakes it, adds no more than so much to them.
const CONFIRMS: f64 = 8.0;
const BY_FORCE: f64 = 4.0;
/// So many blocks before and behind a stretch are looked at with it, and no more than so many in all.
const ABOUT: usize = 10;
const LONGEST: usize = 400;

/// What a fit of the baseline shows, apart from stretches that were found `before`, s.
///
/// # Errors
///
/// [`DiagnosisError`], when the simulator fails.
pub fn found(scene: &ForwardModel<'_>, fit: &Fit, before: &[Range<f64>]) -> Result<Found, DiagnosisError> {
    let reference = Reference::new(scene, fit.doses.clone(), &scene.coarse)?;
    let weighing = Weighing::new(scene, SensorKind::ALL.map(|kind| reference.output(kind)));
    let noise = weighing.white(&fit.residual);
    let truth = scene.plain();
    let energies = SensorKind::ALL.map(|kind| energies(scene, fit, &noise, kind));
    let usual = usual_of(scene, &truth, &energies);
    let residuals =
        Residuals { scene, fit, truth: &truth, noise: &noise, energies: &energies, usual: &usual };
    let runs = residuals.runs();
    let asserted = |run: &Range<usize>| residuals.goes_on(run, before) || residuals.confirm(run);
    let asserted = runs.into_par_iter().filter(asserted);
    let mut stretches: Vec<Stretch> = asserted.map(|run| residuals.stretch(residuals.whole(run))).collect();
    let lasting: f64 = stretches.iter().map(|stretch| stretch.time.end - stretch.time.start).sum();
    if lasting > MOST * scene.duration() {
        stretches.clear();
    }
    Ok(Found { stretches, jolts: residuals.jolts() })
}

/// What a fit of the baseline shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Found {
    /// Stretches in which the machine moved otherwise.
    pub stretches: Vec<Stretch>,
    /// Moments in which one sensor's residual stands alone, s.
    pub jolts: Vec<Range<f64>>,
}

/// What a fit of the baseline leaves, block by block, and what is usual where the movement is as brisk.
struct Residuals<'a, 's> {
    scene: &'a ForwardModel<'s>,
    fit: &'a Fit,
    truth: &'a [Truth],
    noise: &'a Noise,
    energies: &'a [Vec<Option<f64>>; 3],
    usual: &'a [[Option<f64>; 3]],
}

impl Residuals<'_, '_> {
    fn time(&self, block: usize) -> f64 {
        self.scene.blocks[block].time
    }

    /// Whether a sensor is beyond so many times the usual about a block.
    fn is_beyond(&self, kind: SensorKind, block: usize, times: f64) -> bool {
        let (own, usual) = (smoothed(&self.energies[kind as usize], block), self.usual[block][kind as usize]);
        own.zip(usual).is_some_and(|(own, usual)| own > times * usual.max(1.0))
    }

    /// It is what is left of a stretch that was found before.
    fn goes_on(&self, run: &Range<usize>, before: &[Range<f64>]) -> bool {
        let (from, to) = (self.time(run.start), self.time(run.end - 1));
        before.iter().any(|found| from < found.end + REMAINS && to > found.start - REMAINS)
    }

    /// Blocks whose residual is far beyond the usual, none about them being so: what lies between two samples of the stream.
    fn jolts(&self) -> Vec<Range<f64>> {
        let is_jolt = |block: &usize| {
            let stands_alone = |kind: &SensorKind| {
                let own = self.energies[*kind as usize][*block];
                let usual = self.usual[*block][*kind as usize].unwrap_or(1.0).max(1.0);
                let neighbours = [block.checked_sub(APART_JOLTS), block.checked_add(APART_JOLTS)];
                let quiet =
                    |at: &usize| *at >= self.scene.blocks.len() || !self.is_beyond(*kind, *at, BEYOND);
                own.is_some_and(|own| own > JOLTS * usual) && neighbours.iter().flatten().all(quiet)
            };
            self.scene.kinds.iter().any(stands_alone)
        };
        let jolts = (0..self.scene.blocks.len()).filter(is_jolt);
        let rows = |block: usize| {
            let rows = self.scene.blocks[block].rows.clone();
            let time = &self.scene.recording.time;
            Some(*time.get(rows.start)?..*time.get(rows.end.checked_sub(1)?)?)
        };
        jolts.filter_map(rows).collect()
    }

    /// Blocks in a row in which the gyroscope or the magnetometer is beyond the usual; two sensors, where one of them is
    /// missing.
    fn runs(&self) -> Vec<Range<usize>> {
        let turns = [SensorKind::Gyr, SensorKind::Mag];
        let sees_turns = turns.iter().all(|kind| self.scene.kinds.contains(kind));
        let asked = if sees_turns { &turns[..] } else { &self.scene.kinds };
        let least = if sees_turns { 1 } else { 2 };
        let beyond = |block: &usize| {
            asked.iter().filter(|kind| self.is_beyond(**kind, *block, BEYOND)).count() >= least
        };
        let blocks: Vec<usize> = (0..self.scene.blocks.len()).into_par_iter().filter(beyond).collect();
        let near = |a: &usize, b: &usize| self.time(*b) - self.time(*a) < BETWEEN;
        let runs = blocks.chunk_by(near).filter(|run| run.len() >= FEWEST);
        runs.map(|run| run[0]..run[run.len() - 1] + 1).collect()
    }

    /// The run with the blocks before and behind it in which any sensor still shows it.
    fn whole(&self, run: Range<usize>) -> Range<usize> {
        let shows = |block: usize| self.scene.kinds.iter().any(|kind| self.is_beyond(*kind, block, GOES_ON));
        let near = |a: usize, b: usize| (self.time(a) - self.time(b)).abs() < BETWEEN;
        let (mut first, mut last) = (run.start, run.end - 1);
        for block in (0..run.start).rev() {
            match shows(block) {
                true => first = block,
                false if !near(block, first) => break,
                false => {}
            }
        }
        for block in run.end..self.scene.blocks.len() {
            match shows(block) {
                true => last = block,
                false if !near(block, last) => break,
                false => {}
            }
        }
        first..last + 1
    }

    /// Whether a turn of the sensor is likelier than a fault of one sensor; true where gyroscope or magnetometer is missing.
    fn confirm(&self, run: &Range<usize>) -> bool {
        let [_, Some(gyr), Some(mag)] = &self.fit.residual else { return true };
        let about = run.start.saturating_sub(ABOUT)..(run.end + ABOUT).min(self.scene.blocks.len());
        let seen: Vec<Seen> = about.take(LONGEST).map(|at| self.seen(at, &gyr[at], &mag[at])).collect();
        turn_likelihood::log_odds(&seen) + self.log_odds_of_force(run).min(BY_FORCE) > CONFIRMS
    }

    /// ln of the likelihood of more noise in the accelerometer than the usual, against that of the usual.
    fn log_odds_of_force(&self, run: &Range<usize>) -> f64 {
        let acc = SensorKind::Acc as usize;
        let ratio = |at: usize| {
            Some(self.energies[acc].get(at).copied()?? / self.usual.get(at)?[acc].unwrap_or(1.0).max(1.0))
        };
        let ratios: Vec<f64> = run.clone().filter_map(ratio).collect();
        let mean = ratios.iter().sum::<f64>() / ratios.len().max(1) as f64;
        // Three axes a block, normal, of the likeliest variance.
        if mean > 1.0 { 1.5 * ratios.len() as f64 * (mean - 1.0 - mean.ln()) } else { 0.0 }
    }

    fn seen(&self, at: usize, gyr: &Vector3<f64>, mag: &Vector3<f64>) -> Seen {
        let variance = |kind: SensorKind| {
            let sensor = &self.noise.sensors[kind as usize];
            let white = if self.scene.blocks[at].rest.is_some() { sensor.white } else { sensor.moving };
            let usual = self.usual[at][kind as usize].unwrap_or(1.0).max(1.0);
            let worth = self.scene.worth(kind, at);
            let square = white.iter().map(|sigma| sigma * sigma).sum::<f64>() / 3.0;
            if worth > 0.0 { usual * square / worth } else { f64::INFINITY }
        };
        Seen {
            time: self.time(at),
            rate: *gyr,
            field: *mag,
            variances: [variance(SensorKind::Gyr), variance(SensorKind::Mag)],
            w: self.truth[at].w_it_t,
            b: self.truth[at].b_t,
        }
    }

    fn stretch(&self, blocks: Range<usize>) -> Stretch {
        let rms = |kind: SensorKind| {
            let values = self.fit.residual[kind as usize].as_ref()?.get(blocks.clone())?;
            Some((values.iter().map(Vector3::norm_squared).sum::<f64>() / values.len() as f64).sqrt())
        };
        let energy = |kind: SensorKind| {
            self.energies[kind as usize][blocks.clone()].iter().flatten().sum::<f64>() * 3.0
        };
        Stretch {
            time: self.time(blocks.start) - MARGIN..self.time(blocks.end - 1) + MARGIN,
            force: rms(SensorKind::Acc),
            rate: rms(SensorKind::Gyr),
            energy: SensorKind::ALL.map(energy),
        }
    }
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

/// How brisk the movement is in a block: turning, its change, and force other than gravity, in logarithms.
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
