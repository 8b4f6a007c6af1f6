//! Two calibrations of one unit: how far each parameter has moved, and what that means.
//!
//! ```text
//! z = (p_B − p_A) / √(σ_A² + σ_B²)
//! y_A = M y + β        M = A_A A_B⁻¹        β = A_A (b_B − b_A)
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | p, σ | an entry of gain or bias and its standard error |
//! | A, b | gain and bias: calibrated = A (raw − b) |
//! | y, y_A | what is measured, if B is right, and what A still makes of it |
//! | β | error of the bias, unit of A's calibrated values |
//! | M − 1 | its diagonal: error of the scale; its antisymmetric part: rotation; the rest: angles between axes |
//!
//! A parameter has moved where |z| is beyond what the largest of so many healthy ones exceeds once in a hundred times (Bonferroni).
//! Gains are compared only where both calibrations have the same axes and field: a hand gives an upper triangular gain of the
//! accelerometer, a rig a full one in its own axes, and a magnetometer in an unknown field has determinant 1. Elsewhere M would say
//! nothing of the unit, and the biases alone, in raw units, are compared.
//!
//! Gain and bias are fitted together with nonlinear terms, so that calibrations which estimate other such terms are not compared.
//!
//! Gains and biases are compared at B's reference temperature, with what the errors of A's terms of temperature bring over the
//! difference. Not looked at: correlations between parameters, and those terms themselves.

use nalgebra::{Matrix3, Vector3};
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};

pub use self::parameters::Moved;
use self::parameters::{bent, both_estimate};
use crate::{
    recording::{SensorKind, Unit},
    store::{StoredCalibration, StoredTriad},
};

mod parameters;

/// What the JSON begins with.
pub const FORMAT: &str = "imucal-compare/1";
/// How often the largest of the parameters of two calibrations of an unchanged unit is taken for moved.
const FALSE_ALARMS: f64 = 0.01;

/// Why two calibrations are not compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CompareFault {
    /// Of two units.
    #[error(
        "the serials are `{a}` and `{b}`, expected two calibrations of one unit; give the right files, or --other-serial"
    )]
    Serials {
        /// Of the first.
        a: String,
        /// Of the second.
        b: String,
    },
    /// A sensor's raw values have two units.
    #[error(
        "{sensor}: raw values are in {a} and in {b}, expected one unit; calibrate from recordings in the same unit"
    )]
    Units {
        /// Which.
        sensor: SensorKind,
        /// Of the first.
        a: Unit,
        /// Of the second.
        b: Unit,
    },
    /// A gain without an inverse.
    #[error("{sensor}: the second gain has no inverse; calibrate again")]
    Singular {
        /// Which.
        sensor: SensorKind,
    },
    /// They have no sensor in common that can be compared.
    #[error(
        "no sensor is calibrated in both with standard errors, by models with the same nonlinear terms and terms of temperature"
    )]
    Nothing {
        /// Sensors of which one has nonlinear terms, or terms of temperature, that the other has not.
        other_terms: Vec<SensorKind>,
        /// Sensors of which one states no standard errors.
        without_errors: Vec<SensorKind>,
    },
}

/// One sensor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SensorComparison {
    /// Whose.
    pub sensor: SensorKind,
    /// Unit of the first calibration's values, in which `bias_error` is.
    pub unit: Unit,
    /// Each parameter that both have estimated.
    pub parameters: Vec<Moved>,
    /// |z| beyond which a parameter has moved.
    pub limit: f64,
    /// β.
    pub bias_error: [f64; 3],
    /// What M says; `None` where the gains are in other axes or of another field, and the biases alone are compared.
    pub gain: Option<GainComparison>,
}

/// What M says.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GainComparison {
    /// Error of the scale of each axis, a share.
    pub scale_error: [f64; 3],
    /// Rotation vector of the axes, rad.
    pub rotation: [f64; 3],
    /// Change of the angles between y and z, z and x, x and y, rad.
    pub skew: [f64; 3],
}

impl SensorComparison {
    /// A parameter has moved.
    #[must_use]
    pub fn has_moved(&self) -> bool {
        self.parameters.iter().any(|parameter| parameter.moved)
    }
}

/// Both calibrations.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// [`FORMAT`].
    pub format: &'static str,
    /// Days from the first to the second.
    pub days: i64,
    /// The sensors that both have.
    pub sensors: Vec<SensorComparison>,
    /// Sensors that one of them has not.
    pub only_one: Vec<SensorKind>,
    /// Sensors of which one of them estimates nonlinear terms that the other does not, or terms of temperature: their gains and
    /// biases differ by that alone.
    pub other_terms: Vec<SensorKind>,
    /// Sensors without a parameter whose standard error both state.
    pub without_errors: Vec<SensorKind>,
}

/// Compares an earlier calibration with a later one.
///
/// # Errors
///
/// [`CompareFault`].
pub fn compare(
    a: &StoredCalibration,
    b: &StoredCalibration,
    other_serial: bool,
) -> Result<Comparison, CompareFault> {
    let serials = [&a.sensor.serial, &b.sensor.serial];
    if !other_serial && serials.iter().all(|serial| !serial.is_empty()) && serials[0] != serials[1] {
        return Err(CompareFault::Serials { a: serials[0].clone(), b: serials[1].clone() });
    }
    let (mut sensors, mut only_one) = (Vec::new(), Vec::new());
    let (mut other_terms, mut without_errors) = (Vec::new(), Vec::new());
    // The other sensors are in the axes of the accelerometer.
    let acc = a.acc.as_ref().zip(b.acc.as_ref());
    for kind in SensorKind::ALL {
        match (a.triad(kind), b.triad(kind)) {
            (Some(a), Some(b)) if !has_terms_of(a, b) => other_terms.push(kind),
            (Some(a), Some(b)) => {
                let axes = acc.unwrap_or((a, b));
                let alike = [(a, b), axes].iter().all(|(a, b)| estimated(a) == estimated(b));
                let comparable = alike && a.field_norm.is_some() == b.field_norm.is_some();
                match of_sensor(kind, a, b, comparable)? {
                    compared if compared.parameters.is_empty() => without_errors.push(kind),
                    compared => sensors.push(compared),
                }
            }
            (None, None) => {}
            _ => only_one.push(kind),
        }
    }
    if sensors.is_empty() {
        return Err(CompareFault::Nothing { other_terms, without_errors });
    }
    let days = i64::from(b.date.days()) - i64::from(a.date.days());
    Ok(Comparison { format: FORMAT, days, sensors, only_one, other_terms, without_errors })
}

/// Both have terms of temperature or neither has, and both the same nonlinear ones.
fn has_terms_of(a: &StoredTriad, b: &StoredTriad) -> bool {
    bent(a).map(|term| term.known()) == bent(b).map(|term| term.known())
        && a.temperature.is_some() == b.temperature.is_some()
}

/// Which entries of the gain are estimated: what its axes are.
fn estimated(triad: &StoredTriad) -> [[bool; 3]; 3] {
    triad.gain_std.map(|row| row.map(|std| std > 0.0))
}

fn of_sensor(
    kind: SensorKind,
    a: &StoredTriad,
    b: &StoredTriad,
    comparable: bool,
) -> Result<SensorComparison, CompareFault> {
    if a.unit_in != b.unit_in {
        return Err(CompareFault::Units { sensor: kind, a: a.unit_in, b: b.unit_in });
    }
    let at_reference = b.temperature.as_ref().map(|terms| a.at_temperature(terms.reference));
    let a = at_reference.as_ref().unwrap_or(a);
    let (gain_a, gain_b) = (a.triad().gain, b.triad().gain);
    let inverse = gain_b.try_inverse().ok_or(CompareFault::Singular { sensor: kind })?;
    let mut parameters = both_estimate(a, b, comparable);
    let chances = Normal::standard();
    let limit = -chances.inverse_cdf(0.5 * FALSE_ALARMS / parameters.len().max(1) as f64);
    parameters.iter_mut().for_each(|parameter| parameter.moved = parameter.z.abs() > limit);
    Ok(SensorComparison {
        sensor: kind,
        unit: a.unit_out,
        parameters,
        limit,
        bias_error: (gain_a * (Vector3::from(b.bias) - Vector3::from(a.bias))).into(),
        gain: comparable.then(|| GainComparison::of(gain_a * inverse, a.field_norm.is_some())),
    })
}

impl GainComparison {
    /// Of M; gains of determinant 1 say nothing of a common scale.
    pub(crate) fn of(m: Matrix3<f64>, unit_determinant: bool) -> Self {
        let m = if unit_determinant { m / m.determinant().cbrt() } else { m };
        let error = m - Matrix3::identity();
        let half = |r: usize, c: usize, sign: f64| 0.5 * (error[(r, c)] + sign * error[(c, r)]);
        Self {
            scale_error: error.diagonal().into(),
            rotation: [half(2, 1, -1.0), half(0, 2, -1.0), half(1, 0, -1.0)],
            skew: [2.0 * half(1, 2, 1.0), 2.0 * half(2, 0, 1.0), 2.0 * half(0, 1, 1.0)],
        }
    }
}

#[cfg(test)]
mod tests {
    use imucal_core::temperature::TemperatureTerms;

    use super::*;
    use crate::{
        calibrate::{Options, calibrate},
        recording::unit::STANDARD_GRAVITY,
        simulator::{SimulatedUnit, Tumble, record},
        store::StoredTemperature,
    };

    fn calibrated(seed: u64) -> StoredCalibration {
        let unit = SimulatedUnit { interval: 0.02, ..SimulatedUnit::mtx() };
        let recording = record("unit.csv", &Tumble::new(16, seed), &unit, seed);
        let calibration = calibrate(&recording, &Options::default(), &|_| {});
        StoredCalibration::of(&calibration, imucal_core::record::Date::from_days(20_000))
    }

    #[test]
    fn two_calibrations_of_an_unchanged_unit_seldom_differ() {
        let all: Vec<StoredCalibration> = (0..16).map(calibrated).collect();
        let mut moved = 0;
        for pair in all.chunks_exact(2) {
            let comparison = compare(&pair[0], &pair[1], false).expect("of one unit");
            moved += comparison.sensors.iter().filter(|sensor| sensor.has_moved()).count();
        }
        assert!(moved <= 1, "{moved} of 24 sensors");
    }

    #[test]
    fn a_bias_that_moves_is_named_with_its_size_in_the_calibrated_unit() {
        let before = calibrated(1);
        let mut after = before.clone();
        let acc = after.acc.as_mut().expect("calibrated");
        // Five thousandths of g.
        acc.bias[1] += 5e-3 * STANDARD_GRAVITY / acc.gain[1][1];
        let comparison = compare(&before, &after, false).expect("of one unit");
        let acc = &comparison.sensors[0];
        let moved: Vec<&str> = acc.parameters.iter().filter(|p| p.moved).map(|p| p.name.as_str()).collect();
        assert_eq!(moved, ["bias_y"]);
        assert!((acc.bias_error[1] / STANDARD_GRAVITY - 5e-3).abs() < 1e-4, "{:?}", acc.bias_error);
        // The error is one of the first's values, whatever the second puts out.
        after.acc.as_mut().expect("calibrated").unit_out = Unit::Gravity;
        let unit = compare(&before, &after, false).expect("of one unit").sensors[0].unit;
        assert_eq!(unit, Unit::MetrePerSecondSquared);
    }

    #[test]
    fn a_law_of_temperature_that_is_kept_at_two_references_has_not_moved() {
        let mut before = calibrated(1);
        let acc = before.acc.as_mut().expect("calibrated");
        let linear = TemperatureTerms { reference: 20.0, bias_slope: [3e-3; 3], scale_slope: [-1.2e-3; 3] };
        let stored = |linear: &TemperatureTerms<f64>| StoredTemperature {
            reference: linear.reference,
            bias_slope: linear.bias_slope,
            scale_slope: linear.scale_slope,
            quality: None,
            curvature: None,
        };
        acc.temperature = Some(stored(&linear));
        let mut after = before.clone();
        let later = after.acc.as_mut().expect("calibrated");
        let warm = linear.at(&later.triad(), 28.0);
        later.bias = warm.bias.into();
        later.gain = std::array::from_fn(|row| later.gain[row].map(|entry| warm.factor[row] * entry));
        later.temperature = Some(stored(&linear.from_reference(28.0)));
        let found = |other: &StoredCalibration| compare(&before, other, false).expect("of one unit").sensors;
        let same = found(&after).remove(0);
        assert!(same.parameters.iter().all(|parameter| parameter.z.abs() < 1e-6), "{same:?}");
        let scale = same.gain.expect("the same axes").scale_error;
        assert!(scale.iter().all(|error| error.abs() < 1e-12), "{scale:?}");
        // One that has moved by a thousandth is found at the other temperature as well.
        let later = after.acc.as_mut().expect("calibrated");
        later.gain[0][0] *= 1.001;
        let moved = found(&after).remove(0);
        assert!((moved.gain.expect("the same axes").scale_error[0] + 1e-3).abs() < 1e-5, "{moved:?}");
    }

    #[test]
    fn a_turn_of_the_axes_a_scale_and_a_skew_are_distinguished() {
        let before = calibrated(3);
        let mut after = before.clone();
        let gyr = after.gyr.as_mut().expect("calibrated");
        let turn = nalgebra::Rotation3::new(Vector3::new(0.0, 0.0, 2e-3)).into_inner();
        let skew = Matrix3::new(1.003, 0.0, 0.0, 0.0, 1.0, 5e-4, 0.0, 5e-4, 1.0);
        let changed = turn * skew * gyr.triad().gain;
        gyr.gain = std::array::from_fn(|row| std::array::from_fn(|column| changed[(row, column)]));
        let comparison = compare(&before, &after, false).expect("of one unit");
        let gyr = comparison.sensors.iter().find(|sensor| sensor.sensor == SensorKind::Gyr).expect("both");
        let GainComparison { scale_error, rotation, skew } = gyr.gain.expect("the same axes");
        assert!((rotation[2] + 2e-3).abs() < 1e-5 && rotation[0].abs() < 1e-5, "{rotation:?}");
        assert!((scale_error[0] + 3e-3).abs() < 2e-5, "{scale_error:?}");
        assert!((skew[0] + 1e-3).abs() < 2e-5, "{skew:?}");
    }

    #[test]
    fn of_a_unit_in_other_axes_or_of_another_field_the_biases_alone_are_compared() {
        // As on a rig that holds the unit 0.3 rad off: full gains, all entries of which are estimated.
        let before = calibrated(3);
        let mut after = before.clone();
        let turn = nalgebra::Rotation3::new(Vector3::new(0.1, 0.2, 0.2)).into_inner();
        for triad in [&mut after.acc, &mut after.gyr, &mut after.mag].into_iter().flatten() {
            let turned = turn * triad.triad().gain;
            triad.gain = std::array::from_fn(|row| std::array::from_fn(|column| turned[(row, column)]));
            triad.gain_std = triad.gain_std.map(|row| row.map(|std| std.max(1e-9)));
        }
        let comparison = compare(&before, &after, false).expect("of one unit");
        assert_eq!(comparison.sensors.len(), 3);
        for sensor in &comparison.sensors {
            assert!(!sensor.has_moved() && sensor.gain.is_none(), "{sensor:?}");
            assert_eq!(sensor.parameters.len(), 3);
        }
        let mut scaled = before.clone();
        let mag = scaled.mag.as_mut().expect("calibrated");
        mag.field_norm = if mag.field_norm.is_some() { None } else { Some(1.0) };
        let comparison = compare(&before, &scaled, false).expect("of one unit");
        let without: Vec<_> =
            comparison.sensors.iter().filter(|s| s.gain.is_none()).map(|s| s.sensor).collect();
        assert_eq!(without, [SensorKind::Mag]);
    }

    #[test]
    fn what_is_not_of_one_unit_or_in_other_units_is_refused() {
        let (a, mut b) = (calibrated(1), calibrated(2));
        b.sensor.serial = "other".into();
        let fault = compare(&a, &b, false).unwrap_err();
        assert!(matches!(fault, CompareFault::Serials { .. }), "{fault}");
        b.acc.as_mut().expect("one").unit_in = Unit::Gravity;
        assert!(matches!(compare(&a, &b, true), Err(CompareFault::Units { .. })));
        let mut unknown = a.clone();
        let acc = unknown.acc.as_mut().expect("one");
        (acc.gain_std, acc.bias_std) = ([[0.0; 3]; 3], [0.0; 3]);
        let comparison = compare(&a, &unknown, false).expect("the gyroscope can be compared");
        assert_eq!(comparison.without_errors, [SensorKind::Acc]);
        assert!(comparison.sensors.iter().all(|sensor| sensor.sensor != SensorKind::Acc));
        let nothing = StoredCalibration { acc: None, gyr: None, mag: None, ..b };
        assert!(matches!(compare(&a, &nothing, true), Err(CompareFault::Nothing { .. })));
    }
}
