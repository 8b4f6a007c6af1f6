//! Standard errors whose ±1.96 hold 95 %, of least squares under noise whose size and memory are only estimated.
//!
//! ```text
//! V = s² (V₀ + ρ V₁),   θ̂ − θ = Aᵀe
//! p(θ̂ − θ | y) = Σ_ρ ∫ p(ρ, s² | y) N(0, s² Aᵀ(V₀ + ρ V₁)A) ds²
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | V₀, V₁ | two parts of the noise: white and drift, or two sensors' |
//! | ρ | how much of the second there is, from a list with prior weights |
//! | s² | size of all of it: of any, p ∝ 1/s²; or, where V₀ is known to be there at least, one or more ([`Scale`]) |
//! | A | influence of the rows on the parameters, of whatever weights the fit had |
//!
//! The posterior is that of the restricted likelihood. For one ρ and any s² it is Student's distribution with the
//! degrees of freedom that are left, exact for a fit by V⁻¹. A standard error is the posterior's 97.5 % point over 1.96, or
//! its 99.99 % point over 5 where that is larger and asked for; correlations are those of its covariance. Not modelled: noise of a third kind; A of another fit than V⁻¹'s is not
//! independent of s².

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use statrs::distribution::{Continuous, ContinuousCDF, Normal, StudentsT};

use super::{blocked_cholesky, restricted::Restricted};

/// The normal distribution's 97.5 % point.
pub const NORMAL: f64 = 1.959_963_984_540_054;
/// The share below the upper end of a 95 % interval.
const UPPER: f64 = 0.975;
/// The share below five standard errors, at least: where noise may be of two sizes, most errors are small and some are
/// not, and 97.5 % say nothing of the rest.
const FIVE: f64 = 0.9999;
/// Steps to a quantile, at most, and the last one over it.
const STEPS: usize = 60;
/// See [`STEPS`].
const EXACT: f64 = 1e-12;
/// Sizes s² above one, each so many times the one before, and the largest.
const SIZES: (f64, f64) = (1.2, 1e6);
/// How many times larger than the noise its bounds may be, squared.
const BOUNDS: f64 = 16.0;
/// Prior probability that noise which is no less than known is just as known.
const KNOWN: f64 = 0.75;
/// What is less probable than this does not move a 97.5 % point.
const LEAST: f64 = 1e-7;

/// What is known of s².
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Nothing: p(s²) ∝ 1/s².
    Free,
    /// Noise is no less than V₀: three quarters at s² = 1, the others log-uniform from there to 10⁶.
    AtLeastOne,
    /// The same, but V₀ contains bounds, which noise may be below: three eighths at s² = 1 are log-uniform from 1/16 to one
    /// instead.
    Near,
}

/// V₀ + ρ V₁, as a likelihood and errors need it.
pub trait Whitening: Sync {
    /// L⁻¹ X of two matrices, where V₀ + ρ V₁ = L Lᵀ, and ln |V₀ + ρ V₁|; `None` where that is no covariance.
    fn whitened(&self, ratio: f64, x: [DMatrix<f64>; 2]) -> Option<([DMatrix<f64>; 2], f64)>;

    /// AᵀV₀A and AᵀV₁A.
    fn carried(&self, influence: &DMatrix<f64>) -> [DMatrix<f64>; 2];
}

/// V₀ and V₁ written out.
impl Whitening for [DMatrix<f64>; 2] {
    fn whitened(&self, ratio: f64, x: [DMatrix<f64>; 2]) -> Option<([DMatrix<f64>; 2], f64)> {
        let (lower, log_determinant) = blocked_cholesky::factor(&self[0] + &self[1] * ratio)?;
        let [one, other] = x.map(|x| lower.solve_lower_triangular(&x));
        Some(([one?, other?], log_determinant))
    }

    fn carried(&self, influence: &DMatrix<f64>) -> [DMatrix<f64>; 2] {
        self.each_ref().map(|part| influence.tr_mul(&(part * influence)))
    }
}

/// Noise of two parts.
#[derive(Clone, Copy)]
pub struct Parts<'a> {
    /// V₀ and V₁.
    pub parts: &'a dyn Whitening,
    /// Each ρ with its prior weight.
    pub ratios: &'a [(f64, f64)],
    /// What is known of s².
    pub scale: Scale,
    /// Whether five standard errors shall hold nearly all: where something bounds the drift in addition to the prior.
    pub five: bool,
}

/// What an estimate's errors come to.
#[derive(Clone, Debug, PartialEq)]
pub struct Errors {
    /// Covariance such that 1.96 standard errors hold 95 %.
    pub covariance: DMatrix<f64>,
    /// Typical s²: its geometric mean.
    pub scale: f64,
    /// Mean of ρ.
    pub ratio: f64,
}

/// A share of the posterior: a ratio and a size.
struct Component<'a> {
    weight: f64,
    ratio: f64,
    size: f64,
    /// Aᵀ(V₀ + ρ V₁)A.
    unscaled: &'a DMatrix<f64>,
}

/// Sizes s² with their probabilities.
type Sizes = Vec<(f64, f64)>;

/// One ratio: what it says of each column of residuals.
struct Weighed {
    ratio: f64,
    log_prior: f64,
    unscaled: DMatrix<f64>,
    /// Logarithm of each column's evidence, and its sizes with their probabilities.
    columns: Vec<(f64, Sizes)>,
}

impl Parts<'_> {
    /// Drift of `count` sizes from that which white noise averages to over `observed` (in the unit of 1/ρ), each of a
    /// variance so many times the one before, or none at all: half and half.
    pub fn drifts(observed: f64, times: f64, count: i32) -> Vec<(f64, f64)> {
        let some = (0..count).map(|k| (times.powi(k) / observed, 0.5 / f64::from(count)));
        std::iter::once((0.0, 0.5)).chain(some).collect()
    }

    /// Errors of estimates that follow from the rows by `influence` (a column for each). `residuals` are those of any
    /// fit; `jacobian` is their derivatives by what was fitted. `None` where no row is left over or none of the
    /// covariances is one.
    pub fn errors(
        &self,
        residuals: &DVector<f64>,
        jacobian: &DMatrix<f64>,
        influence: &DMatrix<f64>,
    ) -> Option<Errors> {
        let carried = self.parts.carried(influence);
        let column = DMatrix::from_column_slice(residuals.len(), 1, residuals.as_slice());
        self.errors_of(carried, &column, jacobian)?.pop()
    }

    /// The same with AᵀV₀A and AᵀV₁A given, for several columns of residuals that are as large as they like, each, and
    /// share ρ: the axes of a triad. A column that is zero says nothing of ρ.
    pub fn errors_of(
        &self,
        carried: [DMatrix<f64>; 2],
        residuals: &DMatrix<f64>,
        jacobian: &DMatrix<f64>,
    ) -> Option<Vec<Errors>> {
        let freedom = jacobian.nrows().checked_sub(jacobian.ncols()).filter(|freedom| *freedom > 0)?;
        let mut unit = jacobian.clone();
        // Columns at unit length: parameters of different units would spoil the factorisation.
        unit.column_iter_mut().for_each(|mut column| {
            column.normalize_mut();
        });
        // A factor each, as large as the observations are many.
        let weighed = self.ratios.par_iter().filter_map(|(ratio, prior)| {
            let columns = self.weigh(*ratio, residuals, &unit)?;
            let unscaled = &carried[0] + &carried[1] * *ratio;
            Some(Weighed { ratio: *ratio, log_prior: prior.ln(), unscaled, columns })
        });
        let weighed: Vec<Weighed> = weighed.collect();
        if weighed.is_empty() {
            return None;
        }
        let telling: Vec<usize> =
            (0..residuals.ncols()).filter(|column| residuals.column(*column).amax() > 0.0).collect();
        let log = |w: &Weighed| w.log_prior + telling.iter().map(|c| w.columns[*c].0).sum::<f64>();
        let most = weighed.iter().map(log).fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = weighed.iter().map(|w| (log(w) - most).exp()).sum();
        let errors = |column: usize| {
            let components = weighed.iter().flat_map(|w| {
                let share = (log(w) - most).exp() / sum;
                w.columns[column].1.iter().map(move |(size, probability)| Component {
                    weight: share * probability,
                    ratio: w.ratio,
                    size: *size,
                    unscaled: &w.unscaled,
                })
            });
            let components: Vec<Component<'_>> = components.filter(|c| c.weight > LEAST).collect();
            self.errors_from(&components, freedom)
        };
        Some((0..residuals.ncols()).map(errors).collect())
    }

    /// Evidence and sizes of each column at one ratio; `None` where that makes no covariance.
    fn weigh(
        &self,
        ratio: f64,
        residuals: &DMatrix<f64>,
        jacobian: &DMatrix<f64>,
    ) -> Option<Vec<(f64, Sizes)>> {
        let ([data, unit], log_determinant) =
            self.parts.whitened(ratio, [residuals.clone(), jacobian.clone()])?;
        let of_column = |found: Restricted| {
            let (log, sizes) = self.sizes(found.left, found.freedom as f64);
            let log = log + found.log_volume;
            log.is_finite().then_some((log, sizes))
        };
        Restricted::of_rows(&data, unit, log_determinant).into_iter().map(of_column).collect()
    }

    /// Logarithm of the evidence over s², and its posterior.
    fn sizes(&self, left: f64, freedom: f64) -> (f64, Sizes) {
        if self.scale == Scale::Free {
            return (-0.5 * freedom * left.ln(), vec![(left / freedom, 1.0)]);
        }
        let steps = |factor: f64| (factor.ln() / SIZES.0.ln()).ceil() as i32;
        let above = steps(SIZES.1);
        let below = if self.scale == Scale::Near { steps(BOUNDS) } else { 0 };
        let prior = |k: i32| match k {
            ..0 => 0.5 * KNOWN / f64::from(below),
            0 if below > 0 => 0.5 * KNOWN,
            0 => KNOWN,
            _ => (1.0 - KNOWN) / f64::from(above),
        };
        let logs: Vec<(f64, f64)> = (-below..=above)
            .map(|k| {
                let size = SIZES.0.powi(k);
                (size, prior(k).ln() - 0.5 * freedom * size.ln() - 0.5 * left / size)
            })
            .collect();
        let most = logs.iter().map(|(_, log)| *log).fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = logs.iter().map(|(_, log)| (log - most).exp()).sum();
        (most + sum.ln(), logs.into_iter().map(|(size, log)| (size, (log - most).exp() / sum)).collect())
    }

    /// The posterior's covariance, its standard errors set by its quantiles.
    fn errors_from(&self, components: &[Component<'_>], freedom: usize) -> Errors {
        let count = components.first().map_or(0, |c| c.unscaled.nrows());
        let mut covariance = DMatrix::zeros(count, count);
        let (mut log_scale, mut ratio) = (0.0, 0.0);
        for component in components {
            covariance += component.unscaled * (component.weight * component.size);
            log_scale += component.weight * component.size.ln();
            ratio += component.weight * component.ratio;
        }
        let factor = DVector::from_fn(count, |k, _| {
            let [of_most, of_nearly_all] = self.quantiles(components, freedom, k);
            let of_nearly_all = if self.five { of_nearly_all } else { 0.0 };
            let std = f64::max(of_most / NORMAL, of_nearly_all / 5.0);
            let spread = f64::sqrt(covariance[(k, k)]);
            if spread > 0.0 { std / spread } else { 1.0 }
        });
        let covariance = DMatrix::from_fn(count, count, |i, j| covariance[(i, j)] * factor[i] * factor[j]);
        Errors { covariance, scale: log_scale.exp(), ratio }
    }

    /// The 97.5 % and the 99.99 % point of a parameter's error.
    fn quantiles(&self, components: &[Component<'_>], freedom: usize, parameter: usize) -> [f64; 2] {
        let spread = |c: &Component<'_>| (c.size * c.unscaled[(parameter, parameter)]).max(0.0).sqrt();
        let spreads: Vec<(f64, f64)> =
            components.iter().map(|c| (c.weight, spread(c))).filter(|(_, spread)| *spread > 0.0).collect();
        match (self.scale, StudentsT::new(0.0, 1.0, freedom as f64)) {
            (Scale::Free, Ok(student)) => [UPPER, FIVE].map(|upper| upper_point(&spreads, &student, upper)),
            _ => [UPPER, FIVE].map(|upper| upper_point(&spreads, &Normal::standard(), upper)),
        }
    }
}

/// The point below which there is such a share of a mixture of one distribution at several widths with weights.
fn upper_point<D>(spreads: &[(f64, f64)], distribution: &D, upper: f64) -> f64
where
    D: Continuous<f64, f64> + ContinuousCDF<f64, f64>,
{
    let point = distribution.inverse_cdf(upper);
    let ends = spreads.iter().map(|(_, spread)| spread * point);
    let (mut low, mut high) = ends.fold((f64::INFINITY, 0.0), |(l, h), x| (f64::min(l, x), f64::max(h, x)));
    if high <= low {
        return high;
    }
    let all: f64 = spreads.iter().map(|(weight, _)| weight).sum();
    // Newton's steps from below stay below, since the share is concave above zero; halving is for errors of rounding.
    let mut at = low;
    for _ in 0..STEPS {
        let share = |(weight, spread): &(f64, f64)| {
            let x = at / spread;
            (weight * distribution.cdf(x), weight * distribution.pdf(x) / spread)
        };
        let (below, density) =
            spreads.iter().map(share).fold((0.0, 0.0), |sums, share| (sums.0 + share.0, sums.1 + share.1));
        let next = at + (upper * all - below) / density;
        if below < upper * all {
            low = at;
        } else {
            high = at;
        }
        let last =
            std::mem::replace(&mut at, if next > low && next < high { next } else { 0.5 * (low + high) });
        if (at - last).abs() <= EXACT * at {
            break;
        }
    }
    at
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Whitens, and carries, as V₀ and V₁ written out do.
    pub fn assert_is_as_written_out(of: &dyn Whitening, [first, second]: &[DMatrix<f64>; 2]) {
        let x = DMatrix::from_fn(first.nrows(), 3, |i, k| ((i * 3 + 7 * k) as f64).sin());
        for ratio in [0.0, 1e-3, 1.0, 40.0] {
            let factor = (first + second * ratio).cholesky().unwrap();
            let ([one, other], log) = of.whitened(ratio, [x.clone(), x.columns(0, 1).into_owned()]).unwrap();
            let expected = x.tr_mul(&factor.solve(&x));
            assert!((one.tr_mul(&one) - &expected).amax() < 1e-11 * expected.amax(), "{ratio}");
            assert!((other.tr_mul(&one) - expected.rows(0, 1)).amax() < 1e-11 * expected.amax(), "{ratio}");
            assert!((log - factor.ln_determinant()).abs() < 1e-11, "{ratio}");
        }
        for (found, part) in of.carried(&x).iter().zip([first, second]) {
            assert!((found - x.tr_mul(&(part * &x))).amax() < 1e-12);
        }
    }
    use crate::simulator::random::{Purpose, Random};

    /// The share of means of `count` numbers, `step` of drift in them, whose 95 % interval holds.
    fn held(count: usize, step: f64, scale: Scale) -> f64 {
        let white = DMatrix::identity(count, count);
        let walk = DMatrix::from_fn(count, count, |i, j| (i.min(j) + 1) as f64);
        let ratios = [(0.0, 0.5), (0.003, 0.1), (0.012, 0.1), (0.05, 0.1), (0.2, 0.1), (0.8, 0.1)];
        let parts = [white, walk];
        let parts = Parts { parts: &parts, ratios: &ratios, scale, five: false };
        let ones = DMatrix::repeat(count, 1, 1.0);
        let mut random = Random::new(4, Purpose::Noise);
        let hold = (0..2000).filter(|_| {
            let mut drift = 0.0;
            let values = DVector::from_fn(count, |_, _| {
                drift += step * random.normal();
                drift + random.normal()
            });
            let errors = parts.errors(&values, &ones, &(&ones / count as f64)).unwrap();
            values.mean().abs() <= NORMAL * errors.covariance[(0, 0)].sqrt()
        });
        hold.count() as f64 / 2000.0
    }

    #[test]
    fn below_a_quantile_of_a_mixture_lies_its_share() {
        let normal = Normal::standard();
        // As wide as one another, much wider, and next to none that are.
        for spreads in [[(0.5, 1.0), (0.5, 1.2)], [(0.9, 1.0), (0.1, 1e3)], [(1.0 - 1e-6, 1.0), (1e-6, 1e6)]]
        {
            for upper in [UPPER, FIVE] {
                let point = upper_point(&spreads, &normal, upper);
                let share: f64 =
                    spreads.iter().map(|(weight, spread)| weight * normal.cdf(point / spread)).sum();
                assert!((share - upper).abs() < 1e-13, "{spreads:?} {upper}: {point}, {share}");
            }
        }
    }

    #[test]
    fn with_few_degrees_of_freedom_ninety_five_percent_hold_ninety_five() {
        // By the normal distribution four numbers hold 86 %; 2000 means know a share to 0.5 %. A drift that might be
        // there, and noise above what is known, widen both.
        for scale in [Scale::Free, Scale::AtLeastOne] {
            for count in [4, 30] {
                let share = held(count, 0.0, scale);
                assert!((0.93..0.9996).contains(&share), "{scale:?} {count}: {share}");
            }
        }
    }

    #[test]
    fn a_drift_is_in_the_standard_error() {
        // As if independent, they hold 35 %.
        for scale in [Scale::Free, Scale::AtLeastOne] {
            let share = held(30, 0.4, scale);
            assert!((0.9..0.98).contains(&share), "{scale:?}: {share}");
        }
    }

    #[test]
    fn noise_far_above_what_is_known_is_found_and_noise_below_is_not_believed() {
        let parts = [DMatrix::identity(40, 40), DMatrix::identity(40, 40)];
        let parts = Parts { parts: &parts, ratios: &[(0.0, 1.0)], scale: Scale::AtLeastOne, five: false };
        let ones = DMatrix::repeat(40, 1, 1.0);
        let mut random = Random::new(5, Purpose::Noise);
        let values = DVector::from_fn(40, |_, _| random.normal());
        let of = |factor: f64| parts.errors(&(&values * factor), &ones, &(&ones / 40.0)).unwrap();
        let (large, small) = (of(30.0), of(1e-6));
        // 39 degrees of freedom know a variance to 23 %.
        assert!((500.0..1600.0).contains(&large.scale), "{}", large.scale);
        assert!((1.0..1.02).contains(&small.scale), "{}", small.scale);
        assert!((small.covariance[(0, 0)] * 40.0 - 1.0).abs() < 0.05);
    }

    #[test]
    fn of_one_part_alone_the_standard_error_is_student_s() {
        let parts = [DMatrix::identity(5, 5), DMatrix::identity(5, 5)];
        let parts = Parts { parts: &parts, ratios: &[(0.0, 1.0)], scale: Scale::Free, five: false };
        let ones = DMatrix::repeat(5, 1, 1.0);
        let values = DVector::from_column_slice(&[1.0, -1.0, 2.0, 0.0, -2.0]);
        let errors = parts.errors(&values, &ones, &(&ones / 5.0)).unwrap();
        // s² = 10/4, over five; of four degrees of freedom t is 2.7764 at 97.5 %, and 13.034 at 99.99 %, which asks for more.
        let expected = |point: f64| (10.0f64 / 4.0 / 5.0).sqrt() * point;
        assert!((errors.covariance[(0, 0)].sqrt() - expected(2.776_445 / NORMAL)).abs() < 1e-5);
        let five = Parts { five: true, ..parts }.errors(&values, &ones, &(&ones / 5.0)).unwrap();
        assert!((five.covariance[(0, 0)].sqrt() - expected(13.033_7 / 5.0)).abs() < 1e-4);
        assert_eq!(errors.ratio, 0.0);
        assert!(parts.errors(&values.rows(0, 1).into(), &ones.rows(0, 1).into(), &ones).is_none());
    }
}
