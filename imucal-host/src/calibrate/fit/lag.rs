//! How far a sensor is behind an attitude that something else knows: the lag at which a fit leaves least.
//!
//! On the way, a lag of 4 ms at a rate of 1 rad/s is an angle of 0.2°, more than an optical system's own error. At the
//! rests of a rig it is none.

use rayon::prelude::*;

/// How far the clocks of sensor and optical reference are looked for apart, s, and the first step of that search.
const REACH: f64 = 0.048;
const STEP: f64 = 0.008;
/// Halvings of the step: the last is an eighth of a millisecond.
const HALVINGS: usize = 6;
/// To either side of the least, s, where the squares are looked at again: they are a parabola there.
const NEAR: f64 = 0.002;

/// What was found of a lag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lag {
    /// The sensor is so far behind, s.
    Found(f64),
    /// The best is at an end of the search.
    OutOfReach,
}

impl Lag {
    /// The lag at which `rms` is least, by the vertex of the parabola that the squares of `fine` lie on: the same
    /// residual, where `rms` is of a part of the observations.
    pub fn of(rms: impl Fn(f64) -> f64 + Sync, fine: impl Fn(f64) -> f64 + Sync) -> Self {
        let least = |lags: Vec<f64>| {
            let all: Vec<(f64, f64)> = lags.into_par_iter().map(|lag| (rms(lag), lag)).collect();
            all.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))
        };
        let steps = (REACH / STEP).round() as i32;
        let Some(mut best) = least((-steps..=steps).map(|k| f64::from(k) * STEP).collect()) else {
            return Self::OutOfReach;
        };
        if best.1.abs() > REACH - 0.5 * STEP {
            return Self::OutOfReach;
        }
        let mut step = STEP;
        for _ in 0..HALVINGS {
            step *= 0.5;
            let near = least(vec![best.1 - step, best.1 + step]).filter(|other| other.0 < best.0);
            best = near.unwrap_or(best);
        }
        let near = [-NEAR, 0.0, NEAR].into_par_iter().map(|aside| fine(best.1 + aside).powi(2));
        let [below, least, above] = near.collect::<Vec<_>>()[..] else { return Self::Found(best.1) };
        let vertex = 0.5 * NEAR * (below - above) / (below - 2.0 * least + above);
        // Flat, or bent the other way: no vertex near by.
        Self::Found(best.1 + if vertex.abs() <= NEAR { vertex } else { 0.0 })
    }

    /// In words.
    pub fn note(self) -> String {
        match self {
            Self::Found(lag) => {
                let words = if lag < 0.0 { "ahead of" } else { "behind" };
                format!(
                    "the sensor is {:.1} ms {words} the reference; the fit corrects for it",
                    1e3 * lag.abs()
                )
            }
            Self::OutOfReach => {
                format!("no lag within {REACH} s of the reference fits best; none is taken out")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_of_a_parabola_is_found() {
        let rms = |lag: f64| (0.3 + (lag + 0.0123).powi(2)).sqrt();
        let Lag::Found(lag) = Lag::of(rms, rms) else { panic!("within reach") };
        assert!((lag + 0.0123).abs() < 1e-9, "{lag}");
    }

    #[test]
    fn a_least_at_the_end_of_the_search_is_none() {
        assert_eq!(Lag::of(|lag| -lag, |lag| -lag), Lag::OutOfReach);
    }
}
