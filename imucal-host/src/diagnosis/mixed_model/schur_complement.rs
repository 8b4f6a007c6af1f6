//! A symmetric matrix of which the first columns are eliminated, block by block.
//!
//! ```text
//! A  B
//! Bᵀ C  →  C − Bᵀ A⁻¹ B, ln|A|
//! ```
//!
//! Right-looking Cholesky: G. Golub, C. Van Loan, Matrix Computations (4th ed.), 4.2.9. nalgebra's factor is none of a part,
//! and goes column by column.

use nalgebra::DMatrix;

/// Columns that are eliminated at a time.
const WIDTH: usize = 48;

/// What is left of a symmetric matrix without the first `count` rows and columns, and ln of the determinant of their block;
/// `None` where that is not positive definite.
pub fn eliminated(mut matrix: DMatrix<f64>, count: usize) -> Option<(DMatrix<f64>, f64)> {
    let size = matrix.ncols();
    let mut log_determinant = 0.0;
    let mut from = 0;
    while from < count {
        let to = (from + WIDTH).min(count);
        let factor = matrix.view((from, from), (to - from, to - from)).into_owned().cholesky()?;
        log_determinant += factor.ln_determinant();
        // Its inverse, so that the long rows are multiplied.
        let inverse = factor.l().solve_lower_triangular(&DMatrix::identity(to - from, to - from))?;
        let row = inverse * matrix.view((from, to), (to - from, size - to));
        let column = row.transpose();
        // Above the diagonal, and the squares on it.
        for first in (to..size).step_by(WIDTH) {
            let last = (first + WIDTH).min(size);
            let own = row.columns(first - to, last - first);
            let mut left = matrix.view_mut((to, first), (last - to, last - first));
            left.gemm(-1.0, &column.rows(0, last - to), &own, 1.0);
        }
        from = to;
    }
    let mut left = matrix.view((count, count), (size - count, size - count)).into_owned();
    left.fill_lower_triangle_with_upper_triangle();
    Some((left, log_determinant))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_is_the_complement_of_what_is_taken_out() {
        for (count, others) in [(0, 3), (1, 1), (WIDTH, 5), (2 * WIDTH + 7, WIDTH + 9)] {
            let size = count + others;
            let x = DMatrix::from_fn(size + 9, size, |i, j| ((i * 17 + j * j * 5) as f64).sin());
            let all = x.tr_mul(&x) + DMatrix::identity(size, size);
            let of = |at: (usize, usize), shape| all.view(at, shape).into_owned();
            let (a, b) = (of((0, 0), (count, count)), of((0, count), (count, others)));
            let factor = a.cholesky().unwrap();
            let expected = of((count, count), (others, others)) - b.tr_mul(&factor.solve(&b));
            let (left, log_determinant) = eliminated(all, count).unwrap();
            assert!((&left - expected).amax() < 1e-9 && left == left.transpose(), "{count}");
            assert!((log_determinant - factor.ln_determinant()).abs() < 1e-9, "{count}");
        }
        assert!(eliminated(-DMatrix::identity(3, 3), 2).is_none());
    }
}
