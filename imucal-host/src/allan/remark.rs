//! What is odd about a sensor's samples, in words.

use crate::recording::{SensorKind, Unit};

/// What is odd about a sensor's samples.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Remark {
    /// Times are irregular.
    #[error(
        "{sensor}: intervals vary by {:.1} % rms; samples are taken as equally spaced, {interval:.6} s apart", 100.0 * .jitter
    )]
    Jitter {
        /// Which sensor.
        sensor: SensorKind,
        /// Rms of the intervals, of their mean.
        jitter: f64,
        /// Their mean, s.
        interval: f64,
    },
    /// Samples are missing.
    #[error(
        "{sensor}: samples are missing from {first:.3} s on; {bridged} were bridged by straight lines, {gaps} longer gaps (up \
         to {longest:.2} s) end a stretch, and no average goes across{}",
        larger(*.excess)
    )]
    Gaps {
        /// Which sensor.
        sensor: SensorKind,
        /// Time of the first, s.
        first: f64,
        /// Samples bridged.
        bridged: u64,
        /// Longer gaps.
        gaps: u64,
        /// The longest, s.
        longest: f64,
        /// Share by which straight lines enlarge N at most.
        excess: f64,
    },
    /// Little moved.
    #[error(
        "{sensor}: {blocks} of {of} blocks of a second moved, at {time:.1} s the most; the variances hardly show it"
    )]
    Knocked {
        /// Which sensor.
        sensor: SensorKind,
        /// Blocks that moved.
        blocks: u64,
        /// All of them.
        of: u64,
        /// Time of the largest, s.
        time: f64,
    },
    /// The output is read more often than it changes.
    #[error(
        "{sensor}: each value is read {times:.1} times on average before it changes; averages below {shortest:.3} s are not \
         fitted"
    )]
    Repeated {
        /// Which sensor.
        sensor: SensorKind,
        /// How often.
        times: f64,
        /// Averages from which on are fitted, s.
        shortest: f64,
    },
    /// The kinds of noise do not explain the variances.
    #[error(
        "{sensor}, axis {axis}: white noise, bias instability and random walk do not explain the variances (chi-squared \
         {chi_square:.0} of {freedom} degrees of freedom); standard errors were raised by {inflation:.1}"
    )]
    Misfit {
        /// Which sensor.
        sensor: SensorKind,
        /// x, y or z.
        axis: char,
        /// χ².
        chi_square: f64,
        /// Its degrees of freedom.
        freedom: usize,
        /// The factor.
        inflation: f64,
    },
    /// Averages were left out.
    #[error(
        "{sensor}, axis {axis}: averages below {from:.3} s do not fit, as after a filter; they are left out of the fit"
    )]
    Filtered {
        /// Which sensor.
        sensor: SensorKind,
        /// x, y or z.
        axis: char,
        /// From which on they were fitted, s.
        from: f64,
    },
    /// Rounding hides the noise.
    #[error(
        "{sensor}, axis {axis}: samples are rounded to steps of {step:.3e} {unit}, {:.1} times as large as what they scatter by: \
         N, B and K would depend on where between two steps the bias lies, and the axis has no coefficients; record with finer \
         steps, such as those of a smaller range", .step / .deviation
    )]
    Rounded {
        /// Which sensor.
        sensor: SensorKind,
        /// x, y or z.
        axis: char,
        /// The step, SI unit.
        step: f64,
        /// Standard deviation of the samples, from their differences, SI unit.
        deviation: f64,
        /// That unit.
        unit: Unit,
    },
    /// The axis shows nothing but one value.
    #[error(
        "{sensor}, axis {axis}: all samples are {value}: rounding hides the noise, and the axis has no coefficients"
    )]
    Constant {
        /// Which sensor.
        sensor: SensorKind,
        /// x, y or z.
        axis: char,
        /// The value, SI unit.
        value: f64,
    },
}

/// An excess of N, a share, that is worth a word.
const WORTH: f64 = 2e-3;

fn larger(excess: f64) -> String {
    if excess < WORTH {
        return String::new();
    }
    let percent = 100.0 * excess;
    format!(
        "; the lines make N up to {percent:.1} % too large, which its interval does not say, and B likewise"
    )
}
