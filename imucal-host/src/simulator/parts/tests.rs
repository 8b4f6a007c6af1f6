use super::*;
use crate::{
    effect::find,
    simulator::{Conditions, DriftKind, NoiseLevel, Programme},
};

fn simulation(ids: &[&str]) -> Simulation {
    let mut simulation = Simulation { programme: Programme::Sinusoids, rate: 50.0, ..Simulation::default() };
    ids.iter().for_each(|id| simulation.add(find(id).unwrap(), 1.0).unwrap());
    simulation
}

/// The rows of all parts as those of one recording.
fn joined(parts: Parts<'_>) -> (usize, Recording) {
    let mut parts: Vec<Recording> = parts.map(Result::unwrap).collect();
    let count = parts.len();
    let mut whole = parts.remove(0);
    for part in parts {
        whole.time.extend(part.time);
        for (column, of) in
            [(&mut whole.acc, part.acc), (&mut whole.gyr, part.gyr), (&mut whole.mag, part.mag)]
        {
            column.as_mut().unwrap().values.extend(of.unwrap().values);
        }
        whole.temperature.as_mut().unwrap().extend(part.temperature.unwrap());
        whole.gimbal.as_mut().unwrap().extend(part.gimbal.unwrap());
    }
    (count, whole)
}

#[test]
fn parts_of_any_size_make_up_the_whole_bit_for_bit() {
    let row_by_row = ["acc.lever_arm", "gyr.g_sensitivity", "mag.noise_burst", "acc.saturation"];
    let quiet = Simulation { noise: false, ..simulation(&row_by_row) };
    let noise = [DriftKind::Walk, DriftKind::Quick, DriftKind::Slow].map(|kind| NoiseLevel {
        white: 1.5,
        drift: 2.0,
        kind,
    });
    let conditions = Conditions { noise, ..Conditions::default() };
    let drifting = Simulation { conditions, ..simulation(&[]) };
    for simulation in [simulation(&row_by_row), quiet, drifting] {
        let whole = simulation.record("rig.csv").unwrap();
        for at_a_time in [whole.rows() - 1, 1000, 777] {
            let (count, joined) = joined(Parts::of(&simulation, "rig.csv", at_a_time).unwrap());
            assert_eq!(count, whole.rows().div_ceil(at_a_time));
            assert_eq!(joined, whole, "by {at_a_time} rows");
        }
    }
}

#[test]
fn a_run_with_an_effect_that_looks_at_other_rows_is_one_part() {
    let long = |ids: &[&str]| Simulation { rate: 1000.0, ..simulation(ids) };
    for (ids, parts) in
        [(&[][..], 2), (&["acc.bandwidth"], 1), (&["gyr.stuck_samples"], 1), (&["acc.lever_arm"], 2)]
    {
        let simulation = Simulation { duration: Some(100.0), ..long(ids) };
        let (count, joined) = joined(simulation.parts("rig.csv").unwrap());
        assert_eq!(count, parts, "{ids:?}");
        assert_eq!(joined, simulation.record("rig.csv").unwrap(), "{ids:?}");
    }
}
