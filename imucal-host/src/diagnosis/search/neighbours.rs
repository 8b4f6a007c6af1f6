//! Moves of the search: from a set of effects to another that may be likelier.

use rayon::prelude::*;

use super::{
    hypothesis::{Scored, Screened},
    linearisation::Linearisation,
    refit::Fit,
};
use crate::{
    diagnosis::{
        error::DiagnosisError,
        mixed_model::noise::{NEAR, Noise},
        settings::SearchSettings,
    },
    effect::{Effect, class::class},
    recording::SensorKind,
};

type Set = Vec<&'static Effect>;
/// A set, and the sensors whose noise it may change.
type Reaching = (Set, Vec<SensorKind>);

impl Linearisation<'_> {
    /// The best set with one effect more, judged with its own noise; of `among`.
    pub fn added(
        &self,
        from: &Scored,
        among: &dyn Fn(&'static Effect) -> bool,
    ) -> Result<Option<Scored>, DiagnosisError> {
        let (own, ranked) = self.ranked(&from.set, &from.noise)?;
        let likely = |own: f64, ranked: Vec<(f64, &'static Effect)>| -> Set {
            ranked
                .into_iter()
                .filter(|(value, effect)| *value > own && among(effect))
                .map(|(_, e)| e)
                .collect()
        };
        let mut shortlist: Set = likely(own, ranked).into_iter().take(self.settings().screened).collect();
        // Less noise than is true makes evidence, never takes it; most where the noise is furthest from true.
        let (own, ranked) = self.ranked(&from.set, &from.noise.quieter())?;
        let quiet = likely(own, ranked);
        for kind in &self.scene.kinds {
            for effect in
                quiet.iter().filter(|effect| self.reaches(effect, *kind)).take(self.settings().screened_quiet)
            {
                if !is_among(&shortlist, effect) {
                    shortlist.push(effect);
                }
            }
        }
        let sets = shortlist.into_iter().map(|effect| {
            let mut set = from.set.clone();
            set.push(effect);
            (set, self.scene.reach(effect).to_vec())
        });
        Ok(self.best_of(sets.collect(), from))
    }

    /// The best set with two effects of one sensor more. Each alone may leave the other in the drift, and so gain nothing.
    pub fn paired(&self, from: &Scored) -> Result<Option<Scored>, DiagnosisError> {
        let mut sets = Vec::new();
        for kind in &self.scene.kinds {
            sets.extend(self.pairs(&from.set, *kind, &from.noise.quieter())?);
        }
        Ok(self.best_of(sets, from))
    }

    /// A set with the likeliest pairs of effects that reach a sensor.
    fn pairs(
        &self,
        set: &[&'static Effect],
        kind: SensorKind,
        noise: &Noise,
    ) -> Result<Vec<Reaching>, DiagnosisError> {
        let (_, ranked) = self.ranked(set, noise)?;
        let likely = ranked.into_iter().map(|(_, effect)| effect).filter(|effect| self.reaches(effect, kind));
        let likely: Set = likely.take(self.settings().paired).collect();
        let pairs: Vec<[&'static Effect; 2]> = (0..likely.len())
            .flat_map(|i| (0..i).map(move |j| (j, i)))
            .map(|(i, j)| [likely[i], likely[j]])
            .filter(|[one, other]| class(&one.id) != class(&other.id))
            .collect();
        let (_, values) = self.values(set, &pairs, noise)?;
        let mut valued: Vec<(f64, [&'static Effect; 2])> = values.into_iter().zip(pairs).collect();
        valued.sort_by(|a, b| b.0.total_cmp(&a.0));
        let with = |(_, pair): (f64, [&'static Effect; 2])| {
            let reach = either(self.scene.reach(pair[0]), self.scene.reach(pair[1]));
            (set.iter().copied().chain(pair).collect(), reach)
        };
        Ok(valued.into_iter().take(self.settings().screened_quiet).map(with).collect())
    }

    /// The best set with one effect replaced or taken out.
    pub fn changed(&self, from: &Scored) -> Result<Option<Scored>, DiagnosisError> {
        let mut sets = Vec::new();
        for at in 0..from.set.len() {
            let (fewer, taken) = without(&from.set, at);
            let other = |effect: &'static Effect| effect != taken;
            // Alone, it was chosen among all others.
            if !fewer.is_empty() {
                sets.extend(self.replaced(&fewer, taken.sensors, &other, &from.noise)?);
            }
            sets.push((fewer, taken.sensors.to_vec()));
        }
        if self.settings().removes_pairs {
            sets.extend(self.without_pairs(&from.set));
        }
        Ok(self.best_of(sets, from))
    }

    /// The best set with one effect replaced by another of its class.
    pub fn exchanged_in_class(&self, from: &Scored) -> Result<Option<Scored>, DiagnosisError> {
        let mut sets = Vec::new();
        for at in 0..from.set.len() {
            let (fewer, taken) = without(&from.set, at);
            let fellow = |effect: &'static Effect| effect != taken && class(&effect.id) == class(&taken.id);
            sets.extend(self.replaced(&fewer, taken.sensors, &fellow, &from.noise)?);
        }
        Ok(self.best_of(sets, from))
    }

    /// Sets with two effects fewer.
    fn without_pairs(&self, set: &[&'static Effect]) -> Vec<Reaching> {
        let pairs = (0..set.len()).flat_map(|i| (0..i).map(move |j| (j, i)));
        let fewer = |(i, j): (usize, usize)| {
            let kept = set.iter().enumerate().filter(|(at, _)| *at != i && *at != j);
            let reach = either(self.scene.reach(set[i]), self.scene.reach(set[j]));
            (kept.map(|(_, effect)| *effect).collect(), reach)
        };
        pairs.map(fewer).collect()
    }

    /// The best set with one effect replaced by another, or all those of a sensor by one or two, in the shapes that are
    /// best where the first ones are not: together they may be what two others do. With the problem of these shapes.
    pub fn changed_with_new_shapes(
        &self,
        fit: &Fit,
        from: &Scored,
    ) -> Result<Option<(Self, Scored)>, DiagnosisError> {
        let mut best: Option<(Self, Scored)> = None;
        let mut better = |linear: Self, sets: Vec<Reaching>| {
            let found = linear.best_of(sets, from);
            if let Some(found) = found
                && best.as_ref().is_none_or(|(_, most)| found.log_evidence > most.log_evidence)
            {
                best = Some((linear, found));
            }
        };
        for at in 0..from.set.len() {
            let (fewer, taken) = without(&from.set, at);
            // Alone, it was chosen among all others.
            if fewer.is_empty() {
                continue;
            }
            let Some(linear) = self.reshaped(fit, &from.noise, &[taken]) else { continue };
            let moved = |effect: &'static Effect| linear.shape_of(effect) != self.shape_of(effect);
            let sets = linear.replaced(&fewer, self.scene.reach(taken), &moved, &from.noise)?;
            better(linear, sets);
        }
        for kind in &self.scene.kinds {
            let (taken, others): (Set, Set) = from.set.iter().partition(|effect| self.reaches(effect, *kind));
            // A step that was placed in a drift which held the half of it is placed again where little drifts.
            if (taken.len() > 1 || taken.iter().any(|effect| effect.is_shaped()))
                && let Some(linear) = self.reshaped(fit, &from.noise.quieter(), &taken)
            {
                let quiet = from.noise.quieter();
                let mut sets = linear.pairs(&others, *kind, &quiet)?;
                sets.extend(linear.replaced(&others, &[*kind], &|_| true, &quiet)?);
                better(linear, sets);
            }
        }
        Ok(best)
    }

    /// Sets with one effect more, of `among`, that take the place of what reached some sensors.
    fn replaced(
        &self,
        fewer: &Set,
        reach: &[SensorKind],
        among: &dyn Fn(&'static Effect) -> bool,
        noise: &Noise,
    ) -> Result<Vec<Reaching>, DiagnosisError> {
        let (_, ranked) = self.ranked(fewer, noise)?;
        let others = ranked.into_iter().map(|(_, effect)| effect).filter(|effect| among(effect));
        let with = |effect: &'static Effect| {
            let set = fewer.iter().copied().chain([effect]).collect();
            (set, either(reach, self.scene.reach(effect)))
        };
        Ok(others.take(self.settings().replaced).map(with).collect())
    }

    /// The best of some sets that may do better than another, with the noise of its sensors estimated again for each.
    fn best_of(&self, sets: Vec<Reaching>, from: &Scored) -> Option<Scored> {
        let sift = |(set, reached): &Reaching| self.screen(set, &from.noise, reached, &NEAR);
        let sifted: Vec<Result<Screened, _>> = sets.par_iter().map(sift).collect();
        let is_near = |sifted: &Screened| sifted.value > from.sifted - self.settings().behind;
        let mut sifted: Vec<Screened> = sifted.into_iter().flatten().filter(is_near).collect();
        sifted.sort_by(|a, b| b.value.total_cmp(&a.value));
        sifted.truncate(self.settings().scored);
        let offsets = self.offsets(&from.noise);
        let together = |sifted| self.scored_jointly(sifted, &offsets);
        let judged: Vec<Result<Scored, _>> = sifted.into_par_iter().map(together).collect();
        judged.into_iter().flatten().max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence))
    }

    fn settings(&self) -> &SearchSettings {
        &self.scene.settings.search
    }

    fn reaches(&self, effect: &Effect, kind: SensorKind) -> bool {
        self.scene.reach(effect).contains(&kind)
    }
}

fn is_among(set: &[&'static Effect], effect: &Effect) -> bool {
    set.contains(&effect)
}

/// A set without one of its effects, and that effect.
fn without(set: &[&'static Effect], at: usize) -> (Set, &'static Effect) {
    let mut fewer = set.to_vec();
    let taken = fewer.remove(at);
    (fewer, taken)
}

fn either(one: &[SensorKind], other: &[SensorKind]) -> Vec<SensorKind> {
    SensorKind::ALL.into_iter().filter(|kind| one.contains(kind) || other.contains(kind)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect;

    #[test]
    fn a_set_without_one_of_its_effects_keeps_the_others_in_order() {
        let set: Set = effect::CATALOGUE.iter().take(3).collect();
        let (fewer, taken) = without(&set, 1);
        assert!(fewer == [set[0], set[2]] && taken == set[1]);
        assert!(is_among(&set, taken) && !is_among(&fewer, taken));
    }

    #[test]
    fn two_reaches_together_name_each_sensor_once() {
        use SensorKind::{Acc, Gyr, Mag};
        assert_eq!(either(&[Mag, Acc], &[Acc]), [Acc, Mag]);
        assert_eq!(either(&[], &[Gyr]), [Gyr]);
    }
}
