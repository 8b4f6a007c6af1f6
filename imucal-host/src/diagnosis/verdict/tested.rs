//! What is asked of the best set of effects: what its residual still follows, what it closes, and what could stand in its place.

use rayon::prelude::*;

use super::{
    credible,
    shares::{self, Closed},
};
use crate::{
    diagnosis::{
        error::DiagnosisError,
        finding::Place,
        location::{covariate::Covariate, covariates, score_test, score_test::Following},
        search::stepwise::Solution,
        settings::LocationSettings,
    },
    effect::Effect,
    recording::SensorKind,
};

/// What was asked of the best set of effects.
pub(super) struct Tested {
    pub(super) drivers: Vec<Covariate>,
    /// Covariates that the residual of the best set may depend on.
    pub(super) after: Vec<Following>,
    pub(super) closed: Closed,
    pub(super) standings: Vec<credible::Standing>,
}

impl Tested {
    pub(super) fn of(
        Solution { linear, best, .. }: &Solution<'_>,
        progress: &dyn Fn(&str),
    ) -> Result<Self, DiagnosisError> {
        let drivers = covariates::drivers(linear.scene, &linear.weighing.given);
        let after = score_test::score_tests_refitted(linear, &best.set, &best.noise, &drivers)?;
        progress("drivers tested");
        let remainder =
            most_followed(&after, &linear.scene.settings.location).map_or(0.0, |following| following.size);
        let closed = shares::closed(linear, &best.set, &best.noise, remainder)?;
        progress("held out");
        let standing = |cause: &&'static Effect| credible::standing(linear, best, cause);
        let standings = best.set.par_iter().map(standing).collect::<Result<_, _>>()?;
        progress("alternatives judged");
        Ok(Self { drivers, after, closed, standings })
    }

    /// What the residual follows most, if it follows anything.
    pub(super) fn left(&self, by: &LocationSettings) -> Option<&Following> {
        most_followed(&self.after, by)
    }

    /// Sensors whose residual follows something.
    pub(super) fn following(&self, by: &LocationSettings) -> Vec<SensorKind> {
        let follows = |kind: &SensorKind| {
            let mut of_sensor = self.after.iter().filter(|following| following.kind == *kind);
            of_sensor.any(|following| is_followed(following, self.after.len(), by))
        };
        SensorKind::ALL.into_iter().filter(follows).collect()
    }
}

/// A covariate is followed beyond what chance makes of so many tests.
pub(super) fn is_followed(following: &Following, tests: usize, by: &LocationSettings) -> bool {
    following.p_value * tests as f64 <= by.p_value
}

fn most_followed<'f>(all: &'f [Following], by: &LocationSettings) -> Option<&'f Following> {
    all.iter().find(|following| is_followed(following, all.len(), by))
}

/// Covariates that are followed; `explained` is the size of what the causes explain.
pub(super) fn places(following: &[Following], explained: f64, by: &LocationSettings) -> Vec<Place> {
    let explainable = following.iter().map(|f| f.size).fold(explained.max(f64::MIN_POSITIVE), f64::max);
    let place = |f: &Following| Place {
        sensor: f.kind.prefix().to_owned(),
        driver: f.driver.clone(),
        share: (f.size / explainable).min(1.0),
        p_value: (f.p_value * following.len() as f64).min(1.0),
        detail: f.detail.clone(),
    };
    let mut places: Vec<Place> =
        following.iter().filter(|f| is_followed(f, following.len(), by)).map(place).collect();
    places.sort_by(|a, b| b.share.total_cmp(&a.share));
    places
}
