//! What a gap may follow where no gimbals turn the sensor: directions of the vertical and the field, and its own rate.

use nalgebra::Vector3;

use super::covariate::{Covariate, Function};
use crate::{effect::Truth, recording::SensorKind};

/// A function of a direction.
type OfDirection = fn(&Vector3<f64>) -> f64;

/// A function of a rate.
type OfRate = fn(f64) -> f64;

/// The drivers, from the truth of each block: first and second harmonics of the directions in the sensor, rates and
/// angular accelerations about its axes.
pub fn drivers(truth: &[Truth], kinds: &[SensorKind]) -> Vec<Covariate> {
    let mut drivers = vec![direction("gravity_direction", truth, &|row| row.f_t)];
    if kinds.contains(&SensorKind::Mag) {
        drivers.push(direction("field_direction", truth, &|row| row.b_t));
    }
    let rate = |row: &Truth| row.w_pt_t;
    drivers.push(about_axes(
        "rate",
        truth,
        &rate,
        &[("odd in the rate", |w| w), ("even in the rate", f64::abs), ("cubic in the rate", |w| w * w * w)],
    ));
    drivers.push(about_axes("angular_acceleration", truth, &|row| row.dw_it_t, &[("linear", |dw| dw)]));
    drivers
}

fn direction(name: &str, truth: &[Truth], of: &dyn Fn(&Truth) -> Vector3<f64>) -> Covariate {
    let directions: Vec<Vector3<f64>> =
        truth.iter().map(|row| of(row).try_normalize(0.0).unwrap_or_default()).collect();
    let functions: [(&str, OfDirection); 8] = [
        ("first harmonic, x", |u| u.x),
        ("first harmonic, y", |u| u.y),
        ("first harmonic, z", |u| u.z),
        ("second harmonic, x and y", |u| u.x * u.y),
        ("second harmonic, y and z", |u| u.y * u.z),
        ("second harmonic, z and x", |u| u.z * u.x),
        ("second harmonic, x against y", |u| u.x * u.x - u.y * u.y),
        ("second harmonic, z against the rest", |u| 3.0 * u.z * u.z - 1.0),
    ];
    let functions = functions
        .iter()
        .map(|(detail, value)| Function::new(*detail, directions.iter().map(value).collect()))
        .collect();
    Covariate { name: name.to_owned(), functions }
}

fn about_axes(
    name: &str,
    truth: &[Truth],
    of: &dyn Fn(&Truth) -> Vector3<f64>,
    functions: &[(&str, OfRate)],
) -> Covariate {
    let mut all = Vec::new();
    for (axis, which) in ["x", "y", "z"].iter().enumerate() {
        for (detail, value) in functions {
            let values = truth.iter().map(|row| value(of(row)[axis])).collect();
            all.push(Function::new(format!("about {which}, {detail}"), values));
        }
    }
    Covariate { name: name.to_owned(), functions: all }
}
