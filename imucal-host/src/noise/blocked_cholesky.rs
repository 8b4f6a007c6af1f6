//! Cholesky's factor of a dense matrix by blocks of columns, so that most of the work is products of matrices.
//!
//! ```text
//! A = L Lᵀ,   A_J ← A_J − L_{J,<J} L_{j,<J}ᵀ,   L_jj L_jjᵀ = A_jj,   L_{>j,j} = A_{>j,j} L_jj⁻ᵀ
//! ```
//!
//! of the rows J from a block j on. nalgebra's factor goes column by column and is bound by memory from some hundred rows
//! on. Source: Golub and Van Loan, Matrix Computations, 4.2.9.

use nalgebra::DMatrix;

/// Columns of a block.
const WIDTH: usize = 64;

/// L, and ln |A|; `None` where A is not positive definite.
pub fn factor(mut a: DMatrix<f64>) -> Option<(DMatrix<f64>, f64)> {
    let size = a.nrows();
    let mut log_determinant = 0.0;
    for from in (0..size).step_by(WIDTH) {
        let width = WIDTH.min(size - from);
        let (done, mut rest) = a.columns_range_pair_mut(0..from, from..from + width);
        let left = done.rows(from, size - from);
        let above = left.rows(0, width).transpose();
        rest.rows_mut(from, size - from).gemm(-1.0, &left, &above, 1.0);
        let block = rest.rows(from, width).into_owned().cholesky()?.unpack();
        log_determinant += 2.0 * block.diagonal().iter().map(|d| d.ln()).sum::<f64>();
        rest.rows_mut(0, from).fill(0.0);
        rest.rows_mut(from, width).copy_from(&block);
        solve_below(&block, &mut rest, from + width);
    }
    Some((a, log_determinant))
}

/// A L⁻ᵀ in the rows of a block's columns from `below` on.
fn solve_below(block: &DMatrix<f64>, columns: &mut nalgebra::DMatrixViewMut<'_, f64>, below: usize) {
    let rows = columns.nrows() - below;
    for k in 0..block.ncols() {
        let (done, mut rest) = columns.columns_range_pair_mut(0..k, k..k + 1);
        let mut own = rest.view_mut((below, 0), (rows, 1));
        own.gemm(-1.0, &done.rows(below, rows), &block.view((k, 0), (1, k)).transpose(), 1.0);
        own /= block[(k, k)];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_factor_is_that_of_nalgebra_for_any_number_of_blocks() {
        for size in [1, WIDTH - 1, WIDTH, WIDTH + 1, 3 * WIDTH + 5] {
            let x = DMatrix::from_fn(size, size, |i, j| ((i * 31 + j * 7) as f64).sin());
            let a = &x * x.transpose() + DMatrix::identity(size, size);
            let (lower, log) = factor(a.clone()).unwrap();
            let expected = a.cholesky().unwrap();
            assert!((lower - expected.l()).amax() < 1e-10, "{size}");
            assert!((log - expected.ln_determinant()).abs() < 1e-9, "{size}");
        }
    }

    #[test]
    fn an_indefinite_matrix_has_none() {
        let mut a = DMatrix::<f64>::identity(WIDTH + 9, WIDTH + 9);
        a[(WIDTH + 3, WIDTH + 3)] = -1.0;
        assert!(factor(a).is_none());
        assert!(factor(DMatrix::zeros(2, 2)).is_none());
    }
}
