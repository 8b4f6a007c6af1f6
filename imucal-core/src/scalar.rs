//! The one arithmetic path: `f32` on the device, `f64` for comparison on a host, both through `libm` by name.
//!
//! Platform maths differ in the last bit (glibc's `sin` from libm's in about 1 % of arguments), so nothing here
//! goes through `std`. Operations are never fused: `a * b + c` rounds twice on every target.

use nalgebra::RealField;

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// A floating-point number that host and device compute alike: `f32` or `f64`, and nothing else.
///
/// ```compile_fail
/// struct Fixed(i32);
/// impl imucal_core::scalar::Scalar for Fixed {} // sealed
/// ```
pub trait Scalar: sealed::Sealed + RealField + Copy {
    /// Distance from 1 to the next larger number.
    const EPSILON: Self;
    /// The largest finite number.
    const LARGEST: Self;
    /// Whether rows are triangularised in panels of 32: in `f64`, with which only a host fits. In `f32` host and device
    /// rotate them in one by one, and their bits are the same.
    const PANELS: bool;

    /// The nearest number to `value`.
    fn of(value: f64) -> Self;
    /// The nearest number to a whole one, without double precision in between.
    fn whole(value: u32) -> Self;
    /// This number in double precision, exactly.
    fn wide(self) -> f64;
    /// Square root, correctly rounded; NaN below zero.
    fn root(self) -> Self;
    /// Neither infinite nor NaN.
    fn finite(self) -> bool;
    /// Bit by bit, without the cost of a comparison of numbers on a core that has no unit for them.
    fn same(self, other: Self) -> bool;
}

impl Scalar for f32 {
    const EPSILON: Self = f32::EPSILON;
    const LARGEST: Self = f32::MAX;
    const PANELS: bool = false;

    #[inline]
    fn of(value: f64) -> Self {
        value as f32
    }
    #[inline]
    fn whole(value: u32) -> Self {
        value as f32
    }
    #[inline]
    fn wide(self) -> f64 {
        f64::from(self)
    }
    #[inline]
    fn root(self) -> Self {
        libm::sqrtf(self)
    }
    #[inline]
    fn finite(self) -> bool {
        f32::is_finite(self)
    }
    #[inline]
    fn same(self, other: Self) -> bool {
        self.to_bits() == other.to_bits()
    }
}

impl Scalar for f64 {
    const EPSILON: Self = f64::EPSILON;
    const LARGEST: Self = f64::MAX;
    const PANELS: bool = true;

    #[inline]
    fn of(value: f64) -> Self {
        value
    }
    #[inline]
    fn whole(value: u32) -> Self {
        value.into()
    }
    #[inline]
    fn wide(self) -> f64 {
        self
    }
    #[inline]
    fn root(self) -> Self {
        libm::sqrt(self)
    }
    #[inline]
    fn finite(self) -> bool {
        f64::is_finite(self)
    }
    #[inline]
    fn same(self, other: Self) -> bool {
        self.to_bits() == other.to_bits()
    }
}
