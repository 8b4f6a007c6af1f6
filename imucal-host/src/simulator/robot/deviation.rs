//! How a robot's body departs from the plan at an instant.

use super::jet::Jet;

/// A departure; [`Deviation::NONE`] changes not a bit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Factor of the gait, of the ground's unevenness, or of gusts.
    pub amplitude: Jet,
    /// Their phase, rad.
    pub phase: Jet,
    /// Factor of impacts and bumps.
    pub contact: Jet,
    /// Of the position, north, east and down, m.
    pub shift: [Jet; 3],
    /// Of yaw, pitch and roll, rad.
    pub turn: [Jet; 3],
}

impl Deviation {
    /// None.
    pub const NONE: Self = Self {
        amplitude: Jet::constant(1.0),
        phase: Jet::constant(0.0),
        contact: Jet::constant(1.0),
        shift: [Jet::constant(0.0); 3],
        turn: [Jet::constant(0.0); 3],
    };
}

/// Adds three quantities to three.
pub(super) fn plus(of: [Jet; 3], other: [Jet; 3]) -> [Jet; 3] {
    let ([a, b, c], [x, y, z]) = (of, other);
    [a + x, b + y, c + z]
}
