//! Sensitivity of each axis: `P.scale`, a term of the baseline.

use imucal_core::triad::Triad;
use nalgebra::Matrix3;

use super::{Act, Effect, Parameter, Part, SensorKind, TriadEntries, Words, XYZ, member_id, vector};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let words = Words {
        cause: "An axis puts out more than its input, by this share: K' = (I + S) K.",
        remedy: "Calibrate the scale.",
        needs: "Inputs of both signs on each axis.",
    };
    let act = Act::Triad(kind, alter);
    let effect = Effect::member(kind, "scale", act, Parameter::amplitudes(&XYZ, "-", 5e-3), words)
        .part(Part::TriadTerm)
        .changing(TriadEntries::Diagonal)
        .like(&member_id(kind, "scale_cubic"), "inputs at several levels");
    match kind {
        SensorKind::Acc => effect.like("acc.gravity_error", "a known centripetal acceleration"),
        SensorKind::Gyr => {
            effect.like("clk.rate_error", "the encoders at the end of a long motion at constant rate")
        }
        SensorKind::Mag => effect.like("mag.soft_iron", "none: it holds the scale"),
    }
}

fn alter(values: &[f64], triad: &mut Triad<f64>) {
    // K' = (I + S) K, and the gain is the inverse of K.
    triad.gain *= Matrix3::from_diagonal(&vector(values, 0).map(|share| 1.0 / (1.0 + share)));
}
