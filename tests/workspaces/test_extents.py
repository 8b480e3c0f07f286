"""How far workspaces reach: ends against an independent optimiser and closed forms, errors, default grids."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy import ndimage
from scipy.optimize import linprog, minimize
from scipy.spatial.transform import Rotation

import polypod as pp
from polypod.workspaces.causes import EDGE_OF_GRID, SINGULARITY
from polypod.workspaces.pose_search import left_jacobian
from polypod.workspaces.reachable import extremes_within
from support import DATA
from support.oracle.paper import S18 as SIN_18

NAME = "lu-3spu-2rpu-r"


def strokes(mech: pp.Mechanism, half: float) -> pp.Mechanism:
    """The mechanism with a stroke of ± half, m, about its lengths at home."""
    data = mech.to_dict()
    unit = {"mm": 1e-3, "m": 1.0}[data["units"]["length"]]
    for leg, length in zip(data["legs"], mech.inverse_kinematics(mech.home).lengths, strict=True):
        leg["stroke"] = {"min": (length - half) / unit, "max": (length + half) / unit}
    return pp.Mechanism.from_dict(data)


@pytest.fixture(scope="module")
def lu():
    return pp.load(NAME)


@pytest.fixture(scope="module")
def hexapod():
    return pp.load("ups-hexapod")


# --- against an independent optimiser -----------------------------------------------------------------------


def free(mech):
    """Six coordinates: o, and a rotation vector from home."""
    home = mech.home[:3, :3]

    def pose(x):
        return x[:3], Rotation.from_rotvec(x[3:]).as_matrix() @ home

    def start(rng):
        away = 0.4 * np.ptp(mech.stroke) * rng.normal(size=3)
        return np.concatenate([mech.home[:3, 3] + away, 0.7 * rng.normal(size=3)])

    return pose, start


def of_tricept(mech):
    """Two rotations of the passive leg's universal joint, and its length; the platform is one with it."""

    def pose(x):
        rotation = Rotation.from_euler("XY", np.clip(x[:2], -1.5, 1.5)).as_matrix()
        return rotation[:, 2] * x[2], rotation

    return pose, lambda rng: np.array([*rng.normal(0.0, 0.4, 2), 0.9])


def of_lu(mech):
    """Natural coordinates α, p, h, β, γ of the paper's manipulator [T20]."""

    def pose(x):
        alpha, p, h, beta, gamma = x
        first = Rotation.from_euler("X", alpha)
        rotation = (first * Rotation.from_euler("YX", [beta, gamma])).as_matrix()
        middle = np.array([p, 0.27 * SIN_18, 0.0]) + h * first.as_matrix()[:, 2]
        return middle - rotation[:, 1] * 0.15 * SIN_18, rotation

    return (
        pose,
        lambda rng: np.array([0.0, 0.0, 0.65, 0.0, 0.0]) + rng.normal(size=5) * [0.4, 0.2, 0.05, 0.4, 0.4],
    )


SIX = {
    "tsai-6-sps": free,
    "tricept": of_tricept,
    NAME: of_lu,
    "ups-hexapod": free,
    "linuxcnc-6-3": free,
    str(DATA / "stewart-gough.toml"): free,
}


def distances(mech: pp.Mechanism, poses: np.ndarray) -> np.ndarray:
    """(..., n): those of the legs' points on base and platform."""
    legs = mech.geometry["legs"]
    base, platform = (np.array([leg[side]["point"] for leg in legs]) for side in ("base", "platform"))
    return np.linalg.norm(
        poses[..., None, :3, 3] + platform @ poses[..., :3, :3].swapaxes(-1, -2) - base, axis=-1
    )


def independent_end(mech, coordinates, axis: int, sense: int, box, starts: int) -> float:
    """An end of o by COBYLA, without derivatives, from random starts, over distances of points in numpy."""
    pose, start = coordinates
    bounded = np.isfinite(mech.stroke).all(axis=1)
    legs = [leg for leg, has in zip(mech.geometry["legs"], bounded, strict=True) if has]
    base, platform = (np.array([leg[side]["point"] for leg in legs]) for side in ("base", "platform"))
    least, greatest = mech.stroke[bounded].T

    def inside(x):
        o, rotation = pose(x)
        length = np.linalg.norm(o + platform @ rotation.T - base, axis=1)
        return np.concatenate([length - least, greatest - length, o - box[:, 0], box[:, 1] - o])

    rng = np.random.default_rng(axis)
    best = -np.inf
    for _ in range(starts):
        begin = next(x for _ in range(10_000) if inside(x := start(rng)).min() > 0.0)
        found = minimize(
            lambda x: -sense * pose(x)[0][axis],
            begin,
            method="COBYLA",
            constraints=[{"type": "ineq", "fun": inside}],
            tol=1e-11,
            options={"maxiter": 20000},
        )
        if inside(found.x).min() > -1e-7:
            best = max(best, -found.fun)
    return sense * best


ENDS = [
    pytest.param(name, axis, marks=() if name == "tricept" or (name, axis) == (NAME, 1) else pytest.mark.slow)
    for name in SIX
    for axis in range(3)
]


@pytest.mark.parametrize(("name", "axis"), ENDS)
def test_ends_are_those_of_an_independent_optimiser(name, axis):
    """Nothing reaches farther, and the ends are reached: the distances of points keep the strokes."""
    mech = pp.load(name)
    found = pp.workspace(mech)
    low = 0.0 if mech.home[2, 3] > 0.0 else -np.inf  # above the base
    box = np.array([[-9.0, 9.0], [-9.0, 9.0], [low, 9.0]])
    size = np.ptp(found.extents, axis=1)[axis]
    assert found.extremes.errors[axis].max() < 1e-6 * size
    for sense, end in zip((-1, 1), found.extents[axis], strict=True):
        there = independent_end(mech, SIX[name](mech), axis, sense, box, 10)
        assert sense * (there - end) < 2e-6 * size
        assert sense * (end - there) < 2e-6 * size
    length = distances(mech, found.extremes.poses[axis])
    assert (length >= mech.stroke[:, 0] - 1e-9).all()
    assert (length <= mech.stroke[:, 1] + 1e-9).all()


@pytest.mark.parametrize("name", ["4pss-upu", "linapod", "3-puu", "4ups-up", "exechon", "pentapod-5-ups"])
def test_every_kind_of_machine_has_exact_ends(name):
    """Sliders, whose carriages stop at dead positions, redundant actuators, passive legs, free spins."""
    mech = pp.load(name)
    found = pp.workspace(mech)
    size = np.ptp(found.extents, axis=1)
    assert (found.extremes.errors < 1e-6 * size[:, None]).all()
    assert (found.extents[:, 0] < found.vertices.min(axis=0) + 1e-7).all()
    assert (found.extents[:, 1] > found.vertices.max(axis=0) - 1e-7).all()
    limits = mech.limits(found.extremes.poses)
    regular = limits.status == pp.Status.OK  # margins at a dead position are not determined
    assert regular.sum() >= 4
    assert limits.margins[regular].min() > -1e-9
    if mech.redundantly_actuated:  # det JᵀJ has one sign: there is one aspect
        assert np.allclose(pp.workspace(mech, keep_aspect=True).extents, found.extents, atol=1e-7, rtol=0)


def test_another_aspect_behind_a_singularity_does_not_count():
    """3-PUU: places with one sign of det J make up components; that of the start has the volume."""
    mech = pp.load("3-puu")
    found = pp.workspace(mech, keep_aspect=True)
    finer = [axis[0] + (axis[1] - axis[0]) * np.arange(-0.5, len(axis), 0.5) for axis in found.axes]
    places = np.stack(np.meshgrid(*finer, indexing="ij"), axis=-1)
    poses = np.tile(mech.home, (*places.shape[:-1], 1, 1))
    poses[..., :3, 3] = places
    inside = mech.limits(poses).within & (places[..., 2] >= found.inputs["bounds"]["z"][0])
    sign = np.sign(mech.determinant(poses).determinant)
    start = np.array(found.inputs["start"])
    parts, _ = ndimage.label(inside & (sign == np.sign(mech.determinant(start).determinant)))
    at = tuple(int(np.argmin(np.abs(axis - o))) for axis, o in zip(finer, start[:3, 3], strict=True))
    cell = np.prod([axis[1] - axis[0] for axis in finer])
    volume = cell * np.count_nonzero(parts == parts[at])
    assert found.volume == pytest.approx(volume, abs=found.volume_error + 0.005 * volume)
    assert found.volume_error < 0.05 * volume


def test_the_published_manipulator_spans_what_an_audit_found(lu):
    """1439.33 x 1471.97 mm, whatever the step: by another optimiser, and by the audit to 0.01 mm."""
    for step in (0.08, 0.02):
        width = np.ptp(pp.workspace(lu, step=step).extents, axis=1)
        assert width[:2] == pytest.approx([1.439331, 1.471966], abs=1e-6)


# --- what they say ------------------------------------------------------------------------------------------


def test_a_pose_stands_at_each_end_on_the_limits_that_are_named(lu):
    found = pp.workspace(lu, step=0.08, keep_aspect=True)
    assert np.allclose(
        found.extremes.poses[np.arange(3), :, np.arange(3), 3], found.extents, atol=1e-12, rtol=0
    )
    limits = lu.limits(found.extremes.poses)
    assert limits.margins.min() > -1e-9
    names = np.array(limits.names)
    singular = 0
    for axis in range(3):
        for end in range(2):
            told = set(found.extremes.limits[axis][end])
            assert told - {SINGULARITY, EDGE_OF_GRID} == set(names[limits.relative[axis, end] < 1e-6])
            if SINGULARITY in told:
                singular += 1
                assert abs(lu.determinant(found.extremes.poses[axis, end]).determinant) < 1e-9
    assert singular > 0
    assert found.extremes.limits[2][0][-1] == EDGE_OF_GRID  # the base plane


def test_ends_lie_within_given_bounds_and_name_them(lu):
    found = pp.workspace(lu, step=0.05, bounds={"x": (-0.2, 0.3), "z": (0.5, 2.0)})
    assert found.extents[0] == pytest.approx([-0.2, 0.3], abs=1e-9)
    assert found.extents[2, 0] == pytest.approx(0.5, abs=1e-9)
    assert EDGE_OF_GRID in found.extremes.limits[0][0]
    assert EDGE_OF_GRID not in found.extremes.limits[2][1]


def test_a_part_has_ends_of_its_own(lu):
    """Above a plane: as wide as a workspace whose bounds are that part."""
    found = pp.workspace(lu, step=0.04)
    part = extremes_within(found, {"z": (0.4, 2.0)})
    alone = pp.workspace(lu, step=0.04, bounds={"z": (0.4, 2.0)})
    assert np.allclose(part.values, alone.extents, atol=1e-7, rtol=0)
    with pytest.raises(pp.WorkspaceError, match="no place of the boundary"):
        extremes_within(found, {"z": (0.9, 2.0)})


def test_a_spike_thinner_than_the_step_is_followed(lu):
    """Tilts at a point: at an azimuth of ±90° legs 4 and 5 are shortest at once, at the end of a needle."""
    at = {"x": 0.0, "y": 0.1, "z": 0.7}
    found = pp.workspace(lu, ["azimuth", "tilt"], at)
    assert found.vertices[:, 1].max() < 0.98
    assert found.extents[1, 1] > 1.06
    assert set(found.extremes.limits[1][1]) == {"stroke min of leg 4", "stroke min of leg 5"}
    end = lu.inverse_kinematics(found.extremes.poses[1, 1]).lengths
    assert end[[3, 4]] == pytest.approx(0.65, abs=1e-9)
    tip = lu.coordinates(found.extremes.poses[1, 1], "tool")
    assert np.arccos(tip["axis_z"]) == pytest.approx(found.extents[1, 1], abs=1e-9)
    azimuth = float(np.arctan2(tip["axis_y"], tip["axis_x"]))
    assert abs(azimuth) == pytest.approx(np.pi / 2, abs=1e-6)
    about = {"azimuth": (azimuth - 0.02, azimuth + 0.02), "tilt": (0.9, 1.1)}
    finer = pp.workspace(lu, ["azimuth", "tilt"], at, step=0.0004, bounds=about)
    assert 1.05 < finer.vertices[:, 1].max() <= found.extents[1, 1]
    assert finer.extents[1, 1] == pytest.approx(found.extents[1, 1], abs=1e-8)


def test_an_end_of_a_sphere_is_exact():
    """A constant-orientation slice of a hexapod ends on shells about B_i - R m_i: the least of their tops."""
    mech = pp.load(DATA / "stewart-gough.toml")
    found = pp.workspace(mech, ["x", "y", "z"], {"rx": 0.0, "ry": 0.0, "rz": 0.0}, step=0.05)
    top = found.extremes.poses[2, 1]
    centres = np.array(
        [np.subtract(leg["base"]["point"], leg["platform"]["point"]) for leg in mech.geometry["legs"]]
    )
    greatest = mech.stroke[:, 1]
    # Straight above the middle, all six shells meet.
    level = np.sqrt(greatest**2 - np.sum(centres[:, :2] ** 2, axis=1)) + centres[:, 2]
    assert found.extents[2, 1] == pytest.approx(level.min(), abs=1e-8)
    assert np.abs(top[:2, 3]).max() < 1e-4


def test_the_left_jacobian_takes_rates_of_a_rotation_vector_to_angular_velocity():
    rng = np.random.default_rng(4)
    for w in (*rng.normal(size=(6, 3)), np.zeros(3), 1e-5 * rng.normal(size=3)):
        for axis in np.eye(3):
            step = 1e-6 * axis
            turn = Rotation.from_rotvec(w + step) * Rotation.from_rotvec(w - step).inv()
            assert turn.as_rotvec() / 2e-6 == pytest.approx(left_jacobian(w) @ axis, abs=1e-8)


# --- default grids ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("half", [20e-3, 10e-3, 1e-3, 10e-6])
def test_small_strokes_have_a_workspace_by_default(hexapod, half):
    """Extents against linear programming with the Jacobian at home, exact for vanishing strokes."""
    small = strokes(hexapod, half)
    found = pp.workspace(small)
    jacobian = hexapod.jacobian(hexapod.home)
    for axis in range(3):
        way = np.eye(6)[axis]
        most = linprog(
            -way,
            A_ub=np.concatenate([jacobian, -jacobian]),
            b_ub=np.full(12, half),
            bounds=[(None, None)] * 6,
        )
        ends = found.extents[axis] - hexapod.home[axis, 3]
        assert np.abs(ends) == pytest.approx(-most.fun, rel=10.0 * half + 1e-6)
    assert 40 <= max(found.mask.shape) <= 70
    assert 0.0 < found.volume_error < 0.05 * found.volume


def test_a_start_far_from_home_is_found_for_strokes_that_exclude_home(hexapod):
    data = hexapod.to_dict()
    for leg, length in zip(data["legs"], hexapod.inverse_kinematics(hexapod.home).lengths, strict=True):
        leg["stroke"] = {"min": length + 0.3, "max": length + 0.31}
    found = pp.workspace(pp.Mechanism.from_dict(data))
    assert np.ptp(found.extents, axis=1).max() < 0.03
    assert found.extents[2].min() > hexapod.home[2, 3] + 0.3


def test_a_step_that_is_too_coarse_is_told_with_one_that_works(hexapod):
    small = strokes(hexapod, 0.01)
    with pytest.raises(
        pp.WorkspaceError, match=r"no node of a grid of 500\.0 mm .* with .* mm one is"
    ) as told:
        pp.workspace(small, step=0.5)
    works = float(re.findall(r"with ([\d.]+) mm", str(told.value))[0]) / 1e3
    assert pp.workspace(small, step=works).mask.any()


def test_a_step_that_is_too_fine_is_told_with_one_that_works(lu):
    with pytest.raises(pp.WorkspaceError, match=r"at most 1e\+09, with a step of ([\d.]+) mm") as told:
        pp.workspace(lu, step=1e-5)
    step = float(re.findall(r"step of ([\d.]+) mm", str(told.value))[0])
    assert 0.5 < step < 3.0


def test_the_default_grid_follows_what_is_reached(lu):
    """It goes lower than optimisation from home finds: a grid that cuts the workspace off is widened."""
    found = pp.workspace(lu)
    assert found.extents[2, 0] == 0.0
    assert found.shares[EDGE_OF_GRID] < 0.01
    narrow = np.ptp(found.axes[0]) / np.ptp(found.extents[0])
    assert 0.95 < narrow < 1.1
