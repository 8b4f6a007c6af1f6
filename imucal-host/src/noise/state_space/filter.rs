//! The Kalman filter of [`super`].

use nalgebra::{DMatrix, DVector};

use super::{AXES, OfSpan, Row, StateSpace};
use crate::noise::{Span, process::Process};

/// What the rows so far leave open of the state: its covariance, and what it is expected to be by each column.
pub(super) struct Filter<'a> {
    of: &'a StateSpace,
    ratio: f64,
    covariance: DMatrix<f64>,
    states: [DMatrix<f64>; 2],
    /// End of the last span that was entered, s.
    time: f64,
    /// Index of the span that is looked at next.
    next: usize,
}

impl<'a> Filter<'a> {
    pub(super) fn new(of: &'a StateSpace, ratio: f64, x: &[DMatrix<f64>; 2]) -> Self {
        let first = AXES * of.processes.len();
        let places = of.used().map(|(_, place)| place + 1).max().unwrap_or(0);
        let size = first + of.shared[0].nrows() + of.shared[1].nrows() + 2 * AXES * places;
        let mut covariance = DMatrix::zeros(size, size);
        for k in 0..first {
            covariance[(k, k)] = of.processes[k / AXES].sigma.powi(2);
        }
        let mut at = first;
        for (shared, times) in of.shared.iter().zip([1.0, ratio]) {
            covariance.view_mut((at, at), shared.shape()).copy_from(&(shared * times));
            at += shared.nrows();
        }
        let states = x.each_ref().map(|x| DMatrix::zeros(size, x.ncols()));
        Self { of, ratio, covariance, states, time: f64::NEG_INFINITY, next: 0 }
    }

    /// Where the errors e and f of a place stand in the state.
    fn at_place(&self, place: usize) -> usize {
        AXES * self.of.processes.len()
            + self.of.shared.iter().map(DMatrix::nrows).sum::<usize>()
            + 2 * AXES * place
    }

    pub(super) fn enter_until(&mut self, latest: Option<usize>) {
        for span in self.next..latest.map_or(0, |latest| latest + 1) {
            if let Some(place) = self.of.places[span] {
                self.enter(&self.of.spans[span], self.at_place(place));
            }
            self.next = span + 1;
        }
    }

    /// Adds the errors of a span to the state, and goes on to its end.
    fn enter(&mut self, span: &Span, at: usize) {
        let length = span.end - span.start;
        if self.time.is_finite() {
            self.pass((span.start - self.time).max(0.0));
        }
        self.covariance.rows_mut(at, 2 * AXES).fill(0.0);
        self.covariance.columns_mut(at, 2 * AXES).fill(0.0);
        self.states.iter_mut().for_each(|states| states.rows_mut(at, 2 * AXES).fill(0.0));
        let shares: Vec<f64> = self.of.processes.iter().map(|process| process.share_of_end(length)).collect();
        let variance = |(process, share): (&Process, &f64)| {
            process.variance_of_mean(length) - (share * process.sigma).powi(2)
        };
        let left: f64 = self.of.processes.iter().zip(&shares).map(variance).sum();
        for axis in 0..AXES {
            self.average(&shares, axis, at + axis);
            self.covariance[(at + axis, at + axis)] += left + self.of.noise.white / length;
            self.covariance[(at + AXES + axis, at + AXES + axis)] = self.ratio;
        }
        self.pass(length);
        for (k, (process, share)) in self.of.processes.iter().zip(&shares).enumerate() {
            let common = process.sigma.powi(2) * share * (1.0 - process.kept(length));
            for axis in 0..AXES {
                self.covariance[(AXES * k + axis, at + axis)] += common;
                self.covariance[(at + axis, AXES * k + axis)] += common;
            }
        }
        self.time = span.end;
    }

    /// Makes an entry of the state the sum of an axis' processes, each times its share.
    fn average(&mut self, shares: &[f64], axis: usize, at: usize) {
        let mut common = DVector::zeros(self.covariance.nrows());
        for (k, share) in shares.iter().enumerate() {
            common.axpy(*share, &self.covariance.column(AXES * k + axis), 1.0);
        }
        common[at] = shares.iter().enumerate().map(|(k, share)| share * common[AXES * k + axis]).sum();
        self.covariance.set_column(at, &common);
        self.covariance.set_row(at, &common.transpose());
        for states in &mut self.states {
            for mut column in states.column_iter_mut() {
                column[at] =
                    shares.iter().enumerate().map(|(k, share)| share * column[AXES * k + axis]).sum();
            }
        }
    }

    /// Lets the processes go on for a time, s.
    fn pass(&mut self, time: f64) {
        for (k, process) in self.of.processes.iter().enumerate() {
            let kept = process.kept(time);
            for at in AXES * k..AXES * (k + 1) {
                self.covariance.row_mut(at).scale_mut(kept);
                self.covariance.column_mut(at).scale_mut(kept);
                self.covariance[(at, at)] += process.innovation(time);
                self.states.iter_mut().for_each(|states| states.row_mut(at).scale_mut(kept));
            }
        }
    }

    /// Whitens a row of each column and learns from it; the variance of its innovation, `None` where that is none.
    pub(super) fn take(&mut self, row: usize, x: &mut [DMatrix<f64>; 2]) -> Option<f64> {
        let by = self.entries(&self.of.rows[row]);
        let mut common = DVector::zeros(self.covariance.nrows());
        for (at, by) in &by {
            common.axpy(*by, &self.covariance.column(*at), 1.0);
        }
        let own = self.ratio * self.of.rows[row].own;
        let variance = own + by.iter().map(|(at, by)| by * common[*at]).sum::<f64>();
        if variance.is_nan() || variance <= 0.0 {
            return None;
        }
        self.covariance.ger(-1.0 / variance, &common, &common, 1.0);
        for (x, states) in x.iter_mut().zip(&mut self.states) {
            for (mut column, mut state) in x.column_iter_mut().zip(states.column_iter_mut()) {
                let innovation = column[row] - by.iter().map(|(at, by)| by * state[*at]).sum::<f64>();
                state.axpy(innovation / variance, &common, 1.0);
                column[row] = innovation / variance.sqrt();
            }
        }
        Some(variance)
    }

    /// How a row follows the state, where it does.
    fn entries(&self, row: &Row) -> Vec<(usize, f64)> {
        let first = AXES * self.of.processes.len();
        let shared = row.shared.iter().flat_map(|by| by.iter()).enumerate();
        let of_spans = |own: &[OfSpan], from: usize| -> Vec<(usize, f64)> {
            let place = |(span, by): &OfSpan| Some((self.of.places[*span]?, *by));
            own.iter()
                .filter_map(place)
                .flat_map(|(place, by)| [0, 1, 2].map(|axis| (self.at_place(place) + from + axis, by[axis])))
                .collect()
        };
        let (means, independent) = (of_spans(&row.means, 0), of_spans(&row.independent, AXES));
        let all = shared.map(|(k, by)| (first + k, *by)).chain(means).chain(independent);
        all.filter(|(_, by)| *by != 0.0).collect()
    }
}
