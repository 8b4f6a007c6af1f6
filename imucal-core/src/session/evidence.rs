//! The rows that each sensor's fit is made of, from what a session has kept. Nothing is copied: a pose's rows are made when the
//! solver asks for them.

use nalgebra::{SVector, Vector3};

use super::poses::Poses;
use crate::{
    model::{
        Model, RowSink,
        norm::NormModel,
        parameterisation::{FULL_GAIN, UPPER_TRIANGULAR},
        turn::TurnModel,
    },
    observation::ShellPoint,
    observer::cloud::Slot,
    triad::Triad,
};

/// Which observations are used: bit k is observation k.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Used(pub(super) u64);

impl Used {
    pub(super) const ALL: Self = Self(u64::MAX);

    pub(super) fn only(at: usize) -> Self {
        Self(if at < 64 { 1 << at } else { 0 })
    }

    pub(super) fn has(self, at: usize) -> bool {
        at < 64 && self.0 >> at & 1 == 1
    }

    pub(super) fn leave_out(&mut self, at: usize) {
        if at < 64 {
            self.0 &= !(1 << at);
        }
    }

    pub(super) fn count(self, of: usize) -> usize {
        (0..of.min(64)).filter(|at| self.has(*at)).count()
    }
}

/// The accelerometer's rests: T9.
pub(super) struct Rests<'a, const N: usize, const B: usize> {
    pub(super) poses: &'a Poses<N, B>,
    pub(super) used: Used,
    /// Local gravity, m/s².
    pub(super) gravity: f32,
}

impl<const N: usize, const B: usize> Model<f32, 9> for Rests<'_, N, B> {
    fn rows<S: RowSink<f32, 9>>(&self, theta: &SVector<f32, 9>, sink: &mut S) {
        for (_, pose) in self.poses.list().iter().enumerate().filter(|(at, _)| self.used.has(*at)) {
            let point = ShellPoint::new(pose.acc);
            shell(&point, self.gravity).rows(theta, sink);
        }
    }

    fn independent_rows(&self) -> usize {
        self.used.count(self.poses.list().len())
    }
}

/// T9 and E9 of one point.
#[inline]
pub(super) fn shell(point: &ShellPoint<f32>, norm: f32) -> NormModel<'_, f32, 9> {
    NormModel { points: core::slice::from_ref(point), norm, form: UPPER_TRIANGULAR }
}

/// The gyroscope's turns: K9.
pub(super) struct Turns<'a, const N: usize, const B: usize> {
    pub(super) poses: &'a Poses<N, B>,
    pub(super) used: Used,
    /// The accelerometer's calibration.
    pub(super) acc: &'a Triad<f32>,
    /// The bias, rad/s, where it does not wander.
    pub(super) bias: Option<Vector3<f32>>,
}

impl<const N: usize, const B: usize> Model<f32, 9> for Turns<'_, N, B> {
    fn rows<S: RowSink<f32, 9>>(&self, theta: &SVector<f32, 9>, sink: &mut S) {
        for (_, pose) in self.poses.list().iter().enumerate().filter(|(at, _)| self.used.has(*at)) {
            let _none = pose.with_turn(self.acc, self.bias.as_ref(), |turn| {
                TurnModel { turns: core::slice::from_ref(turn), form: FULL_GAIN }.rows(theta, sink);
            });
        }
    }

    fn independent_rows(&self) -> usize {
        let turned = |at: &usize| self.poses.list().get(*at).is_some_and(|pose| pose.has_turn());
        2 * (0..self.poses.list().len()).filter(|at| self.used.has(*at)).filter(turned).count()
    }
}

/// The magnetometer's cloud: E9.
pub(super) struct Cloud<'a> {
    pub(super) slots: &'a [Slot<f32>],
    pub(super) used: Used,
    /// Length of the field, µT.
    pub(super) norm: f32,
    /// Radius of the cloud in the raw unit.
    pub(super) radius: f32,
}

impl Model<f32, 9> for Cloud<'_> {
    fn rows<S: RowSink<f32, 9>>(&self, theta: &SVector<f32, 9>, sink: &mut S) {
        for (_, slot) in self.slots.iter().enumerate().filter(|(at, _)| self.used.has(*at)) {
            shell(&slot.on_shell(self.radius), self.norm).rows(theta, sink);
        }
    }

    fn independent_rows(&self) -> usize {
        self.used.count(self.slots.len())
    }
}
