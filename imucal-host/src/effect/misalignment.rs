//! Directions of the axes: `P.misalignment`, a term of the baseline.

use imucal_core::triad::Triad;
use nalgebra::Matrix3;

use super::{Act, Effect, Parameter, Part, SensorKind, TriadEntries, Words, member_id};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let words = Words {
        cause: "An axis senses a share of what lies along another: K' = (I + N) K, N without diagonal.",
        remedy: "Calibrate the full matrix; remount the unit only with a new calibration.",
        needs: "Input along each axis alone, and its sign reversed.",
    };
    let names = ["xy", "xz", "yx", "yz", "zx", "zy"];
    let effect = Effect::member(
        kind,
        "misalignment",
        Act::Triad(kind, alter),
        Parameter::amplitudes(&names, "rad", 3e-3),
        words,
    )
    .part(Part::TriadTerm)
    .changing(TriadEntries::OffDiagonal)
    .like(&member_id(kind, "cross_axis_product"), "inputs of both signs on each pair of axes");
    match kind {
        SensorKind::Mag => effect.like("mag.soft_iron", "none: its symmetric part is the same"),
        _ => effect.like("rig.encoder_offset", "none for the inner gimbal: remounting changes both"),
    }
}

fn alter(values: &[f64], triad: &mut Triad<f64>) {
    let [xy, xz, yx, yz, zx, zy] = *values else { return };
    let skewed = Matrix3::new(1.0, xy, xz, yx, 1.0, yz, zx, zy, 1.0);
    // Singular only far outside of the plausible; then the triad stays.
    if let Some(straight) = skewed.try_inverse() {
        triad.gain *= straight;
    }
}
