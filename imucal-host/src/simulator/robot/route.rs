//! Where a machine goes: legs over which speed, heading and height change smoothly, from rest to rest.
//!
//! ```text
//! ṗ = v (cos ψ, sin ψ),   l̇ = v      v and ψ: a blend from one value to another over each leg
//! ```
//!
//! Speed and acceleration are closed forms. The way is their integral, by five points of Gauss and Legendre on intervals
//! of a tenth of a second, which is exact to rounding for what is as smooth as this.

use super::jet::Jet;

/// Longest interval of the integral, s.
const INTERVAL: f64 = 0.1;
/// Points and weights of Gauss and Legendre on −1 to 1.
const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// A part of the way: what changes over it, from and to.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Leg {
    start: f64,
    duration: f64,
    /// m/s, forward.
    speed: (f64, f64),
    /// rad, from north over east.
    heading: (f64, f64),
    /// m, up.
    height: (f64, f64),
}

/// What a machine does at an instant, but for its gait.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Going {
    /// m/s, forward.
    pub speed: Jet,
    /// m/s², forward.
    pub acceleration: Jet,
    /// rad, from north over east.
    pub heading: Jet,
    /// rad/s, of the heading.
    pub turn: Jet,
    /// m, up.
    pub height: Jet,
    /// m north, m east, m along the way.
    pub way: [Jet; 3],
}

/// A plan of legs, one after another.
#[derive(Clone, Debug)]
pub struct Plan {
    legs: Vec<Leg>,
    time: f64,
    speed: f64,
    heading: f64,
    height: f64,
}

/// A way from rest to rest.
#[derive(Clone, Debug)]
pub struct Route {
    legs: Vec<Leg>,
    /// For each leg the way to the beginning of each of its intervals.
    ways: Vec<Vec<[f64; 3]>>,
}

impl Plan {
    /// At rest, with a heading, rad.
    pub fn new(heading: f64) -> Self {
        Self { legs: Vec::new(), time: 0.0, speed: 0.0, heading, height: 0.0 }
    }

    /// Time planned so far, s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Speed at the end so far, m/s.
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// A leg of this length, s, to a speed, with a turn, to a height.
    pub fn leg(&mut self, duration: f64, speed: f64, turn: f64, height: f64) {
        let leg = Leg {
            start: self.time,
            duration,
            speed: (self.speed, speed),
            heading: (self.heading, self.heading + turn),
            height: (self.height, height),
        };
        (self.time, self.speed, self.heading, self.height) =
            (self.time + duration, speed, leg.heading.1, height);
        self.legs.push(leg);
    }

    /// A leg on which nothing changes: a rest, or going on.
    pub fn hold(&mut self, duration: f64) {
        self.leg(duration, self.speed, 0.0, self.height);
    }

    /// A leg that changes the speed alone.
    pub fn pace(&mut self, duration: f64, speed: f64) {
        self.leg(duration, speed, 0.0, self.height);
    }

    /// A leg that turns, at the speed it has.
    pub fn turn(&mut self, duration: f64, angle: f64) {
        self.leg(duration, self.speed, angle, self.height);
    }

    /// A leg to a height, at the speed it has.
    pub fn climb(&mut self, duration: f64, height: f64) {
        self.leg(duration, self.speed, 0.0, height);
    }

    /// Its way.
    pub fn route(self) -> Route {
        let mut way = [0.0; 3];
        let ways = self.legs.iter().map(|leg| {
            let count = leg.intervals();
            let interval = leg.duration / count as f64;
            let starts = (0..count).map(|k| {
                let here = way;
                let from = leg.start + interval * k as f64;
                way = leg.further(way, from, interval);
                here
            });
            starts.collect()
        });
        Route { ways: ways.collect(), legs: self.legs }
    }
}

impl Leg {
    fn intervals(&self) -> usize {
        (self.duration / INTERVAL).ceil().max(1.0) as usize
    }

    fn share(&self, time: f64) -> Jet {
        Jet { value: (time - self.start) / self.duration, first: 1.0 / self.duration, second: 0.0 }
    }

    /// A way from a time on for a while, s.
    fn further(&self, mut way: [f64; 3], from: f64, length: f64) -> [f64; 3] {
        if self.speed == (0.0, 0.0) {
            return way;
        }
        for (point, weight) in GAUSS {
            let step = self.share(from + 0.5 * length * (1.0 + point)).step().value;
            let speed = self.speed.0 + (self.speed.1 - self.speed.0) * step;
            let heading = self.heading.0 + (self.heading.1 - self.heading.0) * step;
            let (sin, cos) = libm::sincos(heading);
            let part = 0.5 * length * weight * speed;
            way[0] += part * cos;
            way[1] += part * sin;
            way[2] += part;
        }
        way
    }
}

impl Route {
    /// Its length, s.
    pub fn duration(&self) -> f64 {
        self.legs.last().map_or(0.0, |leg| leg.start + leg.duration)
    }

    /// What is done at a time, s; before and after, that of the nearest end.
    pub fn at(&self, time: f64) -> Going {
        let time = time.clamp(0.0, self.duration());
        let after = self.legs.partition_point(|leg| leg.start <= time);
        let at = after.saturating_sub(1);
        let (Some(leg), Some(ways)) = (self.legs.get(at), self.ways.get(at)) else { return Going::nothing() };
        let share = leg.share(time);
        let (step, slope) = (share.step(), share.step_slope());
        let course = |(from, to): (f64, f64)| step * (to - from) + from;
        let change = |(from, to): (f64, f64)| slope * ((to - from) / leg.duration);
        let (speed, heading) = (course(leg.speed), course(leg.heading));
        let (sin, cos) = heading.sin_cos();
        let interval = leg.duration / ways.len() as f64;
        let k = (((time - leg.start) / interval) as usize).min(ways.len() - 1);
        let from = leg.start + interval * k as f64;
        let way = leg.further(ways[k], from, time - from);
        let along = |value: f64, velocity: Jet| Jet { value, first: velocity.value, second: velocity.first };
        Going {
            speed,
            acceleration: change(leg.speed),
            heading,
            turn: change(leg.heading),
            height: course(leg.height),
            way: [along(way[0], speed * cos), along(way[1], speed * sin), along(way[2], speed)],
        }
    }
}

impl Going {
    fn nothing() -> Self {
        let still = Jet::default();
        Self {
            speed: still,
            acceleration: still,
            heading: still,
            turn: still,
            height: still,
            way: [still; 3],
        }
    }

    /// A shift forward and to the right, m, as one to north and east.
    pub fn sideways(&self, forward: Jet, right: Jet) -> [Jet; 2] {
        let (sin, cos) = self.heading.sin_cos();
        [cos * forward - sin * right, sin * forward + cos * right]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn route() -> Route {
        let mut plan = Plan::new(0.4);
        plan.hold(2.0);
        plan.leg(1.5, 1.2, 0.7, 3.0);
        plan.hold(3.3);
        plan.turn(2.1, -2.5);
        plan.pace(0.9, 0.0);
        plan.hold(1.0);
        plan.route()
    }

    #[test]
    fn the_way_is_the_integral_of_the_speed_and_all_is_smooth_across_legs() {
        let (route, h) = (route(), 1e-4);
        for k in 1..1070 {
            let t = 0.01 * f64::from(k);
            let (before, here, after) = (route.at(t - h), route.at(t), route.at(t + h));
            let all = |g: &Going| [g.way[0], g.way[1], g.way[2], g.speed, g.heading, g.height];
            for ((before, here), after) in all(&before).into_iter().zip(all(&here)).zip(all(&after)) {
                assert!(((after.value - before.value) / (2.0 * h) - here.first).abs() < 1e-6, "{t}");
                assert!(((after.first - before.first) / (2.0 * h) - here.second).abs() < 1e-5, "{t}");
            }
            assert!((here.acceleration.value - here.speed.first).abs() < 1e-12, "{t}");
            assert!((here.acceleration.first - here.speed.second).abs() < 1e-12, "{t}");
            assert!((here.turn.value - here.heading.first).abs() < 1e-12, "{t}");
            assert!((after.turn.first - before.turn.first).abs() < 1e-2, "{t}");
        }
    }

    #[test]
    fn it_begins_and_ends_at_rest() {
        let route = route();
        for t in [-3.0, 0.0, 1.9, 10.5, 100.0] {
            let here = route.at(t);
            assert_eq!((here.speed, here.turn, here.acceleration), Default::default());
            assert_eq!((here.way[2].first, here.way[2].second), (0.0, 0.0));
        }
        assert_eq!(route.at(50.0), route.at(route.duration()));
        assert!((route.duration() - 10.8).abs() < 1e-12);
    }
}
