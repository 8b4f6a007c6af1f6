//! What a residual is tested against: a name, what it follows, and a shape over the observations.

use crate::calibrate::{
    fit::blocked_score::{PARTS, step_begin},
    suspicion::Follows,
};

/// A function of the observation with which a parameter could change.
#[derive(Clone, Debug)]
pub struct Course {
    /// What a residual with it follows.
    pub follows: Follows,
    /// In words, after "follows".
    pub name: String,
    shape: Shape,
}

#[derive(Clone, Debug)]
enum Shape {
    /// Its value at each observation, without the mean.
    Values(Vec<f64>),
    Step(Step),
}

/// From 0 to 1 where a part of the observations begins, less the mean.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// The part, of [`PARTS`].
    pub part: usize,
    first: usize,
    mean: f64,
}

impl Course {
    fn new(follows: Follows, name: String, mut values: Vec<f64>) -> Option<Self> {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        values.iter_mut().for_each(|value| *value -= mean);
        let most = values.iter().map(|v| v.abs()).fold(0.0, f64::max);
        (most.is_finite() && most > 0.0).then_some(Self { follows, name, shape: Shape::Values(values) })
    }

    /// Time, steps in time, and temperature where each observation has one.
    pub fn all(times: Vec<f64>, temperatures: Option<Vec<f64>>) -> Vec<Self> {
        let steps: Vec<Self> = (1..PARTS).filter_map(|part| Self::step(&times, part)).collect();
        let temperature = temperatures.and_then(|t| Self::new(Follows::Temperature, "temperature".into(), t));
        Self::new(Follows::Time, "time".into(), times).into_iter().chain(temperature).chain(steps).collect()
    }

    fn step(times: &[f64], part: usize) -> Option<Self> {
        let first = step_begin(part, times.len());
        let at = times.get(first).filter(|_| first > 0)?;
        let mean = (times.len() - first) as f64 / times.len() as f64;
        let shape = Shape::Step(Step { part, first, mean });
        Some(Self { follows: Follows::Time, name: format!("a step at {at:.0} s"), shape })
    }

    /// Its value at an observation, without the mean.
    pub fn value(&self, observation: usize) -> f64 {
        match &self.shape {
            Shape::Values(values) => values[observation],
            Shape::Step(step) => f64::from(u8::from(observation >= step.first)) - step.mean,
        }
    }

    /// In words, of something that changes with it.
    pub fn changing(&self, what: &str) -> String {
        format!("{}, as a {what} makes it that changes", self.name)
    }

    /// Its largest value, of either sign, at so many observations.
    pub fn largest(&self, observations: usize) -> f64 {
        (0..observations).map(|k| self.value(k).abs()).fold(0.0, f64::max)
    }

    /// The step that it is, if it is one.
    pub fn as_step(&self) -> Option<Step> {
        match self.shape {
            Shape::Values(_) => None,
            Shape::Step(step) => Some(step),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_temperature_that_is_not_recorded_at_each_observation_is_no_course() {
        let times: Vec<f64> = (0..16).map(f64::from).collect();
        let none = Course::all(times.clone(), None);
        assert!(none.iter().all(|course| course.follows == Follows::Time));
        assert_eq!(none.len(), PARTS);
        let warm = Course::all(times.clone(), Some(times));
        assert_eq!(warm.len(), PARTS + 1);
        assert!(warm.iter().all(|course| (0..16).map(|k| course.value(k)).sum::<f64>().abs() < 1e-9));
        assert!(
            Course::all(vec![0.0, 1.0], Some(vec![f64::NAN, 20.0]))
                .iter()
                .all(|c| c.follows == Follows::Time)
        );
    }
}
