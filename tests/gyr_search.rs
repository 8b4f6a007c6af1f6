//! A gyroscope without a rig whose nominal conversion is wrong: where Levenberg–Marquardt alone still arrives, where it
//! does not, and that a swarm and its polish do.

use imucal_core::{
    model::{parameterisation::FULL, turn::TurnModel},
    observation::Turn,
    solver::{
        LevenbergMarquardt,
        swarm::{Bounds, Settings, Swarm},
    },
    triad::Triad,
};
use imucal_host::{
    calibrate::{Calibration, Options, calibrate, outcome::Evidence},
    recording::{Nominal, Recording, SensorKind},
};
use imucal_tests::data;
use nalgebra::{Matrix3, SVector, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// What peers find of this recording, LSB/(rad/s).
const PEERS: [f64; 3] = [4777.99, 4764.37, 4773.13];

fn recording() -> Option<Recording> {
    Some(Recording::read(&data::real("xsens-mti.csv.gz")?).expect("a good recording"))
}

/// The recording as a manifest would have it whose nominal conversion of the gyroscope is this.
fn with_nominal(recording: &Recording, offset: f64, per_unit: f64) -> Recording {
    let mut changed = recording.clone();
    let gyr = changed.gyr.as_mut().expect("recorded");
    let was = gyr.nominal;
    gyr.nominal = Nominal { offset, per_unit };
    let now = gyr.nominal;
    gyr.values
        .iter_mut()
        .for_each(|value| *value = value.map(|v| (was.to_raw(v) - now.offset) / now.per_unit));
    changed
}

fn calibrated(recording: &Recording) -> Calibration {
    let options = Options { multipliers: vec![4.0], ..Options::default() };
    calibrate(recording, &options, &|_| {})
}

#[test]
fn explore() {
    let Some(recording) = recording() else { return };
    let nominal = recording.gyr.as_ref().expect("recorded").nominal;
    for factor in [0.4, 0.5, 0.6, 0.7, 0.8, 1.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.5] {
        let per_degree = nominal.per_unit.to_radians();
        let changed = with_nominal(&recording, nominal.offset + 8.0 * per_degree, factor * nominal.per_unit);
        let calibration = calibrated(&changed);
        let outcome = calibration.sensor(SensorKind::Gyr).expect("recorded");
        let Some(fit) = outcome.fit.as_ref() else {
            println!("{factor}: {:?}", outcome.verdict);
            continue;
        };
        println!(
            "{factor}: {:?} {:?} {}",
            outcome.verdict.as_ref().err(),
            fit.raw_triad().gain.diagonal().map(f64::recip).as_slice(),
            fit.search.expect("gyr").note()
        );
    }
    let calibration = calibrated(&recording);
    let evidence = calibration.sensor(SensorKind::Gyr).and_then(|s| s.evidence.as_ref());
    let Some(Evidence::Turns(known)) = evidence else { panic!("accepted") };
    let turns: Vec<Turn<'_, f64>> = known.iter().map(|t| t.data.between(t.before, t.after)).collect();
    let model = TurnModel { turns: &turns, form: FULL };
    let polish = |from: SVector<f64, 12>| {
        let mut solver = LevenbergMarquardt::new(from, Default::default());
        let report = solver.run(&model);
        (report.termination, report.cost, *solver.theta())
    };
    let optimum = polish(FULL.theta(&Triad::identity()));
    println!("optimum {:?} {}", optimum.0, optimum.1);
    for (scale, degrees) in [
        (0.0, 2.0),
        (0.0, 5.0),
        (0.0, 10.0),
        (0.0, 20.0),
        (0.2, 0.0),
        (-0.2, 0.0),
        (0.2, 5.0),
        (-0.2, 5.0),
        (0.2, 10.0),
        (-0.2, 10.0),
        (0.0, 40.0),
    ] {
        let trials: Vec<(bool, bool, u32)> = (0..8u64)
            .into_par_iter()
            .map(|seed| {
                let sign = |bit: u64| if seed >> bit & 1 == 1 { 1.0 } else { -1.0 };
                let off = Vector3::new(sign(0), sign(1), sign(2)) * f64::to_radians(degrees);
                let start = FULL.theta(&Triad { gain: Matrix3::identity() * (1.0 + scale), bias: off });
                let reach = FULL.theta(&Triad {
                    gain: Matrix3::repeat(0.3),
                    bias: Vector3::repeat(f64::to_radians(degrees.max(2.0) * 1.3)),
                });
                let alone = polish(start);
                let mut swarm = Swarm::<f64, 40, 12, _>::new(
                    Bounds::around(&start, &reach).unwrap(),
                    Settings::default(),
                );
                let report = swarm.run(&model, &mut ChaCha8Rng::seed_from_u64(seed));
                let polished = polish(*swarm.best());
                let near = |cost: f64| cost < 1.001 * optimum.1;
                (near(alone.1), near(polished.1), report.evaluations)
            })
            .collect();
        println!(
            "{scale} {degrees}: LM {} of 8, swarm {} of 8, {:?}",
            trials.iter().filter(|t| t.0).count(),
            trials.iter().filter(|t| t.1).count(),
            trials[0].2
        );
    }
    let _ = PEERS;
}
