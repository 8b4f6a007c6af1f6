use nalgebra::Vector3;

use super::*;
use crate::simulator::truth::Motion;

const AXES: [[Axis; 3]; 3] =
    [[Axis::Z, Axis::Y, Axis::X], [Axis::Z, Axis::X, Axis::Y], [Axis::X, Axis::Y, Axis::Z]];

fn schedule(programme: Programme, axes: [Axis; 3], seed: u64) -> Schedule {
    programme.schedule(axes, seed, None, Place::ankara()).unwrap()
}

#[test]
fn the_rate_is_the_derivative_of_the_attitude_in_every_programme() {
    let h = 1e-5;
    for programme in Programme::ALL {
        for axes in AXES {
            let mut random = Random::new(5, Purpose::Rig);
            let schedule = schedule(programme, axes, 3).on_base(4).scattered(1e-3, &mut random);
            let at = |t: f64| schedule.truth(t, &|_| ());
            let mut fastest = 0.0f64;
            for k in 0..400 {
                let t = schedule.duration() * (f64::from(k) + 0.5) / 400.0;
                let (before, here, after) = (at(t - h), at(t), at(t + h));
                // A direction fixed in n turns the other way in t: df/dt = −w × f.
                let numeric = (after.f_t - before.f_t) / (2.0 * h);
                assert!((numeric + here.w_pt_t.cross(&here.f_t)).norm() < 1e-6, "{programme:?} {axes:?} {t}");
                let dw = (after.w_it_t - before.w_it_t) / (2.0 * h);
                assert!((dw - here.dw_it_t).norm() < 1e-3, "{programme:?} {axes:?} {t}");
                fastest = fastest.max(here.w_pt_t.norm());
            }
            assert!((0.3..5.0).contains(&fastest), "{programme:?} {axes:?} {fastest}");
        }
    }
}

#[test]
fn multi_position_has_two_dozen_attitudes_all_faces_and_six_revisits() {
    for axes in AXES {
        for seed in 0..5 {
            let schedule = schedule(Programme::MultiPosition, axes, seed);
            let downs: Vec<Vector3<f64>> = schedule.rests().iter().map(|t| schedule.down(*t)).collect();
            for face in [Vector3::x(), Vector3::y(), Vector3::z()] {
                for face in [face, -face] {
                    assert!(downs.iter().any(|down| down.dot(&face) > 0.99), "{axes:?} {seed} {face:?}");
                }
            }
            let attitude = |t: &f64| schedule.truth(*t, &|_| ()).c_t_p;
            let poses: Vec<_> = schedule.rests().iter().map(attitude).collect();
            let repeats = (0..poses.len())
                .filter(|k| poses[..*k].iter().any(|before| (before - poses[*k]).norm() < 1e-9))
                .count();
            assert!(
                poses.len() - repeats >= 24 && repeats >= 6,
                "{axes:?} {seed}: {} {repeats}",
                poses.len()
            );
        }
    }
}

#[test]
fn a_mixed_programme_shows_every_face_and_turns_every_gimbal() {
    for (seed, duration) in [(1, 120.0), (2, 200.0), (3, 400.0), (4, 650.0), (5, 120.0), (6, 150.0)] {
        let axes = AXES[seed as usize % 3];
        let schedule = Programme::Mixed.schedule(axes, seed, Some(duration), Place::ankara()).unwrap();
        assert!((schedule.duration() - duration).abs() < 1e-9);
        let downs: Vec<Vector3<f64>> = schedule.rests().iter().map(|t| schedule.down(*t)).collect();
        for face in [Vector3::x(), Vector3::y(), Vector3::z()] {
            for face in [face, -face] {
                assert!(downs.iter().any(|down| down.dot(&face) > 0.99), "{seed} {face:?}");
            }
        }
        let rows = (0..4000).map(|k| schedule.truth(duration * f64::from(k) / 4000.0, &|_| ()));
        let fastest = rows.fold([0.0f64; 3], |fastest, row| {
            std::array::from_fn(|k| fastest[k].max(row.gimbals[k].rate.abs()))
        });
        assert!(fastest.iter().all(|rate| (0.25..3.3).contains(rate)), "{seed} {fastest:?}");
    }
    let rests = |seed| schedule(Programme::Mixed, AXES[0], seed).rests().len();
    assert!((0..10).any(|seed| rests(seed) != rests(10)));
}

#[test]
fn the_gyroscope_s_slews_reach_150_degrees() {
    let schedule = schedule(Programme::Gyroscope, AXES[0], 2);
    let largest = (0..1200)
        .filter_map(|k| schedule.encoders(0.1 * f64::from(k)))
        .flatten()
        .fold(0.0f64, |largest, angle| largest.max(angle.abs()));
    assert!((largest.to_degrees() - 150.0).abs() < 1.0, "{}", largest.to_degrees());
}

#[test]
fn temperature_goes_up_and_down() {
    for programme in [Programme::Thermal, Programme::Full] {
        let schedule = schedule(programme, AXES[0], 2);
        let end = schedule.duration();
        let t: Vec<f64> =
            (0..100).map(|k| schedule.truth(end * f64::from(k) / 100.0, &|_| ()).temperature).collect();
        let rise = |sign: f64| t.windows(2).filter(|pair| sign * (pair[1] - pair[0]) > 0.0).count();
        assert!(rise(1.0) > 20 && rise(-1.0) > 20, "{programme:?}: {} {}", rise(1.0), rise(-1.0));
    }
}

#[test]
fn a_schedule_follows_from_its_seed_and_lasts_as_long_as_asked() {
    let at = |seed| schedule(Programme::Full, AXES[0], seed).truth(200.0, &|_| ());
    assert_eq!(at(1), at(1));
    assert_ne!(at(1), at(2));
    for programme in Programme::ALL {
        for seed in 0..20 {
            let duration = schedule(programme, AXES[1], seed).duration();
            assert!((80.0..650.0).contains(&duration), "{programme:?} {seed}: {duration}");
        }
    }
    let longer = Programme::Full.schedule(AXES[0], 1, Some(640.0), Place::ankara()).unwrap();
    assert!((longer.duration() - 640.0).abs() < 1e-9);
}

#[test]
fn too_short_a_time_is_refused_with_the_shortest() {
    let refusal = Programme::Full.schedule(AXES[0], 1, Some(60.0), Place::ankara()).unwrap_err();
    assert!(matches!(refusal, SimulationError::TooShort { shortest, .. } if shortest > 60.0), "{refusal}");
}

#[test]
fn every_programme_has_a_name_of_its_own() {
    for programme in Programme::ALL {
        assert_eq!(Programme::find(programme.name()), Some(programme));
    }
    assert_eq!(Programme::find("tumble"), None);
}
