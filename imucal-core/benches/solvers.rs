//! How long fits take by model and by the number of observations, in f32 (what a device computes, bit for bit) and in f64, and a
//! particle swarm by its particles, on one core and on all. Prints the tables of imucal-host/docs/performance.md; figures are ratios within one run.
//!
//! `cargo bench -p imucal-core --bench solvers`

use std::{hint::black_box, time::Instant};

use imucal_core::{
    model::{
        Cost, Model,
        dip::{DipModel, DirectionPair},
        norm::NormModel,
        parameterisation::{FULL, FULL_GAIN, UPPER_TRIANGULAR},
        turn::{TurnModel, TurnPass},
    },
    observation::{BlockBuilder, Durations, ShellPoint, Turn},
    rotation::exp,
    scalar::Scalar,
    solver::{
        LevenbergMarquardt, Swarm,
        lm::Settings,
        swarm::{self, Bounds, SwarmReport},
    },
    triad::Triad,
};
use nalgebra::{Matrix3, SVector, Vector3};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use rayon::prelude::*;

/// Observations of a fit.
const COUNTS: [usize; 3] = [38, 380, 3800];
/// Particles of the swarms.
const FEW: usize = 10;
/// See [`FEW`].
const MANY: usize = 40;
/// Time over which a turn is cut into blocks, s, and blocks of a turn.
const BLOCK: (f64, usize) = (0.05, 40);

fn main() {
    println!(
        "| model | parameters | observations | f64, s | f64, an observation over that of {} | f32 over f64 |",
        COUNTS[0]
    );
    println!("| --- | --- | --- | --- | --- | --- |");
    table("norm", 9, |count| [norm::<f64>(count), norm::<f32>(count)]);
    table("dip", 4, |count| [dip::<f64>(count), dip::<f32>(count)]);
    table("turn", 9, |count| [turn::<f64>(count), turn::<f32>(count)]);
    let threads = rayon::current_num_threads();
    println!("\n| swarm on turns | particles | f64, s | f32 over f64 | f64, {threads} threads over one |");
    println!("| --- | --- | --- | --- | --- |");
    for (particles, [wide, narrow, together]) in [
        (FEW, [search::<f64, FEW>(), search::<f32, FEW>(), search_together::<FEW>()]),
        (MANY, [search::<f64, MANY>(), search::<f32, MANY>(), search_together::<MANY>()]),
    ] {
        let (narrow, together) = (narrow / wide, together / wide);
        println!("| {} | {particles} | {wide:.2e} | {narrow:.2} | {together:.2} |", COUNTS[0]);
    }
}

/// Prints a model's lines.
fn table(name: &str, parameters: usize, seconds: impl Fn(usize) -> [f64; 2]) {
    let mut first = None;
    for count in COUNTS {
        let [wide, narrow] = seconds(count);
        let each = wide / count as f64;
        let growth = each / *first.get_or_insert(each);
        println!("| {name} | {parameters} | {count} | {wide:.2e} | {growth:.2} | {:.2} |", narrow / wide);
    }
}

/// Seconds of a fit from `start`, the quickest of several.
fn fit<T: Scalar, const P: usize>(model: &impl Model<T, P>, start: SVector<T, P>) -> f64 {
    least_time(|| {
        let mut solver = LevenbergMarquardt::new(start, Settings::default());
        let report = black_box(solver.run(black_box(model)));
        assert!(report.termination.was_successful(), "{report:?}");
    })
}

/// The least time of some calls, s: other work on the machine only adds.
fn least_time(mut call: impl FnMut()) -> f64 {
    let time = |_| {
        let start = Instant::now();
        call();
        start.elapsed().as_secs_f64()
    };
    (0..20).map(time).fold(f64::MAX, f64::min)
}

/// The k-th of directions spread over a sphere, the same for any number of them.
fn direction(k: usize) -> Vector3<f64> {
    let k = k as f64;
    Vector3::new((1.3 * k).sin(), (2.1 * k + 0.4).cos(), (0.7 * k + 1.0).sin()).normalize()
}

/// What stands for noise: small, and never the same.
fn small(k: usize) -> Vector3<f64> {
    let k = k as f64;
    Vector3::new((12.9 * k).sin(), (78.2 * k).sin(), (37.7 * k).sin())
}

fn gain() -> Matrix3<f64> {
    Matrix3::new(1.02, 0.01, -0.02, 0.0, 0.98, 0.015, 0.0, 0.0, 1.01)
}

fn of<T: Scalar>(v: &Vector3<f64>) -> Vector3<T> {
    v.map(T::of)
}

fn norm<T: Scalar>(count: usize) -> f64 {
    let value = |k| gain() * (direction(k) * 9.8) + Vector3::new(0.2, -0.1, 0.3) + small(k) * 0.01;
    let points: Vec<ShellPoint<T>> = (0..count).map(|k| ShellPoint::new(of(&value(k)))).collect();
    let model = NormModel { points: &points, norm: T::of(9.8), form: UPPER_TRIANGULAR };
    fit(&model, UPPER_TRIANGULAR.theta(&Triad::identity()))
}

fn dip<T: Scalar>(count: usize) -> f64 {
    let apart = exp(&Vector3::new(0.1, -0.2, 0.15));
    let pair = |k| {
        let u_f = direction(k);
        let across = u_f.cross(&direction(k + 7)).normalize();
        let u_b = apart.tr_mul(&(u_f * -0.8 + across * 0.6 + small(k) * 0.002)).normalize();
        DirectionPair { u_f: of::<T>(&u_f), u_b: of(&u_b) }
    };
    let pairs: Vec<_> = (0..count).map(pair).collect();
    fit(&DipModel { pairs: &pairs }, SVector::zeros())
}

/// Blocks and ends of turns about changing axes.
struct Turns<T: Scalar> {
    blocks: Vec<Vec<imucal_core::observation::Block<T>>>,
    ends: Vec<[Vector3<T>; 2]>,
}

impl<T: Scalar> Turns<T> {
    fn new(count: usize) -> Self {
        let mut turns = Self { blocks: Vec::new(), ends: Vec::new() };
        for turn in 0..count {
            let (mut c, mut blocks) = (Matrix3::identity(), Vec::new());
            let mut builder = BlockBuilder::default();
            for k in 0..BLOCK.1 {
                let rate = direction(turn) * (1.0 + 0.2 * (0.3 * k as f64).sin());
                c *= exp(&(rate * BLOCK.0));
                let raw = gain() * rate + small(turn + k) * 1e-4;
                (0..5).for_each(|_| builder.push(&of::<T>(&raw), T::of(BLOCK.0 / 5.0)));
                blocks.push(builder.finish().0);
            }
            let before = direction(turn + 3);
            turns.blocks.push(blocks);
            turns.ends.push([of(&before), of(&c.tr_mul(&before))]);
        }
        turns
    }

    fn turns(&self) -> Vec<Turn<'_, T>> {
        let turn = |(blocks, [before, after]): (_, &[Vector3<T>; 2])| Turn {
            blocks,
            durations: Durations::Uniform(T::of(BLOCK.0)),
            before: *before,
            after: *after,
        };
        self.blocks.iter().map(Vec::as_slice).zip(&self.ends).map(turn).collect()
    }
}

fn turn<T: Scalar>(count: usize) -> f64 {
    let made = Turns::<T>::new(count);
    let turns = made.turns();
    fit(&TurnModel { turns: &turns, form: FULL_GAIN }, FULL_GAIN.theta(&Triad::identity()))
}

/// Seconds of a swarm that looks for gain and bias.
fn search<T: Scalar, const N: usize>() -> f64 {
    searched(|swarm: &mut Swarm<T, N, 12, _>, model, rng| swarm.run(model, rng))
}

/// The same by costs on all cores.
fn search_together<const N: usize>() -> f64 {
    searched(|swarm: &mut Swarm<f64, N, 12, _>, model, rng| {
        swarm.run_ahead(rng, |positions, values| {
            positions.par_iter().zip(values).for_each(|(theta, value)| *value = model.cost(theta));
        })
    })
}

/// Seconds of a swarm by this way to run it.
fn searched<T: Scalar, const N: usize>(
    run: impl Fn(&mut Swarm<T, N, 12, TurnPass<T>>, &TurnModel<'_, T, 12>, &mut ChaCha8Rng) -> SwarmReport<T>,
) -> f64 {
    let made = Turns::<T>::new(COUNTS[0]);
    let turns = made.turns();
    let model = TurnModel { turns: &turns, form: FULL };
    let bounds = Bounds::around(&FULL.theta(&Triad::identity()), &SVector::repeat(T::of(0.1)));
    let bounds = bounds.expect("low is below high");
    least_time(|| {
        let mut swarm = Swarm::new(bounds, swarm::Settings::default());
        black_box(run(&mut swarm, black_box(&model), &mut ChaCha8Rng::seed_from_u64(1)));
    })
}
