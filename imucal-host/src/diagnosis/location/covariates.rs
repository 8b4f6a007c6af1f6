//! What a gap may follow: gimbal angles, rates, temperature, time.
//!
//! A driver is a handful of functions of the block, and each axis of a sensor may follow each of them in its own way.
//! Broader and weaker than an effect: drivers show where a gap lies, and that something is left when no effect says
//! what.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::{
    attitude_covariates,
    covariate::{Covariate, Function},
};
use crate::{
    diagnosis::residual::{block::Block, forward_model::ForwardModel},
    effect::Swing,
    recording::{GIMBALS, SensorKind},
};

/// Harmonics of a gimbal's angle.
const HARMONICS: [&str; 6] = ["first", "second", "third", "fourth", "fifth", "sixth"];
/// The time of the recording, as a driver.
pub const TIME: &str = "time";
/// Half-waves of the time of the recording.
const WAVES: usize = 8;
/// A temperature's rate is taken over this time, s.
const WARMING: f64 = 30.0;
/// Times over which what a motion leaves behind fades, s.
const FADING: [f64; 3] = [5.0, 20.0, 60.0];
/// The drivers of a scene: those that vary in it. `given` is what each sensor puts out, block by block.
pub fn drivers(scene: &ForwardModel<'_>, given: &[Vec<Vector3<f64>>; 3]) -> Vec<Covariate> {
    let swings: Option<Vec<[Swing; 3]>> = scene.blocks.iter().map(|block| scene.swings(block)).collect();
    let mut drivers = match swings {
        Some(swings) => {
            let mut drivers = of_gimbals(&swings);
            let square = |swings: &[Swing; 3]| swings.iter().map(|s| s.rate * s.rate).sum();
            drivers.push(recent_motion(swings.iter().map(square), &scene.blocks));
            drivers.push(other_sensors(given));
            drivers
        }
        None => {
            let truth = scene.plain();
            let mut drivers = attitude_covariates::drivers(&truth, &scene.kinds);
            // A stream holds what is sensed itself; of a reference's attitudes and positions much is smoothed.
            if scene.settings.source.followed {
                drivers.push(recent_motion(truth.iter().map(|row| row.w_it_t.norm_squared()), &scene.blocks));
                drivers.push(other_sensors(given));
                drivers.push(products(given));
            }
            drivers
        }
    };
    if let Some(speeds) = scene.speeds() {
        let square = speeds.iter().map(|speed| speed * speed).collect();
        let functions = vec![Function::new("linear", speeds), Function::new("quadratic", square)];
        drivers.push(Covariate { name: "speed".into(), functions });
    }
    let duration = scene.duration().max(1.0);
    let wave = |order: usize| {
        let values = scene.blocks.iter().map(|b| libm::cos(PI * order as f64 * b.time / duration)).collect();
        Function::new(format!("{order} half-waves"), values)
    };
    drivers.push(Covariate { name: TIME.into(), functions: (1..=WAVES).map(wave).collect() });
    if let Some(temperature) = temperature(scene) {
        let square = temperature.iter().map(|t| t * t).collect();
        let rate = rates(scene, &temperature);
        let functions = vec![Function::new("linear", temperature), Function::new("quadratic", square)];
        drivers.push(leaning(given, &functions[0].values));
        drivers.push(Covariate { name: "temperature".into(), functions });
        drivers.push(Covariate {
            name: "temperature_rate".into(),
            functions: vec![Function::new("linear", rate)],
        });
    }
    drivers.push(input(given));
    drivers.push(other_input(given));
    drivers.retain_mut(|driver| {
        driver.functions.retain_mut(|function| standardise(&mut function.values));
        for (at, _) in scene.blocks.iter().enumerate().filter(|(_, block)| block.rows.is_empty()) {
            driver.functions.iter_mut().for_each(|function| function.values[at] = 0.0);
        }
        !driver.functions.is_empty()
    });
    drivers
}

/// Angles, rates, accelerations and directions of approach of a rig's gimbals, block by block.
fn of_gimbals(swings: &[[Swing; 3]]) -> Vec<Covariate> {
    let mut drivers = Vec::new();
    for (gimbal, name) in GIMBALS.iter().enumerate() {
        let mut functions = Vec::new();
        for (order, harmonic) in HARMONICS.iter().enumerate() {
            let angle = |s: &[Swing; 3]| (order + 1) as f64 * s[gimbal].angle;
            let detail = format!("{harmonic} harmonic");
            functions
                .push(Function::new(detail.clone(), swings.iter().map(|s| libm::cos(angle(s))).collect()));
            functions.push(Function::new(detail, swings.iter().map(|s| libm::sin(angle(s))).collect()));
        }
        drivers.push(Covariate { name: format!("gimbal_{name}"), functions });
    }
    drivers.push(per_gimbal(
        "rate",
        swings,
        &[
            ("odd in the rate", |s| s.rate),
            ("even in the rate", |s| s.rate.abs()),
            ("cubic in the rate", |s| s.rate * s.rate * s.rate),
        ],
    ));
    drivers.push(per_gimbal("angular_acceleration", swings, &[("linear", |s| s.acceleration)]));
    drivers.push(approach(swings));
    drivers
}

/// A function of a gimbal's swing.
type OfSwing = fn(&Swing) -> f64;

fn per_gimbal(name: &str, swings: &[[Swing; 3]], of: &[(&str, OfSwing)]) -> Covariate {
    let mut functions = Vec::new();
    for (gimbal, which) in GIMBALS.iter().enumerate() {
        for (detail, value) in of {
            let values = swings.iter().map(|s| value(&s[gimbal])).collect();
            functions.push(Function::new(format!("{which} gimbal, {detail}"), values));
        }
    }
    Covariate { name: name.into(), functions }
}

/// The direction from which each gimbal came to where it stands.
fn approach(swings: &[[Swing; 3]]) -> Covariate {
    let functions = GIMBALS.iter().enumerate().map(|(gimbal, which)| {
        let mut last = 0.0;
        let values = swings
            .iter()
            .map(|s| {
                if s[gimbal].rate.abs() > 0.02 {
                    last = s[gimbal].rate.signum();
                }
                last
            })
            .collect();
        Function::new(format!("{which} gimbal"), values)
    });
    Covariate { name: "direction_of_approach".into(), functions: functions.collect() }
}

/// What motion has left behind, fading: heat of the drives, a body that swings out. `squares` are those of the rate.
fn recent_motion(squares: impl Iterator<Item = f64>, blocks: &[Block]) -> Covariate {
    let squares: Vec<f64> = squares.collect();
    let fading = |time: f64| {
        let mut left = 0.0;
        let mut last = blocks.first().map_or(0.0, |block| block.time);
        let values = squares
            .iter()
            .zip(blocks)
            .map(|(square, block)| {
                let kept = libm::exp(-(block.time - last) / time);
                last = block.time;
                left = kept * left + (1.0 - kept) * square;
                left
            })
            .collect();
        Function::new(format!("fading over {time} s"), values)
    };
    Covariate { name: "recent_motion".into(), functions: FADING.map(fading).into() }
}

/// What each axis itself senses, by the Legendre polynomials of degree two to six: none of the affine part.
fn input(given: &[Vec<Vector3<f64>>; 3]) -> Covariate {
    let of = |kind: SensorKind, axis: usize| {
        let degrees = legendre(&sensed(given, kind, axis), 6).into_iter().enumerate().skip(2);
        degrees.map(move |(degree, values)| {
            let detail = format!("degree {degree}");
            Function { detail, values, of: Some((kind, axis)) }
        })
    };
    let axes = SensorKind::ALL.into_iter().flat_map(|kind| (0..3).map(move |axis| (kind, axis)));
    Covariate { name: "input".into(), functions: axes.flat_map(|(kind, axis)| of(kind, axis)).collect() }
}

/// What the other axes of a triad sense, likewise, to the third degree, and their product.
fn other_input(given: &[Vec<Vector3<f64>>; 3]) -> Covariate {
    let mut functions = Vec::new();
    for (kind, axis) in SensorKind::ALL.into_iter().flat_map(|kind| (0..3).map(move |axis| (kind, axis))) {
        let others = [(axis + 1) % 3, (axis + 2) % 3];
        let own = others.map(|other| sensed(given, kind, other));
        for (other, sensed) in others.iter().zip(&own) {
            let name = ["x", "y", "z"][*other];
            for (degree, values) in legendre(sensed, 3).into_iter().enumerate().skip(2) {
                let detail = format!("of axis {name}, degree {degree}");
                functions.push(Function { detail, values, of: Some((kind, axis)) });
            }
        }
        let values = own[0].iter().zip(&own[1]).map(|(a, b)| a * b).collect();
        functions.push(Function { detail: "product of two".into(), values, of: Some((kind, axis)) });
    }
    Covariate { name: "other_input".into(), functions }
}

/// What the axes of the other triads sense.
fn other_sensors(given: &[Vec<Vector3<f64>>; 3]) -> Covariate {
    let mut functions = Vec::new();
    for (kind, axis) in SensorKind::ALL.into_iter().flat_map(|kind| (0..3).map(move |axis| (kind, axis))) {
        for other in SensorKind::ALL.into_iter().filter(|other| *other != kind) {
            for (input, name) in ["x", "y", "z"].iter().enumerate() {
                let (values, detail) = (sensed(given, other, input), format!("{other} {name}"));
                functions.push(Function { detail, values, of: Some((kind, axis)) });
            }
        }
    }
    Covariate { name: "other_sensors".into(), functions }
}

/// Products of what the accelerometer's axes sense and what the gyroscope's do; for the magnetometer, of two of the
/// accelerometer's.
fn products(given: &[Vec<Vector3<f64>>; 3]) -> Covariate {
    let force = [0, 1, 2].map(|axis| sensed(given, SensorKind::Acc, axis));
    let rate = [0, 1, 2].map(|axis| sensed(given, SensorKind::Gyr, axis));
    let names = ["x", "y", "z"];
    let product = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a * b).collect() };
    let mut functions = Vec::new();
    for (kind, axis) in SensorKind::ALL.into_iter().flat_map(|kind| (0..3).map(move |axis| (kind, axis))) {
        for (one, other) in (0..3).flat_map(|one| (0..3).map(move |other| (one, other))) {
            let (values, second) = match kind {
                SensorKind::Mag if other < one => continue,
                SensorKind::Mag => (product(&force[one], &force[other]), SensorKind::Acc),
                _ => (product(&force[one], &rate[other]), SensorKind::Gyr),
            };
            let detail = format!("{} {} and {second} {}", SensorKind::Acc, names[one], names[other]);
            functions.push(Function { detail, values, of: Some((kind, axis)) });
        }
    }
    Covariate { name: "products_of_sensors".into(), functions }
}

/// What the axes of a triad sense, by the temperature.
fn leaning(given: &[Vec<Vector3<f64>>; 3], temperature: &[f64]) -> Covariate {
    let mean = temperature.iter().sum::<f64>() / temperature.len().max(1) as f64;
    let mut functions = Vec::new();
    for (kind, axis) in SensorKind::ALL.into_iter().flat_map(|kind| (0..3).map(move |axis| (kind, axis))) {
        for (input, name) in ["x", "y", "z"].iter().enumerate() {
            let sensed = sensed(given, kind, input);
            let values = sensed.iter().zip(temperature).map(|(x, t)| x * (t - mean)).collect();
            let detail = format!("with the input of axis {name}");
            functions.push(Function { detail, values, of: Some((kind, axis)) });
        }
    }
    Covariate { name: "temperature_and_input".into(), functions }
}

/// What an axis senses, as a share of the most that it does.
fn sensed(given: &[Vec<Vector3<f64>>; 3], kind: SensorKind, axis: usize) -> Vec<f64> {
    let sensed: Vec<f64> = given[kind as usize].iter().map(|value| value[axis]).collect();
    let largest = sensed.iter().fold(f64::MIN_POSITIVE, |most, value| most.max(value.abs()));
    sensed.into_iter().map(|value| value / largest).collect()
}

/// Legendre's polynomials of degree 0 to `most`.
pub fn legendre(x: &[f64], most: usize) -> Vec<Vec<f64>> {
    let mut degrees = vec![vec![1.0; x.len()], x.to_vec()];
    for degree in 1..most {
        let n = degree as f64;
        let next =
            |k: usize| ((2.0 * n + 1.0) * x[k] * degrees[degree][k] - n * degrees[degree - 1][k]) / (n + 1.0);
        degrees.push((0..x.len()).map(next).collect());
    }
    degrees
}

fn temperature(scene: &ForwardModel<'_>) -> Option<Vec<f64>> {
    let rows = scene.recording.temperature.as_ref()?;
    let mut last = rows.iter().copied().find(|t| t.is_finite())?;
    let mean = |rows: &[f64]| {
        let (sum, count) =
            rows.iter().filter(|t| t.is_finite()).fold((0.0, 0.0), |(s, n), t| (s + t, n + 1.0));
        if count > 0.0 {
            last = sum / count;
        }
        last
    };
    Some(scene.blocks.iter().map(|b| &rows[b.rows.clone()]).map(mean).collect())
}

fn rates(scene: &ForwardModel<'_>, temperature: &[f64]) -> Vec<f64> {
    let times: Vec<f64> = scene.blocks.iter().map(|b| b.time).collect();
    times
        .iter()
        .map(|time| {
            let from = times.partition_point(|t| *t < time - 0.5 * WARMING);
            let to = times.partition_point(|t| *t <= time + 0.5 * WARMING) - 1;
            let span = times[to] - times[from];
            if span > 0.0 { (temperature[to] - temperature[from]) / span } else { 0.0 }
        })
        .collect()
}

/// To mean zero and variance one; whether the values vary at all.
fn standardise(values: &mut [f64]) -> bool {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    let largest = values.iter().fold(0.0f64, |most, v| most.max(v.abs()));
    values.iter_mut().for_each(|v| *v -= mean);
    let sigma = (values.iter().map(|v| v * v).sum::<f64>() / n).sqrt();
    values.iter_mut().for_each(|v| *v /= sigma);
    sigma > 1e-6 * largest
}
