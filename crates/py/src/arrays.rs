//! Arrays of doubles from and for Python.

use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use polypod_core::batch::Table;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString, PyTuple};

/// States one after the other, whatever the shape of the batch.
#[derive(FromPyObject)]
pub struct Array<'py>(Bound<'py, PyArrayDyn<f64>>);

impl Array<'_> {
    fn shape(&self) -> &[usize] {
        self.0.shape()
    }

    /// Its numbers, while Python keeps to the rule that an array is not written to while it is worked on.
    fn numbers(&self) -> Option<&[f64]> {
        // Columns one after the other are contiguous, too, and would be read in the wrong order.
        if !self.0.is_c_contiguous() {
            return None;
        }
        // SAFETY: no reference into an array of Python outlives a call, and nothing here writes to an
        // argument.
        unsafe { self.0.as_slice() }.ok()
    }
}

pub fn slice<'a>(array: &'a Array<'_>) -> PyResult<&'a [f64]> {
    array.numbers().ok_or_else(|| PyValueError::new_err("needs a contiguous array"))
}

/// Leading axes of an array whose states have so many axes themselves: those of its batch.
pub fn batch_of(array: &Array<'_>, axes: usize) -> Vec<usize> {
    let shape = array.shape();
    shape[..shape.len().saturating_sub(axes)].to_vec()
}

/// Last axes of the arrays that a call takes.
#[pyclass(name = "Axes", frozen)]
pub struct PyAxes(Vec<Vec<usize>>);

#[pymethods]
impl PyAxes {
    #[new]
    fn new(axes: Vec<Vec<usize>>) -> Self {
        PyAxes(axes)
    }

    /// Whether the arguments can be handed over as they are: contiguous arrays of doubles with these last
    /// axes, and the same axes before them.
    fn fit(&self, arguments: &Bound<'_, PyTuple>) -> bool {
        let mut batch: Option<Vec<usize>> = None;
        arguments.len() == self.0.len()
            && arguments.iter().zip(&self.0).all(|(argument, axes)| {
                let Ok(array) = argument.extract::<Array>() else { return false };
                let Some(before) = array.shape().strip_suffix(axes.as_slice()) else { return false };
                array.numbers().is_some() && batch.get_or_insert_with(|| before.to_vec()) == before
            })
    }
}

/// Numbers that are sooner copied than handed over.
const SMALL: usize = 1024;

fn array<'py, T: numpy::Element + Copy>(
    py: Python<'py>,
    data: Vec<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    if data.len() > SMALL {
        return PyArray1::from_vec(py, data).reshape(shape);
    }
    // SAFETY: it is filled before anybody else has it.
    unsafe {
        let array = PyArrayDyn::<T>::new(py, shape, false);
        array.data().copy_from_nonoverlapping(data.as_ptr(), data.len());
        Ok(array)
    }
}

/// Arrays by name and their status, with the axes of the batch before those of a state.
pub fn arrays<'py>(py: Python<'py>, table: Table, batch: &[usize]) -> PyResult<Bound<'py, PyDict>> {
    arrays_but(py, table, batch, [], [])
}

/// Arrays by name, with the fields `M` as booleans (1 for true) and the fields `W` as whole numbers (-1 where
/// there is none).
pub fn arrays_but<'py, const M: usize, const W: usize>(
    py: Python<'py>,
    table: Table,
    batch: &[usize],
    marks: [&str; M],
    whole: [&str; W],
) -> PyResult<Bound<'py, PyDict>> {
    let result = PyDict::new(py);
    for field in table.fields {
        let shape = [batch, &field.shape].concat();
        let (name, data) = (PyString::intern(py, field.name), field.data.into_iter());
        // Vectors are changed in place.
        if marks.contains(&field.name) {
            result.set_item(name, array(py, data.map(|x| x == 1.0).collect(), &shape)?)?;
        } else if whole.contains(&field.name) {
            #[allow(clippy::cast_possible_truncation)]
            let number = |x: f64| if x.is_nan() { -1 } else { x as i64 };
            result.set_item(name, array(py, data.map(number).collect(), &shape)?)?;
        } else {
            result.set_item(name, array(py, data.collect(), &shape)?)?;
        }
    }
    let status = table.status.into_iter().map(|s| s as u8).collect();
    result.set_item(PyString::intern(py, "status"), array(py, status, batch)?)?;
    Ok(result)
}
