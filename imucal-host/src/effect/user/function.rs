//! Functions that a formula may use, and its comparisons.
//!
//! All are those of `libm` by name, so that a formula has one value on every machine. What is not a number stays so:
//! neither a comparison nor `min` hides it.

/// A function of one argument.
pub(super) type Unary = fn(f64) -> f64;
/// One of two.
pub(super) type Binary = fn(f64, f64) -> f64;

/// Names of functions of one argument, and the functions.
const UNARY: [(&str, Unary); 20] = [
    ("abs", libm::fabs),
    ("acos", libm::acos),
    ("asin", libm::asin),
    ("atan", libm::atan),
    ("cbrt", libm::cbrt),
    ("ceil", libm::ceil),
    ("cos", libm::cos),
    ("cosh", libm::cosh),
    ("exp", libm::exp),
    ("floor", libm::floor),
    ("ln", libm::log),
    ("log", libm::log),
    ("log10", libm::log10),
    ("round", libm::round),
    ("sign", sign),
    ("sin", libm::sin),
    ("sinh", libm::sinh),
    ("sqrt", libm::sqrt),
    ("tan", libm::tan),
    ("tanh", libm::tanh),
];

/// Likewise of two.
const BINARY: [(&str, Binary); 5] =
    [("atan2", libm::atan2), ("hypot", libm::hypot), ("max", max), ("min", min), ("pow", libm::pow)];

/// Comparisons, the longer ones first: 1 where they hold, else 0.
pub(super) const COMPARISONS: [(&str, Binary); 5] = [
    ("<=", |a, b| whether(a, b, a <= b)),
    (">=", |a, b| whether(a, b, a >= b)),
    ("==", |a, b| whether(a, b, a == b)),
    ("<", |a, b| whether(a, b, a < b)),
    (">", |a, b| whether(a, b, a > b)),
];

/// The function of one argument of a name.
pub(super) fn unary(name: &str) -> Option<Unary> {
    UNARY.iter().find(|(own, _)| *own == name).map(|(_, function)| *function)
}

/// The function of two arguments of a name.
pub(super) fn binary(name: &str) -> Option<Binary> {
    BINARY.iter().find(|(own, _)| *own == name).map(|(_, function)| *function)
}

/// Names of all of them.
pub(super) fn names() -> impl Iterator<Item = &'static str> + Clone {
    UNARY.iter().map(|(name, _)| *name).chain(BINARY.iter().map(|(name, _)| *name))
}

/// −1, 0 or 1.
fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { if x.is_nan() { x } else { libm::copysign(1.0, x) } }
}

fn min(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { libm::fmin(a, b) }
}

fn max(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { libm::fmax(a, b) }
}

fn whether(a: f64, b: f64, holds: bool) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { f64::from(u8::from(holds)) }
}

/// x to the power of y; small whole powers by products.
pub(super) fn power(x: f64, y: f64) -> f64 {
    match y {
        2.0 => x * x,
        3.0 => x * x * x,
        4.0 => (x * x) * (x * x),
        _ => libm::pow(x, y),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_a_number_is_not_hidden() {
        for name in ["min", "max"] {
            let function = binary(name).unwrap();
            assert!(function(f64::NAN, 1.0).is_nan() && function(1.0, f64::NAN).is_nan(), "{name}");
        }
        assert!(COMPARISONS.iter().all(|(_, compare)| compare(f64::NAN, 1.0).is_nan()));
        assert!(sign(f64::NAN).is_nan());
        assert_eq!([sign(-2.0), sign(0.0), sign(7.5)], [-1.0, 0.0, 1.0]);
    }

    #[test]
    fn small_whole_powers_are_those_of_the_general_function() {
        for (x, y) in [(-1.7, 2.0), (-1.7, 3.0), (0.3, 4.0), (2.0, 0.5), (3.0, -1.0)] {
            assert!((power(x, y) / libm::pow(x, y) - 1.0).abs() < 1e-15, "{x} {y}");
        }
    }
}
