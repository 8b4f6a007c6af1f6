//! Thresholds of cumulative sums from the time between false alarms.
//!
//! For sums `C ← max(0, C + z − k)` of independent z ~ N(0, 1), the mean number of terms until `C ≥ h` grows by a factor of ten for
//! an almost constant step of h. The steps are those of the Markov chain of Brook and Evans (1972), computed by
//! `tests/oracle/watch_run_length.py`; between them h is interpolated. Siegmund's (1985) closed formula
//!
//! ```text
//! ARL ≈ (e^x − x − 1) / (2 k²),   x = 2 k (h + 1.166)
//! ```
//!
//! agrees where k is small ([`siegmund`]). Not modelled: terms that are correlated.

/// Run lengths of the tables: 10 to this power, and so on.
const FIRST_DECADE: u32 = 3;
/// Thresholds of the step chart, k 0.5, terms of 4 at most.
const STEP: [f32; 9] =
    [5.069_08, 7.357_85, 9.657_32, 11.958_26, 14.259_32, 16.560_45, 18.861_5, 21.162_75, 23.463_43];
/// Thresholds of the record chart, k 3.
const RECORD: [f32; 9] =
    [0.090_25, 0.719_67, 1.266_51, 1.756_43, 2.204_53, 2.620_85, 3.012_99, 3.387_7, 3.752_17];

/// Seconds of a day.
const DAY: f32 = 86_400.0;
/// Sums of each chart: six statistics, two sides.
const SUMS: f32 = 12.0;
/// Share of the false alarms that the step charts may have; the rest is the record charts'.
const STEP_SHARE: f32 = 0.8;
/// Poses a day, at most, that the record chart is laid out for.
const POSES: f32 = 8640.0;

/// Thresholds of the charts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thresholds {
    /// Of the step chart, standard deviations.
    pub step: f32,
    /// Of the record chart.
    pub record: f32,
}

impl Thresholds {
    /// For so many false alarms a day of rest, of all statistics together. Rates that no table reaches are the nearest that one does.
    pub fn of(false_alarms: f32) -> Self {
        let rate = false_alarms.max(f32::MIN_POSITIVE) / SUMS;
        Self {
            step: threshold(&STEP, DAY / (rate * STEP_SHARE)),
            record: threshold(&RECORD, POSES / (rate * (1.0 - STEP_SHARE))),
        }
    }
}

/// The threshold of a table at a run length.
fn threshold(table: &[f32], run_length: f32) -> f32 {
    let at = libm::log10f(run_length) - FIRST_DECADE as f32;
    // A run length that is not a number is the shortest, and one beyond the table its last.
    let most = table.len().saturating_sub(1);
    let at = if at > 0.0 { at } else { 0.0 };
    let at = if at < most as f32 { at } else { most as f32 };
    let below = at as usize;
    let last = table.last().copied().unwrap_or(0.0);
    let low = table.get(below).copied().unwrap_or(last);
    let high = table.get(below.saturating_add(1)).copied().unwrap_or(last);
    low + (at - below as f32) * (high - low)
}

/// Siegmund's approximation of the mean run length from zero, terms; `k` and `h` in standard deviations.
pub fn siegmund(k: f32, h: f32) -> f32 {
    let x = 2.0 * k * (h + 1.166);
    (libm::expf(x) - x - 1.0) / (2.0 * k * k)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thresholds_grow_as_false_alarms_become_rarer_and_stay_finite() {
        let mut before = Thresholds::of(f32::INFINITY);
        for rate in [1e9, 100.0, 1.0, 0.1, 0.01, 1e-3, 1e-9, 0.0, -1.0] {
            let now = Thresholds::of(rate);
            assert!(now.step >= before.step && now.record >= before.record, "{rate}: {now:?} {before:?}");
            before = now;
        }
        assert!(before.step < 24.0 && before.record < 4.0);
        assert!(Thresholds::of(f32::NAN).step.is_finite());
    }

    #[test]
    fn siegmund_agrees_with_the_chain_where_k_is_small() {
        for (decade, h) in (FIRST_DECADE..).zip(STEP) {
            let off = libm::log10f(siegmund(super::super::step::REFERENCE, h)) - decade as f32;
            assert!(off.abs() < 0.05, "10^{decade}: {off}");
        }
    }
}
