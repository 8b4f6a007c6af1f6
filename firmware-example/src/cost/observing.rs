//! What a session's samples and slices cost, at rest and in a turn.

use core::{fmt::Write, hint::black_box, mem::MaybeUninit};

use imucal_core::{
    observer::{
        Sample,
        inertial::{InertialObserver, Seen},
    },
    record::Sensor,
    rotation::exp,
};
use nalgebra::{Matrix3, Vector3};

use super::measured;
use crate::{
    machine::Stopwatch,
    scene::Noise,
    standalone::{BLOCKS, POSES, Standalone},
};

/// Samples of a rest, and of a turn, at 100 Hz.
const RESTING: usize = 300;
const TURNING: usize = 200;

/// A sensor that is turned about by hand.
struct Hand {
    noise: Noise,
    /// From the sensor's axes to the local ones.
    attitude: Matrix3<f32>,
    time: u64,
    /// Of the sensor, °C.
    temperature: f32,
}

impl Hand {
    fn sample(&mut self, rate: &Vector3<f32>) -> (Sample<f32>, Vector3<f32>) {
        self.attitude *= exp(&(rate * 0.01));
        self.time += 10_000;
        let to_sensor = self.attitude.transpose();
        let drift = Vector3::new(2e-3, -1e-3, 1e-3) * (self.temperature - 25.0);
        let acc = to_sensor * Vector3::new(0.0, 0.0, -9.8) + drift + self.noise.vector(0.01);
        let field = to_sensor * Vector3::new(20.0, 2.0, 44.0) + self.noise.vector(0.3);
        let gyr = Some(rate + self.noise.vector(0.001));
        (Sample { time: self.time, acc, gyr, temperature: Some(self.temperature) }, field)
    }
}

#[inline(never)]
fn place() -> &'static mut Standalone {
    static mut SESSION: MaybeUninit<Standalone> = MaybeUninit::uninit();
    #[expect(unsafe_code, reason = "memory of the session, which stays off the stack")]
    // SAFETY: this is called once, and nothing else knows the variable.
    let session = unsafe { &mut *(&raw mut SESSION) };
    session.write(Standalone::new(Default::default()))
}

/// What finds a session's rests and turns, by itself.
type Observers = InertialObserver<f32, BLOCKS>;

#[inline(never)]
fn observers() -> &'static mut Observers {
    static mut OBSERVERS: MaybeUninit<Observers> = MaybeUninit::uninit();
    #[expect(unsafe_code, reason = "memory of the observers, which stays off the stack")]
    // SAFETY: this is called once, and nothing else knows the variable.
    let observers = unsafe { &mut *(&raw mut OBSERVERS) };
    observers.write(Observers::default())
}

/// Samples of a whole session in turn, each kind by itself; and the largest slice.
#[inline(never)]
pub(super) fn write(out: &mut impl Write, watch: &Stopwatch) -> core::fmt::Result {
    let (session, observers) = (place(), observers());
    let mut hand = Hand { noise: Noise(7), attitude: Matrix3::identity(), time: 0, temperature: 25.0 };
    let mut slice = 0;
    for pose in 0..POSES as u32 {
        // By steps, up and down again.
        hand.temperature = 25.0 + 2.5 * (pose % 12).min(12 - pose % 12) as f32;
        let turned = Vector3::new(0.9 - 0.1 * pose as f32, 0.5, 0.3 * (pose % 3) as f32);
        for (kind, count, rate) in [("rest", RESTING, Vector3::zeros()), ("turn", TURNING, turned)] {
            let (mut inertial, mut field, mut observed) = (0u32, 0u32, 0u32);
            for _ in 0..count {
                let (sample, measured) = hand.sample(&rate);
                let before = watch.ticks();
                session.push(&sample);
                let between = watch.ticks();
                session.push_field(&measured);
                let after = watch.ticks();
                session.work();
                slice = watch.ticks().wrapping_sub(after).max(slice);
                inertial = inertial.wrapping_add(between.wrapping_sub(before));
                field = field.wrapping_add(after.wrapping_sub(between));
                let before = watch.ticks();
                black_box(matches!(observers.push(&sample), Seen::Nothing));
                observed = observed.wrapping_add(watch.ticks().wrapping_sub(before));
            }
            if pose == 15 {
                writeln!(out, "session_{kind} ticks {inertial} for {count} stack 0")?;
                writeln!(out, "observers_{kind} ticks {observed} for {count} stack 0")?;
                writeln!(out, "session_field_{kind} ticks {field} for {count} stack 0")?;
            }
        }
    }
    writeln!(out, "session_slice ticks {slice} for 1 stack 0")?;
    measured(out, watch, ("session_guide", 1), || session.guide()).map(drop)?;
    alignment(session, out, watch)?;
    warmth(session, out, watch)
}

/// The magnetometer's rotation: its longest slice, and all of them.
#[inline(never)]
fn alignment(session: &mut Standalone, out: &mut impl Write, watch: &Stopwatch) -> core::fmt::Result {
    let Ok(mut fit) = session.alignment() else { return Err(core::fmt::Error) };
    let (longest, all) = slices(watch, || fit.work(session));
    writeln!(out, "session_alignment_slice ticks {longest} for 1 stack 0")?;
    writeln!(out, "session_alignment ticks {all} for 1 stack 0")?;
    let before = watch.ticks();
    let aligned = session.align(&fit);
    let took = watch.ticks().wrapping_sub(before);
    if aligned.is_err() {
        return Err(core::fmt::Error);
    }
    writeln!(out, "session_align ticks {took} for 1 stack 0")
}

/// Ticks of the longest of some slices, and of all of them.
fn slices(watch: &Stopwatch, mut work: impl FnMut() -> bool) -> (u32, u32) {
    let (mut longest, mut all, mut goes_on) = (0, 0u32, true);
    while goes_on {
        let before = watch.ticks();
        goes_on = work();
        let took = watch.ticks().wrapping_sub(before);
        (longest, all) = (took.max(longest), all.wrapping_add(took));
    }
    (longest, all)
}

/// The terms of temperature of the accelerometer: their longest slice, and all of them.
#[inline(never)]
fn warmth(session: &Standalone, out: &mut impl Write, watch: &Stopwatch) -> core::fmt::Result {
    let Ok(mut fit) = session.warmth(Sensor::Accelerometer) else { return Err(core::fmt::Error) };
    let (longest, all) = slices(watch, || fit.work());
    writeln!(out, "session_warmth_slice ticks {longest} for 1 stack 0")?;
    writeln!(out, "session_warmth ticks {all} for 1 stack 0")
}
