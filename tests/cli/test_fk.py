"""`polypod fk`: from a file of leg lengths to poses, as tables, JSON and CSV."""

from __future__ import annotations

import copy
import csv
import json
from dataclasses import replace

import numpy as np
import pytest

import polypod as pp
from polypod.solution.poses_of_lengths import load_lengths
from support import DATA

NAME = "lu-3spu-2rpu-r"
PER_METRE = {"m": 1.0, "mm": 1e3, "cm": 1e2, "um": 1e6, "in": 1 / 0.0254}
STEWART = DATA / "stewart-gough.toml"
NOWHERE = [0.1, 0.9, 0.1, 0.9, 0.1]  # no pose has these lengths
COLUMNS = 140


@pytest.fixture(scope="module")
def mech():
    return pp.load(NAME)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "lengths.csv"


def write(path, rows, units=("mm",) * 5, order=range(5), names="12345"):
    header = ", ".join(f"{names[i]} [{units[i]}]" for i in order)
    lines = [", ".join(repr(float(row[i]) * PER_METRE[units[i]]) for i in order) for row in rows]
    path.write_text("\n".join(["# leg lengths", header, *lines]) + "\n")
    return path


def poses(mech, n=1):
    """Poses along a short path, (n, 4, 4)."""
    s = np.linspace(0.0, 1.0, n)
    return mech.pose(
        {
            "alpha": -0.24 + 0.05 * s,
            "p": np.full(n, -0.28),
            "h": 0.65 + 0.02 * s,
            "beta": 0.5 + 0.1 * s,
            "gamma": np.full(n, 0.7),
        }
    )


def read_json(result, status=0):
    assert result[0] == status
    assert result[2] == ""
    return json.loads(result[1], parse_constant=pytest.fail)


def distances(row, pose):
    return [np.abs(np.array(mode["pose"]) - pose).max() for mode in row["modes"]]


def seven_legs(path):
    """A hexapod with a passive leg in the middle, saved in `path`, and its lengths at home."""
    data = pp.load(STEWART).to_dict()
    del data["published"]
    leg = copy.deepcopy(data["legs"][0])
    leg["base"]["point"]["radius"] = leg["platform"]["point"]["radius"] = 100.0
    data["legs"].append({**leg, "actuated": False})
    mech = pp.Mechanism.from_dict(data)
    mech.save(path)
    return mech, mech.inverse_kinematics(mech.home).lengths


# --- all modes ----------------------------------------------------------------------------------------------


def test_a_known_pose_is_among_the_modes_of_its_lengths(run, mech, path):
    known = poses(mech, 3)
    facts = read_json(run("fk", NAME, write(path, mech.inverse_kinematics(known).lengths), "--json"))
    assert (facts["mechanism"], facts["coordinate_set"]) == (NAME, "paper")
    assert (facts["without_pose"], facts["incomplete"]) == (0, 0)
    assert [row["row"] for row in facts["rows"]] == [1, 2, 3]
    for row, pose in zip(facts["rows"], known, strict=True):
        assert [mode["mode"] for mode in row["modes"]] == list(range(1, len(row["modes"]) + 1))
        assert sum(d < 1e-9 for d in distances(row, pose)) == 1
        mode = row["modes"][int(np.argmin(distances(row, pose)))]
        assert mode["coordinates"] == pytest.approx(
            {name: float(q) for name, q in mech.coordinates(pose).items()}, abs=1e-9
        )


def test_json_gives_what_python_computes(run, mech, path):
    lengths = load_lengths(write(path, mech.inverse_kinematics(poses(mech, 2)).lengths), mech)
    modes = mech.assembly_modes(lengths)
    facts = read_json(run("fk", NAME, path, "--json"))
    for i, row in enumerate(facts["rows"]):
        assert len(row["modes"]) == modes.number[i] > 1
        assert row["status"] == pp.Status(int(modes.status[i])).name
        for j, mode in enumerate(row["modes"]):
            assert mode["pose"] == modes.pose[i, j].tolist()
            for key in ("determinant_sign", "above", "multiplicity", "residual"):
                assert mode[key] == getattr(modes, key)[i, j]
            assert mode["status"] == pp.Status(int(modes.mode_status[i, j])).name
        assert {mode["above"] for mode in row["modes"]} == {True, False}


def test_the_table_shows_mm_and_degrees(run, mech, path):
    pose = poses(mech)[0]
    status, out, err = run("fk", NAME, write(path, [mech.inverse_kinematics(pose).lengths]))
    assert (status, err) == (0, "")
    q = mech.coordinates(pose)
    position = ", ".join(f"{1e3 * x:.1f}" for x in pose[:3, 3])
    line = next(line for line in out.splitlines() if position in line)
    for name in ("alpha", "beta", "gamma"):
        assert f"{name} / deg" in out
        assert f" {np.degrees(q[name]):.1f} " in line
    assert " above " in line
    assert " below " in out
    assert "Row" not in out


def test_columns_have_any_order_and_unit(run, mech, path):
    lengths = mech.inverse_kinematics(poses(mech, 2)).lengths
    write(path, lengths, ("in", "cm", "um", "m", "mm"), (3, 0, 4, 2, 1))
    np.testing.assert_allclose(load_lengths(path, mech), lengths, rtol=1e-14)


def test_legs_without_actuator_need_no_column(run, path, tmp_path):
    mech, home = seven_legs(tmp_path / "seven.toml")
    write(path, [home], ("mm",) * 7, range(6), "1234567")
    np.testing.assert_allclose(load_lengths(path, mech), [[*home[:6], np.nan]], rtol=1e-15)
    for near in ((), ("--near",)):
        facts = read_json(run("fk", tmp_path / "seven.toml", path, "--json", *near))
        assert min(distances(facts["rows"][0], mech.home)) < 1e-9


def test_rows_without_pose_give_exit_status_1(run, mech, path):
    write(path, [NOWHERE, mech.inverse_kinematics(poses(mech)[0]).lengths, [-1.0] * 5])
    status, out, err = run("fk", NAME, path)
    assert (status, err) == (1, "")
    assert "Row 1: no pose has these lengths" in out
    assert "Row 2" not in out
    assert "Row 3: no pose was found; INVALID_INPUT: " in out
    facts = read_json(run("fk", NAME, path, "--json"), 1)
    assert facts["without_pose"] == 2
    assert [len(row["modes"]) > 0 for row in facts["rows"]] == [False, True, False]


def test_a_row_whose_modes_may_be_incomplete_gives_exit_status_1(run, mech, path, monkeypatch):
    find = pp.Mechanism.assembly_modes
    incomplete = np.array([pp.Status.NOT_CONVERGED], dtype=np.uint8)
    monkeypatch.setattr(pp.Mechanism, "assembly_modes", lambda *a: replace(find(*a), status=incomplete))
    write(path, mech.inverse_kinematics(poses(mech)).lengths)
    status, out, _ = run("fk", NAME, path)
    assert status == 1
    assert "Row 1: NOT_CONVERGED: " in out
    assert read_json(run("fk", NAME, path, "--json"), 1)["incomplete"] == 1


@pytest.mark.parametrize("file", ["3-rps", "stewart-gough"])
def test_other_mechanisms(run, path, file):
    mech = pp.load(DATA / f"{file}.toml")
    n = mech.n_legs
    write(path, [mech.inverse_kinematics(mech.home).lengths], ("mm",) * n, range(n), mech.leg_names)
    facts = read_json(run("fk", DATA / f"{file}.toml", path, "--json", "-o", path.with_name("r.csv")))
    assert min(distances(facts["rows"][0], mech.home)) < 1e-9
    assert run("fk", DATA / f"{file}.toml", path)[0] == 0


# --- near ---------------------------------------------------------------------------------------------------


def test_near_follows_one_mode_along_the_rows(run, path):
    """From a regular home along poses that are known; the sign of det J is that of the same mode."""
    mech = pp.load(STEWART)
    s = np.linspace(0.0, 1.0, 5)
    move = {"x": 0.1 * s, "y": -0.05 * s, "z": 0.6 + 0.05 * s, "rx": 0.1 * s, "ry": 0.05 * s, "rz": 0.2 * s}
    known = mech.pose(move)
    write(path, mech.inverse_kinematics(known).lengths, ("mm",) * 6, range(6), mech.leg_names)
    followed = mech.forward_kinematics(load_lengths(path, mech), continued=True)
    facts = read_json(run("fk", STEWART, path, "--near", "--json"))
    modes = read_json(run("fk", STEWART, path, "--json"))
    for i, (row, all_of_row) in enumerate(zip(facts["rows"], modes["rows"], strict=True)):
        (mode,) = row["modes"]
        assert distances(row, known[i])[0] < 1e-9
        assert mode["pose"] == followed.pose[i].tolist()
        assert row["status"] == mode["status"] == pp.Status(int(followed.status[i])).name
        assert (mode["above"], mode["multiplicity"]) == (None, None)
        same = all_of_row["modes"][int(np.argmin(distances(all_of_row, known[i])))]
        assert mode["determinant_sign"] == same["determinant_sign"] != 0


def test_near_says_that_the_mode_of_home_has_ended(run, path):
    """The pose that was found stands, so the exit status is 0."""
    write(path, [[0.75] * 5])
    status, out, _ = run("fk", NAME, path, "--near")
    assert status == 0
    assert f"Row 1: MODE_JUMP: {pp.Status.MODE_JUMP.message}" in out


def test_near_tells_where_there_is_no_pose(run, mech, path):
    write(path, [NOWHERE])
    status, out, err = run("fk", NAME, path, "--near")
    assert (status, err) == (1, "")
    assert f"Row 1: no pose was found; NOT_CONVERGED: {pp.Status.NOT_CONVERGED.message}" in out
    assert read_json(run("fk", NAME, path, "--near", "--json"), 1)["rows"][0]["modes"] == []


def test_follow_begins_with_a_mode_of_the_first_row(run, mech, path):
    """The published home is nearly singular: from there the rows are not reached, from a mode they are."""
    known = poses(mech, 5)
    write(path, mech.inverse_kinematics(known).lengths)
    first = read_json(run("fk", NAME, path, "--json"))["rows"][0]
    number = int(np.argmin(distances(first, known[0]))) + 1
    facts = read_json(run("fk", NAME, path, "--follow", number, "--json"))
    for row, pose in zip(facts["rows"], known, strict=True):
        (mode,) = row["modes"]
        assert distances(row, pose)[0] < 1e-9
        assert (mode["mode"], row["status"]) == (number, "OK")
    near = run("fk", NAME, path, "--near", "--json")
    assert {row["status"] for row in json.loads(near[1])["rows"]} <= {"NOT_CONVERGED", "MODE_JUMP"}


@pytest.mark.parametrize(("rows", "has"), [(None, "modes 1 to 8"), ([NOWHERE], "no mode")])
def test_a_mode_that_is_none_cannot_be_followed(run, mech, path, rows, has):
    write(path, mech.inverse_kinematics(poses(mech)).lengths if rows is None else rows)
    message = f"polypod: mode 9 cannot be followed: the first row of lengths has {has}\n"
    assert run("fk", NAME, path, "--follow", 9) == (2, "", message)


def test_the_table_is_whole_in_80_columns(run, mech, path, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    lengths = mech.inverse_kinematics(poses(mech)).lengths
    write(path, lengths)
    out = run("fk", NAME, path)[1]
    for pose in mech.assembly_modes(lengths[0]).pose:
        assert ", ".join(f"{1e3 * x:.1f}" for x in pose[:3, 3]) in out
    assert "…" not in out


def test_the_rotation_of_six_degrees_of_freedom_is_shown_and_saved(run, path):
    """As rx, ry, rz: six of the eight modes are tilted."""
    mech = pp.load("ups-hexapod")
    lengths = mech.inverse_kinematics(mech.home).lengths
    write(path, [lengths], ("mm",) * 6, range(6), mech.leg_names)
    result = path.with_name("poses.csv")
    out = run("fk", "ups-hexapod", path, "-o", result)[1]
    with result.open() as file:
        lines = list(csv.DictReader(file))
    modes = mech.assembly_modes(lengths)
    assert len(lines) == modes.number
    tilted = 0
    for line, pose in zip(lines, modes.pose, strict=False):
        angles = {name: float(line[f"{name} [rad]"]) for name in ("rx", "ry", "rz")}
        again = mech.state({**dict(zip("xyz", pose[:3, 3], strict=True)), **angles}).pose
        np.testing.assert_allclose(again, pose, atol=1e-12)
        tilted += pose[2, 2] < 0.99
        for angle in angles.values():
            assert f"{np.degrees(abs(angle)):.1f}" in out
    assert tilted


def test_a_table_is_no_longer_than_a_screen(run, mech, path):
    lengths = mech.inverse_kinematics(poses(mech, 30)).lengths
    total = int(mech.assembly_modes(lengths).number.sum())
    write(path, [*lengths, *[NOWHERE] * 50])
    status, out, _ = run("fk", NAME, path)
    assert status == 1
    assert f"... and {total - 40} more, {total} poses of 80 rows in all" in out
    assert "... and 10 more: 50 of 80 rows have no pose, and 0 may lack one." in out
    assert len(out.splitlines()) < 90


# --- result file --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("near", [(), ("--near",)])
def test_the_result_has_one_line_for_each_mode(run, mech, path, near):
    result = path.with_name("poses.csv")
    result.write_text("an older result")
    write(path, [mech.inverse_kinematics(mech.home).lengths, NOWHERE])
    facts = read_json(run("fk", NAME, path, "-o", result, "--json", *near), 1)
    assert facts["result"] == str(result)
    with result.open(encoding="utf-8", newline="") as file:
        header, *lines = csv.reader(file)
    position = ["x [m]", "y [m]", "z [m]"]
    angles = ["alpha [rad]", "beta [rad]", "gamma [rad]"]
    ends = ["determinant_sign", "above", "multiplicity", "residual [m]", "status"]
    assert header == ["row", "mode", *position, *angles, *ends]
    modes = facts["rows"][0]["modes"]
    assert len(lines) == len(modes) > 0
    for line, mode in zip(lines, modes, strict=True):
        cells = dict(zip(header, line, strict=True))
        assert (cells["row"], cells["mode"]) == ("1", str(mode["mode"]))
        assert [float(cells[name]) for name in position] == [row[3] for row in mode["pose"][:3]]
        for name in ("alpha", "beta", "gamma"):
            assert float(cells[f"{name} [rad]"]) == mode["coordinates"][name]
        assert cells["above"] == ("" if near else str(int(mode["above"])))
        assert float(cells["residual [m]"]) == mode["residual"]
        assert int(cells["determinant_sign"]) == mode["determinant_sign"]
        assert cells["status"] == mode["status"]
    assert f"Written: {result}" in run("fk", NAME, path, "-o", result, *near)[1]


# --- wrong input --------------------------------------------------------------------------------------------


def assert_one_message(result, *texts):
    status, out, err = result
    assert (status, out) == (2, "")
    assert err.startswith("polypod: ")
    assert "Traceback" not in err
    for text in texts:
        assert text in err


@pytest.mark.parametrize(
    ("text", "messages"),
    [
        ("", ["file: needs a header such as 1 [mm], 2 [mm], 3 [mm], 4 [mm], 5 [mm] and a row or more"]),
        ("1 [mm], 2 [mm], 3 [mm], 4 [mm], 5 [mm]\n", ["file: needs a header"]),
        (
            "1 [mm], 2 [mm], 3 [mm], 4 [mm], 6 [mm]\n1,1,1,1,1\n",
            [
                'line 1: column "6 [mm]" is unknown; valid: 1, 2, 3, 4, 5',
                "line 1: there is no column for leg 5",
            ],
        ),
        ("1 [mm], 2 [mm], 3 [mm], 4 [mm], 4 [mm], 5 [mm]\n1,1,1,1,1,1\n", ["column 4 stands there 2 times"]),
        ("1 [mm], 2 [m m], 3 [mm], 4 [mm], 5 [mm]\n1,1,1,1,1\n", ['has the unit "m m"; did you mean "mm"?']),
        (
            "1 [mm], 2 [deg], 3 [mm], 4 [mm], 5 [mm]\n1,1,1,1,1\n",
            ['"2 [deg]" has the unit "deg"; valid: m, mm'],
        ),
        ("1 [mm], 2, 3 [mm], 4 [mm], 5 [mm]\n1,1,1,1,1\n", ['column "2" has no unit; valid: m, mm']),
        (
            "# c\n1 [mm], 2 [mm], 3 [mm], 4 [mm], 5 [mm]\n1,1,1,1,1\n1,1,x,nan,1\n",
            ['line 4: column 3 is "x"; needs a finite number', 'line 4: column 4 is "nan"'],
        ),
        ("1 [mm], 2 [mm], 3 [mm], 4 [mm], 5 [mm]\n1,1,1,1\n", ["line 2: has 4 cells; the header has 5"]),
    ],
)
def test_faults_of_a_file_are_named(run, path, text, messages):
    path.write_text(text)
    assert_one_message(run("fk", NAME, path), str(path), *messages)


def test_unreadable_lengths(run, tmp_path):
    assert_one_message(run("fk", NAME, tmp_path / "nowhere.csv"), "nowhere.csv", "does not exist")
    assert_one_message(run("fk", NAME, tmp_path), str(tmp_path), "cannot be read")
    (tmp_path / "binary.csv").write_bytes(b"\xff\x00\xfe")
    assert_one_message(run("fk", NAME, tmp_path / "binary.csv"), "binary.csv", "is not UTF-8 text")


@pytest.mark.parametrize("result", ["r.nc", "r", "nowhere/r.csv", "lengths.csv"])
def test_result_that_cannot_be_written_is_an_error_before_any_work(run, path, result, monkeypatch):
    write(path, [NOWHERE])
    before = path.read_text()
    monkeypatch.setattr("polypod.mechanism.load", lambda _: pytest.fail("worked first"))
    assert_one_message(run("fk", NAME, path, "-o", path.parent / result))
    assert path.read_text() == before


def test_a_design_that_is_singular_everywhere_has_no_answer(run, path, tmp_path):
    """A hexapod whose platform is its base made smaller."""
    data = pp.load(STEWART).to_dict()
    for leg in data["legs"]:
        leg["platform"]["point"] = {**leg["base"]["point"], "radius": 300.0}
    pp.Mechanism.from_dict(data).save(tmp_path / "singular.toml")
    write(path, [[0.7] * 6], ("mm",) * 6, range(6), "123456")
    assert_one_message(
        run("fk", tmp_path / "singular.toml", path), "a design that is not singular everywhere"
    )


def test_help_shows_an_example(run):
    status, out, _ = run("fk", "--help")
    assert status == 0
    assert "Example: polypod fk" in out
