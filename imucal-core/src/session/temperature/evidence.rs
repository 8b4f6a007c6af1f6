//! Rests of one sensor at their temperatures, as rows of a fit with some terms of temperature.

use heapless::Vec;
use nalgebra::{SVector, Vector3};

use crate::{
    model::{
        Model, RowSink,
        norm::NormModel,
        parameterisation::{ENTRIES, FULL},
        thermal::{BLOCK, ThermalForm, ThermalModel, UNIT, UPPER_TRIANGULAR_LINEAR},
    },
    observation::ShellPoint,
    record::Sensor,
    session::evidence::Used,
    temperature::course,
};

/// Parameters: an upper triangular gain, a bias, and three each of β and s.
pub(super) const P: usize = 15;
pub(super) const FORM: ThermalForm<ENTRIES, P> = UPPER_TRIANGULAR_LINEAR;
pub(super) type Theta = SVector<f32, P>;

/// Bits of the parameters: the gain, the bias' terms, the scale's.
const GAIN: u32 = 0b11_1111;
const BIAS_TERMS: u32 = 0b111 << 9;
const SCALE_TERMS: u32 = 0b111 << 12;

/// Terms that are estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Groups(u8);

impl Groups {
    pub(super) const NONE: Self = Self(0);
    pub(super) const BIAS: Self = Self(1);
    pub(super) const SCALE: Self = Self(2);

    pub(super) fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    pub(super) fn has(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    pub(super) fn count(self) -> usize {
        (self.0.count_ones() as usize).saturating_mul(3)
    }
}

/// What the terms follow, and which rests are fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// The temperature, of all rests.
    Whole,
    /// The order of the rests in place of their temperature.
    Order,
    /// The temperature, of all rests but those of one block.
    Without(u8),
    /// Those of one block alone.
    Block(u8),
    /// One alone.
    Rest(usize),
}

/// Rests of one sensor.
#[derive(Clone, Debug)]
pub(super) struct Evidence<const N: usize> {
    pub(super) sensor: Sensor,
    /// Local gravity, m/s².
    pub(super) norm: f32,
    /// θ₀, °C, and the lowest temperature.
    pub(super) reference: f32,
    pub(super) least: f32,
    /// Means, nominal SI; their δ, and their place in the order, −1 to 1.
    pub(super) means: Vec<Vector3<f32>, N>,
    pub(super) changes: Vec<f32, N>,
    pub(super) order: Vec<f32, N>,
    pub(super) used: Used,
}

/// The mean of one rest.
#[derive(Clone, Copy, Debug)]
pub(super) struct RestMean {
    sensor: Sensor,
    norm: f32,
    mean: Vector3<f32>,
}

impl Model<f32, ENTRIES> for RestMean {
    fn rows<S: RowSink<f32, ENTRIES>>(&self, theta: &SVector<f32, ENTRIES>, sink: &mut S) {
        if self.sensor == Sensor::Accelerometer {
            let point = ShellPoint::new(self.mean);
            let points = core::slice::from_ref(&point);
            return NormModel { points, norm: self.norm, form: FULL }.rows(theta, sink);
        }
        for (axis, rate) in self.mean.iter().enumerate() {
            let mut row = SVector::<f32, ENTRIES>::zeros();
            if let (Some(bias), Some(slot)) = (theta.get(9 + axis), row.get_mut(9 + axis)) {
                *slot = 1.0;
                sink.row(bias - rate, &row);
            }
        }
    }

    fn independent_rows(&self) -> usize {
        if self.sensor == Sensor::Accelerometer { 1 } else { 3 }
    }
}

impl<const N: usize> Evidence<N> {
    /// Terms that rests can show.
    pub(super) fn offered(&self) -> Groups {
        let bias = Groups::BIAS;
        if self.sensor == Sensor::Accelerometer { bias.and(Groups::SCALE) } else { bias }
    }

    /// Lowest and highest temperature of the rests that are used, °C.
    pub(super) fn span(&self) -> (f32, f32) {
        let mut used: Vec<f32, N> = Vec::new();
        let seen = self.changes.iter().enumerate().filter(|(at, _)| self.used.has(*at));
        for (_, change) in seen {
            let _room = used.push(self.reference + change * UNIT as f32);
        }
        course::span(&used)
    }

    /// Parameters that are estimated with some terms.
    pub(super) fn parameters(&self, groups: Groups) -> usize {
        let triad = if self.sensor == Sensor::Accelerometer { 9 } else { 3 };
        groups.count().saturating_add(triad)
    }

    /// Residuals of all rests that are used.
    pub(super) fn rows(&self) -> usize {
        let each = if self.sensor == Sensor::Accelerometer { 1 } else { 3 };
        self.used.count(self.means.len()).saturating_mul(each)
    }

    fn block(&self, at: usize) -> u8 {
        let change = self.changes.get(at).copied().unwrap_or(0.0);
        ((change * UNIT as f32 + self.reference - self.least) / BLOCK as f32) as u8
    }

    /// Blocks of temperatures, up to the last.
    pub(super) fn blocks(&self) -> u8 {
        (0..self.means.len()).map(|at| self.block(at)).max().map_or(0, |last| last.saturating_add(1))
    }

    /// Rests of a block that are used.
    pub(super) fn in_block(&self, block: u8) -> usize {
        (0..self.means.len()).filter(|at| self.takes(*at, Part::Block(block))).count()
    }

    fn takes(&self, at: usize, part: Part) -> bool {
        let within = match part {
            Part::Whole | Part::Order => true,
            Part::Without(block) => self.block(at) != block,
            Part::Block(block) => self.block(at) == block,
            Part::Rest(rest) => at == rest,
        };
        within && self.used.has(at)
    }

    /// The rows of some rests with some terms.
    pub(super) fn model(
        &self,
        groups: Groups,
        part: Part,
    ) -> ThermalModel<'_, f32, impl Fn(usize) -> Option<RestMean> + '_, ENTRIES, P> {
        let changes = if part == Part::Order { &self.order } else { &self.changes };
        let mut held = if self.sensor == Sensor::Accelerometer { 0 } else { GAIN };
        for (group, terms) in [(Groups::BIAS, BIAS_TERMS), (Groups::SCALE, SCALE_TERMS)] {
            if !groups.has(group) {
                held |= terms;
            }
        }
        let of = move |at: usize| {
            let mean = *self.means.get(at).filter(|_| self.takes(at, part))?;
            Some(RestMean { sensor: self.sensor, norm: self.norm, mean })
        };
        ThermalModel { changes, of, form: FORM, held }
    }
}
