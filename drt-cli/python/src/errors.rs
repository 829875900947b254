//! Errors, in the words of the command.

use pyo3::exceptions::PyValueError;
use pyo3::{PyErr, create_exception};

create_exception!(
    drt,
    Error,
    PyValueError,
    "An input, an argument or a value that cannot be used. The message is that of the command `drt`: it names the file and the \
     place, and what was expected."
);

/// The exception of an error of the library.
pub(crate) fn raised(error: &impl std::fmt::Display) -> PyErr {
    Error::new_err(error.to_string())
}
