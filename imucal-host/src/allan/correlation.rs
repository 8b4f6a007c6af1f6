//! The correlation time of a Gauss–Markov bias, by a scan of times.
//!
//! For each time the sizes are fitted as in [`fit`]; the interval is where χ² rises by 3.84, χ² of one degree of freedom.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::{
    covariance::{Length, Products},
    fit,
    process::Kind,
};

/// From one time of the scan to the next.
const RATIO: f64 = 1.5;
/// The same where only the expected variances change.
const FINE: f64 = 1.05;
/// To either side, where a slope is taken.
const STEP: f64 = 1.01;
/// Rounds in which the weights follow the best time.
const ROUNDS: usize = 5;
/// The first, of the shortest average, and the last, of the longest.
const FIRST: f64 = 2.0;
const LAST: f64 = 4.0;
/// By how much the deviance grows to the ends of a 95 % interval (χ² of one degree of freedom).
const ENDS: f64 = 3.841;

/// The best correlation time, in samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Correlation {
    /// T.
    pub time: f64,
    /// Ends of its 95 % interval, which a misfit that is no chance widens; no upper one where the recording is too short for it.
    pub interval: (f64, Option<f64>),
    /// σ² of the bias, and its standard error.
    pub size: (f64, f64),
    /// Degrees of freedom of σ² if the time were known: whether there is such a drift at all.
    pub visible: f64,
    /// The squared coefficient of white noise, and its standard error.
    pub white: (f64, f64),
    /// ln|V| + χ².
    pub deviance: f64,
    /// χ², its degrees of freedom, and its probability.
    pub misfit: f64,
    /// Degrees of freedom.
    pub freedom: usize,
    /// Probability.
    pub chance: f64,
}

/// Sums for all times of the scan.
#[derive(Debug)]
pub struct Scan(Vec<(f64, Products)>);

impl Scan {
    /// Of averages of these lengths.
    pub fn new(lengths: &[Length]) -> Self {
        let (first, last) = match lengths {
            [first, .., last] => (FIRST * first.0, LAST * last.0),
            _ => (1.0, 0.0),
        };
        let products = |time| {
            let kinds = vec![Kind::Quantisation, Kind::White, Kind::Markov(time)];
            (time, Products::new(kinds, lengths.to_vec()))
        };
        Self(times(first, last, RATIO).map(products).collect())
    }

    /// The best time of one axis' variances from the `first` length on; `None` where no Gauss–Markov bias is there.
    pub fn correlation(&self, variances: &[f64], first: usize, quantised: bool) -> Option<Correlation> {
        let fitted = |(at, (time, products)): (usize, &(f64, Products))| {
            let kinds = &products.kinds()[usize::from(!quantised)..];
            let fit = fit::fit(products, variances, first, kinds)?;
            fit.of(Kind::Markov(*time)).map(|_| (at, fit))
        };
        let fits = self.0.iter().enumerate().filter_map(fitted);
        let (mut at, fit) = fits.min_by(|a, b| a.1.deviance.total_cmp(&b.1.deviance))?;
        let (size, error) = fit.of(Kind::Markov(self.0[at].0))?;
        let mut sizes = fit.sizes_of(self.0[at].1.kinds());
        let lengths: Vec<f64> = self.0[at].1.lengths()[first..].iter().map(|(m, _)| *m).collect();
        let observed = DVector::from_column_slice(&variances[first..]);
        let mut found = None;
        for _ in 0..ROUNDS {
            let profile = Profile::new(&self.0[at].1, &sizes, &lengths, &observed)?;
            let (time, solved) = profile.best(self.0.first()?.0, self.0.last()?.0, quantised)?;
            let nearest = |(_, a): &(usize, &(f64, _)), (_, b): &(usize, &(f64, _))| {
                let away = |known: f64| (known / time).ln().abs();
                away(a.0).total_cmp(&away(b.0))
            };
            at = self.0.iter().enumerate().min_by(nearest)?.0;
            sizes = solved.insert_rows(0, usize::from(!quantised), 0.0).map(|size| size.max(0.0));
            found = Some((time, profile));
        }
        let (time, profile) = found?;
        let range = (self.0.first()?.0, self.0.last()?.0);
        let found = profile.correlation(time, quantised, range)?;
        Some(Correlation { visible: fit::freedom(size, error), deviance: fit.deviance, ..found })
    }
}

/// χ² against the correlation time, by weights that stay: those of the best time.
///
/// The deviance of [`fit`] chooses between models; along a time it is too narrow, since weights that change with the
/// time count the same variances twice.
struct Profile<'a> {
    factor: Cholesky<f64, Dyn>,
    lengths: &'a [f64],
    observed: &'a DVector<f64>,
}

impl<'a> Profile<'a> {
    fn new(
        products: &Products,
        sizes: &DVector<f64>,
        lengths: &'a [f64],
        observed: &'a DVector<f64>,
    ) -> Option<Self> {
        let (rows, first) = (lengths.len(), products.lengths().len() - lengths.len());
        let covariance = products.covariance(sizes);
        let factor = covariance.view((first, first), (rows, rows)).into_owned().cholesky()?;
        Some(Self { factor, lengths, observed })
    }

    fn design(&self, time: f64, quantised: bool) -> DMatrix<f64> {
        let all = [Kind::Quantisation, Kind::White, Kind::Markov(time)];
        let kinds = &all[usize::from(!quantised)..];
        DMatrix::from_fn(self.lengths.len(), kinds.len(), |row, at| {
            kinds[at].allan_variance(self.lengths[row])
        })
    }

    /// χ² and sizes at a time.
    fn at(&self, time: f64, quantised: bool) -> Option<(f64, DVector<f64>)> {
        let design = self.design(time, quantised);
        let (sizes, _) = fit::generalised(&design, &self.factor, self.observed)?;
        Some((fit::misfit(&design, &self.factor, self.observed, &sizes), sizes))
    }

    fn best(&self, from: f64, to: f64, quantised: bool) -> Option<(f64, DVector<f64>)> {
        let found = times(from, to, FINE).filter_map(|time| Some((time, self.at(time, quantised)?)));
        let (time, (_, sizes)) = found.min_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
        Some((time, sizes))
    }

    fn correlation(&self, time: f64, quantised: bool, (from, to): (f64, f64)) -> Option<Correlation> {
        let points: Vec<(f64, f64)> =
            times(from, to, FINE).filter_map(|time| Some((time.ln(), self.at(time, quantised)?.0))).collect();
        let at = points.iter().position(|(x, _)| *x >= time.ln())?;
        let (best, least) = vertex(&points, at);
        let time = best.exp();
        let (misfit, sizes) = self.at(time, quantised)?;
        let freedom = self.lengths.len().saturating_sub(sizes.len() + 1);
        let inflation = fit::inflation(misfit, freedom);
        let level = least + ENDS * inflation.powi(2);
        let low = crossing(&mut points[..=at].iter().rev(), level).unwrap_or(points[0].0);
        let high = crossing(&mut points[at..].iter(), level);
        let covariance = self.covariance(time, &sizes, quantised)?;
        let known = |at: usize| (sizes[at], inflation * covariance[(at, at)].max(0.0).sqrt());
        let white = usize::from(quantised);
        Some(Correlation {
            time,
            interval: (low.exp(), high.map(f64::exp)),
            size: known(white + 1),
            white: known(white),
            visible: f64::NAN,
            deviance: f64::NAN,
            misfit,
            freedom,
            chance: fit::chance(misfit, freedom),
        })
    }

    /// Of the sizes, the time being estimated with them.
    fn covariance(&self, time: f64, sizes: &DVector<f64>, quantised: bool) -> Option<DMatrix<f64>> {
        let (count, design) = (sizes.len(), self.design(time, quantised));
        let slope = (self.design(time * STEP, quantised) - self.design(time / STEP, quantised))
            .column(count - 1)
            * (sizes[count - 1] / (2.0 * STEP.ln()));
        let mut wider = design.insert_column(count, 0.0);
        wider.set_column(count, &slope);
        Some(fit::generalised(&wider, &self.factor, self.observed)?.1)
    }
}

fn times(from: f64, to: f64, ratio: f64) -> impl Iterator<Item = f64> {
    std::iter::successors(Some(from), move |time| Some(time * ratio)).take_while(move |time| *time <= to)
}

/// The lowest point of the parabola through a point and its neighbours.
fn vertex(profile: &[(f64, f64)], at: usize) -> (f64, f64) {
    let (Some(before), Some(after)) = (at.checked_sub(1).map(|before| profile[before]), profile.get(at + 1))
    else {
        return profile[at];
    };
    let (x, y) = profile[at];
    let (left, right) = ((y - before.1) / (x - before.0), (after.1 - y) / (after.0 - x));
    let bend = (right - left) / (after.0 - before.0);
    let slope = left + bend * (x - before.0);
    if bend > 0.0 { (x - slope / (2.0 * bend), y - slope * slope / (4.0 * bend)) } else { (x, y) }
}

/// Where a profile first rises above a level.
fn crossing(points: &mut dyn Iterator<Item = &(f64, f64)>, level: f64) -> Option<f64> {
    let mut last = *points.next()?;
    for (x, y) in points {
        if *y > level {
            let share = ((level - last.1) / (y - last.1)).clamp(0.0, 1.0);
            return Some(last.0 + share * (x - last.0));
        }
        last = (*x, *y);
    }
    None
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use crate::allan::{
        cascade::Cascade,
        coefficients::{Axis, Coefficient, Estimator, NotSeen, Sums},
        drawn::{Drawn, Source, cascade},
    };

    fn axis(drawn: Drawn, seed: u64, axis: usize) -> Axis {
        let points = cascade(40_000, drawn, seed).points();
        let sums = Sums::new(&points, 40_000);
        Estimator::new(&points, &sums, 40_000, 0.1).axis(axis, 0.0, 1.0)
    }

    #[test]
    fn a_bias_that_forgets_is_found_with_its_time_and_size() {
        let drawn = Drawn { white: 1.0, markov: Some((0.5, 500.0)), ..Drawn::default() };
        for at in 0..3 {
            let found = axis(drawn, 12, at);
            let Coefficient::Known(time) = found.correlation_time else {
                panic!("{:?}", found.correlation_time)
            };
            assert!(time.interval.0 < 50.0 && 50.0 < time.interval.1, "{time:?}");
            assert!(time.interval.1 < 3.0 * time.interval.0, "{time:?}");
            let size = found.bias_std.value().unwrap();
            assert!((size / 0.5 - 1.0).abs() < 0.25, "{size}");
            assert!((found.white.value().unwrap() / 0.1f64.sqrt() - 1.0).abs() < 0.02);
            let not_seen =
                |of: &Coefficient| matches!(of, Coefficient::NotSeen { why: NotSeen::Forgets { .. }, .. });
            assert!(not_seen(&found.random_walk) && not_seen(&found.bias_instability), "{found:?}");
        }
    }

    #[test]
    fn a_walk_has_no_correlation_time_and_1_f_noise_many() {
        let walk = axis(Drawn { white: 1.0, walk: 0.01, ..Drawn::default() }, 3, 0);
        let remembers =
            matches!(walk.correlation_time, Coefficient::NotSeen { why: NotSeen::Remembers { .. }, .. });
        assert!(remembers && walk.random_walk.value().is_some(), "{walk:?}");
        let flicker = axis(Drawn { white: 1.0, flicker: 0.5, ..Drawn::default() }, 3, 0);
        let many =
            matches!(flicker.correlation_time, Coefficient::NotSeen { why: NotSeen::ManyTimes { .. }, .. });
        assert!(many && flicker.bias_instability.value().is_some(), "{flicker:?}");
        let none = axis(Drawn { white: 1.0, ..Drawn::default() }, 3, 0);
        assert!(matches!(none.correlation_time, Coefficient::NotSeen { why: NotSeen::NoDrift { .. }, .. }));
    }

    #[test]
    fn a_misfit_next_to_a_bias_that_forgets_raises_its_standard_errors() {
        let drawn = Drawn { white: 1.0, markov: Some((0.5, 300.0)), ..Drawn::default() };
        let mut source = Source::new(drawn, 4);
        let mut samples = Cascade::default();
        for row in 0..120_000 {
            let sine = (std::f64::consts::TAU * f64::from(row) / 2500.0).sin();
            samples.push(&(source.sample() + Vector3::new(0.0, 1.0, 3.0) * sine));
        }
        let points = samples.points();
        let sums = Sums::new(&points, 120_000);
        let estimator = Estimator::new(&points, &sums, 120_000, 0.01);
        let misfits = [0, 1, 2].map(|axis| estimator.axis(axis, 0.0, 1.0).misfit);
        assert!(misfits[0].inflation == 1.0 && misfits[2].chance < 1e-3, "{misfits:?}");
        for misfit in misfits.iter().filter(|misfit| misfit.chance < 1e-3) {
            let expected = (misfit.chi_square / misfit.freedom as f64).sqrt();
            assert!((misfit.inflation / expected - 1.0).abs() < 1e-12, "{misfit:?}");
        }
    }
}
