//! The magnetometer turned into the accelerometer's axes, by the dip of the field in a session's rests.
//!
//! An ellipsoid leaves a magnetometer in axes of its own. A fit of the dip ([`crate::model::dip`]) starts from each way in which a
//! magnetometer may lie on its board, and the lowest end counts. The turned triad's errors ([`crate::model::alignment`]) are those of
//! the cloud's fit and of the rotation, by what the dips leave.
//!
//! A dip is as constant where all axes of the magnetometer are reversed, so that a mirrored one looks like one that is turned, in a field
//! reversed. What decides is the sense of the dip ([`super::SessionSettings::field_down`]): where it contradicts, the magnetometer is
//! refused, and where it is not known, one that is mounted in another order than the accelerometer.
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
    accept::{Quantity, Refusal},
    model::{
        Model, RowSink,
        alignment::Alignment,
        dip::{
            DipModel, DirectionPair, LARGEST_ERROR, LEAST_ALONG, LEAST_POSES, LEAST_SINE, RELABELLINGS,
            is_lower, relabelling,
        },
        parameterisation::UPPER_TRIANGULAR,
    },
    record::Sensor,
    rotation::axis_order::nearest,
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
    /// The dip is the other way than the field at this place, so that the magnetometer or the accelerometer is mirrored.
    Mirrored,
    /// It lies in another order of the axes, or is mirrored; where the field points would decide.
    MountOrMirror,
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
    /// [`NotAligned`]; the estimate is as it was. What has mirrored axes, or may have, is refused from then on.
    #[inline(never)]
    pub fn align(&mut self, fit: &AlignmentFit) -> Result<(), NotAligned> {
        let (found, sine) = self.rotation(fit)?;
        if let Err(why) = self.check_axes(&found.rotation, sine) {
            self.refuse_axes(&found.rotation, why);
            return Err(why);
        }
        let aligned = self.aligned(fit, &found)?;
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

    /// The rotation that a fit has found, and the sine of the field's dip: above zero where it points down.
    #[inline]
    fn rotation(&self, fit: &AlignmentFit) -> Result<(Alignment<f32>, f32), NotAligned> {
        let dips = self.dips()?;
        let solver = fit.lowest.as_ref().ok_or(unsure(f32::NAN))?;
        let freedom = dips.independent_rows().saturating_sub(4) as f32;
        let (inverse, variance) =
            solver.factor().covariance(1.0).zip(solver.variance()).ok_or(unsure(f32::NAN))?;
        let wider = wider(freedom);
        let covariance = inverse * (variance * wider * wider);
        let found = Alignment::new(dips.pairs(), dips.length(), solver.theta(), &covariance, &inverse);
        let error = found.error();
        if error <= LARGEST_ERROR as f32 { Ok((found, -solver.theta().w)) } else { Err(unsure(error)) }
    }

    /// Whether the sense of the dip is that of the place.
    #[inline]
    fn check_axes(&self, rotation: &Matrix3<f32>, sine: f32) -> Result<(), NotAligned> {
        match self.settings.field_down.filter(|_| libm::fabsf(sine) > LEAST_SINE as f32) {
            Some(down) if down != (sine > 0.0) => Err(NotAligned::Mirrored),
            None if is_in_another_order(rotation) => Err(NotAligned::MountOrMirror),
            _ => Ok(()),
        }
    }

    /// Refuses the magnetometer, and the accelerometer where nothing says that it is the right one of the two: the gyroscope confirms its
    /// axes up to all three reversed.
    #[inline]
    fn refuse_axes(&mut self, rotation: &Matrix3<f32>, why: NotAligned) {
        let refusal = |mirror: Matrix3<f32>| {
            let value = nearest(&-mirror).0 as f64;
            Refusal::Implausible { what: Quantity::Axes, value, limit: 0.0 }
        };
        let confirmed = self.estimate(Sensor::Gyroscope).is_some_and(|gyr| gyr.verdict.is_ok());
        let by_acc = why == NotAligned::Mirrored && !(confirmed && is_in_another_order(rotation));
        let [acc, _, mag] = &mut self.estimates;
        if let Some(mag) = mag {
            mag.verdict = Err(refusal(rotation.transpose()));
        }
        if let Some(acc) = acc.as_mut().filter(|_| by_acc) {
            acc.verdict = Err(refusal(*rotation));
        }
    }

    #[inline]
    fn aligned(&self, fit: &AlignmentFit, found: &Alignment<f32>) -> Result<Estimate, NotAligned> {
        let error = found.error();
        let estimate = self.estimate(Sensor::Magnetometer).ok_or(unsure(error))?;
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

/// The magnetometer's axes are another order of the accelerometer's.
#[inline]
fn is_in_another_order(rotation: &Matrix3<f32>) -> bool {
    let (code, along) = nearest(rotation);
    code != 0 && along > LEAST_ALONG as f32
}

#[inline]
fn unsure(error: f32) -> NotAligned {
    NotAligned::Unsure { error, most: LARGEST_ERROR as f32 }
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
