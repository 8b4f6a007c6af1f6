//! Impacts that samples do not resolve: between two samples of a stream nothing is known of them.
//!
//! ```text
//! e_k = x_k − (4 (x_{k−1} + x_{k+1}) − (x_{k−2} + x_{k+2})) / 6
//! ```
//!
//! e is what a cubic through a sample's neighbours does not foretell, of the recording's samples and of the stream's. A foot
//! that strikes or a wheel on an edge stands far out of the samples about it; vibration, a movement along which all samples
//! are as hard to foretell, does not. Not recognised: impacts so dense that there is nothing between them.

use nalgebra::Vector3;

use crate::{
    recording::{Recording, SensorKind, Stream, median},
    simulator::StreamClock,
};

/// An impact stands out by this factor over the median of |e| about it,
const STANDS_OUT: f64 = 6.0;
/// and in the stream over this share of the recording's own median as well.
const SEEN: f64 = 1.0;
/// Length of the stretches over which medians are taken, s, and so many of them to each side.
const STRETCH: f64 = 0.5;
const ABOUT: usize = 2;
/// So many intervals of the slower clock to each side are left out with an impact.
const MARGIN: f64 = 1.5;
/// Neighbours further apart than so many intervals foretell nothing.
const APART: f64 = 1.6;
/// Where more than this share of the rows would be left out, the movement itself is that rough.
const MOST: f64 = 0.4;

/// Whether no impact is near, row by row of a recording that is compared with a stream on this clock.
pub fn resolved(recording: &Recording, stream: &Stream, clock: StreamClock) -> Vec<bool> {
    let mut impacts: Vec<f64> = Vec::new();
    for kind in SensorKind::ALL {
        let Some(real) = recording.sensor(kind) else { continue };
        let own = Unforeseen::of(&recording.time, &real.values);
        let usual = own.usual();
        impacts.extend(own.impacts(0.0));
        if let Some(values) = stream.values.sensor(kind) {
            let given = Unforeseen::of(&stream.time, values);
            // Where a row shows the stream of s: the clock's inverse.
            let row = |time: f64| time * (1.0 + clock.error) - clock.offset;
            impacts.extend(given.impacts(SEEN * usual).into_iter().map(row));
        }
    }
    impacts.sort_by(f64::total_cmp);
    let interval = |time: &[f64]| median(time.windows(2).map(|pair| pair[1] - pair[0]).collect());
    let slower = interval(&recording.time).into_iter().chain(interval(&stream.time)).fold(0.0, f64::max);
    let is_clear = |time: &f64| {
        let next = impacts.partition_point(|impact| *impact < time - MARGIN * slower);
        impacts.get(next).is_none_or(|impact| *impact > time + MARGIN * slower)
    };
    let resolved: Vec<bool> = recording.time.iter().map(is_clear).collect();
    let left_out = resolved.iter().filter(|resolved| !**resolved).count();
    if left_out as f64 > MOST * resolved.len() as f64 { vec![true; resolved.len()] } else { resolved }
}

/// |e| of samples that have four neighbours, by time, s.
struct Unforeseen {
    samples: Vec<(f64, f64)>,
}

impl Unforeseen {
    fn of(time: &[f64], values: &[Vector3<f64>]) -> Self {
        let interval = median(time.windows(2).map(|pair| pair[1] - pair[0]).collect()).unwrap_or(0.0);
        let of = |(t, x): (&[f64], &[Vector3<f64>])| {
            let even = t.windows(2).all(|pair| pair[1] - pair[0] < APART * interval);
            let foretold = ((x[1] + x[3]) * 4.0 - (x[0] + x[4])) / 6.0;
            let size = (x[2] - foretold).norm();
            (even && size.is_finite()).then_some((t[2], size))
        };
        Self { samples: time.windows(5).zip(values.windows(5)).filter_map(of).collect() }
    }

    /// The median of all.
    fn usual(&self) -> f64 {
        median(self.samples.iter().map(|(_, size)| *size).collect()).unwrap_or(0.0)
    }

    /// Times at which one stands out of those about it, and over `floor`.
    fn impacts(&self, floor: f64) -> Vec<f64> {
        let begins = self.samples.first().map_or(0.0, |(time, _)| *time);
        let stretch = |time: f64| ((time - begins) / STRETCH) as usize;
        let mut sizes: Vec<Vec<f64>> = Vec::new();
        for (time, size) in &self.samples {
            let at = stretch(*time);
            if sizes.len() <= at {
                sizes.resize(at + 1, Vec::new());
            }
            sizes[at].push(*size);
        }
        let medians: Vec<Option<f64>> = sizes.into_iter().map(median).collect();
        let about = |at: usize| {
            let near = medians[at.saturating_sub(ABOUT)..(at + ABOUT + 1).min(medians.len())].iter();
            median(near.flatten().copied().collect()).unwrap_or(0.0)
        };
        let limits: Vec<f64> = (0..medians.len()).map(|at| (STANDS_OUT * about(at)).max(floor)).collect();
        let stands_out = |(time, size): &&(f64, f64)| *size > limits[stretch(*time)];
        self.samples.iter().filter(stands_out).map(|(time, _)| *time).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        effect::find,
        simulator::{
            Dose,
            robot::{RobotKind, RobotScene},
        },
    };

    fn left_out(scene: &RobotScene) -> f64 {
        let pair = scene.record("pair").unwrap();
        let stream = Stream::of(&pair.simulated).unwrap();
        let rows = resolved(&pair.real, &stream, StreamClock::default());
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
