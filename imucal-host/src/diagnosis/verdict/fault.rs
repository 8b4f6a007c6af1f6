//! What a fault of the recording itself adds to the gap: rows that no fit has seen, compared with what the simulator says of
//! them with and without it.
//!
//! ```text
//! φ = (E₀ − E₁ + C) / (E₀ − N)      E = Σ n |ȳ − p̄|² / σ²
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | ȳ, p̄ | means of n spoilt rows of a block, as recorded and as simulated: E₀ without the fault, E₁ with it |
//! | σ | white noise of a sample |
//! | N | what as many blocks of sound rows leave |
//! | C | what the errors of the fit, which has not seen these rows, cost on average |
//!
//! The rows were left out of the baseline's fit and of the search. A burst of noise repeats nothing, and axes or a unit
//! that were mistaken stand in the baseline: these add nothing to it that could be closed. Not modelled: what a baseline
//! would take up of the fault, were it fitted to the spoilt rows as well.

use nalgebra::{DMatrix, Vector3};

use super::shares::{FOLDS, Share};
use crate::{
    diagnosis::{
        finding::{Cause, Gap},
        mixed_model::design::{loosened, places},
        screening::{conventions::Finding, preparation::leave_out},
        search::stepwise::Solution,
    },
    effect::{Act, Effect, SignalRun, Spoils},
    recording::{Recording, SensorKind, Triple},
    simulator::Dose,
};

/// A gap that is smaller than chance would make it so often, in standard deviations, is none.
const SEEN: f64 = 5.0;

/// A fault, on the rows that it has spoilt.
pub struct Fault {
    effect: &'static Effect,
    kind: SensorKind,
    pieces: Vec<Piece>,
    /// σ by axis.
    white: [f64; 3],
    /// N of one piece.
    floor: f64,
    /// C.
    cost: f64,
    /// Number of rows that no fault has spoilt.
    sound: f64,
    /// Whitened squared size of an effect that the search may miss.
    unseen: f64,
}

/// The spoilt rows of a block.
struct Piece {
    block: usize,
    rows: f64,
    /// ȳ − p̄ without and with the fault.
    left: [Vector3<f64>; 2],
}

/// Those findings that add a gap, about the fit that explains the rest. None in a hand, whose own samples say what was
/// to be sensed.
pub fn faults(recording: &Recording, findings: &[Finding], explained: &Solution<'_>) -> Vec<Fault> {
    let scene = explained.linear.scene;
    let spoils = |finding: &&Finding| matches!(finding.dose(), Some(dose) if is_modelled(dose.effect));
    let findings: Vec<&Finding> = findings.iter().filter(spoils).collect();
    if findings.is_empty() || !scene.settings.verdict.counts_faults {
        return Vec::new();
    }
    let Ok(simulated) = scene.simulated(&explained.fit.doses) else { return Vec::new() };
    let of = |finding: &&Finding| {
        let kind = *finding.effect.sensors.first()?;
        let (_, output) = simulated.iter().find(|(own, _)| *own == kind)?;
        Fault::new(recording, finding, kind, output, explained).filter(Fault::shows)
    };
    findings.iter().filter_map(of).collect()
}

fn is_modelled(effect: &Effect) -> bool {
    matches!(effect.spoils(), Some(Spoils::BeyondLimit | Spoils::Repeats))
}

impl Fault {
    fn new(
        recording: &Recording,
        finding: &Finding,
        kind: SensorKind,
        without: &[Vector3<f64>],
        explained: &Solution<'_>,
    ) -> Option<Self> {
        let (scene, triple) = (explained.linear.scene, recording.sensor(kind)?);
        let mut sound = vec![true; recording.rows()];
        leave_out(finding, recording, kind, &mut sound);
        let finite = |row: usize| triple.values[row].iter().all(|value| value.is_finite());
        let spoilt = |row: usize| !sound[row] && scene.is_known(row) && finite(row);
        let with = with_fault(&finding.dose()?, triple, without)?;
        let mean = |rows: &[usize], output: &[Vector3<f64>]| {
            rows.iter().map(|row| triple.values[*row] - output[*row]).sum::<Vector3<f64>>()
                / rows.len() as f64
        };
        let white = explained.best.noise.sensors[kind as usize].moving;
        let usable = &scene.usable[kind as usize];
        let (mut pieces, mut floor, mut blocks) = (Vec::new(), 0.0, 0.0f64);
        for (at, block) in scene.blocks.iter().enumerate() {
            let rows: Vec<usize> = block.rows.clone().filter(|row| spoilt(*row)).collect();
            if !rows.is_empty() {
                let left = [mean(&rows, without), mean(&rows, &with)];
                pieces.push(Piece { block: at, rows: rows.len() as f64, left });
            }
            let rows: Vec<usize> = block.rows.clone().filter(|row| usable[*row]).collect();
            if !rows.is_empty() {
                floor += energy(rows.len() as f64, &mean(&rows, without), &white);
                blocks += 1.0;
            }
        }
        let sound = usable.iter().filter(|usable| **usable).count() as f64;
        let floor = floor / blocks.max(1.0);
        let unseen = scene.settings.verdict.unseen;
        let mut fault = Self { effect: finding.effect, kind, pieces, white, floor, cost: 0.0, sound, unseen };
        fault.cost = fault.errors(explained)?;
        Some(fault)
    }

    /// What the errors of the fit cost on the spoilt rows.
    fn errors(&self, explained: &Solution<'_>) -> Option<f64> {
        let Solution { linear, best, .. } = explained;
        let fitted = linear.fitted(&best.set);
        let normal = linear.design.normal(&linear.precisions(&best.noise), &fitted);
        let mut own = DMatrix::zeros(fitted.len(), fitted.len());
        for channel in linear.design.channels.iter().filter(|channel| channel.kind == self.kind) {
            let (from, to) = places(&channel.ids, &fitted);
            let mut x = DMatrix::zeros(self.pieces.len(), fitted.len());
            for (row, piece) in self.pieces.iter().enumerate() {
                let weight = piece.rows.sqrt() / self.white[channel.axis];
                from.iter()
                    .zip(&to)
                    .for_each(|(from, to)| x[(row, *to)] = weight * channel.x[*from][piece.block]);
            }
            own += x.tr_mul(&x);
        }
        Some(loosened(normal.information)?.solve(&own).trace())
    }

    /// What chance makes of its gap, as a standard deviation.
    fn chance(&self) -> f64 {
        self.floor * (2.0 * self.pieces.len() as f64).sqrt()
    }

    /// Its gap is larger than chance would make it.
    fn shows(&self) -> bool {
        self.explainable() > SEEN * self.chance()
    }

    /// E₀ − N, and E₀ − E₁, of a piece.
    fn gains(&self, piece: &Piece) -> [f64; 2] {
        let [before, after] = piece.left.map(|left| energy(piece.rows, &left, &self.white));
        [before - self.floor, before - after]
    }

    fn explainable(&self) -> f64 {
        self.pieces.iter().map(|piece| self.gains(piece)[0]).sum()
    }

    /// φ; its interval is that of a jackknife over the pieces, dealt to folds in turn, and of what chance and the
    /// fit's errors make of it.
    fn share(&self) -> Share {
        let mut folds = [[0.0; 2]; FOLDS];
        for (at, piece) in self.pieces.iter().enumerate() {
            let gains = self.gains(piece);
            folds[at % FOLDS].iter_mut().zip(gains).for_each(|(sum, gain)| *sum += gain);
        }
        folds.iter_mut().for_each(|[_, closed]| *closed += self.cost / FOLDS as f64);
        let all = folds.iter().fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d]);
        let ratio = |[explainable, closed]: [f64; 2]| closed / explainable.max(f64::MIN_POSITIVE);
        let left = folds.map(|fold| ratio([all[0] - fold[0], all[1] - fold[1]]));
        let further = (self.chance().powi(2) + self.cost.powi(2)) / all[0].powi(2);
        Share::new(ratio(all), &left, further, all[0], self.unseen)
    }
}

/// n |ȳ − p̄|² / σ².
fn energy(rows: f64, left: &Vector3<f64>, white: &[f64; 3]) -> f64 {
    rows * left.iter().zip(white).map(|(left, sigma)| (left / sigma).powi(2)).sum::<f64>()
}

/// What the sensor would have put out with the fault. `None` where its range is not known.
fn with_fault(dose: &Dose, triple: &Triple, without: &[Vector3<f64>]) -> Option<Vec<Vector3<f64>>> {
    match dose.effect.act {
        Act::Signal(_, alter) => {
            let mut limit = triple.full_scale_si()?;
            alter(&dose.values, &mut SignalRun { time: &[], noise: &mut [], limit: &mut limit });
            Some(without.iter().map(|value| value.map(|value| value.clamp(-limit, limit))).collect())
        }
        _ => {
            // Which rows repeat is not the effect's to say, but the recording's.
            let mut held = without.to_vec();
            for row in 1..held.len() {
                if triple.values[row] == triple.values[row - 1] {
                    held[row] = held[row - 1];
                }
            }
            Some(held)
        }
    }
}

/// A fault of the recording as a cause: it is certain.
pub fn cause(finding: &Finding) -> Cause {
    Cause {
        effect: finding.effect.id.clone(),
        probability: 1.0 - finding.p_value,
        equivalents: Vec::new(),
        parameters: finding.parameters.clone(),
        material: true,
        gap_closed: None,
        gap_closed_ci95: None,
    }
}

/// Adds what faults have added to the gap, and what their effects close of it, to the causes that name them, to the
/// table and to the total; `explainable` is the whitened squared size of the gap without them.
pub fn add(
    faults: &[Fault],
    explainable: f64,
    causes: &mut [Cause],
    gap: &mut [Gap],
    total: &mut Option<Share>,
) {
    if faults.is_empty() {
        return;
    }
    let whole = explainable + faults.iter().map(Fault::explainable).sum::<f64>();
    let scaled = |share: Share, size: f64| Share {
        value: share.value * size / whole,
        interval: share.interval.map(|end| end * size / whole),
    };
    let mut sum = total.map_or(Share { value: 0.0, interval: [0.0; 2] }, |share| scaled(share, explainable));
    for cause in causes {
        let share = match faults.iter().find(|fault| fault.effect.id == cause.effect) {
            Some(fault) => {
                let share = scaled(fault.share(), fault.explainable());
                sum.value += share.value;
                sum.interval = [0, 1].map(|end| sum.interval[end] + share.interval[end]);
                Some(share)
            }
            None => {
                let own = cause.gap_closed.zip(cause.gap_closed_ci95);
                own.map(|(value, interval)| scaled(Share { value, interval }, explainable))
            }
        };
        cause.gap_closed = share.map(|share| share.value);
        cause.gap_closed_ci95 = share.map(|share| share.interval);
    }
    *total = Some(sum);
    for gap in gap {
        let own: Vec<&Fault> = faults.iter().filter(|fault| fault.kind.prefix() == gap.sensor).collect();
        widen(gap, &own);
    }
}

/// Takes spoilt rows into an axis' line of the table.
fn widen(gap: &mut Gap, own: &[&Fault]) {
    let (Some(fault), Some(axis)) = (own.first(), ["x", "y", "z"].iter().position(|axis| *axis == gap.axis))
    else {
        return;
    };
    let pieces = || own.iter().flat_map(|fault| &fault.pieces);
    let rows = fault.sound + pieces().map(|piece| piece.rows).sum::<f64>();
    let wider = |rms: f64, which: usize| {
        let spoilt: f64 = pieces().map(|piece| piece.rows * piece.left[which][axis].powi(2)).sum();
        ((fault.sound * rms * rms + spoilt) / rows).sqrt()
    };
    (gap.rms_before, gap.rms_after) = (wider(gap.rms_before, 0), wider(gap.rms_after, 1));
}

#[cfg(test)]
mod tests {
    use crate::{
        diagnosis::{Diagnosis, Options, Verdict, diagnose, finding::Cause},
        effect::find,
        simulator::{Programme, Simulation, UnitKind},
    };

    fn diagnosed(doses: &[(&str, f64)]) -> Diagnosis {
        let (programme, unit) = (Programme::Full, UnitKind::Gx2);
        let mut simulation = Simulation { programme, rate: 25.0, seed: 9, unit, ..Simulation::default() };
        for (id, size) in doses {
            simulation.add(find(id).unwrap(), *size).unwrap();
        }
        diagnose(&simulation.record("faulty").unwrap(), &Options::default(), &|_| ())
    }

    fn cause<'d>(diagnosis: &'d Diagnosis, id: &str) -> &'d Cause {
        let found = diagnosis.causes.iter().find(|cause| cause.effect == id);
        found.unwrap_or_else(|| panic!("{id} is not among {:?}", diagnosis.causes))
    }

    #[test]
    fn faults_close_the_gap_of_their_own_rows_and_sensor() {
        let faults = [("gyr.saturation", 0.4), ("mag.stuck_samples", 3.0)];
        let diagnosis = diagnosed(&faults);
        assert_eq!((diagnosis.verdict, diagnosis.causes.len()), (Verdict::Explained, 2));
        for (id, _) in faults {
            let Cause { gap_closed, gap_closed_ci95, .. } = cause(&diagnosis, id);
            let (share, [low, high]) = (gap_closed.unwrap(), gap_closed_ci95.unwrap());
            assert!(share > 0.0 && low <= share && share <= high, "{id}: {share} {low} {high}");
        }
        let (total, [low, _]) =
            (diagnosis.gap_closed_total.unwrap(), diagnosis.gap_closed_total_ci95.unwrap());
        assert!(total > 0.95 && low > 0.8, "{total} {low}");
        for gap in &diagnosis.gap {
            assert_eq!(gap.rms_before > 1.5 * gap.rms_after, gap.sensor != "acc", "{gap:?}");
            assert!(gap.rms_after < 1.5 * gap.noise_floor, "{gap:?}");
        }
    }

    #[test]
    fn a_fault_and_an_effect_share_the_gap_between_them() {
        let both = [("gyr.saturation", 1.0), ("mag.gimbal_hard_iron_outer", 1.0)];
        let diagnosis = diagnosed(&both);
        let shares = both.map(|(id, _)| cause(&diagnosis, id).gap_closed.unwrap());
        let total = diagnosis.gap_closed_total.unwrap();
        assert!(shares.iter().all(|share| (0.001..0.999).contains(share)), "{shares:?}");
        assert!((shares.iter().sum::<f64>() - total).abs() < 0.02 && total > 0.95, "{shares:?} {total}");
    }

    #[test]
    fn what_repeats_nothing_and_what_the_baseline_takes_up_close_nothing() {
        let neither = [("gyr.noise_burst", 3.0), ("acc.axis_swap", 5.0)];
        let diagnosis = diagnosed(&neither);
        assert!(neither.iter().all(|(id, _)| cause(&diagnosis, id).gap_closed.is_none()));
        assert_eq!(diagnosis.gap_closed_total, None);
    }
}
