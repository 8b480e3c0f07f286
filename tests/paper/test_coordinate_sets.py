"""Coordinates of the paper's mechanism against the oracle: natural, Eq. 5, tool and pose."""

from __future__ import annotations

import math

import numpy as np
import pytest

import polypod as pp
from support import oracle as o
from support.cases import (
    EXACT,
    LU,
    SEED,
    agree,
    as_dict,
    case,
    lu,
    lu_coordinates,
    lu_pose,
    lu_state,
    motion_coordinates,
    pair,
    per_pose,
)


def test_natural_coordinates():
    state = lu_state()
    assert np.all(np.isin(state.status, (pp.Status.OK, pp.Status.OUT_OF_STROKE)))
    agree(state.pose, lu().T, EXACT * 10)
    agree(state.twist, lu().twist)
    agree(state.acceleration, lu().acceleration)


def test_natural_coordinates_of_a_pose():
    found = lu().mech.coordinates(lu().T, "natural")
    agree(np.stack([found[k] for k in LU], axis=1), lu_coordinates(), 1e-12)


PAPER = ("x", "y", "z", "alpha", "beta")


def lu_paper_jets():
    """The paper's five coordinates of the sample off the fold, with rates; their branch; and γ."""
    q = lu_coordinates()
    q = q[np.abs(q[:, 4]) > 1e-2]
    center = lu_pose(q)[1]
    rng = np.random.default_rng(SEED + 4)
    values = np.column_stack([center, q[:, 0], q[:, 3]])
    rates = rng.normal(size=(2, *values.shape)) * ([0.1] * 3 + [0.5] * 2)
    jets = [o.Jet(x, d, dd) for x, d, dd in zip(values.T, rates[0].T, rates[1].T, strict=True)]
    return jets, np.sign(q[:, 4]), q[:, 4]


@pytest.mark.parametrize("branch", [1, -1])
def test_eq5_paper_coordinates(branch):
    """γ of Eq. 5 and its rates, and the pose, twist and acceleration that follow, on both branches."""
    jets, sign, gamma = lu_paper_jets()
    keep = sign == branch
    jets = [o.Jet(j.x[keep], j.d[keep], j.dd[keep]) for j in jets]
    state = lu().mech.state(*(as_dict(PAPER, jets, w) for w in ("x", "d", "dd")), branch=branch)
    near_fold = 1e-10 / np.abs(gamma[keep])
    agree(state.coordinates["gamma"], gamma[keep], near_fold)
    expected = branch * o.arccos(o.eq5(jets[1], jets[2], jets[3]))
    agree(state.coordinate_rates["gamma"], expected.d, near_fold)
    agree(state.coordinate_second_rates["gamma"], expected.dd, near_fold)
    pose = o.paper_pose(*jets, branch=branch)
    twist, acceleration = o.twist_of(pose)
    agree(state.pose[:, :3, :3], pose[0].x, 1e-12)
    agree(state.pose[:, :3, 3], pose[1].x, EXACT)
    agree(state.twist, twist, per_pose(near_fold))
    agree(state.acceleration, acceleration, per_pose(near_fold))


def test_eq5_has_no_pose_beyond_the_fold():
    """On both sides of |cos γ| = 1, and on it."""
    z, alpha = 0.74, 0.05
    span = o.E_SMALL * o.S18
    fold = (o.E1 * o.S18 * math.cos(alpha) - z * math.sin(alpha) - span) / math.cos(alpha)
    y = fold + np.array([-1e-3, -1e-9, 1e-9, 1e-3])
    ones = np.ones(4)
    q = dict(zip(PAPER, (0 * ones, y, z * ones, alpha * ones, 0.1 * ones), strict=True))
    state = lu().mech.state(q)
    assert list(state.status[:1]) == [pp.Status.NO_BRANCH]
    assert state.status[3] in (pp.Status.OK, pp.Status.OUT_OF_STROKE)
    assert np.all(np.isnan(state.pose[0]))
    assert state.status[1] == pp.Status.NO_BRANCH
    assert np.cos(state.coordinates["gamma"][3]) == pytest.approx(float(o.eq5(y[3], z, alpha).x), abs=1e-13)


def test_tool_coordinates():
    """The tip stands and the axis points where they were told to, and the joints close."""
    c = lu()
    rng = np.random.default_rng(SEED + 5)
    names = c.mech.coordinate_sets["tool"]
    direction = np.array([0, 0, 1.0]) + rng.uniform(-0.4, 0.4, (12, 3))
    tip = np.array([0, 0.037, 0.74]) + rng.uniform(-0.04, 0.04, (12, 3))
    state = c.mech.state(dict(zip(names, np.hstack([tip, 3 * direction]).T, strict=True)))
    good = np.isin(state.status, (pp.Status.OK, pp.Status.OUT_OF_STROKE))
    assert np.sum(good) >= 6
    pose = pair(state.pose[good])
    agree(pose[1], tip[good], EXACT)
    agree(
        pose[0][:, :, 2], direction[good] / np.linalg.norm(direction[good], axis=1, keepdims=True), EXACT * 10
    )
    assert np.max(np.abs(o.residuals(c.spec, pose).x)) < 1e-12


def test_pose_coordinates():
    """R = Rx Ry Rz."""
    c = case("stewart-gough")
    q = motion_coordinates("stewart-gough")[0]
    T = c.mech.pose(q)
    R = o.axis_turn(0, q["rx"]).x @ o.axis_turn(1, q["ry"]).x @ o.axis_turn(2, q["rz"]).x
    agree(T[:, :3, :3], R, EXACT)
    agree(T[:, :3, 3], np.column_stack([q[k] for k in "xyz"]), EXACT)
    back = c.mech.coordinates(T, "pose")
    for k, value in q.items():
        agree(back[k], value, EXACT * 10)
