//! A diagnosis for people: one page, the answer first.

use std::fmt::{self, Write};

use super::{
    measure::{measure, plain},
    prose::{hanging, listed},
    watch,
};
use crate::{
    diagnosis::{
        Diagnosis, Verdict,
        finding::{Absent, Amount, Cause, Experiment, Gap, NotTestable, Place, Proposal, ProposalStatus},
    },
    effect,
    recording::manifest::ReferenceKind,
};

pub(crate) mod change;

/// Drivers that are printed; the JSON has all.
const PLACES: usize = 6;

/// The whole page.
pub fn page(diagnosis: &Diagnosis) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write_page(&mut text, diagnosis);
    text
}

fn write_page(text: &mut String, diagnosis: &Diagnosis) -> fmt::Result {
    writeln!(text, "{}: {}", diagnosis.recording, verdict_name(diagnosis.verdict).to_uppercase())?;
    text.push_str(&hanging("", &sentence(diagnosis)));
    // The first remark is the sentence itself where there is no answer.
    let said = usize::from(diagnosis.verdict == Verdict::NotTestable);
    for remark in diagnosis.remarks.iter().skip(said).filter(|remark| !remark.is_empty()) {
        text.push_str(&hanging("note: ", remark));
    }
    match diagnosis.reference {
        Some(ReferenceKind::Simulator | ReferenceKind::Pose) => {
            change::write_changes(text, diagnosis)?;
            write_gap(text, &diagnosis.gap)?;
            change::write_remainder(text, diagnosis)?;
        }
        Some(ReferenceKind::Attitude) | None => write_gap(text, &diagnosis.gap)?,
    }
    write_places(text, &diagnosis.places)?;
    write_causes(text, diagnosis)?;
    write_proposals(text, &diagnosis.proposals)?;
    write_experiments(text, diagnosis)?;
    write_absent(text, diagnosis)?;
    write_not_testable(text, diagnosis)?;
    if let Some(watch) = &diagnosis.watch {
        write!(text, "\n{}", watch::watched(watch))?;
    }
    Ok(())
}

/// The contract's word for a verdict.
pub(crate) fn verdict_name(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Explained => "explained",
        Verdict::Ambiguous => "ambiguous",
        Verdict::Partly => "partly explained",
        Verdict::Unknown => "unknown",
        Verdict::None => "no gap",
        Verdict::NotTestable => "not testable",
    }
}

pub(crate) fn sentence(diagnosis: &Diagnosis) -> String {
    let names: Vec<&str> = diagnosis.causes.iter().map(|cause| cause.effect.as_str()).collect();
    let (causes, one) = (listed(&names), names.len() == 1);
    let closed = closed(diagnosis);
    let place =
        diagnosis.places.first().map(|place| format!(", most of it following {}", place_words(place)));
    match diagnosis.verdict {
        Verdict::Explained => format!("The gap is explained by {causes}{closed}."),
        Verdict::Ambiguous => format!(
            "The gap is explained{closed}, but this recording cannot distinguish {causes} from other effects that \
             explain it equally well."
        ),
        Verdict::Partly => format!(
            "{causes} {} the gap in part{closed}; what is left matters, and its cause is unknown.",
            if one { "explains" } else { "explain" }
        ),
        Verdict::Unknown => format!(
            "There is a gap{}, and no effect of the catalogue explains it.",
            place.unwrap_or_default()
        ),
        Verdict::None => "There is no gap beyond the noise of this recording.".to_owned(),
        Verdict::NotTestable => {
            let why = diagnosis.remarks.first().filter(|why| !why.is_empty());
            let why = why.map_or("the recording lacks what the question needs", String::as_str);
            format!("Nothing can be said: {why}.")
        }
    }
}

/// What all causes close, as the end of a clause.
fn closed(diagnosis: &Diagnosis) -> String {
    let Some(share) = diagnosis.gap_closed_total.filter(|share| share.is_finite()) else {
        return String::new();
    };
    let of = if diagnosis.held_out { ", on data that the fit has not seen" } else { "" };
    let [low, high] = diagnosis.gap_closed_total_ci95.unwrap_or([f64::NAN; 2]);
    format!(", closing {} of the gap beyond the noise{of}", share_words(share, [low, high]))
}

/// `97 % (95 to 98 %)`; without an interval, the share alone.
pub(crate) fn share_words(share: f64, [low, high]: [f64; 2]) -> String {
    let percent = |share: f64| 100.0 * share;
    match low.is_finite() && high.is_finite() {
        true => format!("{:.0} % ({:.0} to {:.0} %)", percent(share), percent(low), percent(high)),
        false => format!("{:.0} %", percent(share)),
    }
}

pub(crate) fn place_words(place: &Place) -> String {
    match place.detail.is_empty() {
        true => format!("{} of {}", place.driver, place.sensor),
        false => format!("{} of {} ({})", place.driver, place.sensor, place.detail),
    }
}

fn write_gap(text: &mut String, gap: &[Gap]) -> fmt::Result {
    if gap.is_empty() {
        return Ok(());
    }
    writeln!(
        text,
        "\n{:<30} {:>10} {:>10} {:>10}",
        "gap, rms of means over blocks", "before", "after", "noise"
    )?;
    for channel in gap {
        let name = format!("{} {}, {}", channel.sensor, channel.axis, channel.unit);
        let [before, after, floor] =
            [channel.rms_before, channel.rms_after, channel.noise_floor].map(|rms| finite(rms, plain));
        writeln!(text, "  {name:<28} {before:>10} {after:>10} {floor:>10}")?;
    }
    Ok(())
}

fn write_places(text: &mut String, places: &[Place]) -> fmt::Result {
    if places.is_empty() {
        return Ok(());
    }
    writeln!(text, "\n{:<62} {:>6} {:>8}", "what the gap follows (shares overlap)", "share", "p-value")?;
    for place in places.iter().take(PLACES) {
        let share = finite(place.share, |share| format!("{:.0} %", 100.0 * share));
        writeln!(text, "  {:<60} {share:>6} {:>8}", place_words(place), p_value(place.p_value))?;
    }
    Ok(())
}

fn write_causes(text: &mut String, diagnosis: &Diagnosis) -> fmt::Result {
    for (index, cause) in diagnosis.causes.iter().enumerate() {
        let heading =
            if diagnosis.causes.len() == 1 { "cause".to_owned() } else { format!("cause {}", index + 1) };
        writeln!(text, "\n{heading}: {}", cause.effect)?;
        let certain = finite(cause.probability, certainty);
        text.push_str(&hanging("  ", &format!("probability {certain}; {}", closing(cause))));
        let amounts: Vec<String> = cause.parameters.iter().map(amount).collect();
        text.push_str(&hanging("  how much:  ", &amounts.join("; ")));
        if let Some((what, remedy)) = cause_and_remedy(diagnosis, cause) {
            text.push_str(&hanging("  what:      ", what));
            text.push_str(&hanging("  to do:     ", remedy));
        }
        for other in equivalents(cause) {
            text.push_str(&hanging("  or else:   ", &other));
        }
    }
    let asserted = |id: &String| diagnosis.causes.iter().any(|cause| cause.effect == **id);
    let others: Vec<&str> =
        diagnosis.credible_set.iter().filter(|id| !asserted(id)).map(String::as_str).collect();
    if !others.is_empty() && !diagnosis.causes.is_empty() {
        text.push_str(&hanging("also credible, at 95 %: ", &others.join(", ")));
    }
    Ok(())
}

/// What a cause closes, and whether that matters.
pub(crate) fn closing(cause: &Cause) -> String {
    let share = match cause.gap_closed.filter(|share| share.is_finite()) {
        Some(share) => {
            let ends = cause.gap_closed_ci95.unwrap_or([f64::NAN; 2]);
            format!("closes {} of the gap", share_words(share, ends))
        }
        None => "was corrected or left out before the gap was measured".to_owned(),
    };
    let material = if cause.material { "" } else { "; too small to matter" };
    format!("{share}{material}")
}

/// What an effect is and what to do about it: of the catalogue, or of the user's file.
pub(crate) fn cause_and_remedy<'d>(diagnosis: &'d Diagnosis, cause: &Cause) -> Option<(&'d str, &'d str)> {
    let own = diagnosis.user_effects.iter().find(|own| own.effect == cause.effect);
    let words = effect::find(&cause.effect).map(|effect| (effect.words.cause, effect.words.remedy));
    words.or_else(|| own.map(|own| (&*own.cause, &*own.remedy)))
}

/// Effects that this recording cannot distinguish from a cause, and by what they could be.
pub(crate) fn equivalents(cause: &Cause) -> Vec<String> {
    let confusables = effect::find(&cause.effect).map(|effect| &*effect.confusables).unwrap_or_default();
    let one = |other: &String| {
        let known = confusables.iter().find(|confusable| confusable.id == *other);
        let distinguished =
            known.map_or(String::new(), |known| format!("; distinguish by: {}", known.parted_by));
        format!("{other}{distinguished}")
    };
    cause.equivalents.iter().map(one).collect()
}

/// A shorter time than this is given in milliseconds, s.
const SHORT: f64 = 0.1;

/// `x 1.90 ± 0.02 uT`.
pub(crate) fn amount(amount: &Amount) -> String {
    let is_short =
        amount.unit == "s" && amount.value.is_some_and(|value| value != 0.0 && value.abs() < SHORT);
    let (scale, unit) = if is_short { (1e3, "ms") } else { (1.0, amount.unit.as_str()) };
    let unit = if unit == "-" { String::new() } else { format!(" {unit}") };
    let scaled = |value: f64| scale * value;
    let value = match (amount.value.map(scaled), amount.std_error.map(scaled)) {
        (None, _) => return format!("{} open", amount.name),
        (Some(value), Some(std)) if std.is_finite() && std > 0.0 => measure(value, std),
        (Some(value), _) => plain(value),
    };
    format!("{} {value}{unit}", amount.name)
}

fn write_proposals(text: &mut String, proposals: &[Proposal]) -> fmt::Result {
    for proposal in proposals {
        let heading = match proposal.status {
            ProposalStatus::Proposed => "proposed formula, not in the catalogue",
            ProposalStatus::Confirmed => "formula of another recording, confirmed",
            ProposalStatus::Refuted => "formula of another recording, refuted",
        };
        writeln!(text, "\n{heading}: {} {}", proposal.sensor, proposal.axes.join(", "))?;
        text.push_str(&hanging("  adds:      ", &proposal.formula));
        let share = share_words(proposal.gap_closed, proposal.gap_closed_ci95);
        let closes =
            format!("closes {share} of what is left of the sensor's gap; log odds {:.0}", proposal.log_odds);
        text.push_str(&hanging("  ", &closes));
        let amounts: Vec<String> = proposal.parameters.iter().map(amount).collect();
        text.push_str(&hanging("  how much:  ", &amounts.join("; ")));
        for other in &proposal.equivalents {
            text.push_str(&hanging("  or else:   ", other));
        }
        let next = match proposal.status {
            ProposalStatus::Proposed => {
                "write it with --proposals FILE, and confirm it on a second recording with --effects FILE --frozen"
            }
            ProposalStatus::Confirmed => {
                "keep it among your own effects: diagnose and simulate take the file"
            }
            ProposalStatus::Refuted => "it does not hold here as it was found: look for another cause",
        };
        text.push_str(&hanging("  to do:     ", next));
    }
    Ok(())
}

fn write_experiments(text: &mut String, diagnosis: &Diagnosis) -> fmt::Result {
    if diagnosis.next_experiment.is_empty() {
        return Ok(());
    }
    writeln!(text, "\nwhat to record next")?;
    for experiment in &diagnosis.next_experiment {
        text.push_str(&hanging("  - ", &experiment_words(experiment)));
    }
    Ok(())
}

pub(crate) fn experiment_words(experiment: &Experiment) -> String {
    let names: Vec<&str> = experiment.separates.iter().map(String::as_str).collect();
    let [from, to] = [experiment.distinguishability_from, experiment.to].map(|d| finite(d.sqrt(), plain));
    format!(
        "{}: separates {} by {to} standard deviations of the noise instead of {from}",
        experiment.instruction,
        listed(&names)
    )
}

fn write_absent(text: &mut String, diagnosis: &Diagnosis) -> fmt::Result {
    if diagnosis.absent.is_empty() {
        return Ok(());
    }
    writeln!(text, "\nabsent: each would have been detected at this size or larger")?;
    let all: Vec<String> = diagnosis.absent.iter().map(absent_words).collect();
    text.push_str(&hanging("  ", &all.join("; ")));
    Ok(())
}

/// An effect and the size from which it would have been seen.
pub(crate) fn absent_words(absent: &Absent) -> String {
    let size = finite(absent.minimum_detectable, |size| format!("{size:.1e}"));
    let unit = if absent.unit == "-" { "" } else { absent.unit.as_str() };
    format!("{} {size} {unit}", absent.effect).trim_end().to_owned()
}

fn write_not_testable(text: &mut String, diagnosis: &Diagnosis) -> fmt::Result {
    if diagnosis.not_testable.is_empty() {
        return Ok(());
    }
    writeln!(text, "\nnot testable with this recording")?;
    for words in not_testable_words(&diagnosis.not_testable) {
        text.push_str(&hanging("  ", &words));
    }
    Ok(())
}

/// Effects that a recording cannot show; those with one reason stand together.
pub(crate) fn not_testable_words(all: &[NotTestable]) -> Vec<String> {
    let mut reasons: Vec<(&str, Vec<&str>)> = Vec::new();
    for effect in all {
        match reasons.iter_mut().find(|(because, _)| *because == effect.because) {
            Some((_, effects)) => effects.push(&effect.effect),
            None => reasons.push((&effect.because, vec![&effect.effect])),
        }
    }
    reasons.into_iter().map(|(because, effects)| format!("{}: {because}", effects.join(", "))).collect()
}

/// A probability in percent that does not round to certainty.
pub(crate) fn certainty(probability: f64) -> String {
    if probability > 0.9995 { "> 99.9 %".to_owned() } else { format!("{:.1} %", 100.0 * probability) }
}

/// A p-value.
pub(crate) fn p_value(value: f64) -> String {
    match value {
        p if !p.is_finite() => "unknown".to_owned(),
        p if p < 1e-99 => "<1e-99".to_owned(),
        p => format!("{p:.0e}"),
    }
}

/// A figure, or a dash where there is none.
fn finite(value: f64, words: impl Fn(f64) -> String) -> String {
    if value.is_finite() { words(value) } else { "–".to_owned() }
}

#[cfg(test)]
mod tests;
