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
//! poses left out.

use imucal_core::model::unified::{Terms, UnifiedParameters};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::rig_fit::{RigFit, fit};
use crate::observe::pose::Poses;

/// A rung is taken where chance would explain its gain less often than this.
pub const SIGNIFICANT: f64 = 1e-3;

/// A rung and its fit.
#[derive(Clone, Debug)]
pub struct Rung {
    /// Name of the model.
    pub name: &'static str,
    /// What it adds, in words.
    pub adds: &'static str,
    /// Name of the rung it is compared with.
    pub below: Option<&'static str>,
    /// Its fit.
    pub fit: RigFit,
    /// Probability that chance alone explains as much more as its added terms do; `None` for the first.
    pub p_value: Option<f64>,
}

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

/// Every rung of the accelerometer's ladder that the poses have residuals for.
pub fn accelerometer(poses: &Poses, gravity: f64) -> Vec<Rung> {
    let base = UnifiedParameters::nominal(nalgebra::Vector3::new(0.0, 0.0, -gravity));
    let mut ladder = Ladder::new(poses);
    ladder.climb("T12", "bias and K, base taken as level", None, || fit(poses, &base, T12), 12);
    ladder.climb("I14", "levelling of the base", Some("T12"), || fit(poses, &base, I14), 14);
    ladder.climb("I17", "quadratic terms", Some("I14"), || fit(poses, &base, I17), 17);
    ladder.climb("I20", "cubic terms", Some("I17"), || fit(poses, &base, I20), 20);
    ladder.climb("I23", "cross-axis products", Some("I20"), || fit(poses, &base, I23), 23);
    ladder.rungs
}

/// Every rung of the magnetometer's ladder; `field_n` is Earth's field in n, µT.
pub fn magnetometer(poses: &Poses, field_n: nalgebra::Vector3<f64>) -> Vec<Rung> {
    let base = UnifiedParameters::nominal(field_n);
    let mut ladder = Ladder::new(poses);
    ladder.climb("M12", "bias and K, field known", None, || fit(poses, &base, T12), 12);
    ladder.climb("M15", "direction of the field", Some("M12"), || fit(poses, &base, M15), 15);
    ladder.climb("X18", "hard iron on the gimbals, field known", Some("M12"), || fit(poses, &base, X18), 18);
    ladder.climb(
        "X21",
        "direction of the field beside hard iron",
        Some("X18"),
        || fit(poses, &base, X21),
        21,
    );
    ladder.rungs
}

struct Ladder {
    residuals: usize,
    rungs: Vec<Rung>,
}

impl Ladder {
    fn new(poses: &Poses) -> Self {
        Self { residuals: 3 * poses.poses.len(), rungs: Vec::new() }
    }

    fn climb(
        &mut self,
        name: &'static str,
        adds: &'static str,
        below: Option<&'static str>,
        fit: impl FnOnce() -> RigFit,
        parameters: usize,
    ) {
        // With fewer residuals than that there is nothing to compare.
        if self.residuals <= parameters + 3 {
            return;
        }
        let fit = fit();
        let p_value =
            self.rungs.iter().find(|rung| Some(rung.name) == below).and_then(|rung| p_value(&rung.fit, &fit));
        self.rungs.push(Rung { name, adds, below, fit, p_value });
    }
}

/// F-test of the upper rung against the lower; `None` where it adds nothing.
fn p_value(lower: &RigFit, upper: &RigFit) -> Option<f64> {
    let added = upper.free().checked_sub(lower.free()).filter(|n| *n > 0)?;
    let left = upper.residuals.checked_sub(upper.free()).filter(|n| *n > 0)?;
    let gained = (lower.squared_sum - upper.squared_sum).max(0.0) / added as f64;
    let f = gained / (upper.squared_sum / left as f64);
    Some(FisherSnedecor::new(added as f64, left as f64).ok()?.sf(f))
}

/// The rung to use: the best at predicting poses left out, among those whose added terms are significant against
/// every chosen rung below.
pub fn choose(rungs: &[Rung]) -> Option<&Rung> {
    let mut chosen = rungs.first()?;
    for rung in &rungs[1..] {
        let predicts_better =
            rung.fit.held_out_rms.zip(chosen.fit.held_out_rms).is_some_and(|(new, old)| new < old);
        let p_value = if contains(rung, chosen) { p_value(&chosen.fit, &rung.fit) } else { rung.p_value };
        if predicts_better && p_value.is_some_and(|p| p < SIGNIFICANT) {
            chosen = rung;
        }
    }
    Some(chosen)
}

/// Every entry of `lower` is one of `upper`.
fn contains(upper: &Rung, lower: &Rung) -> bool {
    lower.fit.entries.iter().all(|entry| upper.fit.entries.contains(entry))
}
