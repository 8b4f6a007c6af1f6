use super::*;
use crate::{
    diagnosis::settings::Settings,
    recording::{Triple, check::integrity, manifest::Axis},
    simulator::{Place, Programme, Replay, Simulation, UnitKind},
};

fn replay(recording: &Recording) -> Replay {
    let axes: [Axis; 3] = recording.manifest.rig.as_ref().unwrap().axes.clone().unwrap().try_into().unwrap();
    let temperature = recording.temperature.clone().unwrap();
    Replay::new(&recording.time, recording.gimbal.as_ref().unwrap(), &temperature, axes, Place::ankara())
        .unwrap()
}

fn checked(recording: &Recording) -> Conventions {
    check(recording, &integrity::inspect(recording), &replay(recording), Settings::default().source)
}

fn simulation(unit: UnitKind, programme: Programme, seed: u64) -> Simulation {
    Simulation { unit, programme, seed, ..Simulation::default() }
}

fn with(id: &str, size: f64, unit: UnitKind, programme: Programme, seed: u64) -> (Conventions, Dose) {
    let mut simulation = simulation(unit, programme, seed);
    simulation.add(effect::find(id).unwrap(), size).unwrap();
    (checked(&simulation.record("run.csv").unwrap()), simulation.doses.remove(0))
}

/// Found alone, each parameter within four standard errors and `share` of its value.
fn assert_recovered(found: &Conventions, dose: &Dose, share: f64) {
    let ids: Vec<&str> = found.findings.iter().map(|finding| finding.effect.id.as_str()).collect();
    assert_eq!(ids, [dose.effect.id.as_str()], "{:?}", found.remarks);
    assert!(found.findings[0].p_value < 1e-6);
    for (amount, truth) in found.findings[0].parameters.iter().zip(&dose.values) {
        let (value, std) = (amount.value.unwrap(), amount.std_error.unwrap());
        assert!(
            (value - truth).abs() <= 4.0 * std + share * truth.abs(),
            "{} {value} ± {std}, {truth}",
            amount.name
        );
    }
}

#[test]
fn healthy_recordings_of_both_units_have_nothing_wrong() {
    for unit in UnitKind::ALL {
        for seed in 0..20 {
            let programme = Programme::ALL[seed as usize % Programme::ALL.len()];
            let mut simulation = simulation(unit, programme, seed);
            simulation.rate = 50.0;
            let found = checked(&simulation.record("run.csv").unwrap());
            assert!(
                found.findings.is_empty() && found.remarks.is_empty() && found.contradiction.is_none(),
                "{unit:?} {programme:?} {seed}: {found:?}"
            );
        }
    }
}

#[test]
fn a_smooth_recording_without_noise_has_nothing_wrong() {
    let mut simulation = simulation(UnitKind::Mtx, Programme::MultiPosition, 3);
    simulation.noise = false;
    let found = checked(&simulation.record("run.csv").unwrap());
    assert!(found.findings.is_empty() && found.remarks.is_empty(), "{found:?}");
}

#[test]
fn swapped_axes_of_any_sensor_are_named_by_their_code() {
    for (at, kind) in SensorKind::ALL.into_iter().enumerate() {
        for code in [1.0, 10.0, 24.0, 47.0] {
            let programme = [Programme::MultiPosition, Programme::Rates][at % 2];
            let (found, dose) = with(&format!("{kind}.axis_swap"), code, UnitKind::Gx2, programme, 5);
            assert_recovered(&found, &dose, 0.0);
        }
    }
}

#[test]
fn a_unit_turned_as_a_whole_is_remarked_and_no_sensor_is_blamed() {
    let mut simulation = simulation(UnitKind::Mtx, Programme::Rates, 2);
    // y, −x, z
    let code = (0..effect::axis_swap::CODES).find(|code| {
        effect::axis_swap::signed_permutation(*code).unwrap()
            == nalgebra::Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    });
    for kind in SensorKind::ALL {
        simulation.add(effect::find(&format!("{kind}.axis_swap")).unwrap(), code.unwrap() as f64).unwrap();
    }
    let found = checked(&simulation.record("run.csv").unwrap());
    assert!(found.findings.is_empty(), "{found:?}");
    assert!(found.remarks[0].contains("(+y, −x, +z)"), "{:?}", found.remarks);
}

#[test]
fn a_wrong_unit_is_named_with_its_power() {
    for kind in SensorKind::ALL {
        for size in [1.0, -1.0] {
            let (found, dose) =
                with(&format!("{kind}.unit_error"), size, UnitKind::Mtx, Programme::MultiPosition, 7);
            assert_recovered(&found, &dose, 1e-9);
        }
        let (found, dose) =
            with(&format!("{kind}.unit_error"), 1.0, UnitKind::Gx2, Programme::MultiPosition, 302);
        assert_recovered(&found, &dose, 1e-9);
    }
}

#[test]
fn a_scale_that_no_unit_explains_is_remarked() {
    let (found, _) = with("acc.unit_error", 0.4, UnitKind::Mtx, Programme::MultiPosition, 7);
    assert!(found.findings.is_empty() && found.remarks[0].contains("no unit explains"), "{found:?}");
}

#[test]
fn clipping_below_full_scale_is_found_with_its_shortfall() {
    for (kind, programme) in [
        (SensorKind::Acc, Programme::MultiPosition),
        (SensorKind::Gyr, Programme::Rates),
        (SensorKind::Mag, Programme::Full),
    ] {
        let (found, dose) = with(&format!("{kind}.saturation"), 1.0, UnitKind::Mtx, programme, 11);
        assert_recovered(&found, &dose, 1e-3);
    }
}

#[test]
fn repeated_samples_are_found_with_their_share() {
    for kind in SensorKind::ALL {
        for unit in UnitKind::ALL {
            let (found, dose) = with(&format!("{kind}.stuck_samples"), 1.0, unit, Programme::Gyroscope, 4);
            assert_recovered(&found, &dose, 0.0);
        }
    }
}

#[test]
fn a_noisy_stretch_is_found_with_its_times_and_excess() {
    for kind in SensorKind::ALL {
        for (seed, unit) in UnitKind::ALL.into_iter().enumerate() {
            for size in [0.3, 1.0] {
                let programme = Programme::ALL[2 * seed + kind as usize];
                let (found, dose) = with(&format!("{kind}.noise_burst"), size, unit, programme, seed as u64);
                assert_recovered(&found, &dose, 0.0);
            }
        }
    }
}

#[test]
fn encoders_read_in_another_order_or_sign_or_unit_are_recognised_by_all_sensors() {
    type Mistake = fn(&mut Recording);
    let mistakes: [(Mistake, &str); 4] = [
        (|r| r.gimbal.iter_mut().flatten().for_each(|row| row.swap(0, 2)), "outer from gimbal_inner"),
        (|r| r.gimbal.iter_mut().flatten().for_each(|row| row[1] = -row[1]), "middle reversed"),
        (
            |r| r.manifest.rig.iter_mut().for_each(|rig| rig.axes = Some(vec![Axis::X, Axis::Y, Axis::Z])),
            "axes = [",
        ),
        (
            |r| r.gimbal.iter_mut().flatten().for_each(|row| *row = row.map(f64::to_radians)),
            "angles in radians",
        ),
    ];
    for (mistake, words) in mistakes {
        let mut recording = simulation(UnitKind::Mtx, Programme::MultiPosition, 6).record("run.csv").unwrap();
        mistake(&mut recording);
        let found = checked(&recording);
        assert!(found.findings.is_empty() && found.remarks.is_empty(), "{found:?}");
        assert!(found.contradiction.as_deref().is_some_and(|text| text.contains(words)), "{found:?}");
    }
}

#[test]
fn a_magnetometer_that_follows_another_heading_says_which() {
    let mut recording = simulation(UnitKind::Mtx, Programme::MultiPosition, 6).record("run.csv").unwrap();
    // What a base that points 40° east of north sees is the field turned 40° to the west.
    let turn = nalgebra::Rotation3::from_axis_angle(&nalgebra::Vector3::z_axis(), 40f64.to_radians());
    let replay = replay(&recording);
    let Triple { values, .. } = recording.mag.as_mut().unwrap();
    for (value, time) in values.iter_mut().zip(&recording.time) {
        let truth = replay.truth(*time, &|_| ());
        let c_t_n = truth.c_p_n * truth.c_t_p;
        *value += c_t_n.tr_mul(&(turn.inverse() * (c_t_n * truth.b_t))) - truth.b_t;
    }
    let found = checked(&recording);
    assert!(found.findings.is_empty(), "{found:?}");
    assert!(
        found.contradiction.as_deref().is_some_and(|text| text.contains("40° east of north")),
        "{found:?}"
    );
}

#[test]
fn a_jump_of_a_bias_is_no_noise() {
    for kind in SensorKind::ALL {
        let (found, _) = with(&format!("{kind}.bias_step"), 30.0, UnitKind::Gx2, Programme::Full, 9);
        assert!(found.findings.is_empty(), "{found:?}");
    }
}
