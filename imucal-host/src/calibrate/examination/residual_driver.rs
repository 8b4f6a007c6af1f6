//! What a residual is tested against: a name, what it follows, and a shape over the observations.

use crate::calibrate::suspicion::Follows;

/// Parts of the recording at whose borders a step is looked for.
const PARTS: usize = 8;

/// A function of the observation with which a parameter could change.
#[derive(Clone, Debug)]
pub struct Course {
    /// What a residual with it follows.
    pub follows: Follows,
    /// In words, after "follows".
    pub name: String,
    /// Its value at each observation, without the mean.
    pub values: Vec<f64>,
}

impl Course {
    fn new(follows: Follows, name: String, values: &[f64]) -> Option<Self> {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let values: Vec<f64> = values.iter().map(|v| v - mean).collect();
        let most = values.iter().map(|v| v.abs()).fold(0.0, f64::max);
        (most.is_finite() && most > 0.0).then_some(Self { follows, name, values })
    }

    /// Time, steps in time, and temperature where each observation has one.
    pub fn all(times: &[f64], temperatures: &[f64]) -> Vec<Self> {
        let mut courses = Vec::new();
        courses.extend(Self::new(Follows::Time, "time".into(), times));
        courses.extend(Self::new(Follows::Temperature, "temperature".into(), temperatures));
        for part in 1..PARTS {
            let first = part * times.len() / PARTS;
            let Some(at) = times.get(first) else { continue };
            let step: Vec<f64> = (0..times.len()).map(|k| f64::from(u8::from(k >= first))).collect();
            courses.extend(Self::new(Follows::Time, format!("a step at {at:.0} s"), &step));
        }
        courses
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_temperature_that_is_not_recorded_is_no_course() {
        let times: Vec<f64> = (0..16).map(f64::from).collect();
        let none = Course::all(&times, &[f64::NAN; 16]);
        assert!(none.iter().all(|course| course.follows == Follows::Time));
        assert_eq!(none.len(), PARTS);
        let warm = Course::all(&times, &times);
        assert_eq!(warm.len(), PARTS + 1);
        assert!(warm.iter().all(|course| course.values.iter().sum::<f64>().abs() < 1e-9));
    }
}
