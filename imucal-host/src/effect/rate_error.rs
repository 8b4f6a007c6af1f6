//! The sensor's clock runs fast: `clk.rate_error`.

use super::{Act, Effect, Parameter, Part, Words};

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "The sensor's clock gains on that of the encoders, the reference or the simulator: the row of t shows the movement at t / (1 + error).",
        remedy: "Discipline the clock, or scale the sensors' times.",
        needs: "Brisk motion at the beginning and again at the end of a long recording.",
    };
    Effect::new("clk.rate_error", Act::Clock(alter), vec![Parameter::amplitude("error", "-", 1e-4)], words)
        .part(Part::ClockRateTerm)
        .like("clk.time_offset", "brisk motion at the beginning and again at the end")
        .like("gyr.scale", "the encoders at the end of a long motion at constant rate")
}

fn alter(values: &[f64], time: f64) -> f64 {
    time / (1.0 + values.first().copied().unwrap_or(0.0))
}
