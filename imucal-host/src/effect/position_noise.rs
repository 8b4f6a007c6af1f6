//! The reference's position trembles: `ref.position_noise`.
//!
//! ```text
//! f_t → f_t + σ ω² n      n: a number of variance one, another one at each time and axis; ω: 40 rad/s
//! ```
//!
//! ω is the bandwidth to which a position is usually differentiated. Not modelled: how a smoother shares the noise among
//! neighbouring rows.

use super::{Act, Effect, Needs, Parameter, Part, Spoils, Truth, Words, tremble::tremble};

/// Its id.
pub const ID: &str = "ref.position_noise";
/// ω, rad/s.
const BANDWIDTH: f64 = 40.0;

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "The reference position trembles by more than its manifest says, or than a reference does; twice \
                differentiated, it is an acceleration that no sensor feels.",
        remedy: "Give its noise in the manifest's [reference]; place cameras nearer, or track at a higher rate.",
        needs: "A reference position that was not smoothed.",
    };
    let parameters = vec![Parameter::magnitude("sigma", "m", 2e-3, 0.3)];
    Effect::new(ID, Act::Field(alter), parameters, words)
        .part(Part::Fault(Spoils::Nothing))
        .on(super::Acc)
        .needing(Needs::OUTSIDE)
        .like("acc.noise_burst", "the reference at rest: it trembles where no sensor does")
}

fn alter(values: &[f64], row: &mut Truth) {
    let Some(sigma) = values.first() else { return };
    row.f_t += tremble(row.time) * (*sigma * BANDWIDTH * BANDWIDTH);
}
