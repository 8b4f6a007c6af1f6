//! Pointing errors of a table that turn all sensors at once.
//!
//! ```text
//! offsets: h_j(t) u_g δ_jg      δ ~ N(0, σ²)      h_j: one at a rest, a straight line in time from each rest to the next
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | u_g | the simulator's derivative along gimbal g, of accelerometer and magnetometer |
//! | σ | scatter, rad: the likeliest |
//!
//! A gimbal's offset turns six axes at once. Treated axis by axis ([`super::repeatability`]), which needs far smaller
//! matrices, one such error counts as several independent coincidences, and an effect that turns all axes seems certain:
//! sets of effects are screened so, and the best are scored with the offsets of this file. Not modelled: that the
//! gyroscope sees offsets change.

use crate::noise::sparse_rows::SparseRows;
use rayon::prelude::*;

use super::{
    design::{Channel, ChannelGroup, Design, GroupProducts, Normal},
    noise::{Noise, Weighing},
    repeatability::stretches,
};
use crate::{
    diagnosis::residual::{
        block::Block, forward_model::ForwardModel, gimbal_derivatives::gimbal_derivatives,
    },
    recording::SensorKind,
};

/// Ratio of scatters that are tried, and how often they are changed.
const RATIO: f64 = 1.5;
const STEPS: i32 = 8;

/// The channels of a design, those that the gimbals' offsets turn in one group.
pub struct SharedOffsets {
    groups: Vec<ChannelGroup>,
}

impl SharedOffsets {
    /// By a noise's white one; `None` where no rig guides the sensor, or nothing but a gyroscope was recorded.
    pub fn of(
        scene: &ForwardModel<'_>,
        design: &Design,
        weighing: &Weighing<'_>,
        noise: &Noise,
    ) -> Option<Self> {
        let turned = gimbal_derivatives(scene);
        if turned.is_empty() || scene.kinds == [SensorKind::Gyr] {
            return None;
        }
        let (places, nodes) = nodes(&scene.blocks, scene.settings.noise.longest_stretch);
        let offsets = |channel: &Channel| {
            let mut rows = SparseRows::default();
            for (block, place) in places.iter().enumerate() {
                let u = |gimbal: usize| {
                    let means = turned[gimbal][channel.kind as usize].as_ref();
                    means.map_or(0.0, |means| means[block][channel.axis])
                };
                let counting = place.iter().filter(|(_, share)| *share != 0.0);
                rows.push(counting.flat_map(|(node, share)| {
                    (0..turned.len()).map(move |gimbal| (turned.len() * node + gimbal, share * u(gimbal)))
                }));
            }
            rows.shrunk()
        };
        let is_turned = |at: &usize| design.channels[*at].kind != SensorKind::Gyr;
        let (turned_alike, others): (Vec<usize>, Vec<usize>) =
            (0..design.channels.len()).partition(is_turned);
        let none = |_: &Channel| SparseRows::empty(scene.blocks.len());
        let alone = others.into_iter().map(|at| weighing.effects_shared(design, noise, vec![at], 0, &none));
        let mut groups: Vec<ChannelGroup> = alone.collect();
        groups.push(weighing.effects_shared(design, noise, turned_alike, turned.len() * nodes, &offsets));
        Some(Self { groups })
    }

    /// The greatest value of the normal equations of the fitted columns over the scatter of the offsets.
    pub fn likeliest(
        &self,
        scene: &ForwardModel<'_>,
        design: &Design,
        noise: &Noise,
        fitted: &[usize],
        value_of: &(dyn Fn(&Normal) -> Option<f64> + Sync),
    ) -> Option<f64> {
        let products = design.products(&self.groups, fitted);
        let part = |group: &GroupProducts, scatter: f64| {
            let precision = noise.precision(&group.kinds, &group.columns.effects, scatter);
            Normal::of(&group.columns, &precision)
        };
        // What shares no offset is the same for every scatter.
        let alone = |group: &GroupProducts| (!group.columns.effects.has_offsets()).then(|| part(group, 0.0));
        let alone: Vec<Option<Normal>> = products.groups.par_iter().map(alone).collect();
        let usual = usual_scatter(scene, noise);
        likeliest(&|steps: i32| {
            let scatter = usual * RATIO.powi(steps);
            let known = products.groups.iter().zip(&alone);
            let parts = known.map(|(group, known)| known.clone().unwrap_or_else(|| part(group, scatter)));
            value_of(&products.sum(fitted.len(), &parts.collect::<Vec<_>>()))
        })
    }
}

/// Scatter of the sensors that show it, rad.
fn usual_scatter(scene: &ForwardModel<'_>, noise: &Noise) -> f64 {
    let shown = scene.kinds.iter().filter(|kind| **kind != SensorKind::Gyr);
    let logs: Vec<f64> = shown.map(|kind| noise.sensors[*kind as usize].scatter.ln()).collect();
    (logs.iter().sum::<f64>() / logs.len().max(1) as f64).exp()
}

/// By how much the offsets of nodes count in each block, and the number of nodes: one for each rest, which keeps its own
/// and shares it with one that follows without a movement, and others where a movement begins, ends or goes on for long.
fn nodes(blocks: &[Block], longest: f64) -> (Vec<[(usize, f64); 2]>, usize) {
    let mut places = Vec::with_capacity(blocks.len());
    let mut node = 0;
    for stretch in stretches(blocks, longest) {
        let (first, last) = (&blocks[stretch.start], &blocks[stretch.end - 1]);
        if first.rest.is_some() {
            places.extend(stretch.map(|_| [(node, 1.0), (node, 0.0)]));
            continue;
        }
        let length = last.time - first.time;
        for block in &blocks[stretch] {
            let share = if length > 0.0 { (block.time - first.time) / length } else { 0.5 };
            places.push([(node, 1.0 - share), (node + 1, share)]);
        }
        node += 1;
    }
    (places, node + 1)
}

/// The greatest value, at steps from zero up or down as long as it grows.
fn likeliest(value: &(dyn Fn(i32) -> Option<f64> + Sync)) -> Option<f64> {
    let near: Vec<Option<f64>> = [0, 1, -1].par_iter().map(|step| value(*step)).collect();
    let here = near[0]?;
    let grows = |at: usize| near[at].filter(|found| *found > here);
    let Some((mut most, way)) = grows(1).map(|m| (m, 1)).or(grows(2).map(|m| (m, -1))) else {
        return Some(here);
    };
    for step in 2..=STEPS {
        let Some(found) = value(way * step).filter(|found| *found > most) else { break };
        most = found;
    }
    Some(most)
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;

    fn blocks(count: usize, rest: Option<usize>, after: f64) -> impl Iterator<Item = Block> {
        (0..count).map(move |k| Block { rows: k..k + 1, time: after + 0.5 * k as f64, rest })
    }

    #[test]
    fn a_rest_keeps_its_offset_and_a_movement_goes_over_from_one_to_the_next() {
        let blocks: Vec<Block> = blocks(2, Some(0), 0.0)
            .chain(blocks(3, None, 1.0))
            .chain(blocks(1, Some(1), 2.5))
            .chain(blocks(1, Some(2), 3.0))
            .chain(blocks(1, None, 3.5))
            .collect();
        let (places, count) = nodes(&blocks, 20.0);
        let mut h = DMatrix::zeros(blocks.len(), count);
        for (block, place) in places.iter().enumerate() {
            place.iter().for_each(|(node, share)| h[(block, *node)] += share);
        }
        let expected = DMatrix::from_row_slice(
            8,
            3,
            &[
                1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0,
                0.0, 1.0, 0.0, 0.0, 0.5, 0.5,
            ],
        );
        assert_eq!(h, expected);
    }

    #[test]
    fn the_greatest_value_is_found_up_and_down_within_the_steps() {
        let peak_at = |peak: i32| likeliest(&|step| Some(-f64::from((step - peak).pow(2))));
        for peak in -STEPS..=STEPS {
            assert_eq!(peak_at(peak), Some(0.0), "{peak}");
        }
        assert_eq!(peak_at(STEPS + 3), Some(-9.0));
        // What cannot be computed is no greater than what can.
        assert_eq!(likeliest(&|step| (step == 0).then_some(7.0)), Some(7.0));
        assert_eq!(likeliest(&|step| (step != 0).then_some(7.0)), None);
    }
}
