//! The covariance of a channel's block means, and its inverse.
//!
//! ```text
//! Σ = D + σ² U Uᵀ + Z K Zᵀ
//! Xᵀ Σ⁻¹ X = Xᵀ D⁻¹ X − Bᵀ B − Yᵀ Y      B = σ L⁻¹ Uᵀ D⁻¹ X      L Lᵀ = I + σ² Uᵀ D⁻¹ U
//!                                          Y = R⁻¹ Zᵀ (D + σ² U Uᵀ)⁻¹ X      R Rᵀ = K⁻¹ + Zᵀ (D + σ² U Uᵀ)⁻¹ Z
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | D, U, Z | white noise, courses of stretches, lines between knots: [`super::random_effects`] |
//! | σ | scatter |
//! | K | drift: first-order Gauss–Markov processes, at knots |
//!
//! Woodbury's identity, twice: what stretches have in common first, the knots after it. The states of a knot are all drifts
//! but the first, and their sum: the blocks see that alone, so that few rows of the factor are long.

use std::sync::Arc;

use nalgebra::{DMatrix, Matrix3, Vector3};

use super::{
    random_effects::{COURSES, CrossProducts, RandomEffects, SPACING, Stretch},
    skyline::{Factor, Skyline},
    symmetric_product,
};

/// A first-order Gauss–Markov process.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Process {
    /// Correlation time, s.
    pub time: f64,
    /// Standard deviation, unit of the channel; positive.
    pub sigma: f64,
}

/// What a stretch has in common, given σ.
#[derive(Clone, Debug)]
struct Common {
    /// σ L⁻¹.
    scaled: Matrix3<f64>,
    /// B of the knots, from the stretch's first on.
    beside: Vec<[f64; COURSES]>,
}

/// (D + σ² U Uᵀ)⁻¹ of one channel: what is the same whatever the drift.
#[derive(Clone, Debug)]
pub struct Still {
    latents: Arc<RandomEffects>,
    commons: Vec<Common>,
    log_determinant: f64,
}

/// Columns that are weighed so.
#[derive(Clone, Debug)]
pub struct Stilled {
    /// What weighs them.
    pub still: Arc<Still>,
    /// Xᵀ (D + σ² U Uᵀ)⁻¹ X.
    plain: DMatrix<f64>,
    /// Xᵀ (D + σ² U Uᵀ)⁻¹ Z, a column a knot.
    knots: DMatrix<f64>,
}

/// Σ⁻¹ of one channel.
#[derive(Clone, Debug)]
pub struct Whitening {
    still: Arc<Still>,
    processes: usize,
    factor: Option<Factor>,
    /// Natural logarithm of Σ's determinant, over blocks with a weight.
    pub log_determinant: f64,
}

impl Still {
    /// From what blocks have in common, and the scatter of that.
    pub fn new(latents: Arc<RandomEffects>, scatter: f64) -> Self {
        let mut log_determinant = latents.log_determinant;
        let mut common = |stretch| {
            let (common, share) = Common::new(stretch, scatter);
            log_determinant += share;
            common
        };
        let commons = latents.stretches.iter().map(&mut common).collect();
        Self { latents, commons, log_determinant }
    }

    /// Columns that were condensed from the same blocks.
    pub fn weighed(self: &Arc<Self>, x: &CrossProducts) -> Stilled {
        let (along, knots) = self.shared(x);
        let plain = symmetric_product::with_product(x.plain.clone(), -1.0, &along, &along.transpose());
        Stilled { still: Arc::clone(self), plain, knots }
    }

    fn common(&self) -> impl Iterator<Item = (&Stretch, &Common)> {
        self.latents.stretches.iter().zip(&self.commons)
    }

    /// Bᵀ, and Xᵀ (D + σ² U Uᵀ)⁻¹ Z; a row a column.
    fn shared(&self, x: &CrossProducts) -> (DMatrix<f64>, DMatrix<f64>) {
        let mut along = DMatrix::zeros(x.along.nrows(), self.latents.courses);
        let mut knots = x.beside.clone();
        for (stretch, common) in self.common() {
            for course in 0..stretch.count {
                let mut own = along.column_mut(stretch.first + course);
                for other in 0..=course {
                    own.axpy(common.scaled[(course, other)], &x.along.column(stretch.first + other), 1.0);
                }
                for (at, beside) in common.beside.iter().enumerate() {
                    knots.column_mut(stretch.base + at).axpy(-beside[course], &own, 1.0);
                }
            }
        }
        (along, knots)
    }
}

impl Whitening {
    /// From what blocks have in common, the scatter of that, and drifts. Drifts that make the matrix indefinite by
    /// rounding are left out.
    pub fn new(latents: Arc<RandomEffects>, scatter: f64, drifts: &[Process]) -> Self {
        Self::drifting(Arc::new(Still::new(latents, scatter)), drifts)
    }

    /// With drifts beside all else. Those that make the matrix indefinite by rounding are left out.
    pub fn drifting(still: Arc<Still>, drifts: &[Process]) -> Self {
        let log_determinant = still.log_determinant;
        let mut whitening = Self { still, processes: drifts.len(), factor: None, log_determinant };
        whitening.factor = whitening.factorise(drifts);
        if let Some(factor) = &whitening.factor {
            whitening.log_determinant += factor.log_determinant;
            for drift in drifts {
                let steps = (whitening.latents().knots - 1) as f64;
                whitening.log_determinant += steps * innovation(drift).ln() + 2.0 * drift.sigma.ln();
            }
        }
        whitening
    }

    /// What the blocks have in common.
    pub fn latents(&self) -> &Arc<RandomEffects> {
        &self.still.latents
    }

    fn factorise(&self, drifts: &[Process]) -> Option<Factor> {
        let (p, count) = (self.processes, self.latents().knots);
        if p == 0 {
            return None;
        }
        let sum = |knot: usize| knot * p + p - 1;
        let mut first: Vec<usize> = (0..count * p).map(|state| (state / p).saturating_sub(1) * p).collect();
        for (Stretch { base, beside, .. }, _) in self.still.common() {
            for knot in *base..base + beside.len() {
                let reach = &mut first[sum(knot)];
                *reach = (*reach).min(base * p);
            }
        }
        let mut matrix = Skyline::new(first);
        for (process, drift) in drifts.iter().enumerate() {
            let (kept, q) = (libm::exp(-SPACING / drift.time), innovation(drift));
            for knot in 0..count {
                let inner = if knot == 0 || knot + 1 == count { 1.0 } else { 1.0 + kept * kept };
                for (row, signed) in parts(process, p) {
                    for (column, also) in parts(process, p) {
                        let (row, column, sign) = (knot * p + row, knot * p + column, signed * also);
                        // Each pair once: the matrix mirrors what is off its diagonal.
                        if row >= column {
                            matrix.add(row, column, sign * inner / q);
                        }
                        if knot > 0 {
                            matrix.add(row, column - p, -sign * kept / q);
                        }
                    }
                }
            }
        }
        for (knot, (own, next)) in self.latents().between.iter().enumerate() {
            matrix.add(sum(knot), sum(knot), *own);
            if knot + 1 < count {
                matrix.add(sum(knot + 1), sum(knot), *next);
            }
        }
        for (Stretch { base, .. }, Common { beside, .. }) in self.still.common() {
            for (i, one) in beside.iter().enumerate() {
                for (j, other) in beside.iter().enumerate().take(i + 1) {
                    let both: f64 = one.iter().zip(other).map(|(a, b)| a * b).sum();
                    matrix.add(sum(base + i), sum(base + j), -both);
                }
            }
        }
        matrix.factorised()
    }

    /// Xᵀ Σ⁻¹ X of columns that were condensed from the same blocks.
    pub fn products(&self, x: &CrossProducts) -> DMatrix<f64> {
        self.stilled_products(&self.still.weighed(x))
    }

    /// Xᵀ Σ⁻¹ X of columns that are weighed but for the drifts.
    pub fn stilled_products(&self, x: &Stilled) -> DMatrix<f64> {
        let drifts = self.drifts(&x.knots);
        symmetric_product::with_product(x.plain.clone(), -1.0, &drifts, &drifts.transpose())
    }

    /// Xᵀ Σ⁻¹ X of condensed columns, given what they show of all but white noise.
    pub fn less(&self, x: &CrossProducts, latent: &DMatrix<f64>) -> DMatrix<f64> {
        symmetric_product::with_product(x.plain.clone(), -1.0, latent, &latent.transpose())
    }

    /// What condensed columns show of all but white noise, Bᵀ and Yᵀ: a row a column.
    pub fn latent(&self, x: &CrossProducts) -> DMatrix<f64> {
        let (along, knots) = self.still.shared(x);
        let drifts = self.drifts(&knots);
        let mut latent = DMatrix::zeros(x.plain.ncols(), along.ncols() + drifts.ncols());
        latent.columns_mut(0, along.ncols()).copy_from(&along);
        latent.columns_mut(along.ncols(), drifts.ncols()).copy_from(&drifts);
        latent
    }

    /// Yᵀ, of what columns show at the knots: a row a column.
    fn drifts(&self, knots: &DMatrix<f64>) -> DMatrix<f64> {
        let (n, p) = (knots.nrows(), self.processes);
        let Some(factor) = &self.factor else { return DMatrix::zeros(n, 0) };
        let mut states = DMatrix::zeros(n, knots.ncols() * p);
        for (knot, values) in knots.column_iter().enumerate() {
            states.set_column((knot + 1) * p - 1, &values);
        }
        factor.forward(states.as_mut_slice(), n);
        states
    }

    /// Σ⁻¹ x of one column over the blocks: what white noise alone leaves of it, less what it shows of all else.
    pub fn apply(&self, x: &[f64], out: &mut [f64]) {
        let RandomEffects { weights, places, knots, .. } = &**self.latents();
        let (along, beside) =
            self.still.shared(&self.latents().condensed(&DMatrix::from_column_slice(x.len(), 1, x)));
        let mut drift = vec![0.0; *knots];
        if let Some(factor) = &self.factor {
            let p = self.processes;
            let mut states = vec![0.0; *knots * p];
            states.iter_mut().skip(p - 1).step_by(p).zip(&beside).for_each(|(state, knot)| *state = *knot);
            factor.solve(&mut states);
            drift.iter_mut().zip(states.iter().skip(p - 1).step_by(p)).for_each(|(knot, sum)| *knot = *sum);
        }
        for (out, (x, (knot, share))) in out.iter_mut().zip(x.iter().zip(places)) {
            *out = x - drift[*knot] * (1.0 - share) - drift[knot + 1] * share;
        }
        for (stretch, common) in self.still.common() {
            let shown = |course: usize| {
                let drifts = common.beside.iter().zip(&drift[stretch.base..]);
                let drift: f64 = drifts.map(|(beside, drift)| beside[course] * drift).sum();
                if course < stretch.count { along[stretch.first + course] - drift } else { 0.0 }
            };
            let amounts = common.scaled.tr_mul(&Vector3::from_fn(|course, _| shown(course)));
            for (out, u) in out[stretch.blocks.clone()].iter_mut().zip(&stretch.u) {
                *out -= amounts.iter().zip(u).map(|(amount, u)| amount * u).sum::<f64>();
            }
        }
        out.iter_mut().zip(weights).for_each(|(out, w)| *out *= w);
    }
}

impl Common {
    /// Of a stretch, and ln |I + σ² Uᵀ D⁻¹ U|.
    fn new(stretch: &Stretch, scatter: f64) -> (Self, f64) {
        let square = Matrix3::identity() + stretch.gram * (scatter * scatter);
        // Positive definite but for numbers that are none, which show in its determinant.
        let lower = square.cholesky().map_or_else(|| Matrix3::repeat(f64::NAN), |factor| factor.l());
        let inverse = lower.solve_lower_triangular(&Matrix3::identity()).unwrap_or_else(Matrix3::zeros);
        let scaled = inverse * scatter;
        let beside = stretch.beside.iter().map(|beside| (scaled * Vector3::from(*beside)).into()).collect();
        (Self { scaled, beside }, 2.0 * lower.diagonal().iter().map(|a| a.ln()).sum::<f64>())
    }
}

/// A drift as a sum of the `count` states of a knot, by their places and signs: the first is what the others leave of the
/// sum.
fn parts(process: usize, count: usize) -> impl Iterator<Item = (usize, f64)> {
    let states = if process == 0 { 0..count } else { process - 1..process };
    states.map(move |state| (state, if process == 0 && state + 1 < count { -1.0 } else { 1.0 }))
}

/// Variance of what is new in a process from one knot to the next.
fn innovation(drift: &Process) -> f64 {
    let kept = libm::exp(-SPACING / drift.time);
    drift.sigma * drift.sigma * (1.0 - kept * kept)
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::{super::random_effects::Shared, *};

    /// Anything but one.
    const SCATTER: f64 = 0.8;

    /// Σ by its definition.
    fn dense(times: &[f64], weights: &[f64], shared: &[Shared], drifts: &[Process]) -> DMatrix<f64> {
        let n = times.len();
        let count = ((times[n - 1] - times[0]) / SPACING).ceil() as usize + 1;
        let z = DMatrix::from_fn(n, count, |row, knot| {
            (1.0 - ((times[row] - times[0]) / SPACING - knot as f64).abs()).max(0.0)
        });
        let mut sigma = DMatrix::from_diagonal(&DVector::from_iterator(n, weights.iter().map(|w| 1.0 / w)));
        for drift in drifts {
            let k = DMatrix::from_fn(count, count, |a, b| {
                drift.sigma.powi(2) * (-SPACING * (a as f64 - b as f64).abs() / drift.time).exp()
            });
            sigma += &z * k * z.transpose();
        }
        for Shared { blocks, courses } in shared {
            for (a, b) in blocks.clone().flat_map(|a| blocks.clone().map(move |b| (a, b))) {
                let both = |u: &Vec<f64>| u[a - blocks.start] * u[b - blocks.start];
                sigma[(a, b)] += SCATTER * SCATTER * courses.iter().map(both).sum::<f64>();
            }
        }
        sigma
    }

    #[test]
    fn it_is_the_inverse_of_the_covariance_it_stands_for() {
        let times: Vec<f64> = (0..60).map(|k| 0.37 * f64::from(k)).collect();
        let weights: Vec<f64> = (0..60).map(|k| 1.0 + 0.5 * f64::from(k % 3)).collect();
        let course =
            |count: usize, f: &dyn Fn(f64) -> f64| (0..count).map(|k| f(k as f64)).collect::<Vec<_>>();
        let shared = [
            Shared { blocks: 3..9, courses: vec![course(6, &|_| 0.6)] },
            Shared {
                blocks: 20..41,
                courses: vec![
                    course(21, &|k| (0.3 * k).sin()),
                    course(21, &|k| 0.1 * k),
                    course(21, &|_| 0.0),
                ],
            },
        ];
        let drifts = [Process { time: 8.0, sigma: 0.9 }, Process { time: 150.0, sigma: 2.0 }];
        for drifts in [&drifts[..], &drifts[..1], &[]] {
            let sigma = dense(&times, &weights, &shared, drifts);
            let latents = Arc::new(RandomEffects::new(&times, weights.clone(), &shared));
            let whitening = Whitening::new(Arc::clone(&latents), SCATTER, drifts);
            let log_determinant = sigma.clone().cholesky().unwrap().ln_determinant();
            assert!((whitening.log_determinant - log_determinant).abs() < 1e-8);
            let x = DVector::from_fn(60, |k, _| ((k * k) as f64).sin());
            let mut found = vec![0.0; 60];
            whitening.apply(x.as_slice(), &mut found);
            assert!((&sigma * DVector::from_vec(found) - &x).amax() < 1e-9);
            let several = DMatrix::from_fn(60, 6, |row, column| (x[row] * (column as f64 - 1.5)).cos());
            let expected = several.tr_mul(&sigma.lu().solve(&several).unwrap());
            let condensed = latents.condensed(&several);
            assert!((whitening.products(&condensed) - &expected).amax() < 1e-9);
            let some = [4, 1];
            let picked = whitening.products(&condensed.picked(&some));
            assert!((picked - expected.select_rows(&some).select_columns(&some)).amax() < 1e-9);
        }
    }
}
