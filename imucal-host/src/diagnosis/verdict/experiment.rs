//! What to record next, so that a cause and its equivalents come apart.
//!
//! ```text
//! D(e|f) = θ_eᵀ (V_ee − V_ef V_ff⁻¹ V_fe) θ_e      V: information with the baseline projected out
//! ```
//!
//! the whitened distance between what e makes at its fitted size θ_e and the nearest that f can make (Eriksson, Frisk,
//! Krysander, Automatica 49, 2013). Each programme of the simulator is tried as a segment after the recording, at the
//! recording's noise.

use rayon::prelude::*;

use crate::{
    diagnosis::{
        finding::Experiment,
        library::evidence::Projected,
        mixed_model::{
            design::{Design, Normal},
            noise::{Noise, Weighing},
        },
        residual::{base_run::Reference, forward_model::ForwardModel},
        search::{refit::signatures, stepwise::Solution},
        settings::Settings,
    },
    effect::Effect,
    recording::{SensorKind, manifest::Axis},
    simulator::{Motion, Programme, Replay, Simulation},
};

/// Rate of the simulated segments, Hz.
const RATE: f64 = 50.0;

/// A segment there may be.
struct Segment {
    programme: Programme,
    instruction: &'static str,
}

const MENU: [Segment; 5] = [
    Segment { programme: Programme::MultiPosition, instruction: "rest in 24 attitudes, six of them twice" },
    Segment {
        programme: Programme::Rates,
        instruction: "turn at constant rates of both signs about each gimbal",
    },
    Segment { programme: Programme::Sinusoids, instruction: "swing each gimbal at three frequencies" },
    Segment { programme: Programme::Gyroscope, instruction: "slew through large angles for 100 s" },
    Segment {
        programme: Programme::Thermal,
        instruction: "repeat the same attitudes while the unit warms by 10 K and cools again",
    },
];

/// The segment that parts each pair best. An effect stands first in its pair, one of its equivalents second.
pub fn next(
    explained: &Solution<'_>,
    axes: [Axis; 3],
    pairs: &[(&'static Effect, &'static Effect)],
) -> Option<Vec<Experiment>> {
    if pairs.is_empty() {
        return Some(Vec::new());
    }
    let linear = &explained.linear;
    let parted = linear.scene.settings.verdict.detectable;
    let noise = &explained.best.noise;
    let every: Vec<usize> = (0..linear.design.columns.len()).collect();
    let here = linear.design.normal(&linear.precisions(noise), &every);
    let segments: Vec<(&Segment, f64, Normal)> =
        MENU.par_iter().filter_map(|segment| information(explained, axes, segment, noise)).collect();
    let mut experiments = Vec::new();
    for (cause, other) in pairs {
        let from = distance(explained, &here, cause, other)?;
        let mut best: Option<(f64, &Segment, f64)> = None;
        for (segment, duration, more) in &segments {
            let mut both = here.clone();
            both.information += &more.information;
            let to = distance(explained, &both, cause, other)?;
            // More for the same time counts; a segment that parts them is enough.
            let worth = to.min(parted) / duration;
            if best.is_none_or(|(most, ..)| worth > most) {
                best = Some((worth, segment, to));
            }
        }
        let advice = |to: f64, segment: &Segment| match to >= parted {
            true => format!("{} (programme {})", segment.instruction, segment.programme.name()),
            // No movement of the rig does it; the catalogue knows what would.
            false => parted_by(cause, other).unwrap_or(segment.instruction).to_owned(),
        };
        if let Some((_, segment, to)) = best {
            experiments.push(Experiment {
                separates: vec![cause.id.clone(), other.id.clone()],
                instruction: advice(to, segment),
                distinguishability_from: from,
                to,
            });
        }
    }
    Some(experiments)
}

fn parted_by(cause: &Effect, other: &Effect) -> Option<&'static str> {
    let of = |a: &Effect, b: &Effect| a.confusables.iter().find(|c| c.id == b.id).map(|c| c.parted_by);
    of(cause, other).or_else(|| of(other, cause)).filter(|parted_by| !parted_by.is_empty())
}

/// Information of the recording's columns in a segment that follows it, and the segment's length.
fn information<'m>(
    explained: &Solution<'_>,
    axes: [Axis; 3],
    segment: &'m Segment,
    noise: &Noise,
) -> Option<(&'m Segment, f64, Normal)> {
    let linear = &explained.linear;
    let simulation = Simulation {
        programme: segment.programme,
        axes,
        rate: RATE,
        noise: false,
        counts: false,
        ..Simulation::default()
    };
    let mut recording = simulation.record("segment").ok()?;
    let later = linear.scene.duration();
    recording.time.iter_mut().for_each(|time| *time += later);
    let place = simulation.schedule().ok()?.place();
    let temperature = recording.temperature.clone()?;
    let replay = Replay::new(&recording.time, recording.gimbal.as_deref()?, &temperature, axes, place)?;
    let settings = Settings::default();
    let usable = SensorKind::ALL.map(|_| vec![true; recording.rows()]);
    let scene = ForwardModel::new(&recording, usable, &replay, linear.scene.triads, &settings);
    let reference = Reference::new(&scene, explained.fit.doses.clone(), &scene.fine).ok()?;
    let columns = linear.design.columns.clone();
    let signatures = signatures(&reference, &columns, &|effect| linear.shape_of(effect)).ok()?;
    let design = Design::new(&scene, columns, &signatures, &Default::default());
    let weighing = Weighing::new(&scene, SensorKind::ALL.map(|kind| reference.output(kind)));
    let every: Vec<usize> = (0..design.size).collect();
    let normal = design.normal(&weighing.precisions(&design, noise), &every);
    Some((segment, replay.duration() - later, normal))
}

/// D of a cause, at its fitted size, from another effect.
fn distance(explained: &Solution<'_>, normal: &Normal, cause: &Effect, other: &Effect) -> Option<f64> {
    let linear = &explained.linear;
    let rest: Vec<&'static Effect> =
        explained.best.set.iter().copied().filter(|effect| *effect != cause).collect();
    let mut fitted = linear.fitted(&rest);
    fitted.extend(linear.design.of(other));
    let own = linear.design.of(cause);
    let dose = explained.fit.doses.iter().find(|dose| dose.effect == cause)?;
    let size = nalgebra::DVector::from_iterator(
        own.len(),
        own.iter().map(|id| {
            let parameter = linear.design.columns[*id].parameter;
            dose.values[parameter] / cause.parameters[parameter].prior_scale
        }),
    );
    let projected = Projected::new(normal, &fitted, &own).ok()?;
    Some(size.dot(&(&projected.information * &size)).max(0.0))
}
