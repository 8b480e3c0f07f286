"""Mechanisms from files: bad ones refused with place and reason, good ones kept whole; mobility by ranks."""

import json
import math
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

import polypod as pp
from polypod.errors import MechanismError, UnknownNameError
from polypod.files.units import from_si, in_units, to_si
from support.mechanism_files import (
    BUILT_IN,
    DELETED,
    FILES,
    GOUGH,
    MIDDLE,
    PAPER,
    RPS,
    SI_UNITS,
    TABLES,
    UP,
    changed,
)

UNIT_ROUNDING = 1e-15  # m, of points about 1 m away: a few roundings, of sine and cosine and of the unit


def faults_of(tables: dict[str, Any]) -> list[tuple[str, str]]:
    with pytest.raises(MechanismError) as caught:
        pp.Mechanism.from_dict(tables)
    return [(fault.place, fault.message) for fault in caught.value.faults]


FIXED = {"joint": "F", "point": [300.0, 0.0, 0.0], "axis": [0, 0, 1], "normal": [1, 0, 0]}
SQUARE = {"joint": "U", "point": {"radius": 150.0, "angle": 0.0}, "axis": [0.0, 1.0, 0.5]}

# Name of the case: file, changes, place of the one fault, telling part of its message.
BAD: dict[str, tuple[str, dict[str, Any], str, str]] = {
    "unknown key": (PAPER, {"legs__2__strok": 1}, "legs.2.strok", 'did you mean "stroke"'),
    "unknown key at the top": (PAPER, {"plattform": 1}, "plattform", 'did you mean "platform"'),
    "missing unit": (PAPER, {"units__mass": DELETED}, "units.mass", "is missing; valid: kg, g, lb"),
    "missing unit of angles": (
        PAPER,
        {"units__angle": DELETED},
        "units.angle",
        "is missing; valid: rad, deg",
    ),
    "wrong unit": (PAPER, {"units__length": "N"}, "units.length", 'is "N"; valid: m, mm, cm'),
    "wrong unit of angles": (PAPER, {"units__angle": "grad"}, "units.angle", 'is "grad"; valid: rad, deg'),
    "negative mass": (PAPER, {"platform__mass": -3.0}, "platform.mass", "is -3 kg; must be positive"),
    "no mass": (PAPER, {"legs__2__piston__mass": 0}, "legs.2.piston.mass", "is 0 kg; must be positive"),
    "indefinite inertia": (
        PAPER,
        {"legs__2__piston__inertia": [[1, 2, 0], [2, 1, 0], [0, 0, 1]]},
        "legs.2.piston.inertia",
        "is not positive definite: its principal moments are [-1.0",
    ),
    "negative inertia": (PAPER, {"platform__inertia": -5.0}, "platform.inertia", "is not positive definite"),
    "inertia of no body": (PAPER, {"rods__1__inertia": [1, 1, 2.1]}, "rods.1.inertia", "belongs to no body"),
    "skew inertia": (
        PAPER,
        {"legs__1__cylinder__inertia": [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]},
        "legs.1.cylinder.inertia",
        "is not symmetric",
    ),
    "lopsided free leg": (
        GOUGH,
        {
            "legs__1__base": {"joint": "S", "point": [500.0, 0.0, 0.0]},
            "legs__1__piston__inertia": [1, 2, 2.5],
        },
        "legs.1.piston",
        "spins freely, so its bodies must be symmetric",
    ),
    "stroke upside down": (
        PAPER,
        {"legs__3__stroke": {"min": 850.0, "max": 650.0}},
        "legs.3.stroke",
        "min is 850 mm, max is 650 mm",
    ),
    "no stroke at all": (PAPER, {"legs__3__stroke__max": 650.0}, "legs.3.stroke", "needs 0 <= min < max"),
    "negative stroke": (PAPER, {"legs__3__stroke__min": -1.0}, "legs.3.stroke", "needs 0 <= min < max"),
    "negative radius": (GOUGH, {"legs__3__radius": -25.0}, "legs.3.radius", "must be positive"),
    "a leg without length": (
        PAPER,
        {"legs__2__base__point": [0.0, 187.0820393249937, 740.0]},
        "legs.2",
        "coincide at the home pose",
    ),
    "a leg twice": (
        GOUGH,
        {"legs__2": TABLES[GOUGH]["legs"][0]},
        "legs.2",
        "coincide with those of legs.1",
    ),
    "no direction of a U joint": (
        PAPER,
        {"legs__2__platform__axis": [0, 0, 0]},
        "legs.2.platform.axis",
        "is zero",
    ),
    "no direction of a rod": (PAPER, {"rods__1__axis": [0, 0, 0]}, "rods.1.axis", "is zero"),
    "no direction of the tool": (PAPER, {"tool__axis": [0, 0, 0]}, "tool.axis", "is zero"),
    "R joint not perpendicular to its leg": (
        RPS,
        {"legs__1__base__axis": [1, 1, 0]},
        "legs.1.base.axis",
        "makes 97.9712 degrees with the leg at the home pose; the axis of an R joint must be perpendicular "
        "to it",
    ),
    "U joint's axis along its leg": (
        GOUGH,
        {"legs__1__base": UP, "legs__1__platform__point": MIDDLE},
        "legs.1.base.axis",
        "the axis of a U joint (or its rod) must not lie along it",
    ),
    "F joint's axis not along its leg": (
        GOUGH,
        {"legs__1__platform": FIXED},
        "legs.1.platform.axis",
        "makes 19.3825 degrees with the leg at the home pose; the axis of an F joint must point along it",
    ),
    "F joint's normal not perpendicular to its axis": (
        GOUGH,
        {"legs__1__base": UP | {"joint": "F", "normal": [1, 0, 1]}, "legs__1__platform__point": MIDDLE},
        "legs.1.base.normal",
        "must be perpendicular to the axis",
    ),
    "UPU leg's axes out of plane": (
        GOUGH,
        {"legs__1__platform": {"joint": "U", "point": [300.0, 0.0, 0.0], "axis": [1, 2, 3]}},
        "home",
        'leg "1" (UPU) by 140.3 mm: the leg, its axis in the base and its axis in the platform must lie in',
    ),
    "RPU leg's axes not square": (
        RPS,
        {"legs__1__platform": SQUARE},
        "home",
        "its axis in the base must be perpendicular to its axis in the platform",
    ),
    "a leg off its rod": (
        PAPER,
        {"legs__3__base__point": [-200.0, 80.0, 0.0]},
        "legs.3.base.point",
        'lies 3.435 mm off the line of rod "L"',
    ),
    "a rod without legs": (
        PAPER,
        {"rods__2": {"name": "M", "point": [0.0, 0.0, 0.0], "axis": [1, 0, 0]}},
        "rods.2",
        "carries no leg",
    ),
    "too few actuators": (
        PAPER,
        {"legs__5__actuated": False},
        "legs",
        "4 actuated legs for 5 degrees of freedom; at least 5",
    ),
    "not a number": (PAPER, {"legs__4__piston__mass": math.nan}, "legs.4.piston.mass", "is NaN"),
    "not a number in a point": (
        PAPER,
        {"legs__4__base__point__radius": math.nan},
        "legs.4.base.point.radius",
        "is NaN; needs a finite number",
    ),
    "infinity": (PAPER, {"dynamics__gravity": [0, 0, math.inf]}, "dynamics.gravity.3", "is Infinity"),
    "infinite stroke": (PAPER, {"legs__4__stroke__max": math.inf}, "legs.4.stroke.max", "is Infinity"),
    "one name for two legs": (PAPER, {"legs__2__name": "1"}, "legs.2.name", 'is "1", the name of legs.1'),
    "no home": (PAPER, {"home": DELETED}, "home", "is missing; needs the centre pose"),
    "efficiency above 1": (
        PAPER,
        {"dynamics__efficiency": 1.1},
        "dynamics.efficiency",
        "above 0 and at most 1",
    ),
    "negative damping": (
        PAPER,
        {"dynamics__linear_damping": -1},
        "dynamics.linear_damping",
        "zero or positive",
    ),
    "cone of no angle": (RPS, {"legs__1__platform__cone__angle": 0}, "legs.1.platform.cone.angle", "above 0"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_refused_with_its_place_and_nothing_else(case: str, tmp_path: Path) -> None:
    name, changes, place, message = BAD[case]
    tables = changed(name, **changes)
    [fault] = faults_of(tables)
    assert fault[0] == place
    assert message in fault[1]
    path = tmp_path / "bad.toml"
    path.write_text(tomli_w.dumps(tables), encoding="utf-8")
    with pytest.raises(MechanismError, match=r"bad\.toml has 1 fault:\n") as caught:
        pp.load(path)
    assert re.search(rf"\n  {re.escape(place)}( \(line \d+\))?: ", str(caught.value))
    assert [(f.place, f.message) for f in caught.value.faults] == [fault]


def test_home_off_the_constraints_names_legs_and_a_pose_nearby() -> None:
    faults = faults_of(changed(PAPER, home__rotation_vector=[0.0, 0.0, 3.0]))
    assert [place for place, _ in faults] == ["home", "home"]
    for leg, (_, message) in zip("13", faults, strict=True):
        assert f'misses the constraint of leg "{leg}" (RPU) by 7.861 mm' in message
        found = re.search(
            r"satisfies all constraints has position (.*) mm and rotation_vector (.*) deg", message
        )
        assert found, message
        position, turn = (np.array(json.loads(group)) for group in found.groups())
        nearby = changed(
            PAPER,
            home__position=position.tolist(),
            home__rotation_vector=turn.tolist(),
        )
        assert pp.Mechanism.from_dict(nearby).dof == 5


@pytest.mark.parametrize(
    ("units", "text", "told"),
    [
        ({"length": "mm"}, "lies 0.003435 m off", "lies 3.435 mm off"),
        ({"length": "in"}, "is 1.079e-1 m long", "is 4.248 in long"),
        (
            {"length": "mm", "angle": "deg"},
            "at [0.1, -2.5] m, 3.14159 rad",
            "at [100, -2500] mm, 180.000 deg",
        ),
        ({"length": "mm"}, 'leg "5 m" is 5 m', 'leg "5 m" is 5000 mm'),
        ({"length": "mm", "mass": "g"}, "1 kg, 2 kg m^2, 3 m/s, 4 N m", "1000 g, 2 kg m^2, 3 m/s, 4 N m"),
        (
            {"length": "mm"},
            "through (0, 0.5, -0.12) m along (0, 0, 1)",
            "through (0, 500, -120) mm along (0, 0, 1)",
        ),
        ({"length": "ell"}, "is 5 m", "is 5 m"),
        (["length"], "is 5 m", "is 5 m"),
    ],
)
def test_messages_of_the_core_are_in_units_of_the_file(units, text, told) -> None:
    assert in_units(text, units) == told


def test_many_different_faults_are_reported_at_once() -> None:
    tables = changed(
        PAPER,
        legs__1__colour="red",
        units__force="kg",
        platform__mass=-3.0,
        rods__1__inertia=[1, 1, 3],
        legs__2__piston__inertia=[1, -1, 1],
        legs__3__stroke={"min": 850.0, "max": 650.0},
        tool__axis=[0, 0, 0],
        dynamics__gravity=[0, 0, math.nan],
        legs__3__base__point=[-200.0, 80.0, 0.0],
        legs__4__base__point=[-88.16778784387097, -84.2705098312484, 740.0],  # where its platform joint is
        legs__5__platform__axis=[0, 0, 0],
        load__axes="tool",
        dynamics__efficiency=0,
    )
    tables["legs"][0]["platform"]["joint"] = "S"
    faults = dict(faults_of(tables))
    expected = {
        "legs.1.colour": "is no key here",
        "units.force": 'is "kg"; valid: N',
        "platform.mass": "must be positive",
        "rods.1.inertia": "belongs to no body",
        "legs.2.piston.inertia": "is not positive definite",
        "legs.3.stroke": "min is 850 mm, max is 650 mm",
        "tool.axis": "is zero",
        "dynamics.gravity.3": "is NaN",
        "legs.3.base.point": "off the line of rod",
        "legs.4": "coincide at the home pose",
        "legs.5.platform.axis": "is zero",
        "load.axes": 'is "tool"; needs "base" or "platform"',
        "dynamics.efficiency": "is 0",
        "legs.1.platform.axis": "must not be given; a S joint has none",
    }
    assert faults.keys() == expected.keys()
    for place, message in expected.items():
        assert message in faults[place]


@pytest.mark.parametrize(
    ("change", "place"),
    [({"legs__5__actuated": False}, "legs"), ({"home__rotation_vector": [0.0, 0.0, 30.0]}, "home")],
)
def test_a_bad_body_does_not_hide_what_is_wrong_with_the_whole(change: dict[str, Any], place: str) -> None:
    assert {found for found, _ in faults_of(changed(PAPER, platform__mass=-3.0, **change))} == {
        "platform.mass",
        place,
    }


def test_a_file_that_is_no_toml_is_named_with_the_line(tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    path.write_text('name = "a"\n[home\n', encoding="utf-8")
    with pytest.raises(MechanismError, match=r"toml \(line 2\): .*column 6") as caught:
        pp.load(path)
    assert str(path) in str(caught.value)


def test_a_file_that_is_no_utf_8_is_named(tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    path.write_bytes('name = "Kräfte"\n'.encode("latin-1"))
    with pytest.raises(MechanismError, match=r"file: is not UTF-8 text: .*0xe4 in position 10") as caught:
        pp.load(path)
    assert str(path) in str(caught.value)


def test_a_missing_file_brings_up_the_likeliest_name(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match=f'"lu-3spu-2rpu"; did you mean "{BUILT_IN}"'):
        pp.load("lu-3spu-2rpu")
    with pytest.raises(UnknownNameError, match=f"nowhere.toml.*valid: .*{BUILT_IN}"):
        pp.load(tmp_path / "nowhere.toml")


# --- round trips --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", FILES)
def test_file_to_object_to_file_loses_nothing(name: str, tmp_path: Path) -> None:
    text = FILES[name].read_text(encoding="utf-8")
    mech = pp.load(FILES[name])
    assert mech.to_toml() == text  # comments, spaces and digits included
    assert pp.Mechanism.from_toml(mech.to_toml()) == mech
    mech.save(tmp_path / "saved.toml")
    assert (tmp_path / "saved.toml").read_bytes() == FILES[name].read_bytes()
    assert pp.load(tmp_path / "saved.toml") == mech


@pytest.mark.parametrize("name", FILES)
def test_dictionary_to_object_to_file_is_exact_to_the_bit(name: str, tmp_path: Path) -> None:
    tables = changed(name, platform__mass=1 / 3, legs__1__piston__inertia=0.1 + 0.2)
    tables["home"]["position"][2] += 1e-13
    mech = pp.Mechanism.from_dict(tables)
    assert mech.to_dict() == tables
    assert pp.Mechanism.from_dict(mech.to_dict()) == mech
    assert tomllib.loads(mech.to_toml()) == tables
    mech.save(tmp_path / "saved.toml")
    again = pp.load(tmp_path / "saved.toml")
    assert again == mech
    assert again.geometry == mech.geometry
    assert np.array_equal(again.home, mech.home)


@pytest.mark.parametrize("kind", [tuple, np.array])
def test_vectors_of_any_kind_make_the_same_mechanism_and_can_be_saved(kind: Any) -> None:
    tables = changed(PAPER)
    tables["home"]["position"] = kind(tables["home"]["position"])
    mech = pp.Mechanism.from_dict(tables)
    assert tomllib.loads(mech.to_toml()) == TABLES[PAPER]
    assert mech == pp.Mechanism.from_dict(TABLES[PAPER])


def test_built_in_and_file_are_the_same_and_others_differ() -> None:
    assert pp.load(BUILT_IN) == pp.load(FILES[BUILT_IN])
    assert pp.load(BUILT_IN) != pp.Mechanism.from_dict(changed(PAPER, legs__1__stroke__min=651.0))
    assert pp.load(BUILT_IN) != BUILT_IN


def test_what_a_mechanism_hands_out_is_not_its_own() -> None:
    mech = pp.load(BUILT_IN)
    mech.to_dict()["legs"][0]["stroke"]["min"] = 1.0
    mech.geometry["legs"][0]["stroke"][0] = 1.0
    mech.home[0, 3] = mech.stroke[0, 0] = 1.0
    assert mech == pp.load(BUILT_IN)
    assert mech.geometry["legs"][0]["stroke"] == [0.65, 0.85]
    assert mech.stroke[0, 0] == 0.65
    assert mech.home[0, 3] == 0.0


def numbers_of(value: Any, place: str = "") -> dict[str, float]:
    """Place → number, of everything below `value`."""
    if isinstance(value, dict | list):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        return {k: v for key, part in items for k, v in numbers_of(part, f"{place}.{key}").items()}
    return {place: value} if isinstance(value, float) else {}


KINDS = {
    **dict.fromkeys(("radius", "z", "min", "max", "position", "point", "center"), "length"),
    **dict.fromkeys(("angle", "rotation_vector"), "angle"),
    **{kind: kind for kind in ("mass", "inertia", "force", "torque")},
    "gravity": "acceleration",
}


def converted(value: Any, old: dict[str, str], new: dict[str, str], key: str = "") -> Any:
    """Tables in other units, each number being that of the innermost key that has a unit."""
    if isinstance(value, dict):
        return {k: converted(v, old, new, KINDS.get(k, "")) for k, v in value.items()}
    if isinstance(value, list):
        return [converted(v, old, new, key) for v in value]
    if key and isinstance(value, float):
        return from_si(to_si(value, key, old.get(key, new[key])), key, new[key])
    return value


ODD = {"length": "in", "angle": "rad", "mass": "lb", "inertia": "g mm^2", "force": "mN", "torque": "kN m"}


@pytest.mark.parametrize("units", [SI_UNITS, ODD | {"acceleration": "mm/s^2"}])
@pytest.mark.parametrize("name", FILES)
def test_units_of_the_file_do_not_matter(name: str, units: dict[str, str]) -> None:
    mech = pp.load(FILES[name])
    tables = mech.to_dict()
    other = {key: converted(value, tables["units"], units, "") for key, value in tables.items()}
    again = pp.Mechanism.from_dict(other | {"units": units})
    assert other != tables
    first, second = numbers_of(mech.geometry), numbers_of(again.geometry)
    assert first.keys() == second.keys()
    for place, value in first.items():
        assert second[place] == pytest.approx(value, rel=UNIT_ROUNDING, abs=UNIT_ROUNDING), place
    assert again.mobility() == mech.mobility()


# --- what it is ---------------------------------------------------------------------------------------------


def test_paper_mechanism() -> None:
    mech = pp.load(BUILT_IN)
    assert repr(mech) == f"<Mechanism {BUILT_IN}: RPU+SPU+RPU+SPU+SPU, 5 degrees of freedom>"
    assert (mech.n_legs, mech.leg_names, mech.rod_names) == (5, tuple("12345"), ("L",))
    assert mech.actuated.tolist() == [True] * 5
    assert mech.stroke.tolist() == [[0.65, 0.85]] * 5
    assert mech.characteristic_length == pytest.approx(0.15, rel=1e-15)
    assert mech.coupled_legs == ("1", "3")
    assert mech.home[:3, 3] == pytest.approx([0, 0.12 * math.sin(math.pi / 10), 0.74], abs=UNIT_ROUNDING)
    near_singular, redundant = mech.warnings
    assert "nearly singular at its centre pose: the smallest singular value is 0.002" in near_singular
    assert "2 redundant constraints couple legs 1 and 3" in redundant


def test_defaults_of_a_leg_without_stroke() -> None:
    mech = pp.Mechanism.from_dict(changed(GOUGH, legs__2__stroke=DELETED))
    assert mech.stroke.tolist() == [[0.55, 0.85], [0, math.inf], *[[0.55, 0.85]] * 4]
    assert pp.load(FILES[GOUGH]).warnings == []


@pytest.mark.parametrize(("degrees", "sound"), [(1e-5, True), (1e-3, False)])
def test_home_may_miss_the_constraints_by_rounding_only(degrees: float, sound: bool) -> None:
    tables = changed(PAPER, home__rotation_vector=[0.0, 0.0, degrees])
    if sound:
        assert pp.Mechanism.from_dict(tables).dof == 5
    else:
        assert {place for place, _ in faults_of(tables)} == {"home"}


@pytest.mark.parametrize(("millimetres", "sound"), [(1e-5, True), (1e-2, False)])
def test_a_rod_may_miss_its_joints_by_rounding_only(millimetres: float, sound: bool) -> None:
    tables = changed(PAPER, rods__1__point=[0.0, 270.0 * math.sin(math.radians(18.0)) + millimetres, 0.0])
    if sound:
        assert pp.Mechanism.from_dict(tables).dof == 5
    else:
        places = {place for place, _ in faults_of(tables)}
        assert places == {"legs.1.base.point", "legs.3.base.point"}
