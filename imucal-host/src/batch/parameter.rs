//! Parameters of a sensor by name: as they are stored, and as what they say of the sensor.
//!
//! ```text
//! A = 1 + E        E_ii: scale_error        ½(E − Eᵀ): rotation        E + Eᵀ: skew        b: offset
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | A, b | gain and bias of nominal SI values: calibrated = A (raw − b) |
//! | `scale_error_x` | a share |
//! | `rotation_x` | rotation vector of the axes, rad, where the whole gain is estimated |
//! | `skew_yz` | departure of the angle between two axes from the nominal one, rad |
//! | `offset_x` | what the sensor reads of nothing, beyond the nominal offset: m/s², rad/s, µT; in the recording's unit if that is arbitrary |
//!
//! All are linear in the entries of A and b, so their standard errors follow from the covariance of these exactly. Angles are to first
//! order in E.

use nalgebra::{DVector, Matrix3};
use serde::{Deserialize, Serialize};

use crate::{
    calibrate::{FitSummary, outcome::entry_name},
    compare::GainComparison,
};

/// A value with its standard error; `None` where it is no finite number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: Option<f64>,
    /// Its standard error; 0 where it is not estimated.
    pub std_error: Option<f64>,
}

/// Names of what [`of_sensor`] may give, in order.
pub const OF_SENSOR: [&str; 12] = [
    "scale_error_x",
    "scale_error_y",
    "scale_error_z",
    "rotation_x",
    "rotation_y",
    "rotation_z",
    "skew_yz",
    "skew_zx",
    "skew_xy",
    "offset_x",
    "offset_y",
    "offset_z",
];

impl Parameter {
    fn new(name: impl Into<String>, value: f64, std_error: f64) -> Self {
        let finite = |value: f64| value.is_finite().then_some(value);
        Self { name: name.into(), value: finite(value), std_error: finite(std_error) }
    }
}

/// Gain and bias of raw values, entry by entry: what is stored.
#[must_use]
pub fn stored(fit: &FitSummary) -> Vec<Parameter> {
    let (triad, (gain_std, bias_std)) = (fit.raw_triad(), fit.raw_std());
    let entry = |entry: u8| {
        let (row, column) = (usize::from(entry / 3), usize::from(entry % 3));
        let (value, std) = match row {
            0..3 => (triad.gain[(row, column)], gain_std[(row, column)]),
            _ => (triad.bias[column], bias_std[column]),
        };
        Parameter::new(entry_name(entry), value, std)
    };
    (0..12).map(entry).collect()
}

/// What gain and bias say of the sensor, as far as they are estimated.
#[must_use]
pub fn of_sensor(fit: &FitSummary) -> Vec<Parameter> {
    let values = linear(&fit.triad.gain);
    let gains: Vec<usize> = (0..fit.covariance_of.len()).filter(|k| fit.covariance_of[*k] < 9).collect();
    let jacobian: Vec<[f64; 9]> = gains
        .iter()
        .map(|k| {
            let mut moved = Matrix3::identity();
            let entry = usize::from(fit.covariance_of[*k]);
            moved[(entry / 3, entry % 3)] += 1.0;
            linear(&moved)
        })
        .collect();
    let covariance = fit.covariance.select_rows(&gains).select_columns(&gains);
    let estimated = |row: usize, column: usize| fit.covariance_of.contains(&((3 * row + column) as u8));
    let mut parameters = Vec::new();
    for (index, name) in OF_SENSOR[..9].iter().enumerate() {
        let (next, last) = ((index + 1) % 3, (index + 2) % 3);
        let pair = [estimated(next, last), estimated(last, next)];
        let present = match index {
            0..3 => estimated(index, index),
            3..6 => pair == [true; 2],
            _ => pair.contains(&true),
        };
        if present {
            let weights = DVector::from_iterator(gains.len(), jacobian.iter().map(|column| column[index]));
            let variance = weights.dot(&(&covariance * &weights));
            parameters.push(Parameter::new(*name, values[index], variance.sqrt()));
        }
    }
    let offsets = OF_SENSOR[9..].iter().enumerate().filter(|(axis, _)| fit.bias_std[*axis] > 0.0);
    parameters.extend(offsets.map(|(k, name)| Parameter::new(*name, fit.triad.bias[k], fit.bias_std[k])));
    parameters
}

/// Scale errors, rotation and skew, in the order of [`OF_SENSOR`].
fn linear(gain: &Matrix3<f64>) -> [f64; 9] {
    let GainComparison { scale_error, rotation, skew } = GainComparison::of(*gain, false);
    let mut all = [0.0; 9];
    all.iter_mut().zip(scale_error.into_iter().chain(rotation).chain(skew)).for_each(|(to, from)| *to = from);
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        calibrate::{Options, calibrate},
        recording::SensorKind,
        simulator::{SimulatedUnit, Tumble, record},
    };

    fn fit(kind: SensorKind) -> FitSummary {
        let unit = SimulatedUnit { interval: 0.02, ..SimulatedUnit::mtx() };
        let recording = record("unit.csv", &Tumble::new(14, 5), &unit, 6);
        let calibration = calibrate(&recording, &Options::default(), &|_| {});
        calibration.sensor(kind).and_then(|outcome| outcome.fit.clone()).expect("fitted")
    }

    fn named(parameters: &[Parameter], name: &str) -> (f64, f64) {
        let found = parameters.iter().find(|parameter| parameter.name == name).expect(name);
        (found.value.expect("a number"), found.std_error.expect("a number"))
    }

    #[test]
    fn a_triangular_gain_has_skews_without_a_rotation_and_a_full_one_has_both() {
        let names = |kind| of_sensor(&fit(kind)).into_iter().map(|found| found.name).collect::<Vec<_>>();
        let acc = names(SensorKind::Acc);
        assert_eq!(acc.len(), 9);
        assert!(acc.iter().all(|name| !name.starts_with("rotation")));
        assert_eq!(names(SensorKind::Gyr), OF_SENSOR);
    }

    #[test]
    fn what_is_said_of_a_sensor_follows_from_its_entries_and_their_covariance() {
        let fit = fit(SensorKind::Gyr);
        let of = of_sensor(&fit);
        let at = |row: u8, column: u8| {
            fit.covariance_of.iter().position(|entry| *entry == 3 * row + column).expect("estimated")
        };
        let (gain, c) = (&fit.triad.gain, &fit.covariance);
        let (value, std) = named(&of, "skew_yz");
        assert!((value - (gain[(1, 2)] + gain[(2, 1)])).abs() < 1e-15);
        let (a, b) = (at(1, 2), at(2, 1));
        let variance = c[(a, a)] + c[(b, b)] + 2.0 * c[(a, b)];
        assert!((std / variance.sqrt() - 1.0).abs() < 1e-9);
        let (value, std) = named(&of, "rotation_x");
        assert!((value - 0.5 * (gain[(2, 1)] - gain[(1, 2)])).abs() < 1e-15);
        assert!((2.0 * std / (c[(a, a)] + c[(b, b)] - 2.0 * c[(a, b)]).sqrt() - 1.0).abs() < 1e-9);
        assert_eq!(named(&of, "offset_z"), (fit.triad.bias.z, fit.bias_std.z));
    }
}
