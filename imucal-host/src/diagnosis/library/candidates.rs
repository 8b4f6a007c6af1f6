//! Terms of the baseline and effects that may explain what it leaves.

use super::grid_posterior::Shaped;
use crate::{
    effect::{Act, CATALOGUE, Effect, NUISANCES, Role},
    recording::SensorKind,
};

/// What a diagnosis chooses from.
#[derive(Clone, Debug)]
pub struct Candidates {
    /// Fitted always.
    pub baseline: Vec<&'static Effect>,
    /// Effects that may be added.
    pub effects: Vec<&'static Effect>,
    /// Those among them that were taken out of the baseline: every sensor has them, and they are no noise.
    pub taken_out: Vec<&'static Effect>,
    /// Effects that the recording cannot show, and why.
    pub untestable: Vec<(&'static Effect, &'static str)>,
}

/// Effects against a calibration made elsewhere: one made of the recording itself holds them.
const ELSEWHERE: [&str; 2] = ["mag.hard_iron", "mag.soft_iron"];

/// Terms of each triad in the baseline; the rig's are beside them.
const TRIAD_TERMS: [&str; 3] = ["bias", "scale", "misalignment"];

/// What a recording is diagnosed with.
#[derive(Clone, Debug)]
pub struct Setting<'a> {
    /// Sensors that are there.
    pub kinds: &'a [SensorKind],
    /// There is a temperature.
    pub thermometer: bool,
    /// Sensors whose triad is given by a calibration made elsewhere.
    pub calibrated: &'a [SensorKind],
    /// The movement is that of a rig's gimbals; else of a reference that is fixed to the sensor.
    pub gimbals: bool,
    /// The movement is what the sensors themselves tell from rest to rest.
    pub hand: bool,
    /// The site tells the field.
    pub field_known: bool,
}

impl Candidates {
    /// In a setting; `without` names catalogue entries to be withheld and terms to be taken out of the baseline, which
    /// then are candidates. Terms of triads that are given are candidates too.
    pub fn new(setting: &Setting<'_>, without: &[String]) -> Self {
        let kinds = setting.kinds;
        let named = |effect: &Effect| without.contains(&effect.id);
        let calibrated = |kind: SensorKind| setting.calibrated.contains(&kind);
        let given = |effect: &Effect| effect.sensors.iter().all(|kind| calibrated(*kind));
        // A reference that is no rig has a clock of its own.
        let on_clock = |effect: &Effect| !setting.gimbals && effect.id == "clk.time_offset";
        let in_baseline = |effect: &Effect| match term(effect, kinds) {
            _ if setting.hand && untold(effect).is_some() => false,
            _ if on_clock(effect) => !named(effect),
            Some(Term::Rig) => !named(effect),
            Some(Term::Triad) => !named(effect) && !given(effect),
            None => false,
        };
        let reached = |effect: &Effect| effect.sensors.iter().any(|sensor| kinds.contains(sensor));
        let (mut baseline, others): (Vec<_>, Vec<_>) = CATALOGUE
            .iter()
            .filter(|effect| !matches!(effect.act, Act::Signal(..) | Act::Data(..)) && reached(effect))
            .partition(|effect| in_baseline(effect));
        let is_free = |effect: &Effect| match effect.id.as_str() {
            // A magnetometer is a chip of its own, and a reference has no clock in common with it.
            "mag.lag" => !setting.gimbals,
            // Without the vertical, the levelling tilts stand for the dip.
            "mag.field_dip" => !setting.field_known && kinds.contains(&SensorKind::Acc),
            // A triad that is free takes up the strength.
            "mag.field_strength" => !setting.field_known && calibrated(SensorKind::Mag),
            _ => !setting.gimbals && given(effect),
        };
        baseline.extend(NUISANCES.iter().filter(|effect| reached(effect) && is_free(effect)));
        let elsewhere = calibrated(SensorKind::Mag);
        let mut candidates =
            Self { baseline, effects: Vec::new(), taken_out: Vec::new(), untestable: Vec::new() };
        let is_term = |effect: &Effect| term(effect, kinds).is_some() || on_clock(effect);
        for effect in others.into_iter().filter(|effect| is_term(effect) || !named(effect)) {
            // What is fixed to a calibrated sensor is iron, and the triad's terms would be the same by another name.
            if elsewhere && is_triad_term(effect, &[SensorKind::Mag]) {
                continue;
            }
            if let Some(why) = untold(effect).filter(|_| setting.hand) {
                candidates.untestable.push((effect, why));
            } else if !setting.thermometer && effect.id.contains(".temp_") {
                candidates.untestable.push((effect, "no temperature was recorded"));
            } else if !elsewhere && ELSEWHERE.contains(&effect.id.as_str()) {
                let why = "it shows against a calibration made elsewhere (--model)";
                candidates.untestable.push((effect, why));
            } else if !setting.gimbals && !setting.hand && effect.id.ends_with(".bandwidth") {
                let why = "a reference attitude has noise and a filter of its own: nothing parts a sensor's low-pass from them";
                candidates.untestable.push((effect, why));
            } else if !setting.gimbals && needs_gimbals(effect, kinds) {
                candidates.untestable.push((effect, "no gimbals turn the sensor"));
            } else {
                candidates.effects.push(effect);
                candidates.taken_out.extend(named(effect).then_some(effect));
            }
        }
        candidates
    }

    /// Whether an effect is fitted always.
    pub fn has_term(&self, effect: &Effect) -> bool {
        self.baseline.iter().any(|term| std::ptr::eq(*term, effect))
    }

    /// Whether an effect was taken out of the baseline.
    pub fn was_taken_out(&self, effect: &Effect) -> bool {
        self.taken_out.iter().any(|taken| std::ptr::eq(*taken, effect))
    }

    /// Terms of triads that a calibration made elsewhere gives, of the sensors that an effect reaches.
    pub fn given_beside(&self, effect: &Effect) -> Vec<&'static Effect> {
        let stands_for =
            |term: &Effect| is_triad_term(term, &SensorKind::ALL) || ELSEWHERE.contains(&term.id.as_str());
        let is_given = |term: &&&'static Effect| {
            stands_for(term)
                && !self.was_taken_out(term)
                && term.sensors.iter().all(|kind| effect.sensors.contains(kind))
        };
        if stands_for(effect) { Vec::new() } else { self.effects.iter().filter(is_given).copied().collect() }
    }

    /// An effect's parameters among those of all candidates, in their order; none for a term of the baseline.
    pub fn shape(&self, shapes: &[Shaped], effect: &Effect) -> Vec<f64> {
        let at = self.effects.iter().position(|other| std::ptr::eq(*other, effect));
        at.and_then(|at| shapes.get(at)).map(|shape| shape.values.clone()).unwrap_or_default()
    }
}

/// Why a recording in a hand, whose attitudes the sensors themselves tell, cannot show an effect.
fn untold(effect: &Effect) -> Option<&'static str> {
    match effect.act {
        Act::Rig(_) => Some("there is no rig: gravity itself tells the attitude of each rest"),
        Act::Clock(_) => Some("there is no clock but the sensors' own"),
        Act::Field(_) if effect.id == "gyr.earth_rate" => {
            Some("the heading is not told, so that Earth's rotation is not known in the sensor's axes")
        }
        _ => None,
    }
}

/// It acts through a gimbal.
fn needs_gimbals(effect: &Effect, kinds: &[SensorKind]) -> bool {
    let of_rig = matches!(effect.act, Act::Rig(_)) && term(effect, kinds).is_none();
    of_rig || effect.id.starts_with("mag.gimbal_") || effect.id == "mag.motor_current"
}

fn is_triad_term(effect: &Effect, kinds: &[SensorKind]) -> bool {
    matches!(term(effect, kinds), Some(Term::Triad))
}

/// An effect that stands in the baseline unless it is taken out.
pub fn is_term(effect: &Effect) -> bool {
    term(effect, &SensorKind::ALL).is_some() || NUISANCES.iter().any(|term| std::ptr::eq(term, effect))
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
