//! Derivatives of inverse dynamics, regressor and base parameters.

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use polypod_core::assembly::geometric_parameters;
use polypod_core::batch;
use polypod_core::dynamics::regressor::{parameters, standard_values};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Array, arrays, batch_of};
use crate::mechanism::PyMechanism;
use crate::states::{loads, states};

/// Names of the coordinates that are varied, and the arrays.
#[pyfunction]
#[pyo3(signature = (mech, poses, twists, accelerations, wrenches, platform_axes, set, names))]
#[allow(clippy::too_many_arguments)]
pub fn inverse_dynamics_derivatives<'py>(
    py: Python<'py>,
    mech: &PyMechanism,
    poses: Array<'py>,
    twists: Array<'py>,
    accelerations: Array<'py>,
    wrenches: Option<Array<'py>>,
    platform_axes: bool,
    set: &str,
    names: Option<Vec<String>>,
) -> PyResult<(Vec<&'static str>, Bound<'py, PyDict>)> {
    let states = states(&poses, &twists, &accelerations)?;
    let loads = loads(wrenches.as_ref(), platform_axes, states.poses)?;
    let ((set, given, varied), core) = (mech.searched(set, names.as_deref())?, mech.core());
    let table = py.detach(|| batch::inverse_dynamics_derivatives(core, &states, &loads, &set, &given));
    Ok((varied, arrays(py, table, &batch_of(&poses, 2))?))
}

#[pyfunction]
#[pyo3(signature = (mech, poses, twists, accelerations, wrenches, platform_axes))]
pub fn regressor<'py>(
    py: Python<'py>,
    mech: &PyMechanism,
    poses: Array<'py>,
    twists: Array<'py>,
    accelerations: Array<'py>,
    wrenches: Option<Array<'py>>,
    platform_axes: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let motion = [&poses, &twists, &accelerations];
    mech.loaded(py, motion, wrenches.as_ref(), platform_axes, batch::regressors)
}

/// Names of the numbers of the geometry.
#[pyfunction]
pub fn geometry_parameters(mech: &PyMechanism) -> Vec<String> {
    geometric_parameters::parameters(mech.core()).iter().map(|p| p.name(mech.core())).collect()
}

/// Names of the standard parameters, names of the file's numbers, values of the standard parameters.
#[pyfunction]
pub fn inertial_parameters<'py>(
    py: Python<'py>,
    mech: &PyMechanism,
) -> (Vec<String>, Vec<String>, Bound<'py, PyArray1<f64>>) {
    let (core, parameters) = (mech.core(), parameters(mech.core()));
    (
        parameters.iter().map(|p| p.standard_name(core)).collect(),
        parameters.iter().map(|p| p.central_name(core)).collect(),
        PyArray1::from_vec(py, standard_values(core)),
    )
}

type BaseParameters<'py> = (Vec<usize>, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>);

/// Numbers of the parameters that are kept, their combinations one a row, and the remainders of all columns.
#[pyfunction]
pub fn base_parameters<'py>(py: Python<'py>, mech: &PyMechanism) -> PyResult<Option<BaseParameters<'py>>> {
    let Some(found) = py.detach(|| polypod_core::dynamics::base_parameters::base_parameters(mech.core()))
    else {
        return Ok(None);
    };
    let shape = [found.combination.nrows(), found.combination.ncols()];
    let rows: Vec<f64> = found.combination.transpose().iter().copied().collect();
    let combination = PyArray1::from_vec(py, rows).reshape(shape)?;
    Ok(Some((found.columns, combination, PyArray1::from_vec(py, found.remainders))))
}
