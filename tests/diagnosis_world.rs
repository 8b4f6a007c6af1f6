//! A simulator whose world is not the site's: its field points elsewhere, its gravity is another place's, or the recording's clock
//! does not run as its own does. The robot's own world and the simulator's are made apart, so that no effect of the catalogue makes
//! the difference that is looked for.

use imucal_host::{
    diagnosis::{Diagnosis, Options, Verdict, diagnose, finding::Amount},
    recording::{Recording, Stream},
    simulator::robot::{RobotKind, RobotScene},
};
use nalgebra::{Rotation3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What else an angle may be off by, rad; the errors that are stated leave it out.
const OFF: f64 = 5e-4;

const KINDS: [RobotKind; 3] = [RobotKind::Legged, RobotKind::Wheeled, RobotKind::Flying];

fn scene(kind: RobotKind, seed: u64) -> RobotScene {
    let mounting = Vector3::new(0.01, -0.02, 0.015);
    RobotScene { kind, seed, duration: 150.0, clock_offset: 0.013, mounting, ..RobotScene::default() }
}

/// What is said of a robot in one world and its simulator in another.
fn diagnosed(real: &RobotScene, simulator: &RobotScene) -> Diagnosis {
    let (real, simulated) =
        (real.record("world").expect("a robot"), simulator.record("world").expect("a robot"));
    compared(&real.real, &simulated.simulated)
}

fn compared(real: &Recording, simulated: &Recording) -> Diagnosis {
    diagnose(real, &Options { stream: Stream::of(simulated), ..Options::default() }, &|_| ())
}

/// Ids of the causes other than the clock's terms.
fn named(diagnosis: &Diagnosis) -> Vec<&str> {
    let ids = diagnosis.causes.iter().map(|cause| cause.effect.as_str());
    ids.filter(|id| !["clk.time_offset", "clk.rate_error"].contains(id)).collect()
}

fn amount<'d>(diagnosis: &'d Diagnosis, effect: &str, parameter: &str) -> &'d Amount {
    let cause = diagnosis.causes.iter().find(|cause| cause.effect == effect).expect("the cause");
    cause.parameters.iter().find(|amount| amount.name == parameter).expect("its parameter")
}

/// Within four standard errors, and what else may be off.
fn is_near(found: &Amount, truth: f64, off: f64) -> bool {
    let (value, error) = (found.value.expect("a value"), found.std_error.expect("an error"));
    (value - truth).abs() < 4.0 * error + off
}

#[test]
fn a_simulator_s_field_with_another_declination_and_dip_is_named_with_both_angles() {
    let angles = [(-0.6, 0.15), (0.2, 0.0), (0.05, -0.03)];
    for (seed, (kind, (declination, dip))) in KINDS.into_iter().zip(angles).enumerate() {
        let simulator = scene(kind, seed as u64);
        let mut real = simulator.clone();
        let field_n = simulator.place.field_n;
        let across = field_n.cross(&Vector3::z()).normalize();
        let turn = Rotation3::new(Vector3::z() * declination) * Rotation3::new(across * dip);
        real.place.field_n = turn * field_n;
        let diagnosis = diagnosed(&real, &simulator);
        let case = format!("{kind:?} {declination} {dip}");
        assert_eq!(named(&diagnosis), ["mag.field_direction"], "{case}");
        assert_eq!(diagnosis.verdict, Verdict::Explained, "{case}");
        for (name, truth) in [("declination", declination), ("dip", dip)] {
            let found = amount(&diagnosis, "mag.field_direction", name);
            assert!(is_near(found, truth, OFF), "{case} {name}: {found:?}");
        }
    }
}

#[test]
fn another_place_s_gravity_is_named_where_accelerations_tell_it_from_a_scale() {
    let simulator = scene(RobotKind::Flying, 2);
    let mut real = simulator.clone();
    real.place.gravity += 0.05;
    let diagnosis = diagnosed(&real, &simulator);
    assert_eq!(named(&diagnosis), ["acc.gravity_error"]);
    let found = amount(&diagnosis, "acc.gravity_error", "share");
    assert!(is_near(found, 0.05 / simulator.place.gravity, 0.0), "{found:?}");
}

#[test]
fn rows_that_are_lost_and_numbered_as_if_none_were_are_a_jump_of_the_clock_where_it_is_one_and_refused_where_they_are_many()
 {
    let pair = scene(RobotKind::Wheeled, 4).record("lost").expect("a robot");
    let numbered = |is_lost: &dyn Fn(usize) -> bool| {
        let mut real = pair.real.clone();
        let rows: Vec<usize> = (0..real.rows()).filter(|row| !is_lost(*row)).collect();
        for values in [&mut real.acc, &mut real.gyr, &mut real.mag].into_iter().flatten() {
            values.values = rows.iter().map(|row| values.values[*row]).collect();
        }
        real.temperature = real.temperature.map(|own| rows.iter().map(|row| own[*row]).collect());
        real.time.truncate(rows.len());
        compared(&real, &pair.simulated)
    };
    // Twelve rows at 200 Hz.
    let once = numbered(&|row| (15_000..15_012).contains(&row));
    assert_eq!(named(&once), ["clk.jump"]);
    assert!(is_near(amount(&once, "clk.jump", "jump"), 0.06, 0.0), "{:?}", once.causes);
    // One in forty, here and there.
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let lost: Vec<bool> = (0..pair.real.rows()).map(|_| random.random::<f64>() < 0.025).collect();
    let many = numbered(&|row| lost[row]);
    assert_eq!(many.verdict, Verdict::NotTestable);
    assert!(many.remarks.iter().any(|remark| remark.contains("rows seem to be lost")), "{:?}", many.remarks);
}
