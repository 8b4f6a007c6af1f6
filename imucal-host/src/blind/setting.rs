//! Under what a trial's recording is made: drawn for each, wider than the simulator's defaults.

use crate::{
    recording::manifest::Axis,
    simulator::{
        Conditions, DriftKind, NoiseLevel, Place, Programme, Simulation, SimulationError, UnitKind,
        random::Random,
    },
};

/// Orders of the gimbals, outermost first.
const AXES: [[Axis; 3]; 6] = [
    [Axis::Z, Axis::Y, Axis::X],
    [Axis::Z, Axis::X, Axis::Y],
    [Axis::Y, Axis::Z, Axis::X],
    [Axis::Y, Axis::X, Axis::Z],
    [Axis::X, Axis::Y, Axis::Z],
    [Axis::X, Axis::Z, Axis::Y],
];
/// Sampling rates, Hz.
const RATES: [f64; 5] = [50.0, 75.0, 100.0, 100.0, 128.0];
/// Lengths, s.
const DURATION: (f64, f64) = (120.0, 650.0);
/// White noise against the sheet's.
const WHITE: (f64, f64) = (0.5, 2.0);
/// Drift against the sheet's.
const DRIFT: (f64, f64) = (0.3, 3.0);
/// Scatter of the rests, degrees.
const SCATTER: (f64, f64) = (0.0005, 0.004);

/// Evenly in its logarithm.
pub(super) fn logarithmic((low, high): (f64, f64), random: &mut Random) -> f64 {
    low * libm::pow(high / low, random.share())
}

/// A recording without effects.
pub(super) fn draw(seed: u64, random: &mut Random) -> Simulation {
    let programme = match random.share() {
        share if share < 0.75 => Programme::Mixed,
        share if share < 0.83 => Programme::MultiPosition,
        share if share < 0.91 => Programme::Thermal,
        _ => Programme::Full,
    };
    // The others last as long as they take, and mixed ones what they are given.
    let duration = logarithmic(DURATION, random);
    fitting(Simulation {
        unit: UnitKind::ALL[random.below(UnitKind::ALL.len())],
        programme,
        axes: AXES[random.below(AXES.len())],
        rate: RATES[random.below(RATES.len())],
        duration: (programme == Programme::Mixed).then_some(duration),
        seed,
        conditions: conditions(random),
        ..Simulation::default()
    })
}

/// As long as can be, if its movements do not fit into the length that was drawn.
fn fitting(simulation: Simulation) -> Simulation {
    match simulation.schedule() {
        Err(SimulationError::TooShort { .. }) => Simulation { duration: Some(DURATION.1), ..simulation },
        _ => simulation,
    }
}

/// Noise of a sensor.
pub(super) fn level(random: &mut Random) -> NoiseLevel {
    NoiseLevel {
        white: logarithmic(WHITE, random),
        drift: logarithmic(DRIFT, random),
        kind: DriftKind::ALL[random.below(DriftKind::ALL.len())],
    }
}

fn conditions(random: &mut Random) -> Conditions {
    let noise = [level(random), level(random), level(random)];
    Conditions { place: Place::draw(random), noise, scatter: logarithmic(SCATTER, random).to_radians() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::{Motion, random::Purpose};

    #[test]
    fn movements_that_do_not_fit_are_given_the_longest_time() {
        let of = |duration| {
            let drawn =
                Simulation { programme: Programme::Mixed, duration: Some(duration), ..Simulation::default() };
            fitting(drawn).schedule().unwrap().duration()
        };
        assert!((of(60.0) - DURATION.1).abs() < 1.0);
        assert!((of(300.0) - 300.0).abs() < 1.0);
    }

    #[test]
    fn recordings_last_two_to_eleven_minutes_and_differ() {
        let mut programmes = Vec::new();
        let mut random = Random::new(4, Purpose::Case);
        for seed in 0..60 {
            let simulation = draw(seed, &mut random);
            let duration = simulation.schedule().unwrap().duration();
            assert!((119.0..651.0).contains(&duration), "{duration} {simulation:?}");
            if !programmes.contains(&simulation.programme.name()) {
                programmes.push(simulation.programme.name());
            }
        }
        assert_eq!(programmes.len(), 4, "{programmes:?}");
    }
}
