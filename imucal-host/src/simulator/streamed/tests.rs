use super::*;
use crate::{recording::Simulated, simulator::Tumble};

/// The stream of a tumbling hand at 250 Hz, its own clock by `clock`.
fn stream(tumble: &Tumble, clock: &StreamClock) -> Stream {
    let time: Vec<f64> = (0..7500).map(|k| 0.004 * f64::from(k)).collect();
    let shown = |s: &f64| tumble.truth(s * (1.0 + clock.error) - clock.offset, &|_| ());
    let truth: Vec<Truth> = time.iter().map(shown).collect();
    let of = |value: &dyn Fn(&Truth) -> Vector3<f64>| Some(truth.iter().map(value).collect());
    let values = Simulated {
        acc: of(&|row| row.f_t),
        gyr: of(&|row| row.w_it_t),
        mag: of(&|row| row.b_t),
        temperature: None,
    };
    Stream { name: "sim.csv".into(), time, values }
}

fn streamed(clock: StreamClock, alter: impl Fn(&mut Stream)) -> (Tumble, Streamed) {
    let tumble = Tumble::new(5, 3);
    let mut stream = stream(&tumble, &clock);
    alter(&mut stream);
    let rows: Vec<f64> = (0..2900).map(|k| 0.3 + 0.01 * f64::from(k)).collect();
    let streamed = Streamed::new(&stream, clock, &rows, vec![25.0; 2900], tumble.place()).unwrap();
    (tumble, streamed)
}

#[test]
fn a_row_shows_the_stream_at_its_own_time_on_the_sensor_s_clock() {
    let (tumble, streamed) = streamed(StreamClock::even(0.0371, 3e-4), |_| ());
    let mut kinks = 0;
    for k in 0..400 {
        let t = 10.5 + 0.0371 * f64::from(k);
        let (here, there) = (streamed.truth(t, &|_| ()), tumble.truth(t, &|_| ()));
        assert!((here.f_t - there.f_t).norm() < 1e-4, "{t}");
        assert!((here.b_t - there.b_t).norm() < 1e-3, "{t}");
        // Where a turn begins or ends its acceleration jumps.
        let off = (here.dw_it_t - there.dw_it_t).norm() > 0.05 * (1.0 + there.dw_it_t.norm());
        let far = (here.w_it_t - there.w_it_t).norm();
        assert!(far < 1e-2, "{t}");
        kinks += usize::from(off || far > 1e-4);
    }
    assert!(kinks < 8, "{kinks}");
}

#[test]
fn the_attitude_is_level_and_follows_the_rate() {
    let (tumble, streamed) = streamed(StreamClock::default(), |_| ());
    for t in [12.0, 17.3, 25.1] {
        let (here, there) = (streamed.truth(t, &|_| ()), tumble.truth(t, &|_| ()));
        let up = |truth: &Truth| (truth.c_p_n * truth.c_t_p * truth.f_t).normalize();
        assert!((up(&here) - up(&there)).norm() < 2e-3, "{t}: {} {}", up(&here), up(&there));
    }
}

#[test]
fn rows_in_a_gap_of_the_stream_and_beyond_its_ends_are_not_known() {
    let (_, streamed) = streamed(StreamClock::default(), |stream| {
        for values in stream.values.gyr.as_mut().unwrap().iter_mut().skip(3000).take(40) {
            *values = Vector3::repeat(f64::NAN);
        }
    });
    let at = |t: f64| streamed.known()[((t - 0.3) / 0.01).round() as usize];
    assert!(at(11.9) && !at(12.05) && at(12.3));
    assert!(streamed.truth(12.05, &|_| ()).w_it_t.iter().all(|w| w.is_finite()));
    let late = StreamClock::even(5.0, 0.0);
    let rows: Vec<f64> = (0..2900).map(|k| 0.01 * f64::from(k)).collect();
    let stream = stream(&Tumble::new(5, 3), &StreamClock::default());
    let cut = Streamed::new(&stream, late, &rows, vec![25.0; 2900], Place::ankara()).unwrap();
    assert!(cut.known()[2400] && !cut.known()[2600]);
}

#[test]
fn the_speed_is_the_integral_of_what_is_not_gravity() {
    let (_, streamed) = streamed(StreamClock::default(), |stream| {
        // To and fro along the first axis in a first rest, 0.5 m/s² for a second each way.
        for (time, force) in stream.time.iter().zip(stream.values.acc.as_mut().unwrap()) {
            force.x += if (4.0..5.0).contains(time) {
                0.5
            } else if (6.0..7.0).contains(time) {
                -0.5
            } else {
                0.0
            };
        }
    });
    let at = |t: f64| streamed.speeds().unwrap()[((t - 0.3) / 0.01).round() as usize];
    assert!(
        (at(5.5) - 0.5).abs() < 0.1 && at(2.0) < 0.1 && at(8.0) < 0.1,
        "{} {} {}",
        at(5.5),
        at(2.0),
        at(8.0)
    );
}

#[test]
fn a_stream_at_rest_does_not_move() {
    let (_, streamed) = streamed(StreamClock::default(), |_| ());
    assert!(streamed.moving()[..900].iter().all(|moves| !moves));
    assert!(streamed.moving()[1050..1150].iter().all(|moves| *moves));
}

#[test]
fn a_mounted_unit_is_given_the_same_movement_in_its_own_axes() {
    let (_, streamed) = streamed(StreamClock::even(0.01, 1e-4), |_| ());
    let c_t_q = exp(&Vector3::new(0.02, -0.05, 0.1));
    let mounted = streamed.mounted(&c_t_q).unwrap();
    for t in [10.0, 12.34, 25.1] {
        let (here, there) = (mounted.truth(t, &|_| ()), streamed.truth(t, &|_| ()));
        for (of_unit, of_table) in [
            (here.f_t, there.f_t),
            (here.w_it_t, there.w_it_t),
            (here.dw_it_t, there.dw_it_t),
            (here.b_t, there.b_t),
        ] {
            assert!((of_unit - c_t_q * of_table).norm() < 1e-9 * (1.0 + of_table.norm()), "{t}");
        }
        let to_n = |truth: &Truth| truth.c_p_n * truth.c_t_p * truth.f_t;
        assert!((to_n(&here) - to_n(&there)).norm() < 1e-6, "{t}");
    }
}

#[test]
fn a_clock_that_jumps_and_wanders_is_followed_and_its_inverse_finds_the_row() {
    let corrections = vec![(10.0, 0.0), (10.0, 0.04), (20.0, 0.04), (30.0, 0.05)];
    let clock = StreamClock { corrections, unknown: vec![9.8..10.1], ..StreamClock::even(0.5, 1e-3) };
    for (time, correction) in [(3.0, 0.0), (9.99, 0.0), (10.01, 0.04), (25.0, 0.045), (40.0, 0.05)] {
        let shown = clock.stream_time(time);
        assert!((shown - (time + 0.5 + correction) / 1.001).abs() < 1e-12, "{time}");
        assert!((clock.row_time(shown) - time).abs() < 1e-4, "{time}");
    }
    let (_, streamed) = streamed(clock, |_| ());
    let at = |t: f64| streamed.known()[((t - 0.3) / 0.01).round() as usize];
    assert!(at(9.7) && !at(9.9) && at(10.2));
}
