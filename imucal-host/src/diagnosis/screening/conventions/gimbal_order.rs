//! Encoders read in another order, sign, unit or about other axes than the rig turns: all sensors disagree at once.
//!
//! Looked for only where some triad's samples hardly follow what the rig says it was given. Each of the orders of the
//! axes, of the columns, of the signs and units is then replayed, and the one is named under which all triads follow.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::pairs::Pairs;
use crate::{
    effect::{Machine, Truth},
    recording::{GIMBALS, Recording, SensorKind, check::integrity::Integrity, manifest::Axis},
    simulator::{Motion, gimbal::direction, programme::wrap, recent::Recent, truth::on_rig},
};

/// A triad follows where K v + b leaves no more than this share of its variance.
pub(crate) const FOLLOWS: f64 = 0.1;
/// Rows that are replayed.
const ROWS: usize = 250;
/// Rates are estimated from readings this far before and after, s.
const REACH: f64 = 0.01;
/// Of orders that leave as much as the best, within this factor and share, the one with the fewest changes is named.
const ALIKE: (f64, f64) = (1.5, 0.003);
/// Steps of the base's heading that are tried, degrees.
const HEADINGS: usize = 5;

const PERMUTATIONS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

/// Where the movement is known from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    Encoders,
    Reference,
    Rests,
}

impl Source {
    fn of(recording: &Recording, motion: &dyn Motion) -> Self {
        match (motion.encoders(0.0), &recording.reference) {
            (Some(_), _) => Self::Encoders,
            (None, Some(_)) => Self::Reference,
            (None, None) => Self::Rests,
        }
    }

    fn words(self) -> &'static str {
        match self {
            Self::Encoders => "the encoders as they are read",
            Self::Reference => "the reference attitude as it is read",
            Self::Rests => "the attitude from gravity at rest and from the gyroscope between rests",
        }
    }

    fn remedy(self) -> &'static str {
        match self {
            Self::Encoders => {
                "no order, sign or unit of the encoders explains it: check what turned the sensor"
            }
            Self::Reference => {
                "check that ref_q* takes the body's axes to north, east, down, scalar first, and the sensors' units and axes"
            }
            Self::Rests => "check the sensors' units, and the order and signs of their axes",
        }
    }
}

/// How encoders might have to be read.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Reading {
    axes: [Axis; 3],
    /// Columns that are the outer, the middle and the inner gimbal's.
    columns: [usize; 3],
    signs: [f64; 3],
    factor: f64,
}

impl Reading {
    /// How many things differ from what the manifest says.
    fn changes(&self, axes: &[Axis; 3]) -> usize {
        usize::from(self.axes != *axes)
            + usize::from(self.columns != [0, 1, 2])
            + self.signs.iter().filter(|sign| **sign < 0.0).count()
            + usize::from(self.factor != 1.0)
    }

    fn words(&self, axes: &[Axis; 3]) -> String {
        let mut parts = Vec::new();
        if self.axes != *axes {
            let name = |axis: &Axis| match axis {
                Axis::X => "\"x\"",
                Axis::Y => "\"y\"",
                Axis::Z => "\"z\"",
            };
            parts.push(format!("[rig] axes = [{}]", self.axes.each_ref().map(name).join(", ")));
        }
        if self.columns != [0, 1, 2] {
            let read: Vec<String> = GIMBALS
                .iter()
                .zip(self.columns)
                .map(|(to, from)| format!("{to} from gimbal_{}", GIMBALS[from]))
                .collect();
            parts.push(format!("columns {}", read.join(", ")));
        }
        let reversed: Vec<&str> =
            GIMBALS.iter().zip(self.signs).filter(|(_, sign)| *sign < 0.0).map(|(name, _)| *name).collect();
        if !reversed.is_empty() {
            parts.push(format!("{} reversed", reversed.join(" and ")));
        }
        if self.factor != 1.0 {
            let unit = if self.factor < 1.0 { "degrees" } else { "radians" };
            parts.push(format!("angles in {unit}"));
        }
        parts.join("; ")
    }

    fn all() -> Vec<Self> {
        let axes = [Axis::X, Axis::Y, Axis::Z];
        let mut all = Vec::new();
        for outer in axes {
            for middle in axes.into_iter().filter(|axis| *axis != outer) {
                for inner in axes.into_iter().filter(|axis| *axis != middle) {
                    for columns in PERMUTATIONS {
                        for signs in 0..8 {
                            let signs = [0, 1, 2].map(|k| if signs >> k & 1 == 1 { -1.0 } else { 1.0 });
                            for factor in [1.0, 1f64.to_radians(), 1f64.to_degrees()] {
                                all.push(Self { axes: [outer, middle, inner], columns, signs, factor });
                            }
                        }
                    }
                }
            }
        }
        all
    }
}

/// What would explain that triads do not follow; `None` where all do.
pub(crate) fn remark(
    recording: &Recording,
    integrity: &Integrity,
    motion: &dyn Motion,
    rows: &[usize],
    truth: &[Truth],
    pairs: &[Option<Pairs>; 3],
) -> Option<String> {
    let left = |pairs: &Pairs| pairs.trusted().moments().unexplained();
    let shares = SensorKind::ALL
        .into_iter()
        .zip(pairs)
        .filter_map(|(kind, pairs)| Some((kind, left(pairs.as_ref()?))));
    let (lost, followed): (Vec<_>, Vec<_>) = shares.partition(|(_, left)| *left > FOLLOWS);
    let compared: Vec<SensorKind> = lost.iter().chain(&followed).map(|(kind, _)| *kind).collect();
    let names: Vec<String> =
        lost.iter().map(|(kind, left)| format!("{kind} ({:.0} %)", 100.0 * left)).collect();
    let source = Source::of(recording, motion);
    let complaint = format!(
        "against {}, much of the samples' variance stays unexplained by any gain and bias: {}",
        source.words(),
        names.join(", ")
    );
    if let [(SensorKind::Mag, _)] = lost[..]
        && !followed.is_empty()
    {
        return Some(match heading(recording, integrity, rows, truth) {
            Some(degrees) => {
                format!("{complaint}; it would follow if the base pointed {degrees}° east of north")
            }
            None => format!("{complaint}; check [site] field_ned_ut and what stands near the rig"),
        });
    }
    lost.first()?;
    let axes: Option<[Axis; 3]> = motion.rig().axes.and_then(|axes| axes.try_into().ok());
    let best = axes.and_then(|axes| {
        best(recording, integrity, motion, &axes, rows, truth, &compared).map(|best| (axes, best))
    });
    Some(match best {
        Some((axes, (reading, left))) => format!(
            "{complaint}; {:.1} % would if the encoders were read so: {}",
            100.0 * left,
            reading.words(&axes)
        ),
        None => format!("{complaint}; {}", source.remedy()),
    })
}

/// The reading under which all triads follow, with the share it leaves.
fn best(
    recording: &Recording,
    integrity: &Integrity,
    motion: &dyn Motion,
    axes: &[Axis; 3],
    rows: &[usize],
    truth: &[Truth],
    kinds: &[SensorKind],
) -> Option<(Reading, f64)> {
    let encoders = recording.gimbal.as_ref()?;
    let place = motion.place();
    let stride = rows.len().div_ceil(ROWS).max(1);
    let reach = (REACH / recording.median_interval()?).round().max(1.0) as usize;
    let about = |row: usize| [row.saturating_sub(reach), row, (row + reach).min(encoders.len() - 1)];
    let known = |row: usize| encoders[row].iter().all(|angle| angle.is_finite());
    let chosen: Vec<(usize, &Truth)> = rows
        .iter()
        .copied()
        .zip(truth)
        .filter(|(row, _)| about(*row).into_iter().all(known))
        .step_by(stride)
        .collect();
    let at: Vec<usize> = chosen.iter().map(|(row, _)| *row).collect();
    let left = |reading: &Reading| {
        let replayed = |(row, truth): &(usize, &Truth)| {
            let mut machine = Machine::exact(reading.axes.map(direction));
            let [before, _, after] = about(*row);
            let span = recording.time[after] - recording.time[before];
            for ((gimbal, column), sign) in machine.gimbals.iter_mut().zip(reading.columns).zip(reading.signs)
            {
                let angle = |row: usize| sign * reading.factor * encoders[row][column];
                // A reading that is wrapped is so in its own unit.
                gimbal.angle = angle(*row);
                gimbal.rate = wrap(angle(after) - angle(before)) / span;
            }
            on_rig(truth.time, &machine, &place, truth.temperature, &mut Recent::default())
        };
        let truth: Vec<Truth> = chosen.iter().map(replayed).collect();
        let shares = kinds.iter().map(|kind| {
            let pairs = Pairs::of(recording, integrity, *kind, &at, &truth);
            // Where nothing moves any more, nothing is explained.
            pairs.map_or(1.0, |pairs| pairs.trusted().moments().unexplained())
        });
        shares.fold(0.0f64, f64::max)
    };
    let ranked: Vec<(Reading, f64)> =
        Reading::all().into_par_iter().map(|reading| (reading, left(&reading))).collect();
    let least = ranked.iter().map(|(_, left)| *left).fold(f64::INFINITY, f64::min);
    ranked
        .into_iter()
        .filter(|(_, left)| *left <= ALIKE.0 * least + ALIKE.1 && *left < FOLLOWS)
        .min_by_key(|(reading, _)| reading.changes(axes))
}

/// The heading of the base, whole degrees, that lets the magnetometer follow.
fn heading(recording: &Recording, integrity: &Integrity, rows: &[usize], truth: &[Truth]) -> Option<i32> {
    let left = |degrees: f64| {
        let turn = imucal_core::rotation::exp(&(Vector3::z() * degrees.to_radians()));
        let turned: Vec<Truth> = truth
            .iter()
            .map(|truth| {
                let c_t_n = truth.c_p_n * truth.c_t_p;
                Truth { b_t: c_t_n.tr_mul(&turn.tr_mul(&(c_t_n * truth.b_t))), ..*truth }
            })
            .collect();
        Pairs::of(recording, integrity, SensorKind::Mag, rows, &turned)
            .map(|pairs| pairs.trusted().moments().unexplained())
    };
    let tried =
        (-180..180).step_by(HEADINGS).filter_map(|degrees| Some((degrees, left(f64::from(degrees))?)));
    let (degrees, left) = tried.min_by(|a, b| a.1.total_cmp(&b.1))?;
    (left < FOLLOWS).then_some(degrees)
}
