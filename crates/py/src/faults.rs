//! Faults of a mechanism as an exception of Python.

use polypod_core::model::spec::Fault;
use pyo3::prelude::*;

pyo3::create_exception!(
    _core,
    Faults,
    pyo3::exceptions::PyException,
    "All faults of a mechanism as (place, message)."
);

/// The one place where errors of the core become errors of Python.
pub fn raise(faults: Vec<Fault>) -> PyErr {
    Faults::new_err((faults.into_iter().map(|f| (f.place, f.message)).collect::<Vec<_>>(),))
}
