//! What an effect is, for people, and what it is mistaken for.

/// Another effect that looks alike.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Confusable {
    /// Its id.
    pub id: String,
    /// The experiment that parts the two.
    pub parted_by: &'static str,
}

/// What an effect is, in words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Words {
    /// What causes it.
    pub cause: &'static str,
    /// What to do about it.
    pub remedy: &'static str,
    /// What a recording must hold to show it.
    pub needs: &'static str,
}
