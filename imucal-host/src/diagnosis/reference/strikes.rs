//! Impacts one after the other, as a recording has them and as a stream has them.
//!
//! ```text
//! q = ln ((∫ |e_r|² + p) / (∫ |e_s|² + p))     ratio of an impact's powers
//! absent in the recording                      Σ |e_r|² < A² Σ |e_s|² + noise
//! ```
//!
//! e_r and e_s are what a cubic does not foretell ([`super::unforeseen`]) of the recording and of the stream. Whether an
//! impact is absent is asked at the same instants: the samples of the slower one, where the faster one is interpolated, by
//! the clock under which both agree best. Impacts in a row that one side has and the other does not show
//! ([`super::absence`]), or whose ratios are all on one side of the usual, are a contact that one side does not have. The
//! usual is the median: what the sensor makes of an impact is the same all the time.

use std::ops::Range;

use nalgebra::Vector3;

use super::{
    absence::absent_stretches,
    unforeseen::{Unforeseen, unforeseen},
};
use crate::{
    recording::{median, order_statistics::std_of_median},
    simulator::cubic::{Cubic, sample_before},
};

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
/// A: an impact is absent where less of it is there than this share; it can be seen where it is so many times the noise.
const SHOWN: f64 = 0.25;
const SEEN: f64 = 12.0;
/// Noise is that of the samples within this time of an impact, s.
const NEAR: f64 = 1.0;
/// The rough clock is known to within this, s. Steps of the search for the exact one, s, and how many to each side, for the
/// clock in the middle and for how far it goes until the end.
const CLOCK: [(usize, f64, i32); 6] =
    [(0, 5e-4, 40), (1, 5e-4, 10), (0, 1e-4, 8), (1, 1e-4, 8), (0, 2e-5, 8), (1, 2e-5, 8)];

/// Most impacts that the search asks.
const MOST: usize = 2000;

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
        let absent = match whole[0].interval >= whole[1].interval {
            true => Pairs::new(&whole[0], stream, 1.0).absent(&spans, &own),
            false => Pairs::new(&whole[1], recording, -1.0).absent(&spans, &own),
        };
        let strike = |(span, absent): (&Range<f64>, [Option<bool>; 2])| {
            let [own, given] = [&own, &given].map(|side| side.within(span));
            Strike {
                time: 0.5 * (span.start + span.end),
                ratio: ((own.power + floor) / (given.power + floor)).ln(),
                absent,
                excess: own.largest - given.largest,
            }
        };
        Self { strikes: spans.iter().zip(absent).map(strike).collect() }
    }

    /// Stretches of impacts that one side does not show, or whose ratios are all on one side of the usual, the clearest first.
    pub fn unmatched(&self) -> Vec<Unmatched> {
        if self.strikes.len() < FEWEST {
            return Vec::new();
        }
        let mut found = self.unusual_ratios();
        for side in 0..2 {
            let absent: Vec<Option<bool>> = self.strikes.iter().map(|strike| strike.absent[side]).collect();
            // A sum of logarithms of odds is half the square of standard deviations.
            let as_deviations = |(strikes, sum): (Range<usize>, f64)| (strikes, (2.0 * sum).sqrt());
            found.extend(absent_stretches(&absent).into_iter().map(as_deviations));
        }
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

    /// Impacts in a row whose ratios are on one side of the usual, and by how many standard deviations.
    fn unusual_ratios(&self) -> Vec<(Range<usize>, f64)> {
        let usual = median(self.strikes.iter().map(|strike| strike.ratio).collect()).unwrap_or(0.0);
        let sizes = self.strikes.iter().map(|strike| (strike.ratio - usual).abs()).collect();
        let scatter = std_of_median(sizes).unwrap_or(0.0).max(LEAST_SCATTER);
        let of = |strike: &Strike| ((strike.ratio - usual) / scatter).clamp(-LARGEST, LARGEST);
        let off: Vec<f64> = self.strikes.iter().map(of).collect();
        let mut found = Vec::new();
        for count in IN_ROW.into_iter().filter(|count| *count <= off.len()) {
            let is_row = |from: &usize| {
                self.strikes[*from..from + count].windows(2).all(|pair| pair[1].time - pair[0].time < PAUSE)
            };
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

/// The slower side's e, and the faster side at its instants.
struct Pairs<'a> {
    slower: &'a Unforeseen,
    faster: Side<'a>,
    cubic: Cubic,
    /// 1 where the stream is the faster one, −1 where the recording is.
    stream: f64,
}

/// Σ e_r · e_s, Σ |e_r|² and Σ |e_s|² of an impact, and over how many samples.
#[derive(Clone, Copy, Default)]
struct Products {
    both: f64,
    own: f64,
    given: f64,
    samples: f64,
}

impl Products {
    /// Whether this much of one side shows nothing of what the other side has.
    fn is_absent(&self, [shown, there]: [f64; 2], noise: f64) -> Option<bool> {
        let noise = noise * self.samples;
        (there > SEEN * noise).then_some(shown < SHOWN * SHOWN * there + noise)
    }
}

impl<'a> Pairs<'a> {
    fn new(slower: &'a Unforeseen, faster: Side<'a>, stream: f64) -> Self {
        Self { slower, faster, cubic: Cubic::new(faster.time, faster.values), stream }
    }

    /// Whether each impact is absent in the recording and in the stream, from e of the recording at the slower one's pace.
    fn absent(&self, spans: &[Range<f64>], own: &Unforeseen) -> Vec<[Option<bool>; 2]> {
        let (Some(first), Some(last)) = (spans.first(), spans.last()) else { return Vec::new() };
        let middle = 0.5 * (first.start + last.end);
        let half = (0.5 * (last.end - first.start)).max(f64::MIN_POSITIVE);
        let shift =
            |[shift, drift]: [f64; 2], span: &Range<f64>| shift + drift * (span.start - middle) / half;
        let noise = own.noise();
        let agreement = |clock: [f64; 2]| -> f64 {
            let of = |span: &Range<f64>| {
                let products = self.products(span, shift(clock, span));
                products.both / (products.own * products.given).sqrt().max(noise)
            };
            spans.iter().step_by(spans.len().div_ceil(MOST)).map(of).sum()
        };
        let mut clock = [0.0; 2];
        for (which, step, count) in CLOCK {
            let tried = (-count..=count).map(|steps| {
                let mut tried = clock;
                tried[which] += step * f64::from(steps);
                (agreement(tried), tried)
            });
            clock = tried.max_by(|a, b| a.0.total_cmp(&b.0)).map_or(clock, |(_, tried)| tried);
        }
        let of = |span: &Range<f64>| {
            let products = self.products(span, shift(clock, span));
            let sizes = [products.own, products.given];
            let noise = own.noise_near(&(span.start - NEAR..span.end + NEAR));
            let [own, given] = [sizes, [sizes[1], sizes[0]]].map(|sizes| products.is_absent(sizes, noise));
            // What one side shows is not absent there, though it were on the other: between two samples, in turn.
            [own.or(given.map(|_| false)), given.or(own.map(|_| false))]
        };
        spans.iter().map(of).collect()
    }

    /// Where the stream comes later by `shift`, s.
    fn products(&self, span: &Range<f64>, shift: f64) -> Products {
        let (time, apart) = (self.faster.time, self.slower.interval);
        let value = |at: f64| self.cubic.at(time, sample_before(time, at), at).0;
        let mut sum = Products::default();
        for (at, slower) in self.slower.samples(span) {
            let at = at - self.stream * shift;
            let faster = unforeseen([-2.0, -1.0, 0.0, 1.0, 2.0].map(|step| value(at + step * apart)));
            let (own, given) = if self.stream > 0.0 { (*slower, faster) } else { (faster, *slower) };
            sum.both += own.dot(&given);
            sum.own += own.norm_squared();
            sum.given += given.norm_squared();
            sum.samples += 1.0;
        }
        sum
    }
}
