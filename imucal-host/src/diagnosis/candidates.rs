//! Terms of the baseline and effects that may explain what it leaves.

use crate::{
    effect::{Act, CATALOGUE, Effect, Role},
    recording::SensorKind,
};

/// What a diagnosis chooses from.
#[derive(Clone, Debug)]
pub struct Candidates {
    /// Fitted always.
    pub baseline: Vec<&'static Effect>,
    /// Effects that may be added.
    pub effects: Vec<&'static Effect>,
    /// Effects that the recording cannot show, and why.
    pub untestable: Vec<(&'static Effect, &'static str)>,
}

/// Effects against a calibration made elsewhere: one made of the recording itself holds them.
const ELSEWHERE: [&str; 2] = ["mag.hard_iron", "mag.soft_iron"];

/// Terms of each triad in the baseline; the rig's are beside them.
const TRIAD_TERMS: [&str; 3] = ["bias", "scale", "misalignment"];

impl Candidates {
    /// With these sensors; `without` names catalogue entries to be withheld and terms to be taken out of the baseline,
    /// which then are candidates. With `calibrated`, the triads are given and their terms are candidates too.
    pub fn new(kinds: &[SensorKind], thermometer: bool, calibrated: bool, without: &[String]) -> Self {
        let named = |effect: &Effect| without.contains(&effect.id);
        let in_baseline = |effect: &Effect| match term(effect, kinds) {
            Some(Term::Rig) => !named(effect),
            Some(Term::Triad) => !named(effect) && !calibrated,
            None => false,
        };
        let reached = |effect: &Effect| effect.sensors.iter().any(|sensor| kinds.contains(sensor));
        let (baseline, others): (Vec<_>, Vec<_>) = CATALOGUE
            .iter()
            .filter(|effect| !matches!(effect.act, Act::Signal(..) | Act::Data(..)) && reached(effect))
            .partition(|effect| in_baseline(effect));
        let mut candidates = Self { baseline, effects: Vec::new(), untestable: Vec::new() };
        for effect in others.into_iter().filter(|effect| term(effect, kinds).is_some() || !named(effect)) {
            if !thermometer && effect.id.contains(".temp_") {
                candidates.untestable.push((effect, "no temperature was recorded"));
            } else if !calibrated && ELSEWHERE.contains(&effect.id.as_str()) {
                let why = "it shows against a calibration made elsewhere (--model)";
                candidates.untestable.push((effect, why));
            } else {
                candidates.effects.push(effect);
            }
        }
        candidates
    }
}

/// An effect that stands in the baseline unless it is taken out.
pub fn is_term(effect: &Effect) -> bool {
    term(effect, &SensorKind::ALL).is_some()
}

/// What a term of the baseline belongs to.
enum Term {
    Rig,
    Triad,
}

fn term(effect: &Effect, kinds: &[SensorKind]) -> Option<Term> {
    let (owner, name) = effect.id.split_once('.')?;
    match effect.id.as_str() {
        "rig.level_tilt" => kinds.iter().any(|kind| *kind != SensorKind::Gyr).then_some(Term::Rig),
        "rig.heading" => kinds.contains(&SensorKind::Mag).then_some(Term::Rig),
        _ => (kinds.iter().any(|kind| kind.prefix() == owner) && TRIAD_TERMS.contains(&name))
            .then_some(Term::Triad),
    }
}

/// Its signature depends on parameters other than amplitudes.
pub fn is_shaped(effect: &Effect) -> bool {
    effect.parameters.iter().any(|p| matches!(p.role, Role::Shape { .. } | Role::Instant { .. }))
}
