//! What a gap may follow: gimbal angles, rates, temperature, time.
//!
//! A driver is a handful of functions of the block, and each axis of a sensor may follow each of them in its own way.
//! Broader and weaker than an effect: drivers tell where a gap lies, and that something is left when no effect says
//! what.

use std::f64::consts::PI;

use nalgebra::{DMatrix, SymmetricEigen, Vector3};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::{
    block::Block,
    design::Design,
    evidence::Projected,
    noise::{NEAR, Noise},
    orientation,
    scene::{Means, Scene},
    search::Linear,
};
use crate::{
    effect::{Effect, Swing},
    recording::SensorKind,
};

/// Harmonics of a gimbal's angle.
const HARMONICS: [&str; 3] = ["first", "second", "third"];
/// Half-waves of the time of the recording.
const WAVES: usize = 8;
/// A temperature's rate is taken over this time, s.
const WARMING: f64 = 30.0;
/// The χ² of a test is divided by this: white noise is known to a few per cent.
const CAUTION: f64 = 1.1;
/// A driver that would be followed by chance less often than this in a quieter noise is tested again.
const SUSPECT: f64 = 1e-9;
/// Drivers tested again.
const SUSPECTS: usize = 4;
/// Directions that keep less than this share of their information do not count.
const RETAINED: f64 = 1e-4;

/// A driver and its functions, by block.
#[derive(Clone, Debug)]
pub struct Driver {
    /// Its name in the report.
    pub name: String,
    /// Its functions.
    pub functions: Vec<Function>,
}

/// A function of the block.
#[derive(Clone, Debug)]
pub struct Function {
    /// What it is.
    pub detail: String,
    /// Its values.
    pub values: Vec<f64>,
    /// The one axis of a sensor that may follow it; `None` for any.
    pub of: Option<(SensorKind, usize)>,
}

impl Function {
    /// That any axis of any sensor may follow.
    pub fn new(detail: impl Into<String>, values: Vec<f64>) -> Self {
        Self { detail: detail.into(), values, of: None }
    }
}

impl Driver {
    /// Places of its columns for a sensor: function and axis.
    fn columns(&self, kind: SensorKind) -> Vec<(usize, usize)> {
        let axes = (0..self.functions.len()).flat_map(|function| (0..3).map(move |axis| (function, axis)));
        let wanted = |(function, axis): &(usize, usize)| {
            self.functions[*function].of.is_none_or(|of| of == (kind, *axis))
        };
        axes.filter(wanted).collect()
    }
}

/// How a sensor's residual follows a driver.
#[derive(Clone, Debug, PartialEq)]
pub struct Following {
    /// Sensor.
    pub kind: SensorKind,
    /// Driver.
    pub driver: String,
    /// The function and axis that it follows most.
    pub detail: String,
    /// Whitened squared size of what follows it, less what noise alone would give.
    pub size: f64,
    /// Probability of as much by noise, this test alone.
    pub p_value: f64,
}

/// The drivers of a scene: those that vary in it. `given` is what each sensor puts out, block by block.
pub fn drivers(scene: &Scene<'_>, given: &[Vec<Vector3<f64>>; 3]) -> Vec<Driver> {
    let mut drivers = match scene.swings {
        Some(swings) => {
            let middle = |b: &Block| swings.get((b.rows.start + b.rows.end) / 2).copied().unwrap_or_default();
            of_gimbals(&scene.blocks.iter().map(middle).collect::<Vec<_>>())
        }
        None => orientation::drivers(&scene.plain(), &scene.kinds),
    };
    let duration = scene.duration().max(1.0);
    let wave = |order: usize| {
        let values = scene.blocks.iter().map(|b| libm::cos(PI * order as f64 * b.time / duration)).collect();
        Function::new(format!("{order} half-waves"), values)
    };
    drivers.push(Driver { name: "time".into(), functions: (1..=WAVES).map(wave).collect() });
    if let Some(temperature) = temperature(scene) {
        let square = temperature.iter().map(|t| t * t).collect();
        let rate = rates(scene, &temperature);
        let functions = vec![Function::new("linear", temperature), Function::new("quadratic", square)];
        drivers.push(Driver { name: "temperature".into(), functions });
        drivers
            .push(Driver { name: "temperature_rate".into(), functions: vec![Function::new("linear", rate)] });
    }
    drivers.push(input(given));
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
fn of_gimbals(swings: &[[Swing; 3]]) -> Vec<Driver> {
    let mut drivers = Vec::new();
    for (gimbal, name) in ["outer", "middle", "inner"].iter().enumerate() {
        let mut functions = Vec::new();
        for (order, harmonic) in HARMONICS.iter().enumerate() {
            let angle = |s: &[Swing; 3]| (order + 1) as f64 * s[gimbal].angle;
            let detail = format!("{harmonic} harmonic");
            functions
                .push(Function::new(detail.clone(), swings.iter().map(|s| libm::cos(angle(s))).collect()));
            functions.push(Function::new(detail, swings.iter().map(|s| libm::sin(angle(s))).collect()));
        }
        drivers.push(Driver { name: format!("gimbal_{name}"), functions });
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

fn per_gimbal(name: &str, swings: &[[Swing; 3]], of: &[(&str, OfSwing)]) -> Driver {
    let mut functions = Vec::new();
    for (gimbal, which) in ["outer", "middle", "inner"].iter().enumerate() {
        for (detail, value) in of {
            let values = swings.iter().map(|s| value(&s[gimbal])).collect();
            functions.push(Function::new(format!("{which} gimbal, {detail}"), values));
        }
    }
    Driver { name: name.into(), functions }
}

/// The direction from which each gimbal came to where it stands.
fn approach(swings: &[[Swing; 3]]) -> Driver {
    let functions = ["outer", "middle", "inner"].iter().enumerate().map(|(gimbal, which)| {
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
    Driver { name: "direction_of_approach".into(), functions: functions.collect() }
}

/// What each axis itself senses, by the Legendre polynomials of degree two to six: none of the affine part.
fn input(given: &[Vec<Vector3<f64>>; 3]) -> Driver {
    let mut functions = Vec::new();
    for (kind, axis) in SensorKind::ALL.into_iter().flat_map(|kind| (0..3).map(move |axis| (kind, axis))) {
        let sensed: Vec<f64> = given[kind as usize].iter().map(|value| value[axis]).collect();
        let largest = sensed.iter().fold(f64::MIN_POSITIVE, |most, value| most.max(value.abs()));
        let (mut before, mut here) = (vec![1.0; sensed.len()], sensed);
        here.iter_mut().for_each(|value| *value /= largest);
        let x = here.clone();
        for degree in 1..6 {
            let n = f64::from(degree);
            let next: Vec<f64> = (0..x.len())
                .map(|k| ((2.0 * n + 1.0) * x[k] * here[k] - n * before[k]) / (n + 1.0))
                .collect();
            (before, here) = (here, next.clone());
            let detail = format!("degree {}", degree + 1);
            functions.push(Function { detail, values: next, of: Some((kind, axis)) });
        }
    }
    Driver { name: "input".into(), functions }
}

fn temperature(scene: &Scene<'_>) -> Option<Vec<f64>> {
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

fn rates(scene: &Scene<'_>, temperature: &[f64]) -> Vec<f64> {
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

/// How each sensor follows each driver once the baseline and `set` are fitted, the surest first.
pub fn following(
    linear: &Linear<'_>,
    set: &[&'static Effect],
    noise: &Noise,
    drivers: &[Driver],
) -> Option<Vec<Following>> {
    let mut found = Vec::new();
    for kind in &linear.scene.kinds {
        let (design, fitted) = with_drivers(linear, set, *kind, drivers);
        let projected = projected(linear, &design, fitted, noise)?;
        let mut at = 0;
        for driver in drivers {
            let count = driver.columns(*kind).len();
            if count == 0 {
                continue;
            }
            let places: Vec<usize> = (at..at + count).collect();
            at += count;
            found.push(follow(linear.scene, *kind, driver, &projected, &places)?);
        }
    }
    sort(&mut found);
    Some(found)
}

/// As [`following`], but what would show in a quieter noise is tested again with a noise estimated beside it: a gap
/// that nothing explains has been taken for drift or scatter.
pub fn following_anew(
    linear: &Linear<'_>,
    set: &[&'static Effect],
    noise: &Noise,
    drivers: &[Driver],
) -> Option<Vec<Following>> {
    let mut found = following(linear, set, noise, drivers)?;
    let suspects = following(linear, set, &noise.quieter(), drivers)?;
    for suspect in suspects.iter().filter(|f| f.p_value < SUSPECT && !f.is_slow()).take(SUSPECTS) {
        let Some(driver) = drivers.iter().find(|driver| driver.name == suspect.driver) else { continue };
        let (design, fitted) = with_drivers(linear, set, suspect.kind, std::slice::from_ref(driver));
        let every: Vec<usize> = (0..design.size).collect();
        let mut anew = noise.clone();
        anew.sensors[suspect.kind as usize] =
            linear.weighing.fit(&design, suspect.kind, &every, noise, &NEAR);
        let projected = projected(linear, &design, fitted, &anew)?;
        let places: Vec<usize> = (0..every.len() - fitted).collect();
        let again = follow(linear.scene, suspect.kind, driver, &projected, &places)?;
        if let Some(own) = found.iter_mut().find(|f| f.kind == again.kind && f.driver == again.driver)
            && again.p_value < own.p_value
        {
            *own = again;
        }
    }
    sort(&mut found);
    Some(found)
}

fn sort(found: &mut [Following]) {
    found.sort_by(|a, b| a.p_value.total_cmp(&b.p_value).then(b.size.total_cmp(&a.size)));
}

impl Following {
    /// Its driver is as slow as drift, which an estimate of the noise cannot tell from it.
    fn is_slow(&self) -> bool {
        self.driver == "time" || self.driver.starts_with("temperature")
    }
}

/// The columns of the baseline and a set, and of drivers of one sensor behind them; with the number of the former.
fn with_drivers(
    linear: &Linear<'_>,
    set: &[&'static Effect],
    kind: SensorKind,
    drivers: &[Driver],
) -> (Design, usize) {
    let fitted = linear.fitted(set);
    let means: Vec<Means> = drivers
        .iter()
        .flat_map(|driver| driver.columns(kind).into_iter().map(move |at| (driver, at)))
        .map(|(driver, (function, axis))| on(kind, axis, &driver.functions[function].values))
        .collect();
    let columns = fitted.iter().map(|id| linear.design.columns[*id]).collect();
    (linear.design.extended(&fitted, columns, &means), fitted.len())
}

fn projected(linear: &Linear<'_>, design: &Design, fitted: usize, noise: &Noise) -> Option<Projected> {
    let every: Vec<usize> = (0..design.size).collect();
    let (first, others) = every.split_at(fitted);
    let normal = design.normal(&linear.whitenings(noise), &every);
    Projected::new(&normal, first, others)
}

/// A signature on one axis of one sensor.
fn on(kind: SensorKind, axis: usize, values: &[f64]) -> Means {
    let mut means: Means = Default::default();
    let along = |value: &f64| Vector3::from_fn(|k, _| if k == axis { *value } else { 0.0 });
    means[kind as usize] = Some(values.iter().map(along).collect());
    means
}

fn follow(
    scene: &Scene<'_>,
    kind: SensorKind,
    driver: &Driver,
    projected: &Projected,
    places: &[usize],
) -> Option<Following> {
    let (statistic, dimensions) = score_test(projected, places);
    let p_value = match ChiSquared::new(dimensions.max(1) as f64) {
        Ok(distribution) if dimensions > 0 => distribution.sf(statistic / CAUTION),
        _ => 1.0,
    };
    let single =
        |place: &usize| projected.score[*place].powi(2) / projected.information[(*place, *place)].max(1e-12);
    let most = places.iter().max_by(|a, b| single(a).total_cmp(&single(b)))?;
    let (function, axis) = *driver.columns(kind).get(most - places[0])?;
    Some(Following {
        kind,
        driver: driver.name.clone(),
        detail: match scene.axis(kind, axis) {
            name @ ("x" | "y" | "z") => format!("{name} axis, {}", driver.functions[function].detail),
            name => format!("{name}; {}", driver.functions[function].detail),
        },
        size: (statistic - dimensions as f64).max(0.0),
        p_value,
    })
}

/// sᵀ V⁺ s and the rank of V, over directions that the projection leaves.
pub fn score_test(projected: &Projected, places: &[usize]) -> (f64, usize) {
    let n = places.len();
    let scale = |i: usize| 1.0 / projected.before[places[i]].max(f64::MIN_POSITIVE).sqrt();
    let v =
        DMatrix::from_fn(n, n, |i, j| projected.information[(places[i], places[j])] * scale(i) * scale(j));
    let eigen = SymmetricEigen::new(v);
    let mut sum = 0.0;
    let mut rank = 0;
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > RETAINED {
            let along: f64 =
                vector.iter().enumerate().map(|(i, v)| v * projected.score[places[i]] * scale(i)).sum();
            sum += along * along / value;
            rank += 1;
        }
    }
    (sum, rank)
}
