//! Output at zero input: `P.bias`, a term of the baseline.

use imucal_core::triad::Triad;

use super::{Act, Effect, Parameter, Part, SensorKind, TriadEntries, Words, XYZ, member_id, of, si, vector};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let words = Words {
        cause: "The output at zero input is not that of the model.",
        remedy: "Calibrate the bias; for a gyroscope at each start.",
        needs: "A rest; for accelerometer and magnetometer in three or more attitudes.",
    };
    let act = Act::Triad(kind, alter);
    let effect = Effect::member(
        kind,
        "bias",
        act,
        Parameter::amplitudes(&XYZ, &si(kind), of(kind, 0.1, 0.01, 1.0)),
        words,
    )
    .part(Part::TriadTerm)
    .changing(TriadEntries::Bias);
    match kind {
        SensorKind::Mag => effect.like("mag.hard_iron", "none: the two are the same"),
        _ => effect.like(&member_id(kind, "bias_drift"), "the same attitude at the beginning and at the end"),
    }
}

fn alter(values: &[f64], triad: &mut Triad<f64>) {
    triad.bias += vector(values, 0);
}
