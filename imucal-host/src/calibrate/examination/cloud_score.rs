//! Score tests of a cloud: its samples are alike in time, and may be very many.
//!
//! Rows are made some at a time; see [`crate::calibrate::fit::blocked_score`].

use std::ops::Range;

use imucal_core::model::{Model, Parameterisation, RowSink, norm::NormModel};
use nalgebra::{DMatrix, DVector, SVector};

use super::{
    norm_residual::{Shape, Shell, Term, terms},
    residual_driver::Course,
    tested::{Tested, least_of_many},
};
use crate::calibrate::{
    fit::blocked_score::{BlockedScore, Rows},
    suspicion::Follows,
};

/// A cloud's residual follows attitude where it is no likelier than this by chance, and takes this share of its square: while the
/// unit rests its errors are one, and blocks of samples are not as independent of each other as the test takes them (`imucal study trust`: no healthy magnetometer is suspect for it).
const ATTITUDE: (f64, f64) = (1e-9, 0.1);

/// All tests of a cloud's residual that say something; none where the fit's derivatives are not of full rank.
pub(super) fn tested<const P: usize>(
    shell: &Shell<'_>,
    form: Parameterisation<P>,
    courses: &[Course],
) -> Vec<Tested> {
    let samples = shell.points.len();
    let terms = terms(samples, courses, shell.upward.as_deref(), false);
    let columns = Columns::of(&terms);
    // The residual has nothing of the terms of temperature left, and their freedom is gone.
    let independent = samples.saturating_sub(shell.warm);
    let made = |of: Range<usize>| rows(shell, form, &columns, of);
    let Some(score) = BlockedScore::new(samples, independent, &made) else { return Vec::new() };
    let test = |term: &Term<'_>| {
        let (index, least) = (columns.index(term)?, least_of_many(term.follows));
        let score = match term.course.and_then(Course::as_step) {
            Some(step) => score.test_step(index, step.part, least),
            None => score.test(index, least),
        };
        let score = score.filter(|score| {
            term.follows != Follows::Attitude || (score.p < ATTITUDE.0 && score.explained > ATTITUDE.1)
        })?;
        Some(Tested::new(term.follows, term.name.clone(), score))
    };
    terms.iter().filter_map(test).collect()
}

/// Columns of which all terms are made: those of steps share one without a course.
struct Columns<'a>(Vec<Term<'a>>);

impl<'a> Columns<'a> {
    fn of(terms: &[Term<'a>]) -> Self {
        let mut all = Self(Vec::new());
        for term in terms {
            if all.index(term).is_none() {
                all.0.push(Term { course: Self::course(term), ..term.clone() });
            }
        }
        all
    }

    fn course(term: &Term<'a>) -> Option<&'a Course> {
        term.course.filter(|course| course.as_step().is_none())
    }

    fn index(&self, term: &Term<'a>) -> Option<usize> {
        let key = |shape: Shape<'a>, course: Option<&'a Course>| (shape, course.map(std::ptr::from_ref));
        let wanted = key(term.shape, Self::course(term));
        self.0.iter().position(|other| key(other.shape, other.course) == wanted)
    }
}

/// Residuals, derivatives and columns of some samples.
fn rows<const P: usize>(
    shell: &Shell<'_>,
    form: Parameterisation<P>,
    columns: &Columns<'_>,
    of: Range<usize>,
) -> Rows {
    let points = &shell.points[of.clone()];
    let directions = shell.directions(points);
    let mut taken =
        Taken { row: 0, residual: DVector::zeros(points.len()), jacobian: DMatrix::zeros(points.len(), P) };
    NormModel { points, norm: shell.norm, form }.rows(&form.theta(shell.triad), &mut taken);
    Rows {
        residual: taken.residual,
        jacobian: taken.jacobian,
        columns: columns.0.iter().map(|term| term.columns(of.start, &directions)).collect(),
    }
}

/// The rows of a model, as matrices of a length that is known.
struct Taken {
    row: usize,
    residual: DVector<f64>,
    jacobian: DMatrix<f64>,
}

impl<const P: usize> RowSink<f64, P> for Taken {
    const JACOBIAN: bool = true;

    fn row(&mut self, residual: f64, jacobian: &SVector<f64, P>) {
        self.residual[self.row] = residual;
        for (column, derivative) in jacobian.iter().enumerate() {
            self.jacobian[(self.row, column)] = *derivative;
        }
        self.row += 1;
    }
}
