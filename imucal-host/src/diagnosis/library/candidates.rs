//! Terms of the baseline and effects that may explain what it leaves.

use super::grid_posterior::GridPosterior;
use crate::{
    diagnosis::settings::Provided,
    effect::{Act, CATALOGUE, Effect, Free, NUISANCES, Needs, Part},
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
    pub untestable: Vec<(&'static Effect, String)>,
    /// Effects of a user that do here what one among `effects` does, which stands for them: that one first.
    pub same: Vec<(&'static Effect, &'static Effect)>,
}

/// What a recording is diagnosed with.
#[derive(Clone, Debug)]
pub struct Setting<'a> {
    /// Sensors that are there.
    pub kinds: &'a [SensorKind],
    /// There is a temperature.
    pub thermometer: bool,
    /// Sensors whose triad is given by a calibration made elsewhere.
    pub calibrated: &'a [SensorKind],
    /// What the source of the movement provides.
    pub provided: Provided,
    /// The site gives the field.
    pub field_known: bool,
}

impl Setting<'_> {
    /// A term of the baseline, unless it is taken out or given.
    fn is_term(&self, effect: &Effect) -> bool {
        let is_there = |shown_by: &[SensorKind]| shown_by.iter().any(|kind| self.kinds.contains(kind));
        match effect.part {
            Part::TriadTerm => is_there(effect.sensors),
            Part::RigTerm(shown_by) => self.provided.base && is_there(shown_by),
            Part::ClockTerm => self.provided.clock,
            Part::ClockRateTerm => self.provided.clock_rate,
            Part::Candidate | Part::Nuisance(_) | Part::Fault(_) => false,
        }
    }

    /// A term of a triad that a calibration made elsewhere gives.
    fn is_given(&self, effect: &Effect) -> bool {
        effect.part == Part::TriadTerm && self.gives(effect)
    }

    fn gives(&self, effect: &Effect) -> bool {
        effect.sensors.iter().all(|kind| self.calibrated.contains(kind))
    }

    fn is_free(&self, nuisance: &Effect) -> bool {
        let Part::Nuisance(free) = nuisance.part else { return false };
        match free {
            Free::ReadApart => self.provided.lags,
            Free::Placed => self.provided.placed,
            Free::NoGimbalsTriadGiven => !self.provided.gimbals && self.gives(nuisance),
            // Without the vertical, the levelling tilts stand for the dip.
            Free::FieldUnknown => !self.field_known && self.kinds.contains(&SensorKind::Acc),
            Free::FieldUnknownTriadGiven => !self.field_known && self.gives(nuisance),
        }
    }

    /// Why the recording cannot show an effect.
    fn cannot_show(&self, effect: &Effect) -> Option<&'static str> {
        let Needs {
            gimbals,
            thermometer,
            heading,
            other_calibration,
            exact_attitude,
            position,
            outside,
            exact_force,
            stream,
            read_together,
        } = effect.needs;
        let provided = &self.provided;
        match effect.act {
            Act::Rig(_) if !provided.table => {
                return Some("there is no rig: gravity itself gives the attitude of each rest");
            }
            Act::Rig(_) if !provided.base => {
                return Some("there is no rig: the simulator gives what is sensed in the sensor's own axes");
            }
            Act::Clock(_) if !provided.table => return Some("there is no clock but the sensors' own"),
            _ => {}
        }
        let field_alone = matches!(effect.act, Act::Formula(..))
            && provided.gives_field()
            && self.kinds.contains(&SensorKind::Mag);
        if outside && (provided.gimbals || !provided.table) {
            return Some("there is no reference on the body: neither a tracker's nor a simulator's");
        }
        if exact_force && provided.placed {
            return Some(
                "accelerations that follow from positions are off by more than what distinguishes gravity from a scale of all \
                 axes",
            );
        }
        if stream && !provided.followed {
            return Some("there is no simulator's stream: how the field points is a term of the baseline");
        }
        if stream && ![SensorKind::Acc, SensorKind::Gyr].iter().all(|kind| self.kinds.contains(kind)) {
            return Some(
                "without accelerometer and gyroscope the vertical is not known in the stream's axes",
            );
        }
        if read_together && provided.lags && provided.clock {
            return Some(
                "nothing says that the sensors were read at the same time: a delay of the gyroscope is the reference's \
                 clock, which is fitted",
            );
        }
        if heading && !provided.heading && !field_alone {
            Some("the heading is not known, so that Earth's rotation is not known in the sensor's axes")
        } else if thermometer && !self.thermometer {
            Some("no temperature was recorded")
        } else if other_calibration && !self.calibrated.contains(&SensorKind::Mag) {
            Some("a calibration of the same recording absorbs it; needs one of another recording (--model)")
        } else if position && !provided.position {
            Some(
                "an attitude alone holds no linear acceleration, which an arm looks like; record the position (ref_p*)",
            )
        } else if exact_attitude && position && !provided.exact_attitude {
            Some(
                "a reference position is known to some millimetres: nothing distinguishes arms of single axes from its errors",
            )
        } else if exact_attitude && !provided.exact_attitude {
            Some(
                "a reference attitude has noise and a filter of its own: nothing distinguishes a sensor's low-pass or \
                 play from them",
            )
        } else if gimbals && !provided.gimbals {
            Some("no gimbals turn the sensor")
        } else {
            None
        }
    }
}

impl Candidates {
    /// In a setting; `without` names catalogue entries to be withheld and terms to be taken out of the baseline, which
    /// then are candidates. Terms of triads that are given are candidates too, and so are the user's `own` effects, of
    /// one id the first.
    pub fn new(setting: &Setting<'_>, without: &[String], own: &[&'static Effect]) -> Self {
        let named = |effect: &Effect| without.contains(&effect.id);
        let reached = |effect: &&Effect| effect.sensors.iter().any(|sensor| setting.kinds.contains(sensor));
        let is_found = |effect: &&Effect| effect.spoils().is_none() && reached(effect);
        let is_new = |(at, effect): &(usize, &&'static Effect)| {
            CATALOGUE.iter().chain(own[..*at].iter().copied()).all(|other| other.id != effect.id)
        };
        let own = own.iter().enumerate().filter(is_new).map(|(_, effect)| *effect);
        let (mut baseline, others): (Vec<_>, Vec<_>) =
            CATALOGUE.iter().chain(own).filter(is_found).partition(|effect| {
                setting.is_term(effect)
                    && !named(effect)
                    && !setting.is_given(effect)
                    && setting.cannot_show(effect).is_none()
            });
        baseline.extend(NUISANCES.iter().filter(|effect| reached(effect) && setting.is_free(effect)));
        let mut candidates = Self {
            baseline,
            effects: Vec::new(),
            taken_out: Vec::new(),
            untestable: Vec::new(),
            same: Vec::new(),
        };
        for effect in others.into_iter().filter(|effect| setting.is_term(effect) || !named(effect)) {
            // What is fixed to a calibrated sensor is iron, and the triad's terms would be the same by another name.
            let is_iron = effect.part == Part::TriadTerm && effect.sensors == [SensorKind::Mag];
            if is_iron && setting.calibrated.contains(&SensorKind::Mag) {
                continue;
            }
            match setting.cannot_show(effect) {
                Some(why) => candidates.untestable.push((effect, why.to_owned())),
                None => {
                    candidates.effects.push(effect);
                    candidates.taken_out.extend(named(effect).then_some(effect));
                }
            }
        }
        candidates
    }

    /// Takes an effect out, since the recording cannot show it; whether it was a candidate.
    pub fn withdraw(&mut self, id: &str, why: String) -> bool {
        let at = self.effects.iter().position(|effect| effect.id == id);
        at.map(|at| self.untestable.push((self.effects.remove(at), why))).is_some()
    }

    /// Effects of a user that another stands for.
    pub fn same_as(&self, effect: &Effect) -> impl Iterator<Item = &'static Effect> {
        self.same.iter().filter(move |(held, _)| *held == effect).map(|(_, other)| *other)
    }

    /// Whether an effect is fitted always.
    pub fn has_term(&self, effect: &Effect) -> bool {
        self.baseline.contains(&effect)
    }

    /// Whether an effect was taken out of the baseline.
    pub fn was_taken_out(&self, effect: &Effect) -> bool {
        self.taken_out.contains(&effect)
    }

    /// Terms of triads that a calibration made elsewhere gives, of the sensors that an effect reaches.
    pub fn given_with(&self, effect: &Effect) -> Vec<&'static Effect> {
        let stands_for = |term: &Effect| term.part == Part::TriadTerm || term.needs.other_calibration;
        let is_given = |term: &&&'static Effect| {
            stands_for(term)
                && !self.was_taken_out(term)
                && term.sensors.iter().all(|kind| effect.sensors.contains(kind))
        };
        if stands_for(effect) { Vec::new() } else { self.effects.iter().filter(is_given).copied().collect() }
    }

    /// An effect's parameters among those of all candidates, in their order; none for a term of the baseline.
    pub fn shape(&self, shapes: &[GridPosterior], effect: &Effect) -> Vec<f64> {
        let at = self.effects.iter().position(|other| *other == effect);
        at.and_then(|at| shapes.get(at)).map(|shape| shape.values.clone()).unwrap_or_default()
    }
}

/// An effect that stands in the baseline unless it is taken out.
pub fn is_term(effect: &Effect) -> bool {
    matches!(effect.part, Part::TriadTerm | Part::RigTerm(_) | Part::Nuisance(_))
}
