//! What a quantity was before: `lag(x, tau)` and `mean(x, tau)`.
//!
//! ```text
//! lag:   τ ẏ = x − y,  y = x at the first row         mean:  y(t) = 1/τ ∫ x over (t − τ, t)
//! ```
//!
//! Both are exact for an input that is straight between rows, so that rows need not be evenly apart and a run at fewer
//! points gives nearly the same. Before its first row an input was what it is there.

/// How a quantity's past counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum History {
    /// A low-pass of the first order with the time constant τ.
    Lag,
    /// The mean over the last τ.
    Mean,
}

impl History {
    /// That of a name.
    pub(super) fn find(name: &str) -> Option<Self> {
        match name {
            "lag" => Some(Self::Lag),
            "mean" => Some(Self::Mean),
            _ => None,
        }
    }

    /// Of a quantity at times, s, which do not decrease; `tau` in s, positive.
    pub(crate) fn of(self, times: &[f64], values: &[f64], tau: f64) -> Vec<f64> {
        match self {
            Self::Lag => lag(times, values, tau),
            Self::Mean => mean(times, values, tau),
        }
    }
}

fn lag(times: &[f64], values: &[f64], tau: f64) -> Vec<f64> {
    let mut state = values.first().copied().unwrap_or_default();
    let mut lagged = Vec::with_capacity(values.len());
    for (row, value) in values.iter().enumerate() {
        if row > 0 {
            let ratio = (times[row] - times[row - 1]) / tau;
            if ratio > 0.0 {
                let kept = libm::exp(-ratio);
                // Of the step between the rows, what is not yet followed: 1 − (1 − e^−r) / r.
                let share = -libm::expm1(-ratio) / ratio;
                state = state * kept + values[row - 1] * (share - kept) + value * (1.0 - share);
            }
        }
        lagged.push(state);
    }
    lagged
}

fn mean(times: &[f64], values: &[f64], tau: f64) -> Vec<f64> {
    let Some((first, start)) = values.first().zip(times.first()) else { return Vec::new() };
    // The integral of what the input is more than at first, up to each row.
    let mut integrals = Vec::with_capacity(values.len());
    let mut integral = 0.0;
    for row in 0..values.len() {
        if row > 0 {
            let step = times[row] - times[row - 1];
            integral += step * (0.5 * (values[row] + values[row - 1]) - first);
        }
        integrals.push(integral);
    }
    let mut before = 0;
    let mut up_to = |time: f64| {
        if time <= *start {
            return 0.0;
        }
        while times[before + 1] < time {
            before += 1;
        }
        let (since, step) = (time - times[before], times[before + 1] - times[before]);
        let slope = (values[before + 1] - values[before]) / step;
        integrals[before] + since * (values[before] - first + 0.5 * since * slope)
    };
    let of = |row: usize| first + (integrals[row] - up_to(times[row] - tau)) / tau;
    (0..values.len()).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uneven() -> Vec<f64> {
        let steps = (0..400).map(|k| [0.01, 0.05, 0.25, 0.0, 0.01][k % 5]);
        steps
            .scan(3.0, |time, step| {
                *time += step;
                Some(*time)
            })
            .collect()
    }

    #[test]
    fn a_steady_input_stays_as_it_is() {
        let times = uneven();
        for history in [History::Lag, History::Mean] {
            let of = history.of(&times, &vec![-4.25; times.len()], 0.4);
            assert!(of.iter().all(|value| (value + 4.25).abs() < 1e-14), "{history:?}");
            assert!(history.of(&[], &[], 1.0).is_empty());
            assert_eq!(history.of(&[1.0], &[2.0], 1.0), [2.0]);
        }
    }

    #[test]
    fn a_ramp_comes_late_by_the_time_constant_or_by_half_the_window() {
        let times = uneven();
        for (history, late) in [(History::Lag, 0.4), (History::Mean, 0.2)] {
            let of = history.of(&times, &times, 0.4);
            for (value, time) in of.iter().zip(&times).skip(300) {
                assert!((value - (time - late)).abs() < 1e-9, "{history:?}: {value} {time}");
            }
        }
    }

    #[test]
    fn a_step_is_followed_exponentially_or_within_the_window() {
        let times: Vec<f64> = (0..2000).map(|k| 1e-3 * f64::from(k)).collect();
        let step: Vec<f64> = times.iter().map(|time| f64::from(u8::from(*time >= 0.5))).collect();
        let at = |history: History, row: usize| history.of(&times, &step, 0.2)[row];
        assert!((at(History::Lag, 700) - (1.0 - libm::exp(-1.0))).abs() < 3e-3);
        assert!((at(History::Mean, 600) - 0.5).abs() < 3e-3 && (at(History::Mean, 720) - 1.0).abs() < 1e-12);
        assert_eq!([at(History::Lag, 499), at(History::Mean, 499)], [0.0; 2]);
    }

    #[test]
    fn only_the_past_counts() {
        let times = uneven();
        let mut later = times.clone();
        later[200..].iter_mut().for_each(|value| *value *= -7.0);
        for history in [History::Lag, History::Mean] {
            assert_eq!(history.of(&times, &times, 0.3)[..200], history.of(&times, &later, 0.3)[..200]);
        }
    }
}
