//! Signatures as columns, channel by channel, and the normal equations of any covariance.
//!
//! A channel is one axis of one sensor. Columns are in usual sizes of their parameters, so that one means usual.

use crate::noise::{
    precision::{ChannelPrecision, Precision},
    random_effects::{Columns, CrossProducts, RandomEffects},
};
use std::sync::Arc;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Vector3};
use rayon::prelude::*;

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

/// What a usual size of one parameter changes, block by block, by sensor and axis; none where it changes nothing.
#[derive(Clone, Debug)]
pub struct Signature([[Option<Arc<Vec<f64>>>; 3]; 3]);

impl From<Means> for Signature {
    fn from(means: Means) -> Self {
        Self(means.map(|values| {
            std::array::from_fn(|axis| {
                let values = values.as_ref()?;
                let reaches = values.iter().any(|value| value[axis] != 0.0);
                reaches.then(|| Arc::new(values.iter().map(|value| value[axis]).collect()))
            })
        }))
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
    /// Those columns, block by block; designs about the same fit share them.
    pub x: Vec<Arc<Vec<f64>>>,
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

/// Channels that share random effects.
#[derive(Clone, Debug)]
pub struct ChannelGroup {
    /// Places of the channels in the design, in the order of the random effects' own.
    pub channels: Vec<usize>,
    /// What their blocks share.
    pub effects: Arc<RandomEffects>,
}

/// Cross-products of columns, group by group: what is the same whatever the drift and the scatter.
#[derive(Clone, Debug)]
pub struct DesignProducts {
    /// The groups.
    pub groups: Vec<GroupProducts>,
}

/// Cross-products of the columns that reach a group of channels.
#[derive(Clone, Debug)]
pub struct GroupProducts {
    /// Sensors, channel by channel.
    pub kinds: Vec<SensorKind>,
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

    /// Of columns, the last being the residual.
    pub fn of(columns: &CrossProducts, precision: &Precision) -> Self {
        Self::within(&precision.products(columns), precision.log_determinant)
    }

    /// Of the products of columns, the last being the residual, and ln |Σ|.
    pub fn within(all: &DMatrix<f64>, log_determinant: f64) -> Self {
        let n = all.ncols() - 1;
        Self {
            information: all.view((0, 0), (n, n)).into_owned(),
            score: all.view((0, n), (n, 1)).column(0).into_owned(),
            energy: all[(n, n)],
            log_determinant,
        }
    }

    /// Adds a channel's; `ids` are the places of its columns.
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
                residual.iter_mut().zip(self.x[at].iter()).for_each(|(left, x)| *left -= amount * x);
            }
        }
        residual
    }

    /// Columns by index, without a value where they do not reach it, and behind them its residual.
    pub fn columns(&self, wanted: &[usize]) -> Columns<'_> {
        let of = |id: &usize| self.ids.iter().position(|own| own == id).map_or(&[][..], |at| &self.x[at]);
        wanted.iter().map(of).chain([self.y.as_slice()]).collect()
    }
}

impl Design {
    /// Channels of the sensors that are there, with columns and a residual.
    pub fn new(
        scene: &ForwardModel<'_>,
        columns: Vec<Column>,
        signatures: &[Signature],
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
        Self::new(scene, Vec::new(), &[], residual)
    }

    /// Some of its columns, by index, and further ones behind them; `columns` names the first of these.
    pub fn extended(&self, kept: &[usize], columns: Vec<Column>, further: &[Signature]) -> Self {
        let channels = self
            .channels
            .par_iter()
            .map(|channel| {
                let (mut ids, mut x) = (Vec::new(), Vec::new());
                for (to, from) in kept.iter().enumerate() {
                    if let Some(at) = channel.ids.iter().position(|id| id == from) {
                        ids.push(to);
                        x.push(Arc::clone(&channel.x[at]));
                    }
                }
                for (id, column) in reaching(channel.kind, channel.axis, kept.len(), further) {
                    ids.push(id);
                    x.push(column);
                }
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
                    let x = channel.x[at].iter();
                    channel.y.iter_mut().zip(x).for_each(|(y, x)| *y += amplitude * x);
                }
            }
        }
    }

    /// Indices of an effect's columns.
    pub fn of(&self, effect: &Effect) -> Vec<usize> {
        (0..self.columns.len()).filter(|index| self.columns[*index].is_of(effect)).collect()
    }

    /// Normal equations of some columns, given the precision of each channel.
    pub fn normal(&self, precisions: &[ChannelPrecision], wanted: &[usize]) -> Normal {
        let alone = |(at, precision): (usize, &ChannelPrecision)| ChannelGroup {
            channels: vec![at],
            effects: Arc::clone(&precision.effects),
        };
        let groups: Vec<ChannelGroup> = precisions.iter().enumerate().map(alone).collect();
        let products = self.products(&groups, wanted);
        let pairs = products.groups.par_iter().zip(precisions);
        let parts: Vec<Normal> =
            pairs.map(|(group, own)| Normal::of(&group.columns, &own.precision)).collect();
        products.sum(wanted.len(), &parts)
    }

    /// Cross-products of some columns, group by group.
    pub fn products(&self, groups: &[ChannelGroup], wanted: &[usize]) -> DesignProducts {
        let of = |group: &ChannelGroup| {
            let channels = || group.channels.iter().map(|at| &self.channels[*at]);
            let reaches = |at: &usize| channels().any(|channel| channel.ids.contains(&wanted[*at]));
            let ids: Vec<usize> = (0..wanted.len()).filter(reaches).collect();
            let own: Vec<usize> = ids.iter().map(|at| wanted[*at]).collect();
            let x: Vec<Columns<'_>> = channels().map(|channel| channel.columns(&own)).collect();
            let kinds = channels().map(|channel| channel.kind).collect();
            GroupProducts { kinds, ids, columns: group.effects.cross_products(&x) }
        };
        DesignProducts { groups: groups.par_iter().map(of).collect() }
    }
}

impl DesignProducts {
    /// Some columns, and the residual; those that are not named are out of reach. Of groups of one sensor, or all of them.
    pub fn picked(&self, kind: Option<SensorKind>, wanted: &[usize]) -> Self {
        let is_asked = |group: &&GroupProducts| kind.is_none_or(|kind| group.kinds.contains(&kind));
        let picked = self.groups.iter().filter(is_asked).map(|group| {
            let (mut from, ids) = places(&group.ids, wanted);
            from.push(group.ids.len());
            GroupProducts { kinds: group.kinds.clone(), ids, columns: group.columns.picked(&from) }
        });
        Self { groups: picked.collect() }
    }

    /// With the groups of another that are of sensors it has none of.
    pub fn with_others(mut self, other: Self) -> Self {
        let has = |group: &GroupProducts| self.groups.iter().any(|own| own.kinds == group.kinds);
        let others: Vec<GroupProducts> = other.groups.into_iter().filter(|group| !has(group)).collect();
        self.groups.extend(others);
        self
    }

    /// Normal equations of its columns, of which there are `size`.
    pub fn normal(&self, size: usize, precision: &(dyn Fn(&GroupProducts) -> Precision + Sync)) -> Normal {
        let of = |group: &GroupProducts| Normal::of(&group.columns, &precision(group));
        self.sum(size, &self.groups.par_iter().map(of).collect::<Vec<_>>())
    }

    /// Normal equations of all groups, of so many columns, from those of each.
    pub fn sum(&self, size: usize, parts: &[Normal]) -> Normal {
        let mut normal = Normal::zeros(size);
        parts.iter().zip(&self.groups).for_each(|(part, group)| normal.add(part, &group.ids));
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
    signatures: &[Signature],
    residual: &Means,
) -> Channel {
    let (ids, x) = reaching(kind, axis, 0, signatures).unzip();
    let y = DVector::from_vec(along(residual, kind, axis).unwrap_or_else(|| vec![0.0; blocks]));
    Channel { kind, axis, ids, x, y }
}

/// The signatures that reach a channel; they are numbered from `first` on.
pub fn reaching(
    kind: SensorKind,
    axis: usize,
    first: usize,
    signatures: &[Signature],
) -> impl Iterator<Item = (usize, Arc<Vec<f64>>)> {
    signatures.iter().enumerate().filter_map(move |(id, Signature(columns))| {
        Some((first + id, Arc::clone(columns[kind as usize][axis].as_ref()?)))
    })
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
        // Together they are determined as well as one of them alone.
        let sum = factor.solve(&DVector::from_element(2, large)).sum();
        assert!((sum - 1.0).abs() < 1e-9, "{sum}");
        assert!(loosened(DMatrix::from_diagonal_element(1, 1, -1.0)).is_none());
    }
}
