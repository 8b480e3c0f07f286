"""The nearest singular poses along each coordinate, against an independent determinant."""

from __future__ import annotations

import numpy as np
import pytest

import polypod as pp
from polypod import Status
from support import oracle as o
from support.singular import GOUGH, LU, NATURAL, QUARTER, RPS, Kind, independent_jacobian, matrix


def assert_first_zeros(mech: pp.Mechanism, name: str, pose: np.ndarray, found) -> int:
    """Each value is a zero of the independent determinant, none is on the way; the number of zeros."""
    values, count = dict(zip(found.coordinates, found.value, strict=True)), 0
    for k, coordinate in enumerate(found.coordinates):
        for side in range(2):
            end, searched = found.singular[k, side], found.searched[k, side]
            stop = end if np.isfinite(end) else searched
            path = np.linspace(values[coordinate], stop, 400)
            poses = np.empty((400, 4, 4))
            guess = pose
            for i, value in enumerate(path):
                guess = poses[i] = mech.pose(values | {coordinate: value}, guess=guess)
            known = np.isfinite(poses).all(axis=(1, 2))
            assert known[:-1].all()
            at = poses[known][:, :3, :3], poses[known][:, :3, 3]
            det = np.linalg.det(independent_jacobian(name, at, mech.characteristic_length))
            assert len({*np.sign(det[:-1])}) == 1, coordinate
            if np.isfinite(end):
                count += 1
                assert abs(det[-1]) < 1e-9 * abs(det[0])
                assert found.kind[k, side] != Kind.NONE
                assert found.distance[k, side] == abs(end - values[coordinate])
            else:
                assert (found.kind[k, side], end) == (Kind.NONE, [-np.inf, np.inf][side])
    return count


def test_distance_of_a_hexapod_is_the_quarter_turn():
    found = GOUGH.singularity_distance(GOUGH.home)
    assert found.coordinates == ("x", "y", "z", "rx", "ry", "rz")
    assert found.singular[5] == pytest.approx([-np.pi / 2, np.pi / 2], abs=1e-12)
    assert found.kind[5].tolist() == [Kind.ACTUATION] * 2
    assert assert_first_zeros(GOUGH, "stewart-gough", GOUGH.home, found) >= 6
    # A full turn for angles; lengths as far as asked.
    assert GOUGH.singularity_distance(GOUGH.home, reach=0.25).searched[0].tolist() == [-0.25, 0.25]
    at = GOUGH.singularity_distance(GOUGH.pose(QUARTER))
    assert at.distance.tolist() == np.zeros((6, 2)).tolist()


def test_distance_in_natural_coordinates():
    pose = LU.pose(NATURAL)
    found = LU.singularity_distance(pose)
    assert found.coordinates == ("alpha", "p", "h", "beta", "gamma")
    assert assert_first_zeros(LU, "lu", pose, found) >= 5


def test_distance_with_dependent_coordinates():
    pose = RPS.pose({"z": 0.45, "rx": 0.1, "ry": -0.2})
    found = RPS.singularity_distance(pose)
    assert found.coordinates == ("z", "rx", "ry")
    assert assert_first_zeros(RPS, "3-rps", pose, found) >= 2
    named = RPS.singularity_distance(pose, coordinates=["rx", "ry", "z"])
    assert np.array_equal(named.singular, found.singular)


@pytest.mark.parametrize("turned", [0.3, 0.05])
def test_distance_to_a_constraint_singularity(turned):
    """Where the constraints are lost the dependent coordinates are, too; the kind is told all the same."""
    angle = np.pi - turned
    pose = matrix((o.turn([0.0, angle, 0.0]), np.array([-0.075 * (1 - np.cos(angle)), 0.0, 0.4])))
    found = RPS.singularity_distance(pose, coordinates=["z", "rx", "ry"])
    assert found.value[2] == pytest.approx(turned)
    assert found.singular[2, 0] == pytest.approx(0.0, abs=1e-6)
    assert found.kind[2, 0] == Kind.CONSTRAINT


def test_distance_of_a_batch_and_without_answer():
    poses = np.stack([LU.pose(NATURAL), np.full((4, 4), np.nan)])
    found = LU.singularity_distance(poses)
    assert found.status.tolist() == [Status.OK, Status.INVALID_INPUT]
    assert found.singular.shape == (2, 5, 2)
    assert np.array_equal(found.singular[0], LU.singularity_distance(poses[0]).singular)
    assert np.isnan(found.singular[1]).all()
    assert (found.kind[1] == Kind.UNKNOWN).all()
    # At the fold the paper's coordinates do not tell the pose's neighbours.
    assert LU.singularity_distance(LU.home, "paper").status == Status.FOLD
