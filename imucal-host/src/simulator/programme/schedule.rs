//! A movement of the rig: what each gimbal does when, where it stands, and how warm it is there.

use nalgebra::Vector3;

use crate::{
    effect::{Machine, Swing, Truth},
    recording::manifest::{Axis, Rig, RigKind},
    simulator::{
        climate::Climate,
        course::Course,
        gimbal::direction,
        place::Place,
        random::{Purpose, Random},
        recent::Recent,
        truth::{Motion, on_rig},
    },
};

/// What the gimbals do for a while.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Length, s.
    pub duration: f64,
    /// Course of each gimbal, outermost first.
    pub courses: [Course; 3],
}

impl Segment {
    /// No gimbal moves.
    pub fn is_rest(&self) -> bool {
        self.courses.iter().all(|course| matches!(course, Course::Slew { from, to } if from == to))
    }
}

/// Segments one after another, on a rig at a place.
#[derive(Clone, Debug)]
pub struct Schedule {
    axes: [Axis; 3],
    segments: Vec<Segment>,
    /// When each segment begins, s.
    starts: Vec<f64>,
    /// How far the gimbals stand from their encoders at the beginning of each segment and at the end, rad.
    scatter: Vec<[f64; 3]>,
    /// Heading of the base, rad.
    heading: f64,
    /// Levelling tilt of the base, rad.
    tilt: [f64; 2],
    climate: Climate,
    place: Place,
}

impl Schedule {
    /// On an exact, level rig that points north.
    pub fn new(axes: [Axis; 3], segments: Vec<Segment>, climate: Climate, place: Place) -> Self {
        let mut starts = Vec::with_capacity(segments.len());
        let mut end = 0.0;
        for segment in &segments {
            starts.push(end);
            end += segment.duration;
        }
        let scatter = vec![[0.0; 3]; segments.len() + 1];
        Self { axes, segments, starts, scatter, heading: 0.0, tilt: [0.0; 2], climate, place }
    }

    /// On a base levelled to some 0.05° and pointed to some 0.5°, drawn from the seed.
    #[must_use]
    pub fn on_base(mut self, seed: u64) -> Self {
        let mut random = Random::new(seed, Purpose::Rig);
        self.tilt = [(); 2].map(|()| 0.05f64.to_radians() * random.normal());
        self.heading = 0.5f64.to_radians() * random.normal();
        self
    }

    /// Gimbals that come to rest some thousandths of a degree off their encoders, by another angle at each rest: `sigma` in rad.
    #[must_use]
    pub fn scattered(mut self, sigma: f64, random: &mut Random) -> Self {
        let mut here = [0.0; 3];
        for (at, segment) in self.segments.iter().enumerate() {
            self.scatter[at] = here;
            if !segment.is_rest() {
                here = here.map(|_| sigma * random.normal());
            }
            self.scatter[at + 1] = here;
        }
        self
    }

    fn at(&self, time: f64) -> Option<(usize, &Segment, f64)> {
        let index = self.starts.partition_point(|start| *start <= time).saturating_sub(1);
        let segment = self.segments.get(index)?;
        Some((index, segment, (time - self.starts[index]).clamp(0.0, segment.duration)))
    }

    /// What the encoders ought to say.
    fn commanded(&self, time: f64) -> [Swing; 3] {
        let Some((_, segment, since)) = self.at(time) else { return Default::default() };
        segment.courses.map(|course| course.at(since, segment.duration))
    }

    /// How far the gimbals truly stand from there; goes over smoothly while they move.
    fn offset(&self, time: f64) -> [Swing; 3] {
        let Some((index, segment, since)) = self.at(time) else { return Default::default() };
        let (from, to) = (self.scatter[index], self.scatter[index + 1]);
        let mut swings = [Swing::default(); 3];
        for ((swing, from), to) in swings.iter_mut().zip(from).zip(to) {
            *swing = Course::Slew { from, to }.at(since, segment.duration);
        }
        swings
    }

    /// The rig at a time, s.
    pub fn machine(&self, time: f64) -> Machine {
        let mut machine = Machine::exact(self.axes.map(direction));
        (machine.heading, machine.tilt) = (self.heading, self.tilt);
        for ((gimbal, commanded), offset) in
            machine.gimbals.iter_mut().zip(self.commanded(time)).zip(self.offset(time))
        {
            *gimbal = commanded.plus(offset);
        }
        machine
    }

    /// Middles of the rests, s.
    pub fn rests(&self) -> Vec<f64> {
        let pairs = self.segments.iter().zip(&self.starts);
        pairs.filter(|(segment, _)| segment.is_rest()).map(|(s, start)| start + 0.5 * s.duration).collect()
    }

    /// Down in the table at a time: unit vector.
    pub fn down(&self, time: f64) -> Vector3<f64> {
        -self.truth(time, &|_| ()).f_t.normalize()
    }
}

impl Motion for Schedule {
    fn duration(&self) -> f64 {
        self.segments.iter().map(|segment| segment.duration).sum()
    }

    fn truth_among(&self, time: f64, rig: &dyn Fn(&mut Machine), recent: &mut Recent) -> Truth {
        let mut machine = self.machine(time);
        rig(&mut machine);
        on_rig(time, &machine, &self.place, self.climate.temperature(time), recent)
    }

    fn encoders(&self, time: f64) -> Option<[f64; 3]> {
        Some(self.commanded(time).map(|swing| swing.angle))
    }

    fn rig(&self) -> Rig {
        Rig { kind: RigKind::FlightMotionSimulator, axes: Some(self.axes.to_vec()) }
    }

    fn place(&self) -> Place {
        self.place
    }
}
