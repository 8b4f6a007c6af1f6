//! Parameters of the causes with their standard errors.

use nalgebra::{DMatrix, DVector};

use crate::{
    diagnosis::{
        error::DiagnosisError,
        finding::Amount,
        mixed_model::{
            design::{Column, Design, Normal, Signature},
            noise::Noise,
        },
        residual::base_run::Reference,
        search::{linearisation::Linearisation, stepwise::Solution},
    },
    effect::{Effect, Parameter, Role},
    simulator::Dose,
};

/// An amplitude is beyond its range by so many standard errors.
const BEYOND: f64 = 3.0;
/// Prior standard deviation in usual sizes: so loose that it only keeps what the data do not show finite.
const LOOSE: f64 = 1e3;
/// Parts of a jackknife.
const PARTS: usize = 8;
/// An instant was looked for at least as closely as this, s, where no block determines it.
const SCANNED: f64 = 5.0;

/// Parameters of each effect of the best set, shapes among them.
pub fn amounts(explained: &Solution<'_>) -> Result<Vec<Vec<Amount>>, DiagnosisError> {
    amounts_of(explained, &explained.best.set)
}

/// Parameters of some effects of the fit, likewise.
pub fn amounts_of(
    explained: &Solution<'_>,
    asked: &[&'static Effect],
) -> Result<Vec<Vec<Amount>>, DiagnosisError> {
    let (linear, set) = (&explained.linear, &explained.best.set);
    let reference = Reference::new(linear.scene, explained.fit.doses.clone(), &linear.scene.fine)?;
    let dose = |effect: &Effect| explained.fit.doses.iter().find(|dose| dose.effect == effect);
    let shaped = |dose: &Dose| -> Vec<Column> {
        let effect = dose.effect;
        effect.shapes_at(&dose.values).map(|parameter| Column { effect, parameter }).collect()
    };
    let shape_columns: Vec<Column> = set.iter().filter_map(|effect| dose(effect)).flat_map(shaped).collect();
    let signatures: Vec<Signature> = shape_columns
        .iter()
        .map(|column| Ok(Signature::from(reference.signature(column.effect, column.parameter, &[])?)))
        .collect::<Result<_, DiagnosisError>>()?;
    let fitted = linear.fitted(set);
    let columns: Vec<Column> =
        fitted.iter().map(|id| linear.design.columns[*id]).chain(shape_columns.iter().copied()).collect();
    let design = linear.design.extended(&fitted, columns.clone(), &signatures);
    let every: Vec<usize> = (0..design.size).collect();
    let normal = design.normal(&linear.precisions(&explained.best.noise), &every);
    let precision = |column: &Column| {
        let parameter = &column.effect.parameters[column.parameter];
        match parameter.role {
            Role::Instant { .. } => (parameter.prior_scale / SCANNED).powi(2),
            _ => 1.0 / (LOOSE * LOOSE),
        }
    };
    let prior = DVector::from_iterator(columns.len(), columns.iter().map(precision));
    let information = normal.information + DMatrix::from_diagonal(&prior);
    let covariance =
        information.cholesky().ok_or(DiagnosisError::Estimates { columns: columns.len() })?.inverse();
    let mut variances = covariance.diagonal();
    if linear.scene.settings.verdict.errors_from_parts {
        let of_parts = jackknife(linear, &design, &explained.best.noise, &prior);
        variances = variances.zip_map(&of_parts, f64::max);
    }
    let error = |effect: &Effect, parameter: usize| {
        let at = columns.iter().position(|c| c.is_of(effect) && c.parameter == parameter)?;
        Some(variances[at].sqrt() * effect.parameters[parameter].prior_scale)
    };
    Ok(asked
        .iter()
        .map(|effect| {
            let values = dose(effect).map_or(&[][..], |dose| &dose.values);
            let amount = |(at, value): (usize, &f64)| Amount {
                name: effect.parameters[at].name.clone(),
                value: value.is_finite().then_some(*value),
                std_error: error(effect, at),
                unit: effect.parameters[at].unit.clone(),
            };
            // A detail that is not fitted is not estimated; details stand last.
            let is_known = |at: &usize| {
                linear.scene.settings.search.fits_details || effect.details().all(|detail| detail != *at)
            };
            values.iter().enumerate().filter(|(at, _)| is_known(at)).map(amount).collect()
        })
        .collect())
}

/// Variances of all columns' amounts by a jackknife over parts of the recording, each left out in turn: they hold what the
/// model of the noise does not, as the errors of a reference. They are those of Student's t, ν/(ν − 2) as large, since few parts
/// show how far the amounts scatter. Source: Efron and Stein, Ann. Stat. 9 (1981).
fn jackknife(
    linear: &Linearisation<'_>,
    design: &Design,
    noise: &Noise,
    prior: &DVector<f64>,
) -> DVector<f64> {
    let every: Vec<usize> = (0..design.size).collect();
    let duration = linear.scene.duration().max(f64::MIN_POSITIVE);
    let part = |part: usize| {
        let within = |block: usize| linear.scene.blocks[block].time / duration * PARTS as f64;
        let inside = |block: usize| (within(block) as usize).min(PARTS - 1) == part;
        design.normal(&linear.weighing.precisions_within(design, noise, &inside), &every)
    };
    let parts: Vec<Normal> = (0..PARTS).map(part).collect();
    let without = |left_out: usize| {
        let mut information = DMatrix::from_diagonal(prior);
        let mut score = DVector::zeros(design.size);
        for (_, part) in parts.iter().enumerate().filter(|(part, _)| *part != left_out) {
            information += &part.information;
            score += &part.score;
        }
        Some(information.cholesky()?.solve(&score))
    };
    let amounts: Vec<DVector<f64>> = (0..PARTS).filter_map(without).collect();
    let n = amounts.len() as f64;
    let mean = amounts.iter().fold(DVector::zeros(design.size), |sum, own| sum + own) / n.max(1.0);
    let squares = amounts.iter().map(|own| (own - &mean).map(|off| off * off));
    let freedom = n - 1.0;
    let few = if freedom > 2.0 { freedom / (freedom - 2.0) } else { 1.0 };
    squares.fold(DVector::zeros(design.size), |sum, own| sum + own) * (few * freedom.max(0.0) / n.max(1.0))
}

/// An effect is large enough to matter: one of its amplitudes is.
pub fn is_material(effect: &Effect, amounts: &[Amount]) -> bool {
    effect.parameters.iter().zip(amounts).any(|(parameter, amount)| {
        parameter.role == Role::Amplitude
            && amount.value.is_some_and(|value| value.abs() >= parameter.material)
    })
}

/// No amplitude is beyond what the world bounds it to, by more than three standard errors. A magnet held to a magnetometer may
/// be of any strength.
pub fn is_plausible(effect: &Effect, amounts: &[Amount]) -> bool {
    effect.parameters.iter().zip(amounts).all(|(parameter, amount)| {
        let off = amount.std_error.map_or(0.0, |error| BEYOND * error);
        let range = parameter.range.0 - off..=parameter.range.1 + off;
        !parameter.is_bounded || amount.value.is_none_or(|value| range.contains(&value))
    })
}

/// At least one amplitude is further from zero than so many of its standard errors; true where the effect is a product of
/// amplitudes and a shape of either sign, such as a gradient and an arm, since the data know neither factor alone.
pub fn is_sized(effect: &Effect, amounts: &[Amount], errors: f64) -> bool {
    let is_factor =
        |parameter: &Parameter| matches!(parameter.role, Role::Shape { .. }) && parameter.range.0 < 0.0;
    if effect.parameters.iter().any(is_factor) {
        return true;
    }
    effect.parameters.iter().zip(amounts).any(|(parameter, amount)| {
        let far = |value: f64| amount.std_error.is_none_or(|error| value.abs() >= errors * error);
        parameter.role == Role::Amplitude && amount.value.is_some_and(far)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::find;

    #[test]
    fn a_magnet_of_any_strength_is_plausible() {
        let field = |name: &str| Amount {
            name: name.into(),
            value: Some(500.0),
            std_error: Some(0.1),
            unit: "uT".into(),
        };
        let amounts = ["x", "y", "z", "t_start", "t_end"].map(field);
        assert!(is_plausible(find("mag.bias_step").unwrap(), &amounts));
    }

    #[test]
    fn an_amplitude_beyond_its_range_by_more_than_its_errors_is_implausible() {
        let effect = find("acc.gravity_error").unwrap();
        let share = |value: f64, std_error: f64| {
            let (value, std_error) = (Some(value), Some(std_error));
            [Amount { name: "share".into(), value, std_error, unit: "-".into() }]
        };
        for (value, std_error, plausible) in
            [(0.005, 1e-4, true), (-0.031, 1e-3, true), (0.041, 3e-4, false), (-0.041, 3e-4, false)]
        {
            assert_eq!(is_plausible(effect, &share(value, std_error)), plausible, "{value} {std_error}");
        }
    }
}
