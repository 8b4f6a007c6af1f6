//! What an ideal sensor would have been through: the movement of a rig's encoders, of a reference attitude, of a
//! simulator's stream, or of the sensor's own rests.

use nalgebra::Vector3;

use super::{model::Model, pose::Pose, rest_to_rest::RestToRest, stream, strikes::Unmatched};
use crate::{
    observe::motion::Attitudes,
    recording::{
        Recording, SensorKind, Stream, check::integrity::Integrity, manifest::Axis, median,
        unit::STANDARD_GRAVITY,
    },
    simulator::{Place, Posed, Recorded, Replay, StreamClock, Tracked},
};

/// Recordings are at least this long, s.
const SHORTEST: f64 = 30.0;

/// The rig's axes, outermost first.
///
/// # Errors
///
/// What the manifest lacks, for a reader.
pub fn axes(recording: &Recording) -> Result<[Axis; 3], String> {
    let axes = recording.manifest.rig.as_ref().and_then(|rig| rig.axes.clone());
    axes.and_then(|axes| axes.try_into().ok()).ok_or_else(|| {
        "the manifest's [rig] names no three axes, outermost first, such as [\"z\", \"y\", \"x\"]".to_owned()
    })
}

/// The movement that a recording is compared with, and where it comes from.
pub struct Reference {
    /// The movement.
    pub movement: Box<dyn Recorded>,
    /// The rests that it is reconstructed from, where neither encoders nor a reference attitude were recorded.
    pub held: Option<RestToRest>,
    /// Stretches with impacts that a stream lacks, or has and the recording lacks.
    pub unmatched: Vec<Unmatched>,
    /// What a reader ought to know of it.
    pub remarks: Vec<String>,
}

/// The movement of a recording, of `stream` where a simulator gives one, of `pose` where there is a reference; both are read
/// by `clock`, positions to a `bandwidth`, rad/s.
///
/// # Errors
///
/// Why there is none, for a reader.
pub fn reference(
    recording: &Recording,
    integrity: &Integrity,
    model: &Model,
    stream: Option<&Stream>,
    pose: Option<&Pose>,
    clock: &StreamClock,
    bandwidth: f64,
) -> Result<Reference, String> {
    let site = &recording.manifest.site;
    let place = Place {
        latitude_deg: site.latitude_deg.unwrap_or(0.0),
        height: site.height_m.unwrap_or(0.0),
        gravity: site.gravity().unwrap_or(STANDARD_GRAVITY),
        field_n: site.field_ned_ut.unwrap_or_default().into(),
    };
    let temperature = recording.temperature.clone().unwrap_or_else(|| vec![25.0; recording.rows()]);
    let (mut held, mut unmatched, mut remarks) = (None, Vec::new(), Vec::new());
    let sources = (stream, recording.gimbal.as_deref(), pose);
    let movement: Box<dyn Recorded> = match sources {
        (Some(stream), ..) => {
            let given = stream::movement(recording, stream, clock, temperature, place)?;
            unmatched = given.unmatched;
            remarks.extend(given.unresolved);
            Box::new(given.movement)
        }
        (None, Some(gimbal), _) => {
            let axes = axes(recording)?;
            if recording.mag.is_some() && site.field_ned_ut.is_none() {
                return Err(
                    "the manifest's [site] lacks field_ned_ut, against which the magnetometer is compared"
                        .into(),
                );
            }
            let replay = Replay::new(&recording.time, gimbal, &temperature, axes, place);
            Box::new(replay.ok_or("no row has a reading of all three encoders")?)
        }
        (None, None, Some(pose)) => {
            let tracked = |attitudes: &Attitudes| {
                let mut place = place;
                if site.field_ned_ut.is_none() {
                    place.field_n = field(recording, integrity, attitudes, model).unwrap_or_default();
                }
                let tracked = Tracked::new(&recording.time, attitudes, temperature.clone(), place);
                tracked.ok_or("no row has a reference attitude")
            };
            let Pose { attitudes, positions } = pose.moved(&recording.time, clock.offset);
            let tracked = tracked(&attitudes)?;
            let posed = positions.and_then(|positions| {
                Posed::new(tracked.clone(), &recording.time, &attitudes, &positions, bandwidth)
            });
            match posed {
                Some(posed) => Box::new(posed),
                None => Box::new(tracked),
            }
        }
        (None, None, None) => {
            let rests = RestToRest::new(recording, integrity, model, temperature, place)?;
            held = Some(rests.clone());
            Box::new(rests)
        }
    };
    let length = movement.duration() - recording.time.first().copied().unwrap_or(0.0);
    if length < SHORTEST {
        return Err(format!(
            "{length:.0} s are too short to distinguish drift from other effects; at least {SHORTEST:.0} s are needed"
        ));
    }
    if !movement.moving().iter().any(|moves| *moves) {
        return Err("the rig does not move: no effect can be distinguished from a bias".to_owned());
    }
    Ok(Reference { movement, held, unmatched, remarks })
}

/// The field in the frame of a reference, µT: the median of what the magnetometer shows there, component by component.
fn field(
    recording: &Recording,
    integrity: &Integrity,
    attitudes: &Attitudes,
    model: &Model,
) -> Option<Vector3<f64>> {
    let triad = &model.triads[SensorKind::Mag as usize];
    let (samples, usable) = (&recording.mag.as_ref()?.values, &integrity.sensor(SensorKind::Mag)?.usable);
    let shown: Vec<Vector3<f64>> = attitudes
        .iter()
        .zip(samples)
        .zip(usable)
        .filter_map(|((c_t_n, b), usable)| usable.then_some((*c_t_n)? * triad.correct(b)))
        .collect();
    let along = |axis: usize| median(shown.iter().map(|b| b[axis]).collect());
    Some(Vector3::new(along(0)?, along(1)?, along(2)?))
}
