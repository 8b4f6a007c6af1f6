//! A drift: a first-order Gauss–Markov process at knots that are evenly spaced.
//!
//! ```text
//! k_{i+1} = φ k_i + ε_i      φ = exp(−Δ / τ)      ε ~ N(0, q)      q = σ² (1 − φ²)      k_0 ~ N(0, σ²)
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | Δ | distance of the knots, s |
//! | τ, σ | correlation time, s; standard deviation |
//!
//! Its precision is tridiagonal. Source: A. Gelb, Applied Optimal Estimation (1974), ch. 3.8.

/// A first-order Gauss–Markov process.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Process {
    /// τ, s.
    pub time: f64,
    /// σ, unit of the channel; positive.
    pub sigma: f64,
}

impl Process {
    /// φ over this distance, s.
    pub fn kept(&self, distance: f64) -> f64 {
        libm::exp(-distance / self.time)
    }

    /// q over this distance, s.
    pub fn innovation(&self, distance: f64) -> f64 {
        let kept = self.kept(distance);
        self.sigma * self.sigma * (1.0 - kept * kept)
    }

    /// ln of the determinant of its covariance at so many knots.
    pub fn log_determinant(&self, knots: usize, distance: f64) -> f64 {
        (knots.saturating_sub(1)) as f64 * self.innovation(distance).ln() + 2.0 * self.sigma.ln()
    }
}
