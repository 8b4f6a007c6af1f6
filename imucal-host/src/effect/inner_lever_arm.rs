//! Each axis of the accelerometer at its own place: `acc.inner_lever_arm`.
//!
//! ```text
//! y_i += [ẇ × r_i + w × (w × r_i)]_i
//! ```

use nalgebra::Vector3;

use super::{Act, Effect, Needs, Parameter, SensorKind, SensorRows, Words, vector};

const NAMES: [&str; 9] = ["x_x", "x_y", "x_z", "y_x", "y_y", "y_z", "z_x", "z_y", "z_z"];

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "The proof masses of the three axes do not sit at one point.",
        remedy: "Estimate an arm for each axis, or take them from the data sheet.",
        needs: "Rates above 1 rad/s about three axes, or brisk sinusoids.",
    };
    let act = Act::Sensor(SensorKind::Acc, alter);
    Effect::new("acc.inner_lever_arm", act, Parameter::amplitudes(&NAMES, "m", 0.01), words)
        .needing(Needs { exact_attitude: true, ..Needs::POSITION })
        .like("acc.lever_arm", "none for its common part; constant rates about all three axes for the rest")
}

fn alter(values: &[f64], run: &mut SensorRows<'_>) {
    let arms = [vector(values, 0), vector(values, 3), vector(values, 6)];
    run.add(|input, _| {
        let (w, dw) = (input.w_iq_q, input.dw_iq_q);
        Vector3::from_fn(|axis, _| (dw.cross(&arms[axis]) + w.cross(&w.cross(&arms[axis])))[axis])
    });
}
