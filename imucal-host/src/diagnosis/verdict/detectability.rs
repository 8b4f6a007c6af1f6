//! Which effects would have been seen, and which this recording cannot show.

use crate::{
    diagnosis::{
        error::DiagnosisError,
        finding::{Absent, NotTestable},
        library::evidence::Projected,
        location::score_test::{RETAINED, score_test},
        mixed_model::noise::Noise,
        search::linearisation::Linearisation,
    },
    effect::Effect,
};

/// Effects that are absent at sizes that matter, and effects that cannot be tested, once baseline and `set` are fitted.
pub fn testable(
    linear: &Linearisation<'_>,
    set: &[&'static Effect],
    noise: &Noise,
) -> Result<(Vec<Absent>, Vec<NotTestable>), DiagnosisError> {
    let fitted = linear.fitted(set);
    let others: Vec<usize> = (0..linear.design.columns.len()).filter(|id| !fitted.contains(id)).collect();
    let projected = Projected::new(&linear.normal(noise), &fitted, &others)?;
    let seen = linear.scene.settings.verdict.detectable;
    let mut absent = Vec::new();
    let not_testable = |(effect, why): &(&'static Effect, String)| NotTestable {
        effect: effect.id.clone(),
        because: why.clone(),
    };
    let mut untestable: Vec<NotTestable> = linear.candidates.untestable.iter().map(not_testable).collect();
    for effect in &linear.candidates.effects {
        if set.contains(effect) {
            continue;
        }
        let places: Vec<usize> =
            (0..others.len()).filter(|at| linear.design.columns[others[*at]].is_of(effect)).collect();
        let parameter = |place: &usize| &effect.parameters[linear.design.columns[others[*place]].parameter];
        let detectable = |place: &usize| {
            let information = projected.information[(*place, *place)];
            let kept = information > RETAINED * projected.before[*place];
            if kept { (seen / information).sqrt() * parameter(place).prior_scale } else { f64::INFINITY }
        };
        let plausible = |place: &usize| detectable(place) < parameter(place).range.1;
        if !places.iter().any(plausible) {
            untestable.push(NotTestable {
                effect: effect.id.clone(),
                because: because(effect, &projected, &places),
            });
            continue;
        }
        let relative = |place: &usize| detectable(place) / parameter(place).material;
        let worst = places.iter().max_by(|a, b| relative(a).total_cmp(&relative(b)));
        let Some(worst) = worst else { continue };
        let (statistic, dimensions) = score_test(&projected, &places);
        if detectable(worst) < parameter(worst).material && statistic < dimensions as f64 + seen {
            absent.push(Absent {
                effect: effect.id.clone(),
                minimum_detectable: detectable(worst),
                unit: parameter(worst).unit.clone(),
            });
        }
    }
    for (held, other) in &linear.candidates.same {
        let of_absent = absent.iter().find(|absent| absent.effect == held.id).cloned();
        absent.extend(of_absent.map(|absent| Absent { effect: other.id.clone(), ..absent }));
        let of_untestable = untestable.iter().find(|not| not.effect == held.id).cloned();
        untestable.extend(of_untestable.map(|not| NotTestable { effect: other.id.clone(), ..not }));
    }
    Ok((absent, untestable))
}

fn because(effect: &Effect, projected: &Projected, places: &[usize]) -> String {
    if places.iter().all(|place| projected.before[*place] <= 0.0) {
        return format!("the recording holds nothing that it would change; it needs: {}", effect.words.needs);
    }
    let taken = places.iter().all(|p| projected.information[(*p, *p)] < RETAINED * projected.before[*p]);
    match effect.confusables.first() {
        Some(other) if taken && !other.parted_by.is_empty() => {
            format!("here the same as {}, which is fitted; distinguish by: {}", other.id, other.parted_by)
        }
        _ if taken => format!("what is fitted takes it up; it needs: {}", effect.words.needs),
        _ => format!("it would have to be implausibly large to be seen; it needs: {}", effect.words.needs),
    }
}
