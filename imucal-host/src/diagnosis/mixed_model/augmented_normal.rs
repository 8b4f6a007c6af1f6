//! Normal equations of what is fitted in any case, augmented by columns that are tried with it.
//!
//! ```text
//! XᵀΣ⁻¹X  XᵀΣ⁻¹F      XᵀΣ⁻¹F = Xᵀ D⁻¹ F − Y_Xᵀ Y_F
//!    ·    FᵀΣ⁻¹F
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | X | fitted columns and, last, the residual |
//! | F | further columns |
//! | D, Y | white noise and the eliminated random effects: [`crate::noise::precision`] |
//!
//! XᵀΣ⁻¹X and Y_X are the same for all that is tried.

use crate::noise::{
    precision::ChannelPrecision,
    random_effects::{Columns, in_parts},
};
use std::sync::Arc;

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::design::{Channel, Design, Normal, Signature, places, reaching};

/// What is fitted in any case, and the residual.
pub struct AugmentedNormal<'a> {
    channels: Vec<Fitted<'a>>,
    size: usize,
}

/// The fitted columns of one channel.
struct Fitted<'a> {
    channel: &'a Channel,
    precision: &'a ChannelPrecision,
    /// X, in parts.
    columns: Vec<DMatrix<f64>>,
    /// Y_Xᵀ: a row a column.
    eliminated: DMatrix<f64>,
    normal: Normal,
    ids: Vec<usize>,
}

impl<'a> AugmentedNormal<'a> {
    /// Some columns of a design, given the precision of each channel.
    pub fn new(design: &'a Design, precisions: &'a [ChannelPrecision], wanted: &[usize]) -> Self {
        let fitted = |(channel, precision): (&'a Channel, &'a ChannelPrecision)| {
            let (from, ids) = places(&channel.ids, wanted);
            let own: Vec<usize> = from.iter().map(|at| channel.ids[*at]).collect();
            let columns = channel.columns(&own);
            let products = precision.effects.cross_products(std::slice::from_ref(&columns));
            let columns = in_parts(&columns, channel.y.len());
            let own = &precision.precision;
            let eliminated = own.eliminated(&products);
            let normal = Normal::within(&own.less(&products, &eliminated), own.log_determinant);
            Fitted { channel, precision, columns, eliminated, normal, ids }
        };
        let channels = design.channels.par_iter().zip(precisions).map(fitted).collect();
        Self { channels, size: wanted.len() }
    }

    /// Normal equations of the columns and, behind them, of further ones.
    pub fn with(&self, further: &[Signature]) -> Normal {
        let parts: Vec<Option<(Normal, Vec<usize>)>> =
            self.channels.par_iter().map(|fitted| fitted.with(self.size, further)).collect();
        let mut sum = Normal::zeros(self.size + further.len());
        for (fitted, part) in self.channels.iter().zip(&parts) {
            match part {
                Some((normal, ids)) => sum.add(normal, ids),
                None => sum.add(&fitted.normal, &fitted.ids),
            }
        }
        sum
    }
}

impl Fitted<'_> {
    /// Augmented by what reaches the channel, and the places of all columns; `None` where nothing does.
    fn with(&self, first: usize, further: &[Signature]) -> Option<(Normal, Vec<usize>)> {
        let more: Vec<(usize, Arc<Vec<f64>>)> =
            reaching(self.channel.kind, self.channel.axis, first, further).collect();
        if more.is_empty() {
            return None;
        }
        let (n, m) = (self.ids.len(), more.len());
        let further: Columns<'_> = more.iter().map(|(_, f)| &f[..]).collect();
        let ChannelPrecision { effects, precision } = self.precision;
        let (products, mut across) = effects.cross_products_with(&further, &self.columns);
        let eliminated = precision.eliminated(&products);
        across.gemm(-1.0, &eliminated, &self.eliminated.transpose(), 1.0);
        let mut normal = Normal { energy: self.normal.energy, ..Normal::zeros(n + m) };
        normal.log_determinant = self.normal.log_determinant;
        normal.information.view_mut((0, 0), (n, n)).copy_from(&self.normal.information);
        normal.information.view_mut((n, n), (m, m)).copy_from(&precision.less(&products, &eliminated));
        normal.information.view_mut((0, n), (n, m)).copy_from(&across.columns(0, n).transpose());
        normal.information.view_mut((n, 0), (m, n)).copy_from(&across.columns(0, n));
        normal.score.rows_mut(0, n).copy_from(&self.normal.score);
        normal.score.rows_mut(n, m).copy_from(&across.column(n));
        let ids = self.ids.iter().copied().chain(more.iter().map(|(id, _)| *id)).collect();
        Some((normal, ids))
    }
}

#[cfg(test)]
mod tests {
    use crate::noise::precision::tests::{DRIFTS, Toy};
    use nalgebra::{DVector, Vector3};

    use super::*;
    use crate::{diagnosis::residual::block::Means, recording::SensorKind};

    const BLOCKS: usize = 5;

    fn column(id: usize) -> impl Fn(usize) -> f64 {
        move |block| (0.3 * (block * (id + 1)) as f64 + id as f64).sin()
    }

    fn channel(axis: usize, ids: Vec<usize>) -> Channel {
        let x = ids.iter().map(|id| Arc::new((0..BLOCKS).map(column(*id)).collect()));
        let x = x.collect();
        let y = DVector::from_fn(BLOCKS, |block, _| column(20 + axis)(block));
        Channel { kind: SensorKind::Acc, axis, ids, x, y }
    }

    #[test]
    fn trial_columns_have_the_normal_equations_of_all_columns_together() {
        let toy = Toy::new(BLOCKS, 1);
        let precisions: Vec<ChannelPrecision> = (0..3).map(|_| toy.precision(&DRIFTS)).collect();
        // The third axis is reached by nothing further, and the second of the two columns reaches the first alone.
        let design = Design {
            columns: Vec::new(),
            size: 3,
            channels: vec![channel(0, vec![0, 1, 2]), channel(1, vec![1]), channel(2, vec![0, 2])],
        };
        let signature = |reach: [f64; 2], id: usize| {
            let value = |block| Vector3::new(reach[0], reach[1], 0.0) * column(id)(block);
            let means: Means = [Some((0..BLOCKS).map(value).collect()), None, None];
            Signature::from(means)
        };
        let further = [signature([1.0, 1.0], 7), signature([1.0, 0.0], 8)];
        let found = AugmentedNormal::new(&design, &precisions, &[0, 2]).with(&further);
        let kept = [0, 2];
        let all = design.extended(&kept, Vec::new(), &further).normal(&precisions, &[0, 1, 2, 3]);
        assert!((found.information - all.information).amax() < 1e-9);
        assert!((found.score - all.score).amax() < 1e-9);
        assert!((found.energy - all.energy).abs() < 1e-9);
        assert!((found.log_determinant - all.log_determinant).abs() < 1e-9);
    }
}
