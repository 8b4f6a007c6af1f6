//! The catalogue of effects that a simulator may lack: the only list of them.
//!
//! An effect alters the chain from the rig to the samples at its true place, and says in words what it is. The chain
//! runs by [`Stage`], within a stage in the order of [`CATALOGUE`]. Between the stages the simulator adds what belongs
//! to the rig and the unit: rig and clock → truth → field → triad → sensor → noise → signal → converter → data.
//!
//! Effects have no noise of their own: without the unit's noise a recording is a function of the parameters, and can
//! be differentiated by them. Those with a memory ([`Act::Memory`]) are given the whole run.

use std::sync::LazyLock;

use imucal_core::triad::Triad;

use crate::recording::{SensorKind, Unit};

mod angular_acceleration;
pub mod attitude_noise;
mod axis_nonorthogonality;
pub mod axis_swap;
mod bandwidth;
mod bias;
mod bias_drift;
mod bias_step;
pub mod class;
pub mod clock_jump;
pub mod clock_wander;
mod cross_axis_product;
mod earth_rate;
mod eddy_current;
mod encoder_harmonic;
mod encoder_offset;
mod field_dip;
mod field_direction;
mod field_drift;
mod field_gradient;
mod field_strength;
mod g2_sensitivity;
mod g_sensitivity;
mod gimbal_hard_iron;
mod gimbal_soft_iron;
mod gravity_error;
mod hard_iron;
mod heading;
mod hysteresis;
mod inner_lever_arm;
mod lag;
mod level_tilt;
mod lever_arm;
mod machine;
mod matrices;
mod misalignment;
pub mod motion_mismatch;
mod motor_current;
mod mount_slip;
mod mounting;
mod noise_burst;
mod parameter;
mod part;
pub mod position_noise;
mod rate_error;
mod room_gradient;
mod saturation;
mod scale;
mod scale_asymmetry;
mod scale_cubic;
mod scale_quadratic;
mod sensor_run;
mod soft_iron;
mod stuck_samples;
mod temp_bias;
mod temp_bias_quadratic;
mod temp_scale;
mod time_offset;
mod transient;
mod tremble;
mod triad_entries;
mod truth;
mod unit_error;
mod unknown_name;
pub mod user;
mod vibration_rectification;
mod warmup;
mod wobble;
mod words;

use SensorKind::{Acc, Gyr, Mag};

use self::matrices::{MATRIX, SYMMETRIC, matrix, symmetric, vector};

pub use self::{
    machine::{Machine, Swing},
    parameter::{Parameter, Role},
    part::{Free, Needs, Part, Spoils},
    sensor_run::{DataRun, SensorRows, SensorRun, SignalRun},
    triad_entries::TriadEntries,
    truth::{Input, Truth},
    unknown_name::UnknownName,
    words::{Confusable, Words},
};

/// Where in the chain an effect acts. The order is that of the chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// The rig does not stand or turn as it says.
    Rig,
    /// Sensors and rig do not share a clock.
    Clock,
    /// The fields at the sensor: specific force, Earth rate, magnetic field.
    Field,
    /// The triad's response, before noise.
    Sensor,
    /// Noise and limits before the converter.
    Signal,
    /// Samples after the converter.
    Data,
}

/// How an effect alters the chain, given its parameters.
#[derive(Clone, Copy, Debug)]
pub enum Act {
    /// Alters the rig at an instant.
    Rig(fn(&[f64], &mut Machine)),
    /// The rig's time that a row of this time shows, s.
    Clock(fn(&[f64], f64) -> f64),
    /// Alters the truth of a row.
    Field(fn(&[f64], &mut Truth)),
    /// Alters a triad of the baseline: true SI in the enclosure's axes to raw SI.
    Triad(SensorKind, fn(&[f64], &mut Triad<f64>)),
    /// Alters a triad's output, each row by itself: a run may be given to it in parts.
    Sensor(SensorKind, fn(&[f64], &mut SensorRows<'_>)),
    /// Alters a triad's output by other rows as well: it is given the whole run.
    Memory(SensorKind, fn(&[f64], &mut SensorRun<'_>)),
    /// Adds a user's formula to a triad's output.
    Formula(SensorKind, &'static user::Formula),
    /// Alters a triad's noise or limit.
    Signal(SensorKind, fn(&[f64], &mut SignalRun<'_>)),
    /// Alters a triad's samples.
    Data(SensorKind, fn(&[f64], &mut DataRun<'_>)),
}

impl Act {
    /// Its place in the chain.
    pub fn stage(&self) -> Stage {
        match self {
            Self::Rig(_) => Stage::Rig,
            Self::Clock(_) => Stage::Clock,
            Self::Field(_) => Stage::Field,
            Self::Triad(..) | Self::Sensor(..) | Self::Memory(..) | Self::Formula(..) => Stage::Sensor,
            Self::Signal(..) => Stage::Signal,
            Self::Data(..) => Stage::Data,
        }
    }

    /// Its effect on a triad's output in a row depends on other rows, or may, as a user's formula.
    pub fn remembers(&self) -> bool {
        matches!(self, Self::Memory(..) | Self::Formula(..))
    }
}

/// One entry of the catalogue.
#[derive(Clone, Debug)]
pub struct Effect {
    /// Its fixed name.
    pub id: String,
    /// What it does to the chain.
    pub act: Act,
    /// Sensors it may alter; all others are left bit for bit as they were.
    pub sensors: &'static [SensorKind],
    /// Its parameters, in the order of the parameter vector.
    pub parameters: Vec<Parameter>,
    /// What it is.
    pub words: Words,
    /// What it is mistaken for.
    pub confusables: Vec<Confusable>,
    /// Its part in a diagnosis.
    pub part: Part,
    /// What a recording must hold to show it.
    pub needs: Needs,
    /// A calibration made of the recording itself takes it up wholly.
    pub absorbed: bool,
    /// Entries of a triad that its parameters change.
    pub changes: Option<TriadEntries>,
}

/// Effects are the same if they bear the same name.
impl PartialEq for Effect {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self, other) || self.id == other.id
    }
}

impl Effect {
    fn new(id: &str, act: Act, parameters: Vec<Parameter>, words: Words) -> Self {
        let sensors: &'static [SensorKind] = match act {
            Act::Rig(_) | Act::Clock(_) | Act::Field(_) => &SensorKind::ALL,
            Act::Triad(kind, _)
            | Act::Sensor(kind, _)
            | Act::Memory(kind, _)
            | Act::Formula(kind, _)
            | Act::Signal(kind, _)
            | Act::Data(kind, _) => only(kind),
        };
        Self {
            id: id.to_owned(),
            act,
            sensors,
            parameters,
            words,
            confusables: Vec::new(),
            part: Part::Candidate,
            needs: Needs::NOTHING,
            absorbed: false,
            changes: None,
        }
    }

    /// One of a family with a member for each sensor.
    fn member(kind: SensorKind, name: &str, act: Act, parameters: Vec<Parameter>, words: Words) -> Self {
        Self::new(&member_id(kind, name), act, parameters, words)
    }

    fn on(mut self, kind: SensorKind) -> Self {
        self.sensors = only(kind);
        self
    }

    fn changing(mut self, entries: TriadEntries) -> Self {
        self.changes = Some(entries);
        self
    }

    fn part(mut self, part: Part) -> Self {
        self.part = part;
        self
    }

    fn needing(mut self, needs: Needs) -> Self {
        self.needs = needs;
        self
    }

    fn absorbed(mut self) -> Self {
        self.absorbed = true;
        self
    }

    fn like(mut self, id: &str, parted_by: &'static str) -> Self {
        self.confusables.push(Confusable { id: id.to_owned(), parted_by });
        self
    }

    /// It is a fault of the recording itself that spoils rows so.
    pub fn spoils(&self) -> Option<Spoils> {
        match self.part {
            Part::Fault(spoils) => Some(spoils),
            _ => None,
        }
    }

    /// Its signature depends on parameters other than amplitudes.
    pub fn is_shaped(&self) -> bool {
        self.parameters.iter().any(|p| matches!(p.role, Role::Shape { .. } | Role::Instant { .. }))
    }

    /// Parameters that its signature is linear in.
    pub fn amplitudes(&self) -> impl Iterator<Item = usize> {
        let known = self.parameters.iter().enumerate();
        known.filter(|(_, parameter)| parameter.role == Role::Amplitude).map(|(index, _)| index)
    }

    /// Details, which a fit that holds the effect is linear in as well.
    pub fn details(&self) -> impl Iterator<Item = usize> {
        let known = self.parameters.iter().enumerate();
        known.filter(|(_, parameter)| matches!(parameter.role, Role::Detail { .. })).map(|(index, _)| index)
    }

    /// Parameters that say how or when, at these values; an instant that never comes is none.
    pub fn shapes_at<'e>(&'e self, values: &'e [f64]) -> impl Iterator<Item = usize> + 'e {
        let is_shape = |role: &Role| matches!(role, Role::Shape { .. } | Role::Instant { .. });
        let known = self.parameters.iter().zip(values).enumerate();
        known.filter(move |(_, (p, value))| is_shape(&p.role) && value.is_finite()).map(|(index, _)| index)
    }

    /// Its parameters in a run of `duration` s, such that it does nothing.
    pub fn neutral(&self, duration: f64) -> Vec<f64> {
        self.parameters.iter().map(|parameter| parameter.neutral(duration)).collect()
    }

    /// With these parameters it does nothing.
    pub fn is_off(&self, values: &[f64]) -> bool {
        self.parameters.iter().zip(values).all(|(parameter, value)| !parameter.switches() || *value == 0.0)
    }
}

/// `acc.bias` of `bias`.
fn member_id(kind: SensorKind, name: &str) -> String {
    format!("{kind}.{name}")
}

fn only(kind: SensorKind) -> &'static [SensorKind] {
    match kind {
        Acc => &[Acc],
        Gyr => &[Gyr],
        Mag => &[Mag],
    }
}

/// The SI-side unit of a sensor, as text.
pub(crate) fn si(kind: SensorKind) -> String {
    Unit::of(kind).first().map(ToString::to_string).unwrap_or_default()
}

/// One of three, by sensor.
fn of<T>(kind: SensorKind, acc: T, gyr: T, mag: T) -> T {
    match kind {
        Acc => acc,
        Gyr => gyr,
        Mag => mag,
    }
}

/// The axes' names, for parameters of which there is one an axis.
pub(crate) const XYZ: [&str; 3] = ["x", "y", "z"];

/// Every effect there is, in the order of the chain.
pub static CATALOGUE: LazyLock<Vec<Effect>> = LazyLock::new(|| {
    let mut list = vec![
        level_tilt::effect(),
        heading::effect(),
        encoder_offset::effect(),
        encoder_harmonic::effect(),
        axis_nonorthogonality::effect(),
        wobble::effect(),
        time_offset::effect(),
        rate_error::effect(),
        clock_jump::effect(),
        clock_wander::effect(),
        motion_mismatch::effect(),
        mount_slip::effect(),
        attitude_noise::effect(),
        position_noise::effect(),
        gravity_error::effect(),
        lever_arm::effect(),
        earth_rate::effect(),
        field_direction::effect(),
        field_drift::effect(),
        transient::effect(),
        field_gradient::effect(),
        gimbal_soft_iron::outer(),
        gimbal_soft_iron::middle(),
        gimbal_hard_iron::outer(),
        gimbal_hard_iron::middle(),
        motor_current::effect(),
        eddy_current::effect(),
    ];
    // What is done to a triad comes before what its output gains, and the filter sees all of that.
    for family in [bias::effect, scale::effect, misalignment::effect] {
        list.extend(SensorKind::ALL.map(family));
    }
    list.extend([soft_iron::effect(), hard_iron::effect()]);
    for family in [
        scale_quadratic::effect,
        scale_cubic::effect,
        scale_asymmetry::effect,
        cross_axis_product::effect,
        temp_bias::effect,
        temp_bias_quadratic::effect,
        temp_scale::effect,
        warmup::effect,
        bias_drift::effect,
        bias_step::effect,
    ] {
        list.extend(SensorKind::ALL.map(family));
    }
    list.extend([
        inner_lever_arm::effect(),
        vibration_rectification::effect(),
        hysteresis::effect(Acc),
        hysteresis::effect(Gyr),
        g_sensitivity::effect(),
        g2_sensitivity::effect(),
        angular_acceleration::effect(),
    ]);
    for family in [
        bandwidth::effect,
        noise_burst::effect,
        saturation::effect,
        stuck_samples::effect,
        axis_swap::effect,
        unit_error::effect,
    ] {
        list.extend(SensorKind::ALL.map(family));
    }
    list
});

/// Terms that the baseline has where a rig, a surveyed site or a housing does not fix them. They are fitted, never named
/// as a cause, and not part of the catalogue.
pub static NUISANCES: LazyLock<Vec<Effect>> = LazyLock::new(|| {
    let mut list = vec![
        field_dip::effect(),
        field_strength::effect(),
        lag::effect(Mag),
        lag::effect(Acc),
        room_gradient::effect(),
    ];
    list.extend(SensorKind::ALL.map(mounting::effect));
    list
});

/// The effect of an id.
pub fn find(id: &str) -> Option<&'static Effect> {
    CATALOGUE.iter().find(|effect| effect.id == id)
}

#[cfg(test)]
mod tests;
