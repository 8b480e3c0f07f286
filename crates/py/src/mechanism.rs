//! The mechanism as a class of Python: each method hands its arrays to an operation on a batch of states.

use std::sync::OnceLock;

use numpy::{PyArray1, PyArrayMethods};
use polypod_core::assembly::build::assemble;
use polypod_core::batch::{self, Coordinates, Loads, Space, States, Table};
use polypod_core::dynamics::joint_reactions;
use polypod_core::forward_kinematics::assembly_modes::{self, Start};
use polypod_core::kinematics::coordinate_sets::Set;
use polypod_core::mobility::screw_systems;
use polypod_core::mobility::singularity::Screw;
use polypod_core::mobility::singularity_distance::SingularitySearch;
use polypod_core::model::limit::Limit;
use polypod_core::model::mechanism::Mechanism;
use polypod_core::model::spec::Spec;
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Array, arrays, arrays_but, batch_of, slice};
use crate::faults::raise;
use crate::states::{expect, guesses, loads, one_pose, states};

type LimitRow = (String, &'static str, Vec<usize>, &'static str, f64, f64, f64);
type JointRow = (String, &'static str, [String; 2]);
type AllModes<'py> = (Bound<'py, PyDict>, Vec<usize>, Bound<'py, PyArray1<u8>>);

type CoordinateSet = (&'static str, Vec<&'static str>, Option<Vec<bool>>);

/// Vector, axis, pitch, point.
type ScrewRow = ([f64; 6], [f64; 3], f64, [f64; 3]);

fn screw_row(vector: [f64; 6], screw: &Screw) -> ScrewRow {
    (vector, screw.axis.array(), screw.pitch, screw.point.array())
}

#[pyclass(name = "Mechanism", frozen)]
pub struct PyMechanism(Mechanism, OnceLock<Option<Start>>);

impl PyMechanism {
    /// An operation on a motion under load.
    pub fn loaded<'py>(
        &self,
        py: Python<'py>,
        [poses, twists, accelerations]: [&Array<'py>; 3],
        wrenches: Option<&Array<'py>>,
        platform_axes: bool,
        operation: fn(&Mechanism, &States, &Loads) -> Table,
    ) -> PyResult<Bound<'py, PyDict>> {
        let states = states(poses, twists, accelerations)?;
        let loads = loads(wrenches, platform_axes, states.poses)?;
        let table = py.detach(|| operation(&self.0, &states, &loads));
        arrays(py, table, &batch_of(poses, 2))
    }

    pub fn core(&self) -> &Mechanism {
        &self.0
    }

    /// One length for each leg in every row.
    fn lengths<'a>(&self, array: &'a Array<'_>) -> PyResult<&'a [f64]> {
        let lengths = slice(array)?;
        if lengths.len().is_multiple_of(self.0.legs.len()) {
            Ok(lengths)
        } else {
            Err(PyValueError::new_err("lengths do not have one value for each leg"))
        }
    }

    /// A set, which of its numbers are given, and their names: those asked for, or as many as will do.
    pub fn searched(
        &self,
        set: &str,
        names: Option<&[String]>,
    ) -> PyResult<(Set, Vec<bool>, Vec<&'static str>)> {
        let set = self.set(set)?;
        let given = batch::searched_coordinates(&self.0, &set, names);
        let names = set.names().iter().zip(&given).filter(|(_, g)| **g).map(|(name, _)| *name).collect();
        Ok((set, given, names))
    }

    pub fn set(&self, name: &str) -> PyResult<Set> {
        let sets = Set::of(&self.0);
        sets.into_iter().find(|s| s.name() == name).ok_or_else(|| PyKeyError::new_err(name.to_owned()))
    }
}

#[pymethods]
impl PyMechanism {
    #[new]
    fn new(spec: &str) -> PyResult<Self> {
        assemble(&Spec::from_json(spec).map_err(raise)?)
            .map(|mech| PyMechanism(mech, OnceLock::new()))
            .map_err(raise)
    }

    #[getter]
    fn dof(&self) -> usize {
        self.0.dof()
    }

    /// Of the Jacobian.
    #[getter]
    fn rows(&self) -> usize {
        self.0.rows()
    }

    #[getter]
    fn characteristic_length(&self) -> f64 {
        self.0.characteristic_length
    }

    #[getter]
    fn home<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(PyArray1::from_slice(py, &self.0.home.matrix()).reshape([4, 4])?.into_any())
    }

    /// Letters of each leg's joints from base to platform.
    #[getter]
    fn leg_letters(&self) -> Vec<String> {
        self.0.legs.iter().map(polypod_core::model::mechanism::Leg::letters).collect()
    }

    /// What is said of legs with U joints at both ends, if there are any.
    fn about_universal_legs(&self) -> Option<String> {
        polypod_core::assembly::universal_legs::about(&self.0)
    }

    /// Name, all numbers, and whether each must be given (none for a set where any will do).
    fn coordinate_sets(&self) -> Vec<CoordinateSet> {
        Set::of(&self.0).iter().map(|s| (s.name(), s.names().to_vec(), s.given(&self.0))).collect()
    }

    /// The mobility analysis as JSON.
    fn mobility(&self) -> PyResult<String> {
        serde_json::to_string(&self.0.mobility).map_err(|e| PyValueError::new_err(e.to_string()))
    }

    /// For a batch with these axes.
    #[pyo3(signature = (set, given, batch, branch, guess, continued))]
    #[allow(clippy::too_many_arguments)]
    fn states<'py>(
        &self,
        py: Python<'py>,
        set: &str,
        given: Vec<Option<[Array<'py>; 3]>>,
        batch: Vec<usize>,
        branch: f64,
        guess: Option<Array<'py>>,
        continued: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (set, count) = (self.set(set)?, batch.iter().product());
        if given.len() != set.names().len() {
            return Err(PyValueError::new_err("needs one entry for each number of the set"));
        }
        let mut series = Vec::with_capacity(given.len());
        for entry in &given {
            series.push(match entry {
                None => None,
                Some([x, d, dd]) => {
                    let parts = [slice(x)?, slice(d)?, slice(dd)?];
                    if parts.iter().any(|p| p.len() != count) {
                        return Err(PyValueError::new_err(
                            "coordinates do not have one value for each state",
                        ));
                    }
                    Some(parts)
                }
            });
        }
        let guess = guesses(guess.as_ref(), count)?;
        let input = Coordinates { set, given: series, branch, guess, continued };
        let table = py.detach(|| batch::states(&self.0, &input, count));
        arrays(py, table, &batch)
    }

    fn coordinates<'py>(
        &self,
        py: Python<'py>,
        set: &str,
        poses: Array<'py>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let batch = batch_of(&poses, 2);
        let (set, poses) = (self.set(set)?, slice(&poses)?);
        let table = py.detach(|| batch::coordinate_values(&self.0, &set, poses));
        arrays(py, table, &batch)
    }

    fn inverse_kinematics<'py>(&self, py: Python<'py>, poses: Array<'py>) -> PyResult<Bound<'py, PyDict>> {
        let batch = batch_of(&poses, 2);
        let poses = slice(&poses)?;
        let table = py.detach(|| batch::inverse_kinematics(&self.0, poses));
        arrays(py, table, &batch)
    }

    fn jacobian<'py>(&self, py: Python<'py>, poses: Array<'py>) -> PyResult<Bound<'py, PyDict>> {
        let batch = batch_of(&poses, 2);
        let poses = slice(&poses)?;
        let table = py.detach(|| batch::jacobians(&self.0, poses));
        arrays(py, table, &batch)
    }

    fn hessian<'py>(&self, py: Python<'py>, poses: Array<'py>) -> PyResult<Bound<'py, PyDict>> {
        let batch = batch_of(&poses, 2);
        let poses = slice(&poses)?;
        let table = py.detach(|| batch::hessians(&self.0, poses));
        arrays(py, table, &batch)
    }

    fn conditioning<'py>(
        &self,
        py: Python<'py>,
        poses: Array<'py>,
        length: f64,
    ) -> PyResult<Bound<'py, PyDict>> {
        let batch = batch_of(&poses, 2);
        let poses = slice(&poses)?;
        let table = py.detach(|| batch::conditioning(&self.0, poses, length));
        arrays(py, table, &batch)
    }

    fn determinant<'py>(
        &self,
        py: Python<'py>,
        poses: Array<'py>,
        twists: Array<'py>,
        length: f64,
    ) -> PyResult<Bound<'py, PyDict>> {
        let batch = batch_of(&poses, 2);
        let (poses, twists) = (slice(&poses)?, slice(&twists)?);
        expect(twists, 6, poses)?;
        let table = py.detach(|| batch::determinants(&self.0, poses, twists, length));
        arrays(py, table, &batch)
    }

    fn singularity<'py>(
        &self,
        py: Python<'py>,
        poses: Array<'py>,
        length: f64,
        tolerance: f64,
    ) -> PyResult<Bound<'py, PyDict>> {
        let batch = batch_of(&poses, 2);
        let poses = slice(&poses)?;
        let table = py.detach(|| batch::singularities(&self.0, poses, length, tolerance));
        arrays(py, table, &batch)
    }

    /// Vector (a twist at o), axis, pitch and point of each principal screw of the degrees of freedom at one
    /// pose; none where a leg has no direction.
    fn freedom_screws(&self, poses: Array<'_>) -> PyResult<Option<Vec<ScrewRow>>> {
        let pose = one_pose(&poses)?;
        let found = screw_systems::freedoms(&self.0, &pose);
        Ok(found.map(|all| all.iter().map(|(twist, screw)| screw_row(twist.array(), screw)).collect()))
    }

    /// Vector (a wrench at o), axis, pitch and point of every constraint at one pose.
    fn constraint_screws(&self, poses: Array<'_>) -> PyResult<Vec<ScrewRow>> {
        let pose = one_pose(&poses)?;
        let found = screw_systems::constraints(&self.0, &pose);
        Ok(found.iter().map(|(wrench, screw)| screw_row(wrench.array(), screw)).collect())
    }

    /// Names of the coordinates that are searched, and their arrays.
    #[pyo3(signature = (poses, set, names, length, reach))]
    fn nearest_singular<'py>(
        &self,
        py: Python<'py>,
        poses: Array<'py>,
        set: &str,
        names: Option<Vec<String>>,
        length: f64,
        reach: f64,
    ) -> PyResult<(Vec<&'static str>, Bound<'py, PyDict>)> {
        let batch = batch_of(&poses, 2);
        let poses = slice(&poses)?;
        let (set, given, searched) = self.searched(set, names.as_deref())?;
        let search = SingularitySearch { set, given, reach, scale: length };
        let table = py.detach(|| batch::nearest_singular(&self.0, poses, &search));
        Ok((searched, arrays(py, table, &batch)?))
    }

    fn kinematics<'py>(
        &self,
        py: Python<'py>,
        poses: Array<'py>,
        twists: Array<'py>,
        accelerations: Array<'py>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let batch = batch_of(&poses, 2);
        let states = states(&poses, &twists, &accelerations)?;
        let table = py.detach(|| batch::kinematics(&self.0, &states));
        arrays(py, table, &batch)
    }

    /// With the forces of all legs that are preferred where they are not determined.
    #[pyo3(signature = (poses, twists, accelerations, wrenches, platform_axes, preferred=None))]
    #[allow(clippy::too_many_arguments)]
    fn inverse_dynamics<'py>(
        &self,
        py: Python<'py>,
        poses: Array<'py>,
        twists: Array<'py>,
        accelerations: Array<'py>,
        wrenches: Option<Array<'py>>,
        platform_axes: bool,
        preferred: Option<Array<'py>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let states = states(&poses, &twists, &accelerations)?;
        let loads = loads(wrenches.as_ref(), platform_axes, states.poses)?;
        let preferred = preferred.as_ref().map(slice).transpose()?;
        if let Some(preferred) = preferred {
            expect(preferred, self.0.legs.len(), states.poses)?;
        }
        let table = py.detach(|| batch::inverse_dynamics(&self.0, &states, &loads, preferred));
        arrays(py, table, &batch_of(&poses, 2))
    }

    #[pyo3(signature = (poses, twists, forces, wrenches, platform_axes))]
    fn forward_dynamics<'py>(
        &self,
        py: Python<'py>,
        poses: Array<'py>,
        twists: Array<'py>,
        forces: Array<'py>,
        wrenches: Option<Array<'py>>,
        platform_axes: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let batch = batch_of(&poses, 2);
        let (poses, twists, forces) = (slice(&poses)?, slice(&twists)?, slice(&forces)?);
        expect(twists, 6, poses)?;
        expect(forces, self.0.legs.len(), poses)?;
        let loads = loads(wrenches.as_ref(), platform_axes, poses)?;
        let table = py.detach(|| batch::forward_dynamics(&self.0, poses, twists, forces, &loads));
        arrays(py, table, &batch)
    }

    /// In platform space, or in coordinates of a set: their names, those of the set that are given, and the
    /// arrays.
    #[pyo3(signature = (poses, twists, set, names))]
    fn equations_of_motion<'py>(
        &self,
        py: Python<'py>,
        poses: Array<'py>,
        twists: Array<'py>,
        set: Option<&str>,
        names: Option<Vec<String>>,
    ) -> PyResult<(Vec<&'static str>, Bound<'py, PyDict>)> {
        let batch = batch_of(&poses, 2);
        let (poses, twists) = (slice(&poses)?, slice(&twists)?);
        expect(twists, 6, poses)?;
        let (space, names) = match set {
            None => (Space::Platform, vec![]),
            Some(set) => {
                let (set, given, names) = self.searched(set, names.as_deref())?;
                (Space::Coordinates(Box::new(set), given), names)
            }
        };
        let table = py.detach(|| batch::equations_of_motion(&self.0, poses, twists, &space));
        Ok((names, arrays(py, table, &batch)?))
    }

    #[pyo3(signature = (poses, twists, accelerations, wrenches, platform_axes))]
    fn power<'py>(
        &self,
        py: Python<'py>,
        poses: Array<'py>,
        twists: Array<'py>,
        accelerations: Array<'py>,
        wrenches: Option<Array<'py>>,
        platform_axes: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let motion = [&poses, &twists, &accelerations];
        self.loaded(py, motion, wrenches.as_ref(), platform_axes, batch::power)
    }

    #[pyo3(signature = (poses, twists, accelerations, wrenches, platform_axes))]
    fn limits<'py>(
        &self,
        py: Python<'py>,
        poses: Array<'py>,
        twists: Array<'py>,
        accelerations: Array<'py>,
        wrenches: Option<Array<'py>>,
        platform_axes: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let batch = batch_of(&poses, 2);
        let states = states(&poses, &twists, &accelerations)?;
        let loads = loads(wrenches.as_ref(), platform_axes, states.poses)?;
        let table = py.detach(|| batch::limits(&self.0, &states, &loads));
        arrays_but(py, table, &batch, ["within"], ["binding"])
    }

    #[pyo3(signature = (poses, twists, accelerations, wrenches, platform_axes, length))]
    #[allow(clippy::too_many_arguments)]
    fn joint_reactions<'py>(
        &self,
        py: Python<'py>,
        poses: Array<'py>,
        twists: Array<'py>,
        accelerations: Array<'py>,
        wrenches: Option<Array<'py>>,
        platform_axes: bool,
        length: f64,
    ) -> PyResult<Bound<'py, PyDict>> {
        let batch = batch_of(&poses, 2);
        let states = states(&poses, &twists, &accelerations)?;
        let loads = loads(wrenches.as_ref(), platform_axes, states.poses)?;
        let table = py.detach(|| batch::joint_reactions(&self.0, &states, &loads, length));
        arrays_but(py, table, &batch, ["determinate", "determinate_in_joint"], [])
    }

    /// Name, kind and links (towards the base, away from it) of each joint.
    fn joint_list(&self) -> Vec<JointRow> {
        joint_reactions::joints(&self.0).into_iter().map(|j| (j.name, j.kind, j.links)).collect()
    }

    /// Name, kind, legs (from 0), unit, least and greatest value (infinite where there is none) and scale of
    /// each limit.
    fn limit_list(&self) -> Vec<LimitRow> {
        let mech = &self.0;
        let row = |l: &Limit| {
            let (least, most) = l.bound.ends();
            (l.name.clone(), l.kind(), l.legs(mech), l.unit(mech), least, most, l.scale)
        };
        mech.limits.iter().map(row).collect()
    }

    fn platform_twist<'py>(
        &self,
        py: Python<'py>,
        poses: Array<'py>,
        rates: Array<'py>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let batch = batch_of(&poses, 2);
        let (poses, rates) = (slice(&poses)?, slice(&rates)?);
        expect(rates, self.0.legs.len(), poses)?;
        let table = py.detach(|| batch::platform_twist(&self.0, poses, rates));
        arrays(py, table, &batch)
    }

    fn platform_acceleration<'py>(
        &self,
        py: Python<'py>,
        poses: Array<'py>,
        twists: Array<'py>,
        accelerations: Array<'py>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let batch = batch_of(&poses, 2);
        let (poses, twists, accelerations) = (slice(&poses)?, slice(&twists)?, slice(&accelerations)?);
        expect(twists, 6, poses)?;
        expect(accelerations, self.0.legs.len(), poses)?;
        let table = py.detach(|| batch::platform_acceleration(&self.0, poses, twists, accelerations));
        arrays(py, table, &batch)
    }

    #[pyo3(signature = (lengths, guess, continued))]
    fn forward_kinematics<'py>(
        &self,
        py: Python<'py>,
        lengths: Array<'py>,
        guess: Option<Array<'py>>,
        continued: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let batch = batch_of(&lengths, 1);
        let lengths = self.lengths(&lengths)?;
        let guess = guesses(guess.as_ref(), lengths.len() / self.0.legs.len())?;
        let table = py.detach(|| batch::forward_kinematics(&self.0, lengths, guess, continued));
        arrays(py, table, &batch)
    }

    /// All modes one after the other, how many belong to each set of lengths, and the status of each set;
    /// none where legs and constraints are not six equations.
    fn assembly_modes<'py>(&self, py: Python<'py>, lengths: Array<'py>) -> PyResult<Option<AllModes<'py>>> {
        let lengths = self.lengths(&lengths)?;
        let found = py.detach(|| {
            let start = self.1.get_or_init(|| assembly_modes::start(&self.0)).as_ref();
            start.map(|start| batch::assembly_modes(&self.0, start, lengths))
        });
        let Some(batch::AllModes { modes, counts, status }) = found else { return Ok(None) };
        let status = PyArray1::from_vec(py, status.iter().map(|&s| s as u8).collect());
        let batch = [modes.status.len()];
        Ok(Some((arrays(py, modes, &batch)?, counts, status)))
    }

    /// The number of complex solutions for generic lengths; none where legs and constraints are not six
    /// equations.
    fn complex_modes(&self, py: Python<'_>) -> Option<usize> {
        py.detach(|| self.1.get_or_init(|| assembly_modes::start(&self.0)).as_ref().map(Start::solutions))
    }

    /// The two legs and their arrays, or none for a mechanism without a coupled pair.
    fn coupled_forces<'py>(
        &self,
        py: Python<'py>,
        poses: Array<'py>,
        multipliers: Array<'py>,
        as_printed: bool,
    ) -> PyResult<Option<([usize; 2], Bound<'py, PyDict>)>> {
        let batch = batch_of(&poses, 2);
        let (poses, multipliers) = (slice(&poses)?, slice(&multipliers)?);
        expect(multipliers, 6 - self.0.dof(), poses)?;
        let result = py.detach(|| batch::coupled_forces(&self.0, poses, multipliers, as_printed));
        result.map(|(pair, table)| Ok((pair, arrays(py, table, &batch)?))).transpose()
    }
}
