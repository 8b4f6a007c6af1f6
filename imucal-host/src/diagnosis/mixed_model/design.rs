//! Signatures as columns, channel by channel, and the normal equations of any covariance.
//!
//! A channel is one axis of one sensor. Columns are in usual sizes of their parameters, so that one means usual.

use std::{borrow::Borrow, sync::Arc};

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Vector3};
use rayon::prelude::*;

use super::{
    random_effects::{CrossProducts, RandomEffects, Sparse},
    whitening::Whitening,
};
use crate::{
    diagnosis::residual::{block::Means, forward_model::ForwardModel},
    effect::Effect,
    recording::SensorKind,
};

/// Standard deviation of a fitted column's prior, in usual sizes: it keeps an inverse finite, and no more.
pub const LOOSE: f64 = 1e4;

/// Share of a column's information that sums over blocks and channels round away at most, many times over.
const ROUNDED: f64 = 1e-12;

/// What a column stands for.
#[derive(Clone, Copy, Debug)]
pub struct Column {
    /// The effect.
    pub effect: &'static Effect,
    /// Index of its parameter.
    pub parameter: usize,
}

impl Column {
    /// It belongs to this effect.
    pub fn is_of(&self, effect: &Effect) -> bool {
        self.effect == effect
    }
}

/// One axis of one sensor: its residual and the columns that reach it.
#[derive(Clone, Debug)]
pub struct Channel {
    /// Sensor.
    pub kind: SensorKind,
    /// Axis, 0 to 2.
    pub axis: usize,
    /// Indices of the columns that are not zero here.
    pub ids: Vec<usize>,
    /// Those columns, a row a block.
    pub x: DMatrix<f64>,
    /// Residual of each block.
    pub y: DVector<f64>,
}

/// All channels.
#[derive(Clone, Debug)]
pub struct Design {
    /// What the first columns stand for; those behind them belong to no effect.
    pub columns: Vec<Column>,
    /// Number of columns.
    pub size: usize,
    /// The channels, sensor by sensor.
    pub channels: Vec<Channel>,
}

/// All channels, as white noise weighs them: what is the same whatever the drift and the scatter.
#[derive(Clone, Debug)]
pub struct DesignProducts {
    /// The channels, sensor by sensor.
    pub channels: Vec<ChannelProducts>,
}

/// One axis of one sensor.
#[derive(Clone, Debug)]
pub struct ChannelProducts {
    /// Sensor.
    pub kind: SensorKind,
    ids: Vec<usize>,
    /// Its columns and, last, its residual.
    pub columns: CrossProducts,
}

/// Normal equations: Jᵀ Σ⁻¹ J, Jᵀ Σ⁻¹ r, rᵀ Σ⁻¹ r and ln |Σ|, summed over channels.
#[derive(Clone, Debug)]
pub struct Normal {
    /// Jᵀ Σ⁻¹ J.
    pub information: DMatrix<f64>,
    /// Jᵀ Σ⁻¹ r.
    pub score: DVector<f64>,
    /// rᵀ Σ⁻¹ r.
    pub energy: f64,
    /// ln |Σ|.
    pub log_determinant: f64,
}

impl Normal {
    /// Of `size` columns, before any channel.
    pub fn zeros(size: usize) -> Self {
        Self {
            information: DMatrix::zeros(size, size),
            score: DVector::zeros(size),
            energy: 0.0,
            log_determinant: 0.0,
        }
    }

    /// The likeliest amounts of all columns, usual sizes; `None` where the information is not that of real columns.
    pub fn amounts(&self) -> Option<DVector<f64>> {
        Some(loosened(self.information.clone())?.solve(&self.score))
    }

    /// Of condensed columns, the last being the residual.
    fn of(columns: &CrossProducts, whitening: &Whitening) -> Self {
        Self::within(&whitening.products(columns), whitening)
    }

    /// Of the products of columns, the last being the residual.
    pub fn within(all: &DMatrix<f64>, whitening: &Whitening) -> Self {
        let n = all.ncols() - 1;
        Self {
            information: all.view((0, 0), (n, n)).into_owned(),
            score: all.view((0, n), (n, 1)).column(0).into_owned(),
            energy: all[(n, n)],
            log_determinant: whitening.log_determinant,
        }
    }

    /// Adds a channel's; `ids` tells where its columns stand.
    pub fn add(&mut self, part: &Self, ids: &[usize]) {
        for (i, row) in ids.iter().enumerate() {
            self.score[*row] += part.score[i];
            for (j, column) in ids.iter().enumerate() {
                self.information[(*row, *column)] += part.information[(i, j)];
            }
        }
        self.energy += part.energy;
        self.log_determinant += part.log_determinant;
    }
}

/// The factor of an information matrix with loose priors added, and with what rounding may have taken of it; `None` where it
/// is not that of real columns.
pub fn loosened(mut information: DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
    for i in 0..information.nrows() {
        information[(i, i)] += 1.0 / (LOOSE * LOOSE) + ROUNDED * information[(i, i)];
    }
    information.cholesky()
}

impl Channel {
    /// Its residual less the columns `fitted`, by index, times their amounts.
    pub fn less(&self, fitted: &[usize], amounts: &DVector<f64>) -> DVector<f64> {
        let mut residual = self.y.clone();
        for (id, amount) in fitted.iter().zip(amounts.iter()) {
            if let Some(at) = self.ids.iter().position(|own| own == id) {
                residual.axpy(-amount, &self.x.column(at), 1.0);
            }
        }
        residual
    }

    /// Some of its columns, by their place in `ids`, and behind them its residual.
    pub fn gathered(&self, places: &[usize]) -> DMatrix<f64> {
        let mut x = DMatrix::zeros(self.y.len(), places.len() + 1);
        for (to, from) in places.iter().enumerate() {
            x.set_column(to, &self.x.column(*from));
        }
        x.set_column(places.len(), &self.y);
        x
    }

    /// All of its columns, and behind them its residual.
    fn all(&self) -> DMatrix<f64> {
        self.gathered(&(0..self.ids.len()).collect::<Vec<_>>())
    }
}

impl Design {
    /// Channels of the sensors that are there, with columns and a residual.
    pub fn new(
        scene: &ForwardModel<'_>,
        columns: Vec<Column>,
        signatures: &[impl Borrow<Means> + Sync],
        residual: &Means,
    ) -> Self {
        let places: Vec<(SensorKind, usize)> =
            scene.kinds.iter().flat_map(|kind| (0..3).map(move |axis| (*kind, axis))).collect();
        let channels = places
            .into_par_iter()
            .map(|(kind, axis)| channel(kind, axis, scene.blocks.len(), signatures, residual))
            .collect();
        Self { size: columns.len(), columns, channels }
    }

    /// A residual without columns.
    pub fn of_residual(scene: &ForwardModel<'_>, residual: &Means) -> Self {
        Self::new(scene, Vec::new(), &[] as &[Means], residual)
    }

    /// Some of its columns, by index, and further ones behind them; `columns` names the first of these.
    pub fn extended(
        &self,
        kept: &[usize],
        columns: Vec<Column>,
        further: &[impl Borrow<Means> + Sync],
    ) -> Self {
        let channels = self
            .channels
            .par_iter()
            .map(|channel| {
                let (mut ids, mut data) = (Vec::new(), Vec::new());
                for (to, from) in kept.iter().enumerate() {
                    if let Some(at) = channel.ids.iter().position(|id| id == from) {
                        ids.push(to);
                        data.extend_from_slice(channel.x.column(at).as_slice());
                    }
                }
                append(channel.kind, channel.axis, kept.len(), further, &mut ids, &mut data);
                let x = DMatrix::from_vec(channel.y.len(), ids.len(), data);
                Channel { kind: channel.kind, axis: channel.axis, ids, x, y: channel.y.clone() }
            })
            .collect();
        Self { columns, size: kept.len() + further.len(), channels }
    }

    /// With another residual.
    #[must_use]
    pub fn leaving(mut self, residual: &Means) -> Self {
        for channel in &mut self.channels {
            if let Some(values) = along(residual, channel.kind, channel.axis) {
                channel.y = DVector::from_vec(values);
            }
        }
        self
    }

    /// With the residual as it would be without some effects: their columns times `amplitudes` added, usual sizes.
    pub fn restore(&mut self, amplitudes: &[(usize, f64)]) {
        for channel in &mut self.channels {
            for (id, amplitude) in amplitudes {
                if let Some(at) = channel.ids.iter().position(|own| own == id) {
                    channel.y.axpy(*amplitude, &channel.x.column(at), 1.0);
                }
            }
        }
    }

    /// Indices of an effect's columns.
    pub fn of(&self, effect: &Effect) -> Vec<usize> {
        (0..self.columns.len()).filter(|index| self.columns[*index].is_of(effect)).collect()
    }

    /// Normal equations of some columns, given each channel's whitening.
    pub fn normal(&self, whitenings: &[Whitening], wanted: &[usize]) -> Normal {
        let part = |(channel, whitening): (&Channel, &Whitening)| {
            let (from, ids) = places(&channel.ids, wanted);
            let columns = whitening.latents().condensed(&channel.gathered(&from));
            (Normal::of(&columns, whitening), ids)
        };
        let parts: Vec<(Normal, Vec<usize>)> = self.channels.par_iter().zip(whitenings).map(part).collect();
        let mut normal = Normal::zeros(wanted.len());
        parts.iter().for_each(|(part, ids)| normal.add(part, ids));
        normal
    }

    /// All columns and before them `count` sparse ones, which a channel may have, given what its blocks have in common.
    pub fn condensed_beside(
        &self,
        latents: &(dyn Fn(&Channel) -> RandomEffects + Sync),
        sparse: &(dyn Fn(&Channel) -> Sparse + Sync),
        count: usize,
    ) -> DesignProducts {
        let channels = self.channels.par_iter().map(|channel| {
            let sparse = sparse(channel);
            let columns = Arc::new(latents(channel)).condensed_beside(&sparse, &channel.all());
            let ids = (0..sparse.count).chain(channel.ids.iter().map(|id| count + id)).collect();
            ChannelProducts { kind: channel.kind, ids, columns }
        });
        DesignProducts { channels: channels.collect() }
    }

    /// All columns, given what the blocks of a channel have in common.
    pub fn condensed(&self, latents: &(dyn Fn(&Channel) -> RandomEffects + Sync)) -> DesignProducts {
        let channels = self.channels.par_iter().map(|channel| {
            let columns = Arc::new(latents(channel)).condensed(&channel.all());
            ChannelProducts { kind: channel.kind, ids: channel.ids.clone(), columns }
        });
        DesignProducts { channels: channels.collect() }
    }
}

impl DesignProducts {
    /// Some columns, and the residual; those that are not named are out of reach. Of one sensor, or all of them.
    pub fn picked(&self, kind: Option<SensorKind>, wanted: &[usize]) -> Self {
        let channels = self.channels.iter().filter(|channel| kind.is_none_or(|kind| channel.kind == kind));
        let picked = channels.map(|channel| {
            let (mut from, ids) = places(&channel.ids, wanted);
            from.push(channel.ids.len());
            ChannelProducts { kind: channel.kind, ids, columns: channel.columns.picked(&from) }
        });
        Self { channels: picked.collect() }
    }

    /// With the channels of another that are of sensors it has none of.
    pub fn beside(mut self, other: Self) -> Self {
        let has = |channel: &ChannelProducts| self.channels.iter().any(|own| own.kind == channel.kind);
        let others: Vec<ChannelProducts> =
            other.channels.into_iter().filter(|channel| !has(channel)).collect();
        self.channels.extend(others);
        self
    }

    /// Normal equations of its columns, of which there are `size`.
    pub fn normal(&self, size: usize, whitening: &(dyn Fn(&ChannelProducts) -> Whitening + Sync)) -> Normal {
        let parts: Vec<Normal> = self
            .channels
            .par_iter()
            .map(|channel| Normal::of(&channel.columns, &whitening(channel)))
            .collect();
        self.sum(size, &parts)
    }

    /// Normal equations of all channels, of so many columns, from those of each.
    pub fn sum(&self, size: usize, parts: &[Normal]) -> Normal {
        let mut normal = Normal::zeros(size);
        parts.iter().zip(&self.channels).for_each(|(part, channel)| normal.add(part, &channel.ids));
        normal
    }
}

/// Which of a channel's columns are wanted, by their place among `ids`, and the places of these among the wanted.
pub fn places(ids: &[usize], wanted: &[usize]) -> (Vec<usize>, Vec<usize>) {
    let to = |id: &usize| wanted.iter().position(|wanted| wanted == id);
    ids.iter().enumerate().filter_map(|(from, id)| Some((from, to(id)?))).unzip()
}

fn channel(
    kind: SensorKind,
    axis: usize,
    blocks: usize,
    signatures: &[impl Borrow<Means>],
    residual: &Means,
) -> Channel {
    let (mut ids, mut data) = (Vec::new(), Vec::new());
    append(kind, axis, 0, signatures, &mut ids, &mut data);
    let x = DMatrix::from_vec(blocks, ids.len(), data);
    let y = DVector::from_vec(along(residual, kind, axis).unwrap_or_else(|| vec![0.0; blocks]));
    Channel { kind, axis, ids, x, y }
}

/// Appends the signatures that reach a channel; they are numbered from `first` on.
pub fn append(
    kind: SensorKind,
    axis: usize,
    first: usize,
    signatures: &[impl Borrow<Means>],
    ids: &mut Vec<usize>,
    data: &mut Vec<f64>,
) {
    let along = |(id, signature)| {
        let means: &Means = Borrow::borrow(signature);
        let values = means[kind as usize].as_ref()?;
        values.iter().any(|v| v[axis] != 0.0).then_some((first + id, values))
    };
    let reaching: Vec<(usize, &Vec<Vector3<f64>>)> =
        signatures.iter().enumerate().filter_map(along).collect();
    data.reserve(reaching.iter().map(|(_, values)| values.len()).sum());
    for (id, values) in reaching {
        ids.push(id);
        data.extend(values.iter().map(|v| v[axis]));
    }
}

fn along(means: &Means, kind: SensorKind, axis: usize) -> Option<Vec<f64>> {
    let values: &Vec<Vector3<f64>> = means[kind as usize].as_ref()?;
    Some(values.iter().map(|v| v[axis]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_that_are_the_same_but_for_rounding_have_a_factor() {
        let (large, rounded) = (2e7, 1e-7);
        let twins = DMatrix::from_row_slice(2, 2, &[large, large, large, large - rounded]);
        let factor = loosened(twins).expect("of real columns");
        // Together they are told as well as one of them alone.
        let sum = factor.solve(&DVector::from_element(2, large)).sum();
        assert!((sum - 1.0).abs() < 1e-9, "{sum}");
        assert!(loosened(DMatrix::from_diagonal_element(1, 1, -1.0)).is_none());
    }
}
