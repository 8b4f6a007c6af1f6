//! Sensors and rig do not share their time's zero: `clk.time_offset`.
//!
//! ```text
//! the row of t shows the rig at t + offset
//! ```

use super::{Act, Effect, Parameter, Part, Words};

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "The sensors' clock started after that of the encoders, the reference or the simulator: the row of t shows the movement at t + offset. Negative: samples reach their row late.",
        remedy: "Record a common trigger, or shift the sensors' times by the offset.",
        needs: "Motion with changing rate, such as sinusoids or slews.",
    };
    Effect::new("clk.time_offset", Act::Clock(alter), vec![Parameter::amplitude("offset", "s", 5e-3)], words)
        .part(Part::ClockTerm)
        .like("clk.rate_error", "brisk motion at the beginning and again at the end")
        .like("gyr.angular_acceleration", "the accelerometer: it is late only where the clock is")
        .like("mag.eddy_current", "the gyroscope: it is late only where the clock is")
}

fn alter(values: &[f64], time: f64) -> f64 {
    time + values.first().copied().unwrap_or(0.0)
}
