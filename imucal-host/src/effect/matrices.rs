//! Vectors and matrices of an effect's parameters, in the order of the parameter vector.

/// A symmetric matrix from xx, yy, zz, xy, xz, yz; missing values are zero.
pub(super) fn symmetric(values: &[f64]) -> nalgebra::Matrix3<f64> {
    let at = |k: usize| values.get(k).copied().unwrap_or(0.0);
    nalgebra::Matrix3::new(at(0), at(3), at(4), at(3), at(1), at(5), at(4), at(5), at(2))
}

/// The parameters' names of [`symmetric`].
pub(super) const SYMMETRIC: [&str; 6] = ["xx", "yy", "zz", "xy", "xz", "yz"];

/// The vector of three values from `at` on; missing values are zero.
pub(super) fn vector(values: &[f64], at: usize) -> nalgebra::Vector3<f64> {
    nalgebra::Vector3::from_fn(|k, _| values.get(at + k).copied().unwrap_or(0.0))
}

/// The matrix of nine values, row by row; missing values are zero.
pub(super) fn matrix(values: &[f64]) -> nalgebra::Matrix3<f64> {
    nalgebra::Matrix3::from_fn(|row, column| values.get(3 * row + column).copied().unwrap_or(0.0))
}

/// The parameters' names of [`matrix`].
pub(super) const MATRIX: [&str; 9] = ["xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"];
