use std::vec::Vec as List;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;

const INTERVAL: u64 = 10_000;

/// A unit that lies still and is moved by turns: `parts` are lengths, s, rates about the axis z, rad/s, and how much it is
/// shaken, m/s².
struct Session {
    random: ChaCha8Rng,
    samples: List<Sample<f64>>,
}

impl Session {
    fn new(seed: u64, parts: &[(f64, f64, f64)]) -> Self {
        let mut session = Self { random: ChaCha8Rng::seed_from_u64(seed), samples: List::new() };
        parts.iter().for_each(|part| session.add(*part));
        session
    }

    fn add(&mut self, (length, rate, shaken): (f64, f64, f64)) {
        let from = self.samples.len() as u64;
        for k in 0..(length * 1e6) as u64 / INTERVAL {
            let mut noise = |size: f64| {
                Vector3::from_fn(|_, _| {
                    size * (0..12).map(|_| self.random.random::<f64>() - 0.5).sum::<f64>()
                })
            };
            let acc = Vector3::new(0.3, -0.2, -9.79) + noise(0.02) + noise(shaken);
            let gyr = Vector3::new(0.01, -0.004, 0.002 + rate) + noise(0.003);
            let time = 5_000_000 + (from + k) * INTERVAL;
            self.samples.push(Sample { time, acc, gyr: Some(gyr), temperature: Some(25.0) });
        }
    }

    fn rests(&self) -> List<ObservedRest<f64>> {
        let mut observer = RestObserver::default();
        let mut rests: List<_> = self.samples.iter().filter_map(|sample| observer.push(sample)).collect();
        rests.extend(observer.finish());
        rests
    }
}

fn seconds(rest: &ObservedRest<f64>) -> (f64, f64) {
    (rest.start as f64 * 1e-6 - 5.0, rest.end as f64 * 1e-6 - 5.0)
}

#[test]
fn rests_between_motions_are_found_and_hold_none_of_them() {
    let parts = [(6.0, 0.0, 0.0), (2.0, 1.5, 2.0), (4.0, 0.0, 0.0), (2.0, -1.0, 2.0), (5.0, 0.0, 0.0)];
    let rests = Session::new(1, &parts).rests();
    assert_eq!(rests.len(), 3);
    for (rest, (from, to)) in rests.iter().zip([(0.0, 6.0), (8.0, 12.0), (14.0, 19.0)]) {
        let (start, end) = seconds(rest);
        // Half a window at either end, and up to a quarter more.
        assert!((from + 0.2..from + 0.8).contains(&start), "{start} {from}");
        assert!((to - 0.8..to - 0.2).contains(&end), "{end} {to}");
        let moments = &rest.rest.acc;
        let error = moments.mean() - Vector3::new(0.3, -0.2, -9.79);
        assert!(error.amax() < 5.0 * 0.02 / f64::from(moments.count()).sqrt(), "{error}");
        assert_eq!(f64::from(moments.count()), ((end - start) * 100.0).round());
        assert!((rest.rest.time - 5.0 - 0.5 * (start + end)).abs() < 2e-3);
        assert!((rest.rest.temperature - 25.0).abs() < 1e-9);
    }
}

#[test]
fn less_than_a_second_of_still_windows_is_no_rest() {
    let parts = [(6.0, 0.0, 0.0), (2.0, 1.0, 2.0), (1.6, 0.0, 0.0), (2.0, 1.0, 2.0), (6.0, 0.0, 0.0)];
    assert_eq!(Session::new(2, &parts).rests().len(), 2);
}

#[test]
fn a_turn_that_the_accelerometer_does_not_feel_is_no_rest() {
    let parts = [(6.0, 0.0, 0.0), (8.0, 0.1, 0.0), (6.0, 0.0, 0.0)];
    let rests = Session::new(3, &parts).rests();
    assert_eq!(rests.len(), 2);
    assert!(seconds(&rests[0]).1 < 6.1 && seconds(&rests[1]).0 > 13.9, "{rests:?}");
}

#[test]
fn a_table_that_turns_at_first_is_not_taken_for_one_that_stands() {
    let rests =
        Session::new(3, &[(6.0, 0.8, 0.0), (6.0, 0.0, 0.0), (2.0, 1.0, 2.0), (6.0, 0.0, 0.0)]).rests();
    let found: List<_> = rests.iter().map(seconds).collect();
    assert!(found.len() == 2 && found[0].0 > 6.0 && found[1].0 > 14.0, "{found:?}");
}

#[test]
fn a_swing_that_comes_back_within_a_window_is_no_rest() {
    let mut session = Session::new(3, &[(6.0, 0.0, 0.0), (8.0, 0.0, 0.0), (6.0, 0.0, 0.0)]);
    for (k, sample) in session.samples.iter_mut().enumerate().skip(600).take(800) {
        // Once a second through 18 degrees.
        let rate = (k as f64 * std::f64::consts::TAU / 100.0).sin();
        sample.gyr.iter_mut().for_each(|gyr| gyr.z += rate);
    }
    let rests = session.rests();
    assert_eq!(rests.len(), 2);
    assert!(seconds(&rests[0]).1 < 6.1 && seconds(&rests[1]).0 > 13.9, "{rests:?}");
}

#[test]
fn what_seemed_a_rest_before_a_quieter_one_came_is_none() {
    // Carried steadily at first: quiet as long as nothing quieter is known.
    let parts = [(5.0, 0.0, 0.25), (2.0, 1.0, 2.0), (6.0, 0.0, 0.0), (2.0, 1.0, 2.0), (6.0, 0.0, 0.25)];
    let rests = Session::new(4, &parts).rests();
    // The first has ended before.
    assert_eq!(rests.len(), 2);
    let threshold = 6.0 * rests[1].noise;
    assert!(rests[0].noise > threshold, "what is kept of it says so: {} {threshold}", rests[0].noise);
}

#[test]
fn a_gap_and_samples_that_are_missing_end_a_rest() {
    let mut session = Session::new(5, &[(20.0, 0.0, 0.0)]);
    assert_eq!(session.rests().len(), 1);
    session.samples.iter_mut().skip(600).for_each(|sample| sample.time += 3_000_000);
    session.samples.iter_mut().skip(1200).take(20).for_each(|sample| sample.acc.x = f64::NAN);
    let rests = session.rests();
    assert_eq!(rests.len(), 3);
    assert!(rests.iter().all(|rest| rest.rest.acc.mean().iter().all(|component| component.is_finite())));
}

#[test]
fn each_of_two_gaps_in_succession_ends_a_rest() {
    let mut session = Session::new(9, &[(12.0, 0.0, 0.0)]);
    // A tenth of a second of samples lies between them.
    session.samples.iter_mut().skip(400).for_each(|sample| sample.time += 3_000_000);
    session.samples.iter_mut().skip(410).for_each(|sample| sample.time += 400_000);
    let rests = session.rests();
    assert_eq!(rests.len(), 2);
    assert!(rests[0].end < 5_000_000 + 4_010_000 && rests[1].start > 5_000_000 + 7_400_000, "{rests:?}");
}

#[test]
fn a_clock_that_is_set_back_ends_a_rest_and_the_next_one_begins() {
    let mut session = Session::new(6, &[(12.0, 0.0, 0.0)]);
    session.samples.iter_mut().skip(600).for_each(|sample| sample.time -= 5_500_000);
    let rests = session.rests();
    assert_eq!(rests.len(), 2);
    assert!(rests.iter().all(|rest| rest.start < rest.end));
}

/// Rests of 6 s between motions; the unit moves first.
const THREE_RESTS: [(f64, f64, f64); 6] =
    [(2.0, 1.0, 2.0), (6.0, 0.0, 0.0), (2.0, 1.0, 2.0), (6.0, 0.0, 0.0), (2.0, -1.0, 2.0), (6.0, 0.0, 0.0)];

#[test]
fn a_sensor_that_repeats_a_sample_for_seconds_is_seen_at_rest_afterwards() {
    for (from, samples) in [(0, 150), (0, 400), (300, 90), (300, 150), (300, 300), (1050, 110)] {
        let mut session = Session::new(10, &THREE_RESTS);
        let stuck = session.samples[from];
        for sample in &mut session.samples[from..from + samples] {
            (sample.acc, sample.gyr) = (stuck.acc, stuck.gyr);
        }
        let rests = session.rests();
        for (begin, end) in [(2.0, 8.0), (10.0, 16.0), (18.0, 24.0)] {
            let found = rests.iter().map(seconds).any(|(from, to)| from > begin - 0.3 && to < end + 0.3);
            assert!(
                found,
                "{samples} samples from {from}: {:?}",
                rests.iter().map(seconds).collect::<List<_>>()
            );
        }
    }
}

#[test]
fn an_accelerometer_of_coarse_steps_is_at_rest_whether_or_not_a_window_shows_noise() {
    // Steps of 4 mg, with noise of a half, a quarter and an eighth of one; at half a step from a level, and near one.
    for (seed, (shrink, level)) in
        (0..).zip([1.0, 0.5, 0.25].into_iter().flat_map(|s| [(s, 0.5), (s, 0.25), (s, 0.0)]))
    {
        let mut session = Session::new(20 + seed, &THREE_RESTS);
        let still = Vector3::new(0.3, -0.2, -9.79);
        for (k, sample) in session.samples.iter_mut().enumerate() {
            // The attitudes differ: at the first rest no axis is near a half.
            let at = if k < 900 { 0.0 } else { level };
            let coarse = |value: f64| (value / 0.04).round() * 0.04;
            sample.acc =
                (still.map(coarse) + (sample.acc - still) * shrink).map(|value| coarse(value + 0.04 * at));
        }
        let rests = session.rests();
        assert_eq!(rests.len(), 3, "{shrink} {level}: {:?}", rests.iter().map(seconds).collect::<List<_>>());
    }
}

#[test]
fn what_a_coarse_accelerometer_may_show_of_its_noise_can_be_set_or_is_learnt() {
    let mut session = Session::new(7, &[(6.0, 0.0, 0.0), (2.0, 1.0, 2.0), (6.0, 0.0, 0.0)]);
    let coarse = |value: f64| (value / 0.04).round() * 0.04;
    session.samples.iter_mut().for_each(|sample| sample.acc = sample.acc.map(coarse));
    session.samples.iter_mut().take(150).for_each(|sample| sample.acc = Vector3::new(0.28, -0.2, -9.8));
    let set = RestSettings { least_variance: 3.0 * 0.02 * 0.02, ..Default::default() };
    for settings in [set, RestSettings::default()] {
        let mut observer = RestObserver::new(settings);
        let mut rests: List<_> = session.samples.iter().filter_map(|sample| observer.push(sample)).collect();
        rests.extend(observer.finish());
        assert_eq!(rests.len(), 2, "{settings:?}");
    }
}

#[test]
fn an_observer_that_is_kept_and_gone_on_with_finds_the_same() {
    let session = Session::new(8, &[(6.0, 0.0, 0.0), (2.0, 1.5, 2.0), (4.0, 0.0, 0.0)]);
    let (mut kept, mut rests) = (RestObserver::default(), List::new());
    for sample in &session.samples {
        let mut again = kept;
        rests.extend(again.push(sample));
        kept = again;
    }
    rests.extend(kept.finish());
    assert_eq!(rests, session.rests());
}

#[test]
fn in_single_precision_it_takes_six_hundred_bytes() {
    assert!(size_of::<RestObserver<f32>>() <= 600, "{}", size_of::<RestObserver<f32>>());
}
