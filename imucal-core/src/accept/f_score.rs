//! How unlikely a ratio of variances is, as a standard normal score.
//!
//! ```text
//! z = ((1 − b) F^⅓ − (1 − a)) / √(a + b F^⅔),   a = 2/(9 q),  b = 2/(9 ν)
//! ```
//!
//! Source: Paulson 1942 (Annals of Mathematical Statistics 13), by the cube roots of Wilson and Hilferty. Too small
//! by at most 0.13 for ν ≥ 6 and scores up to 3.09, and never too large by 0.01 (test). A device needs no distribution for it.

/// The score of a ratio of `q` and `nu` degrees of freedom; NaN where there is none.
pub fn f_score(f: f32, q: f32, nu: f32) -> f32 {
    let (a, b) = (2.0 / (9.0 * q), 2.0 / (9.0 * nu));
    let root = libm::cbrtf(f);
    ((1.0 - b) * root - (1.0 - a)) / libm::sqrtf(a + b * root * root)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `scipy.stats.f.isf(scipy.stats.norm.sf(z), q, nu)`, SciPy 1.17.
    const TABLE: [(f32, f32, f32, f32); 6] = [
        (1.0, 3.0, 6.0, 2.477_515),
        (3.09, 3.0, 6.0, 23.696_538),
        (3.09, 3.0, 12.0, 10.802_225),
        (3.09, 3.0, 60.0, 6.170_514_4),
        (3.09, 6.0, 6.0, 20.024_034),
        (3.09, 6.0, 20.0, 6.017_8),
    ];

    #[test]
    fn the_score_is_that_of_the_exact_chance() {
        for (z, q, nu, f) in TABLE {
            let apart = f_score(f, q, nu) - z;
            assert!((-0.13..0.01).contains(&apart), "{z} {q} {nu}: {apart}");
        }
    }
}
