//! The sensor's clock wanders against that of a simulator's stream: `clk.wander`.
//!
//! ```text
//! the row of t shows the movement at t + amplitude sin(2π t / period)
//! ```
//!
//! A diagnosis follows any wander that is slow; its amplitude is √2 times the root mean square. Not modelled: rows that are lost
//! one by one, of which the times of those between jump.

use std::f64::consts::TAU;

use super::{Act, Effect, Needs, Parameter, Part, Spoils, Words};

/// Its id.
pub const ID: &str = "clk.wander";

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "The times of the rows run now faster and now slower than the simulator's: a host's clock that is disciplined while it \
                records, times of arrival, or many lost rows.",
        remedy: "Write down each sample's own time, by the sensor's clock.",
        needs: "A simulator's stream, a gyroscope, and brisk motion throughout.",
    };
    let parameters =
        vec![Parameter::amplitude("amplitude", "s", 0.01), Parameter::shape("period", "s", 60.0)];
    Effect::new(ID, Act::Clock(alter), parameters, words)
        .part(Part::Fault(Spoils::Nothing))
        .needing(Needs::STREAM)
        .like("ref.motion_mismatch", "motion at other times: a clock that wanders is off in all of it")
        .like("clk.jump", "the moments before and after: a jump is over at once")
}

fn alter(values: &[f64], time: f64) -> f64 {
    let [amplitude, period] = *values else { return time };
    time + amplitude * libm::sin(TAU * time / period)
}
