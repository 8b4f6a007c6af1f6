//! The reference's attitude trembles: `ref.attitude_noise`.
//!
//! ```text
//! f_t → Exp(σ n)ᵀ f_t,  b_t → Exp(σ n)ᵀ b_t      n: a number of variance one, another one at each time and axis
//! ```
//!
//! Not modelled: what a trembling attitude makes of the rate, which depends on how it is differentiated.

use imucal_core::rotation::exp;

use super::{Act, Effect, Needs, Parameter, Part, Spoils, Truth, Words, tremble::tremble};

/// Its id.
pub const ID: &str = "ref.attitude_noise";

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "The reference attitude trembles by more than its manifest says, or than a reference does: markers that are \
                small, far away or half hidden.",
        remedy: "Give its noise in the manifest's [reference]; place markers further apart and cameras nearer.",
        needs: "A reference attitude that was not smoothed.",
    };
    let parameters = vec![Parameter::magnitude("sigma", "rad", 2e-3, 0.3)];
    Effect::new(ID, Act::Field(alter), parameters, words)
        .part(Part::Fault(Spoils::Nothing))
        .needing(Needs::OUTSIDE)
        .like("P.noise_burst", "the reference at rest: it trembles where no sensor does")
}

fn alter(values: &[f64], row: &mut Truth) {
    let Some(sigma) = values.first() else { return };
    let turn = exp(&(tremble(row.time) * *sigma));
    (row.f_t, row.b_t) = (turn.tr_mul(&row.f_t), turn.tr_mul(&row.b_t));
}
