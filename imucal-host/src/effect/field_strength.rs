//! The field in the room is stronger than given: `mag.field_strength`, a term of recordings whose site does not give the
//! field, with a calibration made elsewhere.

use super::{Act, Effect, Free, Parameter, Part, SensorKind, Truth, Words};

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "The field is stronger by this share than the model says.",
        remedy: "Give the site's field in the manifest.",
        needs: "A calibrated magnetometer.",
    };
    let parameters = vec![Parameter::amplitude("strength", "-", 0.03)];
    Effect::new("mag.field_strength", Act::Field(alter), parameters, words)
        .part(Part::Nuisance(Free::FieldUnknownTriadGiven))
        .on(SensorKind::Mag)
}

fn alter(values: &[f64], row: &mut Truth) {
    let share = values.first().copied().unwrap_or(0.0);
    row.b_t *= 1.0 + share;
}
