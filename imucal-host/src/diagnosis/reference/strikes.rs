//! Impacts one after the other, as a recording has them and as a stream has them.
//!
//! ```text
//! q = ln ((∫ |e_r|² + p) / (∫ |e_s|² + p))     ratio of an impact's powers
//! ```
//!
//! e_r and e_s are what a cubic does not foretell ([`super::unforeseen`]) of the recording and of the stream. Impacts in a row
//! that one side has and the other does not show ([`super::absence`]), or has with another gain ([`super::gain`]), both at
//! common instants ([`super::common_instants`]), or whose ratios are all on one side of the usual, are a contact that one side
//! does not have. The usual is the median: what the sensor makes of an impact is the same all the time.

use std::ops::Range;

use nalgebra::Vector3;

use super::{
    absence::absent_stretches,
    common_instants::CommonInstants,
    gain::{Gain, changed_stretches},
    unforeseen::Unforeseen,
};
use crate::recording::{median, order_statistics::std_of_median};

/// Impacts no further apart than this, s, are one.
const ONE: f64 = 0.06;
/// So many intervals of the slower clock to each side belong to an impact.
pub const MARGIN: f64 = 1.5;
/// Of fewer impacts in all it is not known what is usual; so many in a row are looked at together, without a pause longer than
/// this, s.
const FEWEST: usize = 20;
const IN_ROW: [usize; 6] = [4, 6, 8, 12, 16, 24];
const PAUSE: f64 = 3.0;
/// ln of a ratio of powers scatters by this at least.
const LEAST_SCATTER: f64 = 0.3;
/// One impact counts no more than so many standard deviations, and the mean of several in a row is unusual from so many on.
const LARGEST: f64 = 4.0;
const UNUSUAL: f64 = 8.5;
/// Noise is that of the samples within this time of an impact, s.
const NEAR: f64 = 1.0;

/// Impacts in a row that are weaker or stronger in the recording than in the stream.
#[derive(Clone, Debug, PartialEq)]
pub struct Unmatched {
    /// When, s of the recording's clock.
    pub time: Range<f64>,
    /// Root mean square of how far the largest |e| of the two sides are apart, m/s².
    pub force: f64,
    /// How far their sizes are from the usual: the square in standard deviations.
    pub energy: f64,
}

/// One side: samples of specific force at times of the recording's clock, s.
#[derive(Clone, Copy)]
pub struct Side<'a> {
    /// Times.
    pub time: &'a [f64],
    /// Samples, m/s².
    pub values: &'a [Vector3<f64>],
}

/// Impacts in the order of time.
pub struct Strikes {
    strikes: Vec<Strike>,
}

/// One impact.
struct Strike {
    time: f64,
    /// q.
    ratio: f64,
    /// Whether the recording does not show it, and whether the stream does not; `None` where that cannot be seen.
    absent: [Option<bool>; 2],
    /// g, at common instants.
    gain: Option<Gain>,
    /// Largest |e| in the recording less that in the stream.
    excess: f64,
}

impl Strikes {
    /// Of a recording and of a stream, from the times of impacts on either side, s.
    pub fn of(recording: Side<'_>, stream: Side<'_>, mut impacts: Vec<f64>) -> Self {
        impacts.sort_by(f64::total_cmp);
        let whole = [recording, stream].map(|side| Unforeseen::of(side.time, side.values));
        let slower = whole[0].interval.max(whole[1].interval);
        // A short pulse looks smaller to the finer clock: both are seen by the slower one.
        let [own, given] =
            [recording, stream].map(|side| Unforeseen::at_interval(side.time, side.values, slower));
        let margin = MARGIN * slower;
        let span = |times: &[f64]| times[0] - margin..times[times.len() - 1] + margin;
        let spans: Vec<Range<f64>> = impacts.chunk_by(|a, b| b - a < ONE).map(span).collect();
        let floor = own.floor().powi(2).max(f64::MIN_POSITIVE) * margin;
        let both = CommonInstants::new([recording, stream], &whole, &spans, own.noise());
        let strike = |span: &Range<f64>| {
            let shown = both.shown(span, own.noise_near(&(span.start - NEAR..span.end + NEAR)));
            let [own, given] = [&own, &given].map(|side| side.within(span));
            Strike {
                time: 0.5 * (span.start + span.end),
                ratio: ((own.power + floor) / (given.power + floor)).ln(),
                absent: shown.absent,
                gain: shown.gain,
                excess: own.largest - given.largest,
            }
        };
        Self { strikes: spans.iter().map(strike).collect() }
    }

    /// Stretches of impacts that one side does not show, or whose ratios are all on one side of the usual, the clearest first.
    pub fn unmatched(&self) -> Vec<Unmatched> {
        if self.strikes.len() < FEWEST {
            return Vec::new();
        }
        let pauses = self.pauses();
        let gains: Vec<Option<Gain>> = self.strikes.iter().map(|strike| strike.gain).collect();
        let mut by_odds = changed_stretches(&gains, &pauses);
        for side in 0..2 {
            let absent: Vec<Option<bool>> = self.strikes.iter().map(|strike| strike.absent[side]).collect();
            by_odds.extend(absent_stretches(&absent, &pauses));
        }
        // A sum of logarithms of odds is half the square of standard deviations.
        let as_deviations = |(strikes, sum): (Range<usize>, f64)| (strikes, (2.0 * sum).sqrt());
        let mut found = self.unusual_ratios(&pauses);
        found.extend(by_odds.into_iter().map(as_deviations));
        found.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut kept: Vec<(Range<usize>, f64)> = Vec::new();
        for (strikes, z) in found {
            let meets =
                |(other, _): &(Range<usize>, f64)| strikes.start < other.end && other.start < strikes.end;
            if !kept.iter().any(meets) {
                kept.push((strikes, z));
            }
        }
        kept.into_iter().map(|(strikes, z)| self.stretch(strikes, z)).collect()
    }

    /// Whether there is a pause before each impact.
    fn pauses(&self) -> Vec<bool> {
        let after = |pair: &[Strike]| matches!(pair, [before, after] if after.time - before.time >= PAUSE);
        std::iter::once(false).chain(self.strikes.windows(2).map(after)).collect()
    }

    /// Impacts in a row whose ratios are on one side of the usual, and by how many standard deviations.
    fn unusual_ratios(&self, pauses: &[bool]) -> Vec<(Range<usize>, f64)> {
        let usual = median(self.strikes.iter().map(|strike| strike.ratio).collect()).unwrap_or(0.0);
        let sizes = self.strikes.iter().map(|strike| (strike.ratio - usual).abs()).collect();
        let scatter = std_of_median(sizes).unwrap_or(0.0).max(LEAST_SCATTER);
        let of = |strike: &Strike| ((strike.ratio - usual) / scatter).clamp(-LARGEST, LARGEST);
        let off: Vec<f64> = self.strikes.iter().map(of).collect();
        let mut found = Vec::new();
        for count in IN_ROW.into_iter().filter(|count| *count <= off.len()) {
            let is_row = |from: &usize| !pauses[from + 1..from + count].contains(&true);
            let mean = |from: usize| off[from..from + count].iter().sum::<f64>() / count as f64;
            let rows: Vec<(usize, f64)> =
                (0..=off.len() - count).filter(is_row).map(|from| (from, mean(from))).collect();
            // Impacts in step with the samples are alike in a row: their mean scatters more than that of so many others.
            let sizes = rows.iter().map(|(_, mean)| mean.abs()).collect();
            let scatter = std_of_median(sizes).unwrap_or(0.0).max(1.0 / (count as f64).sqrt());
            let unusual = rows.into_iter().map(|(from, mean)| (from..from + count, mean.abs() / scatter));
            found.extend(unusual.filter(|(_, size)| *size > UNUSUAL));
        }
        found
    }

    fn stretch(&self, strikes: Range<usize>, z: f64) -> Unmatched {
        let own = &self.strikes[strikes];
        let squares: f64 = own.iter().map(|strike| strike.excess * strike.excess).sum();
        Unmatched {
            time: own[0].time - ONE..own[own.len() - 1].time + ONE,
            force: (squares / own.len() as f64).sqrt(),
            energy: z * z,
        }
    }
}
