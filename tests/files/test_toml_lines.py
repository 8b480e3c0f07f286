"""Faults of mechanism files point to their lines."""

from __future__ import annotations

import pytest

import polypod as pp
from polypod.errors import Fault, MechanismError
from polypod.files.toml_lines import line_of

BUILT_IN = "exechon"

TEXT = """\
name = "m"

[units]
length = "mm"

[[rods]]
name = "L"

[[legs]]
"base".joint = "S" # home = 3

[[legs]]
stroke = { min = 1,
  max = 2 }

[legs.platform]
joint = "U"

[legs.platform.cone]
angle = 3
"""


@pytest.mark.parametrize(
    ("place", "line"),
    [
        ("name", 1),
        ("units.length", 4),
        ("units.mass", 3),
        ("rods.1.name", 7),
        ("legs.1.base.joint", 10),
        ("legs.1.platform", 9),
        ("legs.2", 12),
        ("legs.2.stroke.max", 13),
        ("legs.2.platform.joint", 17),
        ("legs.2.platform.cone.angle", 20),
        ("legs", 9),
        ("legs.3.stroke", 9),
        ("home", None),
    ],
)
def test_lines_of_places(place: str, line: int | None) -> None:
    assert line_of(TEXT, place) == line


@pytest.mark.parametrize(
    ("right", "wrong", "place"),
    [
        ('length = "mm"', 'length = "m m"', "units.length"),
        ("mass = 20", "mass = -20", "platform.mass"),
        ("position = [0, 0, 900]", "position = [0, 900]", "home.position"),
        ('joint = "S", point = [0, 380, 0]', 'joint = "T", point = [0, 380, 0]', "legs.3.base.joint"),
        ("radius = 30", "raduis = 30", "legs.1.raduis"),
        ("piston = { mass = 3", "piston = { mass = 0", "legs.1.piston.mass"),
    ],
)
def test_a_wrong_entry_is_found(right: str, wrong: str, place: str) -> None:
    text = pp.load(BUILT_IN).to_toml()
    line = 1 + text[: text.index(right)].count("\n")
    with pytest.raises(MechanismError) as caught:
        pp.Mechanism.from_toml(text.replace(right, wrong, 1))
    assert {fault.place for fault in caught.value.faults} == {place}
    assert {fault.line for fault in caught.value.faults} == {line}
    assert f"\n  {place} (line {line}): " in str(caught.value)


def test_every_entry_of_every_built_in_file_has_its_line() -> None:
    """Whatever is written in a file is found in its own line."""
    for name in pp.list_mechanisms():
        mech = pp.load(name)
        lines = mech.to_toml().splitlines()
        for place, key in entries(mech.to_dict()):
            line = line_of(mech.to_toml(), place)
            assert line is not None
            assert f"{key} =" in lines[line - 1] or lines[line - 1].startswith("[["), (name, place)


def entries(table: dict, path: str = ""):
    """Places and names of all entries of a file's tables."""
    for key, value in table.items():
        place = f"{path}{key}"
        if isinstance(value, dict):
            yield from entries(value, f"{place}.")
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            for i, item in enumerate(value, 1):
                yield from entries(item, f"{place}.{i}.")
        else:
            yield place, key


def test_without_a_text_there_is_no_line() -> None:
    content = pp.load(BUILT_IN).to_dict()
    content["platform"]["mass"] = -1
    with pytest.raises(MechanismError) as caught:
        pp.Mechanism.from_dict(content)
    (fault,) = caught.value.faults
    assert fault.line is None
    assert str(fault).startswith("platform.mass: is -1 kg")
    assert str(Fault("a", "b", 3)) == "a (line 3): b"


SINGLE = """\
name = "m"
[units]
length = "m"
angle = "rad"
[home]
position = [0, 0, 1]
[legs]
base = { joint = "S", point = [1, 0, 0] }
platform = { joint = "S", point = [1, 0, 0] }
"""


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (SINGLE, "legs (line 7): is a table; needs one table [[legs]] for each"),
        (
            SINGLE + SINGLE[SINGLE.index("[legs]") :],
            "toml (line 10): [legs] stands there twice; a list of tables has two brackets, [[legs]]",
        ),
    ],
    ids=["once", "twice"],
)
def test_single_brackets_of_a_list_are_one_fault(tmp_path, text: str, expected: str) -> None:
    file = tmp_path / "m.toml"
    file.write_text(text)
    with pytest.raises(MechanismError) as caught:
        pp.load(file)
    assert [str(fault) for fault in caught.value.faults] == [expected]


def test_one_table_in_place_of_an_array_has_lines_of_its_own():
    text = '[units]\nlength = "mm"\n[legs]\nangle = 3\nbase.joint = "U"\n[[rods]]\nname = "L"\n'
    assert line_of(text, "legs.1.angle") == 4
    assert line_of(text, "legs.1.base.joint") == 5
    assert line_of(text, "legs.1.stroke") == 3
    assert line_of(text, "rods.1.name") == 7
