"""Limits against lengths, angles and distances computed in another way, on both sides of each bound.

Distances of struts and platform are found by search; conditioning and forces are those of the oracle.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar, nnls
from scipy.spatial.transform import Rotation

import polypod as pp
from polypod import Status
from support import DATA
from support import oracle as o
from support.limited import Tables, free, paper, tables

Array = NDArray[np.float64]

REST = np.zeros(6)
TINY = 1e-6  # how far beside a bound the two sides of it are tested, in m, rad, N or 1
SEED = 5


def spr() -> Tables:
    """The 3-RPS head upside down: S below, R above."""
    content = tables("3-rps")
    for leg in content["legs"]:
        axis = leg["base"]["axis"]
        leg["base"] = {"joint": "S", "point": leg["base"]["point"]}
        leg["platform"] = {"joint": "R", "point": leg["platform"]["point"], "axis": axis}
        for link in (leg["cylinder"], leg["piston"]):
            link["inertia"][2] = link["inertia"][0]
    return content


def six_three() -> Tables:
    """A hexapod whose legs meet in pairs on the platform."""
    content = tables("stewart-gough")
    for leg, angle in zip(content["legs"], (0, 0, 120, 120, 240, 240), strict=True):
        turn = 30 if leg["base"]["point"]["angle"] % 120 == 10 else -30
        leg["base"]["point"]["angle"] = angle + turn
        leg["base"]["axis"] = {"angle": angle + turn + 90}
        leg["platform"]["point"]["angle"] = angle
    return content


SPREAD = {"p": 0.15, "h": 0.05, "x": 0.15, "y": 0.15, "z": 0.08}


def poses(mech: pp.Mechanism, count: int = 12) -> Array:
    """The centre and poses about it."""
    rng = np.random.default_rng(SEED)
    set = "natural" if "natural" in mech.coordinate_sets else "pose"
    names = mech.coordinate_sets[set] if mech.dof > 3 else ("z", "rx", "ry")
    home = {"h": 0.74} if set == "natural" else mech.coordinates(mech.home, set)
    near = np.concatenate([[0.0, 1e-9], np.ones(count - 2)])
    q = {n: home.get(n, 0.0) + near * rng.uniform(-1, 1, count) * SPREAD.get(n, 0.5) for n in names}
    state = mech.state(q)
    assert np.all(state.status == Status.OK)
    return state.pose


def margins(mech: pp.Mechanism, pose: Array, kind: str) -> Array:
    """Those of one kind."""
    which = [limit.kind == kind for limit in mech.limit_list]
    assert any(which), kind
    return mech.limits(pose).margins[..., which]


# --- what is measured ---------------------------------------------------------------------------------------


def ends(mech: pp.Mechanism, pose: Array) -> tuple[Array, Array]:
    """B and b of every leg, base axes."""
    legs = mech.geometry["legs"]
    points = np.array([leg["platform"]["point"] for leg in legs])
    return np.array([leg["base"]["point"] for leg in legs]), points @ pose[:3, :3].T + pose[:3, 3]


def test_strokes_and_cones_by_hand():
    content = paper()
    for i, leg in enumerate(content["legs"]):
        leg["base"]["cone"] = {"angle": 20.0 + i, "axis": [0.1, 0.0, 1.0]}
        leg["platform"]["cone"] = {"angle": 30.0 + i}
    mech = pp.Mechanism.from_dict(content)
    B0, b0 = ends(mech, mech.home)
    for pose in poses(mech):
        B, b = ends(mech, pose)
        r = b - B
        length = np.sqrt((r**2).sum(axis=1))
        assert margins(mech, pose, "stroke min") == pytest.approx(length - 0.65, abs=1e-15)
        assert margins(mech, pose, "stroke max") == pytest.approx(0.85 - length, abs=1e-15)
        for side, frame, axes in (
            ("base", np.eye(3), np.tile([0.1, 0.0, 1.0], (5, 1))),
            ("platform", pose[:3, :3], (b0 - B0) @ mech.home[:3, :3]),
        ):
            cosine = ((r @ frame) * axes).sum(axis=1) / length / np.sqrt((axes**2).sum(axis=1))
            allowed = np.radians((20.0 if side == "base" else 30.0) + np.arange(5))
            found = margins(mech, pose, f"{side} cone")
            assert found == pytest.approx(allowed - np.arccos(np.minimum(cosine, 1)), abs=3e-8)


def test_the_turn_of_a_revolute_joint_takes_the_leg_from_home():
    """Turning the home direction by the angle that the margin tells gives the direction at the pose."""
    low, high = np.radians([-50.0, 80.0])
    for side, content in (("base", tables("3-rps")), ("platform", spr())):
        for leg in content["legs"]:
            leg[side]["range"] = {"min": -50.0, "max": 80.0}
        mech = pp.Mechanism.from_dict(content)
        B0, b0 = ends(mech, mech.home)
        both_signs = set()
        for pose in poses(mech):
            B, b = ends(mech, pose)
            found = margins(mech, pose, f"{side} angle")
            for i, leg in enumerate(mech.geometry["legs"]):
                axis = np.array(leg[side]["axis"]) / np.linalg.norm(leg[side]["axis"])
                R0, R = (np.eye(3), np.eye(3)) if side == "base" else (mech.home[:3, :3], pose[:3, :3])
                start, now = R0.T @ (b0 - B0)[i], R.T @ (b - B)[i]
                # At the platform the angle is that of the platform against the leg.
                sign = 1 if side == "base" else -1
                turned = {
                    a: Rotation.from_rotvec(sign * a * axis).apply(start / np.linalg.norm(start))
                    for a in (low + found[i], high - found[i])
                }
                angle = min(turned, key=lambda a: np.linalg.norm(turned[a] - now / np.linalg.norm(now)))
                assert turned[angle] == pytest.approx(now / np.linalg.norm(now), abs=1e-12)
                assert abs(angle) < 1e-8 or found[i] == pytest.approx(min(angle - low, high - angle))
                both_signs.add(np.sign(np.round(angle, 6)))
        assert both_signs == {-1.0, 0.0, 1.0}


def test_angles_of_a_rod_and_of_the_joints_on_it():
    """L is along x: the rod's angle is that of r about x; the joint's, that between L and r."""
    content = paper()
    content["rods"][0]["range"] = {"min": -60.0, "max": 40.0}
    for i in (0, 2):
        content["legs"][i]["base"]["range"] = {"min": -25.0, "max": 45.0}
    mech = pp.Mechanism.from_dict(content)
    B0, b0 = ends(mech, mech.home)

    def about_x(r: Array) -> float:
        return float(np.arctan2(r[2], r[1]))

    def from_x(r: Array) -> Array:
        cosine: Array = np.arccos(r[[0, 2], 0] / np.linalg.norm(r[[0, 2]], axis=1))
        return cosine

    for pose in poses(mech):
        B, b = ends(mech, pose)
        turn = about_x((b - B)[0]) - about_x((b0 - B0)[0])
        expected = np.radians(50.0) - abs(turn + np.radians(10.0))
        assert margins(mech, pose, "rod angle") == pytest.approx([expected], abs=1e-12)
        swing = from_x(b - B) - from_x(b0 - B0)
        expected = np.radians(35.0) - np.abs(swing - np.radians(10.0))
        assert margins(mech, pose, "base angle") == pytest.approx(expected, abs=1e-12)


def by_search(a: tuple[Array, Array], b: tuple[Array, Array]) -> float:
    """Least distance over a grid of both segments' points that closes in on it."""
    middle, half = np.array([0.5, 0.5]), 0.5
    for _ in range(30):
        s, t = (np.clip(m + half * np.linspace(-1, 1, 21), 0, 1) for m in middle)
        first, second = (p + x[:, None] * (q - p) for (p, q), x in ((a, s), (b, t)))
        distance = np.linalg.norm(first[:, None] - second[None], axis=-1)
        i, j = np.unravel_index(distance.argmin(), distance.shape)
        middle, half = np.array([s[i], t[j]]), half * 0.4
    return float(distance.min())


def cut(p: Array, q: Array, reach: tuple[float, float]) -> tuple[Array, Array]:
    along = (q - p) / np.linalg.norm(q - p)
    return p + reach[0] * along, q - reach[1] * along


@pytest.mark.parametrize("shape", [six_three, lambda: tables("stewart-gough")], ids=["6-3", "6-6"])
def test_clearance_of_struts_by_search(shape: Callable[[], Tables]):
    content = shape() | {"limits": {"clearance": 6.0}}
    for i, leg in enumerate(content["legs"]):
        leg["radius"] = 10.0 + i
    mech = pp.Mechanism.from_dict(content)
    radii = 0.010 + 0.001 * np.arange(6)
    reach = 3 * (radii + 0.006)
    pairs = [(i, j) for i in range(6) for j in range(i + 1, 6)]
    assert [limit.legs for limit in mech.limit_list if limit.kind == "leg clearance"] == [
        (str(i + 1), str(j + 1)) for i, j in pairs
    ]
    shared = 0
    # Far rotated poses too, where struts cross.
    turned = mech.pose({"x": 0.0, "y": 0.0, "z": 0.55, "rx": 0.3, "ry": 0.1, "rz": np.linspace(-2.8, 2.8, 9)})
    struck = False
    for pose in (*poses(mech, 5), *turned):
        B, b = ends(mech, pose)
        found = margins(mech, pose, "leg clearance")
        for margin, (i, j) in zip(found, pairs, strict=True):
            touch = [np.linalg.norm(p[i] - p[j]) <= radii[i] + radii[j] + 0.006 for p in (B, b)]
            shared += sum(touch)
            one, two = (cut(B[k], b[k], (touch[0] * reach[k], touch[1] * reach[k])) for k in (i, j))
            gap = by_search(one, two) - radii[i] - radii[j]
            assert margin == pytest.approx(gap - 0.006, abs=1e-9)
            struck |= gap < -0.015
    assert struck, "some struts cross"
    assert (shared > 0) == (shape is six_three)


def to_hull(points: Array, x: Array) -> float:
    """Distance of x from the convex hull: the best weights of its points, which add up to one."""
    heavy = 1e4
    matrix = np.vstack([points.T, np.full(len(points), heavy)])
    weights = nnls(matrix, np.append(x, heavy), maxiter=1000)[0]
    return float(np.linalg.norm(points.T @ (weights / weights.sum()) - x))


@pytest.mark.parametrize("height", [0.0, 40.0], ids=["plate", "solid"])
def test_clearance_of_struts_and_platform_by_search(height: float):
    content = tables("stewart-gough") | {"limits": {"clearance": 6.0, "joint_reach": 120.0}}
    content["legs"][1]["platform"]["point"]["z"] = height
    content["legs"][4]["platform"]["point"]["z"] = -height
    mech = pp.Mechanism.from_dict(content)
    # Tilted poses, and one far aside where struts lie along the platform.
    x, z, tilt = [0, 0, 0, 0, 0.9], [0.25, 0.25, 0.25, 0.25, 0.02], [0.9, 0.3, 0, 1.8, 0.01]
    turned = mech.pose({"x": x, "y": 0.1, "z": z, "rx": tilt, "ry": 0.0, "rz": 0.2})
    gaps = []
    for pose in (*poses(mech, 4), *turned):
        B, b = ends(mech, pose)
        for margin, foot, top in zip(margins(mech, pose, "platform clearance"), B, b, strict=True):
            p, q = cut(foot, top, (0.0, 0.120))
            least = minimize_scalar(
                lambda t, p=p, q=q, b=b: to_hull(b, p + t * (q - p)),
                bounds=(0, 1),
                method="bounded",
                options={"xatol": 1e-10},
            )
            gap = min(least.fun, to_hull(b, p), to_hull(b, q))
            assert margin == pytest.approx(gap - 0.025 - 0.006, abs=1e-6)
            gaps.append(gap)
    # A strut lies along a plate, but pierces it never: it ends in its plane.
    assert (0 < min(gaps) < 0.01) if height == 0.0 else min(gaps) < 1e-9
    assert max(gaps) > 0.11


@pytest.mark.parametrize("name", ["lu-3spu-2rpu-r", "3-rps"])
def test_conditioning_and_forces_of_the_oracle(name: str):
    content = tables(name) | {"limits": {"sigma_min": 0.02}}
    content["units"]["force"] = "N"
    content["load"] = {"force": [30.0, -20.0, -400.0]}
    for leg in content["legs"]:
        leg["force"] = {"min": -2500.0, "max": 1500.0}
    mech, spec = pp.Mechanism.from_dict(content), o.read(content)
    pose = poses(mech)[2:]
    pair = (pose[:, :3, :3], pose[:, :3, 3])
    singular = o.conditioning(spec, pair)
    # The conditioning limits accuracy where forces are large.
    accuracy = {"rel": 1e-9 * float((singular[:, 0] / singular[:, -1]).max())}
    assert margins(mech, pose, "conditioning")[:, 0] == pytest.approx(singular[:, -1] - 0.02, **accuracy)
    forces = o.active_forces(spec, pair, np.zeros((len(pose), 6)), np.zeros((len(pose), 6)))
    assert margins(mech, pose, "force min") == pytest.approx(forces + 2500.0, **accuracy)
    assert margins(mech, pose, "force max") == pytest.approx(1500.0 - forces, **accuracy)
    # Another load, and a motion.
    other = mech.inverse_dynamics(pose, REST, REST, [0, 0, 900.0, 0, 5, 0], "platform").forces
    loaded = mech.limits(pose, [0, 0, 900.0, 0, 5, 0], "platform").margins[:, -1]
    assert loaded == pytest.approx(1500.0 - other[:, -1])


# --- both sides of every bound ------------------------------------------------------------------------------


def put(content: Tables, kind: str, bound: float, other: float) -> None:
    """The limit of one kind, for leg 1 where it is one of a leg, in SI."""
    leg = content["legs"][0]
    end = kind[-3:]
    match kind:
        case "stroke min" | "stroke max":
            leg["stroke"] = {end: 1e3 * bound, ("max" if end == "min" else "min"): 1e3 * other}
        case "base cone" | "platform cone":
            leg[kind.split()[0]]["cone"] = {"angle": float(np.degrees(bound))}
        case "base angle":
            leg["base"]["range"] = {"min": -90.0, "max": float(np.degrees(bound))}
        case "rod angle":
            content["rods"][0]["range"] = {"min": -90.0, "max": float(np.degrees(bound))}
        case "leg clearance" | "platform clearance":
            reach = 200.0 if "leg" in kind else 45.0  # so that the other kind has more room
            content["limits"] = {"clearance": 1e3 * bound, "joint_reach": reach}
            for each in content["legs"]:
                each["radius"] = 8.0
        case "conditioning":
            content["limits"] = {"sigma_min": bound}
        case "force min" | "force max":
            leg["force"] = {end: bound, ("max" if end == "min" else "min"): other}


KINDS = {
    "stroke min": ("stroke min of leg 1", "m", 2.0),
    "stroke max": ("stroke max of leg 1", "m", 0.1),
    "base cone": ("base cone of leg 1", "rad", 0.0),
    "platform cone": ("platform cone of leg 1", "rad", 0.0),
    "base angle": ("base angle of leg 1", "rad", 0.0),
    "rod angle": ("angle of rod L", "rad", 0.0),
    "leg clearance": ("clearance of legs 4 and 5", "m", 0.0),
    "platform clearance": ("clearance of leg 4 and the platform", "m", 0.0),
    "conditioning": ("conditioning", "1", 0.0),
    "force min": ("force min of leg 1", "N", 1e5),
    "force max": ("force max of leg 1", "N", -1e5),
}
NATURAL = {"alpha": 0.1, "p": -0.3, "h": 0.62, "beta": 0.7, "gamma": 0.6}


@pytest.mark.parametrize("kind", KINDS)
def test_both_sides_of_a_bound(kind: str):
    """The margin is what the bound was moved by, and its limit binds."""
    name, unit, other = KINDS[kind]
    pose = pp.load("lu-3spu-2rpu-r").pose(NATURAL)

    def limits(bound: float) -> tuple[pp.Mechanism, Any]:
        content = free()
        put(content, kind, bound, other)
        mech = pp.Mechanism.from_dict(content)
        return mech, mech.limits(pose)

    # The quantity at the pose, read from the margin that some bound leaves.
    at_most = kind.split()[-1] in ("max", "cone", "angle")
    start = {"N": -7e4 if at_most else 2e4, "m": 0.5 if "stroke" in kind else 0.01, "1": 0.01, "rad": 1.0}[
        unit
    ]
    mech, some = limits(start)
    index = some.names.index(name)
    value = start - some.margins[index] if at_most else start + some.margins[index]
    tiny = TINY * (1e3 if unit == "N" else 1.0)
    for inside in (True, False):
        bound = value + (tiny if inside == at_most else -tiny)
        mech, found = limits(float(bound))
        assert found.margins[index] == pytest.approx(tiny if inside else -tiny, rel=1e-3)
        assert found.names[found.binding] == name
        assert found.within == inside
        limit = mech.limit_list[index]
        assert (limit.kind, limit.unit) == (kind, unit)
        assert found.relative[index] == pytest.approx(found.margins[index] / limit.scale, rel=1e-12)
        expected = {"stroke": Status.OUT_OF_STROKE, "cone": Status.OUT_OF_CONE, "angle": Status.OUT_OF_ANGLE}
        code = next((s for word, s in expected.items() if word in kind), Status.OK)
        assert found.status == (Status.OK if inside else code)
        assert mech.inverse_dynamics(pose, REST, REST).status == found.status
        assert mech.kinematics(pose, REST, REST).status == found.status
        assert np.isfinite(mech.inverse_dynamics(pose, REST, REST).forces).all()


def test_bounds_are_those_of_the_file():
    content = paper() | {"limits": {"sigma_min": 0.02}}
    content["legs"][1]["base"]["cone"] = {"angle": 40.0}
    content["legs"][2]["base"]["range"] = {"min": -30.0, "max": 60.0}
    content["legs"][4]["force"] = {"min": -100.0, "max": 300.0}
    limits = {limit.name: limit for limit in pp.Mechanism.from_dict(content).limit_list}
    assert len(limits) == 10 + 1 + 1 + 1 + 2
    for name, least, greatest, scale in (
        ("stroke max of leg 2", -np.inf, 0.85, 0.2),
        ("base cone of leg 2", -np.inf, np.radians(40), np.radians(40)),
        ("base angle of leg 3", np.radians(-30), np.radians(60), np.radians(90)),
        ("conditioning", 0.02, np.inf, 1.0),
        ("force min of leg 5", -100.0, np.inf, 400.0),
        ("force max of leg 5", -np.inf, 300.0, 400.0),
    ):
        limit = limits[name]
        assert (limit.least, limit.greatest, limit.scale) == pytest.approx(
            (least, greatest, scale), rel=1e-14
        )
    assert limits["conditioning"].legs == ("1", "2", "3", "4", "5")


def test_the_circle_has_no_ends():
    """Ranges that differ by whole rotations are the same."""
    mechs = []
    for shift in (-360.0, 0.0, 360.0):
        content = tables("3-rps")
        content["legs"][0]["base"]["range"] = {"min": shift - 20.0, "max": shift + 30.0}
        mechs.append(pp.Mechanism.from_dict(content))
    pose = poses(mechs[0])
    found = [margins(mech, pose, "base angle") for mech in mechs]
    assert found[0] == pytest.approx(found[1], abs=1e-14)
    assert found[2] == pytest.approx(found[1], abs=1e-14)


# --- joints that touch --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("beside", "counts"), [(-TINY, False), (TINY, True)])
def test_only_joints_that_always_touch_are_left_out(beside: float, counts: bool):
    """Joints as far apart as radii and clearance: nearer the stretch does not count, farther it does."""
    content = six_three() | {"limits": {"clearance": 4.0}}
    for leg in content["legs"]:
        leg["radius"] = 10.0
    content["legs"][1]["platform"]["point"] = [300.0, 24.0 + 1e3 * beside, 0.0]
    mech = pp.Mechanism.from_dict(content)
    B, b = ends(mech, mech.home)
    margin = margins(mech, mech.home, "leg clearance")[0]
    if counts:
        assert margin == pytest.approx(beside, abs=1e-9), "the ends are the nearest points"
    else:
        one, two = (cut(B[k], b[k], (0.0, 3 * 0.014)) for k in (0, 1))
        assert margin == pytest.approx(by_search(one, two) - 0.024, abs=1e-9)
        assert margin > 1e-3


@pytest.mark.parametrize(("reach", "sine"), [(None, 1 / 3), (60.0, 0.4)])
def test_a_strut_may_lean_on_the_platform_so_far(reach: float | None, sine: float):
    """Clearance and radius are 24 mm together, the stretch is three times that by default."""
    content = tables("stewart-gough") | {"limits": {"clearance": 4.0}}
    if reach is not None:
        content["limits"]["joint_reach"] = reach
    for leg in content["legs"]:
        leg["radius"] = 20.0
    mech = pp.Mechanism.from_dict(content)
    # Leg 1 inwards under the platform, by less and by more than that angle.
    B = np.array(mech.geometry["legs"][0]["base"]["point"])
    b = np.array(mech.geometry["legs"][0]["platform"]["point"])
    for more in (-TINY, TINY):
        angle = np.arcsin(sine) + more
        down = np.array([*(-b[:2] / np.linalg.norm(b) * np.cos(angle)), -np.sin(angle)])
        pose = np.eye(4)
        pose[:3, 3] = B - 0.7 * down - b
        margin = mech.limits(pose).margins[[k.kind == "platform clearance" for k in mech.limit_list]][0]
        stretch = 0.072 if reach is None else reach / 1e3
        assert margin == pytest.approx(stretch * np.sin(angle) - 0.024, abs=1e-12)
        assert (margin > 0) == (more > 0)


def test_a_short_strut_is_cut_by_half_at_most():
    content = tables("stewart-gough") | {"limits": {"clearance": 0.0, "joint_reach": 5000.0}}
    mech = pp.Mechanism.from_dict(content)
    B, b = ends(mech, mech.home)
    expected = [to_hull(b, middle) - 0.025 for middle in (B + b) / 2]
    assert margins(mech, mech.home, "platform clearance") == pytest.approx(expected, abs=1e-9)


# --- continuity ---------------------------------------------------------------------------------------------


def test_margins_are_continuous():
    """Where struts cross, joints rotate far and the platform is pierced, jumps shrink with the step."""
    content = six_three() | {"limits": {"clearance": 6.0, "sigma_min": 0.02}}
    for leg in content["legs"]:
        leg["base"]["cone"] = {"angle": 20.0}
        leg["platform"]["cone"] = {"angle": 25.0}
    hexapod = pp.Mechanism.from_dict(content)
    content = tables("3-rps") | {"limits": {"clearance": 5.0}}
    for leg in content["legs"]:
        leg["base"]["range"] = {"min": -20.0, "max": 30.0}
    head = pp.Mechanism.from_dict(content)

    def along(mech: pp.Mechanism, n: int) -> Array:
        t = np.linspace(0.0, 2 * np.pi, n)
        if mech is head:
            q = {"z": 0.5 + 0.1 * np.sin(t), "rx": 1.2 * np.sin(2 * t), "ry": 0.9 * np.cos(3 * t)}
        else:
            q = {"x": 0.3 * np.sin(t), "y": 0.2 * np.cos(t), "z": 0.5 + 0.3 * np.sin(3 * t)}
            q |= {"rx": 1.5 * np.sin(2 * t), "ry": 0.6 * np.cos(t), "rz": 2.5 * np.sin(t)}
        found = mech.limits(mech.state(q, continued=True).pose).margins
        assert np.isfinite(found).all()
        assert len({*np.sign(found).ravel()}) == 2
        return np.abs(np.diff(found, axis=0)).max(axis=0)

    for mech in (hexapod, head):
        assert np.all(along(mech, 20001) < 0.3 * along(mech, 5001))


# --- what there is without limits, and where there is no answer ---------------------------------------------


def test_nothing_given_nothing_limited():
    mech = pp.Mechanism.from_dict(free())
    assert mech.limit_list == ()
    found = mech.limits(np.stack([mech.home] * 3))
    assert found.margins.shape == found.relative.shape == (3, 0)
    assert found.binding.tolist() == [-1] * 3
    assert found.within.all()
    assert not np.any(found.status)
    # A radius alone is for drawing.
    kinds = {limit.kind for limit in pp.load(DATA / "stewart-gough.toml").limit_list}
    assert kinds == {"stroke min", "stroke max"}


def test_no_answer_no_margin():
    mech = pp.Mechanism.from_dict(paper() | {"limits": {"sigma_min": 0.01}})
    off, sound = mech.home, mech.pose(NATURAL)
    off[0, 3] += 0.01
    off[:3, :3] = Rotation.from_rotvec([0, 0, 0.2]).as_matrix() @ off[:3, :3]
    found = mech.limits([off, np.full((4, 4), np.nan), sound])
    assert found.status.tolist() == [Status.OFF_CONSTRAINT, Status.INVALID_INPUT, Status.OK]
    assert np.isnan(found.margins[:2]).all()
    assert np.isfinite(found.margins[2]).all()
    assert found.binding[:2].tolist() == [-1, -1]
    assert found.within.tolist() == [False, False, True]


def test_forces_at_a_singular_pose_have_no_margin():
    """Struts of a hexapod with base and platform alike are parallel: it slides with its actuators locked."""
    content = tables("stewart-gough") | {"limits": {"sigma_min": 0.05}}
    for leg in content["legs"]:
        leg["platform"]["point"] = {**leg["base"]["point"], "radius": 500.0}
        leg["force"] = {"min": -1e3, "max": 1e3}
    mech = pp.Mechanism.from_dict(content)
    found = mech.limits(mech.home)
    kinds = np.array([limit.kind for limit in mech.limit_list])
    force = np.isin(kinds, ("force min", "force max"))
    assert found.status == Status.SINGULAR
    assert np.isnan(found.margins[force]).all()
    assert np.isfinite(found.margins[~force]).all()
    assert found.margins[kinds == "conditioning"] == pytest.approx([-0.05], abs=1e-12)
    assert found.binding == -1
    assert not found.within
    # Without limits of forces the pose has all its margins; the floor of conditioning binds.
    for leg in content["legs"]:
        del leg["force"]
    found = pp.Mechanism.from_dict(content).limits(mech.home)
    assert found.status == Status.OK
    assert found.names[found.binding] == "conditioning"


COLUMNS = 120
