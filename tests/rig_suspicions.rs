//! Sensors on a simulated rig whose model leaves something out: none is accepted with entries that are off by more than their
//! standard errors allow, and healthy ones are hardly ever suspected.

use std::sync::OnceLock;

use imucal_core::rotation::exp;
use imucal_host::{
    calibrate::{Calibration, FitSummary, Options, Status, calibrate, outcome::SensorOutcome},
    effect,
    recording::{Recording, SensorKind, Triple},
    simulator::{Dose, Simulation},
};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

/// Seeds of healthy recordings, and those of each fault.
const HEALTHY: std::ops::Range<u64> = 700..760;
const FAULTY: std::ops::Range<u64> = 700..706;
/// Standard errors by which an entry of an accepted sensor may differ from that without the fault: 2.5 of what is left once the
/// fault is estimated are not material.
const OFF: f64 = 6.0;

/// Effects of the catalogue at their usual size that no model of a rig's ladder has, in groups. Of the accelerometer's quadratic and
/// cubic terms, which one has, a warning speaks (`tests/nonlinear`).
const EFFECTS: [(&str, &[&str]); 5] = [
    (
        "gains that differ by sign; gyroscope, magnetometer: quadratic and cubic terms",
        &[
            "acc.scale_asymmetry",
            "gyr.scale_asymmetry",
            "gyr.scale_quadratic",
            "gyr.scale_cubic",
            "mag.scale_asymmetry",
            "mag.scale_quadratic",
            "mag.scale_cubic",
        ],
    ),
    ("accelerometer: a bias that drifts, or settles after switching on", &["acc.bias_drift", "acc.warmup"]),
    ("accelerometer: hysteresis", &["acc.hysteresis"]),
    (
        "magnetometer: a field that drifts, a scale that follows temperature, soft iron on a gimbal",
        &["mag.field_drift", "mag.temp_scale", "mag.gimbal_soft_iron_outer", "mag.gimbal_soft_iron_middle"],
    ),
    (
        "gimbal axes that are not at right angles: accelerometer and magnetometer",
        &["rig.axis_nonorthogonality"],
    ),
];

fn recording(seed: u64, id: Option<&str>) -> Recording {
    let plain = Simulation { seed, rate: 50.0, ..Simulation::default() };
    let dose = |id: &str| Dose::sized(effect::find(id).expect("an effect"), 1.0, seed, 600.0);
    let simulation = Simulation { doses: id.map(dose).into_iter().collect(), ..plain };
    simulation.record("rig.csv").expect("a possible recording")
}

fn calibrated(recording: &Recording) -> Calibration {
    calibrate(recording, &Options { multipliers: vec![4.0], ..Options::default() }, &|_| {})
}

/// Values of a sensor from half-way on, altered.
fn alter(recording: &mut Recording, kind: SensorKind, by: &Matrix3<f64>) {
    let half = recording.rows() / 2;
    let of = |triple: &mut Option<Triple>| {
        let values = &mut triple.as_mut().expect("recorded").values;
        values[half..].iter_mut().for_each(|value| *value = by * *value);
    };
    match kind {
        SensorKind::Acc => of(&mut recording.acc),
        SensorKind::Gyr => of(&mut recording.gyr),
        SensorKind::Mag => of(&mut recording.mag),
    }
}

/// Largest difference of the entries of two fits, in standard errors of the first.
fn difference(fit: &FitSummary, healthy: &FitSummary) -> f64 {
    let of = |a: f64, b: f64, std: f64| if std > 0.0 { (a - b).abs() / std } else { 0.0 };
    let gain = fit.triad.gain.zip_zip_map(&healthy.triad.gain, &fit.gain_std, of).max();
    fit.triad.bias.zip_zip_map(&healthy.triad.bias, &fit.bias_std, of).max().max(gain)
}

/// How many sensors ended how.
#[derive(Clone, Copy, Debug, Default)]
struct Count {
    refused: usize,
    suspect: usize,
    accepted: usize,
    /// Largest difference of an accepted one.
    off: f64,
}

impl Count {
    /// Takes in the calibration of a faulty recording, and that of the same without the fault.
    fn take(&mut self, kinds: &[SensorKind], faulty: &Calibration, healthy: &Calibration) {
        for kind in kinds {
            let [faulty, healthy] = [faulty, healthy].map(|all| all.sensor(*kind).expect("recorded"));
            match faulty.status() {
                Status::Refused => self.refused += 1,
                Status::Suspect => self.suspect += 1,
                Status::Accepted => {
                    self.accepted += 1;
                    let fits = faulty.accepted().zip(healthy.passed());
                    self.off = self.off.max(fits.map_or(f64::INFINITY, |(a, b)| difference(a, b)));
                }
            }
        }
    }

    /// Of two faults together.
    fn and(self, other: Self) -> Self {
        Self {
            refused: self.refused + other.refused,
            suspect: self.suspect + other.suspect,
            accepted: self.accepted + other.accepted,
            off: self.off.max(other.off),
        }
    }
}

/// The sensors that an effect acts on: one of the rig on all poses.
fn kinds(id: &str) -> Vec<SensorKind> {
    let own =
        SensorKind::ALL.into_iter().filter(|kind| id.starts_with(&kind.to_string())).collect::<Vec<_>>();
    if own.is_empty() { vec![SensorKind::Acc, SensorKind::Mag] } else { own }
}

/// Calibrations of the rig without a fault, by all seeds; made once.
fn healthy() -> &'static [Calibration] {
    static HEALTHY: OnceLock<Vec<Calibration>> = OnceLock::new();
    HEALTHY.get_or_init(|| FAULTY.into_par_iter().map(|seed| calibrated(&recording(seed, None))).collect())
}

/// Counts of a fault over all seeds, where `faulty` makes the recording of a seed.
fn counted(kinds: &[SensorKind], faulty: impl Fn(u64) -> Recording + Sync) -> Count {
    let faulty: Vec<_> = FAULTY.into_par_iter().map(|seed| calibrated(&faulty(seed))).collect();
    let mut count = Count::default();
    for (faulty, healthy) in faulty.iter().zip(healthy()) {
        count.take(kinds, faulty, healthy);
    }
    count
}

#[test]
fn no_sensor_of_a_faulty_rig_or_unit_is_accepted_with_wrong_entries() {
    let of_group = |(name, ids): (&'static str, &[&str])| {
        let counts = ids.iter().map(|id| counted(&kinds(id), |seed| recording(seed, Some(id))));
        (name, counts.fold(Count::default(), Count::and))
    };
    let altered = |kinds: &[SensorKind], by: Matrix3<f64>| {
        counted(kinds, |seed| {
            let mut recording = recording(seed, None);
            kinds.iter().for_each(|kind| alter(&mut recording, *kind, &by));
            recording
        })
    };
    let mut all: Vec<(&str, Count)> = EFFECTS.into_iter().map(of_group).collect();
    let gains = SensorKind::ALL.map(|kind| altered(&[kind], Matrix3::identity() * 1.01));
    let gains = gains.into_iter().fold(Count::default(), Count::and);
    all.push(("a gain that is 1 % larger from half-way on, of each sensor", gains));
    let slip = exp(&(Vector3::new(0.6, 0.64, 0.48) * 1f64.to_radians()));
    all.push(("the unit slips by 1° half-way: all three sensors", altered(&SensorKind::ALL, slip)));
    println!("| fault | refused | suspect | accepted | accepted ones off by at most, standard errors |");
    println!("| --- | --- | --- | --- | --- |");
    for (name, Count { refused, suspect, accepted, off }) in &all {
        let off = if *accepted > 0 { format!("{off:.1}") } else { "–".into() };
        println!("| {name} | {refused} | {suspect} | {accepted} | {off} |");
    }
    for (name, count) in &all {
        assert!(count.off < OFF, "{name}: {count:?}");
    }
}

#[test]
fn healthy_sensors_on_a_rig_are_hardly_suspected() {
    let all: Vec<Calibration> =
        HEALTHY.into_par_iter().map(|seed| calibrated(&recording(seed, None))).collect();
    let outcomes: Vec<&SensorOutcome> = all.iter().flat_map(|calibration| &calibration.sensors).collect();
    let suspect: Vec<_> = outcomes.iter().filter(|outcome| outcome.status() == Status::Suspect).collect();
    println!("| no fault | 0 | {} | {} | – |", suspect.len(), outcomes.len() - suspect.len());
    assert!(outcomes.iter().all(|outcome| outcome.status() != Status::Refused));
    // One in a thousand; two of 180 would be a chance of 1 %.
    let found: Vec<_> = suspect.iter().flat_map(|outcome| &outcome.suspicions).collect();
    assert!(suspect.len() < 2, "{found:?}");
}

#[test]
fn few_poses_on_a_rig_are_warned_of_by_three_equations_each() {
    let mut fewest = usize::MAX;
    for seconds in [60, 100, 140] {
        let mut short = recording(FAULTY.start, None);
        for triple in [&mut short.acc, &mut short.gyr, &mut short.mag].into_iter().flatten() {
            triple.values[50 * seconds..].fill(Vector3::repeat(f64::NAN));
        }
        let calibration = calibrated(&short);
        let acc = calibration.sensor(SensorKind::Acc).expect("recorded");
        let Some(fit) = acc.passed() else { continue };
        let warned = calibration.warnings.iter().any(|warning| warning.contains("degrees of freedom"));
        assert_eq!(warned, 3 * fit.observations < 2 * fit.parameters, "{seconds} s: {}", fit.observations);
        fewest = fewest.min(fit.observations);
    }
    assert!(fewest < 14, "fewer poses than parameters: {fewest}");
}

#[test]
fn encoders_that_count_the_other_way_leave_no_sensor_accepted_in_a_mirrored_frame() {
    for gimbal in 1..3 {
        let mut recording = recording(FAULTY.start, None);
        let angles = recording.gimbal.as_mut().expect("a rig");
        angles.iter_mut().for_each(|angles| angles[gimbal] = -angles[gimbal]);
        let calibration = calibrated(&recording);
        for outcome in &calibration.sensors {
            assert_ne!(outcome.status(), Status::Accepted, "gimbal {gimbal}: {}", outcome.kind);
        }
    }
}
