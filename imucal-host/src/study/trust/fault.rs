//! Kinds of fault, each put into a hand recording where it arises, with a size drawn so that it matters.

use std::ops::Range;

use imucal_core::triad::Triad;
use nalgebra::{Matrix3, Rotation3, Vector3};

use super::Hand;
use crate::{
    recording::{Recording, SensorKind, Triple},
    simulator::random::Random,
};

/// Standard gravity, for sizes only, m/s².
const G: f64 = 9.8;
/// Length of the field, for sizes only, µT.
const FIELD: f64 = 48.0;

/// A kind of fault.
#[derive(Clone, Copy)]
pub struct Fault {
    /// Its name in the table.
    pub name: &'static str,
    /// Sensors whose calibration it falsifies.
    pub sensors: &'static [SensorKind],
    /// Puts it into the parts; the truth becomes what a calibration ought to find nevertheless.
    hand: fn(&mut Hand, &mut Random),
    /// Puts it into the finished recording.
    recording: fn(&mut Recording, &mut Hand, &mut Random),
}

use SensorKind::{Acc, Gyr, Mag};

const INERTIAL: &[SensorKind] = &[Acc, Gyr];
const ALL: &[SensorKind] = &[Acc, Gyr, Mag];

const fn inside(
    name: &'static str,
    sensors: &'static [SensorKind],
    hand: fn(&mut Hand, &mut Random),
) -> Fault {
    Fault { name, sensors, hand, recording: |_, _, _| () }
}

const fn after(
    name: &'static str,
    sensors: &'static [SensorKind],
    recording: fn(&mut Recording, &mut Hand, &mut Random),
) -> Fault {
    Fault { name, sensors, hand: |_, _| (), recording }
}

/// Every kind.
pub const FAULTS: &[Fault] = &[
    inside("acc: warm-up, temperature recorded", ALL, |hand, random| {
        warm_up(hand, random);
        let temperature = hand.time.iter().map(|t| 20.0 + 15.0 * warmth(*t, hand)).collect();
        hand.temperature = Some(temperature);
    }),
    inside("acc: warm-up, no temperature", ALL, warm_up),
    inside("acc: a sixth of the rests off", ALL, rests_off),
    inside("acc: bias steps in the middle", ALL, |hand, random| {
        bias_step(hand, Acc, random.between(0.3, 1.5), random)
    }),
    inside("acc: gain steps in the middle", ALL, |hand, random| {
        gain_step(hand, Acc, random.between(0.02, 0.06), random)
    }),
    inside("acc: clips before the noise", ALL, |hand, random| clip(hand, Acc, random.between(0.7, 0.85) * G)),
    inside("acc: compresses", ALL, |hand, random| compress(hand, Acc, random.between(1.5, 2.5) * G)),
    inside("acc: cubic", ALL, |hand, random| bend(hand, Acc, G, |x| x * x * x, random)),
    inside("acc: quadratic", ALL, |hand, random| bend(hand, Acc, G, |x| x * x, random)),
    inside("acc: gain differs by sign", ALL, |hand, random| bend(hand, Acc, G, f64::abs, random)),
    inside("acc: hysteresis", ALL, hysteresis),
    inside("acc: an axis sticks in the last third", ALL, |hand, random| stick(hand, Acc, random)),
    after("acc: an axis negated", ALL, |recording, hand, random| negate(recording, hand, Acc, random)),
    after("acc: two axes swapped", ALL, |recording, hand, random| swap(recording, hand, Acc, random)),
    after("acc: g read as m/s²", ALL, |recording, _, _| scale(&mut recording.acc, 1.0 / 9.806_65)),
    inside("rests turn slowly", ALL, creep),
    inside("gyr: soft saturation", &[Gyr], |hand, random| {
        let most = hand.input.iter().map(|input| input.w_iq_q.amax()).fold(0.0, f64::max);
        compress(hand, Gyr, most * random.between(0.8, 1.6));
    }),
    inside("gyr: clips before the noise", &[Gyr], |hand, random| {
        let most = hand.input.iter().map(|input| input.w_iq_q.amax()).fold(0.0, f64::max);
        clip(hand, Gyr, most * random.between(0.4, 0.7));
    }),
    inside("gyr: quadratic", &[Gyr], |hand, random| bend(hand, Gyr, 2.0, |x| x * x, random)),
    inside("gyr: gain differs by sign", &[Gyr], |hand, random| bend(hand, Gyr, 2.0, f64::abs, random)),
    inside("gyr: gain steps in the middle", &[Gyr], |hand, random| {
        gain_step(hand, Gyr, random.between(0.03, 0.1), random)
    }),
    inside("gyr: bias steps in the middle", &[Gyr], |hand, random| {
        bias_step(hand, Gyr, random.between(0.01, 0.05), random)
    }),
    inside("gyr: vibration in turns is rectified", &[Gyr], rectify),
    after("gyr: an axis negated", &[Gyr], |recording, hand, random| negate(recording, hand, Gyr, random)),
    after("gyr: two axes swapped", &[Gyr], |recording, hand, random| swap(recording, hand, Gyr, random)),
    after("gyr: deg/s read as rad/s", &[Gyr], |recording, _, _| {
        scale(&mut recording.gyr, 180.0 / std::f64::consts::PI)
    }),
    after("gyr: late by 0.1 to 0.3 s", &[Gyr], |recording, _, random| late(&mut recording.gyr, random)),
    after("gyr: an axis sticks in the last third", &[Gyr], |recording, _, random| {
        let axis = random.below(3);
        if let Some(gyr) = &mut recording.gyr {
            let from = gyr.values.len() * 2 / 3;
            let held = gyr.values[from][axis];
            gyr.values[from..].iter_mut().for_each(|w| w[axis] = held);
        }
    }),
    after("samples lost under counted stamps", INERTIAL, lose),
    after("ns read as µs", ALL, |recording, _, _| recording.time.iter_mut().for_each(|t| *t *= 1000.0)),
    after("samples repeated", ALL, repeat),
    inside("mag: +5 µT for half the time", &[Mag], |hand, random| {
        bias_step(hand, Mag, random.between(3.0, 7.0), random)
    }),
    inside("mag: field drifts", &[Mag], |hand, random| {
        let drift = random.between(0.06, 0.15);
        let last = hand.time.last().copied().unwrap_or(1.0);
        let shares: Vec<f64> = hand.time.iter().map(|t| 1.0 + drift * (t / last - 0.5)).collect();
        hand.input.iter_mut().zip(shares).for_each(|(input, share)| input.b_q *= share);
        hand.sense();
    }),
    inside("mag: a magnet comes near", &[Mag], magnet),
    inside("mag: field differs from place to place", &[Mag], gradient),
    inside("mag: gain steps in the middle", &[Mag], |hand, random| {
        gain_step(hand, Mag, random.between(0.04, 0.1), random)
    }),
    inside("mag: clips before the noise", &[Mag], |hand, random| {
        clip(hand, Mag, random.between(0.6, 0.8) * FIELD)
    }),
    inside("mag: cubic", &[Mag], |hand, random| bend(hand, Mag, FIELD, |x| x * x * x, random)),
    inside("mag: quadratic", &[Mag], |hand, random| bend(hand, Mag, FIELD, |x| x * x, random)),
    inside("mag: gain differs by sign", &[Mag], |hand, random| bend(hand, Mag, FIELD, f64::abs, random)),
    inside("mag: an axis sticks in the last third", &[Mag], |hand, random| stick(hand, Mag, random)),
    after("mag: an axis negated", &[Mag], |recording, hand, random| negate(recording, hand, Mag, random)),
    after("mag: two axes swapped", &[Mag], |recording, hand, random| swap(recording, hand, Mag, random)),
];

impl Fault {
    /// The recording with the fault, and the hand recording it comes from with its truth.
    pub fn draw(&self, mut hand: Hand, random: &mut Random) -> (Hand, Recording) {
        (self.hand)(&mut hand, random);
        let mut recording = hand.recording("fault.csv");
        (self.recording)(&mut recording, &mut hand, random);
        (hand, recording)
    }
}

impl std::fmt::Debug for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.name)
    }
}

/// Adds to what a sensor puts out, by row; its bias's truth moves by the mean.
fn add(hand: &mut Hand, kind: SensorKind, of: &dyn Fn(usize) -> Vector3<f64>) {
    let rows = hand.time.len();
    let mut sum = Vector3::zeros();
    for (row, value) in hand.clean[kind as usize].iter_mut().enumerate() {
        *value += of(row);
        sum += of(row);
    }
    hand.truth[kind as usize].bias += sum / rows as f64;
}

/// From 0 to 1 over the recording, by a third of it.
fn warmth(time: f64, hand: &Hand) -> f64 {
    let last = hand.time.last().copied().unwrap_or(1.0);
    1.0 - libm::exp(-3.0 * time / last)
}

fn warm_up(hand: &mut Hand, random: &mut Random) {
    let size = random.normals().normalize() * random.between(0.7, 2.0);
    let warm: Vec<f64> = hand.time.iter().map(|t| warmth(*t, hand)).collect();
    add(hand, Acc, &|row| size * warm[row]);
}

fn rests_off(hand: &mut Hand, random: &mut Random) {
    let rests = hand.rests.clone();
    let first = random.below(6);
    for rest in rests.iter().skip(first).step_by(6) {
        let off = random.normals().normalize() * random.between(0.7, 1.5);
        hand.clean[Acc as usize][rest.clone()].iter_mut().for_each(|a| *a += off);
    }
}

fn second_half(rows: usize) -> Range<usize> {
    rows / 2..rows
}

fn bias_step(hand: &mut Hand, kind: SensorKind, size: f64, random: &mut Random) {
    let step = random.normals().normalize() * size;
    let half = second_half(hand.time.len());
    add(hand, kind, &|row| if half.contains(&row) { step } else { Vector3::zeros() });
}

/// Of one axis; the truth is the mean of both gains.
fn gain_step(hand: &mut Hand, kind: SensorKind, size: f64, random: &mut Random) {
    let axis = random.below(3);
    let bias = hand.truth[kind as usize].bias[axis];
    let half = second_half(hand.time.len());
    for (row, value) in hand.clean[kind as usize].iter_mut().enumerate() {
        let sign = if half.contains(&row) { 0.5 } else { -0.5 };
        value[axis] = bias + (value[axis] - bias) * (1.0 + sign * size);
    }
}

fn clip(hand: &mut Hand, kind: SensorKind, at: f64) {
    hand.clean[kind as usize].iter_mut().for_each(|v| *v = v.map(|x| x.clamp(-at, at)));
}

fn compress(hand: &mut Hand, kind: SensorKind, at: f64) {
    hand.clean[kind as usize].iter_mut().for_each(|v| *v = v.map(|x| at * libm::tanh(x / at)));
}

/// Adds a function of one axis's output to it, 2 to 6 % of full scale. The truth is the linear calibration nearest to it
/// over what is recorded, as of any sensor that is not linear: where an axis sees one sign only, that sign's gain.
fn bend(hand: &mut Hand, kind: SensorKind, full: f64, of: fn(f64) -> f64, random: &mut Random) {
    let axis = random.below(3);
    let share = random.between(0.02, 0.06) * if random.below(2) == 0 { 1.0 } else { -1.0 };
    let truth = &mut hand.truth[kind as usize];
    let bias = truth.bias[axis];
    let (mut n, mut x, mut y, mut xx, mut xy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for value in &mut hand.clean[kind as usize] {
        let here = value[axis] - bias;
        let added = share * full * of(here / full);
        (n, x, y, xx, xy) = (n + 1.0, x + here, y + added, xx + here * here, xy + here * added);
        value[axis] += added;
    }
    let slope = (n * xy - x * y) / (n * xx - x * x);
    let offset = (y - slope * x) / n;
    truth.gain.column_mut(axis).scale_mut(1.0 / (1.0 + slope));
    truth.bias[axis] += offset;
}

/// Each rest is drawn towards where the axis was before.
fn hysteresis(hand: &mut Hand, random: &mut Random) {
    let size = random.between(0.1, 0.4);
    let mut before = Vector3::zeros();
    for rest in hand.rests.clone() {
        let here = hand.input[rest.start].f_q;
        let pull = (before - here).map(|d: f64| size * (d / G).clamp(-1.0, 1.0));
        hand.clean[Acc as usize][rest].iter_mut().for_each(|a| *a += pull);
        before = here;
    }
}

fn stick(hand: &mut Hand, kind: SensorKind, random: &mut Random) {
    let axis = random.below(3);
    let from = hand.time.len() * 2 / 3;
    let samples = &mut hand.clean[kind as usize];
    let held = samples[from][axis];
    samples[from..].iter_mut().for_each(|v| v[axis] = held);
}

fn negate(recording: &mut Recording, hand: &mut Hand, kind: SensorKind, random: &mut Random) {
    let mut axes = Matrix3::identity();
    axes[(0, 0)] = -1.0;
    let turn = random.below(3);
    for _ in 0..turn {
        axes = CYCLE.transpose() * axes * CYCLE;
    }
    rearrange(recording, hand, kind, &axes);
}

fn swap(recording: &mut Recording, hand: &mut Hand, kind: SensorKind, random: &mut Random) {
    let axis = random.below(3);
    let mut axes = Matrix3::identity();
    axes.swap_rows(axis, (axis + 1) % 3);
    rearrange(recording, hand, kind, &axes);
}

/// Of `e_x` it makes `e_y`, of that `e_z`.
const CYCLE: Matrix3<f64> = Matrix3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0);

/// Puts an orthogonal matrix before a sensor's output. The truth is what leads back, so that a norm, which sees neither
/// order nor signs, is right where nothing else could show them.
fn rearrange(recording: &mut Recording, hand: &mut Hand, kind: SensorKind, axes: &Matrix3<f64>) {
    let triple = match kind {
        Acc => &mut recording.acc,
        Gyr => &mut recording.gyr,
        Mag => &mut recording.mag,
    };
    if let Some(triple) = triple {
        triple.values.iter_mut().for_each(|v| *v = axes * *v);
    }
    let truth = &mut hand.truth[kind as usize];
    *truth = Triad { gain: truth.gain * axes.transpose(), bias: axes * truth.bias };
}

fn scale(triple: &mut Option<Triple>, by: f64) {
    if let Some(triple) = triple {
        triple.values.iter_mut().for_each(|v| *v *= by);
    }
}

fn late(triple: &mut Option<Triple>, random: &mut Random) {
    let by = 5 + random.below(11);
    if let Some(triple) = triple {
        let first = vec![triple.values[0]; by];
        let count = triple.values.len();
        triple.values = [first, triple.values[..count - by].to_vec()].concat();
    }
}

/// At rest the sensor turns about an axis of its own by 1 to 3 °/s.
fn creep(hand: &mut Hand, random: &mut Random) {
    let axis = nalgebra::Unit::new_normalize(random.normals());
    let rate = random.between(0.01, 0.05);
    let interval = hand.time[1] - hand.time[0];
    let mut angle = 0.0;
    let rests = hand.rests.clone();
    for (row, input) in hand.input.iter_mut().enumerate() {
        let rests = rests.iter().any(|rest| rest.contains(&row));
        let back = Rotation3::from_axis_angle(&axis, -angle);
        (input.f_q, input.w_iq_q, input.b_q) = (back * input.f_q, back * input.w_iq_q, back * input.b_q);
        if rests {
            input.w_iq_q += axis.into_inner() * rate;
            angle += rate * interval;
        }
    }
    hand.sense();
}

/// A bias in motion that grows with the square of the rate.
fn rectify(hand: &mut Hand, random: &mut Random) {
    let size = random.normals().normalize() * random.between(0.05, 0.15);
    let most = hand.input.iter().map(|input| input.w_iq_q.norm_squared()).fold(0.0, f64::max);
    let shares: Vec<f64> = hand.input.iter().map(|input| input.w_iq_q.norm_squared() / most).collect();
    hand.clean[Gyr as usize].iter_mut().zip(shares).for_each(|(w, share)| *w += size * share);
}

/// In a third of the turns a stretch of 0.1 to 0.4 s is lost, and the receiver counts on.
fn lose(recording: &mut Recording, hand: &mut Hand, random: &mut Random) {
    let mut lost = vec![false; recording.rows()];
    for pair in hand.rests.windows(2) {
        if random.below(3) > 0 {
            continue;
        }
        let turn = pair[0].end..pair[1].start;
        let count = 5 + random.below(16);
        let from = turn.start + random.below(turn.len().saturating_sub(count).max(1));
        lost[from..from + count].fill(true);
    }
    let kept: Vec<usize> = (0..lost.len()).filter(|row| !lost[*row]).collect();
    recording.time.truncate(kept.len());
    for triple in [&mut recording.acc, &mut recording.gyr, &mut recording.mag].into_iter().flatten() {
        triple.values = kept.iter().map(|row| triple.values[*row]).collect();
    }
}

/// Each sample stands for two to four rows.
fn repeat(recording: &mut Recording, _: &mut Hand, random: &mut Random) {
    let times = 2 + random.below(3);
    for triple in [&mut recording.acc, &mut recording.gyr, &mut recording.mag].into_iter().flatten() {
        for row in 0..triple.values.len() {
            triple.values[row] = triple.values[row - row % times];
        }
    }
}

/// For a quarter of the time, by up to a third of the field, fixed in space.
fn magnet(hand: &mut Hand, random: &mut Random) {
    let rows = hand.time.len();
    let size = random.between(0.15, 0.35);
    let from = random.below(rows * 3 / 4);
    for row in from..from + rows / 4 {
        let share = (row - from) as f64 / (rows / 4) as f64;
        let near = libm::pow(libm::sin(std::f64::consts::PI * share), 2.0);
        let towards = hand.input[row].f_q / G;
        hand.input[row].b_q += towards * (FIELD * size * near);
    }
    hand.sense();
}

/// The sensor is carried around the point about which the hand turns it, through a field whose gradient changes it by 2 to 6 %
/// there. The gradient has no part along the field, which would be a bias of the sensor.
fn gradient(hand: &mut Hand, random: &mut Random) {
    let lever = random.normals().normalize();
    let size = random.between(0.02, 0.06) * FIELD;
    let heading = random.between(0.0, std::f64::consts::TAU);
    for input in &mut hand.input {
        let (along, upward) = (input.b_q.normalize(), input.f_q.normalize());
        let east = along.cross(&upward).normalize();
        let across = east * libm::cos(heading) + east.cross(&along) * libm::sin(heading);
        input.b_q += (across * along.dot(&lever) + along * across.dot(&lever)) * size;
    }
    hand.sense();
}
