//! Mechanisms of a robot's sensors that no catalogue of ours has, of two kinds: those that a formula over drivers can say,
//! and those that neither catalogue nor formula can.

use std::sync::LazyLock;

use crate::{
    blind::outside::{BEYOND_FORMULAS, OUTSIDE},
    effect::Effect,
    recording::SensorKind,
};

mod aliasing;
mod battery;
mod dead_time;
mod knee;
mod preisach;
mod product;
mod soft_limit;
mod telegraph;

/// Mechanisms of the rig's trials that a formula says.
const OF_RIG: [&str; 6] = ["cross_cubic", "crosstalk", "dead_zone", "motion_heat", "temp_cross", "temp_rate"];

/// A formula over drivers says what they do: of inputs, temperature, its rate and recent motion, and their products, a
/// power, a dead zone, a knee, a hyperbolic tangent or a lag.
pub static SPOKEN: LazyLock<Vec<Effect>> = LazyLock::new(|| {
    let mut list = of_rig(&OF_RIG);
    for family in [knee::effect, product::effect, soft_limit::effect] {
        list.extend(SensorKind::ALL.map(family));
    }
    list
});

/// No such formula says what they do: they remember, jump by chance, or hide between the samples.
pub static UNSPOKEN: LazyLock<Vec<Effect>> = LazyLock::new(|| {
    let mut list = of_rig(&BEYOND_FORMULAS);
    for family in [aliasing::effect, battery::effect, dead_time::effect, preisach::effect, telegraph::effect]
    {
        list.extend(SensorKind::ALL.map(family));
    }
    list
});

fn of_rig(names: &[&str]) -> Vec<Effect> {
    let is_named =
        |effect: &&Effect| effect.id.rsplit_once('.').is_some_and(|(_, name)| names.contains(&name));
    OUTSIDE.iter().filter(is_named).cloned().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        effect::CATALOGUE,
        simulator::{
            Dose,
            robot::{RobotKind, RobotScene},
        },
    };

    #[test]
    fn each_alters_its_sensor_and_no_other_and_is_not_in_the_catalogue() {
        let quiet = RobotScene {
            kind: RobotKind::Legged,
            duration: 60.0,
            noise: false,
            counts: false,
            ..RobotScene::default()
        };
        let healthy = quiet.real("healthy.csv").unwrap();
        assert_eq!((SPOKEN.len(), UNSPOKEN.len()), (27, 21));
        for mechanism in SPOKEN.iter().chain(UNSPOKEN.iter()) {
            assert!(CATALOGUE.iter().all(|effect| effect.id != mechanism.id));
            let doses = vec![Dose::sized(mechanism, 1.0, 5, 60.0)];
            let altered = RobotScene { doses, ..quiet.clone() }.real("altered.csv").unwrap();
            for kind in SensorKind::ALL {
                let same = altered.sensor(kind) == healthy.sensor(kind);
                assert_eq!(same, !mechanism.sensors.contains(&kind), "{} {kind}", mechanism.id);
            }
        }
    }
}
