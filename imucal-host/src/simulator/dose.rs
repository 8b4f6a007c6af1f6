//! An effect with its parameters, ready to be put into the chain.

use super::random::{Purpose, Random};
use crate::effect::{Effect, Parameter, Role};

/// An effect and how much of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Dose {
    /// The effect.
    pub effect: &'static Effect,
    /// Its parameters, in the order of [`Effect::parameters`].
    pub values: Vec<f64>,
}

impl Dose {
    /// Whether it changes anything.
    pub fn acts(&self) -> bool {
        !self.effect.is_off(&self.values)
    }

    /// The same effect at no size, its shape as it is.
    #[must_use]
    pub fn without_amplitudes(&self) -> Self {
        let mut values = self.values.clone();
        self.effect.amplitudes().for_each(|at| values[at] = 0.0);
        Self { effect: self.effect, values }
    }

    /// An effect of a size, in multiples of its usual one, in a run of `duration` s.
    ///
    /// - A single amplitude is size × prior scale; one that cannot be negative takes the size without its sign.
    /// - Several amplitudes point in a direction drawn from the seed, their root mean square size × prior scale.
    /// - A shape is drawn from 0.7 to 1.4 of its usual value, a detail is zero, an instant within 5 % of the run about its usual one.
    /// - A choice is the size itself, rounded.
    ///
    /// All stay within their plausible range. The draw depends on seed and id alone, not on other effects.
    pub fn sized(effect: &'static Effect, size: f64, seed: u64, duration: f64) -> Self {
        let mut random = Random::new(seed ^ fingerprint(&effect.id), Purpose::Effect);
        let count = effect.parameters.iter().filter(|p| p.role == Role::Amplitude).count();
        let direction: Vec<f64> = match count {
            0 => Vec::new(),
            1 => vec![1.0],
            _ => direction(count, &mut random),
        };
        let mut direction = direction.into_iter();
        let values = effect.parameters.iter().map(|parameter| {
            let value = match parameter.role {
                Role::Amplitude => amplitude(parameter, size, direction.next().unwrap_or(1.0)),
                Role::Choice => size.round(),
                Role::Detail { .. } => 0.0,
                Role::Shape { usual } => usual * random.between(0.7, 1.4),
                Role::Instant { share } => duration * (share + random.between(-0.05, 0.05)),
            };
            value.clamp(parameter.range.0, parameter.range.1)
        });
        Self { effect, values: values.collect() }
    }
}

fn amplitude(parameter: &Parameter, size: f64, direction: f64) -> f64 {
    let signed = size * direction * parameter.prior_scale;
    if parameter.range.0 >= 0.0 { signed.abs() } else { signed }
}

/// Uniform on the sphere, with a root mean square of one.
fn direction(count: usize, random: &mut Random) -> Vec<f64> {
    let draws: Vec<f64> = (0..count).map(|_| random.normal()).collect();
    let square: f64 = draws.iter().map(|draw| draw * draw).sum();
    let factor = libm::sqrt(count as f64 / square);
    draws.iter().map(|draw| draw * factor).collect()
}

/// FNV-1a (Fowler, Noll, Vo) of an id, so that each effect has its own direction.
fn fingerprint(id: &str) -> u64 {
    id.bytes()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::{CATALOGUE, find};

    #[test]
    fn a_size_is_the_root_mean_square_in_prior_scales() {
        let effect = find("mag.gimbal_hard_iron_outer").unwrap();
        let dose = Dose::sized(effect, 3.0, 9, 100.0);
        let square: f64 =
            dose.values.iter().zip(&effect.parameters).map(|(v, p)| (v / p.prior_scale).powi(2)).sum();
        assert!(((square / 3.0).sqrt() - 3.0).abs() < 1e-12);
        assert_eq!(Dose::sized(effect, 3.0, 9, 100.0).values, dose.values);
        assert_ne!(Dose::sized(effect, 3.0, 8, 100.0).values, dose.values);
    }

    #[test]
    fn at_size_zero_every_effect_is_off_and_at_one_it_is_on_and_plausible() {
        for effect in CATALOGUE.iter() {
            assert!(effect.is_off(&Dose::sized(effect, 0.0, 1, 300.0).values), "{}", effect.id);
            let on = Dose::sized(effect, 1.0, 1, 300.0);
            assert!(!effect.is_off(&on.values), "{}", effect.id);
            for (value, p) in on.values.iter().zip(&effect.parameters) {
                assert!((p.range.0..=p.range.1).contains(value), "{}: {}", effect.id, p.name);
            }
        }
    }
}
