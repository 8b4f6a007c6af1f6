//! A recording against what the simulator makes of its movement: residuals, and what each parameter would change.
//!
//! Residuals are means over blocks of recorded less simulated samples, at the recording's full rate. A signature is the
//! simulator's own derivative, from a run at nodes a few rows apart, since it need not hold what a residual must.

use std::{ops::Range, sync::OnceLock};

use imucal_core::triad::Triad;
use nalgebra::Vector3;

use super::{
    block::{Block, Means, cut_at_most},
    gravity_observables::GravityObservables,
    sample_points::SamplePoints,
    transient,
};
use crate::{
    diagnosis::{error::DiagnosisError, reference::rest_to_rest::RestToRest, settings::Settings},
    effect::{Effect, Input, Swing, Truth},
    recording::{Recording, SensorKind},
    simulator::{Dose, Recorded, chain::Chain},
};

/// What the axes of a sensor sense, row by row: its output before bias and effects, SI units. Empty without the sensor.
#[derive(Clone, Debug)]
pub(super) struct Sensed {
    pub(super) bias: Vector3<f64>,
    pub(super) axes: Vec<Vector3<f64>>,
}

impl Default for Sensed {
    fn default() -> Self {
        Self { bias: Vector3::zeros(), axes: Vec::new() }
    }
}

/// What is simulated for a recording.
pub struct ForwardModel<'a> {
    /// Settings of the diagnosis.
    pub settings: &'a Settings,
    /// The recording.
    pub recording: &'a Recording,
    /// Its blocks; where a view looks at it, those of the view.
    pub blocks: Vec<Block>,
    pub(super) cuts: Vec<Block>,
    pub(super) view: Option<GravityObservables>,
    /// Sensors that are there.
    pub kinds: Vec<SensorKind>,
    /// Usable rows of each block, by sensor.
    pub counts: [Vec<usize>; 3],
    /// Variance of a sample in each block, by sensor, against the usual one; none where all are alike.
    pub vibration: [Option<Vec<f64>>; 3],
    pub(super) motion: &'a dyn Recorded,
    pub(super) acc_as_sharp: Option<Vec<Vector3<f64>>>,
    /// Rows of each sensor that are used, by [`SensorKind::ALL`].
    pub usable: [Vec<bool>; 3],
    /// The triads that the simulator starts from, by [`SensorKind::ALL`].
    pub triads: [Triad<f64>; 3],
    /// Nodes for signatures.
    pub fine: SamplePoints,
    /// A few nodes a block: to look which of many formulas a residual may follow.
    pub sparse: SamplePoints,
    /// One node a block: to look where in time an effect without memory lies.
    pub coarse: SamplePoints,
    /// Computed by `gimbal_derivatives` when it is first asked for.
    pub(super) gimbal_derivatives: OnceLock<Vec<Means>>,
}

impl<'a> ForwardModel<'a> {
    /// For `recording`, the rows of each sensor that are to be used, a movement, and the triads that the simulator starts from, by [`SensorKind::ALL`].
    pub fn new(
        recording: &'a Recording,
        usable: [Vec<bool>; 3],
        motion: &'a dyn Recorded,
        triads: [Triad<f64>; 3],
        settings: &'a Settings,
    ) -> Self {
        let interval = recording.median_interval().unwrap_or(0.01);
        let by = &settings.residual;
        let blocks = cut_at_most(&recording.time, motion.moving(), interval, by);
        let mut counts = usable.each_ref().map(|usable| {
            let count = |block: &Block| usable.get(block.rows.clone()).unwrap_or_default();
            blocks.iter().map(|block| count(block).iter().filter(|usable| **usable).count()).collect()
        });
        if by.leaves_out_passages {
            transient::leave_out(recording, &usable, &blocks, by, &mut counts);
        }
        let is_used =
            |kind: SensorKind| by.keeps_sensors_without_rows || usable[kind as usize].contains(&true);
        let is_there = |kind: &SensorKind| recording.sensor(*kind).is_some() && is_used(*kind);
        let kinds = SensorKind::ALL.into_iter().filter(is_there).collect();
        let fine_count = |block: &Block| {
            let apart = if block.rest.is_some() { by.resting_points } else { by.moving_points };
            let stride = ((apart / interval).round() as usize).max(1);
            block.rows.len().div_ceil(stride)
        };
        let is_known = |row: usize| by.points_in_gaps || motion.known()[row];
        let fine = SamplePoints::choose(&recording.time, &blocks, fine_count, is_known);
        let few = |block: &Block| fine_count(block).min(by.sparse_points);
        let sparse = SamplePoints::choose(&recording.time, &blocks, few, is_known);
        let coarse = SamplePoints::choose(&recording.time, &blocks, |_| 1, |_| true);
        let of_acc = SensorKind::Acc as usize;
        let acc_as_sharp = recording
            .acc
            .as_ref()
            .and_then(|acc| motion.as_sharp(&acc.values, &usable[of_acc], &triads[of_acc]));
        Self {
            settings,
            recording,
            acc_as_sharp,
            cuts: blocks.clone(),
            view: None,
            blocks,
            kinds,
            counts,
            motion,
            vibration: Default::default(),
            usable,
            triads,
            fine,
            sparse,
            coarse,
            gimbal_derivatives: OnceLock::new(),
        }
    }

    /// Looked at by way of the rests of a hand; what the magnetometer is given there is not known.
    #[must_use]
    pub fn through(mut self, held: &RestToRest) -> Self {
        let gravity = self.motion.place().gravity;
        let of = |time: f64| self.motion.truth(time, &|_| ()).c_t_p;
        let view =
            GravityObservables::new(held, &self.recording.time, &self.cuts, &self.counts, &of, gravity);
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

    /// Takes all rows of some stretches of time, s, out of use.
    pub fn leave_out(&mut self, stretches: &[Range<f64>]) {
        let time = &self.recording.time;
        for (usable, counts) in self.usable.iter_mut().zip(&mut self.counts) {
            for stretch in stretches {
                let from = time.partition_point(|t| *t < stretch.start);
                let to = time.partition_point(|t| *t <= stretch.end);
                if let Some(rows) = usable.get_mut(from..to) {
                    rows.fill(false);
                }
            }
            for (count, block) in counts.iter_mut().zip(&self.cuts) {
                let rows = usable.get(block.rows.clone()).unwrap_or_default();
                *count = (*count).min(rows.iter().filter(|usable| **usable).count());
            }
        }
    }

    /// Without the blocks in which something is brought near the magnetometer or taken away, where no rig guides it.
    #[must_use]
    pub fn without_passages(mut self) -> Self {
        if self.settings.residual.leaves_out_passages {
            // A shock of a hand is movement, and no passage.
            let of_mag = self.residual(&[]).map(|[_, _, mag]| [None, None, mag]);
            let (of_mag, by) = (of_mag.unwrap_or_default(), &self.settings.residual);
            transient::leave_out_passages(&of_mag, &self.blocks, by, &mut self.counts);
        }
        self
    }

    /// Means as they are looked at.
    pub(super) fn seen(&self, means: Means) -> Means {
        match &self.view {
            Some(view) => view.of(&means),
            None => means,
        }
    }

    /// Number of a sensor's usual samples that those of a block are worth.
    pub fn worth(&self, kind: SensorKind, block: usize) -> f64 {
        let variance = self.vibration[kind as usize].as_ref().map_or(1.0, |ratios| ratios[block]);
        self.counts[kind as usize][block] as f64 / variance
    }

    /// Sensors whose blocks an effect may alter: by way of an attitude, others than its own.
    pub fn reach(&self, effect: &Effect) -> &'static [SensorKind] {
        self.settings.residual.coupled.unwrap_or(effect.sensors)
    }

    /// Swings of the gimbals in the middle of a block; `None` without gimbals.
    pub fn swings(&self, block: &Block) -> Option<[Swing; 3]> {
        self.motion.swings((block.rows.start + block.rows.end) / 2)
    }

    /// The movement is known at a row.
    pub fn is_known(&self, row: usize) -> bool {
        self.motion.known().get(row).copied().unwrap_or(false)
    }

    /// A block measures something on an axis of a sensor.
    pub fn measures(&self, kind: SensorKind, block: usize, axis: usize) -> bool {
        self.view.as_ref().is_none_or(|view| view.measures(kind, block, axis))
    }

    /// What an axis of a sensor is, in a table.
    pub fn axis(&self, kind: SensorKind, axis: usize) -> &'static str {
        match (&self.view, kind) {
            (Some(_), SensorKind::Acc) => ["along gravity", "across gravity, first", "across, second"][axis],
            _ => ["x", "y", "z"][axis],
        }
    }

    /// Mean speed of each block, m/s; `None` where it is not known.
    pub fn speeds(&self) -> Option<Vec<f64>> {
        let speeds = self.motion.speeds().filter(|_| self.view.is_none())?;
        let mean = |block: &Block| {
            let rows = speeds.get(block.rows.clone()).unwrap_or_default();
            rows.iter().sum::<f64>() / rows.len().max(1) as f64
        };
        Some(self.cuts.iter().map(mean).collect())
    }

    /// Length of the recording, s.
    pub fn duration(&self) -> f64 {
        self.motion.duration()
    }

    pub(super) fn truth(&self, doses: &[Dose], nodes: &SamplePoints) -> Vec<Truth> {
        Chain::new(doses).truth(self.motion.steady(), &nodes.times)
    }

    pub(super) fn inputs(&self, doses: &[Dose], nodes: &SamplePoints) -> Vec<Input> {
        Chain::new(doses).inputs(self.motion.steady(), &nodes.times)
    }

    /// What a unit is given at each row, without any effect.
    pub fn given_rows(&self) -> Vec<Input> {
        Chain::default().inputs(self.motion, &self.recording.time)
    }

    /// Likewise at the nodes for signatures.
    pub fn given_nodes(&self) -> Vec<Input> {
        self.inputs(&[], &self.fine)
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

    /// What each sensor puts out at the nodes.
    pub(super) fn outputs(
        &self,
        doses: &[Dose],
        kinds: &[SensorKind],
        input: &[Input],
    ) -> Result<[Vec<Vector3<f64>>; 3], DiagnosisError> {
        let chain = Chain::new(doses);
        self.each(kinds, |kind| self.output(&chain, kind, input))
    }

    /// What the sensors sense of an input.
    pub(super) fn sensed(&self, doses: &[Dose], input: &[Input]) -> Result<[Sensed; 3], DiagnosisError> {
        let chain = Chain::new(doses);
        let mut all: [Sensed; 3] = Default::default();
        for kind in &self.kinds {
            let (triad, axes) = chain.sensed(*kind, &self.triads[*kind as usize], input)?;
            all[*kind as usize] = Sensed { bias: triad.bias, axes };
        }
        Ok(all)
    }

    /// As [`Self::outputs`], of what the sensors sense.
    pub(super) fn outputs_of(
        &self,
        doses: &[Dose],
        kinds: &[SensorKind],
        input: &[Input],
        sensed: &[Sensed; 3],
    ) -> Result<[Vec<Vector3<f64>>; 3], DiagnosisError> {
        let chain = Chain::new(doses);
        self.each(kinds, |kind| {
            let Sensed { bias, axes } = &sensed[kind as usize];
            Ok(chain.output_of(kind, bias, input, axes)?)
        })
    }

    /// An output of each of some sensors that are there; empty of the others.
    fn each(
        &self,
        kinds: &[SensorKind],
        output: impl Fn(SensorKind) -> Result<Vec<Vector3<f64>>, DiagnosisError>,
    ) -> Result<[Vec<Vector3<f64>>; 3], DiagnosisError> {
        let mut outputs: [Vec<Vector3<f64>>; 3] = Default::default();
        for kind in kinds.iter().filter(|kind| self.kinds.contains(kind)) {
            outputs[*kind as usize] = output(*kind)?;
        }
        Ok(outputs)
    }

    pub(super) fn output(
        &self,
        chain: &Chain<'_>,
        kind: SensorKind,
        input: &[Input],
    ) -> Result<Vec<Vector3<f64>>, DiagnosisError> {
        Ok(chain.output(kind, &self.triads[kind as usize], input)?)
    }
}
