//! Noise of rows that follow from means over spans of time, which rows share, whitened by a Kalman filter.
//!
//! ```text
//! r_i = Σ_k B_ik e_k + C_i c + √ρ (Σ_k L_ik f_k + G_i g + n_i),   V = V₀ + ρ V₁ = L Lᵀ
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | e_k | error of the mean over span k, three axes: white, and drift that spans share; the unit is the white noise of one second |
//! | c, g | errors that all rows share, each of a covariance |
//! | f_k | three errors of span k, independent, of unit variance |
//! | n_i | error of a row alone |
//! | B, C, L, G | how a row follows each |
//!
//! The filter's state is the drift's Gauss–Markov processes ([`super::process`]), c, g, and e and f of those spans that rows to come
//! follow from: of turns from one rest to the next two at a time. A row's innovation over its standard deviation is the whitened row.
//! Cost and memory are linear in rows where few spans are open at a time, and quadratic in the state. Source: the innovations form of the
//! likelihood, Harvey, Forecasting, Structural Time Series Models and the Kalman Filter (1989), 3.4. Not modelled: axes that err alike.

use nalgebra::{DMatrix, DVector, Vector3};

use super::{Noise, Span, flicker, interval::Whitening, process::Process};
use filter::Filter;

mod filter;

/// Index of a span, and how a row follows three errors of it.
pub type OfSpan = (usize, Vector3<f64>);

/// How a row follows what errs.
#[derive(Clone, Debug, Default)]
pub struct Row {
    /// B.
    pub means: Vec<OfSpan>,
    /// L.
    pub independent: Vec<OfSpan>,
    /// C and G.
    pub shared: [DVector<f64>; 2],
    /// Variance of n.
    pub own: f64,
}

impl Row {
    fn spans(&self) -> impl Iterator<Item = usize> {
        self.means.iter().chain(&self.independent).map(|(span, _)| *span)
    }

    fn latest(&self) -> Option<usize> {
        self.spans().max()
    }
}

/// V₀ and V₁ of such rows.
#[derive(Clone, Debug)]
pub struct StateSpace {
    rows: Vec<Row>,
    /// The order in which the filter takes them: that of their latest span.
    order: Vec<usize>,
    spans: Vec<Span>,
    /// Of each span its place among the open ones; none where no row follows from it.
    places: Vec<Option<usize>>,
    noise: Noise,
    processes: Vec<Process>,
    /// Covariances of c and g.
    shared: [DMatrix<f64>; 2],
}

/// Components of a mean.
const AXES: usize = 3;

impl StateSpace {
    /// Of rows, spans in the order of time that do not overlap, the noise of their means over the white noise's density, and the
    /// covariances of c and g.
    pub fn new(rows: Vec<Row>, spans: Vec<Span>, noise: Noise, shared: [DMatrix<f64>; 2]) -> Self {
        let mut order: Vec<usize> = (0..rows.len()).collect();
        order.sort_by_key(|row| rows[*row].latest());
        let places = places(&rows, &order, spans.len());
        let mut of = Self { rows, order, spans, places, noise, processes: Vec::new(), shared };
        of.processes = flicker::processes(&of.used_spans(), of.noise.drift);
        of
    }

    fn used(&self) -> impl Iterator<Item = (usize, usize)> {
        self.places.iter().enumerate().filter_map(|(span, place)| Some((span, (*place)?)))
    }

    fn used_spans(&self) -> Vec<Span> {
        self.used().map(|(span, _)| self.spans[span].clone()).collect()
    }

    /// Aᵀ times how the rows follow the three errors of each span that is used.
    fn gathered(&self, influence: &DMatrix<f64>, of: fn(&Row) -> &[OfSpan]) -> DMatrix<f64> {
        let mut at = vec![0; self.spans.len()];
        self.used().enumerate().for_each(|(k, (span, _))| at[span] = AXES * k);
        let mut sum = DMatrix::zeros(AXES * self.used().count(), influence.ncols());
        for (row, own) in self.rows.iter().zip(influence.row_iter()) {
            for (span, by) in of(row) {
                sum.rows_mut(at[*span], AXES).ger(1.0, by, &own.transpose(), 1.0);
            }
        }
        sum
    }

    fn carried_by_shared(&self, influence: &DMatrix<f64>, which: usize) -> DMatrix<f64> {
        let mut sum = DMatrix::zeros(self.shared[which].nrows(), influence.ncols());
        for (row, own) in self.rows.iter().zip(influence.row_iter()) {
            sum.ger(1.0, &row.shared[which], &own.transpose(), 1.0);
        }
        sum.tr_mul(&(&self.shared[which] * &sum))
    }
}

impl Whitening for StateSpace {
    fn whitened(&self, ratio: f64, mut x: [DMatrix<f64>; 2]) -> Option<([DMatrix<f64>; 2], f64)> {
        let mut filter = Filter::new(self, ratio, &x);
        let mut log_determinant = 0.0;
        for row in &self.order {
            filter.enter_until(self.rows[*row].latest());
            log_determinant += filter.take(*row, &mut x)?.ln();
        }
        Some((x, log_determinant))
    }

    fn carried(&self, influence: &DMatrix<f64>) -> [DMatrix<f64>; 2] {
        let mut sums = [0, 1].map(|which| self.carried_by_shared(influence, which));
        let (means, spans) = (self.gathered(influence, |row| &row.means), self.used_spans());
        for axis in 0..AXES {
            let own = means.rows_with_step(axis, spans.len(), AXES - 1).into_owned();
            sums[0] += self.noise.carried(&spans, &own);
        }
        let independent = self.gathered(influence, |row| &row.independent);
        sums[1] += independent.tr_mul(&independent);
        for (row, own) in self.rows.iter().zip(influence.row_iter()) {
            sums[1].ger(row.own, &own.transpose(), &own.transpose(), 1.0);
        }
        sums
    }
}

/// Of each span a place from its first row to its last, which no other has meanwhile.
fn places(rows: &[Row], order: &[usize], spans: usize) -> Vec<Option<usize>> {
    let mut last = vec![None; spans];
    for (at, row) in order.iter().enumerate() {
        rows[*row].spans().for_each(|span| last[span] = Some(at));
    }
    let mut places = vec![None; spans];
    // The row after which each place is free.
    let mut until: Vec<usize> = Vec::new();
    let mut entered = 0;
    for (at, row) in order.iter().enumerate() {
        let end = rows[*row].latest().map_or(0, |latest| latest + 1);
        for span in entered..end {
            let Some(last) = last[span] else { continue };
            let free = until.iter().position(|end| *end < at).unwrap_or(until.len());
            if free == until.len() {
                until.push(last);
            }
            until[free] = last;
            places[span] = Some(free);
        }
        entered = entered.max(end);
    }
    places
}

#[cfg(test)]
mod tests {
    use super::{super::interval::tests::assert_is_as_written_out, *};

    /// Rows between neighbouring spans, one of a span alone, and one that goes back by several; out of order.
    fn rows() -> StateSpace {
        let spans = vec![0.0..4.0, 4.0..9.0, 12.0..52.0, 52.5..53.0, 60.0..61.0, 900.0..930.0];
        let number = |seed: usize| ((7 * seed + 3) as f64).sin();
        let vector = |seed: usize| Vector3::new(number(seed), number(seed + 1), number(seed + 2));
        let ends = [(2, 3), (0, 1), (0, 1), (1, 2), (5, 5), (3, 5), (1, 5)];
        let row = |(k, (from, to)): (usize, (usize, usize))| Row {
            means: vec![(from, vector(k)), (to, vector(k + 11))],
            independent: vec![(from, vector(k + 23) * 0.1)],
            shared: [
                DVector::from_fn(4, |at, _| 0.3 * number(k + 40 + at)),
                DVector::from_fn(2, |at, _| 0.2 * number(k + 60 + at)),
            ],
            own: 0.01 * k as f64,
        };
        let covariance = |size: usize| {
            let root = DMatrix::from_fn(size, size, |i, j| number(5 * i + j));
            &root * root.transpose()
        };
        let noise = Noise { density: Vector3::repeat(1.0), white: 0.3, drift: 0.02 };
        let rows = ends.into_iter().enumerate().map(row).collect();
        StateSpace::new(rows, spans, noise, [covariance(4), covariance(2)])
    }

    /// V₀ and V₁, written out.
    fn dense(of: &StateSpace) -> [DMatrix<f64>; 2] {
        let used: Vec<usize> = of.used().map(|(span, _)| span).collect();
        let between = of.noise.covariance(&of.used_spans());
        let at = |span: usize| used.iter().position(|own| *own == span).unwrap();
        let size = of.rows.len();
        let shared = |which: usize| {
            let by = DMatrix::from_fn(size, of.shared[which].nrows(), |i, k| of.rows[i].shared[which][k]);
            &by * &of.shared[which] * by.transpose()
        };
        let mut parts = [shared(0), shared(1)];
        for (i, one) in of.rows.iter().enumerate() {
            parts[1][(i, i)] += one.own;
            for (j, other) in of.rows.iter().enumerate() {
                for ((k, by), (l, by_other)) in
                    one.means.iter().flat_map(|one| other.means.iter().map(move |other| (one, other)))
                {
                    parts[0][(i, j)] += by.dot(by_other) * between[(at(*k), at(*l))];
                }
                for ((k, by), (l, by_other)) in one
                    .independent
                    .iter()
                    .flat_map(|one| other.independent.iter().map(move |other| (one, other)))
                {
                    parts[1][(i, j)] += if k == l { by.dot(by_other) } else { 0.0 };
                }
            }
        }
        parts
    }

    #[test]
    fn whitening_and_what_is_carried_are_those_of_the_matrix_written_out() {
        let rows = rows();
        assert_is_as_written_out(&rows, &dense(&rows));
    }

    #[test]
    fn of_turns_from_span_to_span_two_are_open_at_a_time() {
        let row = |k: usize| Row {
            means: vec![(k, Vector3::x()), (k + 1, Vector3::y())],
            shared: [DVector::zeros(0), DVector::zeros(0)],
            ..Row::default()
        };
        let spans = (0..30).map(|k| f64::from(k)..f64::from(k) + 0.5).collect();
        let noise = Noise { density: Vector3::repeat(1.0), white: 1.0, drift: 0.0 };
        let none = || DMatrix::zeros(0, 0);
        let of = StateSpace::new((0..29).map(row).collect(), spans, noise, [none(), none()]);
        assert_eq!(of.used().map(|(_, place)| place).max(), Some(1));
    }

    #[test]
    fn rows_without_noise_have_no_factor() {
        let shared = [DVector::zeros(0), DVector::zeros(0)];
        let row = Row { means: vec![(0, Vector3::x())], shared, ..Row::default() };
        let noise = Noise { density: Vector3::repeat(1.0), white: 0.0, drift: 0.0 };
        let of =
            StateSpace::new(vec![row], vec![0.0..1.0], noise, [DMatrix::zeros(0, 0), DMatrix::zeros(0, 0)]);
        assert!(of.whitened(1.0, [DMatrix::zeros(1, 1), DMatrix::zeros(1, 0)]).is_none());
    }
}
