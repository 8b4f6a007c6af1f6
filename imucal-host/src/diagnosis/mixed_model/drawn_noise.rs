//! Noise drawn from its model: what the block means of a sensor would be without any gap.

use nalgebra::Vector3;

use super::noise::{Noise, Weighing};
use crate::{recording::SensorKind, simulator::random::Random};

impl Weighing<'_> {
    /// Block means of a sensor that hold noise alone: white noise, both drifts, and pointing errors of the rests.
    pub fn drawn(&self, kind: SensorKind, noise: &Noise, random: &mut Random) -> Vec<Vector3<f64>> {
        let mut means = vec![Vector3::zeros(); self.scene.blocks.len()];
        let sensor = &noise.sensors[kind as usize];
        for axis in 0..3 {
            for process in sensor.drifts() {
                let (mut state, mut last) = (process.sigma * random.normal(), None);
                for (mean, block) in means.iter_mut().zip(&self.scene.blocks) {
                    let distance = last.map_or(0.0, |last| f64::max(block.time - last, 0.0));
                    let step = libm::sqrt(process.innovation(distance).max(0.0));
                    state = state * process.kept(distance) + step * random.normal();
                    last = Some(block.time);
                    mean[axis] += state;
                }
            }
            let (count, offsets) = self.pointing_errors(kind, axis).offsets();
            let errors: Vec<f64> = (0..count).map(|_| sensor.scatter * random.normal()).collect();
            for (at, block) in self.scene.blocks.iter().enumerate() {
                let turned: f64 = offsets.row(at).map(|(error, share)| errors[error] * share).sum();
                let white = if block.rest.is_some() { sensor.white } else { sensor.moving }[axis];
                let worth = self.scene.worth(kind, at).max(1.0);
                means[at][axis] += turned + white / libm::sqrt(worth) * random.normal();
            }
        }
        means
    }
}
