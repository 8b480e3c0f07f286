//! Searches of the workspace, one wave at a time, so that the caller can show progress and stop.

use numpy::{PyArray1, PyArray3, PyArrayMethods};
use polypod_core::batch::pose_of;
use polypod_core::parallel::threads::Team;
use polypod_core::spatial::{Pose, Vec3};
use polypod_core::workspace::fit_orientation::fit;
use polypod_core::workspace::flood_fill::{Flood, Grid, Stop, led};
use polypod_core::workspace::length_lattice::Lattice;
use polypod_core::workspace::pose_bounds::{Bounded, PoseBounds};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Array, slice};
use crate::mechanism::PyMechanism;

/// Codes of what stops the platform where it is no limit.
const SINGULARITY: i64 = -1;
const GRID: i64 = -2;
const SEARCH: i64 = -3;

fn team(threads: usize) -> PyResult<Team> {
    Team::new(threads).map_err(|e| PyValueError::new_err(format!("threads: {e}")))
}

fn start_pose(start: &Array<'_>) -> PyResult<Pose<f64>> {
    let start = slice(start)?;
    if start.len() == 16 { Ok(pose_of(start)) } else { Err(PyValueError::new_err("needs one start pose")) }
}

/// The poses (n, 4, 4) inside all limits next to given ones with the same o; NaN where the search finds none.
#[pyfunction]
pub fn fit_poses<'py>(
    py: Python<'py>,
    mech: &Bound<'py, PyMechanism>,
    poses: Array<'py>,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let poses = slice(&poses)?;
    if poses.len() % 16 != 0 {
        return Err(PyValueError::new_err("needs whole poses"));
    }
    let fitted = poses.chunks_exact(16).flat_map(|matrix| {
        let pose = pose_of(matrix);
        fit(mech.get().core(), &pose, pose.o).map_or([f64::NAN; 16], |pose| pose.matrix())
    });
    PyArray1::from_vec(py, fitted.collect()).reshape([poses.len() / 16, 4, 4])
}

/// The poses (n, 4, 4) that are reached from given ones on straight ways of o to given points (n, 3), in small
/// pieces; NaN where the way is not open.
#[pyfunction]
pub fn lead_poses<'py>(
    py: Python<'py>,
    mech: &Bound<'py, PyMechanism>,
    poses: Array<'py>,
    points: Array<'py>,
    keep_aspect: bool,
    threads: usize,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let (poses, points) = (slice(&poses)?, slice(&points)?);
    let n = poses.len() / 16;
    if poses.len() != 16 * n || points.len() != 3 * n {
        return Err(PyValueError::new_err("needs one point for each whole pose"));
    }
    let (core, team) = (mech.get().core(), team(threads)?);
    let point = |i: usize| Vec3::new(points[3 * i], points[3 * i + 1], points[3 * i + 2]);
    let ways: Vec<_> = (0..n).map(|i| (pose_of(&poses[16 * i..16 * i + 16]), point(i))).collect();
    let poses = py.detach(|| team.install(|| led(core, &ways, keep_aspect)));
    let led: Vec<f64> =
        poses.iter().flat_map(|pose| pose.map_or([f64::NAN; 16], |pose| pose.matrix())).collect();
    PyArray1::from_vec(py, led).reshape([n, 4, 4])
}

/// What bounds a pose: values (n,), and their derivatives (n, 6 + k) by v and ω in base axes and by the k
/// coordinates of drives that move their foot, of the constraints, the limits, the legs' directions, and det J.
#[pyfunction]
pub fn pose_bounds<'py>(
    py: Python<'py>,
    mech: &Bound<'py, PyMechanism>,
    pose: Array<'py>,
    coordinates: Array<'py>,
) -> PyResult<Bound<'py, PyDict>> {
    let (core, coordinates) = (mech.get().core(), slice(&coordinates)?);
    let k = core.legs.iter().filter(|leg| leg.drive.moves_foot()).count();
    if coordinates.len() != k {
        return Err(PyValueError::new_err(format!("needs the coordinates of {k} legs")));
    }
    let bounds = PoseBounds::at(core, &start_pose(&pose)?, coordinates);
    let result = PyDict::new(py);
    let enter = |name: &str, of: &[Bounded]| {
        let values: Vec<f64> = of.iter().map(|b| b.value).collect();
        let mut rows = Vec::with_capacity(of.len() * (6 + k));
        for bounded in of {
            rows.extend(bounded.row.force.array());
            rows.extend(bounded.row.torque.array());
            rows.extend(
                (0..k).map(|i| bounded.by_coordinate.map_or(0.0, |(of, d)| if of == i { d } else { 0.0 })),
            );
        }
        let rows = PyArray1::from_vec(py, rows).reshape([of.len(), 6 + k])?;
        result.set_item(name, (PyArray1::from_vec(py, values), rows))
    };
    enter("constraints", &bounds.constraints)?;
    enter("limits", &bounds.limits)?;
    enter("ahead", &bounds.ahead)?;
    enter("determinant", &[bounds.determinant])?;
    Ok(result)
}

#[pyclass(name = "Flood")]
pub struct PyFlood {
    mech: Py<PyMechanism>,
    flood: Flood,
    team: Team,
}

#[pymethods]
impl PyFlood {
    /// None if the node next to the start pose cannot be reached from it.
    #[staticmethod]
    #[allow(clippy::too_many_arguments)]
    fn begin(
        mech: Py<PyMechanism>,
        origin: [f64; 3],
        step: f64,
        counts: [usize; 3],
        start: Array<'_>,
        keep_aspect: bool,
        threads: usize,
    ) -> PyResult<Option<Self>> {
        let grid = Grid { origin: Vec3::from(origin), step, counts };
        let flood = Flood::new(mech.get().core(), grid, &start_pose(&start)?, keep_aspect);
        let team = team(threads)?;
        Ok(flood.map(|flood| PyFlood { mech, flood, team }))
    }

    /// The number of nodes that the next wave reaches.
    fn wave(&mut self, py: Python<'_>) -> usize {
        let (mech, team, flood) = (self.mech.get().core(), &self.team, &mut self.flood);
        py.detach(|| team.install(|| flood.wave(mech)))
    }

    /// The number of nodes that are reached in smaller steps only; waves may go on from them.
    fn retry(&mut self, py: Python<'_>) -> usize {
        let (mech, team, flood) = (self.mech.get().core(), &self.team, &mut self.flood);
        py.detach(|| team.install(|| flood.retry(mech)))
    }

    /// Mask of the reached nodes, flat, z fastest.
    fn mask<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        PyArray1::from_slice(py, &self.flood.mask)
    }

    /// The cut edges: reached node, direction (-x, x, -y, y, -z, z), share inside, pose, what stops it,
    /// margin.
    fn edges<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (mech, team, flood) = (self.mech.get().core(), &self.team, &self.flood);
        let edges = py.detach(|| team.install(|| flood.edges(mech)));
        let stop = |stop: Stop| match stop {
            Stop::Limit(i) => i as i64,
            Stop::Singularity => SINGULARITY,
            Stop::Grid => GRID,
            Stop::Search => SEARCH,
        };
        let poses: Vec<f64> = edges.iter().flat_map(|edge| edge.pose.matrix()).collect();
        let n = edges.len();
        let result = PyDict::new(py);
        result.set_item("node", PyArray1::from_vec(py, edges.iter().map(|e| e.node as i64).collect()))?;
        let directions = edges.iter().map(|e| e.direction as i64).collect();
        result.set_item("direction", PyArray1::from_vec(py, directions))?;
        result.set_item("share", PyArray1::from_vec(py, edges.iter().map(|e| e.share).collect()))?;
        result.set_item("pose", PyArray1::from_vec(py, poses).reshape([n, 4, 4])?)?;
        result.set_item("stop", PyArray1::from_vec(py, edges.iter().map(|e| stop(e.stop)).collect()))?;
        result.set_item("margin", PyArray1::from_vec(py, edges.iter().map(|e| e.margin).collect()))?;
        Ok(result)
    }
}

#[pyclass(name = "Lattice")]
pub struct PyLattice {
    mech: Py<PyMechanism>,
    lattice: Lattice,
    team: Team,
}

#[pymethods]
impl PyLattice {
    /// None where an actuated leg has no stroke, or no pose inside in the start's mode has the lengths next
    /// to it.
    #[staticmethod]
    fn begin(
        mech: Py<PyMechanism>,
        start: Array<'_>,
        bounds: [[f64; 2]; 3],
        step: f64,
        layer: f64,
        threads: usize,
    ) -> PyResult<Option<Self>> {
        let lattice = Lattice::new(mech.get().core(), &start_pose(&start)?, bounds, step, layer);
        let team = team(threads)?;
        Ok(lattice.map(|lattice| PyLattice { mech, lattice, team }))
    }

    /// The number of poses that the next wave reaches.
    fn wave(&mut self, py: Python<'_>) -> usize {
        let (mech, team, lattice) = (self.mech.get().core(), &self.team, &mut self.lattice);
        py.detach(|| team.install(|| lattice.wave(mech)))
    }

    #[getter]
    fn nodes(&self) -> usize {
        self.lattice.len()
    }

    /// Nodes with a pose that has been reached.
    #[getter]
    fn inside(&self) -> u64 {
        self.lattice.reached.inside
    }

    /// Counts, extents (3, 2), the profile (layers, 4) of least and greatest x and y, lower end and height of
    /// layers.
    fn reached<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let reached = &self.lattice.reached;
        let result = PyDict::new(py);
        result.set_item("poses", reached.poses)?;
        result.set_item("at_limits", reached.at_limits)?;
        result.set_item("singular", reached.singular)?;
        let extents = reached.extents.as_flattened().to_vec();
        result.set_item("extents", PyArray1::from_vec(py, extents).reshape([3, 2])?)?;
        let profile = reached.profile.as_flattened().to_vec();
        let layers = reached.profile.len();
        result.set_item("profile", PyArray1::from_vec(py, profile).reshape([layers, 4])?)?;
        result.set_item("layers", self.lattice.layers)?;
        Ok(result)
    }
}
