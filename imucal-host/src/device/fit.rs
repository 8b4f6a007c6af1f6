//! Fits on board: the observations of a calibration fed to a device, and the same fit made here.

use std::time::Duration;

use imucal_core::{
    link::{BATCH, Capacity, Fault, FitModel, FitProgress, FitReport, FitTask, Observation, Reply, Request},
    model::{
        norm::{NormModel, curvature_excess},
        parameterisation::{FULL, UPPER_TRIANGULAR},
        turn::TurnModel,
    },
    observation::{Block, Durations, Moments, ShellPoint, Turn},
    record::{Date, RawUnit},
    solver::LevenbergMarquardt,
    triad::Triad,
};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::{DeviceError, Session};
use crate::{
    calibrate::outcome::{self, Evidence, SensorOutcome},
    recording::SensorKind,
};

/// A fit on board has ended by then.
const PATIENCE: Duration = Duration::from_secs(300);

/// A fit for a device: the task and what it is made to, in the device's precision.
#[derive(Clone, Debug)]
pub struct BoardFit {
    /// The task.
    pub task: FitTask,
    /// The observations.
    pub observations: Vec<Observation>,
}

/// Parameters and covariance, as the report of a device has them.
pub type Found = (Vec<f32>, Vec<f32>);

impl BoardFit {
    /// What a device is to fit for a sensor that was fitted here; `None` where there is nothing to fit, or by a model
    /// that devices do not have. No more than there is room for: of a longer cloud, evenly spread points; of a longer
    /// motion, longer blocks.
    pub fn of(outcome: &SensorOutcome, room: &Capacity) -> Option<Self> {
        let summary = outcome.fit.as_ref()?;
        let task = |model, norm, bias: Vector3<f64>| FitTask {
            model,
            norm,
            axes: [2, 1, 0],
            bias: bias.map(|x| x as f32).into(),
            unit_in: RawUnit::from_symbol(&summary.unit_in.to_string()).unwrap_or(RawUnit::Arbitrary),
            offset: summary.nominal.offset as f32,
            per_unit: summary.nominal.per_unit as f32,
            search: None,
        };
        match outcome.evidence.as_ref()? {
            Evidence::Shell { points: all, norm, diagonal: false, .. } => {
                let cloud = outcome.kind == SensorKind::Mag;
                let every = all.len().div_ceil(usize::from(room.points).max(1)).max(1);
                let observation = |point: &ShellPoint<f64>| {
                    let excess = if cloud { 0.0 } else { point.excess as f32 };
                    Observation::Point(point.value.map(|x| x as f32).into(), excess)
                };
                let model = if cloud { FitModel::E9 } else { FitModel::T9 };
                Some(Self {
                    task: task(model, *norm as f32, Vector3::zeros()),
                    observations: all.iter().step_by(every).map(observation).collect(),
                })
            }
            // The device has the field forms.
            Evidence::Shell { .. }
            | Evidence::Motions { .. }
            | Evidence::Gimbals(..)
            | Evidence::Reference { .. } => None,
            Evidence::Turns(turns) => {
                let mut known: Vec<KnownTurn> = turns.iter().map(KnownTurn::of).collect();
                while known.iter().map(|turn| turn.blocks.len()).sum::<usize>() > usize::from(room.blocks) {
                    known.iter_mut().for_each(KnownTurn::halve);
                }
                let observations = known.iter().flat_map(KnownTurn::observations).collect();
                // The blocks were made less the bias of the rests.
                Some(Self { task: task(FitModel::K12, 0.0, summary.triad.bias), observations })
            }
        }
    }

    /// The same fit by the core on this machine: bit for bit what the device finds. `None` for a search and for poses.
    pub fn here(&self) -> Option<Found> {
        match self.task.model {
            FitModel::T9 | FitModel::E9 => self.norm_here(),
            FitModel::K12 if self.task.search.is_none() => self.turns_here(),
            _ => None,
        }
    }

    /// Whether the same fit here has the bits of a device's; `None` where it cannot be made here.
    pub fn is_here(&self, report: &FitReport) -> Option<bool> {
        let (theta, covariance) = self.here()?;
        let bits = |figures: &[f32]| figures.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        Some(bits(&theta) == bits(&report.theta) && bits(&covariance) == bits(&report.covariance))
    }

    fn norm_here(&self) -> Option<Found> {
        let mut points: Vec<ShellPoint<f32>> = self
            .observations
            .iter()
            .filter_map(|observation| match observation {
                Observation::Point(value, excess) => {
                    Some(ShellPoint { value: Vector3::from(*value), excess: *excess })
                }
                _ => None,
            })
            .collect();
        let (form, norm, cloud) = (UPPER_TRIANGULAR, self.task.norm, self.task.model == FitModel::E9);
        let mut bias = Vector3::from(self.task.bias);
        if cloud {
            let mut moments = Moments::default();
            points.iter().for_each(|point| moments.push(&point.value));
            bias = moments.mean();
        }
        let fit = |points: &[ShellPoint<f32>], start| {
            let mut solver = LevenbergMarquardt::new(start, Default::default());
            solver.run(&NormModel { points, norm, form });
            solver
        };
        let mut solver = fit(&points, form.theta(&Triad { gain: Matrix3::identity(), bias }));
        if cloud {
            let (triad, variance) = (form.triad(solver.theta()), solver.variance().unwrap_or(0.0));
            for point in &mut points {
                point.excess = curvature_excess(&triad, norm, &point.value, variance);
            }
            solver = fit(&points, *solver.theta());
        }
        Some(found(solver.theta(), solver.covariance().as_ref()))
    }

    fn turns_here(&self) -> Option<Found> {
        let mut known: Vec<KnownTurn> = Vec::new();
        for observation in &self.observations {
            match observation {
                Observation::Turn(before, after) => {
                    let (before, after) = (Vector3::from(*before), Vector3::from(*after));
                    known.push(KnownTurn { before, after, blocks: Vec::new(), durations: Vec::new() });
                }
                Observation::Block(s0, s1, c, duration) => {
                    let block =
                        Block { s0: Vector3::from(*s0), s1: Vector3::from(*s1), c: Vector3::from(*c) };
                    let turn = known.last_mut()?;
                    turn.blocks.push(block);
                    turn.durations.push(*duration);
                }
                _ => return None,
            }
        }
        let turns: Vec<Turn<'_, f32>> = known
            .iter()
            .map(|turn| Turn {
                blocks: &turn.blocks,
                durations: Durations::Each(&turn.durations),
                before: turn.before,
                after: turn.after,
            })
            .collect();
        let mut solver = LevenbergMarquardt::new(FULL.theta(&Triad::identity()), Default::default());
        solver.run(&TurnModel { turns: &turns, form: FULL });
        Some(found(solver.theta(), solver.covariance().as_ref()))
    }
}

/// A turn in the device's precision.
struct KnownTurn {
    before: Vector3<f32>,
    after: Vector3<f32>,
    blocks: Vec<Block<f32>>,
    durations: Vec<f32>,
}

impl KnownTurn {
    fn of(turn: &outcome::KnownTurn) -> Self {
        let (blocks, durations) = turn.data.narrow();
        Self { before: turn.before.cast(), after: turn.after.cast(), blocks, durations }
    }

    /// Joins neighbouring blocks: at 100 Hz two of five samples are still exact to 2e-4° in 100 s of slews.
    fn halve(&mut self) {
        let pairs = self.blocks.chunks(2).zip(self.durations.chunks(2));
        (self.blocks, self.durations) = pairs
            .map(|(blocks, durations)| match (blocks, durations) {
                ([a, b], [t_a, t_b]) => (a.join(*t_a, b, *t_b), t_a + t_b),
                _ => (blocks[0], durations[0]),
            })
            .unzip();
    }

    fn observations(&self) -> Vec<Observation> {
        let pairs = self.blocks.iter().zip(&self.durations);
        let blocks = pairs.map(|(block, duration)| Observation::block(block, *duration));
        std::iter::once(Observation::Turn(self.before.into(), self.after.into())).chain(blocks).collect()
    }
}

/// Without a covariance where that is singular.
fn found<const P: usize>(theta: &SVector<f32, P>, covariance: Option<&SMatrix<f32, P, P>>) -> Found {
    let columns = covariance.into_iter().flat_map(|matrix| matrix.column_iter().enumerate());
    let upper = columns.flat_map(|(k, column)| column.iter().take(k + 1).copied().collect::<Vec<_>>());
    (theta.iter().copied().collect(), upper.collect())
}

impl Session {
    /// Fits on board, to the end; an accepted calibration is in use afterwards, and stored by
    /// [`store_record`](Self::store_record).
    ///
    /// # Errors
    /// [`DeviceError`]. A fit that is refused is a report.
    pub fn fit(&mut self, fit: &BoardFit, date: Date) -> Result<FitReport, DeviceError> {
        self.progress(&Request::StartFit(fit.task), Duration::from_secs(3))?;
        for (batch, first) in fit.observations.chunks(BATCH).zip((0..).step_by(BATCH)) {
            self.feed(first, batch)?;
        }
        self.progress(&Request::StepFit { slices: u16::MAX }, PATIENCE)?;
        self.ask(&Request::FinishFit { date }, "a fit's report", |reply| match reply {
            Reply::Report(report) => Some(report.clone()),
            _ => None,
        })
    }

    /// Feeds a batch; one that was taken although its answer was lost is not fed again.
    fn feed(&mut self, index: u16, batch: &[Observation]) -> Result<(), DeviceError> {
        let observations = batch.iter().copied().collect();
        let after = index + batch.len() as u16;
        match self.progress(&Request::Feed { index, observations }, Duration::from_secs(3)) {
            Err(DeviceError::Refused { fault: Fault::OutOfSequence { expected }, .. })
                if expected == after =>
            {
                Ok(())
            }
            result => result.map(drop),
        }
    }

    fn progress(&mut self, request: &Request<'_>, patience: Duration) -> Result<FitProgress, DeviceError> {
        self.ask_within(patience, request, "a fit's progress", |reply| match reply {
            Reply::Progress(progress) => Some(*progress),
            _ => None,
        })
    }
}
