//! Zeros of functions of time that are known with their rates.

use polypod_core::numerics::hermite_roots::{self, Node, Precision};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{Array, slice};

/// Time and whether it is a crossing (else a near miss) of each zero of a function that is known with its
/// rate.
#[pyfunction]
pub fn zeros<'py>(
    time: Array<'py>,
    values: Array<'py>,
    rates: Array<'py>,
    resolution: f64,
) -> PyResult<Vec<(f64, bool)>> {
    let nodes = nodes(&time, &values, &rates)?;
    Ok(hermite_roots::events(&nodes, resolution)
        .into_iter()
        .map(|(t, e)| (t, e == hermite_roots::Event::Crossing))
        .collect())
}

/// Times at which such a function must be known next, none once its zeros are found to the precision of
/// crossings, of near misses, and of zeros apart.
#[pyfunction]
pub fn unsettled_zeros<'py>(
    time: Array<'py>,
    values: Array<'py>,
    rates: Array<'py>,
    precision: [f64; 3],
) -> PyResult<Vec<f64>> {
    let [crossing, dip, resolution] = precision;
    Ok(hermite_roots::unsettled(&nodes(&time, &values, &rates)?, &Precision { crossing, dip, resolution }))
}

fn nodes(time: &Array<'_>, values: &Array<'_>, rates: &Array<'_>) -> PyResult<Vec<Node>> {
    let (time, values, rates) = (slice(time)?, slice(values)?, slice(rates)?);
    if time.len() != values.len() || time.len() != rates.len() {
        return Err(PyValueError::new_err("needs one value and one rate for each time"));
    }
    Ok(time.iter().zip(values).zip(rates).map(|((&t, &f), &d)| Node { t, f, d }).collect())
}
