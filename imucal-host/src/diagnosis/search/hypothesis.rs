//! A set of effects as the search holds it: screened axis by axis, and scored with all sensors jointly.

use crate::{diagnosis::mixed_model::noise::Noise, effect::Effect};

/// A set of effects and how it does axis by axis: its noise, and its evidence so far.
#[derive(Clone, Debug)]
pub struct Screened {
    /// The effects.
    pub set: Vec<&'static Effect>,
    /// The noise that suits it.
    pub noise: Noise,
    /// ln of its probability, but for a constant; to be compared with others of this kind alone.
    pub value: f64,
}

/// A set of effects and how it was judged.
#[derive(Clone, Debug)]
pub struct Scored {
    /// The effects.
    pub set: Vec<&'static Effect>,
    /// The noise that suits it.
    pub noise: Noise,
    /// ln of its probability, but for a constant.
    pub log_evidence: f64,
    /// Its value as it was sifted.
    pub sifted: f64,
}
