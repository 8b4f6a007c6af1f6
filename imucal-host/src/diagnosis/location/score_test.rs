//! Whether a sensor's residual follows a driver: score tests, and evidence with a noise of its own.

use nalgebra::{DMatrix, SymmetricEigen, Vector3};
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::{covariate::Covariate, covariates::TIME, periodogram};
use crate::{
    diagnosis::{
        error::DiagnosisError,
        library::evidence::{Projected, log_evidence},
        mixed_model::{
            augmented_normal::AugmentedNormal,
            design::{Design, Signature},
            noise::{NEAR, Noise},
        },
        residual::{block::Means, forward_model::ForwardModel},
        search::linearisation::Linearisation,
    },
    effect::Effect,
    recording::SensorKind,
};

/// Directions that keep less than this share of their information are others by another name, and do not count.
pub const RETAINED: f64 = 1e-4;

/// How a sensor's residual follows a driver.
#[derive(Clone, Debug, PartialEq)]
pub struct Following {
    /// Sensor.
    pub kind: SensorKind,
    /// Driver.
    pub driver: String,
    /// The function and axis that it follows most.
    pub detail: String,
    /// Whitened squared size of what follows it, less what noise alone would give.
    pub size: f64,
    /// Probability of as much by noise, this test alone.
    pub p_value: f64,
}

/// How each sensor follows each driver once the baseline and `set` are fitted, the surest first.
pub fn following(
    linear: &Linearisation<'_>,
    set: &[&'static Effect],
    noise: &Noise,
    drivers: &[Covariate],
) -> Result<Vec<Following>, DiagnosisError> {
    let fitted = linear.fitted(set);
    let precisions = linear.precisions(noise);
    let augmented = AugmentedNormal::new(&linear.design, &precisions, &fitted);
    let kinds = linear.scene.kinds.iter();
    let pairs: Vec<(SensorKind, &Covariate)> = kinds
        .flat_map(|kind| drivers.iter().map(move |driver| (*kind, driver)))
        .filter(|(kind, driver)| !driver.columns(*kind).is_empty())
        .collect();
    let follow = |(kind, driver): &(SensorKind, &Covariate)| {
        let normal = augmented.with(&signatures(*kind, driver, noise));
        let every: Vec<usize> = (0..normal.score.len()).collect();
        let (first, others) = every.split_at(fitted.len());
        follow(linear.scene, *kind, driver, &Projected::new(&normal, first, others)?)
    };
    let mut found: Vec<Following> = pairs.par_iter().map(follow).collect::<Result<_, _>>()?;
    sort(&mut found);
    Ok(found)
}

/// As [`following`], but what would show in a quieter noise is judged again by its evidence, with a noise estimated
/// with it: a gap that nothing explains has been taken for drift or scatter. The odds of noise alone are a bound of the
/// probability that noise would do as much.
pub fn score_tests_refitted(
    linear: &Linearisation<'_>,
    set: &[&'static Effect],
    noise: &Noise,
    drivers: &[Covariate],
) -> Result<Vec<Following>, DiagnosisError> {
    let by = &linear.scene.settings.location;
    let mut found = following(linear, set, noise, drivers)?;
    let suspects = following(linear, set, &noise.quieter(), drivers)?;
    let suspects = |slow: bool, most: usize| {
        suspects.iter().filter(move |f| f.p_value < by.suspect && f.is_slow() == slow).take(most)
    };
    let again = |suspect: &Following| {
        let driver = drivers.iter().find(|driver| driver.name == suspect.driver)?;
        Some(judged(linear, set, noise, suspect.kind, driver, 1))
    };
    let tested: Vec<&Following> =
        suspects(true, by.slow_suspects).chain(suspects(false, by.other_suspects)).collect();
    let again: Vec<Following> = tested.into_par_iter().filter_map(again).collect::<Result<_, _>>()?;
    for again in again {
        if let Some(own) = found.iter_mut().find(|f| f.kind == again.kind && f.driver == again.driver)
            && again.p_value < own.p_value
        {
            *own = again;
        }
    }
    let precisions = linear.precisions(noise);
    for kind in &linear.scene.kinds {
        if let Some((driver, choices)) = periodogram::beat(linear, set, &precisions, *kind) {
            found.push(judged(linear, set, noise, *kind, &driver, choices)?);
        }
    }
    sort(&mut found);
    Ok(found)
}

/// A driver, chosen among so many, in addition to a set, by the evidence that it adds with a noise of its own.
fn judged(
    linear: &Linearisation<'_>,
    set: &[&'static Effect],
    noise: &Noise,
    kind: SensorKind,
    driver: &Covariate,
    choices: usize,
) -> Result<Following, DiagnosisError> {
    let (mut design, fitted) = with_driver(linear, set, kind, driver, noise);
    let every: Vec<usize> = (0..design.size).collect();
    let mut groups = linear.groups(set, &linear.fitted(set));
    // The other sensors do not show it.
    design.channels.retain(|channel| channel.kind == kind);
    let others = linear.products(noise).picked(None, &linear.fitted(set));
    let products = linear.weighing.products(&design, noise, &every).with_others(others);
    let alone = noise.normal(&products.picked(None, &every[..fitted]), fitted);
    let before = log_evidence(&alone, noise, linear.baseline.len(), &groups)?;
    let mut refitted = noise.clone();
    refitted.sensors[kind as usize] = linear.weighing.fit(&products, kind, &every, noise, &NEAR);
    let normal = refitted.normal(&products, design.size);
    groups.push(every[fitted..].to_vec());
    let gain =
        log_evidence(&normal, &refitted, linear.baseline.len(), &groups)? - before - (choices as f64).ln();
    let gain = if driver.name == TIME { gain - linear.scene.settings.location.time_gain } else { gain };
    let projected = Projected::new(&normal, &every[..fitted], &every[fitted..])?;
    let following = follow(linear.scene, kind, driver, &projected)?;
    Ok(Following { p_value: libm::exp(-gain.max(0.0)), ..following })
}

fn sort(found: &mut [Following]) {
    found.sort_by(|a, b| a.p_value.total_cmp(&b.p_value).then(b.size.total_cmp(&a.size)));
}

impl Following {
    /// Its driver is as slow as drift, which an estimate of the noise cannot distinguish from it.
    fn is_slow(&self) -> bool {
        self.driver == TIME || self.driver.starts_with("temperature")
    }
}

/// The columns of the baseline and a set, and of a driver of one sensor behind them; with the number of the former.
fn with_driver(
    linear: &Linearisation<'_>,
    set: &[&'static Effect],
    kind: SensorKind,
    driver: &Covariate,
    noise: &Noise,
) -> (Design, usize) {
    let fitted = linear.fitted(set);
    let columns = fitted.iter().map(|id| linear.design.columns[*id]).collect();
    (linear.design.extended(&fitted, columns, &signatures(kind, driver, noise)), fitted.len())
}

/// Signatures of a driver on a sensor, of the size of white noise in a sample.
fn signatures(kind: SensorKind, driver: &Covariate, noise: &Noise) -> Vec<Signature> {
    let usual = noise.usual(kind);
    let columns = driver.columns(kind).into_iter();
    columns.map(|(function, axis)| on(kind, axis, &driver.functions[function].values, usual)).collect()
}

/// A signature on one axis of one sensor.
fn on(kind: SensorKind, axis: usize, values: &[f64], usual: f64) -> Signature {
    let mut means: Means = Default::default();
    let along = |value: &f64| Vector3::from_fn(|k, _| if k == axis { usual * value } else { 0.0 });
    means[kind as usize] = Some(values.iter().map(along).collect());
    means.into()
}

fn follow(
    scene: &ForwardModel<'_>,
    kind: SensorKind,
    driver: &Covariate,
    projected: &Projected,
) -> Result<Following, DiagnosisError> {
    let places: Vec<usize> = (0..projected.score.len()).collect();
    let (statistic, dimensions) = score_test(projected, &places);
    let p_value = match ChiSquared::new(dimensions.max(1) as f64) {
        Ok(distribution) if dimensions > 0 => distribution.sf(statistic / scene.settings.location.caution),
        _ => 1.0,
    };
    let single =
        |place: &usize| projected.score[*place].powi(2) / projected.information[(*place, *place)].max(1e-12);
    let most = places.iter().max_by(|a, b| single(a).total_cmp(&single(b)));
    let column = most.and_then(|most| driver.columns(kind).get(*most).copied());
    let (function, axis) = column.ok_or(DiagnosisError::ScoreTest { covariate: driver.name.clone() })?;
    Ok(Following {
        kind,
        driver: driver.name.clone(),
        detail: match scene.axis(kind, axis) {
            name @ ("x" | "y" | "z") => format!("{name} axis, {}", driver.functions[function].detail),
            name => format!("{name}; {}", driver.functions[function].detail),
        },
        size: (statistic - dimensions as f64).max(0.0),
        p_value,
    })
}

/// sᵀ V⁺ s and the rank of V, over directions that the projection leaves.
pub fn score_test(projected: &Projected, places: &[usize]) -> (f64, usize) {
    let n = places.len();
    let scale = |i: usize| 1.0 / projected.before[places[i]].max(f64::MIN_POSITIVE).sqrt();
    let v =
        DMatrix::from_fn(n, n, |i, j| projected.information[(places[i], places[j])] * scale(i) * scale(j));
    let eigen = SymmetricEigen::new(v);
    let mut sum = 0.0;
    let mut rank = 0;
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > RETAINED {
            let along: f64 =
                vector.iter().enumerate().map(|(i, v)| v * projected.score[places[i]] * scale(i)).sum();
            sum += along * along / value;
            rank += 1;
        }
    }
    (sum, rank)
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::*;
    use crate::{
        diagnosis::mixed_model::design::Normal,
        noise::precision::{
            Precision,
            tests::{DRIFTS, SIGMA, Toy, columns, slices},
        },
    };

    /// The residual of five blocks and five columns, weighed by drift and offsets; the last column is another by twice its
    /// size.
    fn five_blocks() -> (DMatrix<f64>, Normal) {
        let toy = Toy::new(5, 1);
        let mut x = columns(&toy, 5).remove(0);
        let twice = x.column(2) * 2.0;
        x.set_column(3, &twice);
        let effects = toy.effects(DRIFTS.len());
        let products = effects.cross_products(&[slices(&x)]);
        let precision = Precision::new(&effects.states, SIGMA, &[&DRIFTS]);
        let (dense, _) = toy.products(std::slice::from_ref(&x), &DRIFTS);
        (dense, Normal::of(&products, &precision))
    }

    /// What is left of the residual's weighed square by some columns, of dense products.
    fn left(dense: &DMatrix<f64>, by: usize) -> f64 {
        let score: DVector<f64> = dense.view((0, 4), (by, 1)).column(0).into_owned();
        let information = dense.view((0, 0), (by, by)).into_owned();
        dense[(4, 4)] - score.dot(&information.cholesky().unwrap().solve(&score))
    }

    #[test]
    fn a_score_test_is_what_a_covariate_takes_of_the_residual() {
        let (dense, normal) = five_blocks();
        let projected = Projected::new(&normal, &[0, 1], &[2, 3]).unwrap();
        let expected = left(&dense, 2) - left(&dense, 3);
        let (statistic, rank) = score_test(&projected, &[0]);
        assert!((statistic - expected).abs() < 1e-6 * expected && rank == 1, "{statistic} {expected}");
        // The same covariate twice adds nothing.
        let (twice, rank) = score_test(&projected, &[0, 1]);
        assert!((twice - expected).abs() < 1e-6 * expected && rank == 1, "{twice} {expected}");
    }
}
