//! What a swarm's particle costs in `f32` over 100 s at 100 Hz: by blocks, and by samples with the same exponential
//! and the same comparisons.
//!
//! `cargo run --release -p imucal-core --example particle_cost` prints the ratio of the times. The functions
//! `by_blocks` and `by_samples` are kept whole so that an instruction counter can tell them apart.

use std::{hint::black_box, time::Instant};

use imucal_core::{
    model::{Cost, attitude::AttitudeModel, parameterisation::FULL},
    observation::{Block, BlockBuilder, Compared, Durations, Motion},
    rotation::{exp, matrix, quaternion, quaternion_log},
    triad::Triad,
};
use nalgebra::{Quaternion, SVector, Vector3};

const DT: f32 = 0.01;
const SAMPLES: usize = 10_000;
/// Samples between two comparisons with a reference.
const BETWEEN: usize = 100;

/// Raw rate of a table that turns on all axes, rad/s, and Earth rate on it.
fn rate(k: usize) -> (Vector3<f32>, Vector3<f32>) {
    let t = k as f32 * DT;
    let rate = Vector3::new((0.7 * t).sin(), 0.8 * (0.5 * t + 0.4).sin(), -1.2 * (0.3 * t).cos());
    (rate, Vector3::new(0.6, (0.3 * t).sin(), -(0.3 * t).cos()) * 7e-5)
}

#[inline(never)]
fn by_blocks(model: &AttitudeModel<'_, f32, 12>, theta: &SVector<f32, 12>) -> f32 {
    model.cost(theta)
}

#[inline(never)]
fn by_samples(
    samples: &[(Vector3<f32>, Vector3<f32>)],
    start: &Quaternion<f32>,
    references: &[Quaternion<f32>],
    theta: &SVector<f32, 12>,
) -> f32 {
    let triad = FULL.triad(theta);
    let mut c = matrix(start);
    let mut sum = 0.0;
    for (samples, reference) in samples.chunks_exact(BETWEEN).zip(references) {
        for (rate, earth) in samples {
            c *= exp(&((triad.correct(rate) - earth) * DT));
        }
        sum += quaternion_log(&(reference.conjugate() * quaternion(&c))).norm_squared();
    }
    sum / references.len() as f32
}

/// The least time of some calls, µs: other work on the machine only adds.
fn least_time(mut call: impl FnMut()) -> f64 {
    let time = |_| {
        let start = Instant::now();
        call();
        start.elapsed().as_secs_f64() * 1e6
    };
    (0..200).map(time).fold(f64::MAX, f64::min)
}

fn main() {
    let samples: Vec<_> = (0..SAMPLES).map(rate).collect();
    let theta = FULL.theta(&Triad::identity()) * 1.01f32;
    let start = Quaternion::identity();
    let mut c = matrix(&start);
    let references: Vec<_> = samples
        .chunks_exact(BETWEEN)
        .map(|samples| {
            samples.iter().for_each(|(rate, earth)| c *= exp(&((rate - earth) * DT)));
            quaternion(&c)
        })
        .collect();
    let samples_time = least_time(|| {
        black_box(by_samples(&samples, &start, &references, black_box(&theta)));
    });
    println!(
        "by samples: {samples_time:.0} us, cost {:.3e}",
        by_samples(&samples, &start, &references, &theta)
    );
    // Other block sizes may be named; they must divide 100.
    let named: Vec<usize> = std::env::args().skip(1).filter_map(|size| size.parse().ok()).collect();
    for size in if named.is_empty() { vec![5, 10, 20] } else { named } {
        let mut builder = BlockBuilder::default();
        let mut block = |samples: &[(Vector3<f32>, Vector3<f32>)]| -> Block<f32> {
            samples.iter().for_each(|(rate, _)| builder.push(rate, DT));
            builder.finish().0
        };
        let blocks: Vec<_> = samples.chunks_exact(size).map(&mut block).collect();
        let mean =
            |s: &[(Vector3<f32>, Vector3<f32>)]| s.iter().map(|(_, e)| e).sum::<Vector3<f32>>() / size as f32;
        let earth: Vec<_> = samples.chunks_exact(size).map(mean).collect();
        let motions = [Motion {
            blocks: &blocks,
            durations: Durations::Uniform(DT * size as f32),
            earth: &earth,
            force: &[],
            start,
            references: &references,
            compared: Compared::Every((BETWEEN / size) as u32),
        }];
        let model = AttitudeModel { motions: &motions, form: FULL };
        let time = least_time(|| {
            black_box(by_blocks(&model, black_box(&theta)));
        });
        let ratio = samples_time / time;
        println!(
            "by blocks of {size}: {time:.0} us, {ratio:.1} times less, cost {:.3e}",
            by_blocks(&model, &theta)
        );
    }
}
