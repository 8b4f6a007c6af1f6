//! The restricted likelihood of whitened rows (Patterson & Thompson 1971): the fit's parameters integrated out.
//!
//! ```text
//! ln p(y | V) = −½ ln|V| − ½ ln|JᵀV⁻¹J| − ½ rᵀPr / s² − ½ ν ln s²,   rᵀPr = min over δ of |y − J δ|² in whitened rows
//! ```

use nalgebra::DMatrix;

/// What the likelihood of one covariance is made of, but for its scale s².
#[derive(Clone, Copy, Debug)]
pub(super) struct Restricted {
    /// −½ ln|V| − ½ ln|JᵀV⁻¹J|.
    pub log_volume: f64,
    /// rᵀPr.
    pub left: f64,
    /// ν: rows less parameters.
    pub freedom: usize,
}

impl Restricted {
    /// Of whitened residuals (one column) and derivatives, and ln|V|.
    pub fn of(residuals: &DMatrix<f64>, jacobian: DMatrix<f64>, log_determinant: f64) -> Self {
        let (rows, free) = jacobian.shape();
        let qr = jacobian.qr();
        let log_det_fit = 2.0 * qr.r().diagonal().iter().map(|d| d.abs().ln()).sum::<f64>();
        let explained = qr.q().tr_mul(residuals).norm_squared();
        Self {
            log_volume: -0.5 * (log_determinant + log_det_fit),
            left: (residuals.norm_squared() - explained).max(f64::MIN_POSITIVE),
            freedom: rows.saturating_sub(free),
        }
    }
}
