//! Where the gap between simulator and recording lies, which unmodelled effect causes it, and how far it shrinks.

pub mod block;
pub mod candidates;
pub mod convention;
pub mod design;
pub mod evidence;
pub mod finding;
pub mod noise;
pub mod refit;
pub mod scene;
pub mod search;
pub mod shape;
mod skyline;
pub mod whitening;

use imucal_core::triad::Triad;

pub use self::finding::{Diagnosis, Verdict};
use self::{
    candidates::Candidates,
    finding::{Amount, Cause},
    scene::Scene,
    search::Explained,
};
use crate::{
    recording::{Recording, SensorKind, integrity, manifest::Axis},
    simulator::{Place, Replay},
};

/// What a diagnosis may be told beforehand.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Catalogue entries to be withheld from the candidates, and terms to be taken out of the baseline.
    pub without: Vec<String>,
}

/// Diagnoses a recording; `progress` hears of each stage.
pub fn diagnose(recording: &Recording, options: &Options, progress: &dyn Fn(&str)) -> Diagnosis {
    attempt(recording, options, progress).unwrap_or_else(|| refused(recording, Vec::new()))
}

fn refused(recording: &Recording, remarks: Vec<String>) -> Diagnosis {
    Diagnosis {
        format: finding::FORMAT.to_owned(),
        recording: recording.name.clone(),
        verdict: Verdict::NotTestable,
        remarks,
        gap: Vec::new(),
        places: Vec::new(),
        causes: Vec::new(),
        credible_set: Vec::new(),
        gap_closed_total: None,
        gap_closed_total_ci95: None,
        held_out: false,
        absent: Vec::new(),
        not_testable: Vec::new(),
        next_experiment: Vec::new(),
    }
}

fn attempt(recording: &Recording, options: &Options, progress: &dyn Fn(&str)) -> Option<Diagnosis> {
    let integrity = integrity::inspect(recording);
    let axes: [Axis; 3] = recording.manifest.rig.as_ref()?.axes.clone()?.try_into().ok()?;
    let site = &recording.manifest.site;
    let place = Place {
        latitude_deg: site.latitude_deg.unwrap_or(0.0),
        height: site.height_m.unwrap_or(0.0),
        gravity: site.gravity().unwrap_or(9.80665),
        field_n: site.field_ned_ut?.into(),
    };
    let temperature = recording.temperature.clone().unwrap_or_else(|| vec![25.0; recording.rows()]);
    let replay = Replay::new(&recording.time, recording.gimbal.as_deref()?, temperature, axes, place)?;
    let triads = [Triad::identity(); SensorKind::ALL.len()];
    let scene = Scene::new(recording, &integrity, &replay, replay.swings(), triads);
    let thermometer = recording.temperature.is_some();
    let candidates = Candidates::new(&scene.kinds, thermometer, false, &options.without);
    let explained = search::search(&scene, &candidates, progress)?;
    let causes = causes(&explained)?;
    Some(Diagnosis {
        verdict: if causes.is_empty() { Verdict::None } else { Verdict::Explained },
        credible_set: causes.iter().map(|cause| cause.effect.clone()).collect(),
        causes,
        ..refused(recording, Vec::new())
    })
}

fn causes(explained: &Explained<'_>) -> Option<Vec<Cause>> {
    let amount = |dose: &crate::simulator::Dose| {
        dose.effect
            .parameters
            .iter()
            .zip(&dose.values)
            .map(|(parameter, value)| Amount {
                name: parameter.name.clone(),
                value: value.is_finite().then_some(*value),
                std_error: None,
                unit: parameter.unit.clone(),
            })
            .collect()
    };
    explained
        .best
        .set
        .iter()
        .map(|effect| {
            let dose = explained.fit.doses.iter().find(|dose| std::ptr::eq(dose.effect, *effect))?;
            Some(Cause {
                effect: effect.id.clone(),
                probability: 1.0,
                equivalents: Vec::new(),
                parameters: amount(dose),
                material: true,
                gap_closed: f64::NAN,
                gap_closed_ci95: [f64::NAN; 2],
            })
        })
        .collect()
}
