//! Order and signs of each triad's axes: `P.axis_swap`.
//!
//! Of the 48 signed permutations P the one is sought for which y = s P v + b leaves least, with any scale s > 0 and bias
//! b. It counts only where the next best leaves many times as much; which is the case as soon as the input has varied
//! along two axes, and along the third no less than the triad's misalignment can imitate.

use nalgebra::Matrix3;

use super::{Conventions, Finding, SURE, pairs::Pairs};
use crate::{diagnosis::reference::moments::Moments, effect::axis_swap, recording::SensorKind};

/// The next best must leave so many times as much.
const MARGIN: f64 = 6.0;
/// The best must leave no more than this share of the samples' variance.
const LEFT: f64 = 0.1;

/// An accelerometer's mean is off by less than this share of gravity, where its axes are right.
const OFF_GRAVITY: f64 = 0.5;

/// How a triad relates to what it was given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scale {
    /// Common scale: output by input.
    pub scale: f64,
    /// Its standard error.
    pub std_error: f64,
}

/// The order of a triad's axes that is unique by a wide margin.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Order {
    code: usize,
    scale: Scale,
    /// Upper bound of the probability that the axes are as they should be.
    p_value: f64,
}

/// Looks at each triad by [`SensorKind::ALL`]; gives the common scales of those that could be estimated.
pub(crate) fn check(pairs: &[Option<Pairs>; 3], found: &mut Conventions) -> [Option<Scale>; 3] {
    let orders = pairs.each_ref().map(|pairs| order(&pairs.as_ref()?.trusted().moments()));
    let codes: Vec<usize> = orders.iter().flatten().map(|order| order.code).collect();
    let turned = codes.first().filter(|first| {
        let proper = axis_swap::signed_permutation(**first).is_some_and(|p| p.determinant() > 0.0);
        **first != 0 && proper && codes.iter().all(|code| code == *first)
    });
    if let Some(code) = turned {
        found.remarks.push(turned_words(*code, codes.len()));
        let least = orders.iter().flatten().map(|order| order.p_value).fold(1.0, f64::min);
        found.turned = Some((*code, least));
    } else {
        for (kind, order) in SensorKind::ALL.into_iter().zip(&orders) {
            let Some(order) = order.filter(|order| order.code != 0 && order.p_value < SURE) else { continue };
            found.findings.extend(finding(kind, order.code, order.p_value));
        }
    }
    orders.map(|order| order.map(|order| order.scale))
}

/// The code under which an accelerometer senses gravity where it should and follows the rest best, where that is not the
/// given one: its axes are others than those of the other sensors. `None` where it shares theirs.
pub(crate) fn against_gravity(pairs: &Pairs, code: usize) -> Option<usize> {
    let (felt, given) = pairs.means();
    let off = |code: usize| {
        axis_swap::signed_permutation(code).map_or(f64::INFINITY, |p| (felt - p * given).norm())
    };
    let most = OFF_GRAVITY * given.norm();
    if off(code) < most {
        return None;
    }
    let moments = pairs.trusted().moments();
    let left = |code: &usize| {
        let p = axis_swap::signed_permutation(*code).unwrap_or_else(Matrix3::identity);
        -(p.transpose() * moments.cross).trace()
    };
    let upright = (0..axis_swap::CODES).filter(|code| off(*code) < most);
    upright.min_by(|a, b| left(a).total_cmp(&left(b)))
}

/// A sensor's axes are those of a code.
pub(crate) fn finding(kind: SensorKind, code: usize, p_value: f64) -> Option<Finding> {
    Finding::new(&format!("{kind}.axis_swap"), &[(Some(code as f64), Some(0.0))], p_value)
}

/// The sensor and code of such a finding; `None` of another one.
pub(crate) fn code_of(finding: &Finding) -> Option<(SensorKind, usize)> {
    let kind = *finding.effect.sensors.first()?;
    let is_swap = finding.effect.id == format!("{kind}.axis_swap");
    Some((kind, finding.parameters.first()?.value.filter(|_| is_swap)? as usize))
}

/// All triads agree on a turn that a mount can have.
fn turned_words(code: usize, triads: usize) -> String {
    let axes = axis_swap::signed_permutation(code).map(|p| spelt(&p)).unwrap_or_default();
    let alone = "the one triad that can be compared reads";
    let all = "all triads that can be compared read";
    format!(
        "{} {axes} of the table: the unit sits turned on the table, or its axes are named otherwise (code {code}); \
         the baseline takes it up; check the mount and [rig] axes",
        if triads == 1 { alone } else { all }
    )
}

/// `(+y, −x, +z)`: the table's axes that x, y, z of a triad lie along.
pub(crate) fn spelt(p: &Matrix3<f64>) -> String {
    let axis = |row: usize| {
        let column = (0..3).find(|column| p[(row, *column)] != 0.0).unwrap_or(row);
        let sign = if p[(row, column)] < 0.0 { '−' } else { '+' };
        format!("{sign}{}", ["x", "y", "z"][column])
    };
    format!("({}, {}, {})", axis(0), axis(1), axis(2))
}

fn order(moments: &Moments) -> Option<Order> {
    let input = moments.input.trace();
    let left = |p: &Matrix3<f64>| {
        let along = (p.transpose() * moments.cross).trace().max(0.0);
        moments.output - along * along / input
    };
    let mut ranked: Vec<(f64, usize, Matrix3<f64>)> = (0..axis_swap::CODES)
        .filter_map(|code| axis_swap::signed_permutation(code).map(|p| (left(&p), code, p)))
        .collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    let [(least, code, p), (next, ..), ..] = ranked[..] else { return None };
    // What K explains beyond a permutation is misalignment: neither counts for the other.
    if next < MARGIN * least || least > LEFT * moments.output {
        return None;
    }
    let healthy = left(&Matrix3::identity());
    let freedom = 3.0 * moments.rows - 7.0;
    let scale = (p.transpose() * moments.cross).trace() / input;
    let std_error = (least / freedom / input).sqrt();
    // A likelihood ratio of x is as rare as 1/x at most (Markov); rows stand for themselves, being seconds apart.
    let p_value = (-0.5 * moments.rows * (healthy / least).ln()).exp();
    Some(Order { code, scale: Scale { scale, std_error }, p_value })
}
