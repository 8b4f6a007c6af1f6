//! Normal equations of what is fitted in any case, bordered by columns that are tried beside it.
//!
//! ```text
//! XᵀΣ⁻¹X  XᵀΣ⁻¹F      XᵀΣ⁻¹F = (D⁻¹X)ᵀ F − Λ_X Λ_Fᵀ
//!    ·    FᵀΣ⁻¹F
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | X | fitted columns and, last, the residual |
//! | F | further columns |
//! | D, Λ | white noise and what columns share beside it: [`super::whitening`] |
//!
//! D⁻¹X and Λ_X are the same for all that is tried.

use std::borrow::Borrow;

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::{
    design::{Channel, Design, Normal, append, places},
    whitening::Whitening,
};
use crate::diagnosis::residual::block::Means;

/// What is fitted in any case, and the residual.
pub struct Bordered<'a> {
    channels: Vec<Inner<'a>>,
    size: usize,
}

/// One channel of it.
struct Inner<'a> {
    channel: &'a Channel,
    whitening: &'a Whitening,
    /// (D⁻¹X)ᵀ.
    weighted: DMatrix<f64>,
    /// Λ_X.
    latent: DMatrix<f64>,
    normal: Normal,
    ids: Vec<usize>,
}

impl<'a> Bordered<'a> {
    /// Some columns of a design, given each channel's whitening.
    pub fn new(design: &'a Design, whitenings: &'a [Whitening], wanted: &[usize]) -> Self {
        let inner = |(channel, whitening): (&'a Channel, &'a Whitening)| {
            let (from, ids) = places(&channel.ids, wanted);
            let (x, latents) = (channel.gathered(&from), whitening.latents());
            let condensed = latents.condensed(&x);
            let latent = whitening.latent(&condensed);
            let normal = Normal::within(&whitening.less(&condensed, &latent), whitening);
            Inner { channel, whitening, weighted: latents.weighted(&x), latent, normal, ids }
        };
        let channels = design.channels.par_iter().zip(whitenings).map(inner).collect();
        Self { channels, size: wanted.len() }
    }

    /// Normal equations of the columns and, behind them, of further ones.
    pub fn with<M: Borrow<Means> + Sync>(&self, further: &[M]) -> Normal {
        let parts: Vec<Option<(Normal, Vec<usize>)>> =
            self.channels.par_iter().map(|inner| inner.with(self.size, further)).collect();
        let mut sum = Normal::zeros(self.size + further.len());
        for (inner, part) in self.channels.iter().zip(&parts) {
            match part {
                Some((normal, ids)) => sum.add(normal, ids),
                None => sum.add(&inner.normal, &inner.ids),
            }
        }
        sum
    }
}

impl Inner<'_> {
    /// Bordered by what reaches the channel, and the places of all columns; `None` where nothing does.
    fn with<M: Borrow<Means>>(&self, first: usize, further: &[M]) -> Option<(Normal, Vec<usize>)> {
        let (mut more, mut data) = (Vec::new(), Vec::new());
        append(self.channel.kind, self.channel.axis, first, further, &mut more, &mut data);
        if more.is_empty() {
            return None;
        }
        let (n, m) = (self.ids.len(), more.len());
        let f = DMatrix::from_vec(self.channel.y.len(), m, data);
        let condensed = self.whitening.latents().condensed(&f);
        let latent = self.whitening.latent(&condensed);
        let mut across = &self.weighted * &f;
        across.gemm(-1.0, &self.latent, &latent.transpose(), 1.0);
        let mut normal = Normal { log_determinant: self.normal.log_determinant, ..Normal::zeros(n + m) };
        normal.energy = self.normal.energy;
        normal.information.view_mut((0, 0), (n, n)).copy_from(&self.normal.information);
        normal.information.view_mut((n, n), (m, m)).copy_from(&self.whitening.less(&condensed, &latent));
        normal.information.view_mut((0, n), (n, m)).copy_from(&across.rows(0, n));
        normal.information.view_mut((n, 0), (m, n)).copy_from(&across.rows(0, n).transpose());
        normal.score.rows_mut(0, n).copy_from(&self.normal.score);
        normal.score.rows_mut(n, m).copy_from(&across.row(n).transpose());
        let ids = self.ids.iter().copied().chain(more).collect();
        Some((normal, ids))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nalgebra::{DVector, Vector3};

    use super::{
        super::{
            random_effects::{RandomEffects, Shared},
            whitening::Process,
        },
        *,
    };
    use crate::recording::SensorKind;

    const BLOCKS: usize = 40;

    fn column(id: usize) -> impl Fn(usize) -> f64 {
        move |block| (0.3 * (block * (id + 1)) as f64 + id as f64).sin()
    }

    fn channel(axis: usize, ids: Vec<usize>) -> Channel {
        let x = DMatrix::from_fn(BLOCKS, ids.len(), |block, at| column(ids[at])(block));
        let y = DVector::from_fn(BLOCKS, |block, _| column(20 + axis)(block));
        Channel { kind: SensorKind::Acc, axis, ids, x, y }
    }

    #[test]
    fn columns_behind_a_border_have_the_normal_equations_of_all_together() {
        let times: Vec<f64> = (0..BLOCKS).map(|k| 0.6 * k as f64).collect();
        let courses = vec![vec![0.4; 9], (0..9).map(|k| f64::from(k) - 3.5).collect()];
        let whitening = |axis: usize| {
            let weights = (0..BLOCKS).map(|k| 1.0 + ((k + axis) % 3) as f64).collect();
            let latents =
                RandomEffects::new(&times, weights, &[Shared { blocks: 5..14, courses: courses.clone() }]);
            Whitening::new(Arc::new(latents), 0.7, &[Process { time: 8.0, sigma: 0.5 }])
        };
        let whitenings: Vec<Whitening> = (0..3).map(whitening).collect();
        // The third axis is reached by nothing further, and the second of the two columns reaches the first alone.
        let design = Design {
            columns: Vec::new(),
            size: 3,
            channels: vec![channel(0, vec![0, 1, 2]), channel(1, vec![1]), channel(2, vec![0, 2])],
        };
        let means = |reach: [f64; 2], id: usize| -> Means {
            let value = |block| Vector3::new(reach[0], reach[1], 0.0) * column(id)(block);
            [Some((0..BLOCKS).map(value).collect()), None, None]
        };
        let further = [means([1.0, 1.0], 7), means([1.0, 0.0], 8)];
        let found = Bordered::new(&design, &whitenings, &[0, 2]).with(&further);
        let kept = [0, 2];
        let all = design.extended(&kept, Vec::new(), &further).normal(&whitenings, &[0, 1, 2, 3]);
        assert!((found.information - all.information).amax() < 1e-9);
        assert!((found.score - all.score).amax() < 1e-9);
        assert!((found.energy - all.energy).abs() < 1e-9);
        assert!((found.log_determinant - all.log_determinant).abs() < 1e-9);
    }
}
