//! Which model of a ladder to use, and why: what each rung explains, and how it predicts what it has not seen.

use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use crate::recording::SensorKind;

/// Terms are taken where chance would explain their gain less often than this.
pub const SIGNIFICANT: f64 = 1e-3;

/// One rung of a ladder, as a fit has it.
#[derive(Clone, Debug)]
pub struct Step {
    /// Name of the model.
    pub name: &'static str,
    /// What it adds, in words.
    pub adds: &'static str,
    /// Entries estimated, by index: a model contains another whose entries are all among its own.
    pub entries: Vec<u8>,
    /// Parameters estimated and determined by the observations.
    pub free: usize,
    /// Independent residuals.
    pub residuals: usize,
    /// Sum of their squares.
    pub squared_sum: f64,
    /// Rms residual with the degrees of freedom left, calibrated unit.
    pub rms: f64,
    /// The same of observations left out in turn.
    pub held_out_rms: Option<f64>,
    /// The same of the second half of the recording, by a fit to the first: a trajectory that the fit has not seen.
    pub second_half_rms: Option<f64>,
}

/// A ladder, climbed.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// Which sensor.
    pub kind: SensorKind,
    /// The rungs, lowest first, each with the probability that chance alone explains as much more than the rung it
    /// contains; `None` for one that contains none.
    pub rungs: Vec<(Step, Option<f64>)>,
    /// Name of the rung to use.
    pub chosen: &'static str,
    /// Why.
    pub why: String,
}

/// F-test of a model against one that it contains; `None` where it adds nothing or leaves nothing.
pub fn p_value(lower: &Step, upper: &Step) -> Option<f64> {
    let added = upper.free.checked_sub(lower.free).filter(|n| *n > 0)?;
    let left = upper.residuals.checked_sub(upper.free).filter(|n| *n > 0)?;
    let gained = (lower.squared_sum - upper.squared_sum).max(0.0) / added as f64;
    let f = gained / (upper.squared_sum / left as f64);
    Some(FisherSnedecor::new(added as f64, left as f64).ok()?.sf(f))
}

fn contains(upper: &Step, lower: &Step) -> bool {
    lower.entries.iter().all(|entry| upper.entries.contains(entry))
}

/// The highest rung below `index` that it contains.
fn below(steps: &[Step], index: usize) -> Option<&Step> {
    let upper = steps.get(index)?;
    steps[..index].iter().rev().find(|lower| contains(upper, lower))
}

/// Climbs a ladder: the rung to use is the best at predicting observations left out, among those whose added terms
/// are significant against the best so far (or, where it does not contain that one, against what it contains).
pub fn climb(kind: SensorKind, steps: Vec<Step>) -> Option<Comparison> {
    let mut chosen = steps.first()?;
    let mut why = "no larger model is significant and predicts left-out data better".to_owned();
    for (index, step) in steps.iter().enumerate().skip(1) {
        let reference = if contains(step, chosen) { Some(chosen) } else { below(&steps, index) };
        let p = reference.and_then(|lower| p_value(lower, step));
        let held = step.held_out_rms.zip(chosen.held_out_rms).filter(|(new, old)| new < old);
        if let (Some(p), Some((new, old))) = (p.filter(|p| *p < SIGNIFICANT), held) {
            why = format!(
                "{} adds {} (F-test: p = {p:.1e}) and predicts left-out data better: rms {new:.3e} instead of {old:.3e}",
                step.name, step.adds
            );
            chosen = step;
        }
    }
    let chosen = chosen.name;
    let p_values: Vec<Option<f64>> =
        (0..steps.len()).map(|k| below(&steps, k).and_then(|lower| p_value(lower, &steps[k]))).collect();
    Some(Comparison { kind, rungs: steps.into_iter().zip(p_values).collect(), chosen, why })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(name: &'static str, entries: &[u8], squared_sum: f64, held_out: f64) -> Step {
        Step {
            name,
            adds: "terms",
            entries: entries.to_vec(),
            free: entries.len(),
            residuals: 90,
            squared_sum,
            rms: (squared_sum / (90 - entries.len()) as f64).sqrt(),
            held_out_rms: Some(held_out),
            second_half_rms: None,
        }
    }

    #[test]
    fn a_rung_that_explains_nothing_does_not_hide_the_one_above_it() {
        let steps =
            vec![step("A", &[0], 90.0, 1.0), step("B", &[0, 1], 89.9, 1.01), step("C", &[0, 1, 2], 9.0, 0.4)];
        assert_eq!(climb(SensorKind::Acc, steps).unwrap().chosen, "C");
    }

    #[test]
    fn of_two_branches_the_one_that_predicts_better_is_chosen() {
        let steps =
            vec![step("M", &[0], 90.0, 1.0), step("F", &[0, 1], 50.0, 0.8), step("X", &[0, 2, 3], 9.0, 0.4)];
        let comparison = climb(SensorKind::Mag, steps).unwrap();
        assert_eq!(comparison.chosen, "X");
        assert!(comparison.rungs[1].1.is_some_and(|p| p < 1e-6));
    }

    #[test]
    fn noise_alone_keeps_the_lowest_rung() {
        let steps = vec![step("A", &[0], 90.0, 1.0), step("B", &[0, 1], 88.0, 0.99)];
        assert_eq!(climb(SensorKind::Acc, steps).unwrap().chosen, "A");
    }
}
