//! The chart that a simulation integrates in, one state at a time.

use numpy::{PyArray1, PyArrayMethods};
use polypod_core::batch::pose_of;
use polypod_core::dynamics::forward_dynamics::{SINGULAR_BALANCE, forward_dynamics};
use polypod_core::dynamics::inverse_dynamics::load_in_base;
use polypod_core::kinematics::chart::{Chart, ChartPoint};
use polypod_core::model::spec::Axes;
use polypod_core::spatial::{Twist, Wrench};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{Array, slice};
use crate::mechanism::PyMechanism;

#[pyclass(name = "Chart", frozen)]
pub struct PyChart {
    mech: Py<PyMechanism>,
    chart: Chart,
}

fn six(array: &[f64]) -> PyResult<[f64; 6]> {
    array.try_into().map_err(|_| PyValueError::new_err("needs six numbers"))
}

impl PyChart {
    /// Coordinates and rates as a point of the chart; none where it ends.
    fn place(&self, y: &[f64]) -> PyResult<Option<ChartPoint>> {
        let d = self.chart.freedoms();
        if y.len() != 2 * d {
            return Err(PyValueError::new_err(
                "needs one coordinate and one rate for each degree of freedom",
            ));
        }
        Ok(self.chart.place(self.mech.get().core(), &y[..d], &y[d..]))
    }
}

#[pymethods]
impl PyChart {
    /// The chart at a pose; none where its constraints are dependent.
    #[staticmethod]
    fn at(mech: Py<PyMechanism>, pose: Array<'_>) -> PyResult<Option<Self>> {
        let pose = slice(&pose)?;
        if pose.len() != 16 {
            return Err(PyValueError::new_err("needs one pose"));
        }
        let chart = Chart::at(mech.get().core(), &pose_of(pose));
        Ok(chart.map(|chart| PyChart { mech, chart }))
    }

    /// Coordinates, which are zero, and rates of a twist at the chart's own pose.
    fn start<'py>(&self, py: Python<'py>, twist: Array<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let mut y = vec![0.0; self.chart.freedoms()];
        y.extend(self.chart.rates(&Twist::from_array(six(slice(&twist)?)?)));
        Ok(PyArray1::from_vec(py, y))
    }

    /// Pose and twist of coordinates and rates; NaN where the chart ends.
    #[allow(clippy::type_complexity)]
    fn state<'py>(
        &self,
        py: Python<'py>,
        y: Array<'py>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyArray1<f64>>)> {
        let place = self.place(slice(&y)?)?;
        let pose = place.map_or([f64::NAN; 16], |p| p.pose.matrix());
        let twist = place.map_or([f64::NAN; 6], |p| p.twist.array());
        let pose = PyArray1::from_slice(py, &pose).reshape([4, 4])?.into_any();
        Ok((pose, PyArray1::from_slice(py, &twist)))
    }

    /// The rates of coordinates and rates under the forces of all legs and a load (the mechanism's own
    /// without one); NaN where there are none.
    #[pyo3(signature = (y, forces, wrench, platform_axes))]
    fn rates<'py>(
        &self,
        py: Python<'py>,
        y: Array<'py>,
        forces: Array<'py>,
        wrench: Option<Array<'py>>,
        platform_axes: bool,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (mech, y, forces) = (self.mech.get().core(), slice(&y)?, slice(&forces)?);
        if forces.len() != mech.legs.len() {
            return Err(PyValueError::new_err("needs one force for each leg"));
        }
        let (load, axes) = match &wrench {
            None => (mech.load.wrench, mech.load.axes),
            Some(wrench) => {
                let axes = if platform_axes { Axes::Platform } else { Axes::Base };
                (Wrench::from_array(six(slice(wrench)?)?), axes)
            }
        };
        let none = vec![f64::NAN; y.len()];
        let Some(place) = self.place(y)? else { return Ok(PyArray1::from_vec(py, none)) };
        let push: Vec<f64> = mech.actuated().map(|(k, _)| forces[k]).collect();
        let load = load_in_base(load, axes, &place.pose);
        let driven = forward_dynamics(mech, &place.pose, &place.twist, &push, load);
        if !(driven.pivots > SINGULAR_BALANCE) {
            return Ok(PyArray1::from_vec(py, none));
        }
        let mut rates = y[self.chart.freedoms()..].to_vec();
        rates.extend(self.chart.second_rates(&place, &driven.acceleration));
        Ok(PyArray1::from_vec(py, rates))
    }
}
