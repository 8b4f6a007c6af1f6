//! A gyroscope's bias: the mean of its rests, and how well they determine it.
//!
//! ```text
//! m_k = b + Ω sin λ u_k + e_k
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | m, e | mean rate of a rest and its noise: white, and drift that rests share, each axis on its own |
//! | Ω sin λ | the part of Earth's rotation along the vertical, where the latitude is known |
//! | u | direction of the specific force, upwards |
//!
//! The part of Earth's rotation across the vertical points anywhere as the sensor is turned, and counts as noise. Where
//! the noise does not reach the converter's next step, rests repeat one value and its error: it is added
//! ([`quantum`]). Not modelled: headings that are all the same; a gain far from one (Ω sin λ is 5e-5 rad/s).

use imucal_core::observation::Rest;
use nalgebra::{DMatrix, Vector3};
use rayon::prelude::*;

use super::rest_noise::{self, AtRest};
use crate::{
    noise::{
        flicker,
        interval::{Parts, Scale, Whitening},
        semiseparable::{Mean, Semiseparable},
        within::Within,
    },
    observe::quantum,
};

/// Mean rate at rest, weighted by samples, rad/s.
pub fn mean(rests: &[Rest<f64>], means: &[Vector3<f64>]) -> Vector3<f64> {
    let total: f64 = rests.iter().map(|rest| f64::from(rest.gyr.count())).sum();
    let weighed = rests.iter().zip(means).map(|(rest, mean)| mean * f64::from(rest.gyr.count()));
    weighed.sum::<Vector3<f64>>() / total
}

/// Standard error of a bias.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BiasErrors {
    /// All of it, rad/s.
    pub std: Vector3<f64>,
    /// The part that all rests share because the converter has steps, variance, (rad/s)².
    pub steps: Vector3<f64>,
    /// Density of the white noise that the means err by, (rad/s)²·s.
    pub density: Vector3<f64>,
}

/// Of the means of rests; `at_rest` are the samples that they are means of, `rests` how many there are in each.
pub fn errors(rests: &[Rest<f64>], means: &[Vector3<f64>], at_rest: &AtRest<'_>) -> BiasErrors {
    let within = at_rest.means();
    let (count, spans, density) = (rests.len(), at_rest.spans(), at_rest.density_of(&within));
    let total: f64 = rests.iter().map(|rest| f64::from(rest.gyr.count())).sum();
    let influence = DMatrix::from_fn(count, 1, |k, _| f64::from(rests[k].gyr.count()) / total);
    let length = |k: usize| spans[k].end - spans[k].start;
    let mean_over =
        |k: usize| Mean { row: k, span: spans[k].clone(), white: 1.0 / length(k), drifts: Vector3::x() };
    let noise =
        Semiseparable::new(vec![(0..count).map(mean_over).collect()], flicker::processes(&spans, 1.0));
    let ratios = rest_noise::drifts(&Within::of(&within), &spans);
    let parts = Parts { parts: &noise, ratios: &ratios, scale: Scale::AtLeastOne, five: true };
    let carried = noise.carried(&influence);
    let bias = mean(rests, means);
    // In units of the white noise; an axis without any does not move, but for the steps.
    let root = density.map(f64::sqrt);
    let scaled = DMatrix::from_fn(count, 3, |k, axis| {
        if root[axis] > 0.0 { (means[k][axis] - bias[axis]) / root[axis] } else { 0.0 }
    });
    let errors = parts.errors_of(carried, &scaled, &DMatrix::repeat(count, 1, 1.0));
    // One rest does not show how it differs from others: its own noise has to do.
    let alone = (0..count).map(|k| influence[k] * influence[k] / length(k)).sum::<f64>();
    let of_axis = |axis: usize| errors.as_ref().map_or(alone, |errors| errors[axis].covariance[(0, 0)]);
    let resting =
        |axis: usize| at_rest.rows.iter().flat_map(move |rows| at_rest.samples(rows).map(move |v| v[axis]));
    let of_axis_steps =
        |axis: usize| quantum::variances_of_means(at_rest.step[axis], std::iter::once(resting(axis)))[0];
    let mut steps = Vector3::zeros();
    steps.as_mut_slice().par_iter_mut().enumerate().for_each(|(axis, step)| *step = of_axis_steps(axis));
    let std = Vector3::from_fn(|axis, _| (of_axis(axis) * density[axis] + steps[axis]).sqrt());
    BiasErrors { std, steps, density }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        recording::Series,
        simulator::random::{Purpose, Random},
    };

    /// Root mean square error, standard errors, of 100 units of this noise and step: twelve rests of 4 s at 50 Hz.
    fn score(noise: f64, step: f64) -> f64 {
        let rows: Vec<_> = (0..12).map(|k| 300 * k..300 * k + 200).collect();
        let time: Vec<f64> = (0..3600).map(|k| 0.02 * f64::from(k)).collect();
        let square = (0..100).map(|seed| {
            let mut random = Random::new(seed, Purpose::Noise);
            let bias = Vector3::from_fn(|_, _| random.between(-0.1, 0.1));
            let mut sample = || (bias + random.normals() * noise).map(|x| (x / step).round() * step);
            // Between the rests it moves.
            let values: Vec<_> = (0..3600)
                .map(|k| sample() + Vector3::repeat(if k % 300 < 200 { 0.0 } else { step * f64::from(k) }))
                .collect();
            let rests: Vec<Rest<f64>> = rows
                .iter()
                .map(|rows| {
                    let mut rest = Rest::default();
                    values[rows.clone()].iter().for_each(|v| rest.gyr.push(v));
                    rest
                })
                .collect();
            let means: Vec<_> = rests.iter().map(|rest| rest.gyr.mean()).collect();
            let (usable, steps) = ([true; 3600], quantum::quantum(&values, &[true; 3600]));
            let series = Series { time: &time, values: &values, usable: &usable, interval: 0.02 };
            let at_rest = AtRest { series, rows: &rows, step: steps };
            let found = errors(&rests, &means, &at_rest);
            assert!(found.std.min() > 0.0, "{found:?}");
            (mean(&rests, &means) - bias).component_div(&found.std).norm_squared() / 3.0
        });
        (square.sum::<f64>() / 100.0).sqrt()
    }

    #[test]
    fn a_bias_between_two_steps_has_the_standard_error_of_the_step() {
        // Noise of a hundredth, a fifth and two steps; a drift that might be there widens the last.
        for (noise, low, high) in [(1e-4, 0.85, 1.15), (2e-3, 0.6, 1.3), (2e-2, 0.4, 1.1)] {
            let score = score(noise, 1e-2);
            assert!((low..high).contains(&score), "{noise}: {score}");
        }
    }
}
