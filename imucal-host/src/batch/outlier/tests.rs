use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;
use crate::batch::{entry::Standing, parameter::Parameter};

/// A unit whose sensor has these parameters with this standard error.
pub(in crate::batch) fn unit(name: usize, kind: &str, values: &[f64], std_error: f64) -> Entry {
    let parameter = |(name, value): (&&str, &f64)| Parameter {
        name: (*name).to_owned(),
        value: Some(*value),
        std_error: Some(std_error),
    };
    let sensor = Sensor {
        sensor: SensorKind::Acc,
        status: "accepted".into(),
        reason: None,
        model: "T9".into(),
        passed: true,
        kind: Some(kind.to_owned()),
        unit_in: Some("counts".into()),
        unit_out: None,
        observations: None,
        rms: None,
        held_out_rms: None,
        stored: Vec::new(),
        of_sensor: OF_SENSOR.iter().zip(values).map(parameter).collect(),
    };
    Entry::for_tests(&format!("unit {name:04}"), Standing::Calibrated, vec![sensor])
}

fn drawn(count: usize, rng: &mut ChaCha8Rng) -> Vec<Entry> {
    let mut normal = || -> f64 { StandardNormal.sample(rng) };
    (0..count).map(|k| unit(k, "a", &std::array::from_fn::<f64, 12, _>(|_| normal()), 0.0)).collect()
}

#[test]
fn healthy_units_have_an_outlier_less_than_once_in_a_hundred_batches() {
    let mut rng = ChaCha8Rng::seed_from_u64(20);
    for (count, batches) in [(8, 4000), (9, 4000), (11, 3000), (16, 2000), (40, 1000)] {
        let alarms = (0..batches).filter(|_| !outliers(&drawn(count, &mut rng)).outliers.is_empty()).count();
        let share = alarms as f64 / f64::from(batches);
        println!("{count} units: {alarms} of {batches}");
        assert!(share < 0.01, "{count} units: {share}");
    }
}

#[test]
fn a_unit_far_from_the_others_is_found_by_its_parameter_and_no_other() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut units = drawn(40, &mut rng);
    let planted = units[17].sensors[0].of_sensor.iter_mut().find(|found| found.name == "skew_zx").unwrap();
    planted.value = Some(-12.0);
    let found = outliers(&units);
    assert_eq!(found.outliers.len(), 1, "{found:?}");
    let outlier = &found.outliers[0];
    assert_eq!((outlier.name.as_str(), outlier.parameter), ("unit 0017", "skew_zx"));
    assert!(outlier.z < -outlier.limit);
}

#[test]
fn a_unit_that_is_measured_badly_is_not_taken_for_another() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut units = drawn(40, &mut rng);
    units[17] = unit(17, "a", &[12.0; 12], 12.0);
    assert_eq!(outliers(&units).outliers, []);
}

#[test]
fn units_of_two_kinds_are_not_compared_and_few_are_not_judged() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut units = drawn(40, &mut rng);
    units.extend((0..7).map(|k| unit(100 + k, "b", &[f64::from(k as u32) * 1e3; 12], 0.0)));
    let found = outliers(&units);
    assert_eq!(found.outliers, []);
    let sizes: Vec<_> = found.populations.iter().map(|kind| (kind.units, kind.limit.is_some())).collect();
    assert_eq!(sizes, [(40, true), (7, false)]);
}

#[test]
fn equal_units_do_not_differ_and_a_single_other_one_does() {
    let mut units: Vec<Entry> = (0..9).map(|k| unit(k, "a", &[0.5; 12], 1e-3)).collect();
    assert_eq!(outliers(&units).outliers, []);
    units[3] = unit(3, "a", &[1.5; 12], 1e-3);
    let found = outliers(&units).outliers;
    assert!(found.len() == 12 && found.iter().all(|outlier| outlier.name == "unit 0003"), "{found:?}");
}

#[test]
fn the_limit_is_that_of_students_t() {
    // Of SciPy 1.17: -t.ppf(0.005 / 1440, 0.37 * 40), and -t.ppf(0.005 / 96, 0.37 * 8).
    for (units, tested, expected) in [(40, 1440, 6.754252174503152), (8, 96, 28.5403390225053)] {
        let found = limit(units, tested);
        assert!((found / expected - 1.0).abs() < 1e-6, "{found}");
    }
}
