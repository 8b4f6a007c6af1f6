//! Groups of terms, three axes each, that are kept or left out together.

/// A group of terms, in the order of their entries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// β: the bias, linear.
    Bias,
    /// s: the scale, linear.
    Scale,
    /// β₂: the bias, quadratic.
    BiasQuadratic,
    /// s₂: the scale, quadratic.
    ScaleQuadratic,
}

impl Group {
    /// All, in the order in which they are tried.
    pub const ALL: [Self; 4] = [Self::Bias, Self::Scale, Self::BiasQuadratic, Self::ScaleQuadratic];

    /// Its fixed name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bias => "bias",
            Self::Scale => "scale",
            Self::BiasQuadratic => "bias-quadratic",
            Self::ScaleQuadratic => "scale-quadratic",
        }
    }

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Bias => "bias, linear",
            Self::Scale => "scale, linear",
            Self::BiasQuadratic => "bias, quadratic",
            Self::ScaleQuadratic => "scale, quadratic",
        }
    }

    /// The group itself, and the linear one that a quadratic one stands on.
    pub fn with_lower(self) -> Groups {
        match self {
            Self::BiasQuadratic => Groups::NONE.with(Self::Bias).with(self),
            Self::ScaleQuadratic => Groups::NONE.with(Self::Scale).with(self),
            _ => Groups::NONE.with(self),
        }
    }
}

/// Some groups.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Groups(u8);

impl Groups {
    /// None of them.
    pub const NONE: Self = Self(0);

    /// These and one more.
    #[must_use]
    pub fn with(self, group: Group) -> Self {
        Self(self.0 | 1 << group as u8)
    }

    /// These and those.
    #[must_use]
    pub fn and(self, others: Self) -> Self {
        Self(self.0 | others.0)
    }

    /// Whether a group is among them.
    pub fn has(self, group: Group) -> bool {
        self.0 & 1 << group as u8 != 0
    }

    /// Whether all of those are among them.
    pub fn contains(self, others: Self) -> bool {
        self.0 & others.0 == others.0
    }

    /// Those of these that are not among others.
    #[must_use]
    pub fn without(self, others: Self) -> Self {
        Self(self.0 & !others.0)
    }

    /// Whether there are none.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// How many.
    pub fn count(self) -> usize {
        self.0.count_ones() as usize
    }
}
