//! Effects of the catalogue that are formulas, written in the notation of a user's file.

use std::path::Path;

use imucal_core::triad::Triad;
use nalgebra::Vector3;

use super::parse;
use crate::{
    effect::{Act, CATALOGUE, Effect, Input, SensorRun, Truth},
    recording::SensorKind,
    simulator::{Dose, Programme, Simulation, chain::Chain},
};

/// Effects of the catalogue that are no formula, `P.` for each sensor, and why.
const NO_FORMULAS: [(&str, &str); 38] = [
    ("ref.motion_mismatch", "it moves the machine"),
    ("ref.mount_slip", "it turns all that is sensed before the triads"),
    ("ref.attitude_noise", "it has no pattern"),
    ("ref.position_noise", "it has no pattern"),
    ("rig.level_tilt", "it moves the rig"),
    ("rig.heading", "it moves the rig"),
    ("rig.encoder_offset", "it moves the rig"),
    ("rig.encoder_harmonic", "it moves the rig"),
    ("rig.axis_nonorthogonality", "it moves the rig"),
    ("rig.wobble", "it moves the rig"),
    ("clk.time_offset", "it changes the time"),
    ("clk.rate_error", "it changes the time"),
    ("clk.jump", "it changes the time"),
    ("clk.wander", "it changes the time"),
    ("acc.gravity_error", "it changes gravity before the triad, along the vertical of the site"),
    ("acc.lever_arm", "it changes the force before the triad; acc.inner_lever_arm holds it as a formula"),
    ("gyr.earth_rate", "it takes a rate out that no input tells from the table's"),
    ("mag.field_direction", "it turns the field about the vertical, which is no input"),
    ("mag.field_drift", "its vector lies in the room, whose axes are no input"),
    ("mag.transient", "its vector lies in the room, whose axes are no input"),
    ("mag.field_gradient", "it depends on where in the room the sensor is"),
    ("mag.gimbal_soft_iron_outer", "a matrix in a gimbal's axes; those of gimbal_hard_iron_outer show how"),
    ("mag.gimbal_soft_iron_middle", "a matrix in a gimbal's axes; those of gimbal_hard_iron_middle show how"),
    ("mag.motor_current", "vectors in three gimbals' axes; those of gimbal_hard_iron show how"),
    ("P.bias", "a term of the triad"),
    ("P.scale", "a term of the triad"),
    ("P.misalignment", "a term of the triad"),
    ("mag.soft_iron", "a term of the triad"),
    ("mag.hard_iron", "a term of the triad"),
    ("P.temp_scale", "its amplitude divides: it is no multiple of a formula"),
    ("acc.hysteresis", "play remembers more than lag and mean do"),
    ("gyr.hysteresis", "play remembers more than lag and mean do"),
    ("P.bandwidth", "it filters the output with all effects in it"),
    ("P.noise_burst", "it changes noise"),
    ("P.saturation", "it changes a limit"),
    ("P.stuck_samples", "it changes samples"),
    ("P.axis_swap", "it changes samples"),
    ("P.unit_error", "it changes samples"),
];

fn twins() -> Vec<&'static Effect> {
    let each =
        SensorKind::ALL.map(|kind| include_str!("twins_of_each.toml").replace("SENSOR", kind.prefix()));
    let texts = each.iter().map(String::as_str).chain([include_str!("twins.toml")]);
    texts.flat_map(|text| parse(text, Path::new("twins.toml")).unwrap()).collect()
}

/// Twins of an effect, each with the places of its amplitudes among the effect's own.
fn twins_of(effect: &Effect) -> Vec<(&'static Effect, Vec<usize>)> {
    let (sensor, name) = effect.id.split_once('.').unwrap();
    let find =
        |suffix: &str| twins().into_iter().find(|twin| twin.id == format!("{sensor}.twin_{name}{suffix}"));
    let amplitudes = effect.amplitudes().count();
    match find("") {
        Some(twin) => vec![(twin, (0..amplitudes).collect())],
        None => {
            let column = |at: usize| (0..amplitudes / 3).map(|row| 3 * row + at).collect();
            let place = |at: usize| if amplitudes == 9 { column(at) } else { vec![at] };
            let twins = ["_x", "_y", "_z"].iter().enumerate();
            twins.filter_map(|(at, suffix)| Some((find(suffix)?, place(at)))).collect()
        }
    }
}

struct Run {
    truth: Vec<Truth>,
    input: Vec<Input>,
    triad: Triad<f64>,
}

fn run(kind: SensorKind) -> Run {
    let simulation = Simulation { programme: Programme::Mixed, ..Simulation::default() };
    let (schedule, unit) = (simulation.schedule().unwrap(), simulation.unit_under_test());
    // Rows that are not evenly apart.
    let times: Vec<f64> = (0..2500).map(|k| 0.04 * f64::from(k) + 0.01 * f64::from(k % 3)).collect();
    let truth = Chain::default().truth(&schedule, &times);
    let input = truth.iter().map(|row| Input::of(row).turned(&unit.c_t_q)).collect();
    Run { truth, input, triad: unit.triad(kind).triad }
}

impl Run {
    /// What an effect adds to the output of a sensor: of the drawn unit, or of an ideal one where it changes the field.
    fn added(&self, kind: SensorKind, doses: &[Dose], is_field: bool) -> Vec<Vector3<f64>> {
        let table: Vec<Input> = self.truth.iter().map(Input::of).collect();
        let (input, triad) = if is_field { (&table, Triad::identity()) } else { (&self.input, self.triad) };
        let k = triad.sensitivity().unwrap();
        let sensed: Vec<_> = input.iter().map(|row| k * row.given(kind)).collect();
        let mut output = vec![Vector3::zeros(); input.len()];
        let mut run = SensorRun { input, sensed: &sensed, output: &mut output };
        for dose in doses {
            match dose.effect.act {
                Act::Sensor(_, alter) => alter(&dose.values, &mut run.rows()),
                Act::Memory(_, alter) => alter(&dose.values, &mut run),
                Act::Formula(_, formula) => formula.add(&dose.values, &mut run).unwrap(),
                Act::Field(alter) => {
                    for (output, row) in run.output.iter_mut().zip(&self.truth) {
                        let mut altered = *row;
                        alter(&dose.values, &mut altered);
                        *output += altered.b_t - row.b_t;
                    }
                }
                _ => panic!("{}", dose.effect.id),
            }
        }
        output
    }
}

#[test]
fn effects_of_the_catalogue_that_are_formulas_have_a_twin_with_the_same_output() {
    let runs = SensorKind::ALL.map(run);
    let mut count = 0;
    for effect in CATALOGUE.iter() {
        let twins = twins_of(effect);
        if twins.is_empty() {
            continue;
        }
        let kind = effect.sensors[0];
        let run = &runs[kind as usize];
        let own = Dose::sized(effect, 2.0, 7, 90.0);
        let shapes: Vec<f64> = effect
            .parameters
            .iter()
            .zip(&own.values)
            .filter(|(p, _)| !p.switches())
            .map(|(_, v)| *v)
            .collect();
        let dose = |(twin, places): &(&'static Effect, Vec<usize>)| {
            let amplitudes = places.iter().map(|at| own.values[*at]);
            Dose { effect: twin, values: amplitudes.chain(shapes.clone()).collect() }
        };
        let doses: Vec<Dose> = twins.iter().map(dose).collect();
        let is_field = matches!(effect.act, Act::Field(_));
        let expected = run.added(kind, &[own], is_field);
        let found = run.added(kind, &doses, is_field);
        let most = |rows: &mut dyn Iterator<Item = f64>| rows.fold(0.0f64, f64::max);
        let size = most(&mut expected.iter().map(Vector3::amax));
        let apart = most(&mut expected.iter().zip(&found).map(|(a, b)| (a - b).amax()));
        assert!(size > 0.0 && apart <= 1e-12 * size, "{}: {apart} of {size}", effect.id);
        count += 1;
    }
    assert_eq!(count, 3 * 9 + 8);
}

#[test]
fn an_effect_of_the_catalogue_has_a_twin_or_there_is_a_reason() {
    for effect in CATALOGUE.iter() {
        let (_, name) = effect.id.split_once('.').unwrap();
        let reason = NO_FORMULAS.iter().find(|(id, _)| *id == effect.id || *id == format!("P.{name}"));
        assert_eq!(reason.is_some(), twins_of(effect).is_empty(), "{}", effect.id);
    }
}
