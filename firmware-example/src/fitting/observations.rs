//! Observations, as they lie in memory.

use heapless::Vec;
use imucal_core::{
    link::{Fault, FitModel, Observation},
    model::{Parameterisation, rig::GimbalPose, turn::TurnModel},
    observation::{Block, Durations, Moments, ShellPoint, Turn},
};
use nalgebra::Vector3;

/// `POINTS` points, `POSES` poses, or `TURNS` turns of `BLOCKS` blocks altogether.
#[derive(Clone, Debug)]
pub(super) struct Observations<
    const POINTS: usize,
    const POSES: usize,
    const TURNS: usize,
    const BLOCKS: usize,
> {
    pub(super) points: Vec<ShellPoint<f32>, POINTS>,
    pub(super) poses: Vec<GimbalPose<f32>, POSES>,
    /// Directions before and after each turn.
    pub(super) ends: Vec<[Vector3<f32>; 2], TURNS>,
    /// Index of the first block of each turn.
    first: Vec<u16, TURNS>,
    blocks: Vec<Block<f32>, BLOCKS>,
    durations: Vec<f32, BLOCKS>,
}

impl<const POINTS: usize, const POSES: usize, const TURNS: usize, const BLOCKS: usize>
    Observations<POINTS, POSES, TURNS, BLOCKS>
{
    pub(super) const fn new() -> Self {
        Self {
            points: Vec::new(),
            poses: Vec::new(),
            ends: Vec::new(),
            first: Vec::new(),
            blocks: Vec::new(),
            durations: Vec::new(),
        }
    }

    pub(super) fn clear(&mut self) {
        self.points.clear();
        self.poses.clear();
        self.ends.clear();
        self.first.clear();
        self.blocks.clear();
        self.durations.clear();
    }

    /// Takes one observation, if it suits the model.
    pub(super) fn take(&mut self, model: FitModel, observation: &Observation) -> Result<(), Fault> {
        match (model, observation) {
            (FitModel::T9 | FitModel::E9, Observation::Point(value, excess)) => {
                check(value.iter().chain([excess]))?;
                let point = ShellPoint { value: Vector3::from(*value), excess: *excess };
                self.points.push(point).map_err(|_| Fault::Full)
            }
            (FitModel::I14, Observation::Pose(value, sin, cos)) => {
                check(value.iter().chain(sin).chain(cos))?;
                let [value, sin, cos] = [value, sin, cos].map(|three| Vector3::from(*three));
                let pose = GimbalPose::turned(value, sin, cos);
                self.poses.push(pose).map_err(|_| Fault::Full)
            }
            (FitModel::K12, Observation::Turn(before, after)) => {
                check(before.iter().chain(after))?;
                self.turn(Vector3::from(*before), Vector3::from(*after))
            }
            (FitModel::K12, Observation::Block(s0, s1, c, duration)) => {
                check(s0.iter().chain(s1).chain(c).chain([duration]))?;
                let block = Block { s0: Vector3::from(*s0), s1: Vector3::from(*s1), c: Vector3::from(*c) };
                self.block(block, *duration)
            }
            _ => Err(Fault::Unsuited),
        }
    }

    fn turn(&mut self, before: Vector3<f32>, after: Vector3<f32>) -> Result<(), Fault> {
        let first = u16::try_from(self.blocks.len()).map_err(|_| Fault::Full)?;
        self.ends.push([before, after]).map_err(|_| Fault::Full)?;
        self.first.push(first).map_err(|_| Fault::Full)
    }

    fn block(&mut self, block: Block<f32>, duration: f32) -> Result<(), Fault> {
        if self.ends.is_empty() {
            return Err(Fault::Unsuited);
        }
        self.blocks.push(block).map_err(|_| Fault::Full)?;
        self.durations.push(duration).map_err(|_| Fault::Full)
    }

    /// Calls with the turns as the model takes them.
    ///
    /// The list of turns is made again each time: it points into the blocks, and cannot be kept with them.
    pub(super) fn with_turns<const P: usize, R>(
        &self,
        form: Parameterisation<P>,
        call: impl FnOnce(&TurnModel<'_, f32, P>) -> R,
    ) -> R {
        let mut turns: Vec<Turn<'_, f32>, TURNS> = Vec::new();
        let ends = self.first.iter().skip(1).map(|first| usize::from(*first)).chain([self.blocks.len()]);
        for (([before, after], first), end) in self.ends.iter().zip(&self.first).zip(ends) {
            let own = usize::from(*first)..end;
            let turn = Turn {
                blocks: self.blocks.get(own.clone()).unwrap_or_default(),
                durations: Durations::Each(self.durations.get(own).unwrap_or_default()),
                before: *before,
                after: *after,
            };
            if turns.push(turn).is_err() {
                break;
            }
        }
        call(&TurnModel { turns: &turns, form })
    }

    /// Middle of the points.
    pub(super) fn middle(&self) -> Vector3<f32> {
        let mut moments = Moments::default();
        self.points.iter().for_each(|point| moments.push(&point.value));
        moments.mean()
    }
}

fn check<'a>(mut figures: impl Iterator<Item = &'a f32>) -> Result<(), Fault> {
    if figures.all(|x| x.is_finite()) { Ok(()) } else { Err(Fault::Malformed) }
}
