//! A recording beside the simulator's account of it: residuals, and what each parameter would change.
//!
//! Residuals are means over blocks of recorded less simulated samples, at the recording's full rate. A signature is the
//! simulator's own derivative, from a run at nodes a few rows apart, since it need not hold what a residual must.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, PoisonError},
};

use imucal_core::triad::Triad;
use nalgebra::Vector3;
use rayon::prelude::*;

use super::{
    block::{Block, cut},
    hand::{Held, View},
    nodes::Nodes,
    scatter::Turned,
    unsteady,
};
use crate::{
    effect::{Act, Effect, Input, Parameter, Role, Swing, Truth},
    recording::{Recording, SensorKind},
    simulator::{Dose, Recorded, chain::Chain},
};

/// Nodes of signatures are this far apart in motion, s; where no rig guides the sensor, which moves briskly then, the
/// latter.
const NODES: (f64, f64) = (0.045, 0.0175);
/// At rest on a rig nothing changes from one to the next, s.
const RESTING: f64 = 0.25;

/// A derivative's step along an amplitude, as a share of its usual size; along a shape, of its usual value; of an
/// instant, s.
const STEP: (f64, f64, f64) = (0.1, 0.02, 0.25);

/// Block means of each sensor, by [`SensorKind::ALL`]; `None` without the sensor.
pub type Means = [Option<Vec<Vector3<f64>>>; 3];

/// What is simulated beside a recording.
pub struct Scene<'a> {
    /// The recording.
    pub recording: &'a Recording,
    /// Its blocks; where a view looks at it, those of the view.
    pub blocks: Vec<Block>,
    cuts: Vec<Block>,
    view: Option<View>,
    /// Sensors that are there.
    pub kinds: Vec<SensorKind>,
    /// Swings of the gimbals at each row; `None` without gimbals.
    pub swings: Option<&'a [[Swing; 3]]>,
    /// Usable rows of each block, by sensor.
    pub counts: [Vec<usize>; 3],
    motion: &'a dyn Recorded,
    /// Rows of each sensor that are used, by [`SensorKind::ALL`].
    pub usable: [Vec<bool>; 3],
    /// The triads that the simulator starts from, by [`SensorKind::ALL`].
    pub triads: [Triad<f64>; 3],
    /// Nodes for signatures.
    pub fine: Nodes,
    /// One node a block: to look where in time an effect without memory lies.
    pub coarse: Nodes,
    /// What the outputs are turned by when the gimbals stand off their encoders.
    pub turned: Turned,
}

impl<'a> Scene<'a> {
    /// Beside `recording`, the rows of each sensor that are to be used, a movement, and the triads that the simulator starts from, by [`SensorKind::ALL`].
    pub fn new(
        recording: &'a Recording,
        usable: [Vec<bool>; 3],
        motion: &'a dyn Recorded,
        triads: [Triad<f64>; 3],
    ) -> Self {
        let interval = recording.median_interval().unwrap_or(0.01);
        let blocks = cut(&recording.time, motion.moving(), interval);
        let mut counts = usable.each_ref().map(|usable| {
            let count = |block: &Block| usable.get(block.rows.clone()).unwrap_or_default();
            blocks.iter().map(|block| count(block).iter().filter(|usable| **usable).count()).collect()
        });
        if recording.reference.is_some() && motion.swings().is_none() {
            unsteady::leave_out(recording, &usable, &blocks, &mut counts);
        }
        // On a rig a sensor without a usable row stays: its samples may be told from another unit.
        let is_used = |kind: SensorKind| motion.swings().is_some() || usable[kind as usize].contains(&true);
        let is_there = |kind: &SensorKind| recording.sensor(*kind).is_some() && is_used(*kind);
        let kinds = SensorKind::ALL.into_iter().filter(is_there).collect();
        let apart = if motion.swings().is_some() { NODES.0 } else { NODES.1 };
        let fine = |block: &Block| {
            let still = block.rest.is_some() && motion.swings().is_some();
            let stride = ((if still { RESTING } else { apart } / interval).round() as usize).max(1);
            block.rows.len().div_ceil(stride)
        };
        // Across a gap of a reference it is bridged as if it turned evenly: no derivative is to be taken there.
        let told = |row: usize| motion.swings().is_some() || motion.known()[row];
        let fine = Nodes::choose(&recording.time, &blocks, fine, told);
        let coarse = Nodes::choose(&recording.time, &blocks, |_| 1, |_| true);
        Self {
            recording,
            cuts: blocks.clone(),
            view: None,
            blocks,
            kinds,
            swings: motion.swings(),
            counts,
            motion,
            usable,
            triads,
            fine,
            coarse,
            turned: Turned::default(),
        }
    }

    /// Looked at by way of the rests of a hand; what the magnetometer is given there is not known.
    #[must_use]
    pub fn through(mut self, held: &Held) -> Self {
        let gravity = self.motion.place().gravity;
        let of = |time: f64| self.motion.truth(time, &|_| ()).c_t_p;
        let view = View::new(held, &self.recording.time, &self.cuts, &self.counts, &of, gravity);
        self.kinds.retain(|kind| match kind {
            SensorKind::Acc => true,
            SensorKind::Gyr => held.with_gyroscope,
            SensorKind::Mag => false,
        });
        self.blocks.clone_from(&view.blocks);
        self.counts.clone_from(&view.counts);
        self.view = Some(view);
        self
    }

    /// Without the blocks in which something is brought near the magnetometer or taken away, where no rig guides it.
    #[must_use]
    pub fn without_passages(mut self) -> Self {
        if self.swings.is_none() && self.view.is_none() && self.recording.reference.is_some() {
            // A shock of a hand is movement, and no passage.
            let of_mag = self.residual(&[]).map(|[_, _, mag]| [None, None, mag]);
            unsteady::leave_out_passages(&of_mag.unwrap_or_default(), &self.blocks, &mut self.counts);
        }
        self
    }

    /// Means as they are looked at.
    fn seen(&self, means: Means) -> Means {
        match &self.view {
            Some(view) => view.of(&means),
            None => means,
        }
    }

    /// Sensors whose blocks an effect may alter: by way of an attitude, others than its own.
    pub fn reach(&self, effect: &Effect) -> &'static [SensorKind] {
        if self.view.is_some() { &SensorKind::ALL } else { effect.sensors }
    }

    /// It is looked at by way of the rests of a hand.
    pub fn is_viewed(&self) -> bool {
        self.view.is_some()
    }

    /// The movement is told at a row.
    pub fn is_known(&self, row: usize) -> bool {
        self.motion.known().get(row).copied().unwrap_or(false)
    }

    /// A block tells something on an axis of a sensor.
    pub fn tells(&self, kind: SensorKind, block: usize, axis: usize) -> bool {
        self.view.as_ref().is_none_or(|view| view.tells(kind, block, axis))
    }

    /// What an axis of a sensor is, in a table.
    pub fn axis(&self, kind: SensorKind, axis: usize) -> &'static str {
        match (&self.view, kind) {
            (Some(_), SensorKind::Acc) => ["along gravity", "across gravity, first", "across, second"][axis],
            _ => ["x", "y", "z"][axis],
        }
    }

    /// Length of the recording, s.
    pub fn duration(&self) -> f64 {
        self.motion.duration()
    }

    fn truth(&self, doses: &[Dose], nodes: &Nodes) -> Vec<Truth> {
        Chain::new(doses).truth(self.motion.steady(), &nodes.times)
    }

    fn inputs(&self, doses: &[Dose], nodes: &Nodes) -> Vec<Input> {
        Chain::new(doses).inputs(self.motion.steady(), &nodes.times)
    }

    /// The truth in the middle of each block, without any effect.
    pub fn plain(&self) -> Vec<Truth> {
        match &self.view {
            Some(_) => {
                let times: Vec<f64> = self.blocks.iter().map(|block| block.time).collect();
                Chain::default().truth(self.motion, &times)
            }
            None => self.truth(&[], &self.coarse),
        }
    }

    /// What the simulator puts out at each row, by sensor. `None` where a triad is singular.
    pub fn simulated(&self, doses: &[Dose]) -> Option<Vec<(SensorKind, Vec<Vector3<f64>>)>> {
        let chain = Chain::new(doses);
        let input = chain.inputs(self.motion, &self.recording.time);
        let of =
            |kind: &SensorKind| Some((*kind, chain.output(*kind, &self.triads[*kind as usize], &input)?));
        self.kinds.par_iter().map(of).collect()
    }

    /// Recorded less simulated, block by block. `None` where a triad is singular.
    pub fn residual(&self, doses: &[Dose]) -> Option<Means> {
        let simulated = self.simulated(doses)?;
        let of = |(kind, output): &(SensorKind, Vec<_>)| (*kind, self.difference(*kind, output));
        let mut means: Means = Default::default();
        for (kind, difference) in simulated.par_iter().map(of).collect::<Vec<_>>() {
            means[kind as usize] = difference;
        }
        Some(self.seen(means))
    }

    fn difference(&self, kind: SensorKind, output: &[Vector3<f64>]) -> Option<Vec<Vector3<f64>>> {
        let samples = &self.recording.sensor(kind)?.values;
        let usable = &self.usable[kind as usize];
        let mean = |block: &Block| {
            let mut sum = Vector3::zeros();
            let mut count = 0.0;
            for row in block.rows.clone().filter(|row| usable[*row]) {
                sum += samples[row] - output[row];
                count += 1.0;
            }
            if count > 0.0 { sum / count } else { sum }
        };
        Some(self.cuts.iter().map(mean).collect())
    }

    /// What each sensor puts out at the nodes.
    fn outputs(
        &self,
        doses: &[Dose],
        kinds: &[SensorKind],
        input: &[Input],
    ) -> Option<[Vec<Vector3<f64>>; 3]> {
        let chain = Chain::new(doses);
        let mut outputs: [Vec<Vector3<f64>>; 3] = Default::default();
        for kind in kinds.iter().filter(|kind| self.kinds.contains(kind)) {
            outputs[*kind as usize] = chain.output(*kind, &self.triads[*kind as usize], input)?;
        }
        Some(outputs)
    }

    /// A run that signatures are taken against.
    pub fn reference<'s>(&'s self, doses: Vec<Dose>, nodes: &'s Nodes) -> Option<Reference<'s>> {
        let truth = self.truth(&doses, nodes);
        let input: Vec<Input> = truth.iter().map(Input::of).collect();
        let outputs = self.outputs(&doses, &SensorKind::ALL, &input)?;
        Some(Reference { scene: self, nodes, doses, truth, input, outputs, known: Known::default() })
    }
}

/// A simulated run at the nodes, to be differentiated.
pub struct Reference<'s> {
    /// What is simulated beside.
    pub scene: &'s Scene<'s>,
    nodes: &'s Nodes,
    /// Effects of the run, the baseline among them.
    pub doses: Vec<Dose>,
    truth: Vec<Truth>,
    input: Vec<Input>,
    outputs: [Vec<Vector3<f64>>; 3],
    known: Known,
}

/// Signatures that were asked for: effect, parameter, and the bits of all parameters.
type Known = Mutex<HashMap<(&'static str, usize, Vec<u64>), Arc<Means>>>;

impl Reference<'_> {
    /// What a sensor puts out, block by block.
    pub fn output(&self, kind: SensorKind) -> Vec<Vector3<f64>> {
        match &self.scene.view {
            Some(view) => view.given(kind),
            None => self.nodes.averaged(&self.outputs[kind as usize], self.scene.cuts.len()),
        }
    }

    /// The truth at each block's last node, in the order of the nodes.
    pub fn truth(&self) -> &[Truth] {
        &self.truth
    }

    /// A [`signature`](Self::signature), computed once.
    pub fn known_signature(
        &self,
        effect: &'static Effect,
        parameter: usize,
        shape: &[f64],
    ) -> Option<Arc<Means>> {
        // What the run holds is altered where it stands.
        let is_held = self.doses.iter().any(|dose| std::ptr::eq(dose.effect, effect));
        let bits = shape.iter().filter(|_| !is_held).map(|value| value.to_bits()).collect();
        let key = (effect.id.as_str(), parameter, bits);
        let locked = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = locked().get(&key) {
            return Some(Arc::clone(known));
        }
        let signature = Arc::new(self.signature(effect, parameter, shape)?);
        locked().insert(key, Arc::clone(&signature));
        Some(signature)
    }

    /// What a usual size of one parameter changes, block by block, by the simulator's difference quotient. Where the
    /// run holds the effect already, its own parameter is altered; else `neutral` with this parameter switched on.
    pub fn signature(&self, effect: &'static Effect, parameter: usize, neutral: &[f64]) -> Option<Means> {
        let scale = effect.parameters.get(parameter)?.prior_scale;
        let mut doses = self.doses.clone();
        let step = step(effect.parameters.get(parameter)?);
        match doses.iter_mut().find(|dose| std::ptr::eq(dose.effect, effect)) {
            Some(dose) => *dose.values.get_mut(parameter)? += step,
            None => {
                let mut values = neutral.to_vec();
                *values.get_mut(parameter)? += step;
                doses.push(Dose { effect, values });
            }
        }
        let outputs = match effect.act {
            Act::Rig(_) | Act::Clock(_) => {
                self.scene.outputs(&doses, effect.sensors, &self.scene.inputs(&doses, self.nodes))?
            }
            Act::Field(alter) if !self.doses.iter().any(|dose| std::ptr::eq(dose.effect, effect)) => {
                // Field effects come after all that moves the rig; their order among themselves is of second order.
                let values = &doses.last()?.values;
                let altered = |row: &Truth| {
                    let mut row = *row;
                    alter(values, &mut row);
                    Input::of(&row)
                };
                let input: Vec<Input> = self.truth.par_iter().map(altered).collect();
                self.scene.outputs(&doses, effect.sensors, &input)?
            }
            Act::Field(_) => {
                self.scene.outputs(&doses, effect.sensors, &self.scene.inputs(&doses, self.nodes))?
            }
            Act::Triad(..) | Act::Sensor(..) | Act::Signal(..) | Act::Data(..) => {
                self.scene.outputs(&doses, effect.sensors, &self.input)?
            }
        };
        let mut means: Means = Default::default();
        for kind in effect.sensors.iter().filter(|kind| self.scene.kinds.contains(kind)) {
            let (with, without) = (&outputs[*kind as usize], &self.outputs[*kind as usize]);
            let change: Vec<_> = with.iter().zip(without).map(|(a, b)| (a - b) * (scale / step)).collect();
            means[*kind as usize] = Some(self.nodes.averaged(&change, self.scene.cuts.len()));
        }
        Some(self.scene.seen(means))
    }
}

fn step(parameter: &Parameter) -> f64 {
    match parameter.role {
        Role::Amplitude | Role::Choice => STEP.0 * parameter.prior_scale,
        Role::Shape { usual } => STEP.1 * usual.abs(),
        Role::Instant { .. } => STEP.2,
    }
}

/// Parameters of an effect that its signature is linear in.
pub fn amplitudes(effect: &Effect) -> impl Iterator<Item = usize> {
    effect.parameters.iter().enumerate().filter(|(_, p)| p.role == Role::Amplitude).map(|(index, _)| index)
}

/// Parameters that say how or when, at these values; an instant that never comes has none.
pub fn shapes<'e>(effect: &'e Effect, values: &'e [f64]) -> impl Iterator<Item = usize> + 'e {
    let is_shape = |role: &Role| matches!(role, Role::Shape { .. } | Role::Instant { .. });
    let known = effect.parameters.iter().zip(values).enumerate();
    known.filter(move |(_, (p, value))| is_shape(&p.role) && value.is_finite()).map(|(index, _)| index)
}
