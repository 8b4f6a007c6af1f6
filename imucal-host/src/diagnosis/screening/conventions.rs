//! What is wrong with the recording itself: looked for before any fit, since nothing later means anything without it.
//!
//! Each check compares samples with what the simulator says they were given, or with themselves, and names an effect of
//! the catalogue, or, where the fault lies not in one sensor, says in words what would explain it. Times of rows are
//! those of [`Recording::time`]. Not looked for: columns that are shifted by a row, wrong byte order.

use rayon::prelude::*;

use crate::{
    diagnosis::{finding::Amount, settings::Provided},
    effect,
    effect::{Effect, Truth},
    recording::{
        Recording, SensorKind,
        check::integrity::{Integrity, SensorIntegrity},
    },
    simulator::{Dose, Motion, Recorded},
};

mod axis_swap;
mod carried_about;
mod gimbal_order;
mod noise_burst;
mod other_movement;
pub(super) mod pairs;
mod saturation;
mod stream_noise;
mod stuck_samples;
#[cfg(test)]
mod tests;
mod unit_error;

use self::{gimbal_order::FOLLOWS, pairs::Pairs};
use super::stream_conventions::axes as stream_axes;

/// No finding is made above this probability of as much by chance.
const SURE: f64 = 1e-6;
/// Rows that are compared with the truth, at most.
const ROWS: usize = 2000;

/// A fault of the recording that is an effect of the catalogue.
#[derive(Clone, Debug)]
pub struct Finding {
    /// The effect.
    pub effect: &'static Effect,
    /// Its parameters, in the order of [`Effect::parameters`].
    pub parameters: Vec<Amount>,
    /// Upper bound of the probability of as much by chance, all places that were looked at counted.
    pub p_value: f64,
}

impl Finding {
    /// Of an effect's id, with its parameters' values and standard errors. `None` where the catalogue has no such
    /// effect or another number of parameters.
    pub(super) fn new(id: &str, values: &[(Option<f64>, Option<f64>)], p_value: f64) -> Option<Self> {
        let effect = effect::find(id)?;
        let parameters: Vec<Amount> = effect
            .parameters
            .iter()
            .zip(values)
            .map(|(parameter, (value, std_error))| Amount {
                name: parameter.name.clone(),
                value: *value,
                std_error: *std_error,
                unit: parameter.unit.clone(),
            })
            .collect();
        (parameters.len() == effect.parameters.len()).then_some(Self { effect, parameters, p_value })
    }

    /// The effect with these parameters, for the simulator; `None` where one is not known.
    pub fn dose(&self) -> Option<Dose> {
        let values: Option<Vec<f64>> = self.parameters.iter().map(|parameter| parameter.value).collect();
        Some(Dose { effect: self.effect, values: values? })
    }
}

/// What the checks found.
#[derive(Clone, Debug, Default)]
pub struct Conventions {
    /// Effects, in the order of the sensors.
    pub findings: Vec<Finding>,
    /// What else a reader ought to know.
    pub remarks: Vec<String>,
    /// Code of the turn, as `axis_swap` counts them, that all triads share: that of the mount; and the upper bound of the
    /// probability that there is none.
    pub turned: Option<(usize, f64)>,
    /// A sensor that cannot be compared with the movement, since that does not hold what it was given.
    pub beyond_movement: Option<SensorKind>,
    /// How the encoders, the reference or the stream contradict every sensor: no baseline fits before that is mended.
    pub contradiction: Option<String>,
}

/// Share of a sensor's variance that no gain and bias explain where the row of t shows the movement of t + `offset`, s;
/// `None` where nothing shows it.
pub fn unexplained(
    recording: &Recording,
    integrity: &Integrity,
    kind: SensorKind,
    motion: &dyn Motion,
    offset: f64,
) -> Option<f64> {
    let rows = rows(recording);
    let truth = truth(recording, motion, &rows, offset);
    Some(Pairs::of(recording, integrity, kind, &rows, &truth)?.trusted().moments().unexplained())
}

/// Rows that are compared with the truth.
fn rows(recording: &Recording) -> Vec<usize> {
    let stride = recording.rows().div_ceil(ROWS).max(1);
    (stride / 2..recording.rows()).step_by(stride).collect()
}

fn truth(recording: &Recording, motion: &dyn Motion, rows: &[usize], offset: f64) -> Vec<Truth> {
    rows.iter().map(|row| motion.truth(recording.time[*row] + offset, &|_| ())).collect()
}

/// Axes against those of a simulator's stream. A turn that all sensors share is named for each of them, since nothing
/// but the mount that the simulator was given says how the unit sits.
fn against_stream(
    recording: &Recording,
    motion: &dyn Motion,
    pairs: &[Option<Pairs>; 3],
    acc: Option<&Pairs>,
    found: &mut Conventions,
) {
    let acc = acc.filter(|_| motion.gives(SensorKind::Acc));
    if let Some((code, p_value)) = found.turned.take() {
        found.remarks.clear();
        let other = acc.and_then(|pairs| axis_swap::against_gravity(pairs, code));
        let is_there = |kind: &SensorKind| recording.sensor(*kind).is_some() && motion.gives(*kind);
        for kind in SensorKind::ALL.into_iter().filter(is_there) {
            let own = if kind == SensorKind::Acc { other.unwrap_or(code) } else { code };
            let finding = axis_swap::finding(kind, own, p_value).filter(|_| own != 0);
            found.findings.extend(finding);
        }
        if other.is_none() {
            found.remarks.push(stream_axes::turned(code));
            return;
        }
    } else if !found.findings.iter().any(|finding| finding.effect.sensors.contains(&SensorKind::Acc)) {
        // Gravity shows what a movement without much acceleration does not.
        let code = acc.and_then(|pairs| axis_swap::against_gravity(pairs, 0));
        found.findings.extend(code.and_then(|code| axis_swap::finding(SensorKind::Acc, code, 0.0)));
    }
    let codes: Vec<(SensorKind, usize)> = found.findings.iter().filter_map(axis_swap::code_of).collect();
    if !codes.is_empty() {
        found.remarks.push(stream_axes::apart(&codes));
        return;
    }
    let mounted = |kind: SensorKind| {
        let moments = pairs[kind as usize].as_ref()?.trusted().moments();
        stream_axes::mounted(kind, &moments.cross).filter(|_| moments.unexplained() < FOLLOWS)
    };
    found.remarks.extend([SensorKind::Gyr, SensorKind::Acc].into_iter().find_map(mounted));
}

/// Checks a recording against a movement that was reconstructed from it or recorded with it.
pub fn check(
    recording: &Recording,
    integrity: &Integrity,
    motion: &dyn Recorded,
    source: Provided,
) -> Conventions {
    let mut found = Conventions::default();
    let mut rows = rows(recording);
    if source.followed {
        // A stream may begin late or end early.
        rows.retain(|row| motion.known()[*row]);
    }
    let truth = truth(recording, motion, &rows, 0.0);
    // Without the heading there is no field to compare a magnetometer with.
    let is_compared = |kind: SensorKind| {
        motion.gives(kind) && (source.heading || source.followed || kind != SensorKind::Mag)
    };
    let mut pairs = SensorKind::ALL.map(|kind| {
        let pairs = is_compared(kind).then(|| Pairs::of(recording, integrity, kind, &rows, &truth));
        pairs.flatten()
    });
    let carried = || carried_about::check(recording, integrity, &rows, &truth, &pairs);
    if let Some(remark) = if source.position { None } else { carried() } {
        found.remarks.push(remark);
        found.beyond_movement = Some(SensorKind::Acc);
        pairs[SensorKind::Acc as usize] = None;
    } else if !source.position && !source.gimbals && source.heading {
        found.remarks.extend(carried_about::left_open(recording, integrity, &rows, &truth));
    }
    let contradicted = || gimbal_order::remark(recording, integrity, motion, &rows, &truth, &pairs);
    match if source.followed { other_movement::contradiction(&pairs) } else { contradicted() } {
        // Against a wrong movement no sensor's axes mean anything.
        Some(remark) => found.contradiction = Some(remark),
        None => {
            let scales = axis_swap::check(&pairs, &mut found);
            if source.followed {
                let acc = Pairs::all(recording, integrity, SensorKind::Acc, &rows, &truth);
                against_stream(recording, motion, &pairs, acc.as_ref(), &mut found);
            }
            for (kind, scale) in SensorKind::ALL.into_iter().zip(scales) {
                if let (Some(scale), Some(triple)) = (scale, recording.sensor(kind)) {
                    unit_error::check(kind, triple.unit, &scale, &mut found);
                }
            }
        }
    }
    let own = |sensor: &SensorIntegrity| {
        let mut own = Conventions::default();
        if found.beyond_movement != Some(sensor.sensor) {
            of_itself(recording, motion, sensor, &mut own);
            if source.followed {
                stream_noise::check(recording, integrity, motion, sensor, &mut own);
            }
        }
        own
    };
    let own: Vec<Conventions> = integrity.sensors.par_iter().map(own).collect();
    for own in own {
        found.findings.extend(own.findings);
        found.remarks.extend(own.remarks);
    }
    found
}

/// Checks a sensor's samples against each other.
fn of_itself(recording: &Recording, motion: &dyn Motion, sensor: &SensorIntegrity, found: &mut Conventions) {
    let Some(triple) = recording.sensor(sensor.sensor) else { return };
    saturation::check(triple, sensor, found);
    stuck_samples::check(triple, sensor, found);
    if motion.encoders(0.0).is_none() {
        // What a hand does other than turning is no noise of the sensor.
        return;
    }
    let moves = |row: usize| motion.truth(recording.time[row], &|_| ()).w_pt_t.norm();
    noise_burst::check(&recording.time, triple, sensor, &moves, found);
}
