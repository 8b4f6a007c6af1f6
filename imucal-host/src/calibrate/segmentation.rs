//! Which threshold of the rest test to use, and how much that choice matters.
//!
//! Every multiple of the initial rest's variance from 2 to 10 is cut and fitted. The one with the smallest residual
//! among those that keep most of the rests is used; the others say how far the answer moves with the choice.

use std::ops::Range;

use imucal_core::{observation::Rest, triad::Triad};
use rayon::prelude::*;

use super::{acc::rests, thresholds::ThresholdTrial};
use crate::observe::rest::RestDetector;

/// Multiples of the initial rest's variance that are tried.
pub const MULTIPLIERS: [f64; 9] = [2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0];
/// A threshold counts only while it keeps this share of the most rests found at any.
const KEEPS: f64 = 0.8;

/// The rests at one threshold and what the accelerometer's norm makes of them.
#[derive(Clone, Debug)]
pub struct Cut {
    /// Multiple of the reference variance.
    pub multiplier: f64,
    /// The threshold, (m/s²)².
    pub threshold: f64,
    /// Rows of each rest.
    pub rows: Vec<Range<usize>>,
    /// What was observed in each.
    pub rests: Vec<Rest<f64>>,
    /// Quick T9 fit and its rms, where there were enough rests.
    pub fit: Option<(Triad<f64>, f64)>,
}

impl Cut {
    /// The cut's line in the report.
    pub fn trial(&self) -> ThresholdTrial {
        ThresholdTrial {
            multiplier: self.multiplier,
            rests: self.rows.len(),
            acc_gain: self.fit.map(|(triad, _)| triad.gain.diagonal()),
            acc_rms: self.fit.map(|(_, rms)| rms),
            gyr_gain: None,
        }
    }
}

/// Cuts at each multiplier and fits the accelerometer quickly.
pub fn cuts(detector: &RestDetector<'_>, multipliers: &[f64], gravity: f64) -> Vec<Cut> {
    multipliers
        .par_iter()
        .map(|multiplier| {
            let cut = detector.cut(*multiplier);
            let rests: Vec<_> = cut.rests.par_iter().map(|rows| detector.rest(rows)).collect();
            let fit = rests::trial(&rests, gravity);
            Cut { multiplier: cut.multiplier, threshold: cut.threshold, rows: cut.rests, rests, fit }
        })
        .collect()
}

/// Those that keep most of the rests: the ones whose answers may be compared.
pub fn comparable(cuts: &[Cut]) -> impl Iterator<Item = &Cut> + Clone {
    let most = cuts.iter().map(|cut| cut.rows.len()).max().unwrap_or(0);
    cuts.iter().filter(move |cut| cut.rows.len() as f64 >= KEEPS * most as f64)
}

/// The cut to use: the smallest residual; without any fit, the most rests.
pub fn choose(cuts: &[Cut]) -> Option<&Cut> {
    comparable(cuts)
        .filter(|cut| cut.fit.is_some())
        .min_by(|a, b| rms(a).total_cmp(&rms(b)))
        .or_else(|| cuts.iter().max_by_key(|cut| cut.rows.len()))
}

fn rms(cut: &Cut) -> f64 {
    cut.fit.map_or(f64::INFINITY, |(_, rms)| rms)
}
