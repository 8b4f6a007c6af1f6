//! Covariance of Allan variances of one recording, and the degrees of freedom of each.
//!
//! ```text
//! Cov(σ²_i, σ²_j) = 1 / (2 m_i² m_j² M_i M_j) · Σ_h w(h) R_ij(h)²        R_ij(h): covariance of two second differences
//! edf = 2 (σ²)² / Var(σ²)                                                  h samples apart; w: pairs so far apart
//! ```
//!
//! For Gaussian noise this is exact, and for one kind of noise the edf is that of C. A. Greenhall & W. J. Riley,
//! Uncertainty of stability variances based on finite differences (PTTI 2003), eq. (8), which NIST SP 1065, section 5.3,
//! recommends. For a sum of kinds R is a sum too, so that the sums of products of kinds ([`Products`]) are computed once
//! for a recording's lengths and hold for any sizes.
//!
//! Sums over h are taken in full where the corners of R are near to one another, and by Gauss and Legendre's rule between
//! corners that are far apart.

use nalgebra::{DMatrix, DVector};

use super::process::{Kind, SECOND_DIFFERENCE};

/// Nodes on [0, 1] and weights of Gauss and Legendre's rule of six points.
const NODES: [(f64, f64); 6] = [
    (0.033_765_242_898_423_99, 0.085_662_246_189_585_17),
    (0.169_395_306_766_867_74, 0.180_380_786_524_069_3),
    (0.380_690_406_958_401_55, 0.233_956_967_286_345_52),
    (0.619_309_593_041_598_5, 0.233_956_967_286_345_52),
    (0.830_604_693_233_132_2, 0.180_380_786_524_069_3),
    (0.966_234_757_101_576_0, 0.085_662_246_189_585_17),
];
/// A piece as long as this is summed in full.
const SHORT: f64 = 12.0;
/// The tail of flicker falls as h⁻²; beyond so many lengths of both averages nothing is left.
const TAILS: [f64; 4] = [1.0, 3.0, 9.0, 27.0];

/// One length of averages: samples, and samples that the beginnings of its terms span.
pub type Length = (f64, f64);

/// Sums of products of covariances, for any sizes of some kinds of noise.
#[derive(Clone, Debug)]
pub struct Products {
    kinds: Vec<Kind>,
    lengths: Vec<Length>,
    /// Of each pair of kinds, a matrix over the lengths.
    sums: Vec<DMatrix<f64>>,
}

impl Products {
    /// For averages of these lengths, the shortest first.
    pub fn new(kinds: Vec<Kind>, lengths: Vec<Length>) -> Self {
        let (count, size) = (kinds.len(), lengths.len());
        let mut sums = vec![DMatrix::zeros(size, size); count * count];
        for long in 0..size {
            for short in 0..=long {
                let scale = scale(lengths[long], lengths[short]);
                let pair = pair(&kinds, lengths[long], lengths[short]);
                for (sum, value) in sums.iter_mut().zip(pair) {
                    sum[(long, short)] = scale * value;
                    sum[(short, long)] = scale * value;
                }
            }
        }
        Self { kinds, lengths, sums }
    }

    /// The kinds, in the order of their sizes.
    pub fn kinds(&self) -> &[Kind] {
        &self.kinds
    }

    /// The lengths.
    pub fn lengths(&self) -> &[Length] {
        &self.lengths
    }

    /// Expected variances for squared coefficients of one: a column a kind.
    pub fn design(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.lengths.len(), self.kinds.len(), |row, column| {
            self.kinds[column].allan_variance(self.lengths[row].0)
        })
    }

    /// Covariance of the variances for squared coefficients, ≥ 0.
    pub fn covariance(&self, sizes: &DVector<f64>) -> DMatrix<f64> {
        let (count, size) = (self.kinds.len(), self.lengths.len());
        let mut sum = DMatrix::zeros(size, size);
        for one in 0..count {
            for other in 0..count {
                let factor = sizes[one] * sizes[other];
                if factor != 0.0 {
                    sum += &self.sums[one * count + other] * factor;
                }
            }
        }
        sum
    }

    /// Equivalent degrees of freedom of each variance for squared coefficients.
    pub fn freedoms(&self, sizes: &DVector<f64>) -> Vec<f64> {
        let expected = self.design() * sizes;
        let covariance = self.covariance(sizes);
        expected.iter().enumerate().map(|(row, v)| 2.0 * v * v / covariance[(row, row)]).collect()
    }
}

fn scale((m, span): Length, (n, other): Length) -> f64 {
    1.0 / (2.0 * (m * n).powi(2) * span * other)
}

/// Σ w(h) R^c(h) R^c'(h) for each pair of kinds.
fn pair(kinds: &[Kind], long: Length, short: Length) -> Vec<f64> {
    let count = kinds.len();
    let mut sums = vec![0.0; count * count];
    let mut add = |weight: f64, covariances: &[f64]| {
        for (one, a) in covariances.iter().enumerate() {
            for (other, b) in covariances.iter().enumerate() {
                sums[one * count + other] += weight * a * b;
            }
        }
    };
    let (mut smooth, mut whole) = (vec![0.0; count], vec![0.0; count]);
    let corners = corners(long, short);
    for piece in corners.windows(2) {
        for (lag, weight) in nodes(piece[0], piece[1]) {
            covariances(kinds, long.0, short.0, lag, &mut smooth);
            add(weight * pairs(long.1, short.1, lag), &smooth);
        }
    }
    // What s has at zero alone is met where two ends coincide.
    if let Some(own) = kinds.iter().position(|kind| kind.at_zero() != 0.0) {
        for (lag, factor) in coincidences(long.0, short.0) {
            covariances(kinds, long.0, short.0, lag, &mut smooth);
            whole.clone_from(&smooth);
            whole[own] += factor * kinds[own].at_zero();
            let weight = pairs(long.1, short.1, lag);
            add(weight, &whole);
            add(-weight, &smooth);
        }
    }
    sums
}

/// Of each kind, the covariance of the second differences over m and n, the second `lag` samples after the first.
fn covariances(kinds: &[Kind], m: f64, n: f64, lag: f64, out: &mut [f64]) {
    for (kind, out) in kinds.iter().zip(out) {
        let mut sum = 0.0;
        for (a, one) in SECOND_DIFFERENCE.iter().enumerate() {
            for (b, other) in SECOND_DIFFERENCE.iter().enumerate() {
                sum += one * other * kind.generalised(lag + b as f64 * n - a as f64 * m);
            }
        }
        *out = sum;
    }
}

/// Lags at which ends of two second differences coincide, and by which factors, each lag once.
fn coincidences(m: f64, n: f64) -> Vec<(f64, f64)> {
    let mut found: Vec<(f64, f64)> = Vec::new();
    for (a, one) in SECOND_DIFFERENCE.iter().enumerate() {
        for (b, other) in SECOND_DIFFERENCE.iter().enumerate() {
            let lag = a as f64 * m - b as f64 * n;
            match found.iter_mut().find(|(known, _)| *known == lag) {
                Some((_, factor)) => *factor += one * other,
                None => found.push((lag, one * other)),
            }
        }
    }
    found
}

/// Pairs of terms `lag` samples apart: the overlap of both spans.
fn pairs(one: f64, other: f64, lag: f64) -> f64 {
    (one.min(other - lag) - (-lag).max(0.0)).max(0.0)
}

/// Where R has corners, and beyond them ends of pieces of its tails, within the lags that there are.
fn corners((m, one): Length, (n, other): Length) -> Vec<f64> {
    let mut corners: Vec<f64> = coincidences(m, n).into_iter().map(|(lag, _)| lag).collect();
    let far = TAILS.map(|tail| tail * (m + n));
    corners.extend(far.iter().map(|far| 2.0 * m + far));
    corners.extend(far.iter().map(|far| -2.0 * n - far));
    // Corners of the number of pairs.
    let (least, most) = (1.0 - one, other - 1.0);
    corners.extend([0.0, other - one].into_iter().map(f64::round));
    corners.iter_mut().for_each(|lag| *lag = lag.clamp(least, most + 1.0).round());
    corners.sort_by(f64::total_cmp);
    corners.dedup();
    corners
}

/// Whole lags from `from` to before `to`, or as many as stand for them, with their weights.
fn nodes(from: f64, to: f64) -> Vec<(f64, f64)> {
    let length = to - from;
    if length <= SHORT {
        return (0..length as usize).map(|k| (from + k as f64, 1.0)).collect();
    }
    let mut nodes: Vec<(f64, f64)> =
        NODES.iter().map(|(at, weight)| (from + at * length, weight * length)).collect();
    // A sum is the integral and half of what the ends differ by.
    nodes.extend([(from, 0.5), (to, -0.5)]);
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn freedom(kind: Kind, m: f64, rows: f64) -> f64 {
        Products::new(vec![kind], vec![(m, rows + 1.0 - 2.0 * m)]).freedoms(&DVector::from_element(1, 1.0))[0]
    }

    /// The sum over all pairs of terms.
    fn in_full(kind: Kind, m: usize, rows: usize) -> f64 {
        let terms = rows + 1 - 2 * m;
        let mut smooth = [0.0];
        let ends = coincidences(m as f64, m as f64);
        let mut sum = 0.0;
        for lag in 1 - terms as i64..terms as i64 {
            covariances(&[kind], m as f64, m as f64, lag as f64, &mut smooth);
            let end = ends.iter().find(|(end, _)| *end == lag as f64).map_or(0.0, |(_, factor)| *factor);
            let covariance = smooth[0] + end * kind.at_zero();
            sum += (terms as i64 - lag.abs()) as f64 * covariance * covariance;
        }
        let variance = kind.allan_variance(m as f64) * 2.0 * (m * m) as f64;
        (variance * terms as f64).powi(2) / sum
    }

    #[test]
    fn the_degrees_of_freedom_are_those_of_the_whole_sum() {
        for kind in [Kind::Quantisation, Kind::White, Kind::Flicker, Kind::Walk, Kind::Markov(40.0)] {
            for (m, rows) in [(1, 100), (3, 1000), (16, 1000), (64, 1000), (300, 1000), (499, 1000)] {
                let (found, expected) = (freedom(kind, m as f64, rows as f64), in_full(kind, m, rows));
                assert!((found / expected - 1.0).abs() < 0.01, "{kind:?} {m} {rows}: {found} {expected}");
            }
        }
    }

    #[test]
    fn covariances_of_two_lengths_are_those_of_drawn_noise() {
        use crate::allan::cascade::Cascade;
        use crate::simulator::random::{Purpose, Random};
        use nalgebra::Vector3;
        let (rows, lengths) = (400, [(2.0, 397.0), (32.0, 337.0), (64.0, 273.0)]);
        let mut random = Random::new(4, Purpose::Noise);
        let mut draws = Vec::new();
        for _ in 0..2000 {
            let (mut cascade, mut walk) = (Cascade::default(), Vector3::zeros());
            for _ in 0..rows {
                walk += random.normals() * 0.1;
                cascade.push(&(walk + random.normals()));
            }
            let points = cascade.points();
            let at =
                |m: f64| points.iter().find(|point| point.samples as f64 == m).map(|point| point.variance);
            let found: Vec<Vector3<f64>> = lengths.iter().filter_map(|(m, _)| at(*m)).collect();
            (0..3).for_each(|axis| draws.push([found[0][axis], found[1][axis], found[2][axis]]));
        }
        let products = Products::new(vec![Kind::White, Kind::Walk], lengths.to_vec());
        let expected = products.covariance(&DVector::from_column_slice(&[1.0, 0.01]));
        let mean = |of: &dyn Fn(&[f64; 3]) -> f64| draws.iter().map(of).sum::<f64>() / draws.len() as f64;
        for (one, other) in [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)] {
            let (a, b) = (mean(&|draw| draw[one]), mean(&|draw| draw[other]));
            let found = mean(&|draw| (draw[one] - a) * (draw[other] - b));
            let size = (expected[(one, one)] * expected[(other, other)]).sqrt();
            assert!((found - expected[(one, other)]).abs() < 0.08 * size, "{one} {other} {found} {expected}");
        }
    }
}
