//! What a fit is given, and what it has seen of the sphere.

use imucal_core::{
    coverage,
    observation::{self, Block, BlockBuilder, Compared, Durations, Moments, Motion, ShellPoint},
};
use nalgebra::{Quaternion, Vector3};

use crate::scene;

#[inline(never)]
pub(super) fn reach_all() {
    let sample = Vector3::new(1.0f32, 2.0, 3.0);
    let mut moments: Moments<f32> = reach!(observation::Moments::default());
    reach!(observation::Moments::push(&mut moments, &sample));
    reach!(observation::Moments::join(&moments, &moments));
    reach!(observation::Moments::count(&moments));
    reach!(observation::Moments::mean(&moments));
    reach!(observation::Moments::variance(&moments));
    reach!(observation::Moments::squares(&moments));
    let _point: ShellPoint<f32> = reach!(observation::ShellPoint::new(sample));
    reach!(coverage::Coverage::of((0..20).map(|k| scene::spiral(k, 20))));
    blocks(&sample);
}

#[inline(never)]
fn blocks(sample: &Vector3<f32>) {
    let mut builder: BlockBuilder<f32> = reach!(observation::BlockBuilder::default());
    reach!(observation::BlockBuilder::push(&mut builder, sample, 0.01));
    reach!(observation::BlockBuilder::count(&builder));
    reach!(observation::BlockBuilder::duration(&builder));
    let (block, duration): (Block<f32>, f32) = reach!(observation::BlockBuilder::finish(&mut builder));
    reach!(observation::Block::join(&block, duration, &block, duration));
    reach!(observation::Block::less(&block, &Vector3::repeat(0.01), duration));
    reach!(observation::Durations::get(&Durations::Each(&[duration]), 7));
    reach!(observation::Compared::get(&Compared::Every(3), 7));
    reach!(observation::Compared::get(&Compared::After(&[1, 2]), 7));
    let motion = Motion {
        blocks: &[block],
        durations: Durations::Uniform(duration),
        earth: &[],
        force: &[],
        start: Quaternion::identity(),
        references: &[Quaternion::identity()],
        compared: Compared::Every(1),
    };
    reach!(observation::Motion::reference(&motion, 7));
}
