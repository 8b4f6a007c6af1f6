//! What the core's parts cost on a device: instructions, by a timer under QEMU's `-icount`, and stack, by paint.
//!
//! The image `cost` prints a line a part; `tests/device_cost.rs` reads them and makes the table of `imucal-host/docs/devices.md` of them.

#[cfg(mps2)]
mod observing;

use core::{fmt::Write, hint::black_box};

use imucal_core::{
    corrector::{Compensator, Corrector},
    integer::{self, IntegerCompensator},
    link::FitModel,
    model::{Cost, attitude::AttitudeModel, parameterisation::FULL},
    observation::{Block, BlockBuilder, Compared, Durations, Motion},
    record,
    solver::swarm::{Bounds, Settings, Swarm},
    temperature::TemperatureTerms,
    triad::Triad,
};
use nalgebra::{Matrix3, Quaternion, SVector, Vector3};
use rand_core::SeedableRng;
use rand_pcg::Pcg32;

use crate::{
    drill,
    fitting::{Fitting, Memory, SLICE},
    machine::Stopwatch,
    scene::{self, Noise},
    stack,
};

/// Samples of the loops.
const SAMPLES: usize = 64;
/// Blocks that the swarm's cost goes through.
#[cfg(mps2)]
const BLOCKS: usize = 1000;
/// See above.
#[cfg(microbit)]
const BLOCKS: usize = 64;
/// Particles of the swarm.
#[cfg(mps2)]
const PARTICLES: usize = 40;
/// See above.
#[cfg(microbit)]
const PARTICLES: usize = 8;

/// The memory of the fits measured.
#[cfg(mps2)]
type CostFitting<'a> = Fitting<'a, 200, 40, 16, 192, 0>;
#[cfg(mps2)]
type CostMemory = Memory<200, 40, 16, 192, 0>;
#[cfg(microbit)]
type CostFitting<'a> = Fitting<'a, 64, 20, 8, 96, 0>;
#[cfg(microbit)]
type CostMemory = Memory<64, 20, 8, 96, 0>;

/// Prints the costs.
///
/// # Errors
///
/// Those of `out`.
pub fn write(out: &mut impl Write) -> core::fmt::Result {
    let watch = Stopwatch::start();
    decode(out, &watch)?;
    apply(out, &watch)?;
    integers(out, &watch)?;
    #[cfg(microbit)]
    arithmetic(out, &watch)?;
    #[cfg(mps2)]
    observing::write(out, &watch)?;
    fits(out, &watch)?;
    particle(out, &watch)
}

/// Works, and prints what that took: ticks for how many, and stack below this call, bytes.
#[inline(never)]
fn measured<R>(
    out: &mut impl Write,
    watch: &Stopwatch,
    (name, count): (&str, usize),
    work: impl FnOnce() -> R,
) -> Result<R, core::fmt::Error> {
    let painted = stack::paint();
    let before = watch.ticks();
    let result = black_box(work());
    let ticks = watch.ticks().wrapping_sub(before);
    writeln!(out, "{name} ticks {ticks} for {count} stack {}", stack::used_below(painted))?;
    Ok(result)
}

#[inline(never)]
fn decode(out: &mut impl Write, watch: &Stopwatch) -> core::fmt::Result {
    measured(out, watch, ("nothing", 1), || ())?;
    measured(out, watch, ("decode", 1), || record::decode(black_box(crate::RECORD)).is_ok()).map(drop)
}

fn terms() -> TemperatureTerms<f32> {
    TemperatureTerms { reference: 25.0, bias_slope: [1e-3, -2e-3, 5e-4], scale_slope: [1e-5, 2e-5, -1e-5] }
}

/// Samples in a loop, by a full gain, without and with temperature terms, and the same without a corrector.
#[inline(never)]
fn apply(out: &mut impl Write, watch: &Stopwatch) -> core::fmt::Result {
    let (triad, terms) = (scene::gyroscope().truth, terms());
    let plain = Corrector::new(black_box(triad), black_box(None));
    let warm = Corrector::new(black_box(triad), black_box(Some(terms)));
    let mut compensator = Compensator::new(warm);
    let mut samples = [[0f32; 4]; SAMPLES];
    // The last is the temperature: one, and then another with each sample.
    for (k, sample) in samples.iter_mut().enumerate() {
        *sample = [k as f32, 1.0, 2.0, 31.0];
    }
    let mut moving = samples;
    for (k, sample) in moving.iter_mut().enumerate() {
        sample[3] += k as f32 * 0.125;
    }
    measured(out, watch, ("apply", SAMPLES), || {
        for [x, y, z, _] in black_box(&mut samples) {
            [*x, *y, *z] = plain.apply(&Vector3::new(*x, *y, *z)).into();
        }
    })?;
    for (name, samples) in [("apply_at", &mut samples), ("apply_at_moving", &mut moving)] {
        measured(out, watch, (name, SAMPLES), || {
            for [x, y, z, temperature] in black_box(samples) {
                [*x, *y, *z] = compensator.apply_at(&Vector3::new(*x, *y, *z), *temperature).into();
            }
        })?;
    }
    measured(out, watch, ("apply_by_hand", SAMPLES), || {
        let ([a, b, c], [x, y, z]) =
            black_box((<[[f32; 3]; 3]>::from(triad.gain), <[f32; 3]>::from(triad.bias)));
        let ([i, j, k], [u, v, w]) = black_box((terms.bias_slope, terms.scale_slope));
        for [p, q, r, temperature] in black_box(&mut moving) {
            let change = *temperature - 25.0;
            let raw = (*p - (x + i * change), *q - (y + j * change), *r - (z + k * change));
            let row = |n: [f32; 3], scale: f32| {
                (n[0] * raw.0 + n[1] * raw.1 + n[2] * raw.2) * (1.0 + scale * change)
            };
            [*p, *q, *r] = [row(a, u), row(b, v), row(c, w)];
        }
    })
}

/// The same of counts in integers, and the readings of a thermometer between them.
#[inline(never)]
fn integers(out: &mut impl Write, watch: &Stopwatch) -> core::fmt::Result {
    // ±2000 °/s.
    let (triad, terms) = (scene::gyroscope().truth.in_unit(0.0, 939.0), terms().in_unit(939.0));
    let corrector = integer::finest(&triad, Some(&terms))
        .and_then(|finest| IntegerCompensator::new(&triad, Some(&terms), finest));
    let mut compensator = black_box(corrector.map_err(|_| core::fmt::Error)?);
    let (mut samples, mut corrected) = ([[0i16; 3]; SAMPLES], [[0i32; 3]; SAMPLES]);
    for (k, sample) in samples.iter_mut().enumerate() {
        *sample = [k as i16, -1000, 32_000];
    }
    measured(out, watch, ("apply_in_integers", SAMPLES), || {
        for (raw, corrected) in black_box(&samples).iter().zip(black_box(&mut corrected)) {
            *corrected = compensator.apply(*raw);
        }
    })?;
    black_box(&corrected);
    measured(out, watch, ("set_temperature", SAMPLES), || {
        for k in 0..SAMPLES {
            compensator.set_temperature(black_box(31.0 + k as f32 * 0.125));
            black_box(&compensator);
        }
    })
}

/// Sums and products of single numbers, by [`crate::soft_float`] and by the compiler's functions.
#[cfg(microbit)]
#[inline(never)]
fn arithmetic(out: &mut impl Write, watch: &Stopwatch) -> core::fmt::Result {
    #[expect(unsafe_code, reason = "the compiler's own names")]
    unsafe extern "C" {
        fn __aeabi_fadd(a: u32, b: u32) -> u32;
        fn __aeabi_fmul(a: u32, b: u32) -> u32;
        fn __addsf3(a: u32, b: u32) -> u32;
        fn __mulsf3(a: u32, b: u32) -> u32;
    }
    type Operation = unsafe extern "C" fn(u32, u32) -> u32;
    let operations: [(_, Operation); 4] = [
        ("add", __aeabi_fadd),
        ("add_by_compiler", __addsf3),
        ("multiply", __aeabi_fmul),
        ("multiply_by_compiler", __mulsf3),
    ];
    let mut noise = Noise(1);
    let pairs = [(); SAMPLES].map(|()| {
        let [a, b, _] = <[f32; 3]>::from(noise.vector(100.0)).map(f32::to_bits);
        (a, b)
    });
    for (name, operation) in operations {
        measured(out, watch, (name, SAMPLES), || {
            for (a, b) in black_box(&pairs) {
                #[expect(unsafe_code, reason = "as above")]
                // SAFETY: functions of two numbers, which touch no memory.
                black_box(unsafe { operation(*a, *b) });
            }
        })?;
    }
    Ok(())
}

/// Each model to the end: a slice, the whole fit, and its judgement.
#[inline(never)]
fn fits(out: &mut impl Write, watch: &Stopwatch) -> core::fmt::Result {
    static mut MEMORY: CostMemory = CostMemory::new();
    #[expect(unsafe_code, reason = "memory of the fits, as on the co-processor")]
    // SAFETY: this is called once, and nothing else knows the variable.
    let mut fitting = CostFitting::new(unsafe { &mut *(&raw mut MEMORY) });
    for (model, count) in [(FitModel::T9, 40), (FitModel::I14, 40), (FitModel::E9, 200), (FitModel::K12, 12)]
    {
        let room = CostFitting::CAPACITY;
        let most = match model {
            FitModel::I14 => room.poses,
            FitModel::K12 => room.turns,
            _ => room.points,
        };
        let count = count.min(usize::from(most));
        let mut taken = fitting.begin(drill::task(model)).is_ok();
        drill::observe(model, count, &mut Noise(1), |observation| {
            taken &= fitting.take(&observation).is_ok()
        });
        if !taken {
            writeln!(out, "{} not taken", model.name())?;
            continue;
        }
        fitting.step();
        write!(out, "one iteration of ")?;
        measured(out, watch, (model.name(), count), || fitting.step())?;
        let iterations = fitting.progress().map_or(0, |progress| progress.iterations);
        fitting.begin(drill::task(model)).map_err(|_| core::fmt::Error)?;
        drill::observe(model, count, &mut Noise(1), |observation| {
            taken &= fitting.take(&observation).is_ok()
        });
        write!(out, "whole fit of ")?;
        measured(out, watch, (model.name(), count), || while !fitting.step() {})?;
        write!(out, "judgement of ")?;
        measured(out, watch, (model.name(), count), || fitting.finish().is_ok())?;
        let all = fitting.progress().map_or(0, |progress| progress.iterations);
        writeln!(out, "iterations of {} {iterations} then {all}", model.name())?;
    }
    Ok(())
}

/// One iteration of a swarm in twelve parameters over the blocks of a motion.
#[inline(never)]
fn particle(out: &mut impl Write, watch: &Stopwatch) -> core::fmt::Result {
    static mut PARTICLE_BLOCKS: [Block<f32>; BLOCKS] = [Block {
        s0: Vector3::new(0.0, 0.0, 0.0),
        s1: Vector3::new(0.0, 0.0, 0.0),
        c: Vector3::new(0.0, 0.0, 0.0),
    }; BLOCKS];
    #[expect(unsafe_code, reason = "the block store, as on the co-processor")]
    // SAFETY: this is called once, and nothing else knows the variable.
    let blocks = unsafe { &mut *(&raw mut PARTICLE_BLOCKS) };
    let mut builder = BlockBuilder::default();
    for (k, block) in blocks.iter_mut().enumerate() {
        for sample in 0..5 {
            let t = (5 * k + sample) as f32 * 0.01;
            builder
                .push(&Vector3::new(0.3 * t, 0.5 - 0.1 * t, 0.2 * t * t).map(|x| x - libm::floorf(x)), 0.01);
        }
        (*block, _) = builder.finish();
    }
    let references = [Quaternion::identity(); 4];
    let motions = [Motion {
        blocks,
        durations: Durations::Uniform(0.05),
        earth: &[],
        force: &[],
        start: Quaternion::identity(),
        references: &references,
        compared: Compared::Every((BLOCKS / 4) as u32),
    }];
    let model = AttitudeModel { motions: &motions, form: FULL };
    measured(out, watch, ("particle", BLOCKS), || model.cost(&FULL.theta(&Triad::identity())))?;
    let reach: SVector<f32, 12> =
        FULL.theta(&Triad { gain: Matrix3::repeat(0.1), bias: Vector3::repeat(0.2) });
    let Some(bounds) = Bounds::around(&FULL.theta(&Triad::identity()), &reach) else { return Ok(()) };
    let mut swarm = Swarm::<f32, PARTICLES, 12, _>::new(bounds, Settings::default());
    let mut rng = Pcg32::seed_from_u64(1);
    measured(out, watch, ("swarm_slice", SLICE), || swarm.step(&model, &mut rng, SLICE))?;
    measured(out, watch, ("swarm_iteration", PARTICLES * BLOCKS), || {
        while swarm.report().iterations < 1 && swarm.step(&model, &mut rng, SLICE).is_none() {}
    })
}
