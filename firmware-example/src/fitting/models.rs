//! The models of the tasks, over what was observed.

use imucal_core::{
    link::FitTask,
    model::{
        Parameterisation,
        norm::NormModel,
        rig::{Axis, RigAxes},
        unified::{Terms, UnifiedModel, UnifiedParameters},
    },
};
use nalgebra::Vector3;

use super::observations::Observations;

/// K, b and the base's levelling.
pub(super) const LEVELLED: Terms<14> = Terms::new([0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13]);

pub(super) fn norm_model<
    'a,
    const P: usize,
    const A: usize,
    const B: usize,
    const C: usize,
    const D: usize,
>(
    task: &FitTask,
    seen: &'a Observations<A, B, C, D>,
    form: Parameterisation<P>,
) -> NormModel<'a, f32, P> {
    NormModel { points: &seen.points, norm: task.norm, form }
}

pub(super) fn rig_model<'a, const A: usize, const B: usize, const C: usize, const D: usize>(
    task: &FitTask,
    seen: &'a Observations<A, B, C, D>,
) -> UnifiedModel<'a, f32, 14> {
    let axes = rig_axes(task).unwrap_or(RigAxes([Axis::Z, Axis::Y, Axis::X]));
    UnifiedModel { poses: &seen.poses, axes, base: level(task), terms: LEVELLED, held: 0 }
}

/// A perfect accelerometer on a level base.
pub(super) fn level(task: &FitTask) -> UnifiedParameters<f32> {
    UnifiedParameters::nominal(Vector3::new(0.0, 0.0, -task.norm))
}

/// The rig's axes, outermost first; `None` for what is none.
pub(super) fn rig_axes(task: &FitTask) -> Option<RigAxes> {
    let axis = |index: u8| match index {
        0 => Some(Axis::X),
        1 => Some(Axis::Y),
        2 => Some(Axis::Z),
        _ => None,
    };
    let [outer, middle, inner] = task.axes;
    Some(RigAxes([axis(outer)?, axis(middle)?, axis(inner)?]))
}
