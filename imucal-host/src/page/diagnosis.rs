//! A diagnosis: the answer, from the gap to the noise, the causes, and what to record next.

use maud::{Markup, html};

use super::{Answer, Part, Tone, channels::channels, profile::profile, sentences, waterfall::waterfall};
use crate::{
    diagnosis::{
        Diagnosis, Verdict,
        finding::{Cause, ProposalStatus},
    },
    recording::manifest::ReferenceKind,
    report::diagnosis::{
        absent_words, amount, cause_and_remedy, certainty,
        change::{changes, remainder},
        closing, equivalents, experiment_words, not_testable_words, p_value, place_words, sentence,
        share_words,
    },
};

/// What a page says of a diagnosis.
#[must_use]
pub fn diagnosis(diagnosis: &Diagnosis) -> Part {
    let tone = match diagnosis.verdict {
        Verdict::Explained | Verdict::None => Tone::Good,
        Verdict::Ambiguous | Verdict::Partly => Tone::Doubt,
        Verdict::Unknown | Verdict::NotTestable => Tone::Bad,
    };
    // The first remark is the sentence itself where there is no answer.
    let said = usize::from(diagnosis.verdict == Verdict::NotTestable);
    let remarks: Vec<&String> =
        diagnosis.remarks.iter().skip(said).filter(|remark| !remark.is_empty()).collect();
    let absent: Vec<String> = diagnosis.absent.iter().map(absent_words).collect();
    let next: Vec<String> = diagnosis.next_experiment.iter().map(experiment_words).collect();
    let body = html! {
        h2 { "Sim-to-real gap" }
        (to_change(diagnosis))
        div class="figures" {
            (waterfall(diagnosis))
            (channels(&diagnosis.gap))
            @for one in &diagnosis.profiles { (profile(one)) }
        }
        (sentences("Notes", &remarks))
        (followed(diagnosis))
        @for cause in &diagnosis.causes { (of_cause(diagnosis, cause)) }
        (proposals(diagnosis))
        (sentences("What to record next", &next))
        (sentences("Absent: each would have been detected at this size or larger", &absent))
        (sentences("Not testable with this recording", &not_testable_words(&diagnosis.not_testable)))
        (sentences("Warnings", &diagnosis.warnings))
    };
    Part { answer: Answer { tone, words: sentence(diagnosis) }, body }
}

/// What to change in a simulator, where the recording was compared with one.
fn to_change(diagnosis: &Diagnosis) -> Markup {
    let is_followed = matches!(diagnosis.reference, Some(ReferenceKind::Simulator | ReferenceKind::Pose));
    if !is_followed || diagnosis.causes.is_empty() {
        return html! {};
    }
    let (own, of_reference) = changes(diagnosis);
    html! {
        h3 { "What to change in the simulator, what closes most of the gap first" }
        ol { @for words in &own { li { (words) "." } } }
        @if !of_reference.is_empty() { ul { @for words in &of_reference { li { (words) "." } } } }
        p { "What remains: " (remainder(diagnosis)) "." }
    }
}

/// Drivers that the gap follows.
fn followed(diagnosis: &Diagnosis) -> Markup {
    /// Rows that are shown; the JSON has all.
    const PLACES: usize = 8;
    html! {
        @if !diagnosis.places.is_empty() {
            h3 { "What the gap follows (shares overlap)" }
            div class="wide" { table {
                thead { tr { th { "driver" } th { "share" } th { "p-value" } } }
                tbody {
                    @for place in diagnosis.places.iter().take(PLACES) {
                        tr {
                            td { (place_words(place)) }
                            td { (format!("{:.0} %", 100.0 * place.share)) }
                            td { (p_value(place.p_value)) }
                        }
                    }
                }
            } }
        }
    }
}

fn of_cause(diagnosis: &Diagnosis, cause: &Cause) -> Markup {
    let certain = if cause.probability.is_finite() { certainty(cause.probability) } else { "–".to_owned() };
    let others = equivalents(cause);
    html! {
        h3 { "Cause: " (cause.effect) }
        p { "Probability " (certain) "; " (closing(cause)) "." }
        @if !cause.parameters.is_empty() { ul { @for parameter in &cause.parameters { li { (amount(parameter)) } } } }
        @if let Some((what, remedy)) = cause_and_remedy(diagnosis, cause) {
            p { (what) }
            p { "To do: " (remedy) }
        }
        @if !others.is_empty() { p { "This recording cannot distinguish it from:" } ul { @for other in &others { li { (other) } } } }
    }
}

fn proposals(diagnosis: &Diagnosis) -> Markup {
    html! {
        @for proposal in &diagnosis.proposals {
            h3 {
                @match proposal.status {
                    ProposalStatus::Proposed => "Proposed formula, not in the catalogue",
                    ProposalStatus::Confirmed => "Formula of another recording, confirmed",
                    ProposalStatus::Refuted => "Formula of another recording, refuted",
                }
            }
            p { (proposal.sensor) " " (proposal.axes.join(", ")) " += " code { (proposal.formula) } }
            p { "Closes " (share_words(proposal.gap_closed, proposal.gap_closed_ci95)) " of what is left of the sensor's gap." }
            ul { @for parameter in &proposal.parameters { li { (amount(parameter)) } } }
            @if !proposal.equivalents.is_empty() { p { "Or else: " (proposal.equivalents.join("; ")) } }
        }
    }
}
