//! A menu of shapes that was scanned: the likeliest, and how many are as likely.
//!
//! ```text
//! ln p(y) = ln L_max + ln Σ_s π_s L_s / L_max      over the menu, its best cell summed from a closer one
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | L_s | likelihood of the data in shape s, as a Bayes factor |
//! | π_s | its prior |

/// A shape of an effect.
#[derive(Clone, Debug, PartialEq)]
pub struct GridPosterior {
    /// All its parameters, amplitudes zero.
    pub values: Vec<f64>,
    /// ln of how many shapes of the menu are as likely: the likelihood's sum over the menu, each weighed by its prior, as a
    /// share of its maximum; less than one where that is sharper than the menu, or at an unusual shape.
    pub spread: f64,
}

impl GridPosterior {
    /// The only one.
    pub fn alone(values: Vec<f64>) -> Self {
        Self { values, spread: 0.0 }
    }
}

/// Shapes, their ln BF and ln of their priors.
pub struct Scanned<T> {
    /// The shapes.
    pub shapes: Vec<T>,
    /// ln L_s.
    pub values: Vec<f64>,
    /// ln π_s, but for a constant.
    pub priors: Vec<f64>,
}

impl<T: Clone> Scanned<T> {
    /// Places and ln π_s L_s of what could be computed.
    fn finite(&self) -> impl Iterator<Item = (usize, f64)> {
        let sums = self.values.iter().zip(&self.priors).map(|(value, prior)| value + prior);
        sums.enumerate().filter(|(_, sum)| sum.is_finite())
    }

    /// The place of the likeliest; `None` where none could be computed.
    pub fn best(&self) -> Option<usize> {
        self.finite().max_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(at, _)| at)
    }

    /// The likeliest of the shapes `near` the best of these, of which `dense` lie within a cell of this menu, and ln of how
    /// many of this menu are as likely.
    pub fn refined(&self, near: &Self, dense: f64) -> Option<(T, f64)> {
        let (best, refined) = (self.best()?, near.best()?);
        let most = near.values[refined];
        let share = |sum: f64| (sum - most).exp();
        let elsewhere: f64 = self.finite().filter(|(at, _)| *at != best).map(|(_, sum)| share(sum)).sum();
        let here: f64 = near.finite().map(|(_, sum)| share(sum)).sum();
        let usual = self.priors.iter().map(|prior| prior.exp()).sum::<f64>() / self.priors.len() as f64;
        Some((near.shapes[refined].clone(), ((elsewhere + here / dense) / usual).ln()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scanned(values: &[f64]) -> Scanned<usize> {
        Scanned {
            shapes: (0..values.len()).collect(),
            values: values.to_vec(),
            priors: vec![0.0; values.len()],
        }
    }

    #[test]
    fn shapes_as_likely_as_the_likeliest_are_counted_and_others_are_not() {
        let alone = |values: &[f64]| {
            let whole = scanned(values);
            let best = whole.best()?;
            whole.refined(&scanned(&values[best..=best]), 1.0).map(|(_, spread)| (best, spread))
        };
        assert_eq!(alone(&[-1.0, 700.0, f64::NAN, f64::NEG_INFINITY]), Some((1, 0.0)));
        let (_, spread) = alone(&[5.0; 7]).unwrap();
        assert!((spread - 7f64.ln()).abs() < 1e-12, "{spread}");
        let (at, spread) = alone(&[2.0, 2.0 + 2f64.ln()]).unwrap();
        assert!(at == 1 && (spread - 1.5f64.ln()).abs() < 1e-12, "{at} {spread}");
        assert_eq!(alone(&[f64::NAN]), None);
    }

    #[test]
    fn an_unusual_shape_counts_less_than_a_usual_one_that_is_as_likely() {
        let whole = Scanned { shapes: vec![0, 1], values: vec![0.0, 30.0], priors: vec![0.0, -2.0] };
        let near = Scanned { shapes: vec![1], values: vec![30.0], priors: vec![-2.0] };
        let (at, spread) = whole.refined(&near, 1.0).unwrap();
        let share = (-2.0f64).exp() / (0.5 * (1.0 + (-2.0f64).exp()));
        assert!(at == 1 && (spread - share.ln()).abs() < 1e-12, "{at} {spread}");
    }

    #[test]
    fn a_likelihood_sharper_than_the_grid_counts_its_share_of_a_cell() {
        // N(0.3, 0.02²) in cells of one, and from 32 shapes to a cell.
        let bell = |x: f64| -0.5 * ((x - 0.3) / 0.02).powi(2);
        let whole = scanned(&(0..9).map(|k| bell(f64::from(k - 4))).collect::<Vec<_>>());
        let near = scanned(&(-31..32).map(|k| bell(f64::from(k) / 32.0)).collect::<Vec<_>>());
        let (at, spread) = whole.refined(&near, 32.0).unwrap();
        let expected = (0.02 * std::f64::consts::TAU.sqrt()).ln() - bell((at as f64 - 31.0) / 32.0);
        assert!((spread - expected).abs() < 0.1, "{spread} {expected}");
    }
}
