"""The mechanism file: what it becomes in SI, and every fault of its form named at once."""

import copy
import json
import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from polypod.errors import Fault, MechanismError, UnknownNameError, alternatives
from polypod.files.mechanism_spec import read_spec
from polypod.files.units import MECHANISM_KINDS, UNITS, cos_sin, from_si, si_unit, to_si
from support import DATA, ROOT

BUILT_IN = ROOT / "python/polypod/mechanisms"
X = [1.0, 0.0, 0.0]
ON_ROD = {"joint": "R", "rod": "L"}
FILES = [*BUILT_IN.glob("*.toml"), *DATA.glob("*.toml")]


def load(path: Path) -> dict[str, Any]:
    return tomllib.loads(path.read_text(encoding="utf-8"))


@pytest.fixture
def paper() -> dict[str, Any]:
    return load(BUILT_IN / "lu-3spu-2rpu-r.toml")


def places(data: dict[str, Any]) -> list[str]:
    return [fault.place for fault in read_spec(data)[1]]


def message(data: dict[str, Any], place: str) -> str:
    found = [fault.message for fault in read_spec(data)[1] if fault.place == place]
    assert len(found) == 1, read_spec(data)[1]
    return found[0]


def leg_lengths(spec: dict[str, Any]) -> list[float]:
    """At a home pose without rotation, m."""
    assert spec["home"]["rotation_vector"] == [0, 0, 0]
    o = np.array(spec["home"]["position"])
    return [math.dist(o + leg["platform"]["point"], leg["base"]["point"]) for leg in spec["legs"]]


# --- sound files --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_files_of_the_project_are_sound(path: Path) -> None:
    data = load(path)
    before = copy.deepcopy(data)
    spec, faults = read_spec(data)
    assert faults == []
    assert data == before
    assert spec["name"] == path.stem
    assert json.loads(json.dumps(spec)) == spec


@pytest.mark.parametrize(
    "path",
    [BUILT_IN / "lu-3spu-2rpu-r.toml", BUILT_IN / "ups-hexapod.toml", *DATA.glob("*.toml")],
    ids=lambda path: path.stem,
)
def test_strokes_begin_and_end_about_home(path: Path) -> None:
    spec, _ = read_spec(load(path))
    for length, leg in zip(leg_lengths(spec), spec["legs"], strict=True):
        low, high = leg["stroke"]
        assert abs(length - (low + high) / 2) < 0.15 * (high - low)


def test_paper_in_si(paper: dict[str, Any]) -> None:
    spec, _ = read_spec(paper)
    one, two, three = spec["legs"][:3]
    assert [leg["name"] for leg in spec["legs"]] == list("12345")
    assert [leg["base"]["joint"] for leg in spec["legs"]] == list("RSRSS")
    assert [leg["base"]["rod"] for leg in spec["legs"]] == [0, None, 0, None, None]
    assert one["stroke"] == [0.65, 0.85]
    assert one["platform"]["axis"] == [1, 0, 0]
    assert two["base"]["point"] == [0, 0.265, 0]
    assert two["platform"]["axis"] == [0, -1, 0]
    assert one["base"]["point"][0] == -three["base"]["point"][0]
    assert one["base"]["point"][1] == three["base"]["point"][1] == spec["rods"][0]["point"][1]
    assert one["base"]["point"] == pytest.approx(
        [0.27 * math.cos(math.pi / 10), 0.27 * math.sin(math.pi / 10), 0]
    )
    assert one["cylinder"]["center"] == [0, 0.05, 0]
    assert one["piston"]["center"] == [0, -0.1, 0]
    assert two["piston"]["center"] == [0, -0.098, 0]
    assert spec["platform"]["inertia"] == [[5, 0, 0], [0, 5, 0], [0, 0, 5]]
    assert spec["load"] == {"force": [10, 10, 500], "torque": [0, 0, 1000], "axes": "base"}
    assert spec["home"]["position"][1] == pytest.approx(0.12 * math.sin(math.pi / 10), abs=1e-17)
    assert np.mean(leg_lengths(spec)) == pytest.approx(0.75, abs=1e-4)


def test_defaults() -> None:
    spec, _ = read_spec(load(DATA / "3-rps.toml"))
    assert spec["gravity"] == [0, 0, -9.81]
    assert (spec["efficiency"], spec["linear_damping"], spec["angular_damping"]) == (1, 0, 0)
    assert spec["load"] == {"force": [0, 0, 0], "torque": [0, 0, 0], "axes": "base"}
    assert spec["tool"] == {"point": [0, 0, 0], "axis": [0, 0, 1]}
    assert [leg["name"] for leg in spec["legs"]] == ["1", "2", "3"]
    assert all(leg["actuated"] for leg in spec["legs"])
    assert spec["legs"][0]["platform"]["cone"] == {"angle": math.radians(40), "axis": None}


def test_vectors_and_matrices_in_bodies(paper: dict[str, Any]) -> None:
    inertia = [[2, 0.5, 0], [0.5, 3, 0], [0, 0, 4]]
    paper["legs"][0]["cylinder"] = {"mass": 1, "center": [1, 2, 3], "inertia": inertia}
    paper["legs"][0]["piston"]["inertia"] = [1, 2, 3]
    paper["units"]["inertia"] = "kg mm^2"
    leg = read_spec(paper)[0]["legs"][0]
    assert leg["cylinder"]["center"] == [0.001, 0.002, 0.003]
    assert leg["cylinder"]["inertia"] == [[2e-6, 5e-7, 0], [5e-7, 3e-6, 0], [0, 0, 4e-6]]
    assert leg["piston"]["inertia"] == [[1e-6, 0, 0], [0, 2e-6, 0], [0, 0, 3e-6]]


# --- units --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "kind", "unit", "si"),
    [
        (270.0, "length", "mm", 0.27),
        (83.4, "length", "mm", 0.0834),
        (1.0, "length", "in", 0.0254),
        (180.0, "angle", "deg", math.pi),
        (1.0, "mass", "lb", 0.45359237),
        (5e9, "inertia", "g mm^2", 5.0),
        (3.0, "force", "kN", 3000.0),
        (1500.0, "torque", "N mm", 1.5),
        (-9810.0, "acceleration", "mm/s^2", -9.81),
        (20.0, "time", "ms", 0.02),
    ],
)
def test_conversion_is_exact(value: float, kind: str, unit: str, si: float) -> None:
    assert to_si(value, kind, unit) == si
    assert from_si(si, kind, unit) == pytest.approx(value, rel=1e-15)
    assert to_si(np.array([value]), kind, unit).tolist() == [si]


def test_si_units_change_nothing() -> None:
    for kind in UNITS:
        assert to_si(0.1, kind, si_unit(kind)) == 0.1


def test_unknown_unit() -> None:
    with pytest.raises(
        UnknownNameError, match='there is no unit of length "mmm"; did you mean "mm"\\? valid: m, mm'
    ):
        to_si(1.0, "length", "mmm")


def test_cosines_are_exact_and_symmetric() -> None:
    assert [cos_sin(90.0 * k, "deg") for k in range(-1, 4)] == [(0, -1), (1, 0), (0, 1), (-1, 0), (0, -1)]
    for degrees in np.linspace(-720, 720, 97).tolist():
        angle = math.radians(degrees)
        assert cos_sin(degrees, "deg") == pytest.approx((math.cos(angle), math.sin(angle)), abs=2e-15)
        assert cos_sin(angle, "rad") == (math.cos(angle), math.sin(angle))
        c, s = cos_sin(degrees, "deg")
        assert cos_sin(180 - degrees, "deg") == (-c, s)
        assert cos_sin(-degrees, "deg") == (c, -s)


def test_wrong_unit_is_named_and_si_assumed(paper: dict[str, Any]) -> None:
    paper["units"]["length"] = "furlong"
    assert message(paper, "units.length") == 'is "furlong"; valid: m, mm, cm, um, in'
    assert read_spec(paper)[0]["legs"][0]["stroke"] == [650, 850]


def test_every_missing_unit_is_named() -> None:
    paper = load(BUILT_IN / "lu-3spu-2rpu-r.toml")
    del paper["units"]
    assert places(paper) == [f"units.{kind}" for kind in MECHANISM_KINDS]
    assert "mm" in message(paper, "units.length")


def test_units_are_needed_only_where_used() -> None:
    data = load(DATA / "3-rps.toml")
    assert "force" not in data["units"]
    data["load"] = {"torque": [0, 0, 1]}
    assert places(data) == ["units.torque"]


@pytest.mark.parametrize("value", [3, ["mm"], None, {"a": 1}])
def test_a_unit_that_is_no_text(paper: dict[str, Any], value: object) -> None:
    paper["units"]["length"] = value
    assert places(paper) == ["units.length"]
    paper["units"] = value
    assert "units" in places(paper)[0]


# --- faults -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("path", "value", "expected"),
    [
        ("name", 3, "is 3; needs text in quotes"),
        ("home.position", [1, 2], "is [1, 2]; needs [x, y, z]"),
        ("home.position.2", "a", 'is "a"; needs a finite number'),
        ("home.position.3", float("nan"), "is NaN; needs a finite number"),
        ("dynamics.efficiency", float("inf"), "is Infinity; needs a finite number"),
        ("dynamics.gravity", 9.81, "is 9.81; needs [x, y, z]"),
        ("dynamics.linear_damping", True, "is true; needs a finite number"),
        ("load.axes", "tool", 'is "tool"; needs "base" or "platform"'),
        ("tool.axis", "z", 'is "z"; needs [x, y, z] or { angle, z }'),
        ("published.dof", 5.5, "is 5.5; needs a whole number"),
        ("platform.mass", "3 kg", 'is "3 kg"; needs a finite number'),
        ("platform", 3, "is 3; needs a table with mass, center, inertia"),
        ("platform.inertia", [1, 2], "is [1, 2]; needs a number, [Ixx, Iyy, Izz] or three rows of three"),
        ("rods.1.name", 1, "is 1; needs text in quotes"),
        ("rods.1.point", {"radius": 1}, None),
        ("legs.3.actuated", "yes", 'is "yes"; needs true or false'),
        ("legs.3.stroke", [650, 850], "is [650, 850]; needs a table with min, max"),
        ("legs.3.base.joint", "X", 'is "X"; needs "S", "U", "R" or "F"'),
        ("legs.3.base.rod", "l", 'is "l", no rod\'s name; valid: L'),
        ("legs.3.cylinder.mass", None, "is null; needs a finite number"),
        ("legs.3", 3, "is 3; needs a table with base, platform"),
        ("legs", 3, "is 3; needs one table [[legs]] for each"),
        ("rods", {"name": "L"}, "is a table; needs one table [[rods]] for each"),
    ],
)
def test_a_wrong_value_is_shown_with_what_is_needed(
    paper: dict[str, Any], path: str, value: object, expected: str | None
) -> None:
    target: Any = paper
    *parents, last = [int(key) - 1 if key.isdigit() else key for key in path.split(".")]
    for key in parents:
        target = target[key]
    target[last] = value
    if expected is None:
        assert places(paper) == [f"{path}.angle"]
    else:
        assert message(paper, path) == expected


@pytest.mark.parametrize(
    ("path", "wrong", "right"),
    [
        ((), "plattform", "platform"),
        (("units",), "lenght", "length"),
        (("dynamics",), "gravitiy", "gravity"),
        (("load",), "forces", "force"),
        (("platform",), "inertias", "inertia"),
        (("rods", 0), "axes", "axis"),
        (("legs", 1), "strokes", "stroke"),
        (("legs", 1, "stroke"), "mx", "max"),
        (("legs", 1, "base"), "joints", "joint"),
        (("legs", 1, "base", "point"), "angel", "angle"),
        (("legs", 1, "piston"), "centre", "center"),
    ],
)
def test_an_unknown_key_is_named_and_the_rest_used(
    paper: dict[str, Any], path: tuple[Any, ...], wrong: str, right: str
) -> None:
    sound, _ = read_spec(paper)
    target: Any = paper
    for key in path:
        target = target[key]
    target[wrong] = 1
    spec, [fault] = read_spec(paper)
    assert fault.place == ".".join(str(k + 1) if isinstance(k, int) else k for k in (*path, wrong))
    assert f'did you mean "{right}"? valid: ' in fault.message
    assert spec == sound


@pytest.mark.parametrize(
    ("side", "joint", "expected"),
    [
        ("base", {"joint": "S", "axis": X}, {"axis": "must not be given; a S joint has none"}),
        ("base", {"joint": "U"}, {"axis": "is missing; a U joint needs it"}),
        ("base", {"joint": "R"}, {"axis": "is missing; a R joint needs it"}),
        ("base", {"joint": "F", "normal": X}, {"axis": "is missing; a F joint needs it"}),
        ("base", {"joint": "F", "axis": X}, {"normal": "is missing; a F joint needs it"}),
        ("base", {"joint": "U", "axis": X, "normal": X}, {"normal": "must not be given; a U joint has none"}),
        ("base", ON_ROD | {"axis": X}, {"axis": "must not be given; R on a rod takes it from the rod"}),
        ("base", ON_ROD | {"joint": "U", "axis": X}, {"joint": "is U; on a rod it must be R"}),
        ("platform", ON_ROD | {"axis": X}, {"rod": "a rod carries base joints only"}),
        ("platform", {"joint": "F", "axis": X, "normal": {"angle": 90}}, {}),
        ("base", ON_ROD, {}),
    ],
)
def test_what_a_joint_has(
    paper: dict[str, Any], side: str, joint: dict[str, Any], expected: dict[str, str]
) -> None:
    paper["legs"][1][side] = {"point": [100, 0, 0]} | joint
    spec, faults = read_spec(paper)
    assert {fault.place: fault.message for fault in faults} == {
        f"legs.2.{side}.{k}": m for k, m in expected.items()
    }
    assert spec["legs"][1] is not None


def test_a_rod_has_a_whole_body_or_none(paper: dict[str, Any]) -> None:
    del paper["rods"][0]["mass"]
    assert message(paper, "rods.1.mass") == "is missing; a body needs mass, center, inertia"
    for key in ("center", "inertia"):
        del paper["rods"][0][key]
    spec, faults = read_spec(paper)
    assert faults == []
    assert spec["rods"][0]["body"] is None


def test_parts_that_cannot_be_read_leave_the_others(paper: dict[str, Any]) -> None:
    del paper["home"]
    paper["legs"][0]["base"]["point"] = "here"
    paper["legs"][1]["cylinder"]["mass"] = "heavy"
    paper["legs"][1]["stroke"]["max"] = -1  # for the core to find
    paper["legs"].append({})
    spec, faults = read_spec(paper)
    assert [fault.place for fault in faults] == [
        "home",
        "legs.1.base.point",
        "legs.2.cylinder.mass",
        "legs.6.base",
        "legs.6.platform",
    ]
    assert spec["home"] is None
    assert [leg is None for leg in spec["legs"]] == [True, False, False, False, False, True]
    assert spec["legs"][1]["cylinder"] is None
    assert spec["legs"][1]["stroke"] == [0.65, -0.001]


def test_an_empty_file() -> None:
    assert places({}) == ["name", "home"]


def test_nothing_but_wrong_sections() -> None:
    keys = ("units", "dynamics", "load", "home", "tool", "published", "platform", "rods", "legs")
    assert set(places({"name": "a"} | dict.fromkeys(keys, 3))) == set(keys)


# --- errors -------------------------------------------------------------------------------------------------


def test_an_error_lists_each_fault_once() -> None:
    faults = [Fault("legs.1", "is 3"), Fault("home", "is missing"), Fault("legs.1", "is 3")]
    error = MechanismError(faults, "a.toml")
    assert error.faults == tuple(faults[:2])
    assert str(error) == "a.toml has 2 faults:\n  legs.1: is 3\n  home: is missing"
    assert str(MechanismError(faults[:1])) == "the mechanism has 1 fault:\n  legs.1: is 3"


def test_alternatives() -> None:
    assert alternatives("mas", ["mass", "center"]) == 'did you mean "mass"? valid: mass, center'
    assert alternatives("q", ["mass", "center"]) == "valid: mass, center"
    assert alternatives("q", []) == "valid: none"
