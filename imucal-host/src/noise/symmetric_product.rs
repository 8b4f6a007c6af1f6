//! Products of matrices that are known to be symmetric: half of them make the whole.

use nalgebra::{DMatrix, DMatrixViewMut, Dyn, MatrixView};

/// Columns that are multiplied at a time: far more than a kernel's, far fewer than a menu of shapes has.
const WIDTH: usize = 96;

/// A matrix in any order of its entries, so that a transposed one needs no copy.
pub type Strided<'a> = MatrixView<'a, f64, Dyn, Dyn, Dyn, Dyn>;

/// Column after column, `rows` entries each.
pub fn by_columns(entries: &[f64], rows: usize) -> Strided<'_> {
    let columns = entries.len() / rows.max(1);
    Strided::from_slice_with_strides_generic(entries, Dyn(rows), Dyn(columns), Dyn(1), Dyn(rows))
}

/// Row after row, `columns` entries each.
pub fn by_rows(entries: &[f64], columns: usize) -> Strided<'_> {
    let rows = entries.len() / columns.max(1);
    Strided::from_slice_with_strides_generic(entries, Dyn(rows), Dyn(columns), Dyn(columns), Dyn(1))
}

/// Adds α A B to C, where both are symmetric.
pub fn add_product(c: &mut DMatrix<f64>, alpha: f64, a: &Strided<'_>, b: &Strided<'_>) {
    add_upper(&mut c.as_view_mut(), alpha, a, b);
    c.fill_lower_triangle_with_upper_triangle();
}

/// Adds the upper triangle of α A B, which is symmetric, to C; what it adds below the diagonal is not all of it.
pub fn add_upper(c: &mut DMatrixViewMut<'_, f64>, alpha: f64, a: &Strided<'_>, b: &Strided<'_>) {
    let n = c.ncols();
    // Of like widths: a last narrow one would be multiplied by another kernel.
    let parts = n.div_ceil(WIDTH);
    for part in 0..parts {
        let (from, to) = (part * n / parts, (part + 1) * n / parts);
        c.view_mut((0, from), (to, to - from)).gemm(alpha, &a.rows(0, to), &b.columns(from, to - from), 1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_the_products_make_the_whole() {
        for n in [0, 1, 7, WIDTH, WIDTH + 1, 5 * WIDTH / 2] {
            let a = DMatrix::from_fn(n, 30, |i, j| ((i * 31 + j * 7) as f64).sin());
            let c = DMatrix::from_fn(n, n, |i, j| ((i + j) as f64).cos());
            let expected = &c - &a * a.transpose() * 0.5;
            let mut found = c;
            add_product(&mut found, -0.5, &by_columns(a.as_slice(), n), &by_rows(a.as_slice(), n));
            assert!((&found - &expected).amax() < 1e-12 && found == found.transpose(), "{n}");
        }
    }
}
