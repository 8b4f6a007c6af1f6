//! Which other effects could stand in a cause's place.

use rayon::prelude::*;

use crate::{
    diagnosis::{
        error::DiagnosisError,
        mixed_model::noise::NEAR,
        search::{hypothesis::Scored, linearisation::Linearisation},
    },
    effect::Effect,
};

/// Alternatives further below in ln of probability are not judged.
const FAR: f64 = 25.0;
/// Likewise, where each has a noise of its own.
const BEHIND: f64 = 10.0;

/// A cause among those that could stand in its place.
#[derive(Clone, Debug)]
pub struct Standing {
    /// Its probability, among all that could stand in its place and nothing at all.
    pub probability: f64,
    /// The others of the credible set, likeliest first.
    pub equivalents: Vec<&'static Effect>,
    /// The set, likeliest first, the cause among them.
    pub set: Vec<&'static Effect>,
}

/// Effects that were not asserted where nothing was, and cannot be excluded: compared with none at all, each has more than what a
/// credible set leaves out. Likeliest first.
pub fn suspects(linear: &Linearisation<'_>, none: &Scored) -> Result<Vec<&'static Effect>, DiagnosisError> {
    let (own, ranked) = linear.ranked(&none.set, &none.noise)?;
    let odds = |value: f64| (value - own).exp();
    let likely = ranked
        .into_iter()
        .take_while(|(value, _)| odds(*value) > 1.0 - linear.scene.settings.verdict.credible);
    Ok(likely.flat_map(|(_, effect)| alike(linear, effect)).collect())
}

/// An effect and those it stands for.
fn alike(linear: &Linearisation<'_>, effect: &'static Effect) -> impl Iterator<Item = &'static Effect> {
    std::iter::once(effect).chain(linear.candidates.same_as(effect))
}

/// The standing of one cause of a set.
pub fn standing(
    linear: &Linearisation<'_>,
    best: &Scored,
    cause: &'static Effect,
) -> Result<Standing, DiagnosisError> {
    let rest: Vec<&'static Effect> = best.set.iter().copied().filter(|effect| *effect != cause).collect();
    let (_, ranked) = linear.ranked(&rest, &best.noise)?;
    let own = ranked.iter().find(|(_, effect)| *effect == cause);
    let own = own.ok_or(DiagnosisError::Alternatives { effect: &cause.id })?.0;
    let standard = linear.screen(&best.set, &best.noise, &[], &NEAR)?;
    let none = linear.judge(&rest, &best.noise, linear.scene.reach(cause), &NEAR)?;
    let mut judged: Vec<(f64, Option<&'static Effect>)> =
        vec![(best.log_evidence, Some(cause)), (none.log_evidence, None)];
    let others = ranked.iter().filter(|(value, effect)| *effect != cause && *value > own - FAR);
    let others: Vec<&'static Effect> =
        others.take(linear.scene.settings.verdict.alternatives).map(|(_, effect)| *effect).collect();
    let offsets = linear.offsets(&best.noise);
    let instead = |effect: &&'static Effect| {
        let set: Vec<&'static Effect> = rest.iter().copied().chain([*effect]).collect();
        let reached: Vec<_> =
            linear.scene.reach(cause).iter().chain(linear.scene.reach(effect)).copied().collect();
        let sifted = linear.screen(&set, &best.noise, &reached, &NEAR).ok();
        // What falls behind axis by axis is not judged any further.
        let sifted = sifted.filter(|sifted| sifted.value > standard.value - BEHIND)?;
        Some((linear.scored_jointly(sifted, &offsets).ok()?.log_evidence, Some(*effect)))
    };
    let instead: Vec<Option<_>> = others.par_iter().map(instead).collect();
    judged.extend(instead.into_iter().flatten());
    judged.sort_by(|a, b| b.0.total_cmp(&a.0));
    let most = judged[0].0;
    let count =
        |effect: &Option<&'static Effect>| effect.map_or(1, |effect| alike(linear, effect).count()) as f64;
    let total: f64 = judged.iter().map(|(value, effect)| count(effect) * (value - most).exp()).sum();
    let probability = |value: f64| (value - most).exp() / total;
    let mut set = Vec::new();
    let mut held = 0.0;
    for (value, effect) in &judged {
        if held < linear.scene.settings.verdict.credible {
            set.extend(effect.iter().flat_map(|effect| alike(linear, effect)));
        }
        held += count(effect) * probability(*value);
    }
    if !set.contains(&cause) {
        set.extend(alike(linear, cause));
    }
    Ok(Standing {
        probability: probability(best.log_evidence),
        equivalents: set.iter().copied().filter(|effect| *effect != cause).collect(),
        set,
    })
}
