"""Motions: exact derivatives, files read, every fault named at once."""

import copy
import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from numpy.polynomial import Polynomial
from scipy.spatial.transform import Rotation

import polypod as pp
from polypod.errors import MotionError, ShapeError, UnknownNameError
from polypod.motion.motion import Array, Motion, minimum_jerk, quintic
from polypod.motion.motion_file import load_motion

SETS = {
    "paper": ("x", "y", "z", "alpha", "beta"),
    "natural": ("alpha", "p", "h", "beta", "gamma"),
    "tool": ("tip_x", "tip_y", "tip_z", "axis_x", "axis_y", "axis_z"),
    "pose": ("x", "y", "z", "rx", "ry", "rz"),
}
HEADER = "time [s], x [mm], y [mm], z [mm], alpha [deg], beta [deg]"
Write = Callable[[str, str], Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def to_file(name: str, text: str) -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return to_file


def table(time: Array, *columns: Array, header: str = HEADER) -> str:
    rows = (",".join(map(repr, row)) for row in np.column_stack([time, *columns]).tolist())
    return "\n".join([header, *rows, ""])


def faults(path: Path, **options: Any) -> list[str]:
    with pytest.raises(MotionError) as caught:
        load_motion(path, SETS, **options)
    assert str(caught.value).startswith(f"{path} has ")
    assert all(str(fault) in str(caught.value) for fault in caught.value.faults)
    return [str(fault) for fault in caught.value.faults]


# --- the spline through samples ---


def wave(t: Array) -> Array:
    return np.sin(3 * t) + 0.3 * t


def test_samples_are_met_and_polynomials_exact() -> None:
    t = np.sort(np.random.default_rng(1).uniform(0, 2, 12))
    q = Polynomial([0.3, -1, 0.5, 2, -0.7, 0.2])
    motion = Motion.through(t, {"x": q(t)}, set="a")
    assert motion.coordinates["x"] == pytest.approx(q(t), abs=1e-13)
    assert motion.rates["x"] == pytest.approx(q.deriv()(t), abs=1e-11)
    assert motion.second_rates["x"] == pytest.approx(q.deriv(2)(t), abs=1e-9)


@pytest.mark.parametrize("n", [2, 3, 4, 5])
def test_few_samples_are_joined_by_one_polynomial(n: int) -> None:
    t = np.linspace(0, 1, n)
    q = Polynomial(np.arange(1.0, n + 1))
    motion = Motion.through(t, {"x": q(t)}, set="a")
    assert motion.second_rates["x"] == pytest.approx(q.deriv(2)(t) + 0 * t, abs=1e-9)


def order(errors: list[float], steps: list[float]) -> float:
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])


@pytest.mark.parametrize(
    ("nu", "exact"), [(0, wave), (1, lambda t: 3 * np.cos(3 * t) + 0.3), (2, lambda t: -9 * np.sin(3 * t))]
)
def test_orders_of_the_spline(nu: int, exact: Callable[[Array], Array]) -> None:
    """Between samples the error falls with h^(6 - nu), ends included."""
    steps, errors = [], []
    for n in (17, 33, 65):
        t = np.linspace(0, 2, n)
        between = np.linspace(0, 2, 4001)
        sampled = Motion.through(t, {"x": wave(t)}, set="a").sample(between)
        found = (sampled.coordinates, sampled.rates, sampled.second_rates)[nu]["x"]
        errors.append(float(np.abs(found - exact(between)).max()))
        steps.append(2 / (n - 1))
    assert order(errors, steps) > 6 - nu - 0.5


def all_curves() -> dict[str, Motion]:
    t = np.array([0.0, 0.7, 1.0, 1.9, 3.0])
    q = np.random.default_rng(2).normal(size=(5, 2))
    long = np.linspace(0, 3, 40)
    names = ("x", "y")
    sample = np.linspace(0, 3, 301)
    splined = Motion.through(long, {"x": wave(long), "y": np.cos(long)}, set="a")
    return {
        "through": splined,
        "without curve": replace(splined, curve=None),
        "quintic": Motion.along(quintic(t, q), sample, names, name="a", set="a"),
        "minimum-jerk": Motion.along(minimum_jerk(t, q), sample, names, name="a", set="a"),
    }


@pytest.mark.parametrize("name", all_curves())
def test_rates_are_derivatives(name: str) -> None:
    """Central differences approach them with h^2."""
    motion = all_curves()[name]
    t = np.sort(np.random.default_rng(3).uniform(0.01, 2.99, 200))
    t = t[np.abs(t[:, None] - [0.7, 1.0, 1.9]).min(axis=1) > 0.01]
    steps, errors = [4e-3, 2e-3, 1e-3], []
    at = motion.sample(t)
    for h in steps:
        before, after = motion.sample(t - h), motion.sample(t + h)
        error = 0.0
        for key in motion.coordinates:
            rate = (after.coordinates[key] - before.coordinates[key]) / (2 * h)
            second = (after.rates[key] - before.rates[key]) / (2 * h)
            error = max(
                error, np.abs(rate - at.rates[key]).max(), np.abs(second - at.second_rates[key]).max()
            )
        errors.append(error)
    assert order(errors, steps) == pytest.approx(2, abs=0.2)


# --- keyframes ---


def test_quintic_meets_keyframes_at_rest_ends_and_is_smooth() -> None:
    t = np.array([0.0, 0.5, 2.0, 2.5, 4.0])
    q = np.random.default_rng(4).normal(size=(5, 3))
    curve = quintic(t, q)
    assert curve(t) == pytest.approx(q, abs=1e-12)
    for nu in (1, 2):
        assert curve(t[[0, -1]], nu) == pytest.approx(np.zeros((2, 3)), abs=1e-11)
    for nu in range(5):
        before, after = curve(t[1:-1] - 1e-9, nu), curve(t[1:-1] + 1e-9, nu)
        assert before == pytest.approx(after, rel=1e-4, abs=1e-4)


def test_two_keyframes_make_the_minimum_jerk_polynomial() -> None:
    t, q = np.array([1.0, 3.0]), np.array([[-2.0], [5.0]])
    at = np.linspace(1, 3, 101)
    s = (at - 1) / 2
    expected = -2 + 7 * (10 * s**3 - 15 * s**4 + 6 * s**5)
    for curve in (quintic(t, q), minimum_jerk(t, q)):
        assert curve(at)[:, 0] == pytest.approx(expected, abs=1e-12)


def test_minimum_jerk_rests_at_every_keyframe() -> None:
    t = np.array([0.0, 0.5, 2.0])
    curve = minimum_jerk(t, np.array([[0.0], [1.0], [-1.0]]))
    for nu in (1, 2):
        assert curve(t, nu) == pytest.approx(np.zeros((3, 1)), abs=1e-11)


# --- motions ---


def test_sampling_at_the_samples_changes_nothing() -> None:
    for motion in all_curves().values():
        again = motion.sample(motion.time)
        for key in motion.coordinates:
            assert again.coordinates[key] == pytest.approx(motion.coordinates[key], abs=1e-12)
            assert again.second_rates[key] == pytest.approx(motion.second_rates[key], abs=1e-8)


def test_a_spline_is_known_from_its_samples() -> None:
    motions = all_curves()
    t = np.linspace(0, 3, 1000)
    with_curve, without = motions["through"].sample(t), motions["without curve"].sample(t)
    assert with_curve.second_rates["x"] == pytest.approx(without.second_rates["x"], abs=1e-7)


def test_sampling_keeps_the_rest() -> None:
    t = np.linspace(0, 1, 11)
    wrench = np.outer(t, [1, 2, 3, 4, 5, 6])
    motion = Motion.through(t, {"x": t}, set="a", name="b", branch=-1, wrench=wrench, wrench_axes="platform")
    again = motion.sample([0.25, 0.5])
    assert (again.set, again.name, again.branch, again.wrench_axes) == ("a", "b", -1, "platform")
    assert again.wrench is not None
    assert again.wrench[0] == pytest.approx(0.25 * np.arange(1, 7))


@pytest.mark.parametrize("time", [-0.1, 1.1, math.nan])
def test_sampling_outside(time: float) -> None:
    t = np.linspace(0, 1, 11)
    motion = Motion.through(t, {"x": t}, set="a")
    with pytest.raises(MotionError, match=f"time: is {time} s; the motion lasts from 0.0 s to 1.0 s"):
        motion.sample([0.5, time])


def test_a_motion_made_by_hand_is_checked() -> None:
    t = np.arange(3.0)
    q = {"x": np.zeros(3)}
    with pytest.raises(ShapeError, match=r"x has shape \(2,\)"):
        Motion("a", "a", t, {"x": np.zeros(2)}, q, q)
    with pytest.raises(ShapeError, match="same names"):
        Motion("a", "a", t, {"y": np.zeros(3)}, q, q)
    with pytest.raises(ShapeError, match=r"wrench has shape \(6,\); needs \(3, 6\)"):
        Motion("a", "a", t, q, q, q, wrench=np.zeros(6))
    with pytest.raises(MotionError, match="branch: is 0; needs 1 or -1"):
        Motion("a", "a", t, q, q, q, branch=0)
    with pytest.raises(MotionError, match=r"time: time is 0\.0 after 2\.0; it must increase"):
        Motion("a", "a", np.array([1.0, 2.0, 0.0]), q, q, q)
    with pytest.raises(MotionError, match="x: holds nan; needs finite numbers"):
        Motion.through(t, {"x": t * np.nan}, set="a")
    with pytest.raises(MotionError, match="too few samples, 1"):
        Motion.through([0], {"x": [0]}, set="a")
    with pytest.raises(ShapeError):
        Motion.through([0, 1], {"x": 0.0}, set="a")


# --- CSV ---


def test_csv_in_si(write: Write) -> None:
    t = np.linspace(0, 1, 21)
    path = write("wave.csv", "# a comment\n\n" + table(t, 100 * wave(t), 0 * t, 700 + t, 10 * wave(t), t))
    motion = load_motion(path, SETS)
    assert (motion.name, motion.set, motion.branch, motion.wrench) == ("wave", "paper", 1, None)
    assert tuple(motion.coordinates) == SETS["paper"]
    assert motion.time == pytest.approx(t)
    assert motion.coordinates["x"] == pytest.approx(0.1 * wave(t))
    assert motion.rates["alpha"] == pytest.approx(np.radians(10 * (3 * np.cos(3 * t) + 0.3)), abs=1e-5)
    assert load_motion(path, SETS, branch=-1).branch == -1


@pytest.mark.parametrize("name", SETS)
def test_csv_of_every_set_in_any_order(write: Write, name: str) -> None:
    units = {"a": "rad", "b": "rad", "g": "rad", "r": "rad"}
    columns = [f"{q} [{units.get(q[0], 'm')}]" if "axis" not in q else q for q in reversed(SETS[name])]
    header = ",".join([*columns, "time [ms]"])
    rows = "\n".join(",".join(map(str, [*range(len(columns)), 10 * i])) for i in range(8))
    motion = load_motion(write("a.csv", f"{header}\n{rows}\n"), SETS)
    assert motion.set == name
    assert tuple(motion.coordinates) == SETS[name]
    assert motion.time[1] == 0.01
    assert [q[0] for q in motion.coordinates.values()] == list(range(len(columns)))[::-1]


def test_csv_wrench(write: Write) -> None:
    t = np.linspace(0, 1, 7)
    header = HEADER + ", force_z [kN], torque_x [N mm], force_x [N]"
    path = write("a.csv", table(t, t, t, t, t, t, t, t, t, header=header))
    motion = load_motion(path, SETS, wrench_axes="platform")
    zero = 0 * t
    assert motion.wrench == pytest.approx(np.stack([t, zero, 1000 * t, t / 1000, zero, zero], axis=-1))
    assert motion.wrench_axes == "platform"


def test_csv_from_a_spreadsheet(write: Write) -> None:
    """Byte order mark, carriage returns, quoted headers, empty last lines."""
    text = table(np.arange(3.0), *np.ones((5, 3))).replace("x [mm]", '"x [mm]"').replace("\n", "\r\n")
    assert load_motion(write("a.csv", "\ufeff" + text + ",,,,,\r\n\r\n"), SETS).coordinates["x"][0] == 0.001


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("x [mm]", "x", ['line 1: column "x" has no unit; valid: m, mm, cm, um, in']),
        ("x [mm]", "x [km]", ['column "x [km]" has the unit "km"; ', "valid: m, mm, cm, um, in"]),
        ("alpha [deg]", "alpha [mm]", ['line 1: column "alpha [mm]" has the unit "mm"; valid: rad, deg']),
        ("beta [deg]", "beta [", ['line 1: column "beta [" must be a name and a unit, such as x [mm]']),
        ("time [s]", "time [h]", ['line 1: column "time [h]" has the unit "h"; valid: s, ms']),
        ("y [mm]", "x [mm]", ["line 1: column x stands there 2 times", "there is no y"]),
        (
            "beta [deg]",
            "betta [deg]",
            ['"betta [deg]" is unknown; did you mean "beta"? valid: time', "no beta"],
        ),
        ("beta", "gamma", ["nearest is paper (x, y, z, alpha, beta), but there is no beta, also gamma"]),
        ("time [s]", "axis_x [m]", ['has the unit "m"; it needs none', "no column time [s]", "also axis_x"]),
    ],
)
def test_csv_header(write: Write, old: str, new: str, expected: list[str]) -> None:
    path = write("a.csv", table(np.arange(8.0), *np.ones((5, 8))).replace(old, new))
    found = faults(path)
    for part in expected:
        assert any(part in fault for fault in found), found


def test_csv_of_numbers_alone_is_that_read_cell_by_cell(write: Write) -> None:
    """A comment among the rows makes every cell be looked at: the numbers are the same bits."""
    generator = np.random.default_rng(7)
    text = table(
        np.arange(50.0), *(generator.normal(size=(5, 50)) * 10.0 ** generator.integers(-9, 9, (5, 50)))
    )
    lines = text.splitlines()
    by_cell = "\n".join([*lines[:20], "# a comment", *lines[20:]])
    found = [load_motion(write("a.csv", t), SETS).curve.c for t in (text, by_cell)]  # type: ignore[union-attr]
    assert np.array_equal(*found)
    lines[30] = lines[30].replace(lines[30].split(",")[0], "5")
    assert faults(write("a.csv", "\n".join(lines))) == ["line 31: time is 5.0 after 28.0; it must increase"]


POSE = "time [s], x [m], y [m], z [m], rx [rad], ry [rad], rz [rad]"


@pytest.mark.parametrize(
    ("char", "name"), [(";", "semicolons"), ("\t", "tabs"), ("|", "bars"), (" ", "spaces")]
)
def test_csv_with_other_separators(write: Write, char: str, name: str) -> None:
    """One fault, which says what stands there, and that decimal commas will not do either."""
    header = POSE.replace(", ", char)
    text = f"{header}\n" + "\n".join(char.join((f"{t}", *["0,5"] * 6)) for t in range(3))
    assert faults(write("a.csv", text)) == [
        f"line 1: has {name} between its columns; needs commas there, and points in numbers, as in 0.5, 1.25"
    ]


@pytest.mark.parametrize(
    ("columns", "expected"),
    [
        (["roll [deg]", "pitch [deg]", "yaw [deg]"], 'from_euler("xyz", [roll, pitch, yaw]).as_euler("XYZ")'),
        (["Roll", "Pitch", "Yaw"], "R = Rz(yaw) Ry(pitch) Rx(roll)"),
        (["qw", "qx", "qy", "qz"], 'from_quat([x, y, z, w]).as_euler("XYZ")'),
        (["orientation.x", "orientation.y", "orientation.z", "orientation.w"], "a quaternion"),
    ],
)
def test_csv_with_other_numbers_of_a_rotation(write: Write, columns: list[str], expected: str) -> None:
    """One fault with all of them, the order of the rotation and the way to it."""
    header = ", ".join(["time [s]", "x [m]", "y [m]", "z [m]", *columns])
    rows = np.zeros((3 + len(columns), 3))
    (fault,) = faults(write("a.csv", table(np.arange(3.0), *rows, header=header)))
    names = ", ".join(column.partition(" ")[0] for column in columns)
    assert fault.startswith(f"line 1: {names}: ")
    assert "a rotation is given by rx, ry, rz, of R = Rx(rx) Ry(ry) Rz(rz)" in fault
    assert expected in fault
    assert "did you mean" not in fault


def test_the_ways_from_other_numbers_of_a_rotation_lead_to_the_pose() -> None:
    """What the faults tell to do makes the same matrix."""
    roll, pitch, yaw = 0.3, -0.5, 0.9
    x, y, z = (
        Rotation.from_euler(axis, angle).as_matrix()
        for axis, angle in zip("xyz", (roll, pitch, yaw), strict=True)
    )
    meant = z @ y @ x
    mech = pp.load("ups-hexapod")
    for rotation in (
        Rotation.from_euler("xyz", [roll, pitch, yaw]),
        Rotation.from_quat(Rotation.from_matrix(meant).as_quat()),
    ):
        rx, ry, rz = rotation.as_euler("XYZ")
        pose = mech.state({"x": 0.0, "y": 0.0, "z": 1.0, "rx": rx, "ry": ry, "rz": rz}).pose
        np.testing.assert_allclose(pose[:3, :3], meant, atol=1e-14)


@pytest.mark.parametrize(("unit", "seconds"), [("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)])
def test_csv_with_times_of_a_recorder(write: Write, unit: str, seconds: float) -> None:
    header = HEADER.replace("[s]", f"[{unit}]")
    text = table(np.arange(8.0), *np.ones((5, 8)), header=header)
    assert load_motion(write("a.csv", text), SETS).time[-1] == pytest.approx(7 * seconds, rel=1e-15)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("time [s]", "time [µs]", 'has the unit "µs"; did you mean "us"? valid: s, ms, us, ns'),
        ("time [s]", "time [seconds]", 'did you mean "s"?'),
        ("x [mm]", "x [Millimeters]", 'did you mean "mm"?'),
        ("beta [deg]", "beta [°]", 'did you mean "deg"?'),
        ("beta [deg]", "beta [grad]", 'has the unit "grad"; valid: rad, deg, mrad'),
        ("x [mm]", "x [nm]", 'has the unit "nm"; valid: m, mm, cm, um, in'),
    ],
)
def test_a_unit_is_proposed_if_it_is_the_same(write: Write, old: str, new: str, expected: str) -> None:
    """Not one that only looks alike: it would be wrong by a factor."""
    text = table(np.arange(8.0), *np.ones((5, 8))).replace(old, new)
    assert any(expected in fault for fault in faults(write("a.csv", text)))


def test_csv_rows_all_faults_at_once(write: Write) -> None:
    lines = table(np.arange(9.0), *np.ones((5, 9))).splitlines()
    lines[1] = "0,1,1,one,1,1"
    lines[2] = "1,1,1,nan,,1"
    lines[3] = "2,1,1,1,1"
    lines[4] = "3,1,1,1,1,1,1"
    lines[5] = "# a comment counts as a line"
    lines[6] = "1,1,1,1,1,1"
    lines[7] = "inf,1,1,1,1,1"
    lines[8] = "0.5,1,1,1,1,-inf"
    assert faults(write("a.csv", "\n".join(lines))) == [
        'line 2: column z is "one"; needs a finite number',
        'line 3: column z is "nan"; needs a finite number',
        'line 3: column alpha is ""; needs a finite number',
        "line 4: has 5 cells; the header has 6",
        "line 5: has 7 cells; the header has 6",
        'line 8: column time is "inf"; needs a finite number',
        'line 9: column beta is "-inf"; needs a finite number',
        "line 7: time is 1.0 after 1.0; it must increase",
        "line 9: time is 0.5 after 1.0; it must increase",
    ]


def test_csv_header_and_rows_at_once(write: Write) -> None:
    text = table(np.array([0.0, 1.0, 1.0]), *np.ones((5, 3))).replace("x [mm]", "x").replace("alpha", "alhpa")
    assert len(faults(write("a.csv", text))) == 4


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "file: is empty; needs a header such as time [s], x [mm], ... and two samples or more"),
        (HEADER, "file: has too few samples, 0; needs two or more"),
        (HEADER + "\n0,1,2,3,4,5\n", "file: has too few samples, 1; needs two or more"),
    ],
)
def test_csv_without_samples(write: Write, text: str, expected: str) -> None:
    assert faults(write("a.csv", text)) == [expected]


# --- TOML ---

KEYFRAMES: dict[str, Any] = {
    "motion": {"coordinates": "paper", "branch": -1, "samples": 101},
    "units": {"time": "s", "length": "mm", "angle": "deg"},
    "keyframes": [
        {"time": 0.0, "x": 0, "y": 1, "z": 740, "alpha": 0, "beta": 0},
        {"time": 1.0, "x": 10, "y": 1, "z": 740, "alpha": 5, "beta": 2.5},
        {"time": 3, "x": 0, "y": 1, "z": 750, "alpha": 0, "beta": 0},
    ],
}


@pytest.fixture
def keyframes() -> dict[str, Any]:
    return copy.deepcopy(KEYFRAMES)


@pytest.mark.parametrize("spline", ["quintic", "minimum-jerk"])
def test_toml(write: Write, keyframes: dict[str, Any], spline: str) -> None:
    keyframes["motion"]["spline"] = spline
    motion = load_motion(write("hop.toml", tomli_w.dumps(keyframes)), SETS)
    assert (motion.name, motion.set, motion.branch, motion.wrench) == ("hop", "paper", -1, None)
    assert motion.time == pytest.approx(np.linspace(0, 3, 101))
    at = motion.sample([0, 1, 3])
    assert at.coordinates["x"] == pytest.approx([0, 0.01, 0], abs=1e-15)
    assert at.coordinates["beta"] == pytest.approx(np.radians([0, 2.5, 0]), abs=1e-14)
    assert motion.rates["z"][[0, -1]] == pytest.approx([0, 0], abs=1e-14)
    assert (abs(at.rates["z"][1]) < 1e-12) == (spline == "minimum-jerk")
    assert load_motion(write("hop.toml", tomli_w.dumps(keyframes)), SETS, branch=1).branch == 1


def test_toml_wrench(write: Write, keyframes: dict[str, Any]) -> None:
    keyframes["units"] |= {"force": "kN", "torque": "N m"}
    keyframes["wrench"] = {"force": [0, 0, 1], "axes": "platform"}
    keyframes["keyframes"][1] |= {"force": [0, 0, 2], "torque": [3, 0, 0]}
    motion = load_motion(write("a.toml", tomli_w.dumps(keyframes)), SETS)
    assert motion.wrench_axes == "platform"
    at = motion.sample([0, 0.5, 1, 2, 3]).wrench
    assert at is not None
    assert at[:, 2] == pytest.approx([1000, 1500, 2000, 1500, 1000], abs=20)  # linear between samples
    assert at[:, 3] == pytest.approx([0, 1.5, 3, 1.5, 0], abs=0.06)


@pytest.mark.parametrize(
    ("path", "value", "expected"),
    [
        (("motion", "coordinates"), "papper", 'no coordinate set of the mechanism; did you mean "paper"?'),
        (("motion", "spline"), "cubic", 'motion.spline: is "cubic"; needs "quintic" or "minimum-jerk"'),
        (("motion", "branch"), 2, "motion.branch: is 2; needs 1 or -1"),
        (("motion", "samples"), 1, "motion.samples: is 1; needs at least 2"),
        (("motion", "sample"), 1, 'motion.sample: is no key here; did you mean "samples"?'),
        (("motion",), {}, "motion.coordinates: is missing"),
        (("units", "length"), "mile", 'units.length: is "mile"; valid: m, mm'),
        (("units", "tim"), "s", 'units.tim: is no kind of quantity here; did you mean "time"?'),
        (("units",), {"time": "s", "angle": "deg"}, "units.length: is missing; valid: m, mm"),
        (("wrench",), {"force": [1, 2, 3]}, "units.force: is missing; valid: N"),
        (("wrench",), {"force": [1, 2]}, "wrench.force: is [1, 2]; needs [x, y, z]"),
        (("keyframe",), [], 'keyframe: is no key here; did you mean "keyframes"?'),
        (("keyframes",), [{}], "keyframes: needs two tables [[keyframes]] or more"),
        (("keyframes", 1), 3, "keyframes.2: is 3; needs a table with time, x, y, z, alpha, beta"),
        (("keyframes", 1), {"time": 1}, "keyframes.2.beta: is missing; needed here: time, x, y, z"),
        (("keyframes", 1, "time"), 0, "keyframes.2.time: time is 0.0 after 0.0; it must increase"),
        (("keyframes", 1, "x"), "a", 'keyframes.2.x: is "a"; needs a finite number'),
        (("keyframes", 1, "x"), math.nan, "keyframes.2.x: is NaN; needs a finite number"),
        (("keyframes", 2, "alhpa"), 1, 'keyframes.3.alhpa: is no key here; did you mean "alpha"?'),
        (("keyframes", 2, "force"), [1], "keyframes.3.force: is [1]; needs [x, y, z]"),
    ],
)
def test_toml_faults(
    write: Write, keyframes: dict[str, Any], path: tuple[Any, ...], value: object, expected: str
) -> None:
    target: Any = keyframes
    for key in path[:-1]:
        target = target[key]
    target[path[-1]] = value
    found = [
        re.sub(r" \(line \d+\)", "", fault) for fault in faults(write("a.toml", tomli_w.dumps(keyframes)))
    ]
    assert any(expected in fault for fault in found), found


LINES = """\
[motion]
coordinates = "paper"
spline = "cubic"
[units]
time = "s"
length = "mile"
angle = "deg"
[[keyframes]]
time = 0
x = 0
y = 0
z = 0
alpha = 0
beta = 0
[[keyframes]]
time = 1
x = 0
y = "b"
z = 0
alpha = 0
beta = 0
gama = 3
"""


def test_toml_faults_have_their_lines_and_each_is_one(write: Write) -> None:
    assert [fault.partition(": ")[0] for fault in faults(write("a.toml", LINES))] == [
        "units.length (line 6)",
        "motion.spline (line 3)",
        "keyframes.2.y (line 18)",
        "keyframes.2.gama (line 22)",
    ]


@pytest.mark.parametrize(
    ("old", "expected"),
    [
        (
            "[[keyframes]]",
            "toml (line 15): [keyframes] stands there twice; a list of tables has two brackets, "
            "[[keyframes]]",
        ),
        (
            "[[keyframes]]\ntime = 0",
            "keyframes (line 8): is a table, [keyframes]; needs two tables [[keyframes]] or more",
        ),
    ],
)
def test_toml_with_single_brackets(write: Write, old: str, expected: str) -> None:
    text = LINES.replace(old, old.replace("[[", "[").replace("]]", "]"))
    if "time" in old:
        text = text[: text.index("[[keyframes]]")]
    assert expected in faults(write("a.toml", text))


def test_toml_all_faults_at_once(write: Write, keyframes: dict[str, Any]) -> None:
    keyframes["motion"]["spline"] = "cubic"
    keyframes["units"]["length"] = "mile"
    keyframes["keyframes"][0]["x"] = "a"
    del keyframes["keyframes"][2]["y"]
    assert [fault.split(" ")[0] for fault in faults(write("a.toml", tomli_w.dumps(keyframes)))] == [
        "units.length",
        "motion.spline",
        "keyframes.1.x",
        "keyframes.3.y",
    ]


# --- files that are none ---


def test_files_that_cannot_be_read(write: Write, tmp_path: Path) -> None:
    assert faults(tmp_path / "none.csv") == ["file: does not exist"]
    assert "line 1" in faults(write("a.toml", "= 3"))[0]
    (tmp_path / "b.csv").write_bytes(b"\xff\xfe\x00")
    assert faults(tmp_path / "b.csv")[0].startswith("file: is not UTF-8 text: 'utf-8'")
    (tmp_path / "c.csv").mkdir()
    assert faults(tmp_path / "c.csv")[0].startswith("file: cannot be read")


def test_an_unknown_built_in_name() -> None:
    with pytest.raises(
        UnknownNameError, match=r'there is no built-in motion \(nor a .csv or .toml file\) "nothing"; '
    ):
        load_motion("nothing", SETS)
