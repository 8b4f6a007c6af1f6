//! Scale that changes with temperature: `P.temp_scale`.
//!
//! The scale's drift of [`TemperatureTerms`] from 25 °C, on what each axis senses.

use imucal_core::{temperature::TemperatureTerms, triad::Triad};

use super::{
    Act, Effect, Needs, Parameter, SensorKind, SensorRows, Words, XYZ, member_id, temp_bias::REFERENCE,
    vector,
};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let words = Words {
        cause: "The sensitivity falls with temperature, by this share per kelvin.",
        remedy: "Add a temperature term to the scale.",
        needs: "The same inputs of both signs at two temperatures, not in the order of time.",
    };
    let parameters = Parameter::amplitudes(&XYZ, "1/K", 2e-4);
    Effect::member(kind, "temp_scale", Act::Sensor(kind, alter), parameters, words)
        .needing(Needs::THERMOMETER)
        .like(&member_id(kind, "temp_bias"), "inputs of both signs at each temperature")
        .like(&member_id(kind, "scale_cubic"), "the same inputs at two temperatures")
}

fn alter(values: &[f64], run: &mut SensorRows<'_>) {
    let slope = vector(values, 0);
    let terms = TemperatureTerms { reference: REFERENCE, bias_slope: [0.0; 3], scale_slope: slope.into() };
    run.add(|input, sensed| {
        // A scale that has drifted to zero senses nothing.
        terms.predict(&Triad::identity(), sensed, input.temperature).unwrap_or_default() - sensed
    });
}
