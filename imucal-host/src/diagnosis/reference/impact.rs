//! Impacts that samples do not resolve: between two samples of a stream nothing is known of them.
//!
//! A foot that strikes or a wheel on an edge is far from what a cubic through a sample's neighbours foretells
//! ([`super::unforeseen`]); vibration, a movement along which all samples are as hard to foretell, is no further than the
//! samples about it. Impacts that one side has and the other lacks, several in a row ([`super::strikes`]), are a movement
//! that the simulator does not have: a contact. Not recognised: impacts so dense that there is nothing between them, and a single
//! one that one side lacks.

use super::{
    strikes::{MARGIN, Side, Strikes, Unmatched},
    unforeseen::{Unforeseen, interval},
};
use crate::{
    recording::{Recording, SensorKind, Stream},
    simulator::StreamClock,
};

/// An impact of the stream is larger than this share of the recording's own median of |e|.
const SEEN: f64 = 1.0;
/// Where more than this share of the rows would be left out, the movement itself is that rough.
const MOST: f64 = 0.4;

/// The impacts of a recording and of the stream that it is compared with.
#[derive(Clone, Debug, PartialEq)]
pub struct Impacts {
    /// Whether no impact is near, row by row.
    pub resolved: Vec<bool>,
    /// Stretches with impacts that one side has and the other lacks.
    pub unmatched: Vec<Unmatched>,
}

/// The impacts of a recording and of a stream on this clock.
pub fn impacts(recording: &Recording, stream: &Stream, clock: &StreamClock) -> Impacts {
    let row = |time: f64| clock.row_time(time);
    let rows: Vec<f64> = stream.time.iter().map(|time| row(*time)).collect();
    let (mut times, mut unmatched) = (Vec::new(), Vec::new());
    for kind in SensorKind::ALL {
        let Some(real) = recording.sensor(kind) else { continue };
        let own = Unforeseen::of(&recording.time, &real.values);
        let mut of_sensor = own.impacts(0.0);
        if let Some(values) = stream.values.sensor(kind) {
            let given = Unforeseen::of(&rows, values);
            of_sensor.extend(given.impacts(SEEN * own.usual()));
            if kind == SensorKind::Acc {
                let side = |time, values| Side { time, values };
                let sides = [side(&recording.time, &real.values), side(&rows, values)];
                unmatched = Strikes::of(sides[0], sides[1], of_sensor.clone()).unmatched();
            }
        }
        times.extend(of_sensor);
    }
    times.sort_by(f64::total_cmp);
    let margin = MARGIN * interval(&recording.time).max(interval(&rows));
    let is_clear = |time: &f64| {
        let next = times.partition_point(|impact| *impact < time - margin);
        times.get(next).is_none_or(|impact| *impact > time + margin)
    };
    let mut resolved: Vec<bool> = recording.time.iter().map(is_clear).collect();
    let left_out = resolved.iter().filter(|resolved| !**resolved).count();
    if left_out as f64 > MOST * resolved.len() as f64 {
        resolved.fill(true);
    }
    Impacts { resolved, unmatched }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        effect::find,
        simulator::{
            Dose,
            robot::{MismatchKind, RobotKind, RobotScene},
        },
    };

    fn left_out(scene: &RobotScene) -> f64 {
        let pair = scene.record("pair").unwrap();
        let stream = Stream::of(&pair.simulated).unwrap();
        let rows = impacts(&pair.real, &stream, &StreamClock::default()).resolved;
        rows.iter().filter(|resolved| !**resolved).count() as f64 / rows.len() as f64
    }

    #[test]
    fn feet_that_strike_are_left_out_and_vibration_is_not() {
        let of = |kind| RobotScene { kind, duration: 60.0, seed: 4, ..RobotScene::default() };
        let legged = left_out(&of(RobotKind::Legged));
        assert!((0.01..0.3).contains(&legged), "{legged}");
        for kind in [RobotKind::Wheeled, RobotKind::Flying] {
            let scene = RobotScene { vibration: 3.0, ..of(kind) };
            let share = left_out(&scene);
            assert!(share < 0.05, "{kind:?} {share}");
        }
    }

    #[test]
    fn feet_that_strike_otherwise_than_the_simulator_says_are_a_stretch_and_others_are_none() {
        let scene = RobotScene {
            kind: RobotKind::Legged,
            duration: 240.0,
            real_rate: 500.0,
            sim_rate: 500.0,
            seed: 4,
            ..RobotScene::default()
        };
        let unmatched = |scene: &RobotScene| {
            let pair = scene.record("pair").unwrap();
            impacts(&pair.real, &Stream::of(&pair.simulated).unwrap(), &StreamClock::default()).unmatched
        };
        let harder = RobotScene { mismatch: Some((MismatchKind::Contact, 6.0)), ..scene };
        // Where only the stream resolves the impacts, by their gains: one drawn size is twice as hard, or none at all.
        for (otherwise, least) in [
            (harder.clone(), 1.0),
            (RobotScene { real_rate: 125.0, mismatch: Some((MismatchKind::Contact, 1.0)), ..harder }, 0.3),
        ] {
            assert_eq!(unmatched(&RobotScene { mismatch: None, ..otherwise.clone() }), []);
            let stretches = otherwise.moved().unwrap().mismatch.stretches;
            let found = unmatched(&otherwise);
            assert!(!found.is_empty());
            for found in found {
                let (start, end) = (found.time.start + 1.0, found.time.end - 1.0);
                let is_true = stretches
                    .iter()
                    .any(|stretch| start > stretch.span.0 - 1.0 && end < stretch.span.1 + 1.0);
                assert!(is_true && found.force > least, "{found:?} {stretches:?}");
            }
        }
    }

    #[test]
    fn a_sensor_s_own_faults_are_no_impacts() {
        let scene = |id: &str, size: f64| {
            let doses = vec![Dose::sized(find(id).unwrap(), size, 5, 60.0)];
            RobotScene { kind: RobotKind::Wheeled, duration: 60.0, doses, ..RobotScene::default() }
        };
        let healthy = left_out(&RobotScene { doses: Vec::new(), ..scene("acc.scale_cubic", 1.0) });
        for (id, size) in [("acc.scale_cubic", 10.0), ("mag.field_gradient", 10.0), ("gyr.noise_burst", 3.0)]
        {
            let share = left_out(&scene(id, size));
            assert!((share - healthy).abs() < 0.01, "{id} {share} {healthy}");
        }
    }
}
