//! The equations of parallel manipulators on telescopic legs, generic over the number.
//!
//! Rooms from the ground up: each imports only from those above it in the list below, which
//! `tools/imports.py` checks.
//!
//! Labels in brackets name their source: `[Eq. 26]` an equation of Lu, Liu, Zhang, Ye and Wang, "Dynamics
//! analysis of a novel 5-DoF parallel manipulator with couple-constrained wrench"; `[T6]` one of
//! `docs/theory.md`.

#![cfg_attr(test, allow(dead_code))]

pub mod number;

pub mod spatial;

pub mod numerics;

pub mod parallel;

pub mod model;

pub mod kinematics;

pub mod mobility;

pub mod limits;

pub mod assembly;

pub mod dynamics;

pub mod forward_kinematics;

pub mod workspace;

/// Left out of unit tests, as only it needs some of what is here: nothing takes as long to compile.
#[cfg(not(test))]
pub mod batch;

// The tests of the modules use the mechanisms of the other tests.
#[cfg(test)]
#[path = "../tests/common/mod.rs"]
mod common;
#[cfg(test)]
extern crate self as polypod_core;
