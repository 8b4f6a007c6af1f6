//! The catalogue of effects for people, from the catalogue itself.

use super::{measure::plain, prose::hanging};
use crate::{
    effect::{CATALOGUE, Effect, Parameter, Role, Stage},
    recording::SensorKind,
};

/// All effects, in the order of the chain, and a user's own.
pub fn catalogue(own: &[&'static Effect]) -> String {
    let entries: Vec<String> = CATALOGUE.iter().chain(own.iter().copied()).map(entry).collect();
    entries.join("\n")
}

/// One effect: where it acts, what it is, its parameters, what it is mistaken for.
pub fn entry(effect: &Effect) -> String {
    let mut text = format!("{}\n", effect.id);
    let sensors: Vec<&str> = effect.sensors.iter().map(|kind| kind.prefix()).collect();
    let sensors =
        if sensors.len() == SensorKind::ALL.len() { "all sensors".to_owned() } else { sensors.join(", ") };
    text += &hanging("  acts on:  ", &format!("{}; seen by {sensors}", place(effect.act.stage())));
    text += &hanging("  what:     ", effect.words.cause);
    text += &hanging("  to do:    ", effect.words.remedy);
    text += &hanging("  needs:    ", effect.words.needs);
    let alike = |a: &Parameter, b: &Parameter| sizes(a) == sizes(b);
    for group in effect.parameters.chunk_by(alike) {
        let names: Vec<&str> = group.iter().map(|parameter| parameter.name.as_str()).collect();
        text += &hanging("  size:     ", &format!("{}: {}", names.join(", "), sizes(&group[0])));
    }
    for other in &effect.confusables {
        let parted = if other.parted_by.is_empty() {
            String::new()
        } else {
            format!("; distinguish by: {}", other.parted_by)
        };
        text += &hanging("  or else:  ", &format!("{}{parted}", other.id));
    }
    text
}

/// What a stage of the chain is, in words.
fn place(stage: Stage) -> &'static str {
    match stage {
        Stage::Rig => "how the rig stands and turns",
        Stage::Clock => "the time that rig and sensors share",
        Stage::Field => "the fields at the sensor",
        Stage::Sensor => "the triad's response",
        Stage::Signal => "noise and limit before the converter",
        Stage::Data => "samples behind the converter",
    }
}

/// Usual size of a parameter, what matters, and what is plausible.
fn sizes(parameter: &Parameter) -> String {
    let unit = if parameter.unit == "-" { String::new() } else { format!(" {}", parameter.unit) };
    match parameter.role {
        Role::Amplitude => format!(
            "usually {}{unit}, matters from {}{unit}",
            plain(parameter.prior_scale),
            plain(parameter.material)
        ),
        Role::Shape { usual } => format!(
            "usually {}{unit}, plausible from {} to {}{unit}",
            plain(usual),
            plain(parameter.range.0),
            plain(parameter.range.1)
        ),
        Role::Detail { usual } => format!(
            "0 until a strong effect shows it, then about {}{unit}, plausible to {}{unit}",
            plain(usual),
            plain(parameter.range.1)
        ),
        Role::Instant { share } => {
            format!("a time, in simulations at about {:.0} % of the run", 100.0 * share)
        }
        Role::Choice => format!("0 to {:.0}; 0 is none", parameter.range.1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::find;

    #[test]
    fn every_effect_is_printed_with_its_parameters_and_all_that_is_said_of_it() {
        let text = catalogue(&[]);
        let ids: Vec<&str> = text.lines().filter(|line| !line.is_empty() && !line.starts_with(' ')).collect();
        let expected: Vec<&str> = CATALOGUE.iter().map(|effect| effect.id.as_str()).collect();
        assert_eq!(ids, expected);
        for effect in CATALOGUE.iter() {
            let flat = entry(effect).split_whitespace().collect::<Vec<_>>().join(" ");
            for words in [effect.words.cause, effect.words.remedy, effect.words.needs] {
                assert!(flat.contains(words), "{}: {words}", effect.id);
            }
            assert!(
                effect
                    .parameters
                    .iter()
                    .all(|p| flat.contains(&p.name) && (p.unit == "-" || flat.contains(&p.unit)))
            );
            assert!(
                effect
                    .confusables
                    .iter()
                    .all(|other| flat.contains(&other.id) && flat.contains(other.parted_by))
            );
        }
    }

    #[test]
    fn parameters_of_one_size_stand_together() {
        let text = entry(find("acc.warmup").unwrap());
        assert!(text.starts_with("acc.warmup\n  acts on:  the triad's response; seen by acc\n"), "{text}");
        assert!(text.contains("x, y, z: usually 0.02000 m/s^2, matters from 0.004000 m/s^2\n"), "{text}");
        assert!(text.contains("tau: usually 150.0 s, plausible from 15.00 to 1500 s\n"), "{text}");
    }
}
