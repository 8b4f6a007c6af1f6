//! The simulator's present model of a unit: a calibration made elsewhere.

use imucal_core::triad::Triad;
use nalgebra::{Matrix3, Vector3};

use crate::{
    apply,
    apply::ApplyError,
    calibrate::known_attitudes::ladder,
    recording::{Nominal, Recording, SensorKind},
    store::{StoredCalibration, StoredTriad},
};

/// Triads that a simulation starts from.
#[derive(Clone, Debug)]
pub struct Model {
    /// Nominal SI to SI, by [`SensorKind::ALL`]; identity where the calibration does not hold the sensor.
    pub triads: [Triad<f64>; 3],
    /// Sensors that it holds and the recording has.
    pub calibrated: Vec<SensorKind>,
    /// Standard errors of its gain and, nominal SI, of its bias, by [`SensorKind::ALL`]; zero where it has none.
    pub errors: [(Matrix3<f64>, Vector3<f64>); 3],
    /// What a reader ought to know of it.
    pub remarks: Vec<String>,
}

impl Default for Model {
    /// Knows nothing: every triad is nominal.
    fn default() -> Self {
        Self {
            triads: [Triad::identity(); 3],
            calibrated: Vec::new(),
            errors: Default::default(),
            remarks: Vec::new(),
        }
    }
}

impl Model {
    /// A calibration, for a recording of the same unit.
    ///
    /// # Errors
    ///
    /// Why it does not fit the recording, for a reader.
    pub fn new(recording: &Recording, stored: &StoredCalibration) -> Result<Self, String> {
        let record = stored.to_record(&recording.path).map_err(|error| error.to_string())?;
        let remark = apply::check(recording, stored, &record, false).map_err(because)?;
        let mut model = Self { remarks: remark.into_iter().collect(), ..Self::default() };
        for kind in SensorKind::ALL {
            if let (Some(triple), Some(triad)) = (recording.sensor(kind), stored.triad(kind)) {
                model.triads[kind as usize] = si(triad, triple.nominal);
                model.errors[kind as usize] = errors(kind, triad, triple.nominal);
                model.calibrated.push(kind);
                model.remarks.extend(left_out(kind, triad));
            }
        }
        Ok(model)
    }
}

/// Says which terms of a calibration the simulation does without.
fn left_out(kind: SensorKind, stored: &StoredTriad) -> Option<String> {
    let warm = stored.temperature.is_some().then_some("terms of temperature");
    let bent = stored.nonlinearity.is_some().then_some("nonlinear terms");
    let terms: Vec<&str> = warm.into_iter().chain(bent).collect();
    (!terms.is_empty()).then(|| {
        format!(
            "{kind}: the simulation starts from gain and bias of the model alone; what its {} describe counts as a gap",
            terms.join(" and ")
        )
    })
}

/// Why a calibration is no model of a recording's unit: a simulation of another unit is not to be forced.
fn because(error: ApplyError) -> String {
    match error {
        ApplyError::WrongSensor { recording, recorded, connected } => format!(
            "{recording}: recorded with serial `{connected}`, but the model was calibrated for `{recorded}`: what parts \
             two units is no gap of a simulator; give --model a calibration of `{connected}`, or leave it out"
        ),
        other => other.to_string(),
    }
}

/// Standard errors of a gain from nominal SI to SI, and of a bias in nominal SI.
fn errors(kind: SensorKind, stored: &StoredTriad, nominal: Nominal) -> (Matrix3<f64>, Vector3<f64>) {
    let per_si = stored.unit_out.per_si().unwrap_or(nominal.per_unit);
    let unsure = unsure(kind, stored);
    let std = |value: f64| if value > 0.0 { value * unsure } else { 0.0 };
    let gain =
        Matrix3::from_fn(|row, column| std(stored.gain_std[row][column])) * (nominal.per_unit / per_si);
    (gain, Vector3::from(stored.bias_std).map(std) / nominal.per_unit)
}

/// By how much a standard error is larger since the noise was estimated from few residuals: √(ν/(ν − 2)), the standard deviation
/// of Student's t; with two degrees of freedom or fewer it says nothing.
fn unsure(kind: SensorKind, stored: &StoredTriad) -> f64 {
    // A motion turns about three axes, and at a known attitude a sensor has three; a rest's or a sample's norm is one number.
    let mut at_attitudes = ladder::ACCELEROMETER.iter().chain(&ladder::MAGNETOMETER);
    let of_vectors = kind == SensorKind::Gyr || at_attitudes.any(|(name, _)| *name == stored.model);
    let equations = f64::from(stored.observations) * if of_vectors { 3.0 } else { 1.0 };
    let freedom = equations - f64::from(stored.parameters);
    if freedom > 2.0 { (freedom / (freedom - 2.0)).sqrt() } else { f64::INFINITY }
}

/// `gain · (raw − bias)` as a triad from nominal SI values to SI ones.
fn si(stored: &StoredTriad, nominal: Nominal) -> Triad<f64> {
    // A nominal value is (raw − offset) / per_unit; a calibrated one has no offset.
    let nominal_in = stored.triad().in_unit(-nominal.offset / nominal.per_unit, 1.0 / nominal.per_unit);
    let per_si = stored.unit_out.per_si().unwrap_or(nominal.per_unit);
    Triad { gain: nominal_in.gain / per_si, ..nominal_in }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        recording::Unit,
        store::{StoredNonlinearity, StoredTemperature},
    };

    fn stored() -> StoredTriad {
        StoredTriad {
            unit_in: Unit::Counts,
            unit_out: Unit::Gravity,
            gain: [[2.5e-4, 1e-6, 0.0], [0.0, 2.4e-4, 0.0], [0.0, 2e-6, 2.6e-4]],
            bias: [33_000.0, 32_500.0, 32_800.0],
            model: "T9".to_owned(),
            gain_std: [[0.0; 3]; 3],
            bias_std: [0.0; 3],
            rms: 0.0,
            held_out_rms: None,
            observations: 20,
            parameters: 9,
            condition: 2.0,
            coverage: 1.0,
            field_norm: None,
            provenance: None,
            nonlinearity: None,
            temperature: None,
        }
    }

    #[test]
    fn a_model_of_few_residuals_is_less_sure_of_its_errors() {
        let of = |observations: u32, kind| {
            let stored = StoredTriad { observations, bias_std: [0.5, 0.0, 0.2], ..stored() };
            errors(kind, &stored, Nominal { offset: 0.0, per_unit: 1.0 }).1
        };
        // Fifteen poses on a rig are 45 equations of 14 parameters.
        let on_rig = StoredTriad {
            model: "I14".into(),
            observations: 15,
            parameters: 14,
            bias_std: [0.5; 3],
            ..stored()
        };
        let error = errors(SensorKind::Acc, &on_rig, Nominal { offset: 0.0, per_unit: 1.0 }).1;
        assert!((error.x / 0.5 - (31.0f64 / 29.0).sqrt()).abs() < 1e-12, "{error}");
        let many = of(100_009, SensorKind::Acc);
        assert!((many - Vector3::new(0.5, 0.0, 0.2)).norm() < 1e-4, "{many}");
        let eight = of(17, SensorKind::Acc);
        assert!((eight - Vector3::new(0.5, 0.0, 0.2) * (8.0f64 / 6.0).sqrt()).norm() < 1e-12, "{eight}");
        assert_eq!(of(11, SensorKind::Acc), Vector3::new(f64::INFINITY, 0.0, f64::INFINITY));
        // A motion gives three numbers.
        assert!(of(11, SensorKind::Gyr).x < 0.53);
    }

    #[test]
    fn terms_that_the_simulation_does_without_are_named() {
        assert_eq!(left_out(SensorKind::Acc, &stored()), None);
        let none = [0.0; 3];
        let temperature = StoredTemperature {
            reference: 25.0,
            bias_slope: none,
            scale_slope: none,
            quality: None,
            curvature: None,
        };
        let bent = StoredNonlinearity {
            range: 9.8,
            quadratic: none,
            cubic: none,
            cross: [none; 3],
            quadratic_std: none,
            cubic_std: none,
            cross_std: [none; 3],
        };
        let stored = StoredTriad { temperature: Some(temperature), nonlinearity: Some(bent), ..stored() };
        let remark = left_out(SensorKind::Acc, &stored).expect("two kinds of terms");
        assert!(
            remark.starts_with("acc: ") && remark.contains("terms of temperature and nonlinear terms"),
            "{remark}"
        );
    }

    #[test]
    fn counts_become_what_the_calibration_makes_of_them() {
        let nominal = Nominal { offset: 32768.0, per_unit: 415.0 };
        let stored = stored();
        let raw = Vector3::new(37_000.0, 29_000.0, 33_123.0);
        let gain = Matrix3::from_fn(|i, j| stored.gain[i][j]);
        let expected = gain * (raw - Vector3::from(stored.bias)) * 9.80665;
        let found = si(&stored, nominal).correct(&raw.map(|x| nominal.to_si(x)));
        assert!((found - expected).norm() < 1e-9, "{found} {expected}");
    }
}
