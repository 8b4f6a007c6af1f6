//! Causes that a room's field could stand for: where no rig keeps a magnetometer in its place, iron in the building changes the
//! field from place to place by as much.

use crate::{
    diagnosis::{finding::Cause, mixed_model::design::Channel, search::stepwise::Solution},
    effect::Effect,
    recording::SensorKind,
};

/// Takes out of `causes` those that change the magnetometer alone, and no block of it by more than `room`, µT, and says so. Terms
/// that were taken out of the baseline stay: they are there in every place.
pub fn leave_out(causes: &mut Vec<Cause>, explained: &Solution<'_>, room: f64) -> Vec<String> {
    let Solution { linear, best, .. } = explained;
    let of = |cause: &Cause| best.set.iter().copied().find(|effect| effect.id == cause.effect);
    let is_small = |cause: &mut Cause| {
        of(cause).is_some_and(|effect| {
            let is_mag = effect.sensors == [SensorKind::Mag] && !linear.candidates.was_taken_out(effect);
            is_mag && most_changed(explained, effect) < room
        })
    };
    let remark = |cause: Cause| {
        format!(
            "not asserted: {} changes the field by less than {room} uT, as the field of a room does from place to place",
            cause.effect
        )
    };
    causes.extract_if(.., is_small).map(remark).collect()
}

/// The most by which an effect of the fit changes a block of the magnetometer, µT.
fn most_changed(Solution { linear, fit, .. }: &Solution<'_>, effect: &Effect) -> f64 {
    let Some(dose) = fit.doses.iter().find(|dose| dose.effect == effect) else { return 0.0 };
    let design = &linear.design;
    let channels: Vec<&Channel> =
        design.channels.iter().filter(|channel| channel.kind == SensorKind::Mag).collect();
    let size = |block: usize| {
        let axis = |channel: &&Channel| {
            let own = channel
                .ids
                .iter()
                .zip(&channel.x)
                .filter(|(id, _)| design.columns.get(**id).is_some_and(|column| column.is_of(effect)));
            let change = own.map(|(id, x)| {
                let at = design.columns[*id].parameter;
                x[block] * dose.values[at] / effect.parameters[at].prior_scale
            });
            change.sum::<f64>().powi(2)
        };
        channels.iter().map(axis).sum::<f64>().sqrt()
    };
    (0..linear.scene.blocks.len()).map(size).fold(0.0, f64::max)
}
