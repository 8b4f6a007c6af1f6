use std::sync::LazyLock;

use nalgebra::Vector3;
use sha2::{Digest, Sha256};

use super::*;
use crate::{
    effect::{Act, CATALOGUE, Role, Stage, find},
    recording::{
        Recording,
        SensorKind::{self, Acc, Mag},
    },
    simulator::{chain::Chain, place::EARTH_RATE},
};

/// A short recording with rests, rates and swings of temperature.
fn short() -> Simulation {
    Simulation { programme: Programme::Sinusoids, rate: 50.0, ..Simulation::default() }
}

fn with(id: &str, size: f64) -> Simulation {
    let mut simulation = short();
    simulation.add(find(id).unwrap(), size).unwrap();
    simulation
}

/// Without noise; counts are not rounded then.
fn clean(simulation: &Simulation) -> Recording {
    Simulation { noise: false, counts: false, ..simulation.clone() }.record("clean.csv").unwrap()
}

fn bits(recording: &Recording, kind: SensorKind) -> Vec<[u64; 3]> {
    let values = &recording.sensor(kind).unwrap().values;
    values.iter().map(|v| [v.x, v.y, v.z].map(f64::to_bits)).collect()
}

fn fingerprint(recording: &Recording) -> String {
    let mut hash = Sha256::new();
    let mut add = |value: f64| hash.update(value.to_bits().to_le_bytes());
    recording.time.iter().copied().for_each(&mut add);
    for kind in SensorKind::ALL {
        recording.sensor(kind).unwrap().values.iter().flatten().copied().for_each(&mut add);
    }
    recording.temperature.iter().flatten().copied().for_each(&mut add);
    recording.gimbal.iter().flatten().flatten().copied().for_each(&mut add);
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

static HEALTHY: LazyLock<Recording> = LazyLock::new(|| short().record("healthy.csv").unwrap());

#[test]
fn without_noise_and_effects_the_output_is_the_unified_model_exactly() {
    let simulation = Simulation { noise: false, counts: false, ..short() };
    let recording = simulation.record("clean.csv").unwrap();
    let (unit, schedule) = (simulation.unit_under_test(), simulation.schedule().unwrap());
    for (row, time) in recording.time.iter().enumerate() {
        let truth = schedule.truth(*time, &|_| ());
        for (kind, v_t) in SensorKind::ALL.into_iter().zip([truth.f_t, truth.w_it_t, truth.b_t]) {
            let model = unit.triad(kind).triad.predict(&(unit.c_t_q * v_t)).unwrap();
            assert_eq!(recording.sensor(kind).unwrap().values[row], model, "{kind} {time}");
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_bits_on_every_machine() {
    // Made by this simulator: the 20 Hz swings of seed 1 with two effects. A change of it is a change of all seeds.
    const GOLDEN: &str = "1a9b9f470840ca7329a61ddd03674822317978517891235abfea7e1f55eeb637";
    let mut simulation = Simulation { rate: 20.0, ..short() };
    simulation.add(find("gyr.temp_bias").unwrap(), 1.0).unwrap();
    simulation.add(find("rig.wobble").unwrap(), 1.0).unwrap();
    let recorded = fingerprint(&simulation.record("golden.csv").unwrap());
    assert_eq!(recorded, GOLDEN);
    simulation.seed = 2;
    assert_ne!(fingerprint(&simulation.record("golden.csv").unwrap()), GOLDEN);
}

#[test]
fn another_recording_of_a_unit_is_of_the_same_one_and_scatters_otherwise() {
    let again = short().again();
    assert_eq!(again.unit_under_test(), short().unit_under_test());
    assert_eq!(again.again().unit_under_test(), short().unit_under_test());
    assert_ne!(again.record("again.csv").unwrap().acc, short().record("short.csv").unwrap().acc);
}

#[test]
fn every_effect_alters_its_sensors_and_no_other_and_at_size_zero_nothing() {
    for effect in CATALOGUE.iter() {
        let recorded = with(&effect.id, 1.0).record("on.csv").unwrap();
        let mut altered = false;
        for kind in SensorKind::ALL {
            let same = bits(&recorded, kind) == bits(&HEALTHY, kind);
            assert!(same || effect.sensors.contains(&kind), "{} touches {kind}", effect.id);
            altered |= !same;
        }
        assert!(altered, "{} does nothing", effect.id);
        assert_eq!(recorded.gimbal, HEALTHY.gimbal, "{}", effect.id);
        // The thermometer is on the sensor's clock.
        let clock = effect.act.stage() == Stage::Clock;
        assert!(clock || recorded.temperature == HEALTHY.temperature, "{}", effect.id);
        let off = with(&effect.id, 0.0).record("healthy.csv").unwrap();
        assert_eq!(fingerprint(&off), fingerprint(&HEALTHY), "{}", effect.id);
    }
}

#[test]
fn without_noise_a_recording_is_smooth_in_every_amplitude() {
    let base = clean(&short());
    // What clips, repeats or is one of a list is not.
    let smooth = |effect: &Effect| effect.act.stage() < Stage::Signal;
    for effect in CATALOGUE.iter().filter(|effect| smooth(effect)) {
        let mut simulation = with(&effect.id, 1.0);
        // Heading and the like are hardly seen by the accelerometer.
        let kind = effect.sensors[effect.sensors.len() - 1];
        let full = simulation.doses[0].values.clone();
        let mut difference = |share: f64| {
            for ((value, full), parameter) in
                simulation.doses[0].values.iter_mut().zip(&full).zip(&effect.parameters)
            {
                *value = if parameter.role == Role::Amplitude { full * share } else { *full };
            }
            let recording = clean(&simulation);
            let pairs = recording.sensor(kind).unwrap().values.iter().zip(&base.sensor(kind).unwrap().values);
            pairs.map(|(with, without)| (with - without) / share).collect::<Vec<_>>()
        };
        let (small, half) = (difference(1e-3), difference(5e-4));
        let norm = |rows: &[Vector3<f64>]| rows.iter().map(|v| v.norm_squared()).sum::<f64>().sqrt();
        let change: Vec<_> = small.iter().zip(&half).map(|(a, b)| a - b).collect();
        assert!(norm(&small) > 0.0 && norm(&change) < 0.01 * norm(&small), "{}", effect.id);
    }
}

#[test]
fn effects_are_applied_in_the_chain_s_order_whatever_the_order_given() {
    let (mut one, mut other) = (short(), short());
    for id in ["acc.saturation", "acc.scale_cubic", "rig.level_tilt", "acc.bandwidth"] {
        one.add(find(id).unwrap(), 1.0).unwrap();
        other.doses.insert(0, one.doses[one.doses.len() - 1].clone());
    }
    assert_eq!(fingerprint(&one.record("a.csv").unwrap()), fingerprint(&other.record("a.csv").unwrap()));
}

#[test]
fn a_late_clock_shows_the_rig_as_it_was() {
    let offset = -0.02;
    let mut simulation = short();
    let effect = find("clk.time_offset").unwrap();
    simulation.doses = vec![Dose { effect, values: vec![offset] }];
    let (late, prompt) = (clean(&simulation), clean(&short()));
    // Just one row at 50 Hz, while the encoders keep to theirs.
    let (late_acc, prompt_acc) = (&late.acc.unwrap().values, &prompt.acc.unwrap().values);
    for row in 1..late_acc.len() {
        assert!((late_acc[row] - prompt_acc[row - 1]).norm() < 1e-9, "{row}");
    }
    assert_eq!(late.gimbal, prompt.gimbal);
}

#[test]
fn a_fast_clock_stamps_later_than_the_rig() {
    let Act::Clock(alter) = find("clk.rate_error").unwrap().act else { panic!("not a clock") };
    assert!((alter(&[1e-4], 1000.1) - 1000.0).abs() < 1e-9);
}

#[test]
fn saturation_clips_at_the_reduced_full_scale() {
    let recording = with("acc.saturation", 1.0).record("clipped.csv").unwrap();
    let limit = recording.acc.as_ref().unwrap().full_scale_si().unwrap() / 7.0;
    let step = 1.0 / recording.manifest.counts.acc.unwrap().per_unit;
    let largest = recording.acc.unwrap().values.iter().map(|v| v.amax()).fold(0.0, f64::max);
    assert!(largest <= limit + step && largest >= limit - step, "{largest} {limit}");
}

#[test]
fn the_converter_gives_whole_counts_of_sixteen_bits() {
    for triple in [&HEALTHY.acc, &HEALTHY.gyr, &HEALTHY.mag].into_iter().flatten() {
        for value in triple.values.iter().flatten() {
            let raw = triple.nominal.to_raw(*value);
            assert!((raw - raw.round()).abs() < 1e-6 && (0.0..65_536.0).contains(&raw), "{raw}");
        }
    }
}

#[test]
fn rests_show_gravity_and_the_rate_shows_earth_s_rotation() {
    let schedule = short().schedule().unwrap();
    for time in schedule.rests() {
        let truth = schedule.truth(time, &|_| ());
        assert!((truth.f_t.norm() - schedule.place().gravity).abs() < 1e-12);
        assert!((truth.w_it_t.norm() - EARTH_RATE).abs() < 1e-15, "{time}");
    }
}

#[test]
fn the_rate_stays_the_derivative_of_the_attitude_on_a_bad_rig() {
    let schedule = short().schedule().unwrap();
    let h = 1e-5;
    for effect in CATALOGUE.iter().filter(|effect| effect.act.stage() == Stage::Rig) {
        let doses = [Dose::sized(effect, 20.0, 1, 100.0)];
        for k in 0..100 {
            let t = 1.0 + 0.9 * f64::from(k);
            let rows = Chain::new(&doses).truth(&schedule, &[t - h, t, t + h]);
            let numeric = (rows[2].f_t - rows[0].f_t) / (2.0 * h);
            assert!((numeric + rows[1].w_pt_t.cross(&rows[1].f_t)).norm() < 1e-6, "{} {t}", effect.id);
            let dw = (rows[2].w_it_t - rows[0].w_it_t) / (2.0 * h);
            assert!((dw - rows[1].dw_it_t).norm() < 1e-3, "{} {t}", effect.id);
        }
    }
}

/// The truth with one effect less that without.
fn added(simulation: &Simulation, id: &str, values: &[f64], sensor: SensorKind) -> Vec<Vector3<f64>> {
    let doses = vec![Dose { effect: find(id).unwrap(), values: values.to_vec() }];
    let (with, without) = (clean(&Simulation { doses, ..simulation.clone() }), clean(simulation));
    let pairs = with.sensor(sensor).unwrap().values.iter().zip(&without.sensor(sensor).unwrap().values);
    pairs.map(|(with, without)| with - without).collect()
}

fn rms(rows: &[Vector3<f64>]) -> f64 {
    (rows.iter().map(|v| v.norm_squared()).sum::<f64>() / rows.len() as f64).sqrt()
}

fn difference(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

#[test]
fn in_a_steady_field_eddy_currents_look_like_a_late_magnetometer() {
    // Brisk sampling, since the filter takes its input as straight between rows.
    let fast = Simulation { rate: 500.0, ..short() };
    let by = |id| added(&fast, id, &[1e-3], Mag);
    let (eddy, late) = (by("mag.eddy_current"), by("mag.bandwidth"));
    assert!(rms(&difference(&eddy, &late)) < 0.05 * rms(&eddy));
}

#[test]
fn axes_that_share_a_lever_arm_are_the_accelerometer_s_lever_arm() {
    let arm = [0.03, -0.02, 0.05];
    let inner = added(&short(), "acc.inner_lever_arm", &[arm, arm, arm].concat(), Acc);
    let whole = added(&short(), "acc.lever_arm", &arm, Acc);
    // The inner arms are in the enclosure's axes, turned by up to a degree, and behind K.
    assert!(rms(&difference(&inner, &whole)) < 0.1 * rms(&whole));
}

#[test]
fn a_lever_arm_adds_the_centripetal_acceleration() {
    let simulation = Simulation { programme: Programme::Rates, ..short() };
    let schedule = simulation.schedule().unwrap();
    let doses = [Dose { effect: find("acc.lever_arm").unwrap(), values: vec![0.1, 0.0, 0.0] }];
    let times: Vec<f64> = (0..1600).map(|k| 0.1 * f64::from(k)).collect();
    let rows = Chain::new(&doses).truth(&schedule, &times);
    let steady = rows.iter().filter(|row| row.dw_it_t.norm() < 1e-3 && row.w_pt_t.z.abs() > 2.0);
    let mut found = 0;
    for row in steady {
        let added = row.f_t - schedule.truth(row.time, &|_| ()).f_t;
        let across = row.w_it_t.norm_squared() - row.w_it_t.x * row.w_it_t.x;
        assert!((added.x + 0.1 * across).abs() < 1e-3, "{added}");
        found += 1;
    }
    assert!(found > 20, "{found}");
}

#[test]
fn removing_all_of_earth_s_rotation_leaves_none() {
    let chain = [Dose { effect: find("gyr.earth_rate").unwrap(), values: vec![-1.0] }];
    let schedule = short().schedule().unwrap();
    let rest = schedule.rests()[0];
    assert!(Chain::new(&chain).truth(&schedule, &[rest])[0].w_it_t.norm() < 1e-18);
}

#[test]
fn a_recording_survives_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("simulated.csv.gz");
    HEALTHY.write(&path).unwrap();
    let read = Recording::read(&path).unwrap();
    assert_eq!(read.warnings, []);
    for kind in SensorKind::ALL {
        let pairs = read.sensor(kind).unwrap().values.iter().zip(&HEALTHY.sensor(kind).unwrap().values);
        assert!(pairs.into_iter().all(|(read, was)| (read - was).amax() < 1e-9));
    }
    assert_eq!(read.manifest, HEALTHY.manifest);
}

#[test]
fn impossible_rates_and_durations_are_refused() {
    let refusal = |simulation: Simulation| simulation.record("x.csv").unwrap_err();
    assert!(matches!(refusal(Simulation { rate: 0.0, ..short() }), SimulationError::Rate { .. }));
    assert!(matches!(refusal(Simulation { rate: f64::NAN, ..short() }), SimulationError::Rate { .. }));
    let long = Simulation { duration: Some(1e9), ..short() };
    assert!(matches!(refusal(long), SimulationError::TooLong { .. }));
    let short = Simulation { duration: Some(f64::NAN), ..short() };
    assert!(matches!(refusal(short), SimulationError::TooShort { .. }));
}
