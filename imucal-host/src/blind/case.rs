//! One trial: what is drawn for it, and the label that is sealed.

use serde::{Deserialize, Serialize};

use super::{
    lambda::{Lambda, difference, largest},
    outside::OUTSIDE,
    seal::{Nonce, hex},
    setting::{self, logarithmic},
};
use crate::{
    effect::{Act, CATALOGUE, Effect, Part, Role, Spoils, class::class},
    simulator::{
        Dose, Simulation, SimulationError,
        random::{Purpose, Random},
    },
};

/// Sizes, λ.
pub const SIZES: (f64, f64) = (30.0, 3000.0);
/// Afflicted cases come in rounds of this order: effects of the catalogue, none meaning one from outside.
const ROUND: [usize; 20] = [1, 0, 2, 1, 1, 0, 1, 3, 2, 1, 0, 1, 1, 2, 0, 1, 3, 1, 0, 2];
/// A size is as wanted within this share of its logarithm.
const NEAR: f64 = 0.05;
/// A size that cannot be met better, as where something clips or not, is taken within this.
const NEAR_ENOUGH: f64 = 0.4;
/// Runs to find a size.
const TRIES: usize = 14;

/// Which case of a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Case {
    /// Without an effect.
    Healthy(usize),
    /// With one, two or three effects of the catalogue, or one from outside.
    Afflicted(usize),
}

impl Case {
    /// Its name.
    pub fn name(self) -> String {
        match self {
            Self::Healthy(index) => format!("healthy-{index:04}"),
            Self::Afflicted(index) => format!("afflicted-{index:04}"),
        }
    }

    /// The case of a name.
    pub fn find(name: &str) -> Option<Self> {
        let (kind, index) = name.split_once('-')?;
        let index = index.parse().ok()?;
        match kind {
            "healthy" => Some(Self::Healthy(index)),
            "afflicted" => Some(Self::Afflicted(index)),
            _ => None,
        }
    }
}

/// Why an effect of the catalogue is never drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Omission {
    /// The baseline takes it up, in every recording.
    Baseline,
    /// It is a mistake of convention: there or not, of no size.
    Convention,
    /// It is an error of a reference on the body or of a simulator, which a rig has not.
    Reference,
    /// It leaves the mean of the samples as it is, and λ is the size of a mean.
    NoMean,
}

/// Why an effect is not drawn; `None` for those that are.
pub fn omission(effect: &Effect) -> Option<Omission> {
    match effect.part {
        _ if effect.needs.outside || effect.needs.stream => Some(Omission::Reference),
        _ if effect.absorbed => Some(Omission::Baseline),
        Part::TriadTerm | Part::RigTerm(_) | Part::Nuisance(_) => Some(Omission::Baseline),
        Part::Fault(Spoils::Nothing | Spoils::Scale) => Some(Omission::Convention),
        Part::Fault(Spoils::Passage | Spoils::Repeats) => Some(Omission::NoMean),
        Part::Fault(Spoils::BeyondLimit) | Part::Candidate | Part::ClockTerm | Part::ClockRateTerm => None,
    }
}

/// What is sealed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Label {
    /// `imucal-blind-label/1`.
    pub format: String,
    /// Makes the label impossible to guess from its hash.
    pub salt: String,
    /// Name of the case.
    pub case: String,
    /// Of the recording.
    pub setting: Setting,
    /// What is there.
    pub effects: Vec<Present>,
    /// Drawn, but not to be shown by this recording at any plausible size.
    pub passed_over: Vec<String>,
}

/// What a person may know of the recording: all of it follows from nonce and case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setting {
    /// Type of the unit.
    pub unit: String,
    /// What the rig did.
    pub programme: String,
    /// Gimbal axes, outermost first.
    pub axes: String,
    /// Sampling rate, Hz.
    pub rate: f64,
    /// Length, s.
    pub duration: f64,
    /// White noise in multiples of the sheet's, by sensor.
    pub white: [f64; 3],
    /// Drift likewise.
    pub drift: [f64; 3],
    /// How it drifts.
    pub drift_kind: [String; 3],
    /// Scatter of the rests, rad.
    pub scatter: f64,
}

/// An effect that is there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Present {
    /// Its id.
    pub effect: String,
    /// No catalogue has it.
    pub outside: bool,
    /// Names and values of its parameters.
    pub parameters: Vec<(String, f64)>,
    /// λ by sensor.
    pub lambda: [f64; 3],
    /// The largest λ with the other effects' signals projected out as well.
    pub lambda_beside: f64,
}

/// A case, drawn.
#[derive(Debug)]
pub struct Drawn {
    /// The recording with its effects.
    pub simulation: Simulation,
    /// What is sealed.
    pub label: Label,
    /// Measures signals in this recording.
    pub lambda: Lambda,
}

/// Draws a case of the set that follows from a nonce.
///
/// # Errors
///
/// [`SimulationError`]; none is known.
pub fn draw(nonce: &Nonce, case: Case) -> Result<Drawn, SimulationError> {
    draw_among(nonce, case, &[])
}

/// Likewise, with a user's own effects drawn as those of the catalogue are.
///
/// # Errors
///
/// [`SimulationError`], as where a formula has no value.
pub fn draw_among(nonce: &Nonce, case: Case, own: &[&'static Effect]) -> Result<Drawn, SimulationError> {
    let name = case.name();
    let seed = nonce.seed(&format!("imucal blind seed {name}"));
    let mut random = Random::new(seed, Purpose::Case);
    let mut simulation = setting::draw(seed, &mut random);
    let lambda = Lambda::new(&simulation)?;
    let wanted = match case {
        Case::Healthy(_) => None,
        Case::Afflicted(index) => Some(ROUND[index % ROUND.len()]),
    };
    let (pool, count): (Vec<&'static Effect>, usize) = match wanted {
        None => (Vec::new(), 0),
        Some(0) => (OUTSIDE.iter().collect(), 1),
        Some(count) => {
            let all = CATALOGUE.iter().chain(own.iter().copied());
            (all.filter(|effect| omission(effect).is_none()).collect(), count)
        }
    };
    let mut passed_over = Vec::new();
    simulation.doses = doses(&lambda, pool, count, seed, &mut passed_over, &mut random)?;
    let label = Label {
        format: "imucal-blind-label/1".to_owned(),
        salt: hex(&nonce.derive(&format!("imucal blind salt {name}"))),
        case: name,
        setting: setting_of(&simulation, lambda.duration()),
        effects: present(&lambda, &simulation.doses)?,
        passed_over,
    };
    Ok(Drawn { simulation, label, lambda })
}

fn setting_of(simulation: &Simulation, duration: f64) -> Setting {
    let noise = simulation.conditions.noise;
    let axes: String = simulation.axes.iter().map(|axis| format!("{axis:?}").to_lowercase()).collect();
    Setting {
        unit: simulation.unit.name().to_owned(),
        programme: simulation.programme.name().to_owned(),
        axes,
        rate: simulation.rate,
        duration,
        white: noise.map(|level| level.white),
        drift: noise.map(|level| level.drift),
        drift_kind: noise.map(|level| level.kind.name().to_owned()),
        scatter: simulation.conditions.scatter,
    }
}

fn doses(
    lambda: &Lambda,
    mut pool: Vec<&'static Effect>,
    count: usize,
    seed: u64,
    passed_over: &mut Vec<String>,
    random: &mut Random,
) -> Result<Vec<Dose>, SimulationError> {
    let size_of = |dose: &Dose| -> Result<f64, SimulationError> {
        let signal = difference(&lambda.run(std::slice::from_ref(dose))?, &lambda.healthy);
        Ok(largest(&lambda.of(&signal, &[])))
    };
    random.shuffle(&mut pool);
    let mut doses: Vec<Dose> = Vec::new();
    for effect in pool {
        if doses.len() == count {
            break;
        }
        if doses.iter().any(|dose| class(&dose.effect.id) == class(&effect.id)) {
            continue;
        }
        let wanted = logarithmic(SIZES, random);
        let unit = shaped(effect, seed, lambda.duration(), random);
        match sized(&size_of, &unit, wanted)? {
            Some(dose) => doses.push(dose),
            None => passed_over.push(effect.id.clone()),
        }
    }
    Ok(doses)
}

/// An effect of its usual size. Directions are those of [`Dose::sized`], or one parameter alone; shapes and times are
/// drawn from more than the simulator does by itself.
pub(super) fn shaped(effect: &'static Effect, seed: u64, duration: f64, random: &mut Random) -> Dose {
    let mut dose = Dose::sized(effect, if random.share() < 0.5 { -1.0 } else { 1.0 }, seed, duration);
    let roles: Vec<Role> = effect.parameters.iter().map(|parameter| parameter.role).collect();
    let amplitudes: Vec<usize> = (0..roles.len()).filter(|at| roles[*at] == Role::Amplitude).collect();
    if amplitudes.len() > 1 && random.share() < 0.3 {
        let kept = amplitudes[random.below(amplitudes.len())];
        amplitudes.iter().filter(|at| **at != kept).for_each(|at| dose.values[*at] = 0.0);
    }
    let instants: Vec<usize> =
        (0..roles.len()).filter(|at| matches!(roles[*at], Role::Instant { .. })).collect();
    let mut time = duration * random.between(0.1, 0.7);
    for at in instants {
        dose.values[at] = time;
        time += duration * random.between(0.08, 0.9 - 0.8 * time / duration);
    }
    for (value, role) in dose.values.iter_mut().zip(&roles) {
        if let Role::Shape { usual } = role {
            *value = usual * logarithmic((0.4, 2.5), random);
        }
    }
    if matches!(effect.act, Act::Formula(..)) {
        let ranges = effect.parameters.iter().map(|parameter| parameter.range);
        dose.values.iter_mut().zip(ranges).for_each(|(value, (low, high))| *value = value.clamp(low, high));
    }
    dose
}

/// The effect in a size of this λ, which `size_of` measures; `None` where no plausible size has it.
pub(super) fn sized(
    size_of: &dyn Fn(&Dose) -> Result<f64, SimulationError>,
    unit: &Dose,
    wanted: f64,
) -> Result<Option<Dose>, SimulationError> {
    let (mut low, mut high, mut size) = (0.0f64, f64::INFINITY, 1.0f64);
    let mut best: Option<(f64, Dose)> = None;
    for _ in 0..TRIES {
        let Some(dose) = times(unit, size) else { break };
        let found = size_of(&dose)?;
        let miss = libm::log(found / wanted);
        if best.as_ref().is_none_or(|(least, _)| miss.abs() < *least) {
            best = Some((miss.abs(), dose));
        }
        if miss.abs() < NEAR {
            break;
        }
        if miss < 0.0 {
            low = low.max(size)
        } else {
            high = high.min(size)
        }
        // λ grows as the square; where it does not, the bounds are halved.
        size *= libm::sqrt(wanted / found).clamp(0.05, 20.0);
        if size <= low || size >= high {
            size = libm::sqrt(low * high);
        }
    }
    Ok(best.filter(|(miss, _)| *miss < NEAR_ENOUGH).map(|(_, dose)| dose))
}

/// A dose of so many times the amplitudes; `None` where one is not plausible.
fn times(unit: &Dose, size: f64) -> Option<Dose> {
    let mut dose = unit.clone();
    for (value, parameter) in dose.values.iter_mut().zip(&unit.effect.parameters) {
        if parameter.role == Role::Amplitude {
            *value *= size;
            if !(parameter.range.0..=parameter.range.1).contains(value) {
                return None;
            }
        }
    }
    size.is_finite().then_some(dose)
}

fn present(lambda: &Lambda, doses: &[Dose]) -> Result<Vec<Present>, SimulationError> {
    let signal = |dose: &Dose| -> Result<_, SimulationError> {
        Ok(difference(&lambda.run(std::slice::from_ref(dose))?, &lambda.healthy))
    };
    let signals: Vec<_> = doses.iter().map(signal).collect::<Result<_, _>>()?;
    let describe = |(at, dose): (usize, &Dose)| {
        let others: Vec<_> =
            (0..doses.len()).filter(|other| *other != at).map(|k| signals[k].clone()).collect();
        let names = dose.effect.parameters.iter().map(|parameter| parameter.name.clone());
        Present {
            effect: dose.effect.id.clone(),
            outside: OUTSIDE.iter().any(|effect| effect.id == dose.effect.id),
            parameters: names.zip(dose.values.iter().copied()).collect(),
            lambda: lambda.of(&signals[at], &[]),
            lambda_beside: largest(&lambda.of(&signals[at], &others)),
        }
    };
    Ok(doses.iter().enumerate().map(describe).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_case_follows_from_nonce_and_name_and_a_label_from_neither_alone() {
        let nonce = Nonce::parse("12").unwrap();
        let (one, again) =
            (draw(&nonce, Case::Afflicted(2)).unwrap(), draw(&nonce, Case::Afflicted(2)).unwrap());
        assert_eq!(one.label, again.label);
        assert_eq!(one.label.effects.len(), 2);
        assert_ne!(one.label.salt, draw(&nonce, Case::Afflicted(3)).unwrap().label.salt);
        assert_ne!(one.label, draw(&Nonce::parse("13").unwrap(), Case::Afflicted(2)).unwrap().label);
    }

    #[test]
    fn sizes_are_those_drawn_and_effects_of_different_classes() {
        let nonce = Nonce::parse("3").unwrap();
        for (index, wanted) in ROUND.iter().copied().enumerate().take(8) {
            let label = draw(&nonce, Case::Afflicted(index)).unwrap().label;
            assert_eq!(label.effects.len(), wanted.max(1), "{label:?}");
            for effect in &label.effects {
                let size = largest(&effect.lambda);
                assert!((SIZES.0 * 0.6..SIZES.1 * 1.6).contains(&size), "{label:?}");
                assert!(effect.lambda_beside <= size * (1.0 + 1e-9), "{label:?}");
                assert_eq!(effect.outside, wanted == 0, "{label:?}");
            }
        }
        assert!(draw(&nonce, Case::Healthy(0)).unwrap().label.effects.is_empty());
    }

    #[test]
    fn names_are_read_as_they_are_written() {
        for case in [Case::Healthy(3), Case::Afflicted(1234)] {
            assert_eq!(Case::find(&case.name()), Some(case));
        }
        assert_eq!(Case::find("ill-0001"), None);
        assert_eq!(Case::find("healthy"), None);
    }

    #[test]
    fn omitted_are_the_baseline_s_terms_and_what_has_no_size() {
        let omitted = |id: &str| omission(crate::effect::find(id).unwrap());
        assert_eq!(omitted("acc.scale"), Some(Omission::Baseline));
        assert_eq!(omitted("gyr.unit_error"), Some(Omission::Convention));
        assert_eq!(omitted("mag.noise_burst"), Some(Omission::NoMean));
        assert_eq!(omitted("mag.saturation"), None);
        let drawn = CATALOGUE.iter().filter(|effect| omission(effect).is_none()).count();
        assert_eq!(drawn, 60);
    }
}
