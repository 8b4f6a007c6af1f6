//! What a host may ask, and what a device may answer.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::{
    CaptureOutcome, CaptureState, CaptureTask, FitProgress, FitReport, FitTask, Identity, LastReset,
    Observation, RawSamples, Status,
};
use crate::record::{Date, Defect, RawUnit, Sensor};

/// Observations of one message at the most.
pub const BATCH: usize = 12;

/// Samples of one triad, as many as a frame has room for.
pub type Values = Vec<[f32; 3], { 4 * BATCH }>;

/// From host to device. The order of the variants is the format: append only.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Request<'a> {
    /// Who is there? Answered by [`Reply::Identity`], and offers a session.
    Identify {
        /// A number that the host has drawn: of 64 random bits.
        nonce: u64,
    },
    /// How are you? Answered by [`Reply::Status`].
    Status,
    /// The stored record's bytes, whether they can be used or not. Answered by [`Reply::Record`].
    GetRecord,
    /// Store a record and use it. Answered by [`Reply::Stored`] once it is whole in flash.
    PutRecord {
        /// Its bytes.
        record: &'a [u8],
        /// Store it although the one stored is another sensor's or a newer format's.
        replace: bool,
    },
    /// Correct samples, raw unit of the record. Answered by [`Reply::Corrected`].
    Correct {
        /// Of which triad.
        sensor: Sensor,
        /// °C; NaN where it is not known.
        temperature: f32,
        /// The samples.
        raw: Values,
    },
    /// Send each so many samples of the device's own sensor corrected; 0 ends the stream. Answered by
    /// [`Reply::Done`], and then by [`Reply::Sample`]s.
    Stream {
        /// Every so many samples.
        every: u16,
    },
    /// Begin a fit; one that is under way is given up. Answered by [`Reply::Progress`].
    StartFit(FitTask),
    /// Observations of the fit begun. Answered by [`Reply::Progress`].
    Feed {
        /// Index of the first one.
        index: u16,
        /// The observations.
        observations: Vec<Observation, BATCH>,
    },
    /// Go on with the fit for so many slices, or to its end. Answered by [`Reply::Progress`] when that is done;
    /// meanwhile the device does whatever else it does.
    StepFit {
        /// Slices; 65 535: to the end.
        slices: u16,
    },
    /// Judge a fit that has stopped; one that is accepted is used from then on, and stored by [`Request::Store`].
    /// Answered by [`Reply::Report`].
    FinishFit {
        /// Today, for the record.
        date: Date,
    },
    /// Store the record in use. Answered as [`Request::PutRecord`] is.
    Store {
        /// As there.
        replace: bool,
    },
    /// Give the fit up. Answered by [`Reply::Done`].
    AbortFit,
    /// Refuse whatever changes something from now on. Answered by [`Reply::Done`].
    Lock,
    /// Take changes again. Answered by [`Reply::Done`]; of a device without a key, by [`Fault::Locked`] where it is
    /// locked.
    Unlock,
    /// How did the last run end? Answered by [`Reply::LastReset`].
    LastReset,
    /// Begin a calibration session; one that is under way is given up. From then on raw samples, the device's own
    /// and [`Request::Samples`], go into it. Answered by [`Reply::Capture`].
    StartCapture(CaptureTask),
    /// Raw samples for the session under way; without one for the drift watch. Answered by [`Reply::Capture`], or
    /// [`Reply::Done`], when all have been taken.
    Samples {
        /// Index of the first one since the session, or without one the device, started; modulo 65 536.
        index: u16,
        /// The samples.
        samples: RawSamples,
    },
    /// How far is the session? Answered by [`Reply::Capture`].
    Capture,
    /// End the session: what is accepted and surer than what is in use is used from then on, and stored by
    /// [`Request::Store`]. Answered by [`Reply::Captured`] when the last fits are done.
    FinishCapture {
        /// Today, for the record.
        date: Date,
    },
    /// Give the session up. Answered by [`Reply::Done`].
    AbortCapture,
    /// Use and store the record before the one that is stored. Answered as [`Request::PutRecord`] is; where another one
    /// than `of` is stored already, by its number.
    RestorePrevious {
        /// Number of the stored record.
        of: u32,
    },
    /// What has the drift watch seen? Answered by [`Reply::Watch`].
    Watch,
    /// What is taken off the rate of the device's own gyroscope, since it lay still after its start? Answered by
    /// [`Reply::BiasOfTheDay`].
    BiasOfTheDay,
}

impl Request<'_> {
    /// Whether it changes a record, the calibration in use, a fit or the lock's end: what the lock refuses, and what
    /// needs a seal where the device has a key.
    pub fn changes(&self) -> bool {
        match self {
            Self::Identify { .. }
            | Self::Status
            | Self::GetRecord
            | Self::Correct { .. }
            | Self::Stream { .. }
            | Self::Lock
            | Self::LastReset
            | Self::Capture
            | Self::Watch
            | Self::BiasOfTheDay => false,
            Self::PutRecord { .. }
            | Self::StartFit(_)
            | Self::Feed { .. }
            | Self::StepFit { .. }
            | Self::FinishFit { .. }
            | Self::Store { .. }
            | Self::AbortFit
            | Self::Unlock
            | Self::StartCapture(_)
            | Self::Samples { .. }
            | Self::FinishCapture { .. }
            | Self::AbortCapture
            | Self::RestorePrevious { .. } => true,
        }
    }
}

/// From device to host. The order of the variants is the format: append only.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Reply<'a> {
    /// To [`Request::Identify`]; its frame bears the name of the session that is offered.
    Identity(Identity),
    /// To [`Request::Status`].
    Status(Status),
    /// To [`Request::GetRecord`].
    Record(&'a [u8]),
    /// A record is in flash.
    Stored {
        /// Its number since the flash was empty.
        sequence: u32,
    },
    /// To [`Request::Correct`]: the same samples, calibrated.
    Corrected(Values),
    /// One sample of a stream.
    Sample {
        /// Number since the device started.
        number: u32,
        /// Accelerometer, gyroscope and magnetometer, calibrated; `None` where the device has none, or no
        /// calibration of it.
        values: [Option<[f32; 3]>; 3],
    },
    /// How far the fit is.
    Progress(FitProgress),
    /// To [`Request::FinishFit`].
    Report(FitReport),
    /// Done, and nothing to say.
    Done,
    /// Not done.
    Fault(Fault),
    /// To [`Request::LastReset`].
    LastReset(LastReset),
    /// How far the calibration session is.
    Capture(CaptureState),
    /// To [`Request::FinishCapture`]: accelerometer, gyroscope, magnetometer.
    Captured([CaptureOutcome; 3]),
    /// To [`Request::Watch`]: the bytes of a [`WatchSummary`](crate::watch::WatchSummary).
    Watch(&'a [u8]),
    /// To [`Request::BiasOfTheDay`]: rad/s, calibrated; `None` where nothing is taken off.
    BiasOfTheDay(Option<[f32; 3]>),
}

/// Why a request was not done. Nothing has changed, but that observations before the one refused are taken.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Fault {
    /// A frame was damaged on its way.
    Damaged,
    /// A frame was too long.
    Oversized,
    /// The frame's version is not this. Only written as [`refuse_version`](super::refuse_version) does.
    Version {
        /// The device's.
        supported: u8,
    },
    /// Intact, but no request of this version, or figures that are not finite.
    Malformed,
    /// A request that came again or late, or whose id is too far above the last one.
    Stale {
        /// The last id taken.
        last: u32,
    },
    /// Observations before or after those expected.
    OutOfSequence {
        /// Index of the next.
        expected: u16,
    },
    /// No room for these observations.
    Full,
    /// The fit begun does not take such observations, or does not exist on this device.
    Unsuited,
    /// Another request is still being worked at.
    Busy,
    /// No fit was begun, or it has not stopped.
    NotReady,
    /// No record is in use for this sensor.
    NoRecord,
    /// The record is damaged.
    BadRecord,
    /// The record's format is newer than this firmware.
    NewerFormat,
    /// The record was made for another unit.
    OtherSensor,
    /// What is stored is another sensor's or a newer format's, and `replace` was not set.
    Occupied,
    /// The flash did not take it.
    Flash,
    /// Not of this session: the device has started again, or another host has begun one. Identify.
    Session,
    /// It changes something, and has no seal.
    KeyNeeded,
    /// Its seal is wrong, or the device has no key.
    WrongSeal,
    /// The device is locked.
    Locked,
    /// A record, or a fit that is otherwise accepted, that no sensor can have. What was in use still is.
    Implausible(Defect),
    /// A record or a fit for samples in another unit than the board puts out.
    OtherUnit {
        /// Whose.
        sensor: Sensor,
        /// What the board puts out.
        expected: RawUnit,
    },
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        accept::Refusal,
        link::{
            FitModel, Header, MAX_FRAME, MOST_COVARIANCE, MOST_PARAMETERS, Origin, RawSample, SAMPLES, encode,
        },
        record,
        solver::Termination,
        watch,
    };

    fn fits(message: &impl Serialize) -> bool {
        let header = Header { id: u32::MAX, origin: Origin::Device, session: u32::MAX };
        encode(&header, message, None, &mut [0; MAX_FRAME]).is_ok()
    }

    #[test]
    fn the_longest_messages_fit_a_frame() {
        let values = Values::from([[1e30; 3]; 4 * BATCH]);
        assert!(fits(&Request::Correct {
            sensor: Sensor::Magnetometer,
            temperature: 1e30,
            raw: values.clone()
        }));
        assert!(fits(&Reply::Corrected(values)));
        assert!(fits(&Request::PutRecord { record: &[1; record::MAX_LEN], replace: true }));
        let block = Observation::Block([1.0; 3], [1.0; 3], [1.0; 3], 1.0);
        assert!(fits(&Request::Feed { index: u16::MAX, observations: Vec::from([block; BATCH]) }));
        let refusal =
            Refusal::PoorCoverage { coverage: 1.0, flatness: 1.0, need_coverage: 1.0, need_flatness: 1.0 };
        assert!(fits(&Reply::Report(FitReport {
            model: FitModel::I14,
            termination: Termination::NotFinite,
            iterations: u16::MAX,
            evaluations: u16::MAX,
            independent_rows: u32::MAX,
            cost: 1.0,
            gradient: 1.0,
            condition: 1.0,
            nonlinearity: 1.0,
            coverage: 1.0,
            refusal: Some(refusal),
            theta: Vec::from([1.0; MOST_PARAMETERS]),
            covariance: Vec::from([1.0; MOST_COVARIANCE]),
        })));
        let sample = RawSample { time: u64::MAX, raw: [Some([1.0; 3]); 3], temperature: 1.0 };
        assert!(fits(&Request::Samples { index: u16::MAX, samples: Vec::from([sample; SAMPLES]) }));
        assert!(fits(&Reply::Captured([CaptureOutcome::Refused(refusal); 3])));
        assert!(fits(&Reply::Watch(&[1; watch::MAX_LEN])));
    }
}
