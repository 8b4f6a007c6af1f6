//! Where the gap between simulator and recording lies, which unmodelled effect causes it, and how far it shrinks.

pub mod block;
pub mod candidates;
pub mod credible;
pub mod design;
pub mod driver;
pub mod estimate;
pub mod evidence;
pub mod finding;
pub mod gap;
pub mod noise;
pub mod refit;
pub mod scene;
pub mod search;
pub mod shape;
mod skyline;
pub mod testable;
pub mod whitening;

use imucal_core::triad::Triad;

pub use self::finding::{Diagnosis, Verdict};
use self::{
    candidates::Candidates,
    driver::Following,
    finding::{Cause, Place as Driven},
    scene::Scene,
    search::Explained,
};
use crate::{
    recording::{Recording, SensorKind, integrity, manifest::Axis},
    simulator::{Motion, Place, Replay},
};

/// A driver is followed when noise alone would do as much less often than this, all tests counted.
const FOLLOWED: f64 = 0.01;
/// A remainder below this share of the explainable gap does not matter.
const REMAINDER: f64 = 0.05;
/// Causes that close less than this share of it explain nothing.
const EXPLAINS: f64 = 0.2;
/// A cause as probable as this has no rival.
const CERTAIN: f64 = 0.95;
/// Recordings are at least this long, s.
const SHORTEST: f64 = 30.0;

/// What a diagnosis may be told beforehand.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Catalogue entries to be withheld from the candidates, and terms to be taken out of the baseline.
    pub without: Vec<String>,
}

/// Diagnoses a recording; `progress` hears of each stage.
pub fn diagnose(recording: &Recording, options: &Options, progress: &dyn Fn(&str)) -> Diagnosis {
    let replay = match replay(recording) {
        Ok(replay) => replay,
        Err(why) => return untestable(recording, why),
    };
    let integrity = integrity::inspect(recording);
    let triads = [Triad::identity(); SensorKind::ALL.len()];
    let scene = Scene::new(recording, &integrity, &replay, triads);
    let thermometer = recording.temperature.is_some();
    let candidates = Candidates::new(&scene.kinds, thermometer, false, &options.without);
    let explained = search::search(&scene, &candidates, progress);
    let answer = explained.as_ref().and_then(|explained| answer(recording, explained, progress));
    answer.unwrap_or_else(|| {
        untestable(recording, "the baseline cannot be fitted to this recording".to_owned())
    })
}

/// The recorded movement, or why there is none.
fn replay(recording: &Recording) -> Result<Replay, String> {
    let gimbal = recording.gimbal.as_deref().ok_or(
        "there are no encoder columns (gimbal_outer, gimbal_middle, gimbal_inner): without a rig the simulator cannot \
         be given the movement",
    )?;
    let axes = recording.manifest.rig.as_ref().and_then(|rig| rig.axes.clone());
    let axes: [Axis; 3] = axes
        .and_then(|axes| axes.try_into().ok())
        .ok_or("the manifest's [rig] names no three axes, outermost first, such as [\"z\", \"y\", \"x\"]")?;
    let site = &recording.manifest.site;
    if recording.mag.is_some() && site.field_ned_ut.is_none() {
        return Err(
            "the manifest's [site] lacks field_ned_ut, against which the magnetometer is compared".to_owned()
        );
    }
    let place = Place {
        latitude_deg: site.latitude_deg.unwrap_or(0.0),
        height: site.height_m.unwrap_or(0.0),
        gravity: site.gravity().unwrap_or(crate::recording::unit::STANDARD_GRAVITY),
        field_n: site.field_ned_ut.unwrap_or_default().into(),
    };
    let temperature = recording.temperature.clone().unwrap_or_else(|| vec![25.0; recording.rows()]);
    let replay = Replay::new(&recording.time, gimbal, temperature, axes, place)
        .ok_or("no row has a reading of all three encoders")?;
    if replay.duration() < SHORTEST {
        return Err(format!(
            "{:.0} s are too short to tell drift from anything else; {SHORTEST:.0} s at least",
            replay.duration()
        ));
    }
    Ok(replay)
}

fn untestable(recording: &Recording, why: String) -> Diagnosis {
    Diagnosis {
        format: finding::FORMAT.to_owned(),
        recording: recording.name.clone(),
        verdict: Verdict::NotTestable,
        remarks: vec![why],
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

fn answer(recording: &Recording, explained: &Explained<'_>, progress: &dyn Fn(&str)) -> Option<Diagnosis> {
    let (linear, best) = (&explained.linear, &explained.best);
    let drivers = driver::drivers(linear.scene);
    let before = driver::following(linear, &[], &best.noise, &drivers)?;
    let after = driver::following(linear, &best.set, &best.noise, &drivers)?;
    progress("drivers tested");
    let left = after.iter().find(|f| is_followed(f, after.len()));
    let closed = gap::closed(linear, &best.set, &best.noise, left.map_or(0.0, |f| f.size))?;
    progress("held out");
    let standings: Vec<credible::Standing> =
        best.set.iter().map(|cause| credible::standing(linear, best, cause)).collect::<Option<_>>()?;
    progress("alternatives judged");
    let amounts = estimate::amounts(explained)?;
    let mut causes: Vec<Cause> = Vec::new();
    for (((effect, standing), amounts), share) in
        best.set.iter().zip(&standings).zip(amounts).zip(&closed.each)
    {
        causes.push(Cause {
            effect: effect.id.clone(),
            probability: standing.probability,
            equivalents: standing.equivalents.iter().map(|other| other.id.clone()).collect(),
            material: estimate::is_material(effect, &amounts),
            parameters: amounts,
            gap_closed: share.value,
            gap_closed_ci95: share.interval,
        });
    }
    causes.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    let mut credible_set: Vec<String> = Vec::new();
    for effect in standings.iter().flat_map(|standing| &standing.set) {
        if !credible_set.contains(&effect.id) {
            credible_set.push(effect.id.clone());
        }
    }
    let (absent, not_testable) = testable::testable(linear, &best.set, &best.noise)?;
    let found = !causes.is_empty();
    Some(Diagnosis {
        verdict: verdict(&causes, left, &closed),
        remarks: Vec::new(),
        gap: gap::table(linear, &best.set, &best.noise)?,
        places: places(if found { &before } else { &after }, closed.explainable),
        causes,
        credible_set,
        gap_closed_total: found.then_some(closed.total.value),
        gap_closed_total_ci95: found.then_some(closed.total.interval),
        held_out: true,
        absent,
        not_testable,
        ..untestable(recording, String::new())
    })
}

fn is_followed(following: &Following, tests: usize) -> bool {
    following.p_value * tests as f64 <= FOLLOWED
}

fn verdict(causes: &[Cause], left: Option<&Following>, closed: &gap::Closed) -> Verdict {
    let remainder = left.map_or(0.0, |f| f.size) / closed.explainable;
    match (causes, left) {
        ([], None) => Verdict::None,
        ([], Some(_)) => Verdict::Unknown,
        (_, Some(_)) if closed.total.value < EXPLAINS => Verdict::Unknown,
        (_, Some(_)) if remainder > REMAINDER => Verdict::Partly,
        _ if causes.iter().any(|cause| cause.probability < CERTAIN) => Verdict::Ambiguous,
        _ => Verdict::Explained,
    }
}

fn places(following: &[Following], explainable: f64) -> Vec<Driven> {
    let mut places: Vec<Driven> = following
        .iter()
        .filter(|f| is_followed(f, following.len()))
        .map(|f| Driven {
            sensor: f.kind.prefix().to_owned(),
            driver: f.driver.clone(),
            share: (f.size / explainable).min(1.0),
            p_value: (f.p_value * following.len() as f64).min(1.0),
            detail: f.detail.clone(),
        })
        .collect();
    places.sort_by(|a, b| b.share.total_cmp(&a.share));
    places
}
