//! A noisy stretch: `P.noise_burst`.

use super::{Act, Effect, Parameter, Part, SensorKind, SignalRun, Spoils, Words, member_id};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let words = Words {
        cause: "For a while the noise is larger by this share: someone walks by, a pump runs, a radio transmits.",
        remedy: "Leave that stretch out, or weigh it less.",
        needs: "Rests within and outside of the stretch.",
    };
    let parameters = vec![
        Parameter::magnitude("excess", "-", 3.0, 100.0),
        Parameter::instant("t_start", 0.45),
        Parameter::instant("t_end", 0.6),
    ];
    Effect::member(kind, "noise_burst", Act::Signal(kind, alter), parameters, words)
        .part(Part::Fault(Spoils::Passage))
        .like(&member_id(kind, "bias_step"), "the mean over the stretch: noise leaves it")
}

fn alter(values: &[f64], run: &mut SignalRun<'_>) {
    let [excess, start, end] = *values else { return };
    for (noise, time) in run.noise.iter_mut().zip(run.time) {
        if (start..end).contains(time) {
            *noise *= 1.0 + excess;
        }
    }
}
