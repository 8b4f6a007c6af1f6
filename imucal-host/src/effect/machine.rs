//! The rig at one instant: what its base, gimbals and imperfections do to the table.

use nalgebra::Vector3;

/// An angle and its first two derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Swing {
    /// Angle, rad, not wrapped, right-handed.
    pub angle: f64,
    /// Rate, rad/s.
    pub rate: f64,
    /// Acceleration, rad/s².
    pub acceleration: f64,
}

impl Swing {
    /// An angle that stays, rad.
    pub fn still(angle: f64) -> Self {
        Self { angle, rate: 0.0, acceleration: 0.0 }
    }

    /// The sum of two swings about one axis.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            angle: self.angle + other.angle,
            rate: self.rate + other.rate,
            acceleration: self.acceleration + other.acceleration,
        }
    }

    /// The swing of `f(angle)` while the angle swings like this, from f and its first two derivatives there.
    #[must_use]
    pub fn through(self, value: f64, first: f64, second: f64) -> Self {
        Self {
            angle: value,
            rate: first * self.rate,
            acceleration: first * self.acceleration + second * self.rate * self.rate,
        }
    }
}

/// A three-gimbal rig at one instant. From the local level n inwards: heading about z and levelling tilt about y, then
/// x (p); wobble of the outer axis; outer gimbal (o); skew; middle gimbal (m); skew; inner gimbal (t).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Machine {
    /// Directions of the gimbal axes, outermost first, in the parent's frame at zero; unit vectors.
    pub axes: [Vector3<f64>; 3],
    /// Heading of the base, rad: p turned from n about down.
    pub heading: f64,
    /// Levelling tilt of the base about its x and y, rad: f^p = g (sin β, −cos β sin α, −cos β cos α).
    pub tilt: [f64; 2],
    /// Small turns of the outer axis about the two axes that follow it cyclically (z: x, y), in the base.
    pub wobble: [Swing; 2],
    /// True angles of the gimbals, outermost first.
    pub gimbals: [Swing; 3],
    /// Small turns between outer and middle and between middle and inner gimbal, rad, each about the common normal
    /// of the two axes.
    pub skew: [f64; 2],
}

impl Machine {
    /// A level, exact rig with these axes, at zero.
    pub fn exact(axes: [Vector3<f64>; 3]) -> Self {
        Self {
            axes,
            heading: 0.0,
            tilt: [0.0; 2],
            wobble: [Swing::default(); 2],
            gimbals: [Swing::default(); 3],
            skew: [0.0; 2],
        }
    }

    /// Its table turns against its base as another's does.
    pub fn turns_like(&self, other: &Self) -> bool {
        let same_axes = self.axes == other.axes && self.skew == other.skew && self.wobble == other.wobble;
        same_axes && self.gimbals == other.gimbals
    }
}
