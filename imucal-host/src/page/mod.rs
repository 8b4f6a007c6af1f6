//! Pages: one self-contained HTML file a result, with drawings of its own, for a browser or as a certificate on paper.
//!
//! | goes in | comes out |
//! | --- | --- |
//! | a calibration, a diagnosis, a unit's noise, a comparison; what [`batch`](crate::batch::page) makes of many | a page: the answer in a sentence, figures, drawings |
//!
//! | file | what |
//! | --- | --- |
//! | [`provenance`] | what was read, by which version, when, and its hash |
//! | [`scale`], [`plot`], [`dot_rows`] | values along an axis with ticks; a frame with marks in it; named rows of dots |
//! | [`sphere`], [`residuals`], [`segmentation`] | drawings of a calibration |
//! | [`waterfall`], [`channels`], [`profile`] | drawings of a diagnosis |
//! | [`deviations`], [`drift`] | Allan deviations; parameters that have moved |
//! | [`calibration`], [`diagnosis`], [`noise`], [`comparison`] | the sections of a page |
//!
//! A page has no script and loads nothing. It follows the reader's choice of a light or a dark screen, and prints on A4.

use std::{io, path::Path};

use imucal_core::record::Date;
use maud::{DOCTYPE, Markup, PreEscaped, html};

pub mod calibration;
pub mod channels;
pub mod comparison;
pub mod deviations;
pub mod diagnosis;
pub mod dot_rows;
pub mod drift;
pub mod noise;
pub mod plot;
pub mod profile;
pub mod provenance;
pub mod residuals;
pub mod scale;
pub mod segmentation;
pub mod sphere;
pub mod waterfall;

pub use provenance::Provenance;

use crate::{recording::Recording, store::noise_file::NoiseFile};

const STYLE: &str = include_str!("style.css");

/// How good the news is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Tone {
    /// As wished.
    Good,
    /// Only in part, or with a doubt.
    Doubt,
    /// Refused.
    Bad,
}

/// A sentence that answers the question.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    /// How good it is.
    pub tone: Tone,
    /// The sentence.
    pub words: String,
}

/// What is said of one result: its answer, then all else.
pub struct Part {
    /// The answer.
    pub answer: Answer,
    /// Sections below it.
    pub body: Markup,
}

/// A whole document: the answers first, then where they come from, then each part.
#[must_use]
pub fn page(title: &str, provenance: &Provenance, parts: &[Part]) -> String {
    let document = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { (title) }
                @for part in parts { (answer(&part.answer)) }
                (provenance.facts())
                @for part in parts { (part.body) }
                footer { "imucal " (env!("CARGO_PKG_VERSION")) ". Errors are standard errors (k = 1) unless another factor is stated." }
            }
        }
    };
    document.into_string()
}

/// The page of a recording's result, made on a day, with the hash of the recording's file.
///
/// # Errors
///
/// What the system says of a file that cannot be read.
pub fn of_recording(recording: &Recording, made: Date, parts: &[Part]) -> io::Result<String> {
    let provenance = Provenance::new(made).with_file("recording", &recording.path)?;
    Ok(page(&recording.name, &provenance.with_recording(recording), parts))
}

/// The page of a unit's noise, estimated from a file on a day.
///
/// # Errors
///
/// As [`of_recording`].
pub fn of_noise(file: &NoiseFile, path: &Path, made: Date) -> io::Result<String> {
    let provenance = Provenance::new(made).with_file("recording", path)?;
    let provenance = provenance.with("unit", &file.name).with("serial number", &file.serial);
    Ok(page(&file.recording, &provenance, &[noise::noise(file)]))
}

fn answer(answer: &Answer) -> Markup {
    let class = match answer.tone {
        Tone::Good => "verdict",
        Tone::Doubt => "verdict doubt",
        Tone::Bad => "verdict bad",
    };
    html! { p class=(class) { (answer.words) } }
}

/// A drawing with its title and what it shows.
pub(crate) fn figure(title: &str, drawing: &Markup, caption: &Markup) -> Markup {
    html! { figure { (drawing) figcaption { b { (title) } (caption) } } }
}

/// Three keys for the axes of a triad.
fn axis_keys() -> Markup {
    html! { @for axis in ["x", "y", "z"] { span class={ "key " (axis) } { (axis) } } }
}

/// A list of sentences, where there are any.
fn sentences<S: AsRef<str>>(heading: &str, all: &[S]) -> Markup {
    html! {
        @if !all.is_empty() {
            h3 { (heading) }
            ul class=[(all.len() > 8).then_some("many")] { @for one in all { li { (one.as_ref()) } } }
        }
    }
}

#[cfg(test)]
mod tests;
