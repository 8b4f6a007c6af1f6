//! The inverse covariance of block means, by one banded elimination of the random effects.
//!
//! ```text
//! Σ = D + Z K Zᵀ      Xᵀ Σ⁻¹ X = Xᵀ D⁻¹ X − Yᵀ Y      Y = L⁻¹ S Zᵀ D⁻¹ X      L Lᵀ = S Zᵀ D⁻¹ Z S + P
//! ln |Σ| = ln |D| + ln |L Lᵀ| + ln |K of the drifts|
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | D, Z | white noise and what the blocks share: [`super::random_effects`] |
//! | S, P | σ and 1 for an offset, so that σ may be zero; 1 and the processes' precision for drift |
//!
//! The states are eliminated in the order of time: Henderson's equations with the random effects first. Sources: C.
//! Henderson, Biometrics 31 (1975); H. Rue, L. Held, Gaussian Markov Random Fields (2005), ch. 2.

use std::{ops::Range, sync::Arc};

use nalgebra::DMatrix;

use super::{
    process::Process,
    random_effects::{CrossProducts, RandomEffects, States},
    skyline::{Factor, Skyline},
    symmetric_product::{add_product, by_columns, by_rows},
};

/// States that are multiplied at a time.
const PART: usize = 2048;

/// Σ⁻¹ of the channels of some random effects.
#[derive(Clone, Debug)]
pub struct Precision {
    /// S.
    scales: Vec<f64>,
    factor: Factor,
    /// ln |Σ|, over blocks with a weight.
    pub log_determinant: f64,
}

impl Precision {
    /// From the random effects, the standard deviation of the offsets, and the drifts of each channel. Drifts that make the
    /// matrix indefinite by rounding are left out, and offsets as well where that is not enough.
    pub fn new(effects: &States, sigma: f64, drifts: &[&[Process]]) -> Self {
        let with = |sigma: f64, drifts: &[&[Process]]| {
            let scales = scales(effects, sigma, drifts);
            let factor = matrix(effects, &scales, drifts).factorised()?;
            let drift = drifts.iter().flat_map(|own| own.iter());
            let of_drifts: f64 = drift.map(|drift| effects.knots.log_determinant(drift)).sum();
            let log_determinant = effects.log_determinant + factor.log_determinant + of_drifts;
            Some(Self { scales, factor, log_determinant })
        };
        with(sigma, drifts).or_else(|| with(sigma, &[])).or_else(|| with(0.0, &[])).unwrap_or_else(|| {
            let (scales, factor) = (vec![0.0; effects.count()], Factor::identity(effects.count()));
            let log_determinant = effects.log_determinant;
            Self { scales, factor, log_determinant }
        })
    }

    /// Xᵀ Σ⁻¹ X.
    pub fn products(&self, x: &CrossProducts) -> DMatrix<f64> {
        self.less(x, &self.eliminated(x))
    }

    /// Xᵀ Σ⁻¹ X, given Yᵀ.
    pub fn less(&self, x: &CrossProducts, eliminated: &DMatrix<f64>) -> DMatrix<f64> {
        let mut products = x.plain.clone();
        let count = eliminated.nrows();
        for part in eliminated.as_slice().chunks(PART * count.max(1)) {
            add_product(&mut products, -1.0, &by_columns(part, count), &by_rows(part, count));
        }
        products
    }

    /// Yᵀ: a row a column of X.
    pub fn eliminated(&self, x: &CrossProducts) -> DMatrix<f64> {
        let mut states = x.states.clone();
        for (mut state, scale) in states.column_iter_mut().zip(&self.scales).filter(|(_, s)| **s != 1.0) {
            state *= *scale;
        }
        let width = states.nrows();
        self.factor.forward(states.as_mut_slice(), width);
        states
    }
}

/// Σ⁻¹ of a single channel, and the rows of its blocks, by which further columns are multiplied.
#[derive(Clone, Debug)]
pub struct ChannelPrecision {
    /// D⁻¹ and Z.
    pub effects: Arc<RandomEffects>,
    /// Σ⁻¹.
    pub precision: Precision,
}

impl ChannelPrecision {
    /// Σ⁻¹ x of one column.
    pub fn apply(&self, x: &[f64]) -> Vec<f64> {
        let scales = &self.precision.scales;
        let mut u = self.effects.cross_products(&[vec![x]]).states.as_slice().to_vec();
        u.iter_mut().zip(scales).for_each(|(u, scale)| *u *= scale);
        self.precision.factor.solve(&mut u);
        u.iter_mut().zip(scales).for_each(|(u, scale)| *u *= scale);
        let mut out = x.to_vec();
        self.effects.weighted_remainder(&u, &mut out);
        out
    }
}

/// S.
fn scales(effects: &States, sigma: f64, drifts: &[&[Process]]) -> Vec<f64> {
    let of_drift = if drifts.is_empty() { 0.0 } else { 1.0 };
    let mut scales = vec![of_drift; effects.count()];
    effects.offsets.iter().for_each(|state| scales[*state] = sigma);
    scales
}

/// S Zᵀ D⁻¹ Z S + P.
fn matrix(effects: &States, scales: &[f64], drifts: &[&[Process]]) -> Skyline {
    let mut matrix = effects.gram.scaled(scales);
    effects.offsets.iter().for_each(|state| matrix.add(*state, *state, 1.0));
    if drifts.is_empty() {
        // Of scale zero: they count as nothing.
        effects.of_drifts().for_each(|state| matrix.add(state, state, 1.0));
    }
    for (channel, drifts) in drifts.iter().enumerate() {
        for (process, drift) in drifts.iter().enumerate() {
            let first = channel * effects.processes;
            add_precision(&mut matrix, effects, first, (process, drifts.len()), drift);
        }
    }
    matrix
}

/// Adds a drift's precision; `first` is the channel's first state at a knot.
fn add_precision(
    matrix: &mut Skyline,
    effects: &States,
    first: usize,
    (process, count): (usize, usize),
    drift: &Process,
) {
    let (states, signs) = parts(process, count);
    let mut add = |(knot, other): (usize, usize), value: f64| {
        let [start, begin] = [knot, other].map(|knot| effects.of_knots[knot] + first);
        for (row, signed) in states.clone().zip(&signs) {
            // Each pair once: the matrix mirrors what is off its diagonal.
            let end = if knot == other { row + 1 } else { states.end };
            let entries = matrix.entries(start + row, begin + states.start..begin + end);
            entries.iter_mut().zip(&signs).for_each(|(entry, also)| *entry += signed * also * value);
        }
    };
    add((0, 0), 1.0 / (drift.sigma * drift.sigma));
    let transitions = effects.knots.transitions(drift);
    let each = transitions.flat_map(|(kept, q, times)| std::iter::repeat_n((kept, q), times));
    for (before, (kept, q)) in each.enumerate() {
        add((before, before), kept * kept / q);
        add((before + 1, before), -kept / q);
        add((before + 1, before + 1), 1.0 / q);
    }
}

/// A drift as a sum of the `count` states of a knot, by their places and signs: the first is what the others leave of the
/// sum.
fn parts(process: usize, count: usize) -> (Range<usize>, Vec<f64>) {
    match process {
        0 => (0..count, (1..=count).map(|state| if state < count { -1.0 } else { 1.0 }).collect()),
        _ => (process - 1..process, vec![1.0]),
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use nalgebra::DVector;

    use super::{
        super::{
            Span, flicker,
            knots::Knots,
            random_effects::{ChannelBlocks, Columns},
            sparse_rows::SparseRows,
        },
        *,
    };

    /// Distance of the knots, s.
    const SPACING: f64 = 2.5;

    /// Anything but one.
    pub const SIGMA: f64 = 0.8;
    pub const DRIFTS: [Process; 2] = [Process { time: 8.0, sigma: 0.9 }, Process { time: 150.0, sigma: 2.0 }];

    /// Blocks of some channels with two offsets that begin and end at different times, and one block that holds nothing.
    pub struct Toy {
        pub times: Vec<f64>,
        pub channels: Vec<ChannelBlocks>,
    }

    impl Toy {
        pub fn new(blocks: usize, channels: usize) -> Self {
            let times = (0..blocks).map(|k| 0.6 * k as f64).collect();
            let channel = |at: usize| {
                let mut offsets = SparseRows::default();
                for block in 0..blocks {
                    let course = |offset: usize| 0.3 + (0.7 * block as f64 + (offset + at) as f64).sin();
                    let counts = |offset: &usize| match offset {
                        0 => block < blocks / 2,
                        _ => block > blocks / 3,
                    };
                    offsets.push((0..2).filter(counts).map(|offset| (offset, course(offset))));
                }
                let weight = |block: usize| if block == 2 { 0.0 } else { 1.0 + ((block + at) % 3) as f64 };
                ChannelBlocks { weights: (0..blocks).map(weight).collect(), offsets }
            };
            Self { times, channels: (0..channels).map(channel).collect() }
        }

        /// Of the first channel.
        pub fn precision(&self, drifts: &[Process]) -> ChannelPrecision {
            let effects = self.effects(drifts.len());
            let precision = Precision::new(&effects.states, SIGMA, &[drifts]);
            ChannelPrecision { effects, precision }
        }

        pub fn effects(&self, processes: usize) -> Arc<RandomEffects> {
            Arc::new(RandomEffects::new(Knots::at(&self.times, SPACING), self.channels.clone(), 2, processes))
        }

        /// Σ by its definition, over the blocks that hold something, and these, channel below channel.
        fn covariance(&self, drifts: &[Process]) -> (DMatrix<f64>, Vec<usize>) {
            let blocks = self.times.len();
            let at = |row: usize| (row / blocks, row % blocks);
            let measured: Vec<usize> = (0..blocks * self.channels.len())
                .filter(|row| self.channels[at(*row).0].weights[at(*row).1] > 0.0)
                .collect();
            let knots = ((self.times[blocks - 1] / SPACING).ceil() as usize + 1).max(2);
            let hat = |block: usize, knot: usize| {
                (1.0 - (self.times[block] / SPACING - knot as f64).abs()).max(0.0)
            };
            let shared = |row: usize, offset: usize| {
                let (channel, block) = at(row);
                let mut row = self.channels[channel].offsets.row(block);
                row.find(|(own, _)| *own == offset).map_or(0.0, |(_, u)| u)
            };
            let sigma = DMatrix::from_fn(measured.len(), measured.len(), |i, j| {
                let ((one, a), (other, b)) = (at(measured[i]), at(measured[j]));
                let mut sum: f64 = (0..2)
                    .map(|offset| SIGMA * SIGMA * shared(measured[i], offset) * shared(measured[j], offset))
                    .sum();
                for drift in drifts.iter().filter(|_| one == other) {
                    for (p, q) in (0..knots).flat_map(|p| (0..knots).map(move |q| (p, q))) {
                        let apart = SPACING * p.abs_diff(q) as f64;
                        sum += hat(a, p) * hat(b, q) * drift.sigma.powi(2) * (-apart / drift.time).exp();
                    }
                }
                if i == j { sum + 1.0 / self.channels[one].weights[a] } else { sum }
            });
            (sigma, measured)
        }

        /// Xᵀ Σ⁻¹ X and ln |Σ|, by their definition.
        pub fn products(&self, x: &[DMatrix<f64>], drifts: &[Process]) -> (DMatrix<f64>, f64) {
            let (sigma, measured) = self.covariance(drifts);
            let blocks = self.times.len();
            let rows: Vec<_> = measured.iter().map(|row| x[row / blocks].row(row % blocks)).collect();
            let all = DMatrix::from_rows(&rows);
            let factor = sigma.cholesky().unwrap();
            (all.tr_mul(&factor.solve(&all)), factor.ln_determinant())
        }
    }

    /// The columns of a matrix.
    pub fn slices(x: &DMatrix<f64>) -> Columns<'_> {
        x.as_slice().chunks_exact(x.nrows()).collect()
    }

    /// Some columns over the blocks, channel by channel.
    pub fn columns(toy: &Toy, count: usize) -> Vec<DMatrix<f64>> {
        let value =
            |at: usize, block: usize, column: usize| ((block * (column + 2) + 5 * at) as f64 * 0.3).cos();
        let of =
            |at: usize| DMatrix::from_fn(toy.times.len(), count, |block, column| value(at, block, column));
        (0..toy.channels.len()).map(of).collect()
    }

    #[test]
    fn products_are_those_of_the_covariance_by_its_definition() {
        for (blocks, channels) in [(5, 1), (5, 2), (40, 1), (40, 3)] {
            let toy = Toy::new(blocks, channels);
            let x = columns(&toy, 4);
            let of: Vec<Columns<'_>> = x.iter().map(slices).collect();
            for drifts in [&DRIFTS[..], &DRIFTS[..1], &[]] {
                let effects = toy.effects(drifts.len());
                let products = effects.cross_products(&of);
                let precision = Precision::new(&effects.states, SIGMA, &vec![drifts; channels]);
                let (expected, log_determinant) = toy.products(&x, drifts);
                let found = precision.products(&products);
                assert!((&found - &expected).amax() < 1e-9, "{blocks} {channels} {}", drifts.len());
                assert!((precision.log_determinant - log_determinant).abs() < 1e-9);
                let some = [3, 1];
                let picked = precision.products(&products.picked(&some));
                assert!((picked - expected.select_rows(&some).select_columns(&some)).amax() < 1e-9);
            }
        }
    }

    #[test]
    fn a_weighted_column_is_that_of_the_inverse_covariance() {
        let toy = Toy::new(40, 1);
        let precision = toy.precision(&DRIFTS);
        let (sigma, measured) = toy.covariance(&DRIFTS);
        let x = DVector::from_fn(40, |k, _| ((k * k) as f64).sin());
        let found = DVector::from_vec(precision.apply(x.as_slice())).select_rows(&measured);
        assert!((sigma * found - x.select_rows(&measured)).amax() < 1e-9);
    }

    #[test]
    fn means_over_spans_are_weighed_by_their_covariance() {
        let spans: Vec<Span> = vec![0.0..4.0, 6.0..6.5, 6.5..9.0, 40.0..90.0];
        let drifts = [10.0, 100.0, 1000.0].map(|time| Process { time, sigma: 1.3 });
        let own = |span: &Span| 2.0 / (span.end - span.start);
        let left =
            |span: &Span| drifts.iter().map(|d| d.mean_given_ends(span.end - span.start).1).sum::<f64>();
        let weights = spans.iter().map(|span| 1.0 / (own(span) + left(span))).collect();
        let channel = ChannelBlocks { weights, offsets: SparseRows::empty(4) };
        let effects = RandomEffects::new(Knots::over(&spans, &drifts), vec![channel], 0, 3);
        let precision = Precision::new(&effects.states, 0.0, &[&drifts]);
        let white = DVector::from_fn(4, |k, _| own(&spans[k]));
        let covariance = flicker::covariance_of(&spans, &drifts) + DMatrix::from_diagonal(&white);
        let x = DMatrix::from_fn(4, 2, |k, column| ((3 * k + column) as f64).cos());
        let expected = x.tr_mul(&covariance.clone().cholesky().unwrap().solve(&x));
        let found = precision.products(&effects.cross_products(&[slices(&x)]));
        assert!((found - expected).amax() < 1e-10);
        assert!((precision.log_determinant - covariance.determinant().ln()).abs() < 1e-10);
    }

    #[test]
    fn offsets_and_drifts_that_are_zero_leave_white_noise() {
        let toy = Toy::new(40, 2);
        let x = columns(&toy, 3);
        let effects = toy.effects(2);
        let products = effects.cross_products(&x.iter().map(slices).collect::<Vec<_>>());
        let none = Precision::new(&effects.states, 0.0, &[]);
        assert_eq!(none.products(&products), products.plain);
        // Numbers that are none leave what can be computed.
        let broken = [Process { time: 8.0, sigma: f64::NAN }, DRIFTS[1]];
        let found = Precision::new(&effects.states, SIGMA, &[&broken, &DRIFTS]);
        let without = Precision::new(&effects.states, SIGMA, &[]);
        assert_eq!(found.products(&products), without.products(&products));
    }
}
