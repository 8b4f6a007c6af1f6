//! The sensor's clock jumps against that of a simulator's stream: `clk.jump`.
//!
//! ```text
//! the row of t shows the movement at t + jump      from t_start on
//! ```
//!
//! Not modelled: rows that are lost at the jump.

use super::{Act, Effect, Needs, Parameter, Part, Spoils, Words};

/// Its id.
pub const ID: &str = "clk.jump";

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "From an instant on the row of t shows the movement at t + jump: rows were lost and the others were numbered as if none \
                were, or a clock was set.",
        remedy: "Write down each sample's own time, or shift the times after the jump by it.",
        needs: "A simulator's stream, a gyroscope, and brisk motion before and after the jump.",
    };
    let parameters = vec![Parameter::amplitude("jump", "s", 0.03), Parameter::instant("t_start", 0.5)];
    Effect::new(ID, Act::Clock(alter), parameters, words)
        .part(Part::Fault(Spoils::Nothing))
        .needing(Needs::STREAM)
        .like(
            "ref.motion_mismatch",
            "the time after it: a jump stays, and later motion agrees once it is taken into account",
        )
        .like("clk.rate_error", "a longer recording: a rate goes on")
}

fn alter(values: &[f64], time: f64) -> f64 {
    let [jump, start] = *values else { return time };
    if time >= start { time + jump } else { time }
}
