//! Work that takes long: in a thread of its own, while this one lets Python's other threads run and hears Ctrl-C.

use std::{
    sync::mpsc::{self, RecvTimeoutError},
    thread,
    time::Duration,
};

use pyo3::prelude::*;

use crate::failure::ImucalError;

/// How long Ctrl-C may wait.
const TICK: Duration = Duration::from_millis(50);
/// As the main thread of a program has.
const STACK: usize = 8 << 20;

/// What `work` comes to. Interrupted, it runs to its end unheard and its result is dropped: nothing stops it halfway.
pub(crate) fn run<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let (send, mut result) = mpsc::channel();
    let send = move || {
        // Where Ctrl-C was heard, nobody receives.
        let _ = send.send(work());
    };
    thread::Builder::new().name("imucal".into()).stack_size(STACK).spawn(send)?;
    loop {
        let received;
        // The receiver goes along, since it is of one thread at a time.
        (result, received) = py.detach(move || {
            let received = result.recv_timeout(TICK);
            (result, received)
        });
        match received {
            Ok(done) => return Ok(done),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => {
                return Err(ImucalError::new_err("imucal failed at work: see standard error, and report it"));
            }
        }
    }
}
