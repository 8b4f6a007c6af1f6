//! What goes wrong, as exceptions of Python. Their texts are the library's: what was found, what was expected, what to do.

use std::fmt::Display;

use pyo3::{PyErr, create_exception, exceptions::PyException};

create_exception!(imucal, ImucalError, PyException, "What imucal cannot do, and why.");
create_exception!(imucal, ReadError, ImucalError, "A file or an array that is not what it should be.");
create_exception!(
    imucal,
    OptionError,
    ImucalError,
    "An argument that means nothing, or not for this recording."
);
create_exception!(imucal, MismatchError, ImucalError, "A calibration that is not for this recording.");
create_exception!(imucal, WriteError, ImucalError, "A file that cannot be written.");

/// A file or an array that cannot be read.
pub(crate) fn unread(cause: impl Display) -> PyErr {
    ReadError::new_err(cause.to_string())
}

/// An argument that means nothing.
pub(crate) fn option(cause: impl Display) -> PyErr {
    OptionError::new_err(cause.to_string())
}

/// A calibration and a recording that do not belong together.
pub(crate) fn mismatch(cause: impl Display) -> PyErr {
    MismatchError::new_err(cause.to_string())
}

/// A file that cannot be written.
pub(crate) fn unwritten(cause: impl Display) -> PyErr {
    WriteError::new_err(cause.to_string())
}
