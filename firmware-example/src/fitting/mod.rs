//! A fit under way: what it is made to, and its solver, which goes on by slices.
//!
//! A slice is [`SLICE`] blocks of a swarm's cost, below a millisecond at 100 MHz, or one iteration of
//! Levenberg–Marquardt, up to ten (`tests/device_cost.rs`). What follows a stop (the judgement, and a cloud's
//! refinement) is one more, up to twice as long.

use heapless::Vec;
use imucal_core::{
    accept::Limits,
    fit::{Criteria, FitSummary, Observed, errors_by_sensitivity, standard_errors},
    link::{Capacity, Fault, FitModel, FitProgress, FitTask, Observation},
    model::{
        Parameterisation,
        norm::curvature_excess,
        parameterisation::{FULL, UPPER_TRIANGULAR},
        turn::TurnPass,
        unified::UnifiedParameters,
    },
    record::Sensor,
    solver::{LevenbergMarquardt, Swarm, swarm},
    triad::Triad,
};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use rand_core::SeedableRng;
use rand_pcg::Pcg32;

mod models;
mod observations;
mod report;

use models::{LEVELLED, level, norm_model, rig_axes, rig_model};
use observations::Observations;
pub use report::Finished;
use report::{Figures, finished};

/// Blocks of a swarm's cost in one slice.
pub const SLICE: usize = 384;
/// Poses at least: the affine part has twelve parameters, and each pose gives three.
const LEAST_POSES: usize = 6;
/// Turns at least.
const LEAST_TURNS: usize = 8;
/// Largest rms error of a turn, rad (5.7°): beyond it axes are swapped or a unit is wrong.
const LARGEST_TURN: f64 = 0.1;
/// Where a swarm searches, about nominal: scale, skew, and bias, rad/s (15°/s).
const REACH: (f32, f32, f32) = (0.2, 0.1, 0.262);

/// Levenberg–Marquardt of all sizes, one at a time.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "there is one, and no heap")]
enum Descent {
    Nine(LevenbergMarquardt<f32, 9>),
    Twelve(LevenbergMarquardt<f32, 12>),
    Fourteen(LevenbergMarquardt<f32, 14>),
}

type Search<const PARTICLES: usize> = (Swarm<f32, PARTICLES, 12, TurnPass<f32>>, Pcg32);

/// The memory that fits take: observations and a swarm. All of it zeros at first, so that a `static` costs no flash.
#[derive(Clone, Debug)]
pub struct Memory<
    const POINTS: usize,
    const POSES: usize,
    const TURNS: usize,
    const BLOCKS: usize,
    const PARTICLES: usize,
> {
    seen: Observations<POINTS, POSES, TURNS, BLOCKS>,
    /// The swarm, while one searches. A list, since an `Option` without a value need not be zeros.
    search: Vec<Search<PARTICLES>, 1>,
}

impl<const POINTS: usize, const POSES: usize, const TURNS: usize, const BLOCKS: usize, const PARTICLES: usize>
    Memory<POINTS, POSES, TURNS, BLOCKS, PARTICLES>
{
    /// Empty.
    pub const fn new() -> Self {
        Self { seen: Observations::new(), search: Vec::new() }
    }
}

impl<const POINTS: usize, const POSES: usize, const TURNS: usize, const BLOCKS: usize, const PARTICLES: usize>
    Default for Memory<POINTS, POSES, TURNS, BLOCKS, PARTICLES>
{
    fn default() -> Self {
        Self::new()
    }
}

/// A fit under way, or none.
#[derive(Debug)]
pub struct Fitting<
    'a,
    const POINTS: usize,
    const POSES: usize,
    const TURNS: usize,
    const BLOCKS: usize,
    const PARTICLES: usize,
> {
    memory: &'a mut Memory<POINTS, POSES, TURNS, BLOCKS, PARTICLES>,
    task: Option<FitTask>,
    taken: u16,
    descent: Option<Descent>,
    /// Iterations of the swarm, once it is done.
    searched: u16,
    /// The cloud's noise has been taken into account.
    refined: bool,
    stopped: bool,
}

impl<
    'a,
    const POINTS: usize,
    const POSES: usize,
    const TURNS: usize,
    const BLOCKS: usize,
    const PARTICLES: usize,
> Fitting<'a, POINTS, POSES, TURNS, BLOCKS, PARTICLES>
{
    /// What there is room for.
    pub const CAPACITY: Capacity = Capacity {
        points: POINTS as u16,
        poses: POSES as u16,
        turns: TURNS as u16,
        blocks: BLOCKS as u16,
        particles: PARTICLES as u16,
    };

    /// No fit.
    pub fn new(memory: &'a mut Memory<POINTS, POSES, TURNS, BLOCKS, PARTICLES>) -> Self {
        let mut fitting =
            Self { memory, task: None, taken: 0, descent: None, searched: 0, refined: false, stopped: false };
        fitting.clear();
        fitting
    }

    /// Gives up what there is.
    pub fn clear(&mut self) {
        self.task = None;
        self.memory.seen.clear();
        self.memory.search.clear();
        self.descent = None;
        (self.taken, self.searched) = (0, 0);
        (self.refined, self.stopped) = (false, false);
    }

    /// Begins a fit, without observations.
    ///
    /// # Errors
    ///
    /// [`Fault::Malformed`] for figures that cannot be, [`Fault::Unsuited`] for what this device has not. What there
    /// was goes on.
    pub fn begin(&mut self, task: FitTask) -> Result<(), Fault> {
        let finite = [task.norm, task.offset, task.per_unit].iter().chain(&task.bias).all(|x| x.is_finite());
        let sized = task.model.sensor() == Sensor::Gyroscope || task.norm > 0.0;
        if !finite || !sized || task.per_unit == 0.0 || rig_axes(&task).is_none() {
            return Err(Fault::Malformed);
        }
        if task.search.is_some() && (PARTICLES == 0 || task.model != FitModel::K12) {
            return Err(Fault::Unsuited);
        }
        self.clear();
        self.task = Some(task);
        Ok(())
    }

    /// Takes an observation.
    ///
    /// # Errors
    ///
    /// [`Fault::NotReady`] without a fit begun; [`Fault::Full`]; [`Fault::Unsuited`] for the model or after the first
    /// slice; [`Fault::Malformed`].
    pub fn take(&mut self, observation: &Observation) -> Result<(), Fault> {
        let task = self.task.as_ref().ok_or(Fault::NotReady)?;
        if !self.memory.search.is_empty() || self.descent.is_some() {
            return Err(Fault::Unsuited);
        }
        self.memory.seen.take(task.model, observation)?;
        self.taken = self.taken.saturating_add(1);
        Ok(())
    }

    /// How far it is; `None` where no fit was begun.
    pub fn progress(&self) -> Option<FitProgress> {
        self.task?;
        let iterations = match &self.descent {
            None => 0,
            Some(Descent::Nine(solver)) => solver.iterations(),
            Some(Descent::Twelve(solver)) => solver.iterations(),
            Some(Descent::Fourteen(solver)) => solver.iterations(),
        };
        let searched =
            self.memory.search.first().map_or(self.searched, |(swarm, _)| swarm.report().iterations);
        Some(FitProgress { observations: self.taken, searched, iterations, stopped: self.stopped })
    }

    /// One slice; true once the fit has stopped, or where there is none.
    pub fn step(&mut self) -> bool {
        let Some(task) = self.task.filter(|_| !self.stopped) else { return true };
        if !self.memory.search.is_empty() {
            self.search_on();
        } else if self.descent.is_some() {
            self.stopped = self.descend(&task);
        } else {
            self.start(&task);
        }
        self.stopped
    }

    /// Goes on with the search; a descent from its best follows.
    #[inline(never)]
    fn search_on(&mut self) {
        let Memory { seen, search } = &mut *self.memory;
        let Some((swarm, rng)) = search.first_mut() else { return };
        if seen.with_turns(FULL, |model| swarm.step(model, rng, SLICE).is_some()) {
            self.searched = swarm.report().iterations;
            self.descent = Some(Descent::Twelve(LevenbergMarquardt::new(*swarm.best(), Default::default())));
            search.clear();
        }
    }

    /// One iteration; true where the last solver has stopped.
    #[inline(never)]
    fn descend(&mut self, task: &FitTask) -> bool {
        let seen = &self.memory.seen;
        let stopped = match &mut self.descent {
            None => true,
            Some(Descent::Fourteen(solver)) => solver.step(&rig_model(task, seen)).is_some(),
            Some(Descent::Twelve(solver)) => seen.with_turns(FULL, |model| solver.step(model).is_some()),
            Some(Descent::Nine(solver)) => solver.step(&norm_model(task, seen, UPPER_TRIANGULAR)).is_some(),
        };
        stopped && !self.refine(task)
    }

    /// A cloud is fitted once more, once its noise is known: single samples lie outside their shell on average.
    fn refine(&mut self, task: &FitTask) -> bool {
        let Some(Descent::Nine(rough)) = &mut self.descent else { return false };
        if task.model != FitModel::E9 || self.refined {
            return false;
        }
        self.refined = true;
        let triad = UPPER_TRIANGULAR.triad(rough.theta());
        let variance = rough.variance().unwrap_or(0.0);
        for point in &mut self.memory.seen.points {
            point.excess = curvature_excess(&triad, task.norm, &point.value, variance);
        }
        *rough = LevenbergMarquardt::new(*rough.theta(), Default::default());
        true
    }

    #[inline(never)]
    fn start(&mut self, task: &FitTask) {
        if let Some((seed, bounds)) = task.search.zip(bounds()) {
            return self.search(seed, bounds);
        }
        let bias = Vector3::from(task.bias);
        let nominal = Triad { gain: Matrix3::identity(), bias };
        let nine = |form: Parameterisation<9>, triad| {
            Descent::Nine(LevenbergMarquardt::new(form.theta(&triad), Default::default()))
        };
        self.descent = Some(match task.model {
            FitModel::I14 => {
                let start = LEVELLED.theta(&UnifiedParameters { bias, ..level(task) });
                Descent::Fourteen(LevenbergMarquardt::new(start, Default::default()))
            }
            FitModel::E9 => nine(UPPER_TRIANGULAR, Triad { bias: self.memory.seen.middle(), ..nominal }),
            FitModel::K12 => {
                Descent::Twelve(LevenbergMarquardt::new(FULL.theta(&Triad::identity()), Default::default()))
            }
            _ => nine(UPPER_TRIANGULAR, nominal),
        });
    }

    /// Lets a swarm loose. Alone, since it passes through the stack.
    #[inline(never)]
    fn search(&mut self, seed: u64, bounds: swarm::Bounds<f32, 12>) {
        let _room =
            self.memory.search.push((Swarm::new(bounds, Default::default()), Pcg32::seed_from_u64(seed)));
    }

    /// Judges the fit.
    ///
    /// # Errors
    ///
    /// [`Fault::NotReady`] before it has stopped.
    pub fn finish(&self) -> Result<Finished, Fault> {
        match (&self.task, &self.descent) {
            (Some(task), Some(descent)) if self.stopped => Ok(self.judge(task, descent)),
            _ => Err(Fault::NotReady),
        }
    }

    fn judge(&self, task: &FitTask, descent: &Descent) -> Finished {
        match descent {
            Descent::Nine(solver) => self.judge_norm(task, solver, UPPER_TRIANGULAR, Limits::for_norm(9, 10)),
            Descent::Twelve(solver) => self.judge_turns(task, solver, FULL),
            Descent::Fourteen(solver) => self.judge_rig(task, solver),
        }
    }

    #[inline(never)]
    fn judge_norm<const P: usize>(
        &self,
        task: &FitTask,
        solver: &LevenbergMarquardt<f32, P>,
        form: Parameterisation<P>,
        limits: Limits,
    ) -> Finished {
        let triad = form.triad(solver.theta());
        // Raw unit; that of a gain of the same size in all directions.
        let radius = task.norm * libm::sqrtf(3.0 / triad.gain.norm_squared());
        let observed = Observed::Points(&self.memory.seen.points);
        let criteria = Criteria { observed, limits, radius, nonlinearity: true };
        let summary = FitSummary::of(solver, &norm_model(task, &self.memory.seen, form), &triad, &criteria);
        let covariance = solver.covariance();
        let std = form.triad(&standard_errors(&covariance));
        finished(task, figures(solver.theta(), &covariance), &summary, &criteria, &triad, &std)
    }

    #[inline(never)]
    fn judge_turns<const P: usize>(
        &self,
        task: &FitTask,
        solver: &LevenbergMarquardt<f32, P>,
        form: Parameterisation<P>,
    ) -> Finished {
        let triad = form.triad(solver.theta());
        // Each turn has two ends.
        let observations = 2 * LEAST_TURNS;
        let limits = Limits { rms: LARGEST_TURN, observations, ..Limits::for_norm(9, LEAST_TURNS) };
        let observed = Observed::TurnEnds(&self.memory.seen.ends);
        let criteria = Criteria { observed, limits, radius: 1.0, nonlinearity: true };
        let summary =
            self.memory.seen.with_turns(form, |model| FitSummary::of(solver, model, &triad, &criteria));
        // The blocks were made less the bias of the task.
        let whole = Triad { bias: triad.bias + Vector3::from(task.bias), ..triad };
        let covariance = solver.covariance();
        let std = form.triad(&standard_errors(&covariance));
        finished(task, figures(solver.theta(), &covariance), &summary, &criteria, &whole, &std)
    }

    #[inline(never)]
    fn judge_rig(&self, task: &FitTask, solver: &LevenbergMarquardt<f32, 14>) -> Finished {
        let found = LEVELLED.parameters(&level(task), solver.theta());
        let gain = found.sensitivity.try_inverse().unwrap_or_else(Matrix3::zeros);
        let triad = Triad { gain, bias: found.bias };
        let limits = Limits {
            observations: LEAST_POSES,
            directions: LEAST_POSES,
            ..Limits::for_norm(12, LEAST_POSES)
        };
        let observed = Observed::Poses(&self.memory.seen.poses);
        let criteria = Criteria { observed, limits, radius: task.norm, nonlinearity: false };
        let summary = FitSummary::of(solver, &rig_model(task, &self.memory.seen), &triad, &criteria);
        let covariance = solver.covariance();
        let std = errors_by_sensitivity(&gain, &covariance);
        finished(task, figures(solver.theta(), &covariance), &summary, &criteria, &triad, &std)
    }
}

/// Where a swarm searches.
#[inline(never)]
fn bounds() -> Option<swarm::Bounds<f32, 12>> {
    let (scale, skew, rate) = REACH;
    let reach = Triad {
        gain: Matrix3::repeat(skew) + Matrix3::from_diagonal_element(scale - skew),
        bias: Vector3::repeat(rate),
    };
    swarm::Bounds::around(&FULL.theta(&Triad::identity()), &FULL.theta(&reach))
}

fn figures<'a, const P: usize>(
    theta: &'a SVector<f32, P>,
    covariance: &'a Option<SMatrix<f32, P, P>>,
) -> Figures<'a> {
    Figures { theta: theta.as_slice(), covariance: covariance.as_ref().map(|matrix| matrix.as_slice()) }
}
