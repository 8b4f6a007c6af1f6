//! What a diagnosis stands on: the movement, rows that can be used, and triads to start from.
//!
//! Faults of the recording itself are undone or left out here, so that the search sees none of them.

use imucal_core::{rotation::exp, triad::Triad};
use nalgebra::{Matrix3, Vector3};

use super::{
    bandwidth, constant_axis, conventions,
    conventions::{Conventions, Finding},
    mounting::mounting,
    pose_conventions, reference_offset, stream_conventions,
};
use crate::{
    calibrate::integrity_warning,
    diagnosis::{
        error::DiagnosisError,
        reference::{
            clock_steadiness::Steadiness, model::Model, movement, movement::Reference,
            rest_to_rest::RestToRest, revisits, stream, strikes::Unmatched,
        },
        settings::Settings,
    },
    effect::{Act, DataRun, Effect, Spoils, axis_swap},
    noise::white,
    recording::{
        Recording, SensorKind, Stream, Triple,
        check::{integrity, integrity::Integrity},
    },
    simulator::{Recorded, StreamClock},
    store::StoredCalibration,
};

/// Samples closer to a limit than this many standard deviations of their noise are not used.
const CLIPPED: f64 = 5.0;
/// Samples so close in time to one beyond that are left out with it, s.
const NEIGHBOURHOOD: f64 = 0.5;

/// What a diagnosis stands on.
pub struct Preparation {
    /// The recorded movement.
    pub movement: Box<dyn Recorded>,
    /// The rests that it was reconstructed from, where there is neither a rig nor a reference.
    pub held: Option<RestToRest>,
    /// The clock that a reference was read by to follow the samples: see [`reference_offset::coarse`] and
    /// [`stream::clock`].
    pub clock: StreamClock,
    /// Rows of each sensor that can be used, by [`SensorKind::ALL`].
    pub usable: [Vec<bool>; 3],
    /// Triads to start from, nominal SI to SI: those of the model, or such as put axes and units right.
    pub triads: [Triad<f64>; 3],
    /// The model that it stands on.
    pub model: Model,
    /// Stretches with impacts that a stream lacks, or has and the recording lacks.
    pub unmatched: Vec<Unmatched>,
    /// Faults of the recording that are effects of the catalogue.
    pub findings: Vec<Finding>,
    /// What else a reader ought to know.
    pub remarks: Vec<String>,
    /// The reference's positions tremble so much that they give no acceleration.
    pub without_position: bool,
    /// A simulator's stream has noise of its own, row by row.
    pub noisy_stream: bool,
}

impl Preparation {
    /// Of a recording, with the simulator's stream and the model of its unit where there are such.
    ///
    /// # Errors
    ///
    /// Why the recording cannot be diagnosed, for a reader.
    pub fn new(
        recording: &Recording,
        stream: Option<&Stream>,
        model: Option<&StoredCalibration>,
        settings: &Settings,
    ) -> Result<Self, DiagnosisError> {
        let model = model.map(|model| Model::new(recording, model)).transpose();
        let model = model.map_err(DiagnosisError::Recording)?.unwrap_or_default();
        let integrity = integrity::inspect(recording);
        let (fresh, repeated) = stream.map(stream_conventions::held::fresh).unzip();
        let stream = fresh.as_deref();
        let of_stream = stream.map(|stream| stream_conventions::check(recording, stream)).transpose();
        let of_stream = of_stream.map_err(DiagnosisError::Recording)?.unwrap_or_default();
        let smoothed = stream.filter(|_| of_stream.noisy);
        let smoothed = smoothed.map(|noisy| stream_conventions::own_noise::smoothed(recording, noisy));
        let stream = smoothed.as_ref().or(stream);
        let of_pose = match stream {
            Some(_) => pose_conventions::Prepared::default(),
            None => {
                let prepared = pose_conventions::prepared(recording, &integrity);
                prepared.map_err(DiagnosisError::Recording)?
            }
        };
        let pose = of_pose.pose.as_ref();
        let of_bandwidth = |clock: &StreamClock, bandwidth: f64| {
            movement::reference(recording, &integrity, &model, stream, pose, clock, bandwidth)
                .map_err(DiagnosisError::Recording)
        };
        let reference = |clock: &StreamClock| of_bandwidth(clock, bandwidth::USUAL);
        let steadiness = match stream {
            Some(given) => stream::clock(recording, &integrity, given).map_err(DiagnosisError::Recording)?,
            None => Steadiness::even(StreamClock::default()),
        };
        let mut clock = steadiness.clock.clone();
        let mut as_read = reference(&clock)?;
        if settings.source.clock && stream.is_none() {
            clock.offset = reference_offset::coarse(recording, &integrity, &*as_read.movement);
            if clock.offset != 0.0 {
                as_read = reference(&clock)?;
            }
        }
        if settings.source.placed {
            as_read = bandwidth::best(recording, &integrity, as_read, &|width| of_bandwidth(&clock, width))?;
        }
        let Reference { mut movement, held, unmatched, remarks: of_reference } = as_read;
        let lacks =
            stream.and_then(|given| stream_conventions::gravity::missing(recording, given, &*movement));
        if let Some(lacks) = lacks {
            return Err(DiagnosisError::Recording(lacks));
        }
        let conventions = conventions::check(recording, &integrity, &*movement, settings.source);
        // A reference that trembles contradicts the sensors by that alone.
        if let Some(contradiction) = conventions.contradiction.clone().filter(|_| of_pose.findings.is_empty())
        {
            return Err(DiagnosisError::Recording(contradiction));
        }
        let mut usable = SensorKind::ALL.map(|kind| usable_rows(recording, &integrity, &conventions, kind));
        if let Some(kind) = conventions.beyond_movement {
            usable[kind as usize].fill(false);
        }
        let without_acc = |kind: SensorKind| of_pose.without_acc && kind == SensorKind::Acc;
        let left_out = |kind: &SensorKind| {
            without_acc(*kind) || !movement.gives(*kind) || of_stream.left_out[*kind as usize]
        };
        for kind in SensorKind::ALL.into_iter().filter(left_out) {
            usable[kind as usize].fill(false);
        }
        for usable in &mut usable {
            usable.iter_mut().zip(movement.known()).for_each(|(usable, known)| *usable &= known);
        }
        let mut constant = Vec::new();
        for kind in SensorKind::ALL {
            if let Some(remark) = constant_axis::remark(recording, kind, &usable[kind as usize]) {
                usable[kind as usize].fill(false);
                constant.push(remark);
            }
        }
        let mut triads = model.triads;
        if let Some(held) = &held {
            for kind in [SensorKind::Acc, SensorKind::Gyr] {
                if model.calibrated.contains(&kind) {
                    triads[kind as usize] = held.triads[kind as usize];
                }
            }
        }
        if let Some(turn) = conventions.turned.and_then(|(code, _)| axis_swap::signed_permutation(code)) {
            triads.iter_mut().for_each(|triad| triad.gain = turn.tr_mul(&triad.gain));
        }
        for finding in &conventions.findings {
            undo(finding, recording, &mut usable, &mut triads);
        }
        let turn = stream.and_then(|_| mounting(recording, &integrity, &*movement, &triads, &usable));
        if let Some(mounted) = turn.and_then(|turn| movement.mounted(&exp(&-turn))) {
            movement = mounted;
        }
        if !usable.iter().flatten().any(|row| *row) {
            let why = [vec!["no sensor has a usable row".to_owned()], of_stream.remarks, constant];
            let why = why.concat().join("; ");
            return Err(DiagnosisError::Recording(why));
        }
        let mut remarks = conventions.remarks;
        remarks.extend(integrity.sensors.iter().flat_map(integrity_warning::stuck));
        remarks.extend(constant);
        remarks.extend(repeated.flatten());
        remarks.extend(of_pose.remarks);
        remarks.extend(of_stream.remarks.iter().cloned());
        remarks.extend(stream_conventions::clock::remark(&steadiness));
        remarks.extend(of_reference);
        remarks.extend(model.remarks.iter().cloned());
        // A machine's attitudes are no rests of a table, whose pointing errors repeat.
        remarks.extend(revisits::remark(&*movement).filter(|_| settings.noise.scatters));
        remarks.extend(shortcomings(recording));
        let mut findings = of_pose.findings;
        findings.extend(conventions.findings);
        findings.extend(stream_conventions::clock::findings(&steadiness));
        Ok(Self {
            movement,
            held,
            clock,
            usable,
            triads,
            model,
            unmatched,
            findings,
            remarks,
            without_position: of_pose.without_acc,
            noisy_stream: of_stream.noisy,
        })
    }
}

/// Leaves out the rows that a fault has spoilt, and has the sensor's triad undo what it does to all of them.
fn undo(finding: &Finding, recording: &Recording, usable: &mut [Vec<bool>; 3], triads: &mut [Triad<f64>; 3]) {
    let Some(kind) = finding.effect.sensors.first().copied() else { return };
    leave_out(finding, recording, kind, &mut usable[kind as usize]);
    if let Some(matrix) = finding.dose().and_then(|dose| response(finding.effect, &dose.values)) {
        let triad = &mut triads[kind as usize];
        *triad = of_altered(triad, &matrix).unwrap_or(*triad);
    }
}

/// The triad of samples M v, where that of v is known: G (v − b) = G M⁻¹ (M v − M b).
fn of_altered(triad: &Triad<f64>, m: &Matrix3<f64>) -> Option<Triad<f64>> {
    Some(Triad { gain: triad.gain * m.try_inverse()?, bias: m * triad.bias })
}

/// Rows of a sensor that can be used. In a wrong unit every sample may seem to lie beyond the range: then those count
/// that were measured and are not stuck.
fn usable_rows(
    recording: &Recording,
    integrity: &Integrity,
    conventions: &Conventions,
    kind: SensorKind,
) -> Vec<bool> {
    let (Some(sensor), Some(triple)) = (integrity.sensor(kind), recording.sensor(kind)) else {
        return Vec::new();
    };
    let is_rescaled = |finding: &Finding| {
        finding.effect.spoils() == Some(Spoils::Scale) && finding.effect.sensors.contains(&kind)
    };
    if !conventions.findings.iter().any(is_rescaled) {
        return sensor.usable.clone();
    }
    let mut usable: Vec<bool> =
        triple.values.iter().map(|value| value.iter().all(|component| component.is_finite())).collect();
    sensor.stuck.iter().for_each(|rows| usable[rows.clone()].fill(false));
    usable
}

/// What the samples of a data effect are of those before it, where that is linear: a column an axis.
fn response(effect: &Effect, values: &[f64]) -> Option<Matrix3<f64>> {
    let Act::Data(_, alter) = effect.act else { return None };
    matches!(effect.spoils(), Some(Spoils::Nothing | Spoils::Scale)).then(|| {
        let mut samples = [Vector3::x(), Vector3::y(), Vector3::z()];
        alter(values, &mut DataRun { samples: &mut samples });
        Matrix3::from_columns(&samples)
    })
}

/// Rows that a fault has spoilt are not used.
pub fn leave_out(finding: &Finding, recording: &Recording, kind: SensorKind, usable: &mut [bool]) {
    let Some(triple) = recording.sensor(kind) else { return };
    match finding.effect.spoils() {
        Some(Spoils::Repeats) => {
            for (usable, pair) in usable.iter_mut().skip(1).zip(triple.values.windows(2)) {
                *usable &= pair[0] != pair[1];
            }
        }
        Some(Spoils::BeyondLimit) => leave_out_clipped(finding, &recording.time, triple, usable),
        Some(Spoils::Passage) => leave_out_passage(finding, &recording.time, usable),
        Some(Spoils::Nothing | Spoils::Scale) | None => {}
    }
}

fn leave_out_clipped(finding: &Finding, time: &[f64], triple: &Triple, usable: &mut [bool]) {
    let shortfall = finding.parameters.first().and_then(|amount| amount.value);
    let Some((shortfall, full_scale)) = shortfall.zip(triple.full_scale_si()) else { return };
    // Just below the limit noise is clipped on one side; and to choose samples by their noise would be a bias as well.
    let most = full_scale / (1.0 + shortfall) - CLIPPED * white::of_samples(&triple.values);
    let is_beyond = |(value, _): &(&Vector3<f64>, &f64)| value.amax() >= most;
    let beyond: Vec<f64> = triple.values.iter().zip(time).filter(is_beyond).map(|(_, time)| *time).collect();
    for (usable, time) in usable.iter_mut().zip(time) {
        let next = beyond.partition_point(|beyond| *beyond < time - NEIGHBOURHOOD);
        *usable &= beyond.get(next).is_none_or(|beyond| *beyond > time + NEIGHBOURHOOD);
    }
}

fn leave_out_passage(finding: &Finding, time: &[f64], usable: &mut [bool]) {
    let value = |name: &str| {
        let amount = finding.parameters.iter().find(|amount| amount.name == name);
        amount.and_then(|amount| amount.value)
    };
    let Some(start) = value("t_start") else { return };
    // Without an end it goes on to that of the recording.
    let passage = start..value("t_end").unwrap_or(f64::INFINITY);
    for (usable, time) in usable.iter_mut().zip(time) {
        *usable &= !passage.contains(time);
    }
}

/// What the recording lacks, and what that costs.
fn shortcomings(recording: &Recording) -> Vec<String> {
    let mut remarks = Vec::new();
    if recording.temperature.is_none() {
        remarks.push(
            "no temperature was recorded: an effect of temperature cannot be distinguished from drift"
                .to_owned(),
        );
    }
    if recording.manifest.site.gravity().is_none() && recording.acc.is_some() {
        remarks.push(
            "the site's gravity is not given: standard gravity stands in, and the scale takes up the rest"
                .to_owned(),
        );
    }
    remarks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect;

    #[test]
    fn what_a_convention_does_to_samples_is_undone_in_gain_and_bias() {
        let gain = Matrix3::new(1.02, 0.01, -0.02, 0.0, 0.97, 0.03, 0.01, 0.0, 1.05);
        let triad = Triad { gain, bias: Vector3::new(0.3, -0.2, 0.1) };
        let v = Vector3::new(2.0, -7.0, 5.0);
        // Order 2 with its first axis reversed, and readings a power of ten too large.
        for (id, values) in [("acc.axis_swap", [17.0]), ("acc.unit_error", [2.0])] {
            let m = response(effect::find(id).unwrap(), &values).expect("it is linear");
            let found = of_altered(&triad, &m).expect("it can be undone");
            assert!((found.correct(&(m * v)) - triad.correct(&v)).norm() < 1e-9, "{id}: {found:?}");
        }
        assert!(of_altered(&triad, &Matrix3::zeros()).is_none());
    }
}
