//! Clipping below full scale: `P.saturation`.

use super::{Act, Effect, Parameter, Part, SensorKind, SignalRun, Spoils, Words, member_id, of};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let words = Words {
        cause: "The output clips at full scale / (1 + shortfall): a low supply, a range set too small.",
        remedy: "Set the larger range, or leave the clipped rows out.",
        needs: "Inputs above the limit.",
    };
    let shortfall = Parameter::magnitude("shortfall", "-", of(kind, 6.0, 20.0, 3.0), 1000.0);
    Effect::member(kind, "saturation", Act::Signal(kind, alter), vec![shortfall], words)
        .part(Part::Fault(Spoils::BeyondLimit))
        .like(&member_id(kind, "scale_cubic"), "the largest values: clipped ones are all the same")
}

fn alter(values: &[f64], run: &mut SignalRun<'_>) {
    *run.limit /= 1.0 + values.first().copied().unwrap_or(0.0).max(0.0);
}
