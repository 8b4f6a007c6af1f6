//! A user's own effects, from a TOML file: a formula of the ideal chain, added to a sensor's output.
//!
//! | file | what |
//! | --- | --- |
//! | `entry` | one entry of the file, checked and made an [`Effect`] |
//! | `formula` | amplitudes times formulas, added to a run |
//! | `expression` | a formula as a tree, evaluated column by column |
//! | `parser` | from text to tree, within limits |
//! | `quantity` | the inputs a formula may have |
//! | `function`, `history` | functions; `lag` and `mean` |
//! | `fault` | what is wrong with a file or a formula |
//!
//! The parser is our own: the crate `exmex` reads −x² as (−x)², no `1e-3`, and no `min(a, max(b, c))`.

use std::{
    path::Path,
    sync::{Mutex, PoisonError},
};

use serde::Deserialize;
use toml::Spanned;

use self::entry::Entry;
pub(crate) use self::history::History;
pub use self::{
    entry::Fitted,
    fault::{EntryFault, FormulaFault, UserEffectError},
    formula::{Formula, NotFinite},
};
use super::{CATALOGUE, Effect, NUISANCES, UnknownName};
use crate::file::Limits;

mod entry;
mod expression;
mod fault;
mod formula;
mod function;
mod history;
mod parser;
mod quantity;

/// Most effects of a file.
const MOST: usize = 200;

/// The file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    effect: Vec<Spanned<Entry>>,
}

/// The effects of a file, in its order, each once.
///
/// # Errors
///
/// [`UserEffectError`] names the line, what was found, what was expected, and what to do.
pub fn read(path: &Path, limits: &Limits) -> Result<Vec<&'static Effect>, UserEffectError> {
    let bytes = limits.read_small(path).map_err(|fault| UserEffectError::of(path.to_owned(), fault))?;
    let text = String::from_utf8(bytes).map_err(|cause| UserEffectError::NotUtf8 {
        path: path.to_owned(),
        line: line_at(cause.as_bytes(), cause.utf8_error().valid_up_to()),
    })?;
    parse(&text, path)
}

/// Those of a file's text; `path` is for messages only.
///
/// # Errors
///
/// As [`read`], but for the system's.
pub fn parse(text: &str, path: &Path) -> Result<Vec<&'static Effect>, UserEffectError> {
    let file: File = toml::from_str(text).map_err(|error| UserEffectError::Syntax {
        path: path.to_owned(),
        line: line_at(text.as_bytes(), error.span().map_or(0, |span| span.start)),
        found: error.message().trim().replace('\n', ", "),
    })?;
    if file.effect.is_empty() || file.effect.len() > MOST {
        return Err(UserEffectError::Count { path: path.to_owned(), found: file.effect.len(), most: MOST });
    }
    let mut read: Vec<(usize, &'static Effect)> = Vec::new();
    for spanned in &file.effect {
        let (line, entry) = (line_at(text.as_bytes(), spanned.span().start), spanned.get_ref());
        let failed = |cause: EntryFault| UserEffectError::Entry {
            path: path.to_owned(),
            line,
            id: entry.id.chars().take(60).flat_map(char::escape_default).collect(),
            cause: Box::new(cause),
        };
        let is_known = |id: &String| {
            let own = file.effect.iter().any(|other| other.get_ref().id == *id);
            own || CATALOGUE.iter().chain(NUISANCES.iter()).any(|effect| effect.id == *id)
        };
        if let Some(id) = entry.like().iter().find(|id| !is_known(id)) {
            return Err(failed(entry::wrong("like", id, "ids of the catalogue or of this file")));
        }
        let effect = interned(entry).map_err(failed)?;
        match read.iter().find(|(_, other)| other.id == effect.id) {
            Some((_, other)) if std::ptr::eq(*other, effect) => {}
            Some((line, _)) => return Err(failed(EntryFault::Twice { line: *line })),
            None => read.push((line, effect)),
        }
    }
    Ok(read.into_iter().map(|(_, effect)| effect).collect())
}

/// The effect of an id among the catalogue's and these.
pub fn find_among(id: &str, own: &[&'static Effect]) -> Option<&'static Effect> {
    super::find(id).or_else(|| own.iter().copied().find(|effect| effect.id == id))
}

/// The effect of an id of the catalogue or of the user's own; `what` names it in a message.
///
/// # Errors
///
/// [`UnknownName`], with the nearest id.
pub fn named(what: &'static str, id: &str, own: &[&'static Effect]) -> Result<&'static Effect, UnknownName> {
    let ids = CATALOGUE.iter().chain(own.iter().copied()).map(|effect| effect.id.as_str());
    find_among(id, own).ok_or_else(|| UnknownName::of(what, id, ids))
}

/// Ids of effects, or of terms of a baseline, that are all known.
///
/// # Errors
///
/// [`UnknownName`] of the first that is not.
pub fn known(ids: &[String], own: &[&'static Effect]) -> Result<Vec<String>, UnknownName> {
    ids.iter().map(|id| named("effect or term", id, own).map(|effect| effect.id.clone())).collect()
}

/// The effect of an entry; equal entries have one effect, which lives as long as the process.
fn interned(entry: &Entry) -> Result<&'static Effect, EntryFault> {
    static KNOWN: Mutex<Vec<(String, &'static Effect)>> = Mutex::new(Vec::new());
    let content = format!("{entry:?}");
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, effect)) = known.iter().find(|(own, _)| *own == content) {
        return Ok(effect);
    }
    let effect: &'static Effect = Box::leak(Box::new(entry.effect()?));
    known.push((content, effect));
    Ok(effect)
}

/// The line of a byte, counted from one.
fn line_at(text: &[u8], byte: usize) -> usize {
    1 + text.iter().take(byte).filter(|byte| **byte == b'\n').count()
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod twins;
