//! What a radian of each gimbal's offset from its encoder changes in the block means.
//!
//! Taken with the triads that the simulator starts from: what is fitted later changes it in the second order only.

use super::{base_run::Reference, block::Means, forward_model::ForwardModel};
use crate::effect::find;

/// The change for each gimbal, outermost first, block by block; empty where no gimbals turn the sensor.
pub fn gimbal_derivatives<'s>(scene: &'s ForwardModel<'_>) -> &'s [Means] {
    scene.gimbal_derivatives.get_or_init(|| computed(scene).unwrap_or_default())
}

fn computed(scene: &ForwardModel<'_>) -> Option<Vec<Means>> {
    let offset = find("rig.encoder_offset").filter(|_| scene.settings.source.gimbals)?;
    let reference = Reference::new(scene, Vec::new(), &scene.coarse).ok()?;
    let neutral = offset.neutral(scene.duration());
    let of = |gimbal: usize| {
        let scale = 1.0 / offset.parameters[gimbal].prior_scale;
        let mut means = reference.signature(offset, gimbal, &neutral).ok()?;
        means.iter_mut().flatten().flatten().for_each(|value| *value *= scale);
        Some(means)
    };
    (0..offset.parameters.len()).map(of).collect()
}
