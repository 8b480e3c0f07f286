//! Arrays in, arrays out: the bindings of `polypod-core`. No mathematics here; shapes and names are the
//! caller's.

// Arguments arrive from Python by value.
#![allow(clippy::needless_pass_by_value)]

mod arrays;
mod derivatives;
mod faults;
mod mechanism;
mod simulation;
mod states;
mod workspace;
mod zeros;

use polypod_core::mobility::singularity::Kind;
use polypod_core::model::status::Status;
use polypod_core::number::lanes;
use polypod_core::parallel::threads;
use pyo3::prelude::*;

/// Keeps memory for the next results: the system's allocator gives that of large arrays back, and fetching it
/// page by page costs more than filling it.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Code, name and message of every kind of singularity.
#[pyfunction]
fn singularity_kinds() -> Vec<(u8, String, &'static str)> {
    Kind::ALL.iter().map(|&k| (k as u8, format!("{k:?}"), k.message())).collect()
}

/// Code and message of every status.
#[pyfunction]
fn statuses() -> Vec<(u8, String, &'static str)> {
    Status::ALL.iter().map(|&s| (s as u8, format!("{s:?}"), s.message())).collect()
}

/// Threads of batches; 0 for one on each core.
#[pyfunction]
fn set_threads(count: usize) {
    threads::set(count);
}

/// Names of the instruction sets that batches can use here, the narrowest first.
#[pyfunction]
fn instruction_sets() -> Vec<&'static str> {
    lanes::instruction_sets()
}

/// Whether this processor has the set; batches then use no wider registers than its.
#[pyfunction]
fn use_instructions(name: &str) -> bool {
    lanes::use_instructions(name)
}

#[pymodule]
fn _core(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add("__version__", env!("CARGO_PKG_VERSION"))?;
    m.add("SINGULAR", polypod_core::kinematics::singular::SINGULAR)?;
    m.add("Faults", m.py().get_type::<faults::Faults>())?;
    m.add_class::<arrays::PyAxes>()?;
    m.add_class::<mechanism::PyMechanism>()?;
    m.add_function(wrap_pyfunction!(derivatives::inverse_dynamics_derivatives, m)?)?;
    m.add_function(wrap_pyfunction!(derivatives::regressor, m)?)?;
    m.add_function(wrap_pyfunction!(derivatives::inertial_parameters, m)?)?;
    m.add_function(wrap_pyfunction!(derivatives::geometry_parameters, m)?)?;
    m.add_function(wrap_pyfunction!(derivatives::base_parameters, m)?)?;
    m.add_function(wrap_pyfunction!(workspace::fit_poses, m)?)?;
    m.add_function(wrap_pyfunction!(workspace::lead_poses, m)?)?;
    m.add_function(wrap_pyfunction!(workspace::pose_bounds, m)?)?;
    m.add_class::<simulation::PyChart>()?;
    m.add_class::<workspace::PyFlood>()?;
    m.add_class::<workspace::PyLattice>()?;
    m.add_function(wrap_pyfunction!(set_threads, m)?)?;
    m.add_function(wrap_pyfunction!(instruction_sets, m)?)?;
    m.add_function(wrap_pyfunction!(use_instructions, m)?)?;
    m.add_function(wrap_pyfunction!(zeros::zeros, m)?)?;
    m.add_function(wrap_pyfunction!(zeros::unsettled_zeros, m)?)?;
    m.add_function(wrap_pyfunction!(singularity_kinds, m)?)?;
    m.add_function(wrap_pyfunction!(statuses, m)?)
}
