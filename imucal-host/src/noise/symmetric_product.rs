//! Products of matrices that are known to be symmetric: half of them make the whole.

use nalgebra::DMatrix;

/// Columns that are multiplied at a time: far more than a kernel's, far fewer than a menu of shapes has.
const WIDTH: usize = 96;

/// Adds α A B to C, where both are symmetric.
pub fn add_product(c: &mut DMatrix<f64>, alpha: f64, a: &DMatrix<f64>, b: &DMatrix<f64>) {
    let n = c.ncols();
    // Of like widths: a last narrow one would be multiplied by another kernel.
    let parts = n.div_ceil(WIDTH);
    for part in 0..parts {
        let (from, to) = (part * n / parts, (part + 1) * n / parts);
        c.view_mut((0, from), (to, to - from)).gemm(alpha, &a.rows(0, to), &b.columns(from, to - from), 1.0);
    }
    c.fill_lower_triangle_with_upper_triangle();
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
            add_product(&mut found, -0.5, &a, &a.transpose());
            assert!((&found - &expected).amax() < 1e-12 && found == found.transpose(), "{n}");
        }
    }
}
