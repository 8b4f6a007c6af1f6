//! Causes that an error of the source could stand for: where no rig keeps a magnetometer in its place, iron in the building changes
//! the field from place to place by as much, and an attitude that is off by a few tenths of a degree turns gravity.

use crate::{
    diagnosis::{finding::Cause, mixed_model::design::Channel, search::stepwise::Solution},
    effect::Effect,
    recording::{SensorKind, unit::STANDARD_GRAVITY},
};

/// Takes out of `causes` those that change one sensor alone, and no block of it by more than `errors`, by
/// [`SensorKind::ALL`], in its unit, and says so. Terms that were taken out of the baseline stay: they are there always.
pub fn leave_out(causes: &mut Vec<Cause>, explained: &Solution<'_>, errors: [f64; 3]) -> Vec<String> {
    let Solution { linear, best, .. } = explained;
    let is_small = |cause: &mut Cause| {
        let effect = best.set.iter().copied().find(|effect| effect.id == cause.effect);
        let effect = effect.filter(|effect| !linear.candidates.was_taken_out(effect));
        effect.is_some_and(|effect| match effect.sensors {
            [kind] => most_changed(explained, effect, *kind) < errors[*kind as usize],
            _ => false,
        })
    };
    causes.extract_if(.., is_small).map(|cause| remark(&cause.effect, errors)).collect()
}

fn remark(effect: &str, [acc, _, mag]: [f64; 3]) -> String {
    match effect.starts_with(SensorKind::Acc.prefix()) {
        true => format!(
            "not asserted: {effect} changes the specific force by less than {acc} m/s^2, as a reference attitude that is off by \
             {:.1}° does",
            (acc / STANDARD_GRAVITY).to_degrees()
        ),
        false => format!(
            "not asserted: {effect} changes the field by less than {mag} uT, as the field of a room does from place to place"
        ),
    }
}

/// The most by which an effect of the fit changes a block of a sensor, in its unit.
fn most_changed(Solution { linear, fit, .. }: &Solution<'_>, effect: &Effect, kind: SensorKind) -> f64 {
    let Some(dose) = fit.doses.iter().find(|dose| dose.effect == effect) else { return 0.0 };
    let design = &linear.design;
    let channels: Vec<&Channel> = design.channels.iter().filter(|channel| channel.kind == kind).collect();
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
