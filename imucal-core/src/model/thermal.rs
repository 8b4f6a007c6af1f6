//! Any model of a triad, of a triad that follows the temperature: each observation at the triad of its own temperature.
//!
//! ```text
//! δ = (θ − θ₀) / 10 K
//! f = 1 + s δ + s₂ δ²
//! gain(θ) = f ∘ gain,   K(θ) = K / f,   bias(θ) = b + β δ + β₂ δ²
//! ```
//!
//! | symbol | meaning | unit |
//! | --- | --- | --- |
//! | θ, θ₀ | temperature of an observation, and that at which gain and bias hold | °C |
//! | β, β₂ | growth of the bias, sensor axes | raw unit per 10 K, per (10 K)² |
//! | s, s₂ | growth of the scale, calibrated axes | per 10 K, per (10 K)² |
//! | f ∘, / f | rows of the gain times, columns of K = gain⁻¹ over the axis' factor | – |
//!
//! The terms are those of [`crate::temperature`]. Ten kelvin as their unit keep the columns of the Jacobian of one size
//! where a calibration spans tens of kelvin, which is what `f32` needs. The derivatives follow from those of the model by
//! the chain rule, so that every model has one formula for what warmth does to it.
//!
//! Not modelled: drift of the axes' directions, hysteresis, a lag between the thermometer and the sensing element.

use nalgebra::{SVector, Vector3};

use super::{Model, RowSink, parameterisation::ENTRIES};
use crate::{scalar::Scalar, solver::gauge::bit, temperature::TemperatureTerms};

/// The unit of δ, K.
pub const UNIT: f64 = 10.0;
/// Width of a block of temperatures that is held out to see whether terms predict it, K.
pub const BLOCK: f64 = 5.0;
/// Terms of temperature: three each of β, s, β₂ and s₂.
pub const THERMAL: usize = 12;

/// What a model's first nine parameters are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The gain, by rows: norms, turns, motions.
    Gain,
    /// Its inverse K, by rows: the unified model.
    Sensitivity,
}

/// Which parameters are estimated: those of a model of `S`, of which the first twelve are a triad's, then β, s, β₂, s₂.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ThermalForm<const S: usize, const P: usize> {
    entries: [u8; P],
    side: Side,
}

/// T9 with β and s: what rests in many poses at several temperatures determine.
pub const UPPER_TRIANGULAR_LINEAR: ThermalForm<ENTRIES, 15> =
    ThermalForm::new([0, 1, 2, 4, 5, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17], Side::Gain);

impl<const S: usize, const P: usize> ThermalForm<S, P> {
    /// Parameters by index: those of the model below `S`, then [`THERMAL`] terms. Others are never estimated.
    pub const fn new(entries: [u8; P], side: Side) -> Self {
        Self { entries, side }
    }

    /// Index of each parameter.
    pub fn entries(&self) -> &[u8; P] {
        &self.entries
    }

    /// The parameters of a triad and further ones of its model, without any terms of temperature.
    pub fn theta<T: Scalar>(&self, cold: &SVector<T, S>) -> SVector<T, P> {
        let mut theta = SVector::<T, P>::zeros();
        for (slot, entry) in theta.iter_mut().zip(&self.entries) {
            if let Some(value) = cold.get(usize::from(*entry)) {
                *slot = *value;
            }
        }
        theta
    }

    /// The model's parameters at the reference temperature; zero where one is not estimated.
    pub fn cold<T: Scalar>(&self, theta: &SVector<T, P>) -> SVector<T, S> {
        let mut cold = SVector::<T, S>::zeros();
        for (entry, value) in self.entries.iter().zip(theta.iter()) {
            if let Some(slot) = cold.get_mut(usize::from(*entry)) {
                *slot = *value;
            }
        }
        cold
    }

    /// β, s, β₂ and s₂; zero where they are not estimated.
    fn warmth<T: Scalar>(&self, theta: &SVector<T, P>) -> [Vector3<T>; 4] {
        let mut terms = [Vector3::zeros(); 4];
        for (entry, value) in self.entries.iter().zip(theta.iter()) {
            let Some(term) = usize::from(*entry).checked_sub(S) else { continue };
            if let Some(slot) = terms.get_mut(term / 3).and_then(|term_of| term_of.get_mut(term % 3)) {
                *slot = *value;
            }
        }
        terms
    }

    /// The linear terms as a record has them, `reference` in °C; of standard errors those of the terms.
    pub fn terms<T: Scalar>(&self, theta: &SVector<T, P>, reference: T) -> TemperatureTerms<T> {
        let [beta, s, _, _] = self.warmth(theta);
        let per = T::of(1.0 / UNIT);
        TemperatureTerms { reference, bias_slope: (beta * per).into(), scale_slope: (s * per).into() }
    }
}

/// Observations of a model, each at its temperature.
#[derive(Clone, Copy, Debug)]
pub struct ThermalModel<'a, T, F, const S: usize, const P: usize> {
    /// δ of each observation.
    pub changes: &'a [T],
    /// The model of one of them alone.
    pub of: F,
    /// What is estimated.
    pub form: ThermalForm<S, P>,
    /// Bit k set: parameter k is held at zero.
    pub held: u32,
}

/// A triad's parameters at one temperature, and how they follow from those at the reference.
struct Warm<T: Scalar, const S: usize> {
    cold: SVector<T, S>,
    factor: Vector3<T>,
    change: T,
}

impl<T: Scalar, const S: usize> Warm<T, S> {
    fn new(cold: &SVector<T, S>, [_, s, _, s2]: &[Vector3<T>; 4], change: T) -> Self {
        let factor = s.zip_map(s2, |s, s2| T::one() + (s + s2 * change) * change);
        Self { cold: *cold, factor, change }
    }

    /// The model's parameters at this temperature.
    fn theta(&self, side: Side, [beta, _, beta2, _]: &[Vector3<T>; 4]) -> SVector<T, S> {
        let mut theta = self.cold;
        let drift = beta.zip_map(beta2, |b, b2| (b + b2 * self.change) * self.change);
        for (entry, value) in theta.iter_mut().enumerate() {
            match (side, entry) {
                (Side::Gain, 0..9) => *value *= self.along(entry / 3),
                (Side::Sensitivity, 0..9) => *value /= self.along(entry % 3),
                (_, 9..12) => *value += drift.get(entry - 9).copied().unwrap_or_else(T::zero),
                _ => {}
            }
        }
        theta
    }

    fn along(&self, axis: usize) -> T {
        self.factor.get(axis).copied().unwrap_or_else(T::one)
    }

    /// Derivative by one parameter, of those of the model at this temperature.
    fn chain(&self, side: Side, by: &SVector<T, S>, entry: usize) -> T {
        let at = |k: usize| by.get(k).copied().unwrap_or_else(T::zero);
        let Some(term) = entry.checked_sub(S) else {
            return match (side, entry) {
                (Side::Gain, 0..9) => at(entry) * self.along(entry / 3),
                (Side::Sensitivity, 0..9) => at(entry) / self.along(entry % 3),
                _ => at(entry),
            };
        };
        let axis = term % 3;
        let power = if term < 6 { self.change } else { self.change * self.change };
        match term / 3 {
            0 | 2 => at(9 + axis) * power,
            1 | 3 => self.by_factor(side, by, axis) * power,
            _ => T::zero(),
        }
    }

    /// Derivative by an axis' factor.
    fn by_factor(&self, side: Side, by: &SVector<T, S>, axis: usize) -> T {
        let mut sum = T::zero();
        for k in 0..3 {
            let entry = if side == Side::Gain { 3 * axis + k } else { 3 * k + axis };
            if let (Some(slope), Some(value)) = (by.get(entry), self.cold.get(entry)) {
                sum += *slope * *value;
            }
        }
        let factor = self.along(axis);
        if side == Side::Gain { sum } else { -sum / (factor * factor) }
    }
}

/// Passes a model's rows on as those of the parameters.
struct Chained<'a, K, T: Scalar, const S: usize, const P: usize> {
    sink: &'a mut K,
    form: &'a ThermalForm<S, P>,
    held: u32,
    warm: Warm<T, S>,
}

impl<T: Scalar, K: RowSink<T, P>, const S: usize, const P: usize> RowSink<T, S> for Chained<'_, K, T, S, P> {
    const JACOBIAN: bool = K::JACOBIAN;

    fn row(&mut self, residual: T, jacobian: &SVector<T, S>) {
        let mut row = SVector::<T, P>::zeros();
        if K::JACOBIAN {
            for (k, (slot, entry)) in row.iter_mut().zip(&self.form.entries).enumerate() {
                if self.held & bit(k) == 0 {
                    *slot = self.warm.chain(self.form.side, jacobian, usize::from(*entry));
                }
            }
        }
        self.sink.row(residual, &row);
    }
}

impl<T: Scalar, M: Model<T, S>, F: Fn(usize) -> Option<M>, const S: usize, const P: usize> Model<T, P>
    for ThermalModel<'_, T, F, S, P>
{
    #[inline(never)]
    fn rows<K: RowSink<T, P>>(&self, theta: &SVector<T, P>, sink: &mut K) {
        let mut free = *theta;
        for (k, value) in free.iter_mut().enumerate() {
            if self.held & bit(k) != 0 {
                *value = T::zero();
            }
        }
        let (cold, terms) = (self.form.cold(&free), self.form.warmth(&free));
        for (index, change) in self.changes.iter().enumerate() {
            let Some(model) = (self.of)(index) else { continue };
            let warm = Warm::new(&cold, &terms, *change);
            let at = warm.theta(self.form.side, &terms);
            model.rows(&at, &mut Chained { sink, form: &self.form, held: self.held, warm });
        }
        for (k, value) in theta.iter().enumerate() {
            if self.held & bit(k) != 0 {
                let mut row = SVector::<T, P>::zeros();
                if let Some(entry) = row.get_mut(k) {
                    *entry = T::one();
                }
                sink.row(*value, &row);
            }
        }
    }

    fn independent_rows(&self) -> usize {
        let of_one = |index| (self.of)(index).map_or(0, |model: M| model.independent_rows());
        let of_all = (0..self.changes.len()).map(of_one).fold(0usize, usize::saturating_add);
        of_all.saturating_add((0..P).filter(|k| self.held & bit(*k) != 0).count())
    }
}

#[cfg(test)]
mod tests;
