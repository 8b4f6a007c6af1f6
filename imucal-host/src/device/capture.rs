//! A calibration session on a device, its drift watch, and what it keeps of records.

use std::time::Duration;

use imucal_core::{
    link::{
        CaptureOutcome, CaptureState, CaptureTask, Fault, RawSample, RawSamples, Reply, Request, SAMPLES,
    },
    record::Date,
    watch::{self, WatchSummary},
};

use super::{DeviceError, Session};

/// Samples, each followed by a slice of a fit, are done by then.
const SAMPLES_PATIENCE: Duration = Duration::from_secs(10);
/// The last fits of a session are done by then.
const FIT_PATIENCE: Duration = Duration::from_secs(60);

impl Session {
    /// Begins a session; one that is under way is given up.
    ///
    /// # Errors
    /// [`DeviceError`]; a device without memory for a session refuses.
    pub fn start_capture(&mut self, task: CaptureTask) -> Result<CaptureState, DeviceError> {
        self.capture_state(&Request::StartCapture(task))
    }

    /// How far the session is.
    ///
    /// # Errors
    /// [`DeviceError`]; without a session it refuses.
    pub fn capture(&mut self) -> Result<CaptureState, DeviceError> {
        self.capture_state(&Request::Capture)
    }

    /// Sends raw samples to the session, up to [`SAMPLES`]; `before`: how many were sent before them.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn push_samples(&mut self, before: u32, samples: &[RawSample]) -> Result<CaptureState, DeviceError> {
        let request = Request::Samples { index: before as u16, samples: batch(samples) };
        let after = (before as u16).wrapping_add(samples.len() as u16);
        let taken = self.ask_within(SAMPLES_PATIENCE, &request, CAPTURE, |reply| match reply {
            Reply::Capture(state) => Some(*state),
            _ => None,
        });
        match taken {
            // They were taken although the answer was lost.
            Err(DeviceError::Refused { fault: Fault::OutOfSequence { expected }, .. })
                if expected == after =>
            {
                self.capture()
            }
            taken => taken,
        }
    }

    /// Sends raw samples to the drift watch, while there is no session; `before` as above, since the device started.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn watch_samples(&mut self, before: u32, samples: &[RawSample]) -> Result<(), DeviceError> {
        let request = Request::Samples { index: before as u16, samples: batch(samples) };
        self.ask_within(SAMPLES_PATIENCE, &request, "that samples were taken", |reply| {
            matches!(reply, Reply::Done).then_some(())
        })
    }

    /// Ends the session; of accelerometer, gyroscope and magnetometer what it came to.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn finish_capture(&mut self, date: Date) -> Result<[CaptureOutcome; 3], DeviceError> {
        let request = Request::FinishCapture { date };
        self.ask_within(FIT_PATIENCE, &request, "what a session came to", |reply| match reply {
            Reply::Captured(outcomes) => Some(*outcomes),
            _ => None,
        })
    }

    /// Gives the session up.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn abort_capture(&mut self) -> Result<(), DeviceError> {
        self.done(&Request::AbortCapture)
    }

    /// Goes back to the record before the stored one; its new number, or `None` where there is none.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn restore_previous(&mut self) -> Result<Option<u32>, DeviceError> {
        let of = self.status()?.sequence;
        match self.store(&Request::RestorePrevious { of }) {
            Err(DeviceError::Refused { fault: Fault::NoRecord, .. }) => Ok(None),
            sequence => sequence.map(Some),
        }
    }

    /// What the drift watch has seen; `None` where nothing is watched yet.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn watch(&mut self) -> Result<Option<WatchSummary>, DeviceError> {
        let summary = self.ask(&Request::Watch, "a summary of the drift watch", |reply| match reply {
            Reply::Watch(bytes) => watch::decode(bytes).ok(),
            _ => None,
        });
        match summary {
            Err(DeviceError::Refused { fault: Fault::NotReady, .. }) => Ok(None),
            summary => summary.map(Some),
        }
    }

    /// What is taken off the rate of the device's own gyroscope since it lay still after its start, rad/s; `None` where
    /// nothing is, or where the firmware does not say.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn bias_of_the_day(&mut self) -> Result<Option<[f32; 3]>, DeviceError> {
        let bias = self.ask(&Request::BiasOfTheDay, "a bias of the day", |reply| match reply {
            Reply::BiasOfTheDay(bias) => Some(*bias),
            _ => None,
        });
        match bias {
            Err(DeviceError::Refused { fault: Fault::Malformed, .. }) => Ok(None),
            bias => bias,
        }
    }

    fn capture_state(&mut self, request: &Request<'_>) -> Result<CaptureState, DeviceError> {
        self.ask(request, CAPTURE, |reply| match reply {
            Reply::Capture(state) => Some(*state),
            _ => None,
        })
    }
}

/// What is expected of a session's answers.
const CAPTURE: &str = "the state of a session";

/// Up to [`SAMPLES`] of them.
fn batch(samples: &[RawSample]) -> RawSamples {
    samples.iter().take(SAMPLES).copied().collect()
}
