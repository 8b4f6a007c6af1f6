//! Fits of the unified model at known attitudes, on a rig or along a reference: the core's in `f32` against the
//! reference's in `f64`.

use imucal_core::{
    model::{
        rig::{GimbalPose, Pose, ReferencePose},
        unified::{Terms, UNIFIED, UnifiedModel, UnifiedParameters},
    },
    solver::LevenbergMarquardt,
};
use nalgebra::{Matrix3, Rotation3, SVector, UnitQuaternion, Vector3};

use super::{
    fit_equivalence::{FitEquivalence, ParameterDifference},
    reference::{self, KnownPose},
    ulp,
};
use crate::{
    calibrate::{fit::rig_fit::RigFit, known_attitudes::rig::unified_name},
    observe::pose::Poses,
    recording::SensorKind,
};

/// More poses than this are thinned for both: ten times as many determine no more than a few thousand.
const MOST: usize = 3000;

/// Poses on a rig.
pub(super) fn on_gimbals(kind: SensorKind, poses: &Poses, fit: &RigFit) -> Option<FitEquivalence> {
    let plain = |pose: &GimbalPose<f64>| {
        let axes = poses.axes.0.map(|axis| Vector3::ith_axis(axis as usize));
        let angles = pose.angles();
        let [outer, middle, inner] = [0, 1, 2].map(|k| Rotation3::from_axis_angle(&axes[k], angles[k]));
        KnownPose {
            output: pose.value.into(),
            c_p_t: (outer * middle * inner).inverse().into_inner(),
            c_o_t: (middle * inner).inverse().into_inner(),
            c_m_t: inner.inverse().into_inner(),
        }
    };
    let narrow: Vec<GimbalPose<f32>> = poses.poses.iter().map(GimbalPose::cast).collect();
    let plain: Vec<KnownPose> = poses.poses.iter().map(plain).collect();
    by_length(kind, &narrow, poses.axes, &plain, fit)
}

/// Samples along a reference.
pub(super) fn along_reference(
    kind: SensorKind,
    poses: &[ReferencePose<f64>],
    fit: &RigFit,
) -> Option<FitEquivalence> {
    let step = poses.len().div_ceil(MOST).max(1);
    let some: Vec<_> = poses.iter().step_by(step).collect();
    let plain = |pose: &&ReferencePose<f64>| KnownPose {
        output: pose.value.into(),
        c_p_t: UnitQuaternion::from_quaternion(pose.attitude).inverse().to_rotation_matrix().into_inner(),
        c_o_t: Matrix3::zeros(),
        c_m_t: Matrix3::zeros(),
    };
    let plain: Vec<KnownPose> = some.iter().map(plain).collect();
    let narrow: Vec<ReferencePose<f32>> = some.into_iter().map(ReferencePose::cast).collect();
    by_length(kind, &narrow, (), &plain, fit)
}

/// By the number of entries, which is a type.
fn by_length<G: Pose<f32>>(
    kind: SensorKind,
    narrow: &[G],
    axes: G::Axes,
    plain: &[KnownPose],
    fit: &RigFit,
) -> Option<FitEquivalence> {
    match fit.entries.len() {
        12 => refit::<12, G>(kind, narrow, axes, plain, fit),
        14 => refit::<14, G>(kind, narrow, axes, plain, fit),
        15 => refit::<15, G>(kind, narrow, axes, plain, fit),
        17 => refit::<17, G>(kind, narrow, axes, plain, fit),
        18 => refit::<18, G>(kind, narrow, axes, plain, fit),
        20 => refit::<20, G>(kind, narrow, axes, plain, fit),
        21 => refit::<21, G>(kind, narrow, axes, plain, fit),
        23 => refit::<23, G>(kind, narrow, axes, plain, fit),
        _ => None,
    }
}

fn refit<const P: usize, G: Pose<f32>>(
    kind: SensorKind,
    narrow: &[G],
    axes: G::Axes,
    plain: &[KnownPose],
    fit: &RigFit,
) -> Option<FitEquivalence> {
    let entries: [u8; P] = fit.entries.as_slice().try_into().ok()?;
    let is_held = |entry: u8| fit.held.iter().any(|(held, _)| *held == entry);
    let free: Vec<u8> = entries.iter().copied().filter(|entry| !is_held(*entry)).collect();
    let found = fit.parameters.to_vector();
    // Both start a few percent away from the answer, so that both have to find it.
    let mut start = found;
    free.iter().for_each(|entry| start[usize::from(*entry)] *= 1.02);

    let terms = Terms::new(entries);
    let held = (0..P).filter(|k| is_held(entries[*k])).fold(0, |held, k| held | 1 << k);
    let single = |all: &SVector<f64, UNIFIED>| UnifiedParameters::from_vector(&all.cast::<f32>());
    let model = UnifiedModel { poses: narrow, axes, base: single(&found), terms, held };
    let mut solver = LevenbergMarquardt::new(terms.theta(&single(&start)), Default::default());
    let report = solver.run(&model);
    let device = terms.parameters(&model.base, solver.theta()).to_vector();

    let reference = reference::fit_poses(plain, &start.into(), &free)?;
    let norm = fit.parameters.vector_n.norm();
    let parameters = free.iter().zip(reference).map(|(entry, reference)| {
        let device = f64::from(device[usize::from(*entry)]);
        ParameterDifference {
            name: unified_name(*entry),
            device,
            reference,
            ulp: ulp(device, reference),
            std: fit.std(*entry).unwrap_or(0.0),
            scale: match entry {
                0..9 | 12 | 13 => 1.0,
                23..26 | 29.. => 1.0 / norm,
                26..29 => 1.0 / (norm * norm),
                _ => norm,
            },
        }
    });
    Some(FitEquivalence { kind, termination: report.termination, parameters: parameters.collect() })
}
