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
//! | [`crate::noise`] | drifts, and Σ⁻¹ with the random effects eliminated in the order of time; calibration uses them too |
//! | [`design`] | columns X by channel, and their normal equations |
//! | [`augmented_normal`] | normal equations of trial columns added to fitted ones |
//! | [`drawn_noise`] | noise drawn from its model |
//! | [`likelihood`] | the restricted likelihood (REML) |
//! | [`white_noise`] | white noise from neighbouring blocks |
//! | [`repeatability`] | pointing errors of the table, axis by axis |
//! | [`shared_offsets`] | pointing errors that turn all sensors at once |
//! | [`noise`] | parameters of the noise and the search for them |
//!
//! Every question is answered by one product: cross-products of columns with each other and with u, by white noise alone;
//! then the elimination of u under the drifts and the scatter; then sums over channels in a [`Normal`](design::Normal).
//! Cost and memory are linear in the length of the recording.
//!
//! Sources: Henderson, Biometrics 31 (1975); Patterson and Thompson, Biometrika 58 (1971).
//!
//! Not modelled: noise that is not Gaussian; drift that axes share.

pub mod augmented_normal;
pub mod design;
pub mod drawn_noise;
pub mod likelihood;
pub mod noise;
pub mod repeatability;
pub mod shared_offsets;
pub mod white_noise;
