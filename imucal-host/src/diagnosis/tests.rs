use std::sync::LazyLock;

use nalgebra::{DMatrix, DVector, Vector3};

use crate::{
    diagnosis::{
        Options, Verdict, diagnose,
        finding::ProfileBin,
        library::{
            candidates::{Candidates, Setting},
            evidence::Projected,
        },
        mixed_model::{
            design::{Channel, Normal},
            noise::FAR,
        },
        residual::{block::Means, forward_model::ForwardModel},
        screening::preparation::Preparation,
        search::{
            linearisation::Linearisation,
            refit::{Fit, refit},
        },
        settings::Settings,
    },
    effect::find,
    recording::{Recording, SensorKind},
    simulator::{
        Dose, DriftKind, NoiseLevel, Programme, SimulatedUnit, Simulation, Tumble, UnitKind, record,
    },
};

fn simulation(seed: u64) -> Simulation {
    Simulation { programme: Programme::Full, rate: 25.0, seed, ..Simulation::default() }
}

static HEALTHY: LazyLock<Recording> = LazyLock::new(|| simulation(11).record("healthy").unwrap());

/// The problem about a healthy recording's baseline.
fn with_linear<T>(check: impl FnOnce(Linearisation<'_>) -> T) -> T {
    with_fit(&HEALTHY, |linear, _| check(linear))
}

/// Likewise, and the fit.
fn with_fit<T>(recording: &Recording, check: impl FnOnce(Linearisation<'_>, &Fit) -> T) -> T {
    let settings = Settings::default();
    let preparation = Preparation::new(recording, None, None, &settings).unwrap();
    let (usable, movement) = (preparation.usable.clone(), &*preparation.movement);
    let scene = ForwardModel::new(recording, usable, movement, preparation.triads, &settings);
    let setting = Setting {
        kinds: &scene.kinds,
        thermometer: true,
        calibrated: &[],
        provided: settings.source,
        field_known: true,
    };
    let candidates = Candidates::new(&setting, &[], &[]);
    let doses = candidates
        .baseline
        .iter()
        .map(|effect| Dose { effect, values: vec![0.0; effect.parameters.len()] })
        .collect();
    let fit = refit(&scene, Fit::of(&scene, doses).unwrap(), None).unwrap();
    let noise = Linearisation::fitted_alone(&scene, &candidates, &fit).unwrap().weighing.white(&fit.residual);
    check(Linearisation::new(&scene, &candidates, &fit, &noise, None).unwrap(), &fit)
}

#[test]
fn a_healthy_residual_whitened_by_its_own_noise_has_the_energy_of_noise() {
    with_linear(|linear| {
        let white = linear.weighing.white(&linear.scene.residual(&[]).unwrap());
        let judged = linear.judge(&[], &white, &SensorKind::ALL, &FAR).unwrap();
        let normal = linear.design.normal(&linear.precisions(&judged.noise), &linear.baseline);
        let n = normal.score.len();
        let information = normal.information.clone() + DMatrix::identity(n, n) * 1e-8;
        let left = normal.energy - normal.score.dot(&information.cholesky().unwrap().solve(&normal.score));
        let counts = linear.scene.counts.iter().flatten().filter(|count| **count > 0).count();
        let freedom = (3 * counts - n) as f64;
        // Noise in motion is the larger of two estimates: too much of it costs power, too little would cost honesty.
        assert!((0.87..1.03).contains(&(left / freedom)), "{left} of {freedom}");
    });
}

#[test]
fn a_residual_that_is_simulated_in_parts_is_that_of_the_whole_run() {
    with_linear(|linear| {
        let scene = linear.scene;
        // Of each stage, and one that looks at other rows.
        for id in ["rig.wobble", "clk.time_offset", "mag.field_drift", "acc.scale_cubic", "gyr.bandwidth"] {
            let doses = [Dose::sized(find(id).unwrap(), 3.0, 1, scene.duration())];
            let residual = scene.residual(&doses).unwrap();
            for (kind, output) in scene.simulated(&doses).unwrap() {
                let recorded = &scene.recording.sensor(kind).unwrap().values;
                let mean = |rows: std::ops::Range<usize>| {
                    let used: Vec<usize> = rows.filter(|row| scene.usable[kind as usize][*row]).collect();
                    let sum =
                        used.iter().fold(Vector3::zeros(), |sum, row| sum + (recorded[*row] - output[*row]));
                    if used.is_empty() { sum } else { sum / used.len() as f64 }
                };
                let whole: Vec<_> = scene.blocks.iter().map(|block| mean(block.rows.clone())).collect();
                assert_eq!(residual[kind as usize].as_ref().unwrap(), &whole, "{id} {kind}");
            }
        }
    });
}

#[test]
fn what_gimbals_deviate_from_their_encoders_is_noise_in_motion_too() {
    with_linear(|linear| {
        let mut noise = linear.weighing.white(&linear.scene.residual(&[]).unwrap());
        let acc = &mut noise.sensors[SensorKind::Acc as usize];
        (acc.white, acc.moving, acc.drift, acc.scatter) = ([0.0; 3], [0.0; 3], [0.0; 2], 0.01);
        let usual = (0.01 * 9.8f64).powi(2);
        let along = |block: usize| -> f64 {
            let acc = linear.design.channels.iter().filter(|channel| channel.kind == SensorKind::Acc);
            acc.map(|channel| linear.weighing.variance(channel, &noise, block)).sum()
        };
        // Of three axes at right angles two turn gravity, whatever its direction; gimbals that line up do more or less.
        for (block, _) in linear.scene.blocks.iter().enumerate().filter(|(_, block)| block.rest.is_none()) {
            let share = along(block) / usual;
            assert!((0.5..3.5).contains(&share), "block {block}: {share}");
        }
    });
}

#[test]
fn a_drift_that_forgets_nothing_is_distinguished_from_one_that_does() {
    for (kind, forgets) in [(DriftKind::Walk, false), (DriftKind::Quick, true)] {
        let mut simulation = Simulation { duration: Some(1100.0), ..simulation(5) };
        simulation.conditions.noise.fill(NoiseLevel { drift: 10.0, kind, ..NoiseLevel::default() });
        let recording = simulation.record("drifting").unwrap();
        with_fit(&recording, |linear, fit| {
            let white = linear.weighing.white(&fit.residual);
            let noise = linear.judge(&[], &white, &SensorKind::ALL, &FAR).unwrap().noise;
            // The gyroscope's drift is hardly more than its white noise here.
            for sensor in [SensorKind::Acc, SensorKind::Mag] {
                let slow = noise.sensors[sensor as usize].slow;
                assert_eq!(slow < linear.scene.duration(), forgets, "{kind:?} {noise:?}");
            }
        });
    }
}

#[test]
fn pointing_errors_of_all_sensors_are_one_chance_and_no_harmonic() {
    let mut simulation = simulation(3);
    simulation.conditions.scatter = 0.02f64.to_radians();
    let recording = simulation.record("scattered").unwrap();
    with_fit(&recording, |linear, fit| {
        let white = linear.weighing.white(&fit.residual);
        let none = linear.screen(&[], &white, &SensorKind::ALL, &FAR).unwrap();
        let harmonic = find("rig.encoder_harmonic").unwrap();
        let with = linear.screen(&[harmonic], &none.noise, &SensorKind::ALL, &FAR).unwrap();
        let axis_by_axis = with.value - none.value;
        let offsets = linear.offsets(&white);
        let none = linear.scored_jointly(none, &offsets).unwrap();
        let together = linear.scored_jointly(with, &offsets).unwrap().log_evidence - none.log_evidence;
        assert!(axis_by_axis > 0.0 && together < 0.0, "{axis_by_axis} {together}");
    });
}

#[test]
fn samples_next_to_clipped_ones_are_left_out_whatever_their_own_noise() {
    let mut simulation = simulation(7);
    let full_scale = HEALTHY.acc.as_ref().unwrap().full_scale_si().unwrap();
    let effect = find("acc.saturation").unwrap();
    simulation.doses.push(Dose { effect, values: vec![full_scale / 9.5 - 1.0] });
    let recording = simulation.record("clipped").unwrap();
    let preparation = Preparation::new(&recording, None, None, &Settings::default()).unwrap();
    let (values, usable) =
        (&recording.acc.as_ref().unwrap().values, &preparation.usable[SensorKind::Acc as usize]);
    let clipped: Vec<f64> =
        values.iter().zip(&recording.time).filter(|(v, _)| v.amax() > 9.49).map(|(_, t)| *t).collect();
    assert!(!clipped.is_empty() && usable.iter().any(|usable| *usable));
    for (time, _) in recording.time.iter().zip(usable).filter(|(_, usable)| **usable) {
        assert!(clipped.iter().all(|clipped| (clipped - time).abs() > 0.5), "{time} s");
    }
}

#[test]
fn a_signature_that_lasts_from_one_fit_to_the_next_is_the_one_computed_again() {
    with_fit(&HEALTHY, |linear, fit| {
        let effect = find("acc.scale_quadratic").unwrap();
        let mut doses = fit.doses.clone();
        doses.push(Dose { effect, values: effect.parameters.iter().map(|p| p.prior_scale).collect() });
        let residual = linear.scene.residual(&doses).unwrap();
        let fit = Fit { doses, residual };
        let noise = linear.weighing.white(&fit.residual);
        let about =
            |before| Linearisation::new(linear.scene, linear.candidates, &fit, &noise, before).unwrap();
        let (lasting, again) = (about(Some(&linear)), about(None));
        for other in linear.candidates.effects.iter().filter(|other| !other.is_shaped()) {
            let columns = |linear: &Linearisation<'_>| -> Vec<f64> {
                let of = |(id, channel): (usize, &Channel)| -> Vec<f64> {
                    let at = channel.ids.iter().position(|own| *own == id);
                    at.map_or(vec![0.0; channel.y.len()], |at| channel.x[at].to_vec())
                };
                let ids = linear.design.of(other).into_iter();
                ids.flat_map(|id| linear.design.channels.iter().map(move |channel| (id, channel)))
                    .flat_map(of)
                    .collect()
            };
            let (old, new) = (DVector::from_vec(columns(&lasting)), DVector::from_vec(columns(&again)));
            let change = (&old - &new).norm() / new.norm();
            assert!(change < 0.05, "{}: {change}", other.id);
        }
    });
}

/// The change that usual sizes of all of an effect's parameters make, turned round when half of its square is over.
fn twin(linear: &Linearisation<'_>, own: &[usize]) -> Means {
    let blocks = &linear.scene.blocks;
    let squares: Vec<f64> = (0..blocks.len())
        .map(|block| {
            let columns = linear.design.channels.iter().flat_map(|channel| {
                let at = |id: &usize| channel.ids.iter().position(|other| other == id);
                own.iter().filter_map(at).map(|at| channel.x[at][block].powi(2))
            });
            columns.sum()
        })
        .collect();
    let whole: f64 = squares.iter().sum();
    let mut over = 0.0;
    let middle = squares.iter().position(|square| {
        over += square;
        over > 0.5 * whole
    });
    let middle = middle.unwrap_or_default();
    let mut means: Means = Default::default();
    for channel in &linear.design.channels {
        let column = means[channel.kind as usize].get_or_insert_with(|| vec![Vector3::zeros(); blocks.len()]);
        for id in own {
            if let Some(at) = channel.ids.iter().position(|other| other == id) {
                for (block, value) in column.iter_mut().enumerate() {
                    let sign = if block < middle { 1.0 } else { -1.0 };
                    value[channel.axis] += sign * channel.x[at][block];
                }
            }
        }
    }
    means
}

#[test]
fn the_twin_of_an_effect_with_its_sign_broken_is_not_explained_by_it() {
    with_linear(|linear| {
        let white = linear.weighing.white(&linear.scene.residual(&[]).unwrap());
        let precisions = linear.precisions(&white);
        for effect in &linear.candidates.effects {
            let own = linear.design.of(effect);
            let kept: Vec<usize> = linear.baseline.iter().chain(&own).copied().collect();
            let columns = kept.iter().map(|id| linear.design.columns[*id]).collect();
            let design = linear.design.extended(&kept, columns, &[twin(&linear, &own).into()]);
            let every: Vec<usize> = (0..design.size).collect();
            let normal = design.normal(&precisions, &every);
            let left = |fitted: usize| {
                let projected = Projected::new(&normal, &every[..fitted], &every[kept.len()..]).unwrap();
                projected.information[(0, 0)]
            };
            let (before, after) = (left(linear.baseline.len()), left(kept.len()));
            // What the baseline takes up of the twin is no part of the question.
            assert!(after > 0.1 * before, "{}: {:.3} is left", effect.id, after / before);
        }
    });
}

#[test]
fn an_effect_is_named_with_its_size_and_closes_the_gap() {
    for (id, size, parameter) in [("mag.gimbal_hard_iron_outer", 1.0, "x"), ("gyr.scale_cubic", 3.0, "z")] {
        let mut simulation = simulation(5);
        simulation.unit = UnitKind::Gx2;
        simulation.add(find(id).unwrap(), size).unwrap();
        let recording = simulation.record("afflicted").unwrap();
        let diagnosis = diagnose(&recording, &Options::default(), &|_| ());
        let names: Vec<&str> = diagnosis.causes.iter().map(|cause| cause.effect.as_str()).collect();
        assert_eq!((names.as_slice(), diagnosis.verdict), ([id].as_slice(), Verdict::Explained));
        let amount = diagnosis.causes[0].parameters.iter().find(|p| p.name == parameter).unwrap();
        let at = simulation.doses[0].effect.parameters.iter().position(|p| p.name == parameter).unwrap();
        let truth = simulation.doses[0].values[at];
        let (value, error) = (amount.value.unwrap(), amount.std_error.unwrap());
        assert!((value - truth).abs() < 4.0 * error, "{id}: {value} ± {error}, truly {truth}");
        assert!(diagnosis.gap_closed_total.unwrap() > 0.95, "{id}");
    }
}

#[test]
fn a_profile_shows_a_cubic_residual_over_the_rate_and_none_after_it() {
    let mut simulation = simulation(5);
    simulation.add(find("gyr.scale_cubic").unwrap(), 10.0).unwrap();
    let recording = simulation.record("cubic").unwrap();
    let diagnosis = diagnose(&recording, &Options::default(), &|_| ());
    let profile = diagnosis.profiles.iter().find(|profile| profile.sensor == "gyr").unwrap();
    let follows = [&profile.driver, &profile.function, &profile.unit];
    assert_eq!(follows, ["input", "degree 3", "rad/s"]);
    let bins = &profile.bins;
    assert!(bins.len() > 10 && bins.is_sorted_by(|a, b| a.driver < b.driver), "{bins:?}");
    let square = |of: fn(&ProfileBin) -> f64| {
        bins.iter().map(|bin| (of(bin) / bin.std).powi(2)).sum::<f64>() / bins.len() as f64
    };
    // Before it, bins differ by what a cubic gain adds; after it, by hardly more than white noise.
    let (before, after) = (square(|bin| bin.before), square(|bin| bin.after));
    assert!(before > 100.0 && after < 4.0, "{before} {after}: {bins:?}");
}

#[test]
fn a_projection_is_what_is_left_of_a_column_after_least_squares() {
    let x = DMatrix::from_fn(40, 3, |i, j| ((i * (j + 2)) as f64 * 0.7).sin());
    let y = DVector::from_fn(40, |i, _| (i as f64 * 0.31).cos());
    let normal = Normal {
        information: x.transpose() * &x,
        score: x.transpose() * &y,
        energy: y.dot(&y),
        log_determinant: 0.0,
    };
    let projected = Projected::new(&normal, &[0, 1], &[2]).unwrap();
    let baseline = x.columns(0, 2).into_owned();
    let fit = baseline.clone().svd(true, true).solve(&x.column(2), 1e-12).unwrap();
    let left = x.column(2) - baseline * fit;
    assert!((projected.information[(0, 0)] - left.dot(&left)).abs() < 1e-6);
    assert!((projected.score[0] - left.dot(&y)).abs() < 1e-6);
    let (amplitude, variance) = projected.estimate(&[0]).unwrap();
    assert!((amplitude[0] - left.dot(&y) / left.dot(&left)).abs() < 1e-6);
    assert!((variance[(0, 0)] - 1.0 / left.dot(&left)).abs() < 1e-6);
}

#[test]
fn the_evidence_of_one_amplitude_is_the_mean_over_its_scales() {
    let (score, information) = (30.0, 16.0);
    let projected = Projected {
        score: DVector::from_vec(vec![score]),
        information: DMatrix::from_vec(1, 1, vec![information]),
        before: DVector::from_vec(vec![information]),
    };
    // N(y | 0, V + V² a²) against N(y | 0, V) of the score y.
    let of = |a: f64| {
        let grown = 1.0 + a * a * information;
        0.5 * (score * score * a * a / grown - f64::ln(grown))
    };
    let each = [0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0].map(of);
    let expected = (each.iter().map(|value| value.exp()).sum::<f64>() / 8.0).ln();
    assert!((projected.log_bayes_factor(&[&[0]]) - expected).abs() < 1e-9);
}

#[test]
fn effects_that_share_nothing_are_as_likely_together_as_each_by_itself() {
    let (score, information) = (DVector::from_vec(vec![30.0, -7.0]), DVector::from_vec(vec![16.0, 9.0]));
    let projected =
        Projected { score, information: DMatrix::from_diagonal(&information), before: information };
    let both = projected.log_bayes_factor(&[&[0], &[1]]);
    let each = projected.log_bayes_factor(&[&[0]]) + projected.log_bayes_factor(&[&[1]]);
    assert!((both - each).abs() < 1e-9, "{both} {each}");
}

#[test]
fn the_evidence_of_an_effect_allows_for_one_amplitude_that_stands_alone() {
    let (scores, informations) = ([30.0, -1.0, 2.0], [16.0, 9.0, 4.0]);
    let information = DVector::from_row_slice(&informations);
    let projected = Projected {
        score: DVector::from_row_slice(&scores),
        information: DMatrix::from_diagonal(&information),
        before: information,
    };
    let of = |at: usize, a: f64| {
        let (grown, score): (f64, f64) = (1.0 + a * a * informations[at], scores[at] * a);
        (0.5 * (score * score / grown - grown.ln())).exp()
    };
    let each = [0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0].map(|a| {
        let amplitudes = [0, 1, 2].map(|at| of(at, a));
        0.7 * amplitudes.iter().product::<f64>() + 0.1 * amplitudes.iter().sum::<f64>()
    });
    let expected = (each.iter().sum::<f64>() / 8.0).ln();
    assert!((projected.log_bayes_factor(&[&[0, 1, 2]]) - expected).abs() < 1e-9);
}

#[test]
fn a_hand_recording_that_ends_within_a_move_has_no_gap() {
    let unit = SimulatedUnit { interval: 0.02, ..SimulatedUnit::mtx() };
    let mut recording = record("cut.csv", &Tumble::new(30, 0), &unit, 1);
    // The last turn but one begins at 150 s.
    let rows = recording.time.partition_point(|time| *time < 150.1 - 1e-9);
    recording.time.truncate(rows);
    for triple in [&mut recording.acc, &mut recording.gyr, &mut recording.mag].into_iter().flatten() {
        triple.values.truncate(rows);
    }
    recording.mag = None;
    assert_eq!(diagnose(&recording, &Options::default(), &|_| ()).verdict, Verdict::None);
}

#[test]
fn a_hand_recording_s_field_is_compared_with_no_heading() {
    let unit = SimulatedUnit { interval: 0.02, ..SimulatedUnit::mtx() };
    let mut recording = record("field.csv", &Tumble::new(20, 2), &unit, 3);
    recording.manifest.site.field_ned_ut = Some([25.0, 2.0, 39.0]);
    let diagnosis = diagnose(&recording, &Options::default(), &|_| ());
    assert_eq!(diagnosis.verdict, Verdict::None, "{:?}", diagnosis.remarks);
}
