//! Earth's rotation is not that of the model: `gyr.earth_rate`.

use super::{Act, Effect, Needs, Parameter, SensorKind, Truth, Words};

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "The simulator leaves Earth's rotation out: the recording's is 1 + share of the simulator's.",
        remedy: "Add Earth's rotation at the site's latitude to the rate.",
        needs: "Long rests in different attitudes and a gyroscope quieter than 10 degrees an hour.",
    };
    let share = Parameter::bounded("share", "-", 1.0, (-2.0, 2.0));
    Effect::new("gyr.earth_rate", Act::Field(alter), vec![share], words)
        .needing(Needs::HEADING)
        .on(SensorKind::Gyr)
        .like(
            "gyr.g_sensitivity",
            "rests at several headings: its vertical part looks like Earth's, its level part not",
        )
        .like("gyr.bias", "rests in opposite attitudes")
}

fn alter(values: &[f64], row: &mut Truth) {
    let share = values.first().copied().unwrap_or(0.0);
    row.w_it_t += row.w_ie_t * share;
}
