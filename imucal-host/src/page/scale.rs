//! Values along an axis of a drawing, and its ticks.

/// Ticks that fit an axis.
const TICKS: usize = 5;

/// An axis: which values it reaches, and how they lie along it.
#[derive(Clone, Debug, PartialEq)]
pub struct Scale {
    from: f64,
    to: f64,
    logarithmic: bool,
    /// Power of ten that labels are multiples of.
    exponent: i32,
}

/// A tick: where it stands, as a share of the axis, and its label.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// 0 at the beginning, 1 at the end.
    pub at: f64,
    /// Text.
    pub label: String,
}

impl Scale {
    /// Reaches all finite values, with a margin; with no value or one, a span around it.
    #[must_use]
    pub fn linear(values: impl IntoIterator<Item = f64>) -> Self {
        let (low, high) = ends(values).unwrap_or((0.0, 1.0));
        let margin = match high - low {
            span if span > 0.0 => 0.05 * span,
            _ if low != 0.0 => 0.1 * low.abs(),
            _ => 1.0,
        };
        Self::between(low - margin, high + margin)
    }

    /// From one value to another, without a margin.
    #[must_use]
    pub fn between(from: f64, to: f64) -> Self {
        let most = from.abs().max(to.abs());
        let decade = if most > 0.0 { most.log10().floor() as i32 } else { 0 };
        // Multiples of a thousand, as prefixes of units are.
        let exponent = if (-2..4).contains(&decade) { 0 } else { 3 * decade.div_euclid(3) };
        Self { from, to, logarithmic: false, exponent }
    }

    /// Reaches all finite values above zero, by their logarithm.
    #[must_use]
    pub fn logarithmic(values: impl IntoIterator<Item = f64>) -> Self {
        let positive = values.into_iter().filter(|value| *value > 0.0);
        let (low, high) = ends(positive).unwrap_or((1.0, 10.0));
        Self { from: low.log10() - 0.06, to: high.log10() + 0.06, logarithmic: true, exponent: 0 }
    }

    /// Where a value lies, 0 to 1 within the axis; `None` where it has no place on it.
    #[must_use]
    pub fn share(&self, value: f64) -> Option<f64> {
        let value = if self.logarithmic { value.log10() } else { value };
        let share = (value - self.from) / (self.to - self.from);
        share.is_finite().then_some(share)
    }

    /// What stands before a unit where labels are multiples of a power of ten: `10⁻³ `.
    #[must_use]
    pub fn factor(&self) -> String {
        if self.exponent == 0 { String::new() } else { format!("{} ", power(self.exponent)) }
    }

    /// At most a handful of ticks, or one a decade or a few decades.
    #[must_use]
    pub fn ticks(&self) -> Vec<Tick> {
        if self.logarithmic { self.decades() } else { self.steps() }
    }

    fn steps(&self) -> Vec<Tick> {
        let span = self.to - self.from;
        let raw = span / TICKS as f64;
        if !raw.is_finite() || raw <= 0.0 {
            return Vec::new();
        }
        let decade = 10f64.powf(raw.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * decade).find(|step| *step >= raw);
        let step = step.unwrap_or(10.0 * decade);
        let unit = 10f64.powi(self.exponent);
        let decimals = (-(step / unit * (1.0 + 1e-9)).log10().floor()).max(0.0) as usize;
        let first = (self.from / step).ceil() as i64;
        let last = (self.to / step).floor() as i64;
        let tick = |k: i64| {
            let value = k as f64 * step;
            let label = format!("{:.decimals$}", value / unit).replace('-', "−");
            Some(Tick { at: self.share(value)?, label })
        };
        (first..=last).filter_map(tick).collect()
    }

    fn decades(&self) -> Vec<Tick> {
        let (first, last) = (self.from.ceil() as i32, self.to.floor() as i32);
        if last <= first {
            return self.within_a_decade();
        }
        let every = (last - first) as usize / (TICKS + 1) + 1;
        let tick = |decade| Some(Tick { at: self.share(10f64.powi(decade))?, label: power(decade) });
        (first..=last).step_by(every).filter_map(tick).collect()
    }

    /// Where no two powers of ten are within reach: round values, at their logarithms.
    fn within_a_decade(&self) -> Vec<Tick> {
        let (low, high) = (10f64.powf(self.from), 10f64.powf(self.to));
        let decade = high.log10().floor() as i32;
        let factor = if (-2..4).contains(&decade) { 0 } else { decade };
        let unit = 10f64.powi(factor);
        let plain = Self { exponent: 0, ..Self::between(low / unit, high / unit) };
        let one = |tick: Tick| {
            let value = plain.from + tick.at * (plain.to - plain.from);
            let label = if factor == 0 { tick.label } else { format!("{}·{}", tick.label, power(factor)) };
            Some(Tick { at: self.share(value * unit)?, label })
        };
        plain.steps().into_iter().filter_map(one).collect()
    }
}

fn ends(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    let finite = values.into_iter().filter(|value| value.is_finite());
    finite.fold(None, |ends, value| match ends {
        None => Some((value, value)),
        Some((low, high)) => Some((value.min(low), value.max(high))),
    })
}

/// A power of ten: `1`, `10`, `10⁻³`.
fn power(exponent: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    match exponent {
        0 => "1".to_owned(),
        1 => "10".to_owned(),
        2 => "100".to_owned(),
        _ => {
            let sign = if exponent < 0 { "⁻" } else { "" };
            let digits = exponent.unsigned_abs().to_string();
            let raised: String = digits.bytes().map(|digit| DIGITS[usize::from(digit - b'0')]).collect();
            format!("10{sign}{raised}")
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn labels(scale: &Scale) -> Vec<String> {
        scale.ticks().into_iter().map(|tick| tick.label).collect()
    }

    #[test]
    fn labels_are_round_and_small_values_have_a_factor() {
        assert_eq!(labels(&Scale::between(0.0, 100.0)), ["0", "20", "40", "60", "80", "100"]);
        let small = Scale::between(-0.0004, 0.0004);
        assert_eq!(
            (labels(&small), small.factor()),
            (vec!["−400".into(), "−200".into(), "0".into(), "200".into(), "400".into()], "10⁻⁶ ".into())
        );
    }

    #[test]
    fn a_logarithmic_axis_has_powers_of_ten() {
        assert_eq!(labels(&Scale::logarithmic([0.01, 1000.0])), ["10⁻²", "10⁻¹", "1", "10", "100", "10³"]);
        assert_eq!(labels(&Scale::logarithmic([2.0, 6.0])), ["2", "4", "6"]);
        assert_eq!(labels(&Scale::logarithmic([0.02, 0.03])), ["0.020", "0.025", "0.030"]);
        assert_eq!(labels(&Scale::logarithmic([2e-5, 3e-5])), ["2.0·10⁻⁵", "2.5·10⁻⁵", "3.0·10⁻⁵"]);
    }

    proptest! {
        #[test]
        fn every_axis_has_a_few_ticks_within_it(a in -1e12f64..1e12, span in 1e-9f64..1e12) {
            let scale = Scale::linear([a, a + span]);
            let ticks = scale.ticks();
            prop_assert!((2..=TICKS + 2).contains(&ticks.len()), "{ticks:?}");
            for tick in &ticks {
                prop_assert!((-1e-9..=1.0 + 1e-9).contains(&tick.at));
            }
        }

        #[test]
        fn every_logarithmic_axis_has_ticks_and_holds_its_values(low in -12f64..12.0, decades in 0f64..20.0) {
            let ends = [10f64.powf(low), 10f64.powf(low + decades)];
            let scale = Scale::logarithmic(ends);
            prop_assert!(scale.ticks().len() <= 3 * TICKS);
            for value in ends {
                prop_assert!((0.0..=1.0).contains(&scale.share(value).unwrap()));
            }
        }
    }
}
