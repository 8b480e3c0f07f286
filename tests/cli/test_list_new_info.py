"""`polypod list` and `polypod new`, and what `polypod info` tells of degrees of freedom and constraints."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

import polypod as pp


def test_list_has_a_line_for_each(run):
    status, out, err = run("list")
    assert (status, err) == (0, "")
    lines = out.splitlines()
    assert [line.split()[0] for line in lines] == list(pp.list_mechanisms())
    (line,) = (line for line in lines if line.startswith("tricept "))
    assert "3UPS+UPF" in line
    assert "3 degrees of freedom" in line


def test_list_as_json(run):
    facts = json.loads(run("list", "--json")[1], parse_constant=pytest.fail)
    assert [row["name"] for row in facts] == list(pp.list_mechanisms())
    row = next(row for row in facts if row["name"] == "3-upu")
    assert {"name": "3-upu", "legs": "3UPU", "dof": 3}.items() <= row.items()


# --- new ----------------------------------------------------------------------------------------------------


def test_new_writes_a_sound_file(run, tmp_path):
    path = tmp_path / "my machine.toml"
    status, out, err = run("new", path)
    assert (status, err) == (0, "")
    assert "Written" in out
    mech = pp.load(path)
    assert (mech.name, mech.dof, mech.leg_letters) == ("my machine", 3, ("RPS",) * 3)
    assert mech.warnings == []
    assert bool(mech.limits(mech.home).within)
    text = path.read_text(encoding="utf-8")
    for table in (
        "[units]",
        "[home]",
        "[platform]",
        "[load]",
        "[dynamics]",
        "[limits]",
        "[[rods]]",
        "[[legs]]",
    ):
        assert table in text
    assert run("info", path)[0] == 0


def test_every_key_of_the_template_can_be_left_out_where_it_says_so(tmp_path):
    """The tables that are marked optional, and the optional keys of leg 1."""
    from polypod.cli.templates import starting_text

    content = pp.Mechanism.from_toml(starting_text(tmp_path / "m.toml")).to_dict()
    for table in ("platform", "load", "dynamics", "limits"):
        smaller = {key: value for key, value in content.items() if key != table}
        assert pp.Mechanism.from_dict(smaller).dof == 3
    leg = content["legs"][0]
    for key in ("name", "actuated", "stroke", "force", "radius", "cylinder", "piston"):
        smaller = {name: value for name, value in leg.items() if name != key}
        assert pp.Mechanism.from_dict({**content, "legs": [smaller, *content["legs"][1:]]}).dof == 3


def test_new_like_a_built_in_one(run, tmp_path):
    path = tmp_path / "mine.toml"
    assert run("new", path, "--like", "tricept")[0] == 0
    mine, tricept = pp.load(path), pp.load("tricept")
    assert mine.name == "mine"
    assert {**mine.to_dict(), "name": "tricept"} == tricept.to_dict()
    assert mine.to_toml().splitlines()[1:] == tricept.to_toml().splitlines()[1:]


def test_new_refuses(run, tmp_path):
    kept = tmp_path / "kept.toml"
    kept.write_text("precious")
    for arguments, message in (
        ((kept,), "is there already"),
        ((tmp_path / "m.txt",), "a mechanism file ends in .toml"),
        ((tmp_path / "m.toml", "--like", "tricep"), 'did you mean "tricept"'),
        ((tmp_path / "nowhere" / "m.toml",), "No such file or directory"),
    ):
        status, out, err = run("new", *arguments)
        assert (status, out) == (2, "")
        assert message in err
    assert kept.read_text() == "precious"
    assert list(tmp_path.iterdir()) == [kept]


# --- info ---------------------------------------------------------------------------------------------------


def facts_of(run, name):
    status, out, _ = run("info", name, "--json")
    assert status == 0
    return json.loads(out, parse_constant=pytest.fail)


def test_parasitic_motion_of_a_3_rps(run):
    """Tilted by θ about x or y, o shifts by half the joints' radius times 1 - cos θ: a known result."""
    freedoms = facts_of(run, "3-rps")["freedoms"]
    assert freedoms["independent"] == ["z", "rx", "ry"]
    rise, about_x, about_y = freedoms["coupled"]
    assert rise["follow"] == {}
    shift = 0.150 / 2 * (1 - math.cos(about_x["change"]))
    assert about_x["follow"] == {"x": pytest.approx(shift, rel=1e-9)}
    assert about_y["follow"] == {"x": pytest.approx(-shift, rel=1e-9)}
    assert "x +1.14 mm" in run("info", "3-rps")[1]


def test_freedoms_of_a_3_rps_at_rest(run):
    """It rises, and rotations about any line in the plane of its upper joints."""
    rise, *turns = facts_of(run, "3-rps")["freedoms"]["screws"]
    assert rise["kind"] == "translation"
    np.testing.assert_allclose(rise["axis"], [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose([row["axis"] for row in turns], [[1, 0, 0], [0, 1, 0]], atol=1e-12)
    np.testing.assert_allclose([row["point"] for row in turns], [[0, 0, 0.5]] * 2, atol=1e-12)
    assert [row["kind"] for row in turns] == ["turn", "turn"]
    said = run("info", "3-rps")[1]
    assert "0.0, 0.0, 500.0" in said
    # Each constraint is a force through an upper joint, along the axis of its revolute joint.
    wrenches = facts_of(run, "3-rps")["constraint_wrenches"]
    mech = pp.load("3-rps")
    for row, leg in zip(wrenches, mech.to_dict()["legs"], strict=True):
        place, angle = leg["platform"]["point"], math.radians(leg["platform"]["point"]["angle"])
        joint = mech.home[:3, 3] + place["radius"] / 1e3 * np.array([math.cos(angle), math.sin(angle), 0.0])
        assert np.linalg.norm(np.cross(joint - row["point"], row["axis"])) < 1e-12


def test_a_ball_below_lets_turn_about_itself(run):
    """The SPR leg's ball 560 mm below o: with translations along Y and Z, rotations about axes through it."""
    screws = facts_of(run, "4sps-spr")["freedoms"]["screws"]
    assert [row["kind"] for row in screws] == ["translation"] * 2 + ["turn"] * 3
    for row in screws[2:]:
        assert np.linalg.norm(np.cross(row["point"], row["axis"])) < 1e-12


def test_a_loose_pose_has_more_freedoms(run):
    """The centre of the 3-UPU with radial axes: three couples in a plane hold but two turns."""
    assert [row["kind"] for row in facts_of(run, "3-upu")["freedoms"]["screws"]] == ["translation"] * 3
    assert len(facts_of(run, "3-upu-snu")["freedoms"]["screws"]) > 3


def test_translations_have_no_parasitic_motion(run):
    freedoms = facts_of(run, "3-upu")["freedoms"]
    assert freedoms["independent"] == ["x", "y", "z"]
    assert [row["follow"] for row in freedoms["coupled"]] == [{}, {}, {}]


def test_six_freedoms_have_nothing_that_follows(run):
    facts = facts_of(run, "tsai-6-sps")
    assert facts["freedoms"]["independent"] == ["x", "y", "z", "rx", "ry", "rz"]
    assert facts["freedoms"]["coupled"] == []
    screws = facts["freedoms"]["screws"]
    assert [row["kind"] for row in screws] == ["translation"] * 3 + ["turn"] * 3
    np.testing.assert_allclose([row["axis"] for row in screws], [*np.eye(3), *np.eye(3)], atol=1e-12)
    assert facts["constraint_wrenches"] == []


def test_a_motion_that_is_not_determined_says_so(run):
    """At the loose centre of the 3-UPU with radial axes."""
    assert facts_of(run, "3-upu-snu")["freedoms"]["coupled"][2]["follow"] is None
    assert "not determined there" in run("info", "3-upu-snu")[1]


@pytest.mark.parametrize(
    ("name", "wrenches"),
    [
        # Forces along the pins, through the balls: at o the moment is radius times force, about Z.
        ("3-rps", [("1", False, [0, 1, 0], [0, 0, 0.15])]),
        ("3-upu", [("1", True, [0, 0, 0], None), ("2", True, [0, 0, 0], None), ("3", True, [0, 0, 0], None)]),
        # A force through the ball of the SPR leg, 560 mm below o, along its pin.
        ("4sps-spr", [("5", False, [1, 0, 0], [0, -0.56, 0])]),
        ("4ups-upu", [("5", True, [0, 0, 0], [0, 0, 1])]),
        ("lu-3spu-2rpu-r", [("1", True, [0, 0, 0], [0, 0, 1])]),
    ],
)
def test_constraint_wrenches(run, name, wrenches):
    found = facts_of(run, name)["constraint_wrenches"]
    for row, (leg, couple, force, moment) in zip(found, wrenches, strict=False):
        assert (row["leg"], row["couple"]) == (leg, couple)
        assert row["force"] == pytest.approx(force, abs=1e-12)
        if moment is not None:
            sign = math.copysign(1.0, sum(a * b for a, b in zip(row["moment"], moment, strict=True)))
            assert row["moment"] == pytest.approx([sign * value for value in moment], abs=1e-12)
    assert sum(row["independent"] for row in found) == 6 - pp.load(name).dof


def test_redundant_constraints_are_named(run):
    wrenches = facts_of(run, "exechon")["constraint_wrenches"]
    assert sum(not row["independent"] for row in wrenches) == 2
    assert run("info", "exechon")[1].count("redundant") > 2
    words = " ".join(run("info", "exechon")[1].split())
    assert "2 redundant constraints couple legs 1 and 2:" in words
    words = " ".join(run("info", "2upr-rpu")[1].split())
    assert "3 redundant constraints couple legs 1, 2 and 3:" in words
