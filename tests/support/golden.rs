//! Solutions of the independent Python oracles, and comparisons with them.

use std::path::Path;

use nalgebra::{Matrix3, Vector3};
use serde_json::Value;

/// A golden file by its name without the ending.
///
/// # Panics
///
/// Where it is missing or no JSON: it belongs to the project.
pub fn golden(name: &str) -> Value {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden").join(format!("{name}.json"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// A number.
///
/// # Panics
///
/// Where it is none.
pub fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("not a number: {value}"))
}

/// A list of numbers.
///
/// # Panics
///
/// Where it is none.
pub fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap_or_else(|| panic!("not a list: {value}")).iter().map(number).collect()
}

/// Three numbers.
pub fn vector(value: &Value) -> Vector3<f64> {
    Vector3::from_column_slice(&numbers(value))
}

/// A list of vectors.
///
/// # Panics
///
/// Where it is none.
pub fn vectors(value: &Value) -> Vec<Vector3<f64>> {
    value.as_array().unwrap_or_else(|| panic!("not a list: {value}")).iter().map(vector).collect()
}

/// A 3×3 matrix by rows.
pub fn matrix(value: &Value) -> Matrix3<f64> {
    let rows = vectors(value);
    Matrix3::from_rows(&[rows[0].transpose(), rows[1].transpose(), rows[2].transpose()])
}

/// Pairs of row numbers, as the oracle wrote them.
///
/// # Panics
///
/// Where they are none.
pub fn intervals(value: &Value) -> Vec<(usize, usize)> {
    let row = |v: &Value| usize::try_from(v.as_u64().expect("a row")).expect("fits");
    value.as_array().expect("a list").iter().map(|pair| (row(&pair[0]), row(&pair[1]))).collect()
}

/// Every value within `tolerance` of what is expected, absolute.
///
/// # Panics
///
/// Where one is not, with all of them.
pub fn assert_close(what: &str, found: &[f64], expected: &[f64], tolerance: f64) {
    assert_each_close(what, found, expected, &vec![tolerance; expected.len()]);
}

/// Every value within its own tolerance of what is expected, absolute.
///
/// # Panics
///
/// Where one is not, with all of them.
pub fn assert_each_close(what: &str, found: &[f64], expected: &[f64], tolerances: &[f64]) {
    assert_eq!((found.len(), expected.len()), (expected.len(), tolerances.len()), "{what}: lengths differ");
    let far = found.iter().zip(expected).zip(tolerances).position(|((f, e), t)| {
        let near = (f - e).abs() <= *t;
        !near
    });
    assert_eq!(
        far, None,
        "{what}: found {found:?}\nexpected {expected:?}\nwithin {tolerances:?}; the index is the first that is off"
    );
}
