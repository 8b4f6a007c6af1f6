//! Names that nothing has, with the nearest one that there is.

use crate::recording::manifest::spelling::nearest;

/// Edits within which a misspelt name is taken for a known one, and the share of its length that they may be.
const NEAR: usize = 8;
const OF_ITS_LENGTH: (usize, usize) = (3, 4);

/// A name that no effect, unit or other thing of a list has; its text says the nearest name, or all there are.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no {what} `{found}`; {advice}")]
pub struct UnknownName {
    /// What it was taken for, in words.
    pub what: &'static str,
    /// The name.
    pub found: String,
    /// The name that is probably meant, or all names.
    pub advice: String,
}

impl UnknownName {
    /// A name that is not among these.
    pub fn of<'a>(what: &'static str, found: &str, names: impl IntoIterator<Item = &'a str> + Clone) -> Self {
        let (share, of) = OF_ITS_LENGTH;
        let limit = NEAR.min(found.chars().count() * share / of);
        let advice = match nearest(found, names.clone(), limit) {
            Some(name) => format!("did you mean `{name}`?"),
            None => format!("expected one of {}", names.into_iter().collect::<Vec<_>>().join(", ")),
        };
        Self { what, found: found.to_owned(), advice }
    }
}
