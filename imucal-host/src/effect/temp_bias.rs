//! Bias that grows with temperature: `P.temp_bias`.
//!
//! The drift of [`TemperatureTerms`] from 25 °C.

use imucal_core::{temperature::TemperatureTerms, triad::Triad};
use nalgebra::Vector3;

use super::{Act, Effect, Needs, Parameter, SensorKind, SensorRows, Words, XYZ, member_id, of, si, vector};

/// Temperature at which temperature effects vanish, °C.
pub(super) const REFERENCE: f64 = 25.0;

pub(super) fn effect(kind: SensorKind) -> Effect {
    let words = Words {
        cause: "The bias grows with the sensor's temperature.",
        remedy: "Add a temperature term per axis to the calibration.",
        needs: "The same attitude at two temperatures, not in the order of time.",
    };
    let parameters = Parameter::amplitudes(&XYZ, &format!("{}/K", si(kind)), of(kind, 2e-3, 3e-4, 0.02));
    Effect::member(kind, "temp_bias", Act::Sensor(kind, alter), parameters, words)
        .needing(Needs::THERMOMETER)
        .like(&member_id(kind, "bias_drift"), "heating and then cooling")
        .like(&member_id(kind, "warmup"), "a cooling ramp, then the first attitude again")
        .like(&member_id(kind, "temp_bias_quadratic"), "three or more temperatures")
}

fn alter(values: &[f64], run: &mut SensorRows<'_>) {
    let slope = vector(values, 0);
    let terms = TemperatureTerms { reference: REFERENCE, bias_slope: slope.into(), scale_slope: [0.0; 3] };
    // Nothing to invert: the triad is the identity and the scale stays.
    run.add(|input, _| {
        terms.predict(&Triad::identity(), &Vector3::zeros(), input.temperature).unwrap_or_default()
    });
}
