//! Smooth courses of one gimbal's angle, with exact first and second derivatives.

use std::f64::consts::TAU;

use crate::effect::Swing;

/// The angle of a gimbal over a segment. Rate and acceleration vanish at both ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Course {
    /// From one angle to another, rad, along a quintic; the same two is a rest.
    Slew {
        /// At the beginning, rad.
        from: f64,
        /// At the end, rad.
        to: f64,
    },
    /// Constant rate, reached and left within `ramp` along a quintic.
    Cruise {
        /// Angle at the beginning, rad.
        from: f64,
        /// Rate between the ramps, rad/s.
        rate: f64,
        /// Length of each ramp, s; at most half the segment.
        ramp: f64,
    },
    /// A whole number of swings about an angle, swelling over the first fifth and fading over the last.
    Sine {
        /// Middle, where it begins and ends, rad.
        centre: f64,
        /// Largest excursion, rad.
        amplitude: f64,
        /// Number of swings in the segment.
        swings: f64,
    },
}

/// 0 to 1 with vanishing first and second derivatives at both ends: value, first and second derivative by u.
fn quintic(u: f64) -> (f64, f64, f64) {
    let u = u.clamp(0.0, 1.0);
    let v = 1.0 - u;
    (u * u * u * (10.0 - 15.0 * u + 6.0 * u * u), 30.0 * u * u * v * v, 60.0 * u * v * (v - u))
}

/// Integral of [`quintic`] from 0; 0.5 at u = 1.
fn quintic_integral(u: f64) -> f64 {
    let u4 = u * u * u * u;
    u4 * (2.5 - 3.0 * u + u * u)
}

impl Course {
    /// At `time` s of a segment of `duration` s.
    pub fn at(&self, time: f64, duration: f64) -> Swing {
        match *self {
            Self::Slew { from, to } if from == to => Swing::still(from),
            Self::Slew { from, to } => {
                let (value, first, second) = quintic(time / duration);
                let span = to - from;
                Swing {
                    angle: from + span * value,
                    rate: span * first / duration,
                    acceleration: span * second / (duration * duration),
                }
            }
            Self::Cruise { from, rate, ramp } => cruise(from, rate, ramp, time, duration),
            Self::Sine { centre, amplitude, swings } => sine(centre, amplitude, swings, time, duration),
        }
    }
}

fn cruise(from: f64, rate: f64, ramp: f64, time: f64, duration: f64) -> Swing {
    let left = duration - time;
    // What is left of the way looks as the way so far does, from the other end.
    let (share, sign) = if time < ramp { (time / ramp, 1.0) } else { (left / ramp, -1.0) };
    if share >= 1.0 {
        return Swing { angle: from + rate * (time - 0.5 * ramp), rate, acceleration: 0.0 };
    }
    let (value, first, _) = quintic(share);
    let way = rate * ramp * quintic_integral(share);
    let angle = if sign > 0.0 { from + way } else { from + rate * (duration - ramp) - way };
    Swing { angle, rate: rate * value, acceleration: sign * rate * first / ramp }
}

fn sine(centre: f64, amplitude: f64, swings: f64, time: f64, duration: f64) -> Swing {
    let swell = 0.2 * duration;
    let (u, sign) = if time < 0.5 * duration { (time, 1.0) } else { (duration - time, -1.0) };
    let (e, e1, e2) = quintic(u / swell);
    let (e1, e2) = (sign * e1 / swell, e2 / (swell * swell));
    let w = TAU * swings / duration;
    let (sin, cos) = libm::sincos(w * time);
    Swing {
        angle: centre + amplitude * e * sin,
        rate: amplitude * (e1 * sin + e * w * cos),
        acceleration: amplitude * (e2 * sin + 2.0 * e1 * w * cos - e * w * w * sin),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_those_of_the_angle_and_vanish_at_the_ends() {
        let h = 1e-5;
        for course in [
            Course::Slew { from: -0.4, to: 2.2 },
            Course::Cruise { from: 0.3, rate: -1.4, ramp: 0.8 },
            Course::Sine { centre: 0.6, amplitude: 0.3, swings: 7.0 },
        ] {
            for k in 1..400 {
                let t = 0.01 * f64::from(k);
                let at = |t| course.at(t, 4.0);
                let rate = (at(t + h).angle - at(t - h).angle) / (2.0 * h);
                let acceleration = (at(t + h).rate - at(t - h).rate) / (2.0 * h);
                assert!((rate - at(t).rate).abs() < 1e-7, "{course:?} {t}");
                assert!((acceleration - at(t).acceleration).abs() < 1e-3, "{course:?} {t}");
            }
            for end in [0.0, 4.0] {
                assert!(
                    course.at(end, 4.0).rate.abs() < 1e-12 && course.at(end, 4.0).acceleration.abs() < 1e-9
                );
            }
        }
    }

    #[test]
    fn a_cruise_covers_rate_times_the_time_less_a_ramp() {
        let course = Course::Cruise { from: 1.0, rate: 2.0, ramp: 0.5 };
        assert!((course.at(4.0, 4.0).angle - 8.0).abs() < 1e-12);
    }
}
