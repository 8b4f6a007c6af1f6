//! One pair: what is drawn for it, and the label that is sealed.

use serde::{Deserialize, Serialize};

use super::{
    lambda::RobotLambda,
    outside::{SPOKEN, UNSPOKEN},
    own, setting,
};
use crate::{
    blind::{
        case::{Case, SIZES, omission, shaped, sized},
        lambda::{Signal, difference},
        seal::{Nonce, hex},
        setting::logarithmic,
        trial::OwnEffects,
    },
    effect::{Act, CATALOGUE, Effect, Role},
    simulator::{
        Dose, SimulationError,
        random::{Purpose, Random},
        robot::{MismatchKind, RobotKind, RobotScene},
    },
};

/// What an afflicted pair holds, in rounds of this order.
const ROUND: [Content; 16] = [
    Content::Effect,
    Content::Motion,
    Content::Effect,
    Content::Spoken,
    Content::Own,
    Content::Effect,
    Content::Motion,
    Content::Effect,
    Content::Unspoken,
    Content::Effect,
    Content::Spoken,
    Content::Motion,
    Content::Effect,
    Content::Own,
    Content::Unspoken,
    Content::Effect,
];
/// How far a robot departs from its simulator, in multiples of the usual.
const DEPARTURE: (f64, f64) = (0.05, 2.0);
/// Smallest departure that is to be seen, λ, and the largest multiple it is drawn with.
const SEEN: f64 = 200.0;
const LARGEST: f64 = 8.0;

/// What a pair holds in addition to its clocks and its mount.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Content {
    /// Nothing.
    Healthy,
    /// One effect of the catalogue.
    Effect,
    /// Stretches in which the robot moved otherwise than its simulator.
    Motion,
    /// A mechanism from outside the catalogue that a formula says.
    Spoken,
    /// One that no formula says.
    Unspoken,
    /// An effect that a user has written down.
    Own,
}

/// What is sealed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotLabel {
    /// `imucal-blind-robot-label/1`.
    pub format: String,
    /// Makes the label impossible to guess from its hash.
    pub salt: String,
    /// Name of the case.
    pub case: String,
    /// What it holds.
    pub content: Content,
    /// Of the pair.
    pub setting: RobotSetting,
    /// The effect that is there.
    pub effect: Option<RobotPresent>,
    /// How the robot moved otherwise.
    pub mismatch: Option<Departed>,
    /// Drawn, but not to be shown by this pair at any plausible size.
    pub passed_over: Vec<String>,
}

/// What a person may know of the pair: all of it follows from nonce and case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotSetting {
    /// Kind of robot.
    pub machine: String,
    /// Type of the unit.
    pub unit: String,
    /// Rates of the recording and of the simulator's stream, Hz.
    pub rates: [f64; 2],
    /// Length, s.
    pub duration: f64,
    /// How the unit is turned on the body, rad.
    pub mounting: [f64; 3],
    /// The recording's row of t shows the simulator's t + offset, s.
    pub clock_offset: f64,
    /// Rate error of the recording's clock.
    pub clock_rate_error: f64,
    /// Share of rows that are lost.
    pub dropped: f64,
    /// White noise in multiples of the sheet's, by sensor.
    pub white: [f64; 3],
    /// Drift likewise.
    pub drift: [f64; 3],
    /// How it drifts.
    pub drift_kind: [String; 3],
    /// Vibration in multiples of the usual.
    pub vibration: f64,
}

/// An effect that is there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotPresent {
    /// Its id.
    pub effect: String,
    /// Names and values of its parameters.
    pub parameters: Vec<(String, f64)>,
    /// λ with triads, mounts and clock estimated as well.
    pub lambda: f64,
    /// Least λ with one effect of the catalogue on the same sensor taken out as well; of mechanisms that a formula says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lambda_beyond: Option<f64>,
}

/// A movement that the simulator does not know.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Departed {
    /// `slip`, `gait` or `contact`.
    pub kind: String,
    /// In multiples of the usual.
    pub size: f64,
    /// Beginning and end of each stretch on the simulator's clock, s.
    pub stretches: Vec<[f64; 2]>,
    /// λ with triads, mounts and clock estimated as well.
    pub lambda: f64,
}

/// A pair, drawn.
#[derive(Clone, Debug)]
pub struct RobotDrawn {
    /// The pair with what it holds.
    pub scene: RobotScene,
    /// What is sealed.
    pub label: RobotLabel,
}

/// Draws a pair of the set that follows from a nonce, and from the effects that a user has written down.
///
/// # Errors
///
/// [`SimulationError`], as where a formula has no value.
pub fn draw(nonce: &Nonce, case: Case, own: &OwnEffects) -> Result<RobotDrawn, SimulationError> {
    let name = case.name();
    let seed = nonce.seed(&format!("imucal blind robot seed {name}"));
    let mut random = Random::new(seed, Purpose::Case);
    let mut scene = setting::draw(seed, &mut random);
    let content = match case {
        Case::Healthy(_) => Content::Healthy,
        Case::Afflicted(index) => ROUND[index % ROUND.len()],
    };
    let mut label = RobotLabel {
        format: "imucal-blind-robot-label/1".to_owned(),
        salt: hex(&nonce.derive(&format!("imucal blind robot salt {name}"))),
        case: name,
        content,
        setting: setting_of(&scene),
        effect: None,
        mismatch: None,
        passed_over: Vec::new(),
    };
    let pool: Vec<&'static Effect> = match content {
        Content::Healthy => return Ok(RobotDrawn { scene, label }),
        Content::Motion => {
            depart(&mut scene, &mut label, &mut random)?;
            return Ok(RobotDrawn { scene, label });
        }
        Content::Effect => CATALOGUE.iter().filter(|effect| is_drawn(effect)).collect(),
        Content::Spoken => SPOKEN.iter().collect(),
        Content::Unspoken => UNSPOKEN.iter().collect(),
        Content::Own => own::drawn(own).to_vec(),
    };
    affect(&mut scene, &mut label, pool, &mut random)?;
    Ok(RobotDrawn { scene, label })
}

/// An effect that a robot's sensor can have; its clock is drawn anyway.
pub fn is_drawn(effect: &Effect) -> bool {
    let of_rig = effect.needs.gimbals || matches!(effect.act, Act::Rig(_) | Act::Clock(_));
    omission(effect).is_none() && !of_rig
}

fn setting_of(scene: &RobotScene) -> RobotSetting {
    RobotSetting {
        machine: scene.kind.name().to_owned(),
        unit: scene.unit.name().to_owned(),
        rates: [scene.real_rate, scene.sim_rate],
        duration: scene.duration,
        mounting: scene.mounting.into(),
        clock_offset: scene.clock_offset,
        clock_rate_error: scene.clock_rate_error,
        dropped: scene.dropped,
        white: scene.levels.map(|level| level.white),
        drift: scene.levels.map(|level| level.drift),
        drift_kind: scene.levels.map(|level| level.kind.name().to_owned()),
        vibration: scene.vibration,
    }
}

/// One effect of a pool, of a size.
fn affect(
    scene: &mut RobotScene,
    label: &mut RobotLabel,
    mut pool: Vec<&'static Effect>,
    random: &mut Random,
) -> Result<(), SimulationError> {
    let lambda = RobotLambda::new(scene)?;
    let size = |dose: &Dose| -> Result<f64, SimulationError> {
        let run = lambda.run(std::slice::from_ref(dose))?;
        Ok(lambda.of(&difference(&run, &lambda.healthy), &[]))
    };
    random.shuffle(&mut pool);
    for effect in pool {
        let wanted = logarithmic(SIZES, random);
        let unit = shaped(effect, scene.seed, scene.duration, random);
        let Some(dose) = sized(&size, &unit, wanted)? else {
            label.passed_over.push(effect.id.clone());
            continue;
        };
        let names = effect.parameters.iter().map(|parameter| parameter.name.clone());
        label.effect = Some(RobotPresent {
            effect: effect.id.clone(),
            parameters: names.zip(dose.values.iter().copied()).collect(),
            lambda: size(&dose)?,
            lambda_beyond: match label.content {
                Content::Spoken => Some(beyond_catalogue(&lambda, &dose, scene)?),
                _ => None,
            },
        });
        scene.doses = vec![dose];
        break;
    }
    Ok(())
}

/// Least λ of a mechanism with one effect of the catalogue taken out as well: what no effect on the same sensor explains.
fn beyond_catalogue(lambda: &RobotLambda, dose: &Dose, scene: &RobotScene) -> Result<f64, SimulationError> {
    let signal = |dose: Dose| Ok(difference(&lambda.run(&[dose])?, &lambda.healthy));
    let own = signal(dose.clone())?;
    let mut least = lambda.of(&own, &[]);
    let is_rival = |effect: &&Effect| is_drawn(effect) && effect.sensors == dose.effect.sensors;
    for effect in CATALOGUE.iter().filter(is_rival) {
        let usual = Dose::sized(effect, 1.0, scene.seed, scene.duration);
        let amplitudes = (0..usual.values.len()).filter(|at| effect.parameters[*at].role == Role::Amplitude);
        let one = |kept: usize| {
            let mut values = usual.values.clone();
            for at in (0..values.len()).filter(|at| effect.parameters[*at].role == Role::Amplitude) {
                values[at] = if at == kept { effect.parameters[at].prior_scale } else { 0.0 };
            }
            signal(Dose { effect, values })
        };
        let columns: Vec<Signal> = amplitudes.map(one).collect::<Result<_, SimulationError>>()?;
        least = least.min(lambda.of(&own, &columns));
    }
    Ok(least)
}

/// Another motion than the simulator's, large enough to be seen.
fn depart(
    scene: &mut RobotScene,
    label: &mut RobotLabel,
    random: &mut Random,
) -> Result<(), SimulationError> {
    let lambda = RobotLambda::new(scene)?;
    let mut kind = MismatchKind::ALL[random.below(MismatchKind::ALL.len())];
    if (scene.kind, kind) == (RobotKind::Flying, MismatchKind::Contact) {
        kind = MismatchKind::Gait;
    }
    let drawn = logarithmic(DEPARTURE, random);
    let mut size = drawn;
    loop {
        let run = lambda.run_otherwise((kind, size))?;
        let found = lambda.of(&difference(&run, &lambda.healthy), &[]);
        scene.mismatch = Some((kind, size));
        if found >= SEEN || size > LARGEST {
            let stretches = scene.moved()?.mismatch.stretches;
            label.mismatch = Some(Departed {
                kind: kind.name().to_owned(),
                size,
                stretches: stretches.iter().map(|stretch| stretch.span.into()).collect(),
                lambda: found,
            });
            return Ok(());
        }
        // Where no bump lies in the stretches there is no contact to miss: then it slips.
        if size > 0.5 * LARGEST && kind == MismatchKind::Contact {
            (kind, size) = (MismatchKind::Slip, drawn);
        } else {
            size *= 2.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_case_follows_from_nonce_and_name_and_holds_what_its_round_says() {
        let nonce = Nonce::parse("12").unwrap();
        let own = OwnEffects::default();
        let label = |index| draw(&nonce, Case::Afflicted(index), &own).unwrap().label;
        for index in [1, 3, 4, 8] {
            let label = label(index);
            assert_eq!(label.content, ROUND[index]);
            match label.content {
                Content::Motion => assert!(label.effect.is_none() && label.mismatch.unwrap().lambda >= SEEN),
                _ => {
                    let present = label.effect.unwrap();
                    assert!((SIZES.0 * 0.6..SIZES.1 * 1.6).contains(&present.lambda), "{present:?}");
                    assert!(
                        present.lambda_beyond.is_none_or(|beyond| beyond <= present.lambda),
                        "{present:?}"
                    );
                    assert_eq!(present.lambda_beyond.is_some(), ROUND[index] == Content::Spoken);
                }
            }
        }
        assert_eq!(label(1), label(1));
        let healthy = draw(&nonce, Case::Healthy(0), &own).unwrap();
        assert!(healthy.label.effect.is_none() && healthy.scene.doses.is_empty());
        assert_ne!(healthy.label.salt, draw(&nonce, Case::Healthy(1), &own).unwrap().label.salt);
    }

    #[test]
    fn drawn_are_effects_of_sensors_without_gimbals_rig_and_clock() {
        let drawn = |id: &str| is_drawn(crate::effect::find(id).unwrap());
        for id in ["acc.lever_arm", "gyr.g_sensitivity", "mag.field_gradient", "gyr.temp_bias"] {
            assert!(drawn(id), "{id}");
        }
        for id in ["clk.time_offset", "rig.wobble", "mag.motor_current", "acc.bias", "gyr.axis_swap"] {
            assert!(!drawn(id), "{id}");
        }
    }
}
