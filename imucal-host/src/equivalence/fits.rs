//! Fit by fit: the core's solver in `f32` against the reference's in `f64`, on the same observations.

use imucal_core::{
    model::{
        Parameterisation,
        norm::NormModel,
        parameterisation::{DIAGONAL, FULL, FULL_GAIN, FULL_WITH_SENSITIVITY, UPPER_TRIANGULAR},
        turn::TurnModel,
    },
    observation::{Durations, ShellPoint, Turn},
    solver::LevenbergMarquardt,
    triad::Triad,
};
use nalgebra::{SVector, Vector3};

use super::{
    fit_equivalence::{FitEquivalence, ParameterDifference},
    known_attitudes,
    reference::{self, SampledTurn},
    ulp,
};
use crate::{
    calibrate::{
        fit::{
            gyr_rig_fit,
            gyr_rig_fit::{MotionFit, Weighted},
        },
        outcome::{Evidence, FitSummary, KnownTurn, SensorOutcome, entry_name},
    },
    observe::motion::MotionData,
    recording::{Recording, SensorKind},
};

/// Fits an accepted sensor again, on the device's path and by the reference; `None` where there is nothing to fit
/// or the reference does not settle.
pub fn compare(recording: &Recording, outcome: &SensorOutcome) -> Option<FitEquivalence> {
    let summary = outcome.passed()?;
    match outcome.evidence.as_ref()? {
        Evidence::Shell { points, norm, diagonal: false, triad, std, .. } => {
            shell(outcome.kind, points, *norm, (triad, std), UPPER_TRIANGULAR)
        }
        Evidence::Shell { points, norm, diagonal: true, triad, std, .. } => {
            shell(outcome.kind, points, *norm, (triad, std), DIAGONAL)
        }
        Evidence::Turns(turns) => gyroscope(recording, turns, summary),
        Evidence::Motions { data, fit } => match fit.entries.len() {
            12 => attitude(data, fit, FULL),
            _ => attitude(data, fit, FULL_WITH_SENSITIVITY),
        },
        Evidence::Gimbals(poses, fit) => known_attitudes::on_gimbals(outcome.kind, poses, fit),
        Evidence::Reference { poses, fit, .. } => known_attitudes::along_reference(outcome.kind, poses, fit),
    }
}

fn shell<const P: usize>(
    kind: SensorKind,
    points: &[ShellPoint<f64>],
    norm: f64,
    (near, std): (&Triad<f64>, &Triad<f64>),
    form: Parameterisation<P>,
) -> Option<FitEquivalence> {
    // Both start a few percent away from the answer, so that both have to find it.
    let start = form.theta(&Triad { gain: near.gain * 1.02, bias: near.bias * 0.98 });
    let narrow: Vec<ShellPoint<f32>> =
        points.iter().map(|p| ShellPoint { value: p.value.cast(), excess: p.excess as f32 }).collect();
    let mut solver = LevenbergMarquardt::new(start.cast::<f32>(), Default::default());
    let report = solver.run(&NormModel { points: &narrow, norm: norm as f32, form });
    let plain: Vec<([f64; 3], f64)> = points.iter().map(|p| (p.value.into(), p.excess)).collect();
    let reference = reference::fit_shell(&plain, norm, P == 6, start.as_slice())?;
    let std = form.theta(std);
    let scales = form.theta(&Triad {
        gain: nalgebra::Matrix3::repeat(near.gain.norm()),
        bias: Vector3::repeat(norm / near.gain.norm()),
    });
    let parameters = differences(
        form.entries(),
        solver.theta().iter().map(|x| f64::from(*x)),
        &reference,
        std.as_slice(),
        scales.as_slice(),
    );
    Some(FitEquivalence { kind, termination: report.termination, parameters })
}

fn gyroscope(recording: &Recording, turns: &[KnownTurn], summary: &FitSummary) -> Option<FitEquivalence> {
    let start = FULL_GAIN.theta(&Triad::identity());
    let narrow: Vec<_> = turns.iter().map(|turn| turn.data.narrow()).collect();
    let known: Vec<Turn<'_, f32>> = turns
        .iter()
        .zip(&narrow)
        .map(|(turn, (blocks, durations))| Turn {
            blocks,
            durations: Durations::Each(durations),
            before: turn.before.cast(),
            after: turn.after.cast(),
        })
        .collect();
    let mut solver = LevenbergMarquardt::new(start.cast::<f32>(), Default::default());
    let report = solver.run(&TurnModel { turns: &known, form: FULL_GAIN });
    let sampled: Vec<SampledTurn> = turns
        .iter()
        .map(|turn| SampledTurn {
            rows: turn.data.rows.clone(),
            bias: turn.data.bias,
            before: turn.before,
            after: turn.after,
            stretch: turn.stretch,
        })
        .collect();
    let gyr = &recording.gyr.as_ref()?.values;
    let reference = reference::fit_turns(&sampled, &recording.time, gyr, start.as_slice())?;
    let std = FULL_GAIN.theta(&Triad { gain: summary.gain_std, bias: summary.bias_std });
    let parameters = differences(
        FULL_GAIN.entries(),
        solver.theta().iter().map(|x| f64::from(*x)),
        &reference,
        std.as_slice(),
        &[1.0; 9],
    );
    Some(FitEquivalence { kind: SensorKind::Gyr, termination: report.termination, parameters })
}

fn attitude<const P: usize>(
    data: &[MotionData],
    fit: &MotionFit,
    form: Parameterisation<P>,
) -> Option<FitEquivalence> {
    let all: Vec<&MotionData> = data.iter().collect();
    let weights = gyr_rig_fit::weights(&all);
    let start: Vec<f64> = fit.parameters.iter().map(|p| 1.02 * p).collect();
    let narrow: Vec<_> = data.iter().map(MotionData::narrow).collect();
    let motions: Vec<_> = narrow.iter().map(|motion| motion.motion()).collect();
    let narrow_weights: Vec<f32> = weights.iter().map(|w| *w as f32).collect();
    let model = Weighted { motions: &motions, weights: &narrow_weights, form };
    let from = SVector::<f64, P>::from_column_slice(&start).cast::<f32>();
    let mut solver = LevenbergMarquardt::new(from, Default::default());
    let report = solver.run(&model);
    let reference = reference::fit_motions(data, &weights, &start)?;
    let std: Vec<f64> = fit.covariance.diagonal().iter().map(|v| v.sqrt()).collect();
    let device = solver.theta().iter().map(|x| f64::from(*x));
    let mut parameters = differences(form.entries(), device, &reference, &std, &[1.0; P]);
    for (k, parameter) in parameters.iter_mut().enumerate().skip(12) {
        let axis = |k: usize| ["x", "y", "z"][k % 3];
        parameter.name = format!("g_{}{}", axis((k - 12) / 3), axis(k));
    }
    Some(FitEquivalence { kind: SensorKind::Gyr, termination: report.termination, parameters })
}

pub(super) fn differences(
    entries: &[u8],
    device: impl Iterator<Item = f64>,
    reference: &[f64],
    std: &[f64],
    scales: &[f64],
) -> Vec<ParameterDifference> {
    entries
        .iter()
        .zip(device.zip(reference))
        .zip(std.iter().zip(scales))
        .map(|((entry, (device, reference)), (std, scale))| ParameterDifference {
            name: entry_name(*entry),
            device,
            reference: *reference,
            ulp: ulp(device, *reference),
            std: *std,
            scale: *scale,
        })
        .collect()
}
