//! The magnetometer turned into the accelerometer's axes, by the dip of the field in a session's rests.
//!
//! An ellipsoid leaves a magnetometer in axes of its own. A fit of the dip ([`crate::model::dip`]) starts from each way in which a
//! magnetometer may lie on its board, and the lowest end counts. The turned triad's errors ([`crate::model::alignment`]) are those of
//! the cloud's fit and of the rotation, by what the dips leave.
//!
//! Not modelled: what errors of the cloud's fit leave in the dips, which counts in both parts, so that the errors are stated about a
//! fifth too large (`session::tests::alignment`).

use nalgebra::{Matrix3, SVector, Vector3};

use super::{
    Session,
    estimate::{Estimate, Gauge},
    fitting::Fit,
    judgement::{stated, wider},
    poses::unit,
};
use crate::{
    model::{
        Model, RowSink,
        alignment::Alignment,
        dip::{DipModel, DirectionPair, LARGEST_ERROR, LEAST_POSES, RELABELLINGS, is_lower, relabelling},
        parameterisation::UPPER_TRIANGULAR,
    },
    record::Sensor,
    solver::LevenbergMarquardt,
    triad::Triad,
};

/// Why a magnetometer stays in its own axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NotAligned {
    /// The accelerometer or the magnetometer is not accepted.
    NotAccepted(Sensor),
    /// It was turned before.
    Already,
    /// There are too few rests at which the field was measured.
    TooFewRests {
        /// Rests.
        have: usize,
        /// Needed at least.
        need: usize,
    },
    /// The rests do not show the rotation: its largest standard error, rad; NaN where it is not determined at all.
    Unsure {
        /// The error.
        error: f32,
        /// Allowed at most.
        most: f32,
    },
}

/// The fit of a magnetometer's rotation, under way.
#[derive(Clone, Debug)]
pub struct AlignmentFit {
    /// The cloud's fit once more, of whose covariance an estimate keeps the diagonal alone.
    cloud: Fit,
    /// It is at its end.
    has_cloud: bool,
    /// The start that is tried.
    start: usize,
    solver: LevenbergMarquardt<f32, 4>,
    /// The end that is lowest so far.
    lowest: Option<LevenbergMarquardt<f32, 4>>,
}

/// Directions of specific force and field at rest, each calibrated by itself.
struct Dips<'a, const N: usize, const B: usize, const M: usize> {
    session: &'a Session<N, B, M>,
    acc: &'a Triad<f32>,
    mag: &'a Triad<f32>,
}

impl<const N: usize, const B: usize, const M: usize> Dips<'_, N, B, M> {
    fn pairs(&self) -> impl Iterator<Item = DirectionPair<f32>> {
        let poses = self.session.poses.list().iter().filter(|pose| pose.has_field());
        poses.map(|pose| DirectionPair {
            u_f: unit(&self.acc.correct(&pose.acc)),
            u_b: unit(&self.mag.correct(&pose.field)),
        })
    }

    /// Mean length of the field, µT.
    fn length(&self) -> f32 {
        let poses = || self.session.poses.list().iter().filter(|pose| pose.has_field());
        let lengths = poses().map(|pose| libm::sqrtf(self.mag.correct(&pose.field).norm_squared()));
        lengths.sum::<f32>() / poses().count() as f32
    }
}

impl<const N: usize, const B: usize, const M: usize> Model<f32, 4> for Dips<'_, N, B, M> {
    fn rows<S: RowSink<f32, 4>>(&self, theta: &SVector<f32, 4>, sink: &mut S) {
        for pair in self.pairs() {
            DipModel { pairs: core::slice::from_ref(&pair) }.rows(theta, sink);
        }
    }

    fn independent_rows(&self) -> usize {
        self.pairs().count()
    }
}

impl<const N: usize, const B: usize, const M: usize> Session<N, B, M> {
    /// Begins to look how the magnetometer lies against the accelerometer, by the fits as they are now.
    ///
    /// # Errors
    ///
    /// [`NotAligned`]: why it cannot be found.
    pub fn alignment(&self) -> Result<AlignmentFit, NotAligned> {
        let have = self.dips()?.independent_rows();
        if have < LEAST_POSES {
            return Err(NotAligned::TooFewRests { have, need: LEAST_POSES });
        }
        let cloud = self.begin_magnetometer().ok_or(NotAligned::NotAccepted(Sensor::Magnetometer))?;
        Ok(AlignmentFit { cloud, has_cloud: false, start: 0, solver: Self::starting(0), lowest: None })
    }

    /// Turns the magnetometer's estimate as a fit has found at its end. A later fit of the cloud is in the magnetometer's own axes
    /// again.
    ///
    /// # Errors
    ///
    /// [`NotAligned`]; the estimate is as it was.
    #[inline(never)]
    pub fn align(&mut self, fit: &AlignmentFit) -> Result<(), NotAligned> {
        let aligned = self.aligned(fit)?;
        let [.., mag] = &mut self.estimates;
        *mag = Some(aligned);
        Ok(())
    }

    /// [`Self::alignment`] to its end, then [`Self::align`]. It takes as long as a few fits; who has samples to take meanwhile calls those
    /// by slices.
    ///
    /// # Errors
    ///
    /// [`NotAligned`]: why the magnetometer stays in its own axes.
    pub fn align_axes(&mut self) -> Result<(), NotAligned> {
        let mut fit = self.alignment()?;
        while fit.work(self) {}
        self.align(&fit)
    }

    fn aligned(&self, fit: &AlignmentFit) -> Result<Estimate, NotAligned> {
        let dips = self.dips()?;
        let most = LARGEST_ERROR as f32;
        let unsure = |error: f32| NotAligned::Unsure { error, most };
        let solver = fit.lowest.as_ref().ok_or(unsure(f32::NAN))?;
        let freedom = dips.independent_rows().saturating_sub(4) as f32;
        let (inverse, variance) =
            solver.factor().covariance(1.0).zip(solver.variance()).ok_or(unsure(f32::NAN))?;
        let wider = wider(freedom);
        let covariance = inverse * (variance * wider * wider);
        let found = Alignment::new(dips.pairs(), dips.length(), solver.theta(), &covariance, &inverse);
        let error = found.error();
        let estimate = self.estimate(Sensor::Magnetometer).filter(|_| error <= most).ok_or(unsure(error))?;
        let triad = found.turned(&estimate.triad);
        let covariance = stated(&fit.cloud, None).ok_or(unsure(error))?;
        let std = found.errors(&estimate.triad, &self.changes(&fit.cloud), &covariance);
        let std = std.ok_or(unsure(error))?;
        Ok(Estimate { triad, std, alignment_error: Some(error), ..*estimate })
    }

    /// How the estimate follows the parameters of the cloud's fit.
    #[inline(never)]
    fn changes(&self, cloud: &Fit) -> [Triad<f32>; 9] {
        let gain = UPPER_TRIANGULAR.triad(cloud.solver.theta()).gain;
        let gauge = match self.settings.field {
            Some(_) => Gauge::of_known_field(),
            None => Gauge::of_unknown_field(&gain),
        };
        let none = Triad { gain: Matrix3::zeros(), bias: Vector3::zeros() };
        let mut changes = [none; 9];
        // Entries of the gain by columns: their places among the parameters, which go by rows.
        let places = [Some(0), None, None, Some(1), Some(3), None, Some(2), Some(4), Some(5)];
        for (at, (place, value)) in places.iter().zip(gain.iter()).enumerate() {
            let Some(place) = place else { continue };
            let slopes = gauge.slopes(*place, *value) / gauge.divisor;
            for (change, slope) in changes.iter_mut().zip(slopes.iter()) {
                change.gain.as_mut_slice().get_mut(at).into_iter().for_each(|entry| *entry = *slope);
            }
        }
        for (axis, change) in changes.iter_mut().skip(6).enumerate() {
            change.bias.as_mut_slice().get_mut(axis).into_iter().for_each(|entry| *entry = 1.0);
        }
        changes
    }

    fn starting(at: usize) -> LevenbergMarquardt<f32, 4> {
        let phi = RELABELLINGS.get(at).map_or_else(Default::default, |way| relabelling::<f32>(*way));
        LevenbergMarquardt::new(SVector::from([phi.x, phi.y, phi.z, 0.0]), Default::default())
    }

    /// Of sensors that are accepted, as long as the magnetometer is in its own axes.
    fn dips(&self) -> Result<Dips<'_, N, B, M>, NotAligned> {
        let accepted = |sensor: Sensor| {
            let estimate = self.estimate(sensor).filter(|estimate| estimate.verdict.is_ok());
            estimate.ok_or(NotAligned::NotAccepted(sensor))
        };
        let (acc, mag) = (accepted(Sensor::Accelerometer)?, accepted(Sensor::Magnetometer)?);
        match mag.alignment_error {
            Some(_) => Err(NotAligned::Already),
            None => Ok(Dips { session: self, acc: &acc.triad, mag: &mag.triad }),
        }
    }
}

impl AlignmentFit {
    /// One slice: an iteration of the cloud's fit, or of the dip's from one of the starts; false once nothing is left to be done. The
    /// session must be as it was when the fit began.
    pub fn work<const N: usize, const B: usize, const M: usize>(
        &mut self,
        session: &Session<N, B, M>,
    ) -> bool {
        if self.start >= RELABELLINGS.len() {
            return false;
        }
        if !self.has_cloud {
            self.has_cloud = session.advance(&mut self.cloud) != Some(false);
            return true;
        }
        let Ok(dips) = session.dips() else { return false };
        if let Some(end) = self.solver.step(&dips) {
            let cost = self.solver.factor().squared_sum();
            let is_lowest =
                self.lowest.as_ref().is_none_or(|lowest| is_lower(cost, lowest.factor().squared_sum()));
            if end.was_successful() && is_lowest {
                self.lowest = Some(self.solver.clone());
            }
            self.start += 1;
            self.solver = Session::<N, B, M>::starting(self.start);
        }
        true
    }
}
