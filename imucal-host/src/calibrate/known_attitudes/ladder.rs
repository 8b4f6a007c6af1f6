//! The ladders of models on a rig: each rung adds terms to the one below, by composition.
//!
//! | accelerometer | adds | magnetometer | adds |
//! | --- | --- | --- | --- |
//! | T12 | K and bias, base taken as level | M12 | K and bias, field known |
//! | I14 | levelling of the base (2) | M15 | the field (its direction; K takes its length) |
//! | I17 | quadratic terms (3) | X18 | hard iron on outer and middle gimbal (6) |
//! | I20 | cubic terms (3) | X21 | both |
//! | I23 | cross-axis products (3) | | |
//!
//! Source: models.md 2 and 4. Rungs are compared by the F-test of what the added terms explain, and by the residual of
//! poses left out ([`crate::calibrate::fit::compare`]).

use imucal_core::model::unified::{Terms, UnifiedParameters};
use nalgebra::Vector3;

use crate::{
    calibrate::fit::{
        compare::Step,
        rig_fit::{RigFit, fit},
    },
    observe::pose::Poses,
};

/// A rung and its fit.
#[derive(Clone, Debug)]
pub struct Rung {
    /// Name of the model.
    pub name: &'static str,
    /// What it adds, in words.
    pub adds: &'static str,
    /// Its fit.
    pub fit: RigFit,
}

/// Models of an accelerometer on a rig, lowest first, with what each adds.
pub const ACCELEROMETER: [(&str, &str); 5] = [
    ("T12", "bias and K, base taken as level"),
    ("I14", "levelling of the base"),
    ("I17", "quadratic terms"),
    ("I20", "cubic terms"),
    ("I23", "cross-axis products"),
];
/// Models of a magnetometer on a rig.
pub const MAGNETOMETER: [(&str, &str); 4] = [
    ("M12", "bias and K, field known"),
    ("M15", "direction of the field"),
    ("X18", "hard iron on the gimbals, field known"),
    ("X21", "hard iron on the gimbals and direction of the field"),
];

const K_AND_B: [u8; 12] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11];

/// The first twelve entries and some more.
const fn with<const P: usize>(more: &[u8]) -> Terms<P> {
    let mut entries = [0; P];
    let mut k = 0;
    while k < P {
        entries[k] = if k < 12 { K_AND_B[k] } else { more[k - 12] };
        k += 1;
    }
    Terms::new(entries)
}

/// Bias and K (12).
pub const T12: Terms<12> = with(&[]);
/// And the base's levelling (14).
pub const I14: Terms<14> = with(&[12, 13]);
/// And quadratic terms (17).
pub const I17: Terms<17> = with(&[12, 13, 23, 24, 25]);
/// And cubic terms (20).
pub const I20: Terms<20> = with(&[12, 13, 23, 24, 25, 26, 27, 28]);
/// And cross-axis products (23).
pub const I23: Terms<23> = with(&[12, 13, 23, 24, 25, 26, 27, 28, 29, 30, 31]);
/// Bias, K and the field (15).
pub const M15: Terms<15> = with(&[14, 15, 16]);
/// Bias, K and hard iron on two gimbals (18).
pub const X18: Terms<18> = with(&[17, 18, 19, 20, 21, 22]);
/// Bias, K, hard iron on two gimbals and the field (21).
pub const X21: Terms<21> = with(&[17, 18, 19, 20, 21, 22, 14, 15, 16]);

/// One rung of either ladder; `vector_n` is gravity's or the field's, n, SI. `None` for a name that is on no ladder,
/// or where the poses leave no residual to judge it by.
pub fn rung(name: &str, poses: &Poses, vector_n: Vector3<f64>) -> Option<Rung> {
    rung_from(name, poses, &UnifiedParameters::nominal(vector_n))
}

/// The same, with what is known beforehand: entries that are not estimated keep their value in `base`.
pub fn rung_from(name: &str, poses: &Poses, base: &UnifiedParameters<f64>) -> Option<Rung> {
    let (name, adds) = ACCELEROMETER.into_iter().chain(MAGNETOMETER).find(|(known, _)| *known == name)?;
    let enough = |parameters: usize| 3 * poses.poses.len() > parameters + 3;
    let fit = match name {
        "T12" | "M12" if enough(12) => fit(poses, base, T12),
        "I14" if enough(14) => fit(poses, base, I14),
        "I17" if enough(17) => fit(poses, base, I17),
        "I20" if enough(20) => fit(poses, base, I20),
        "I23" if enough(23) => fit(poses, base, I23),
        "M15" if enough(15) => fit(poses, base, M15),
        "X18" if enough(18) => fit(poses, base, X18),
        "X21" if enough(21) => fit(poses, base, X21),
        _ => return None,
    };
    Some(Rung { name, adds, fit })
}

impl Rung {
    /// The rung as a comparison takes it.
    pub fn step(&self) -> Step {
        self.fit.step(self.name, self.adds)
    }
}
