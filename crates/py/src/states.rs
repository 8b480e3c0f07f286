//! Arguments that stand for states of the platform and loads on it.

use polypod_core::batch::{self, Loads, States};
use polypod_core::model::spec::Axes;
use polypod_core::spatial::Pose;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{Array, slice};

/// `len(poses) / 16` states; every other array must fit them.
pub fn expect(array: &[f64], width: usize, poses: &[f64]) -> PyResult<()> {
    if !poses.len().is_multiple_of(16) || array.len() != poses.len() / 16 * width {
        return Err(PyValueError::new_err("arrays do not have one row for each pose"));
    }
    Ok(())
}

pub fn one_pose(poses: &Array<'_>) -> PyResult<Pose<f64>> {
    let matrix = slice(poses)?;
    if matrix.len() == 16 { Ok(batch::pose_of(matrix)) } else { Err(PyValueError::new_err("not one pose")) }
}

/// No guess, one for all states, or one for each.
pub fn guesses<'a>(poses: Option<&'a Array<'_>>, states: usize) -> PyResult<Option<&'a [f64]>> {
    let poses = poses.map(slice).transpose()?;
    if poses.is_some_and(|p| p.len() != 16 && p.len() != 16 * states) {
        return Err(PyValueError::new_err("needs one guess, or one for each state"));
    }
    Ok(poses)
}

/// Without twists and accelerations all is at rest.
pub fn states<'a>(
    poses: &'a Array<'_>,
    twists: &'a Array<'_>,
    accelerations: &'a Array<'_>,
) -> PyResult<States<'a>> {
    let (poses, twists, accelerations) = (slice(poses)?, slice(twists)?, slice(accelerations)?);
    for rates in [twists, accelerations] {
        expect(rates, if rates.is_empty() { 0 } else { 6 }, poses)?;
    }
    Ok(States { poses, twists, accelerations })
}

pub fn loads<'a>(wrench: Option<&'a Array<'_>>, platform_axes: bool, poses: &[f64]) -> PyResult<Loads<'a>> {
    Ok(match wrench {
        None => Loads::Own,
        Some(array) => {
            let values = slice(array)?;
            expect(values, 6, poses)?;
            Loads::Given(values, if platform_axes { Axes::Platform } else { Axes::Base })
        }
    })
}
