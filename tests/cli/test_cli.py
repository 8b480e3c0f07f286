"""The command line: exit status, messages, tables and JSON."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

import polypod as pp
from support import DATA

NAME = "lu-3spu-2rpu-r"


def motion_file(path: Path, **columns: list[float]) -> Path:
    header = "time [s], x [mm], y [mm], z [mm], alpha [deg], beta [deg]"
    rows = zip(*columns.values(), strict=True)
    path.write_text("\n".join([header, *(", ".join(map(str, row)) for row in rows)]) + "\n")
    return path


# --- help and version ---------------------------------------------------------------------------------------


def test_version(run):
    assert run("--version") == (0, f"polypod {pp.__version__}\n", "")


@pytest.mark.parametrize("command", ["demo", "info", "solve", "workspace"])
def test_help_shows_an_example(run, command):
    status, out, _ = run(command, "--help")
    assert status == 0
    assert f"Example: polypod {command}" in out


def test_help_names_all_commands(run):
    status, out, _ = run("--help")
    assert status == 0
    assert all(command in out for command in ("demo", "info", "solve", "Start with: polypod demo"))


# --- info ---------------------------------------------------------------------------------------------------


def test_info_tells_the_published_split_from_the_right_one(run):
    status, out, err = run("info", NAME)
    assert (status, err) == (0, "")
    words = " ".join(out.split())
    for text in (
        "RPU",
        "650.0 to 850.0",
        "couple legs 1, 3",
        "from ranks",
        "published",
        "The published sum is right, as only ς - M_0 enters it and 3 - 1 = 2 - 0; the split is not",
        "rank 22 of 24",
        "quaternary",
        "natural",
        "Warning: nearly singular at its centre pose",
    ):
        assert text in words


def test_info_json_is_complete(run):
    status, out, _ = run("info", NAME, "--json")
    assert status == 0
    facts = json.loads(out, parse_constant=pytest.fail)
    assert facts["mobility"]["dof"] == 5
    assert facts["mobility"]["redundant_legs"] == ["1", "3"]
    assert facts["accounting"]["computed"] == {"redundant": 2, "passive": 0, "sum": 5}
    assert facts["accounting"]["published"] == {"redundant": 3, "passive": 1, "sum": 5}
    assert {kind: len(names) for kind, names in facts["links_by_joints"].items()} == {
        "pentagonal": 1,
        "quaternary": 1,
        "ternary": 1,
        "binary": 10,
    }
    rows = [(row["leg"], row["kind"], row["independent"]) for row in facts["constraints"]]
    assert rows == [("1", "A", True), ("3", "A", False), ("3", "E", False)]
    assert all(row["condition"] for row in facts["constraints"])
    assert facts["coordinate_sets"]["paper"] == ["x", "y", "z", "alpha", "beta"]
    assert 0 < facts["centre_pose"]["sigma_min"] < 0.01 < facts["centre_pose"]["sigma_max"]
    assert facts["legs"][0]["stroke"] == [0.65, 0.85]
    assert any("nearly singular" in warning for warning in facts["warnings"])


def test_info_json_has_null_for_a_free_stroke(run, tmp_path):
    data = pp.load(NAME).to_dict()
    del data["legs"][0]["stroke"], data["published"]
    path = tmp_path / "free.toml"
    pp.Mechanism.from_dict(data).save(path)
    facts = json.loads(run("info", path, "--json")[1], parse_constant=pytest.fail)
    assert facts["legs"][0]["stroke"] == [None, None]
    assert facts["accounting"]["published"] is None
    assert "free" in run("info", path)[1]


@pytest.mark.parametrize("file", ["3-rps", "stewart-gough"])
def test_info_of_other_mechanisms(run, file):
    status, out, _ = run("info", DATA / f"{file}.toml")
    assert status == 0
    assert "The published terms agree." in " ".join(out.split())


def test_info_when_the_published_sum_is_wrong(run, tmp_path):
    data = pp.load(NAME).to_dict()
    data["published"]["passive"] = 0
    pp.Mechanism.from_dict(data).save(tmp_path / "m.toml")
    assert "add up to 6, not to 5" in " ".join(run("info", tmp_path / "m.toml")[1].split())


# --- solve --------------------------------------------------------------------------------------------------


def test_solve_writes_what_python_computes(run, tmp_path):
    mech = pp.load(NAME)
    expected = pp.solve(mech, pp.load_motion(NAME, mech))
    for suffix in (".nc", ".csv"):
        path = tmp_path / f"result{suffix}"
        path.write_text("an older result")
        status, out, err = run("solve", NAME, NAME, "-o", path)
        assert (status, err) == (0, "")
        assert "All states have an answer" in out
        assert str(path) in out.replace("\n", "")
        assert pp.load_solution(path) == expected


def test_solve_json_gives_the_same_numbers(run, tmp_path):
    status, out, _ = run("solve", NAME, NAME, "-o", tmp_path / "r.nc", "--json")
    assert status == 0
    facts = json.loads(out, parse_constant=pytest.fail)
    data = pp.load_solution(tmp_path / "r.nc").dataset
    force = data["force"].to_numpy()[:, 3]
    assert facts["legs"][3]["peak_force"] == force[np.argmax(np.abs(force))]
    assert facts["legs"][3]["length"] == [data["length"][:, 3].min(), data["length"][:, 3].max()]
    assert facts["nearest_to_singular"]["sigma_min"] == data["sigma_min"].min()
    assert facts["power"]["relative_residual"] < 1e-10
    assert facts["coupled"]["legs"] == ["1", "3"]
    assert facts["states"] == data.sizes["time"]
    assert facts["without_answer"] == 0
    assert facts["outcomes"] == []


def test_states_without_answer_give_exit_status_1(run, tmp_path):
    """|cos γ| > 1 in the middle: those states are named, the others solved."""
    n = 9
    motion = motion_file(
        tmp_path / "m.csv",
        time=[0.1 * i for i in range(n)],
        x=[0.0] * n,
        y=[20.0 + 5.0 * i for i in range(n)],
        z=[700.0] * n,
        alpha=[3.0 * (i == 4) for i in range(n)],
        beta=[20.0] * n,
    )
    status, out, err = run("solve", NAME, motion, "-o", tmp_path / "r.nc")
    assert (status, err) == (1, "")
    assert "NO_BRANCH" in out
    solved = pp.load_solution(tmp_path / "r.nc").dataset
    facts = json.loads(run("solve", NAME, motion, "-o", tmp_path / "r.nc", "--json")[1])
    no_branch = next(row for row in facts["outcomes"] if row["status"] == "NO_BRANCH")
    first = int(np.argmax(solved["status"].to_numpy() == pp.Status.NO_BRANCH))
    assert no_branch["first_time"] == pytest.approx(0.1 * first)
    assert facts["without_answer"] >= no_branch["count"] > 0


def test_out_of_stroke_is_reported_but_has_an_answer(run, tmp_path):
    text = pp.load(NAME).to_toml().replace("max = 850.0", "max = 780.0")
    (tmp_path / "short.toml").write_text(text)
    status, out, _ = run("solve", tmp_path / "short.toml", NAME, "-o", tmp_path / "r.csv")
    assert status == 0
    assert "OUT_OF_STROKE" in out


def test_solve_without_any_answer(run, tmp_path):
    motion = motion_file(
        tmp_path / "m.csv",
        time=[0.0, 1.0, 2.0],
        x=[0.0] * 3,
        y=[500.0] * 3,
        z=[700.0] * 3,
        alpha=[0.0] * 3,
        beta=[20.0] * 3,
    )
    status, out, _ = run("solve", NAME, motion, "-o", tmp_path / "r.nc")
    assert status == 1
    assert "none" in out
    status, out, _ = run("solve", NAME, motion, "-o", tmp_path / "r.nc", "--json")
    facts = json.loads(out, parse_constant=pytest.fail)
    assert status == 1
    assert facts["without_answer"] == 3
    assert facts["nearest_to_singular"] is None


def test_long_work_is_solved_in_parts(run, tmp_path, monkeypatch):
    monkeypatch.setattr("polypod.solution.solve.CHUNK", 100)
    status, _, err = run("solve", NAME, NAME, "-o", tmp_path / "r.nc")
    assert (status, err) == (0, "")  # not on a terminal: no bar


# --- wrong input --------------------------------------------------------------------------------------------


def assert_one_message(result, *texts):
    status, out, err = result
    assert (status, out) == (2, "")
    assert err.startswith("polypod: ")
    assert "Traceback" not in err
    for text in texts:
        assert text in err


def test_unknown_mechanism(run):
    assert_one_message(run("info", "nowhere.toml"), "nowhere.toml", NAME)


def test_mechanism_is_a_directory(run, tmp_path):
    assert_one_message(run("info", tmp_path), str(tmp_path))


def test_mechanism_is_binary(run, tmp_path):
    path = tmp_path / "m.toml"
    path.write_bytes(bytes(range(256)))
    assert_one_message(run("info", path), str(path), "UTF-8")


def test_mechanism_is_no_toml(run, tmp_path):
    path = tmp_path / "m.toml"
    path.write_text("name = \n")
    assert_one_message(run("info", path), str(path), "line 1")


def test_all_faults_of_a_mechanism_are_told(run, tmp_path):
    path = tmp_path / "m.toml"
    text = pp.load(NAME).to_toml()
    path.write_text(text.replace("mass = 3.0", "mass = -3.0").replace("[home]", "[hom]"))
    assert_one_message(run("info", path), "platform.mass", "home", "hom")


@pytest.mark.parametrize("motion", ["nowhere.csv", "nowhere.toml", "no-motion"])
def test_unknown_motion(run, tmp_path, motion):
    assert_one_message(run("solve", NAME, motion, "-o", tmp_path / "r.nc"), motion)


def test_motion_of_another_mechanism(run, tmp_path):
    result = run("solve", DATA / "3-rps.toml", NAME, "-o", tmp_path / "r.nc")
    assert_one_message(result, "paper", "pose")


def test_bad_rows_of_a_motion_are_named(run, tmp_path):
    path = tmp_path / "m.csv"
    path.write_text("time [s], x [mm], y [mm], z [mm], alpha [deg], beta [deg]\n0,0,0,0,0,0\n1,0,?,0,0,0\n")
    assert_one_message(run("solve", NAME, path, "-o", tmp_path / "r.nc"), "line 3", "y")


@pytest.mark.parametrize("motion", ["binary.csv", "binary.toml", "directory.csv"])
def test_unreadable_motion(run, tmp_path, motion):
    path = tmp_path / motion
    if motion.startswith("directory"):
        path.mkdir()
    else:
        path.write_bytes(b"\xff\x00\xfe")
    assert_one_message(run("solve", NAME, path, "-o", tmp_path / "r.nc"), motion)


@pytest.mark.parametrize("result", ["r.txt", "r", "nowhere/r.nc", "."])
def test_result_that_cannot_be_written_is_an_error_before_any_work(run, tmp_path, result, monkeypatch):
    monkeypatch.setattr("polypod.mechanism.load", lambda _: pytest.fail("worked first"))
    assert_one_message(run("solve", NAME, NAME, "-o", tmp_path / result))
    assert list(tmp_path.iterdir()) == []


def test_demo_into_a_file(run, tmp_path):
    path = tmp_path / "file"
    path.write_text("mine")
    assert_one_message(run("demo", "-o", path), str(path))
    assert path.read_text() == "mine"


@pytest.mark.parametrize("args", [(), ("nothing",), ("solve", NAME), ("solve", NAME, NAME), ("info", "--x")])
def test_usage_errors(run, args):
    status, out, err = run(*args)
    assert status == 2
    assert "Usage" in out + err
    assert "Traceback" not in out + err


THREE_ROWS = "time [s], z [mm], rx [deg], ry [deg]\n0, 500, 0, 0\n1, 510, 1, 1\n2, 500, 0, 0\n"


def test_solve_does_not_overwrite_its_own_input(run, tmp_path):
    motion = tmp_path / "motion.csv"
    motion.write_text(THREE_ROWS)
    result = run("solve", str(DATA / "3-rps.toml"), str(motion), "-o", str(motion))
    assert_one_message(result, "is an input")
    assert motion.read_text() == THREE_ROWS


def test_samples_go_between_the_rows_of_a_file(run, tmp_path):
    motion, output = tmp_path / "motion.csv", tmp_path / "out.nc"
    motion.write_text(THREE_ROWS)
    run("solve", str(DATA / "3-rps.toml"), str(motion), "-o", str(output), "--samples", "41")
    time = pp.load_solution(output).dataset.time.to_numpy()
    np.testing.assert_allclose(time, np.linspace(0.0, 2.0, 41))


def test_info_draws_the_mechanism(run, tmp_path):
    figure = tmp_path / "machine.png"
    status, out, _ = run("info", str(DATA / "3-rps.toml"), "--draw", str(figure))
    assert (status, out.splitlines()[-1]) == (0, f"Written: {figure}")
    assert figure.read_bytes().startswith(b"\x89PNG")
    assert figure.stat().st_size > 10_000
    _, out, _ = run("info", str(DATA / "3-rps.toml"), "--draw", str(figure), "--json")
    assert json.loads(out)["name"] == "3-rps"


# --- workspace ----------------------------------------------------------------------------------------------


def test_workspace_prints_tables_and_writes_files(run, tmp_path):
    mesh, picture = tmp_path / "w.ply", tmp_path / "w.png"
    status, out, err = run("workspace", NAME, "--step", "80mm", "-o", mesh, "--draw", picture)
    assert (status, err) == (0, "")
    assert "reachable workspace" in out
    assert re.search(r"│ z +│ +\S+ mm │ +[78]\d\d\.\d mm │", out)
    assert re.search(r"volume: 0\.\d+ ± \S+ m\^3", out)
    assert "stroke max of leg 1" in out
    assert mesh.read_bytes().startswith(b"ply")
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_workspace_as_json_is_that_of_python(run, tmp_path):
    path = tmp_path / "w.nc"
    args = ("--vary", "azimuth,tilt", "--fix", "x=0", "--fix", "y=100mm", "--fix", "z=0.7", "--step", "6deg")
    status, out, _ = run("workspace", NAME, *args, "--bounds", "tilt=0:1.2", "-o", path, "--json")
    assert status == 0
    found = pp.workspace(
        pp.load(NAME),
        ["azimuth", "tilt"],
        {"x": 0.0, "y": 0.1, "z": 0.7},
        step=np.radians(6),
        bounds={"tilt": (0.0, 1.2)},
    )
    assert json.loads(out) == found.facts()
    assert pp.load_workspace(path) == found


def test_workspace_by_a_lattice(run):
    status, out, _ = run("workspace", NAME, "--kind", "lattice", "--step", "100mm", "--json")
    assert status == 0
    assert json.loads(out)["nodes"] == 3**5
    status, out, _ = run("workspace", NAME, "--kind", "lattice", "--step", "100mm")
    assert "243 combinations" in out


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (("--step", "0"), "step of x is 0.0"),
        (("--step", "2 parsecs"), "--step: 'parsecs' is no unit"),
        (("--step", "wide"), "--step is 'wide'"),
        (("--step", "3deg"), "--step: 'deg' is no unit of length; valid: m, mm, cm, um, in"),
        (("--vary", "x,alpha", "--step", "3deg"), "such as --step alpha=3deg"),
        (("--vary", "x,alpha", "--step", "3"), "such as --step x=20mm --step alpha=10deg"),
        (("--vary", "x,y", "--step", "alpha=3mm"), "--step alpha: 'mm' is no unit of angle; valid: rad, deg"),
        (("--vary", "x,y,z", "--fix", "alpha=2mm"), "--fix alpha: 'mm' is no unit of angle"),
        (
            ("--vary", "x,y,z", "--fix", "axis_x=2mm"),
            "--fix axis_x is '2mm'; must be a number without a unit",
        ),
        (("--bounds", "z=2deg:3deg"), "--bounds z: 'deg' is no unit of length"),
        (("--bounds", "z=400:950mm"), "both numbers need a unit, such as 400mm:950mm"),
        (
            ("--vary", "x,y,z", "--fix", "alpah=2deg"),
            "--fix: 'alpah' is no coordinate; did you mean \"alpha\"?",
        ),
        (("--kind", "slice"), "needs --vary"),
        (("--kind", "lattice", "-o", "w.stl"), "--output is not for --kind lattice"),
        (("--fix", "x=0"), "--fix is for slices"),
        (("--vary", "x,y,z", "--fix", "alpha"), "--fix is 'alpha'; must be name=value"),
        (("--vary", "x,y,q", "--fix", "alpha=0"), "'q' is none"),
        (("--bounds", "z=3"), "--bounds is 'z=3'; must be name=from:to"),
        (("-o", "w.obj"), "w.obj ends in '.obj'"),
        (("-o", "nowhere/w.stl"), "nowhere is no directory"),
        (("--draw", "w.pdf"), "w.pdf ends in '.pdf'"),
        (("--vary", "alpha,beta", "-o", "w.stl"), "has no mesh"),
        (("--threads", "-2"), "threads is -2"),
    ],
)
def test_workspace_says_what_is_wrong(run, args, message):
    status, out, err = run("workspace", NAME, *args)
    assert (status, out) == (2, "")
    assert err.startswith("polypod: ")
    assert message in err
