//! Generalised least squares under a linear mixed model.
//!
//! ```text
//! y = X β + Z u + e      e ~ N(0, D)   u ~ N(0, K)      Σ = D + Z K Zᵀ
//! ```
//!
//! | goes in | comes out |
//! | --- | --- |
//! | block means of residual and signatures | normal equations `Xᵀ Σ⁻¹ X`, `Xᵀ Σ⁻¹ y`, `yᵀ Σ⁻¹ y`, ln det Σ; the noise that maximises the restricted likelihood |
//!
//! β holds baseline and effects; u the drift of each axis at knots and the pointing errors of the table; e white noise.
//!
//! | file | what |
//! | --- | --- |
//! | [`skyline`] | Cholesky factor of a banded matrix |
//! | [`symmetric_product`], [`schur_complement`] | products and elimination of dense symmetric matrices |
//! | [`random_effects`] | Z and its cross-products with X and y |
//! | [`whitening`] | Σ⁻¹, by Woodbury's identity over banded precisions |
//! | [`design`] | columns X by axis, and their normal equations |
//! | [`augmented_normal`] | normal equations of trial columns, with nuisance columns projected out |
//! | [`likelihood`] | the restricted likelihood (REML) |
//! | [`white_noise`] | white noise from neighbouring blocks |
//! | [`repeatability`] | pointing errors of the table, axis by axis |
//! | [`noise`] | parameters of the noise and the search for them |
//! | [`shared_offsets`] | pointing errors that turn all sensors at once |
//!
//! Sources: Henderson, Biometrics 31 (1975); Patterson and Thompson, Biometrika 58 (1971).
//!
//! Not modelled: noise that is not Gaussian; drift that axes share.

pub mod augmented_normal;
pub mod design;
pub mod likelihood;
pub mod noise;
pub mod random_effects;
pub mod repeatability;
pub mod schur_complement;
pub mod shared_offsets;
pub mod skyline;
pub mod symmetric_product;
pub mod white_noise;
pub mod whitening;
