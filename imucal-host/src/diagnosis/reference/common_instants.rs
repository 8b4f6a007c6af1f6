//! Impacts of a recording and of a stream at the same instants.
//!
//! The instants are the samples of the slower side, where the faster one is interpolated, by the clock under which both agree
//! best over all impacts:
//!
//! ```text
//! absent in the recording   Σ |e_r|² < A² Σ |e_s|² + noise
//! gain                      g = Σ e_slow · e_fast / Σ |e_fast|²
//! ```
//!
//! with e as in [`super::unforeseen`], at the slower side's pace.

use std::ops::Range;

use rayon::prelude::*;

use super::{
    gain::Gain,
    strikes::Side,
    unforeseen::{Unforeseen, unforeseen},
};
use crate::simulator::cubic::{Cubic, sample_before};

/// A: an impact is absent where less of it is there than this share; it can be seen where it is so many times the noise, and
/// its gain from so many times on.
const SHOWN: f64 = 0.25;
const SEEN: f64 = 12.0;
const GAIN_SEEN: f64 = 6.0;
/// The rough clock is known to within this, s. Steps of the search for the exact one, s, and how many to each side, for the
/// clock in the middle and for how far it goes until the end.
const CLOCK: [(usize, f64, i32); 6] =
    [(0, 5e-4, 40), (1, 5e-4, 10), (0, 1e-4, 8), (1, 1e-4, 8), (0, 2e-5, 8), (1, 2e-5, 8)];
/// Most impacts that the search asks.
const MOST: usize = 2000;

/// What both sides show of an impact.
pub struct Shown {
    /// Whether the recording does not show it, and whether the stream does not; `None` where that cannot be seen.
    pub absent: [Option<bool>; 2],
    /// Its gain; `None` where the faster side does not show it.
    pub gain: Option<Gain>,
}

/// The slower side's e, and the faster side at its instants.
pub struct CommonInstants<'a> {
    slower: &'a Unforeseen,
    faster: &'a Unforeseen,
    side: Side<'a>,
    cubic: Cubic,
    /// 1 where the stream is the faster one, −1 where the recording is.
    stream: f64,
    /// By how much the stream comes later in the middle, and more at the end, s.
    clock: [f64; 2],
    middle: f64,
    half: f64,
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

impl<'a> CommonInstants<'a> {
    /// Of a recording and of a stream with their e, over the impacts in these spans, s; `noise` is the power of a sample's.
    pub fn new(
        [recording, stream]: [Side<'a>; 2],
        [own, given]: &'a [Unforeseen; 2],
        impacts: &[Range<f64>],
        noise: f64,
    ) -> Self {
        let (slower, faster, side, sign) = match own.interval >= given.interval {
            true => (own, given, stream, 1.0),
            false => (given, own, recording, -1.0),
        };
        let begins = impacts.first().map_or(0.0, |span| span.start);
        let ends = impacts.last().map_or(begins, |span| span.end);
        let mut instants = Self {
            slower,
            faster,
            side,
            cubic: Cubic::new(side.time, side.values),
            stream: sign,
            clock: [0.0; 2],
            middle: 0.5 * (begins + ends),
            half: (0.5 * (ends - begins)).max(f64::MIN_POSITIVE),
        };
        instants.clock = instants.best_clock(impacts, noise);
        instants
    }

    fn best_clock(&self, impacts: &[Range<f64>], noise: f64) -> [f64; 2] {
        let agreement = |clock: [f64; 2]| -> f64 {
            let of = |span: &Range<f64>| {
                let products = self.products(span, self.shift(clock, span));
                products.both / (products.own * products.given).sqrt().max(noise)
            };
            impacts.iter().step_by(impacts.len().div_ceil(MOST).max(1)).map(of).sum()
        };
        let mut clock = [0.0; 2];
        for (which, step, count) in CLOCK {
            let tried = (-count..=count).into_par_iter().map(|steps| {
                let mut tried = clock;
                tried[which] += step * f64::from(steps);
                (agreement(tried), tried)
            });
            let tried: Vec<(f64, [f64; 2])> = tried.collect();
            let best = tried.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
            clock = best.map_or(clock, |(_, tried)| tried);
        }
        clock
    }

    /// By how much the stream comes later, s.
    fn shift(&self, [shift, drift]: [f64; 2], span: &Range<f64>) -> f64 {
        shift + drift * (span.start - self.middle) / self.half
    }

    /// What is seen of an impact, where a sample's noise has this power.
    pub fn shown(&self, span: &Range<f64>, noise: f64) -> Shown {
        let shift = self.shift(self.clock, span);
        let products = self.products(span, shift);
        let sizes = [products.own, products.given];
        let [own, given] = [sizes, [sizes[1], sizes[0]]].map(|sizes| products.is_absent(sizes, noise));
        // What one side shows is not absent there, though it were on the other: between two samples, in turn.
        let absent = [own.or(given.map(|_| false)), given.or(own.map(|_| false))];
        Shown { absent, gain: self.gain(&products, span, shift, noise) }
    }

    fn gain(&self, products: &Products, span: &Range<f64>, shift: f64, noise: f64) -> Option<Gain> {
        let there = if self.stream > 0.0 { products.given } else { products.own };
        let by = self.stream * shift;
        let rough = self.faster.within(&(span.start - by..span.end - by)).power;
        (there > GAIN_SEEN * noise * products.samples).then(|| Gain {
            value: products.both / there,
            variance: noise / 3.0 / there,
            roughness: rough / (there * self.slower.interval),
        })
    }

    /// Where the stream comes later by `shift`, s.
    fn products(&self, span: &Range<f64>, shift: f64) -> Products {
        let (time, apart) = (self.side.time, self.slower.interval);
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
