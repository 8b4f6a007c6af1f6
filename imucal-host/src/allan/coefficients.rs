//! Coefficients of one axis, each known with its interval or not seen, with the reason.

use super::{
    cascade::AllanPoint,
    correlation::{Correlation, Scan},
    covariance::Products,
    fit::{self, Fit},
    process::Kind,
    upper_bound::upper_bound,
};

/// Averages up to this share of the recording: of longer ones there are too few.
const LONGEST: f64 = 0.25;
/// A coefficient with fewer degrees of freedom, 2.4 standard errors from nothing, is not seen.
const SEEN: f64 = 12.0;
/// Quantisation is in few recordings, and wrongly assumed it costs certainty: three standard errors.
const QUANTISED: f64 = 18.0;
/// A filter colours averages shorter than this, s; they are left out where they do not fit.
const FILTERED: f64 = 1.0;
/// And of the longest average at most this share.
const FILTERED_SHARE: f64 = 1.0 / 32.0;
/// A recording shows a correlation time if it is so many times as long as the upper end of its interval.
const TIMES: f64 = 50.0;
/// A difference of deviances that is no chance.
const BETTER: f64 = 10.0;

const KINDS: [Kind; 4] = [Kind::Quantisation, Kind::White, Kind::Flicker, Kind::Walk];

/// A coefficient, or why there is none.
#[derive(Clone, Debug, PartialEq)]
pub enum Coefficient {
    /// The recording determines it.
    Known(Known),
    /// It does not.
    NotSeen {
        /// Why.
        why: NotSeen,
        /// What it is at most, with a probability of 97.5 %; `None` where nothing says so.
        most: Option<f64>,
    },
}

/// A coefficient with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Known {
    /// Its value.
    pub value: f64,
    /// Ends of the interval.
    pub interval: (f64, f64),
    /// Equivalent degrees of freedom; infinite where the interval is not one of χ².
    pub freedom: f64,
}

/// Why a coefficient is not known.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NotSeen {
    /// Other noise covers it.
    #[error(
        "other noise covers it: found {ratio:.1} standard errors from zero, expected {least:.1}; it may be seen in a \
         longer recording than {duration:.0} s"
    )]
    Covered {
        /// Standard errors from zero.
        ratio: f64,
        /// What is expected at least.
        least: f64,
        /// Length of the recording, s.
        duration: f64,
    },
    /// The bias is a Gauss–Markov process.
    #[error(
        "the bias has a correlation time of {time:.3} s: it neither walks nor falls as 1/f (deviance less by {by:.0})"
    )]
    Forgets {
        /// Correlation time, s.
        time: f64,
        /// By how much that fits better.
        by: f64,
    },
    /// The correlation time is too long for the recording.
    #[error(
        "the correlation time is longer than {least:.0} s; a recording of more than {advised:.0} s would show it"
    )]
    Remembers {
        /// The shortest correlation time that fits, s.
        least: f64,
        /// A length that would show it, s.
        advised: f64,
    },
    /// No drift.
    #[error("no drift of the bias is seen in {duration:.0} s")]
    NoDrift {
        /// Length of the recording, s.
        duration: f64,
    },
    /// Drift of more than one time.
    #[error(
        "the bias drifts at many rates, as 1/f: no single correlation time fits (deviance more by {by:.0})"
    )]
    ManyTimes {
        /// By how much it fits worse.
        by: f64,
    },
    /// The axis has no fit.
    #[error("no sum of the kinds of noise fits the variances")]
    NoFit,
}

/// What one axis has.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Mean, unit.
    pub mean: f64,
    /// Q, unit·s.
    pub quantisation: Coefficient,
    /// N, unit/√Hz.
    pub white: Coefficient,
    /// B, unit.
    pub bias_instability: Coefficient,
    /// K, unit·√Hz.
    pub random_walk: Coefficient,
    /// T, s.
    pub correlation_time: Coefficient,
    /// Standard deviation of a Gauss–Markov bias, unit.
    pub bias_std: Coefficient,
    /// The least Allan deviation, unit, and its averaging time, s.
    pub least: (f64, f64),
    /// How well the kinds of noise explain the variances.
    pub misfit: Misfit,
    /// Deviations, the shortest averages first.
    pub deviations: Vec<Deviation>,
}

/// How well the kinds of noise explain the variances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Misfit {
    /// χ².
    pub chi_square: f64,
    /// Its degrees of freedom.
    pub freedom: usize,
    /// Probability of as much by chance.
    pub chance: f64,
    /// Averaging time from which on they were fitted, s.
    pub from: f64,
    /// Factor by which standard errors were raised for it, ≥ 1.
    pub inflation: f64,
}

/// An overlapping Allan deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Averaging time, s.
    pub time: f64,
    /// Samples of an average.
    pub samples: u64,
    /// Terms of the sum.
    pub terms: u64,
    /// σ, unit.
    pub value: f64,
    /// Ends of its 95 % interval, unit.
    pub interval: (f64, f64),
    /// Equivalent degrees of freedom.
    pub freedom: f64,
}

/// Sums over the lengths of averages; the same for all sensors and recordings that have the same lengths.
#[derive(Debug)]
pub struct Sums {
    products: Products,
    scan: Scan,
}

impl Sums {
    /// For the lengths of these variances of so many samples.
    pub fn new(points: &[AllanPoint], samples: u64) -> Self {
        let lengths: Vec<(f64, f64)> =
            within(points, samples).iter().map(|point| (point.samples as f64, point.span)).collect();
        Self { scan: Scan::new(&lengths), products: Products::new(KINDS.to_vec(), lengths) }
    }
}

/// Variances of averages up to [`LONGEST`] of the samples.
fn within(points: &[AllanPoint], samples: u64) -> Vec<AllanPoint> {
    let longest = LONGEST * samples as f64;
    points.iter().filter(|point| point.samples as f64 <= longest).copied().collect()
}

/// The variances of a triad, to be explained axis by axis.
#[derive(Debug)]
pub struct Estimator<'a> {
    points: Vec<AllanPoint>,
    sums: &'a Sums,
    /// From sample to sample, s.
    interval: f64,
    duration: f64,
}

impl<'a> Estimator<'a> {
    /// Of a triad with so many samples, `interval` s apart; `sums` are those of its variances.
    pub fn new(points: &[AllanPoint], sums: &'a Sums, samples: u64, interval: f64) -> Self {
        Self { points: within(points, samples), sums, interval, duration: samples as f64 * interval }
    }

    /// The axis' coefficients; averages shorter than `shortest` samples are left out of the fit.
    pub fn axis(&self, axis: usize, mean: f64, shortest: f64) -> Axis {
        let variances: Vec<f64> = self.points.iter().map(|point| point.variance[axis]).collect();
        let fitted = self.best(&variances, shortest);
        let forgetting = fitted.as_ref().and_then(|(first, fit)| {
            let quantised = fit.of(Kind::Quantisation).is_some();
            self.sums.scan.correlation(&variances, *first, quantised)
        });
        let mut found = self.coefficients(mean, &variances, fitted.as_ref());
        if let (Some((_, fit)), Some(forgetting)) = (&fitted, &forgetting) {
            self.judge(&mut found, fit, forgetting);
        }
        found
    }

    /// The fit from the first length on from which it explains the variances, and that length.
    fn best(&self, variances: &[f64], shortest: f64) -> Option<(usize, Fit)> {
        let lengths = self.sums.products.lengths();
        let last = lengths.last()?.0;
        let most = (FILTERED / self.interval).min(FILTERED_SHARE * last).max(shortest);
        let begin = lengths.iter().position(|(m, _)| *m >= shortest)?;
        let firsts = (begin..lengths.len()).take_while(|first| *first == begin || lengths[*first].0 <= most);
        let mut best: Option<(usize, Fit)> = None;
        for first in firsts {
            let Some(fit) = self.parsimonious(variances, first) else { continue };
            if fit.chance() >= fit::MISFIT {
                return Some((first, fit));
            }
            if best.as_ref().is_none_or(|(_, known)| fit.chance() > known.chance()) {
                best = Some((first, fit));
            }
        }
        best
    }

    /// With quantisation only where it is visible.
    fn parsimonious(&self, variances: &[f64], first: usize) -> Option<Fit> {
        let whole = fit::fit(&self.sums.products, variances, first, &KINDS)?;
        match whole.of(Kind::Quantisation) {
            Some((size, error)) if fit::freedom(size, error) < QUANTISED => {
                fit::fit(&self.sums.products, variances, first, &KINDS[1..])
            }
            _ => Some(whole),
        }
    }

    fn coefficients(&self, mean: f64, variances: &[f64], fitted: Option<&(usize, Fit)>) -> Axis {
        let inflation = fitted.map_or(1.0, |(_, fit)| fit::inflation(fit.misfit, fit.freedom));
        let of = |kind: Kind, unit: f64| match fitted {
            Some((first, fit)) => {
                let error_at =
                    |size| Some(inflation * fit::error_at(&self.sums.products, fit, *first, kind, size)?);
                let found = fit.of(kind).map(|(size, error)| (size, inflation * error));
                self.coefficient(found.or_else(|| Some((0.0, error_at(0.0)?))), unit, &error_at)
            }
            None => Coefficient::NotSeen { why: NotSeen::NoFit, most: None },
        };
        let step = self.interval;
        let deviations = self.deviations(variances, fitted.map(|(_, fit)| fit));
        let least = deviations.iter().min_by(|a, b| a.value.total_cmp(&b.value));
        let no_drift = NotSeen::NoDrift { duration: self.duration };
        Axis {
            mean,
            quantisation: of(Kind::Quantisation, step * step),
            white: of(Kind::White, step),
            bias_instability: of(Kind::Flicker, 1.0),
            random_walk: of(Kind::Walk, 1.0 / step),
            correlation_time: Coefficient::NotSeen { why: no_drift, most: None },
            bias_std: Coefficient::NotSeen { why: no_drift, most: None },
            least: least.map_or((f64::NAN, f64::NAN), |point| (point.value, point.time)),
            misfit: Misfit {
                chi_square: fitted.map_or(f64::NAN, |(_, fit)| fit.misfit),
                freedom: fitted.map_or(0, |(_, fit)| fit.freedom),
                chance: fitted.map_or(0.0, |(_, fit)| fit.chance()),
                from: fitted.map_or(f64::NAN, |(first, _)| self.sums.products.lengths()[*first].0 * step),
                inflation,
            },
            deviations,
        }
    }

    /// `size` and its standard error in samples; `unit` takes the squared coefficient to seconds, and `error_at` gives the standard error
    /// of another size.
    fn coefficient(
        &self,
        size: Option<(f64, f64)>,
        unit: f64,
        error_at: &dyn Fn(f64) -> Option<f64>,
    ) -> Coefficient {
        let (size, error) = size.unwrap_or((0.0, f64::NAN));
        let freedom = fit::freedom(size, error);
        if freedom >= SEEN {
            let (low, high) = fit::interval(size, freedom);
            let root = |x: f64| (x * unit).sqrt();
            return Coefficient::Known(Known {
                value: root(size),
                interval: (root(low), root(high)),
                freedom,
            });
        }
        let ratio = if error.is_finite() { size / error } else { 0.0 };
        let why = NotSeen::Covered { ratio, least: (0.5 * SEEN).sqrt(), duration: self.duration };
        let most = upper_bound(size, error_at).map(|most| (most * unit).sqrt());
        Coefficient::NotSeen { why, most: most.filter(|most| most.is_finite()) }
    }

    /// The same where the standard error does not depend on the size.
    fn certain(&self, (size, error): (f64, f64), unit: f64) -> Coefficient {
        self.coefficient(Some((size, error)), unit, &|_| Some(error))
    }

    fn deviations(&self, variances: &[f64], fit: Option<&Fit>) -> Vec<Deviation> {
        let kinds = self.sums.products.kinds();
        let white = |kind: &Kind| f64::from(u8::from(*kind == Kind::White));
        let assumed = || nalgebra::DVector::from_iterator(kinds.len(), kinds.iter().map(white));
        let sizes = fit.map_or_else(assumed, |fit| fit.sizes_of(kinds));
        let freedoms = self.sums.products.freedoms(&sizes);
        let deviation = |((point, variance), freedom): ((&AllanPoint, &f64), f64)| {
            let (low, high) = fit::interval(*variance, freedom);
            Deviation {
                time: point.samples as f64 * self.interval,
                samples: point.samples,
                terms: point.terms,
                value: variance.sqrt(),
                interval: (low.sqrt(), high.sqrt()),
                freedom,
            }
        };
        self.points.iter().zip(variances).zip(freedoms).map(deviation).collect()
    }

    /// Whether the bias forgets, and what that says of the other coefficients.
    fn judge(&self, axis: &mut Axis, fit: &Fit, forgetting: &Correlation) {
        let by = fit.deviance - forgetting.deviance;
        let time = |samples: f64| samples * self.interval;
        let unknown = |why| Coefficient::NotSeen { why, most: None };
        // What forgets faster is a filter, or noise of a band, and no bias.
        if forgetting.visible < SEEN || time(forgetting.interval.0) < FILTERED {
            return;
        }
        let (low, high) = forgetting.interval;
        axis.correlation_time = match high {
            Some(high) if TIMES * time(high) <= self.duration && by < 0.0 => {
                unknown(NotSeen::ManyTimes { by: -by })
            }
            Some(high) if TIMES * time(high) <= self.duration => Coefficient::Known(Known {
                value: time(forgetting.time),
                interval: (time(low), time(high)),
                freedom: f64::INFINITY,
            }),
            _ => {
                unknown(NotSeen::Remembers { least: time(low), advised: 2.0 * TIMES * time(forgetting.time) })
            }
        };
        if !matches!(axis.correlation_time, Coefficient::Known(_)) {
            axis.bias_std = axis.correlation_time.clone();
            return;
        }
        axis.bias_std = self.certain(forgetting.size, 1.0);
        if by > BETTER {
            let why = NotSeen::Forgets { time: time(forgetting.time), by };
            axis.white = self.certain(forgetting.white, self.interval);
            axis.bias_instability = unknown(why);
            axis.random_walk = unknown(why);
            axis.misfit.chi_square = forgetting.misfit;
            axis.misfit.freedom = forgetting.freedom;
            axis.misfit.chance = forgetting.chance;
            axis.misfit.inflation = fit::inflation(forgetting.misfit, forgetting.freedom);
        }
    }
}

impl Coefficient {
    /// Its value; `None` where it is not seen.
    pub fn value(&self) -> Option<f64> {
        match self {
            Self::Known(known) => Some(known.value),
            Self::NotSeen { .. } => None,
        }
    }

    /// Its value, or where it is not seen the most that it may be.
    pub fn at_most(&self) -> Option<f64> {
        match self {
            Self::Known(known) => Some(known.value),
            Self::NotSeen { most, .. } => *most,
        }
    }
}
