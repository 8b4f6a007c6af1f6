//! The restricted likelihood (Patterson & Thompson 1971): the fit's parameters integrated out.
//!
//! ```text
//! ln p(y | V) = −½ ln|V| − ½ ln|JᵀV⁻¹J| − ½ rᵀPr / s² − ½ ν ln s²,   rᵀPr = min over δ of (y − J δ)ᵀ V⁻¹ (y − J δ)
//! ```

use nalgebra::{DMatrix, DVectorView};

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
    /// Of each column of whitened residuals, of whitened derivatives, and ln|V|.
    pub fn of_rows(residuals: &DMatrix<f64>, jacobian: DMatrix<f64>, log_determinant: f64) -> Vec<Self> {
        let (rows, free) = jacobian.shape();
        let qr = jacobian.qr();
        let log_det_fit = 2.0 * qr.r().diagonal().iter().map(|d| d.abs().ln()).sum::<f64>();
        let explained = qr.q().tr_mul(residuals);
        let of_column = |(residuals, explained): (DVectorView<'_, f64>, DVectorView<'_, f64>)| Self {
            log_volume: -0.5 * (log_determinant + log_det_fit),
            left: (residuals.norm_squared() - explained.norm_squared()).max(f64::MIN_POSITIVE),
            freedom: rows.saturating_sub(free),
        };
        residuals.column_iter().zip(explained.column_iter()).map(of_column).collect()
    }

    /// Of XᵀV⁻¹X, X = [J y] of so many rows, and ln|V|; `None` where columns of J are dependent.
    pub fn of_products(products: &DMatrix<f64>, rows: usize, log_determinant: f64) -> Option<Self> {
        let free = products.ncols().checked_sub(1)?;
        let factor = products.view((0, 0), (free, free)).into_owned().cholesky()?;
        let score = products.view((0, free), (free, 1)).into_owned();
        let explained = score.dot(&factor.solve(&score));
        Some(Self {
            log_volume: -0.5 * (log_determinant + factor.ln_determinant()),
            left: (products[(free, free)] - explained).max(f64::MIN_POSITIVE),
            freedom: rows.saturating_sub(free),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_and_their_products_have_the_same_likelihood() {
        let all = DMatrix::from_fn(9, 4, |row, k| ((row * (k + 1)) as f64).cos());
        let found = Restricted::of_products(&all.tr_mul(&all), 9, 0.3).unwrap();
        let expected = Restricted::of_rows(&all.columns(3, 1).into(), all.columns(0, 3).into(), 0.3)[0];
        assert!((found.log_volume - expected.log_volume).abs() < 1e-12);
        assert!((found.left - expected.left).abs() < 1e-12 && found.freedom == expected.freedom);
        let dependent = DMatrix::repeat(9, 3, 1.0);
        assert!(Restricted::of_products(&dependent.tr_mul(&dependent), 9, 0.0).is_none());
    }
}
