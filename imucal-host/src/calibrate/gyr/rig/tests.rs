use super::*;
use crate::{
    calibrate::calibrate,
    recording::check::integrity,
    simulator::{Programme, Simulation},
};

/// A simulated recording, and the gain and bias that are true of it, table axes.
fn simulated(programme: Programme, seed: u64) -> (Recording, Matrix3<f64>, Vector3<f64>) {
    let simulation = Simulation { programme, seed, ..Simulation::default() };
    let unit = simulation.unit_under_test();
    let truth = unit.triad(SensorKind::Gyr).triad;
    (simulation.record("rig.csv").unwrap(), unit.c_t_q.transpose() * truth.gain, truth.bias)
}

/// Only the gyroscope is looked at.
fn calibrated(recording: &Recording, options: &Options) -> Calibration {
    let skip = vec![SensorKind::Acc, SensorKind::Mag];
    calibrate(recording, &Options { skip, ..options.clone() }, &|_| ())
}

fn alone(recording: &Recording, model: &'static str) -> FitSummary {
    let options = Options { rig_gyr: Some(model), ..Options::default() };
    let calibration = calibrated(recording, &options);
    let outcome = calibration.sensor(SensorKind::Gyr).unwrap();
    assert_eq!(outcome.model, model);
    outcome.accepted().unwrap_or_else(|| panic!("{:?}", outcome.verdict)).clone()
}

/// Errors of the gain in standard errors.
fn scores(fit: &FitSummary, gain: &Matrix3<f64>) -> Vec<f64> {
    (fit.triad.gain - gain).component_div(&fit.gain_std).iter().copied().collect()
}

fn spread(scores: &[f64]) -> f64 {
    (scores.iter().map(|z| z * z).sum::<f64>() / scores.len() as f64).sqrt()
}

#[test]
fn gains_of_a_simulated_gyroscope_match_their_standard_errors() {
    let mut pooled = Vec::new();
    for seed in 1..=24 {
        let (recording, gain, _) = simulated(Programme::Gyroscope, seed);
        pooled.extend(scores(&alone(&recording, G12), &gain));
    }
    let most = pooled.iter().fold(0.0f64, |most, z| most.max(z.abs()));
    println!("{} scores: rms {:.3}, largest {most:.2}", pooled.len(), spread(&pooled));
    assert!(most < 4.0, "{most}");
    assert!((0.75..1.25).contains(&spread(&pooled)), "{}", spread(&pooled));
}

#[test]
fn a_full_programme_has_gains_and_g_sensitivity_within_four_errors() {
    for seed in [1, 2, 3] {
        let (recording, gain, _) = simulated(Programme::Full, seed);
        for model in [G12, G21] {
            let fit = alone(&recording, model);
            let scores = scores(&fit, &gain);
            let (rms, held) = (fit.rms.to_degrees(), fit.held_out_rms.unwrap().to_degrees());
            println!(
                "{model} seed {seed}: {:.2} rms of scores, {rms:.3}°, held out {held:.3}°",
                spread(&scores)
            );
            assert!(scores.iter().all(|z| z.abs() < 4.0), "{model} seed {seed}: {scores:?}");
        }
    }
}

#[test]
fn encoders_in_degrees_and_missing_axes_are_reported() {
    let (mut degrees, ..) = simulated(Programme::Gyroscope, 1);
    let mut nameless = degrees.clone();
    degrees.gimbal.iter_mut().flatten().flatten().for_each(|angle| *angle = angle.to_degrees());
    nameless.manifest.rig.as_mut().unwrap().axes = None;
    for (recording, expected) in [(degrees, "degrees"), (nameless, "[rig] axes")] {
        let calibration = calibrated(&recording, &Options { rig_acc: None, ..Options::default() });
        assert!(calibration.warnings.iter().any(|w| w.contains(expected)), "{:?}", calibration.warnings);
        assert_eq!(calibration.sensor(SensorKind::Gyr).unwrap().model, crate::calibrate::gyr::turns::MODEL);
    }
}

#[test]
fn without_a_latitude_earth_s_rotation_stays_in_the_bias() {
    let (mut recording, ..) = simulated(Programme::Gyroscope, 1);
    recording.manifest.site.latitude_deg = None;
    let calibration = calibrated(&recording, &Options::default());
    assert!(calibration.warnings.iter().any(|w| w.contains("latitude")), "{:?}", calibration.warnings);
}

#[test]
fn encoders_missing_for_a_stretch_cost_the_motion_in_it_and_no_more() {
    let (mut recording, gain, _) = simulated(Programme::Gyroscope, 4);
    let whole = alone(&recording, G12);
    let gimbal = recording.gimbal.as_mut().unwrap();
    gimbal[4000..4100].fill([f64::NAN; 3]);
    let fit = alone(&recording, G12);
    assert!(fit.left_out.iter().any(|text| text.contains("no attitude is known")), "{:?}", fit.left_out);
    assert!((1..=2).contains(&(whole.observations - fit.observations)), "{}", fit.observations);
    assert!(scores(&fit, &gain).iter().all(|z| z.abs() < 4.0));
}

#[test]
fn a_reference_attitude_tells_what_encoders_tell() {
    let (mut recording, gain, _) = simulated(Programme::Gyroscope, 5);
    let axes = pose::rig_axes(recording.manifest.rig.as_ref()).unwrap();
    let attitudes = motion::of_encoders(recording.gimbal.as_deref().unwrap(), &axes);
    let quaternion = |c: &Matrix3<f64>| {
        let q = imucal_core::rotation::quaternion(c);
        [q.w, q.i, q.j, q.k]
    };
    let reference = |row: &Option<Matrix3<f64>>| row.as_ref().map_or([f64::NAN; 4], quaternion);
    recording.reference = Some(attitudes.iter().map(reference).collect());
    recording.gimbal = None;
    assert!(scores(&alone(&recording, G12), &gain).iter().all(|z| z.abs() < 4.0));
    // Nine seconds of it are not enough.
    recording.reference.as_mut().unwrap()[900..].fill([f64::NAN; 4]);
    let calibration = calibrated(&recording, &Options::default());
    let refused = calibration.sensor(SensorKind::Gyr).unwrap().verdict.clone().unwrap_err();
    assert_eq!(refused.refusal.reason(), "too-few-observations");
}

#[test]
fn a_reference_whose_clock_is_early_is_found_so_and_costs_nothing() {
    let (mut recording, gain, _) = simulated(Programme::Gyroscope, 5);
    let axes = pose::rig_axes(recording.manifest.rig.as_ref()).unwrap();
    let attitudes = motion::of_encoders(recording.gimbal.as_deref().unwrap(), &axes);
    let early = motion::later(&recording.time, &attitudes, -0.012);
    recording.gimbal = None;
    let sensor = recording.gyr.as_ref().unwrap();
    let usable = vec![true; recording.rows()];
    let found = lagging(&recording, sensor, &usable, &early);
    let note = found.notes.last().unwrap();
    let lag: f64 = note.split(' ').find_map(|word| word.parse().ok()).unwrap();
    assert!(note.contains("behind") && (lag - 12.0).abs() < 1.5, "{note}");
    let fit = gyr_rig_fit::fit(&found.data, FULL, found.bias);
    assert!((fit.triad.gain - gain).amax() < 0.01, "{}", fit.triad.gain);
}

#[test]
fn a_comparison_stops_at_the_gain_without_further_cause() {
    let (recording, ..) = simulated(Programme::Full, 6);
    let options = Options { compare: true, multipliers: vec![4.0], ..Options::default() };
    let calibration = calibrate(&recording, &options, &|_| ());
    let found = calibration.comparisons.iter().find(|c| c.kind == SensorKind::Gyr).unwrap();
    let names: Vec<_> = found.rungs.iter().map(|(step, _)| step.name).collect();
    assert_eq!(names, ["-", "B3", "K9", G12, G21]);
    assert_eq!(found.chosen, G12, "{}", found.why);
    let second: Vec<f64> = found.rungs.iter().filter_map(|(step, _)| step.second_half_rms).collect();
    println!("{second:?}");
    let [nominal, bias, field, full, with_force] = second[..] else { panic!("{second:?}") };
    // Of a sound sensor gravity's direction determines as much as attitudes do, to within the second half's own noise; what
    // is not there to be found does not help.
    assert!(nominal > bias && bias > 5.0 * field && (field / full - 1.0).abs() < 0.15, "{second:?}");
    assert!(with_force > 0.95 * full, "{second:?}");
}

#[test]
fn from_a_start_far_off_the_swarm_ends_where_the_static_bias_does() {
    let (recording, ..) = simulated(Programme::Gyroscope, 7);
    let sensor = recording.gyr.as_ref().unwrap();
    let usable = integrity::inspect(&recording).sensor(SensorKind::Gyr).unwrap().usable.clone();
    let (axes, gimbal) = pose::axes_and_encoders(&recording).unwrap();
    let attitudes = motion::of_encoders(gimbal, &axes);
    let found = on_encoders(&recording, sensor, &usable, gimbal, &attitudes, &axes, None);
    let near = gyr_rig_fit::fit(&found.data, FULL, found.bias);
    let far = gyr_rig_fit::search(&found.data, FULL, found.bias + Vector3::new(0.12, -0.1, 0.15)).unwrap();
    assert!(near.search.swarm.is_none() && far.search.swarm.is_some_and(|swarm| swarm.kept));
    assert!((near.triad.gain - far.triad.gain).norm() < 1e-5, "{} {}", near.triad.gain, far.triad.gain);
}
