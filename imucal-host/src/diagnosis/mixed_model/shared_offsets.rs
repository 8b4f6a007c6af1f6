//! The probability of a set of effects where all sensors stand off the encoders together.
//!
//! ```text
//! Σ = Σ₀ + σ² V Vᵀ      V = Σ_j h_j(t) u_g      h_j: one at a rest, a straight line in time from each rest to the next
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | Σ₀ | white noise and drift of each axis, as [`super::noise`] has found them |
//! | u_g | the simulator's derivative along gimbal g, of accelerometer and magnetometer |
//! | σ | scatter, rad: the likeliest |
//!
//! A gimbal's offset turns six axes at once. Taken axis by axis ([`super::repeatability`]), which wants far smaller matrices, one
//! such chance looks like six, and an effect that turns them all seems sure: it sifts the sets of which the best are
//! judged here. Not modelled: that the gyroscope sees offsets change.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::{
    design::{Channel, Design, DesignProducts, Normal},
    noise::{Noise, Weighing},
    random_effects::Sparse,
    repeatability::stretches,
    schur_complement::eliminated,
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

/// All columns, as white noise weighs them, and before them the gimbals' offsets at so many nodes.
pub struct SharedOffsets {
    condensed: DesignProducts,
    count: usize,
}

impl SharedOffsets {
    /// The gimbals' offsets at nodes beside all columns, by a noise's white one; `None` where no rig guides the sensor, or
    /// nothing but a gyroscope was recorded.
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
        let (places, nodes) = nodes(&scene.blocks);
        let count = turned.len() * nodes;
        let sparse = |channel: &Channel| {
            let row = |(block, place): (usize, &[(usize, f64); 2])| {
                let of = |gimbal: usize| turned[gimbal][channel.kind as usize].as_ref();
                let u = |gimbal: usize| of(gimbal).map_or(0.0, |means| means[block][channel.axis]);
                let along = place
                    .iter()
                    .flat_map(|(node, share)| (0..turned.len()).map(move |gimbal| (*node, *share, gimbal)));
                along.map(|(node, share, gimbal)| (turned.len() * node + gimbal, share * u(gimbal))).collect()
            };
            match channel.kind {
                SensorKind::Gyr => Sparse::none(),
                _ => Sparse { count, rows: places.iter().enumerate().map(row).collect() },
            }
        };
        let latents = |channel: &Channel| weighing.drifting(channel, noise);
        Some(Self { condensed: design.condensed_beside(&latents, &sparse, count), count })
    }

    /// The greatest value of the normal equations of the fitted columns over the scatter of the offsets.
    pub fn likeliest(
        &self,
        scene: &ForwardModel<'_>,
        noise: &Noise,
        fitted: &[usize],
        value_of: &(dyn Fn(&Normal) -> Option<f64> + Sync),
    ) -> Option<f64> {
        let known: Vec<usize> = (0..self.count).chain(fitted.iter().map(|id| self.count + id)).collect();
        let normal = noise.normal(&self.condensed.picked(None, &known), known.len());
        let usual = usual_scatter(scene, noise);
        likeliest(&|steps: i32| value_of(&without(&normal, self.count, usual * RATIO.powi(steps))?))
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
fn nodes(blocks: &[Block]) -> (Vec<[(usize, f64); 2]>, usize) {
    let mut places = Vec::with_capacity(blocks.len());
    let mut node = 0;
    for stretch in stretches(blocks) {
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

/// Normal equations with the first `count` columns integrated out, whose amounts are normal with this standard deviation.
fn without(normal: &Normal, count: usize, sigma: f64) -> Option<Normal> {
    let (size, n) = (normal.score.len(), normal.score.len() - count);
    let mut all = DMatrix::zeros(size + 1, size + 1);
    all.view_mut((0, 0), (size, size)).copy_from(&normal.information);
    all.view_mut((0, size), (size, 1)).copy_from(&normal.score);
    all[(size, size)] = normal.energy;
    all.rows_mut(0, count).scale_mut(sigma);
    all.columns_mut(0, count).scale_mut(sigma);
    (0..count).for_each(|own| all[(own, own)] += 1.0);
    let (left, log_determinant) = eliminated(all, count)?;
    Some(Normal {
        information: left.view((0, 0), (n, n)).into_owned(),
        score: left.view((0, n), (n, 1)).column(0).into_owned(),
        energy: left[(n, n)],
        log_determinant: normal.log_determinant + log_determinant,
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

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
        let (places, count) = nodes(&blocks);
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
    fn the_greatest_value_is_found_up_and_down_and_no_further_than_it_may_be_looked_for() {
        let peak_at = |peak: i32| likeliest(&|step| Some(-f64::from((step - peak).pow(2))));
        for peak in -STEPS..=STEPS {
            assert_eq!(peak_at(peak), Some(0.0), "{peak}");
        }
        assert_eq!(peak_at(STEPS + 3), Some(-9.0));
        // What cannot be computed is no greater than what can.
        assert_eq!(likeliest(&|step| (step == 0).then_some(7.0)), Some(7.0));
        assert_eq!(likeliest(&|step| (step != 0).then_some(7.0)), None);
    }

    #[test]
    fn columns_that_are_integrated_out_leave_what_their_covariance_leaves() {
        let (rows, sigma) = (9, 0.7);
        let v = DMatrix::from_fn(rows, 2, |i, j| (1.3 * i as f64 + j as f64).sin());
        let x = DMatrix::from_fn(rows, 3, |i, j| (0.4 * (i * j) as f64 + i as f64).cos());
        let y = DVector::from_fn(rows, |i, _| (i as f64 - 3.0) * 0.3);
        let all = DMatrix::from_fn(rows, 5, |i, j| if j < 2 { v[(i, j)] } else { x[(i, j - 2)] });
        let normal = Normal {
            information: all.tr_mul(&all),
            score: all.tr_mul(&y),
            energy: y.dot(&y),
            log_determinant: 0.0,
        };
        let found = without(&normal, 2, sigma).unwrap();
        let covariance = DMatrix::identity(rows, rows) + &v * v.transpose() * (sigma * sigma);
        let inverse = covariance.clone().try_inverse().unwrap();
        assert!((found.information - x.tr_mul(&(&inverse * &x))).amax() < 1e-12);
        assert!((found.score - x.tr_mul(&(&inverse * &y))).amax() < 1e-12);
        assert!((found.energy - y.dot(&(&inverse * &y))).abs() < 1e-12);
        assert!((found.log_determinant - covariance.determinant().ln()).abs() < 1e-12);
    }
}
