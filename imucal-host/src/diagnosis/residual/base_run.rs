//! A simulated run at the sample points, and what each parameter of an effect would change in it.
//!
//! A signature is the simulator's own derivative, by a difference quotient, averaged over each block:
//!
//! ```text
//! s_j = (output(θ + h e_j) − output(θ)) · σ_j / h      σ_j: the usual size of the parameter
//! ```
//!
//! Not modelled: what two effects change together, which is of the second order.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::{
    block::Means,
    forward_model::{ForwardModel, Sensed},
    sample_points::SamplePoints,
};
use crate::{
    diagnosis::error::DiagnosisError,
    effect::{Act, Effect, Input, Parameter, Role, Truth, user::Formula},
    recording::SensorKind,
    simulator::Dose,
};

/// A derivative's step along an amplitude, as a share of its usual size; along a shape, of its usual value; of an
/// instant, s.
const STEP: (f64, f64, f64) = (0.1, 0.02, 0.25);

/// A simulated run at the nodes, to be differentiated.
pub struct Reference<'s> {
    /// The problem that is simulated.
    pub scene: &'s ForwardModel<'s>,
    nodes: &'s SamplePoints,
    /// Effects of the run, the baseline among them.
    pub doses: Vec<Dose>,
    truth: Vec<Truth>,
    input: Vec<Input>,
    sensed: [Sensed; 3],
    outputs: [Vec<Vector3<f64>>; 3],
}

impl<'s> Reference<'s> {
    /// The run with these effects. `None` where a triad is singular.
    pub fn new(
        scene: &'s ForwardModel<'s>,
        doses: Vec<Dose>,
        nodes: &'s SamplePoints,
    ) -> Result<Self, DiagnosisError> {
        let truth = scene.truth(&doses, nodes);
        let input: Vec<Input> = truth.iter().map(Input::of).collect();
        let sensed = scene.sensed(&doses, &input)?;
        let outputs = scene.outputs_of(&doses, &SensorKind::ALL, &input, &sensed)?;
        Ok(Self { scene, nodes, doses, truth, input, sensed, outputs })
    }

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

    /// What the amplitudes of a sensor's formula multiply on each axis, block by block.
    ///
    /// # Errors
    ///
    /// [`DiagnosisError::Formula`], where it has no value.
    pub fn factors(
        &self,
        formula: &Formula,
        kind: SensorKind,
        shapes: &[f64],
    ) -> Result<Vec<Vector3<f64>>, DiagnosisError> {
        let each = formula.factors(&self.input, &self.sensed[kind as usize].axes, shapes);
        let each = each.map_err(|cause| DiagnosisError::Formula(Box::new(cause)))?;
        let node = |row: usize| Vector3::from_fn(|axis, _| each.get(axis).map_or(0.0, |column| column[row]));
        let nodes: Vec<Vector3<f64>> = (0..self.input.len()).map(node).collect();
        Ok(self.nodes.averaged(&nodes, self.scene.cuts.len()))
    }

    /// What a usual size of one parameter changes, block by block, by the simulator's difference quotient. Where the
    /// run holds the effect already, its own parameter is altered; else `neutral` with this parameter switched on.
    pub fn signature(
        &self,
        effect: &'static Effect,
        parameter: usize,
        neutral: &[f64],
    ) -> Result<Means, DiagnosisError> {
        let scale = effect.parameters[parameter].prior_scale;
        let mut doses = self.doses.clone();
        let step = step(&effect.parameters[parameter]);
        match doses.iter_mut().find(|dose| dose.effect == effect) {
            Some(dose) => dose.values[parameter] += step,
            None => {
                let mut values = neutral.to_vec();
                values[parameter] += step;
                doses.push(Dose { effect, values });
            }
        }
        let outputs = match effect.act {
            Act::Rig(_) | Act::Clock(_) => {
                self.scene.outputs(&doses, effect.sensors, &self.scene.inputs(&doses, self.nodes))?
            }
            Act::Field(alter) if !self.doses.iter().any(|dose| dose.effect == effect) => {
                // Field effects come after all that moves the rig; their order among themselves is of second order.
                let altered = |row: &Truth| {
                    let mut row = *row;
                    doses.last().into_iter().for_each(|dose| alter(&dose.values, &mut row));
                    Input::of(&row)
                };
                let input: Vec<Input> = self.truth.par_iter().map(altered).collect();
                self.scene.outputs(&doses, effect.sensors, &input)?
            }
            Act::Field(_) => {
                self.scene.outputs(&doses, effect.sensors, &self.scene.inputs(&doses, self.nodes))?
            }
            Act::Triad(..) => self.scene.outputs(&doses, effect.sensors, &self.input)?,
            Act::Sensor(..) | Act::Memory(..) | Act::Formula(..) | Act::Signal(..) | Act::Data(..) => {
                self.scene.outputs_of(&doses, effect.sensors, &self.input, &self.sensed)?
            }
        };
        let mut means: Means = Default::default();
        for kind in effect.sensors.iter().filter(|kind| self.scene.kinds.contains(kind)) {
            let (with, without) = (&outputs[*kind as usize], &self.outputs[*kind as usize]);
            let change: Vec<_> = with.iter().zip(without).map(|(a, b)| (a - b) * (scale / step)).collect();
            means[*kind as usize] = Some(self.nodes.averaged(&change, self.scene.cuts.len()));
        }
        Ok(self.scene.seen(means))
    }
}

fn step(parameter: &Parameter) -> f64 {
    match parameter.role {
        Role::Amplitude | Role::Choice => STEP.0 * parameter.prior_scale,
        Role::Detail { usual } => STEP.0 * usual,
        Role::Shape { usual } if usual != 0.0 => STEP.1 * usual.abs(),
        Role::Shape { .. } => STEP.1 * parameter.prior_scale,
        Role::Instant { .. } => STEP.2,
    }
}
