//! A triad turned on the reference: `P.mounting`, a term of calibrated triads where no housing ties the two together.
//!
//! ```text
//! K' = K Exp(θ)
//! ```

use imucal_core::{rotation, triad::Triad};

use super::{Act, Effect, Free, Parameter, Part, SensorKind, Words, XYZ, member_id, vector};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let words = Words {
        cause: "The axes that the triad was calibrated in are turned against those of the reference.",
        remedy: "None is needed: calibrations and optical references choose their axes freely.",
        needs: "Two attitudes that are not turned about the input.",
    };
    let parameters = Parameter::amplitudes(&XYZ, "rad", 0.03);
    Effect::new(&member_id(kind, "mounting"), Act::Triad(kind, alter), parameters, words)
        .part(Part::Nuisance(Free::NoGimbalsTriadGiven))
}

fn alter(values: &[f64], triad: &mut Triad<f64>) {
    // The gain is the inverse of K.
    triad.gain = rotation::exp(&vector(values, 0)).tr_mul(&triad.gain);
}
