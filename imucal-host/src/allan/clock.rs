//! The instants of a sensor's samples: how regular they are, and where some are missing.
//!
//! An Allan variance takes samples as equally spaced. Jitter of their times is not noise of a sensor that is still, so
//! that it is counted and not corrected. Missing samples are: a few in a row are bridged by the straight line between
//! their neighbours, a longer gap ends a stretch, and no average goes across.
//!
//! Times that are rounded to about an interval step by one or two of what they are rounded to, as evenly as they can; the interval is then
//! their mean. Not recognised: single samples that are missing there.

/// Samples over which an interval is averaged: times may come in bursts of as many.
const BURST: usize = 16;
/// A single interval that departs from the mean by more than this share is one of a burst.
const UNEVEN: f64 = 0.3;
/// Rounded times have so many steps that are longer than the others, at least: as many samples are not lost as evenly by chance.
const LONGER: f64 = 8.0;
/// A step is of a missing sample from so many intervals on, and where times are rounded to about an interval.
const LATE: (f64, f64) = (1.5, 2.5);
/// A gap of more samples is not bridged.
const BRIDGED: u64 = 10;

/// What comes before a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Before {
    /// Nothing is missing.
    Nothing,
    /// So many samples, which are bridged.
    Bridge(u64),
    /// More of them: a new stretch begins.
    Gap,
}

/// Follows the times of one sensor's samples, s.
#[derive(Clone, Debug)]
pub struct SampleClock {
    /// From sample to sample, as the first of them have it.
    nominal: f64,
    /// A longer step is of a missing sample, s.
    late: f64,
    last: Option<f64>,
    /// The last intervals, without what is missing.
    ring: [f64; BURST],
    filled: usize,
    /// Time and intervals within stretches.
    elapsed: f64,
    intervals: u64,
    /// Squared deviations from the nominal interval.
    squares: f64,
    found: Gaps,
}

/// What was missing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gaps {
    /// Samples that were bridged.
    pub bridged: u64,
    /// Gaps that end a stretch.
    pub gaps: u64,
    /// Time of the first missing sample, s.
    pub first: Option<f64>,
    /// The longest gap, s.
    pub longest: f64,
}

impl SampleClock {
    /// For samples that begin at these times; `None` below two.
    pub fn new(first: &[f64]) -> Option<Self> {
        let span = BURST.min(first.len().checked_sub(1)?);
        let over = |count: usize| {
            let mean = |window: &[f64]| (window[count] - window[0]) / count as f64;
            crate::recording::median(first.windows(count + 1).map(mean).collect())
        };
        // Where times come in bursts, single intervals are far from their mean.
        let (single, mean) = (over(1)?, over(span)?);
        let rounded = even_mean(first, single);
        let usual = if (mean / single - 1.0).abs() < UNEVEN { single } else { mean };
        let nominal = rounded.unwrap_or(usual);
        Some(Self {
            nominal,
            late: if rounded.is_some() { LATE.1 } else { LATE.0 } * nominal,
            last: None,
            ring: [nominal; BURST],
            filled: 0,
            elapsed: 0.0,
            intervals: 0,
            squares: 0.0,
            found: Gaps::default(),
        })
    }

    /// What is missing before the sample of this time.
    pub fn before(&mut self, time: f64) -> Before {
        let Some(last) = self.last.replace(time) else { return Before::Nothing };
        let step = time - last;
        let others: f64 = self.ring.iter().sum::<f64>() - self.ring[self.filled % BURST];
        // A late sample after a burst of early ones lacks nothing.
        let missing = match step > self.late {
            true => ((others + step) / self.nominal).round() - BURST as f64,
            false => 0.0,
        };
        let missing = if missing >= 1.0 { missing as u64 } else { 0 };
        let own = step - missing as f64 * self.nominal;
        self.ring[self.filled % BURST] = own;
        self.filled += 1;
        if missing > 0 {
            self.found.first.get_or_insert(last);
            self.found.longest = self.found.longest.max(step);
        }
        if missing > BRIDGED {
            self.found.gaps += 1;
            return Before::Gap;
        }
        self.elapsed += step;
        self.intervals += missing + 1;
        self.squares += (own - self.nominal).powi(2);
        self.found.bridged += missing;
        if missing > 0 { Before::Bridge(missing) } else { Before::Nothing }
    }

    /// From sample to sample, the first of them, s.
    pub fn nominal(&self) -> f64 {
        self.nominal
    }

    /// Mean interval within stretches, s.
    pub fn interval(&self) -> f64 {
        if self.intervals > 0 { self.elapsed / self.intervals as f64 } else { self.nominal }
    }

    /// Rms of the intervals about the nominal one, of that.
    pub fn jitter(&self) -> f64 {
        let mean = self.interval() - self.nominal;
        let variance = self.squares / self.intervals.max(1) as f64 - mean * mean;
        variance.max(0.0).sqrt() / self.nominal
    }

    /// What was missing.
    pub fn gaps(&self) -> Gaps {
        self.found
    }
}

/// The mean interval of times that are rounded to about an interval, the usual one of which is `single`: a decimal, as milliseconds are.
/// `None` of others: samples that are lost as regularly leave the same times.
fn even_mean(times: &[f64], single: f64) -> Option<f64> {
    let (first, last, count) = (times.first()?, times.last()?, times.len() - 1);
    let mean = (last - first) / count as f64;
    let longer = (last - first) / single - count as f64;
    let is_decimal = (single.log10() - single.log10().round()).abs() < 1e-6;
    let off = |(k, time): (usize, &f64)| (time - first - k as f64 * mean).abs();
    let farthest = times.iter().enumerate().map(off).fold(0.0, f64::max);
    (is_decimal && longer >= LONGER && farthest < 1.01 * single).then_some(mean)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(times: &[f64]) -> (SampleClock, Vec<Before>) {
        let mut clock = SampleClock::new(&times[..times.len().min(1024)]).unwrap();
        let before = times.iter().map(|time| clock.before(*time)).collect();
        (clock, before)
    }

    #[test]
    fn missing_samples_are_bridged_or_begin_a_stretch() {
        let times: Vec<f64> = (0..400)
            .filter(|k| ![50, 51, 120].contains(k) && !(200..260).contains(k))
            .map(|k| f64::from(k) * 0.01)
            .collect();
        let (clock, before) = run(&times);
        let odd: Vec<Before> = before.into_iter().filter(|before| *before != Before::Nothing).collect();
        assert_eq!(odd, [Before::Bridge(2), Before::Bridge(1), Before::Gap]);
        let gaps = clock.gaps();
        assert_eq!((gaps.bridged, gaps.gaps, gaps.first), (3, 1, Some(0.49)));
        assert!((clock.interval() - 0.01).abs() < 1e-12 && clock.jitter() < 1e-6);
    }

    #[test]
    fn bursts_and_jitter_lack_nothing() {
        let burst: Vec<f64> = (0..400).map(|k| f64::from(k / 8) * 0.08 + f64::from(k % 8) * 1e-4).collect();
        let (clock, before) = run(&burst);
        assert!(before.iter().all(|before| *before == Before::Nothing), "{before:?}");
        assert!((clock.interval() / 0.01 - 1.0).abs() < 0.02 && clock.jitter() > 1.0);
    }

    #[test]
    fn the_interval_is_the_mean_where_times_are_rounded() {
        // 4.98 ms, rounded to milliseconds.
        let times: Vec<f64> = (0..5000).map(|k| (f64::from(k) * 4.98).round() / 1000.0).collect();
        let (clock, before) = run(&times);
        assert!(before.iter().all(|before| *before == Before::Nothing));
        assert!((clock.interval() - 0.00498).abs() < 1e-6, "{}", clock.interval());
    }

    #[test]
    fn times_that_are_rounded_to_about_an_interval_lack_nothing_and_random_losses_are_some() {
        for rate in [952.0, 833.0] {
            let times: Vec<f64> =
                (0..20_000).map(|k| (1000.0 * f64::from(k) / rate).round() / 1000.0).collect();
            let (clock, before) = run(&times);
            assert!(before.iter().all(|before| *before == Before::Nothing), "{rate}");
            assert!((clock.interval() * rate - 1.0).abs() < 1e-3, "{rate}: {}", clock.interval());
        }
        let mut random = crate::simulator::random::Random::new(3, crate::simulator::random::Purpose::Noise);
        let kept = (0..20_000).filter(|_| random.normal() < 1.5);
        let times: Vec<f64> = kept.map(|k| f64::from(k) / 1000.0).collect();
        let lost = 20_000 - times.len() as u64;
        let bridged = run(&times).0.gaps().bridged;
        assert!(bridged.abs_diff(lost) < lost / 50, "{bridged} {lost}");
    }
}
