//! The kinds of noise that an Allan variance is made of.
//!
//! ```text
//! σ²(m) = 3 Q²/m² + N²/m + (2 ln 2/π) B² + K² m/3        lengths and rates in samples
//! ```
//!
//! | kind | symbol | its sum's generalised covariance s(t) |
//! | --- | --- | --- |
//! | quantisation of the integrated output | Q | Q² at t = 0 alone |
//! | white noise | N | −N² \|t\|/2 |
//! | bias instability, a spectrum that falls as 1/f | B | B² t² ln\|t\|/(2π) |
//! | random walk of the bias | K | K² \|t\|³/12 |
//! | Gauss–Markov bias of correlation time T | σ | −σ² T (\|t\| − T (1 − e^(−\|t\|/T))) |
//!
//! The sum x of the samples has no covariance of its own; second differences have one, which s gives: for numbers c with
//! Σ c = Σ c·t = 0, the variance of Σ c x(t) is Σ Σ c c' s(t − t'). Sources: C. A. Greenhall & W. J. Riley, Uncertainty of
//! stability variances based on finite differences (PTTI 2003), for s; IEEE Std 952, annex C, for the coefficients.
//!
//! Not modelled: a ramp of the bias, such as of a unit that warms up, and what a filter takes off white noise.

/// One kind of noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// Q.
    Quantisation,
    /// N.
    White,
    /// B.
    Flicker,
    /// K.
    Walk,
    /// σ, of this correlation time, samples.
    Markov(f64),
}

/// The second difference of a sum at m: its factors at 0, m and 2m.
pub(super) const SECOND_DIFFERENCE: [f64; 3] = [1.0, -2.0, 1.0];

impl Kind {
    /// s(t) of a coefficient of one, but for what is at t = 0 alone; t in samples.
    pub(super) fn generalised(self, time: f64) -> f64 {
        let time = time.abs();
        match self {
            Self::Quantisation => 0.0,
            Self::White => -0.5 * time,
            Self::Flicker if time == 0.0 => 0.0,
            Self::Flicker => time * time * time.ln() / (2.0 * std::f64::consts::PI),
            Self::Walk => time.powi(3) / 12.0,
            // exp_m1 keeps the digits where t is short.
            Self::Markov(own) => -own * (time + own * (-time / own).exp_m1()),
        }
    }

    /// What else s has at t = 0.
    pub(super) fn at_zero(self) -> f64 {
        if self == Self::Quantisation { 1.0 } else { 0.0 }
    }

    /// σ²(m) of a squared coefficient of one.
    pub fn allan_variance(self, samples: f64) -> f64 {
        let continuous = 2.0 * self.generalised(2.0 * samples) - 8.0 * self.generalised(samples);
        (continuous + 6.0 * self.at_zero()) / (2.0 * samples * samples)
    }
}

/// Standard deviation of a sample's white noise: N is a density, and a sample has half its rate of bandwidth, twice-sided.
pub fn per_sample(density: f64, rate: f64) -> f64 {
    density * rate.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_variances_are_those_of_the_standard() {
        for m in [1.0, 7.0, 1e3, 1e6] {
            let near = |kind: Kind, expected: f64| {
                let found = kind.allan_variance(m);
                assert!((found / expected - 1.0).abs() < 1e-9, "{kind:?} {m}: {found} {expected}");
            };
            near(Kind::Quantisation, 3.0 / (m * m));
            near(Kind::White, 1.0 / m);
            near(Kind::Flicker, 2.0 * 2f64.ln() / std::f64::consts::PI);
            near(Kind::Walk, m / 3.0);
        }
    }

    #[test]
    fn a_bias_that_forgets_is_a_walk_at_first_and_white_noise_at_last() {
        let kind = Kind::Markov(1000.0);
        // Increments of 2 σ²/T a sample; a density of 2 σ² T.
        assert!((kind.allan_variance(10.0) / (2.0 / 1000.0 * 10.0 / 3.0) - 1.0).abs() < 0.02);
        assert!((kind.allan_variance(1e6) / (2.0 * 1000.0 / 1e6) - 1.0).abs() < 0.02);
    }
}
