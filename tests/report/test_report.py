"""The report: its numbers and words, without a browser."""

from __future__ import annotations

import base64
import dataclasses
import json
import re
from importlib.resources import files

import numpy as np
import pytest

import polypod as pp
from polypod.report.decimate import POINTS, kept, spans
from polypod.report.formulas import to_html
from polypod.report.reactions import reactions_along, reactions_table
from polypod.solution.actuator_sizing import leg_power, requirements, rms_over_time
from polypod.solution.solve import CHUNK
from polypod.summary.solution_facts import summarise
from polypod.summary.tables import fixed
from support import DATA, ROOT

NAME = "lu-3spu-2rpu-r"
TRIPOD = (ROOT / "docs" / "mechanism-file.md").read_text(encoding="utf-8")
TRIPOD = TRIPOD.split('```toml title="tripod.toml"\n')[1].split("```")[0]


@pytest.fixture(scope="module")
def mech():
    return pp.load(NAME)


@pytest.fixture(scope="module")
def motion(mech):
    return pp.load_motion(NAME, mech)


@pytest.fixture(scope="module")
def solution(mech, motion):
    return pp.solve(mech, motion)


@pytest.fixture(scope="module")
def html(mech, solution):
    """The page on the paper's manipulator along its motion, without a workspace."""
    return pp.report_html(mech, solution, workspace=False)


def with_first_rows(motion: pp.Motion, rows: int) -> pp.Motion:
    parts = {
        name: {key: values[:rows] for key, values in getattr(motion, name).items()}
        for name in ("coordinates", "rates", "second_rates")
    }
    return dataclasses.replace(motion, time=motion.time[:rows], curve=None, **parts)


def page_data(html: str) -> dict:
    return json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', html, re.S)[1])


def doubles(text: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), dtype="<f8")


# --- actuators ----------------------------------------------------------------------------------------------


def test_rms_of_a_sine_at_uneven_instants():
    time = np.linspace(0.0, 1.0, 4001) ** 2
    assert rms_over_time(time, 3.0 * np.sin(2 * np.pi * time)) == pytest.approx(3.0 / np.sqrt(2.0), rel=1e-6)


def test_rms_leaves_gaps_out():
    time, values = np.array([0.0, 1.0, 2.0, 10.0, 11.0]), np.array([2.0, 2.0, np.nan, 4.0, 4.0])
    assert rms_over_time(time, values) == pytest.approx(np.sqrt((4.0 + 16.0) / 2))


@pytest.mark.parametrize(
    ("values", "expected"), [([-3.0], 3.0), ([np.nan], None), ([1.0, np.nan, 2.0], None)]
)
def test_rms_of_single_values(values, expected):
    assert rms_over_time(np.arange(len(values), dtype=float), np.array(values)) == expected


def test_requirements_agree_with_what_solve_tells(mech, solution):
    rows, facts = requirements(mech, solution), summarise(mech, solution)
    for row, leg in zip(rows, facts["legs"], strict=True):
        assert row["leg"] == leg["name"]
        assert row["force"]["peak"] == leg["peak_force"]
        assert row["speed"]["peak"] == leg["peak_rate"]
        assert [row["stroke"]["least"], row["stroke"]["greatest"]] == leg["length"]
        assert row["stroke"]["share"] == pytest.approx((leg["length"][1] - leg["length"][0]) / 0.2)
        assert abs(row["power"]["peak"]) >= row["power"]["rms"] > 0.0


def test_powers_of_the_legs_add_up_to_that_of_all_actuators(solution):
    total = solution.dataset["actuator_power"].to_numpy()
    assert np.allclose(leg_power(solution).sum(axis=1), total, rtol=0, atol=1e-9 * np.abs(total).max())


def test_passive_legs_are_no_actuators():
    tripod = pp.Mechanism.from_toml(TRIPOD)
    path = pp.Motion.through([0.0, 1.0], {"x": [0, 0.02], "y": [0, 0], "z": [0.6, 0.62]}, set="pose")
    assert [row["leg"] for row in requirements(tripod, pp.solve(tripod, path))] == ["1", "2", "3"]


def test_small_peaks_keep_their_figures_and_no_zero_is_negative():
    """A planar mechanism, whose actuators carry no weight."""
    planar = pp.load(ROOT / "docs" / "mechanisms" / "planar.toml")
    path = pp.Motion.through([0.0, 4.0], {"x": [0, 0.01], "y": [0, 0.01], "rz": [0.52, 0.6]}, set="pose")
    solution = pp.solve(planar, path.sample(np.linspace(0.0, 4.0, 21)))
    html = pp.report_html(planar, solution, workspace=False)
    glance = dict(re.findall(r"<dt>(.*?)</dt><dd>(.*?)</dd>", html))
    peak, unit = glance["peak force"].split()
    largest = float(np.max(np.abs(solution.dataset["force"].to_numpy())))
    assert unit == "N"
    assert float(peak) == pytest.approx(largest, rel=5e-3)
    assert 0.0 < largest < 0.5
    assert ">-0.0<" not in html


# --- fewer points -------------------------------------------------------------------------------------------


def test_peaks_of_every_curve_are_kept():
    rng = np.random.default_rng(1)
    values = rng.normal(size=(1_000_000, 5))
    values[123_457, 2], values[999_998, 4] = 50.0, -60.0
    at = kept(values)
    assert len(at) <= POINTS + 2
    assert np.array_equal(values[at].max(axis=0), values.max(axis=0))
    assert np.array_equal(values[at].min(axis=0), values.min(axis=0))
    assert (at[0], at[-1]) == (0, 999_999)
    assert np.all(np.diff(at) > 0)


def test_a_peak_in_each_stretch_is_kept():
    values = np.zeros((100_000, 1))
    values[::1000] = 1.0
    assert values[kept(values)].sum() == 100.0


def test_gaps_stay_gaps():
    values = np.linspace(0.0, 1.0, 100_000)[:, None].copy()
    values[70_000:70_003] = np.nan
    at = kept(values)
    assert {70_000, 70_002} <= {*at.tolist()}
    assert np.isnan(values[at]).sum() == 2


def test_short_curves_are_whole():
    assert np.array_equal(kept(np.zeros((POINTS, 3))), np.arange(POINTS))


def test_spans_of_flags():
    assert spans(np.array([0, 1, 1, 0, 1], dtype=bool)) == [(1, 2), (4, 4)]
    assert spans(np.zeros(3, dtype=bool)) == []
    many = np.arange(1_000_000) % 2 == 0
    assert spans(many) == [(0, 999_998)]


# --- formulas -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "html"),
    [
        ("velocity $v$ / mm s$^{-1}$", "velocity <i>v</i> / mm s<sup>−1</sup>"),
        (r"$f_{a\mathrm{left\ one}}$", "<i>f</i><sub><i>a</i>left one</sub>"),
        (r"$\sigma_\mathrm{min}$", "<i>σ</i><sub>min</sub>"),
        (r"$\varepsilon_x$", "<i>ε</i><sub><i>x</i></sub>"),
        ("<b> & $<$", "&lt;b&gt; &amp; &lt;"),
    ],
)
def test_formulas_become_html(text, html):
    assert str(to_html(text)) == html


def test_no_formula_of_the_curves_is_left_over(html):
    """All mathematics of the figures has its HTML: no command and no brace remains."""
    data = page_data(html)
    texts = [chart["label"] for chart in data["charts"]]
    texts += [curve["name"] for chart in data["charts"] for curve in chart["curves"]]
    assert len(data["charts"]) > 40
    assert not [text for text in texts if re.search(r"[\\{}$^]", text)]


# --- reactions ----------------------------------------------------------------------------------------------


def test_reactions_are_those_of_solve(mech, motion):
    data = pp.solve(mech, motion, reactions=True).dataset
    found = reactions_along(mech, pp.solve(mech, motion))
    assert np.array_equal(found.force, np.linalg.norm(data["reaction"].to_numpy()[..., :3], axis=-1))
    assert np.array_equal(found.torque, np.linalg.norm(data["reaction"].to_numpy()[..., 3:], axis=-1))
    assert np.array_equal(
        found.undetermined, ~data["reaction_determinate"].to_numpy().astype(bool).all(axis=0)
    )
    assert found.undetermined.any()


def test_a_state_of_a_long_motion_has_the_reactions_that_it_has_alone(mech):
    """Beyond one chunk, too: the table's peaks are those of all states."""
    motion = pp.load_motion(NAME, mech).sample(np.linspace(0.0, 8.0, CHUNK + 1003))
    solution = pp.solve(mech, motion)
    found = reactions_along(mech, solution)
    data = solution.dataset
    motions = (data[name].to_numpy() for name in ("pose", "twist", "acceleration", "wrench"))
    whole = mech.joint_reactions(*motions, data.attrs["wrench_axes"]).reactions
    assert np.array_equal(found.time, data["time"].to_numpy())
    assert np.array_equal(found.force, np.linalg.norm(whole[..., :3], axis=-1))
    assert np.array_equal(found.torque, np.linalg.norm(whole[..., 3:], axis=-1))
    table = reactions_table(found)
    assert [row[3] for row in table.rows] == [fixed(peak) for peak in found.force.max(axis=0)]


# --- the page -----------------------------------------------------------------------------------------------


def outside(html: str) -> list[str]:
    """Addresses that a browser would fetch from elsewhere."""
    page = re.sub(r"<script.*?</script>|<pre>.*?</pre>", "", html, flags=re.S)
    found = re.findall(r'(?:src|href|url)\s*[=(]\s*["\']?([^"\'\s>)]+)', page)
    return [address for address in found if not address.startswith(("#", "data:"))]


@pytest.mark.parametrize("name", ["3-rps", "stewart-gough", "ups-hexapod", "tripod"])
def test_a_report_without_motion(name):
    if name == "tripod":
        mech = pp.Mechanism.from_toml(TRIPOD)
    else:
        mech = pp.load(name if name == "ups-hexapod" else DATA / f"{name}.toml")
    html = pp.report_html(mech, step=None if name == "3-rps" else 0.15)
    assert f"<h1>{name}</h1>" in html
    assert 'id="workspace"' in html
    assert 'id="actuators"' not in html
    assert "Table I" not in html
    assert not outside(html)
    # The o of this one does not move freely in space: its workspace is one of its own coordinates.
    assert ("All values that z, rx and ry can take together" in html) == (name == "3-rps")
    assert ('id="space"' in html) == (name != "3-rps")


def test_a_slice_in_a_report_is_told_as_one(mech):
    """Angles are not drawn in space, as if they were lengths."""
    tilts = pp.workspace(mech, ["azimuth", "tilt"], {"x": 0.0, "y": 0.1, "z": 0.7}, step=0.2)
    html = pp.report_html(mech, workspace=tilts)
    assert "All values that azimuth and tilt can take together inside all limits at x = 0.0 mm" in html
    assert 'id="space"' not in html
    reach = pp.workspace(mech, ["x", "y", "z"], {"alpha": 0.1, "beta": 0.6}, step=0.1)
    assert 'id="space"' in pp.report_html(mech, workspace=reach)


def test_a_report_says_why_it_has_no_workspace():
    data = pp.load(DATA / "3-rps.toml").to_dict()
    for leg in data["legs"]:
        del leg["stroke"]
    html = pp.report_html(pp.Mechanism.from_dict(data))
    assert "None was found: bounds.x: 3-rps has no strokes that bound it" in html


@pytest.mark.parametrize("rows", [1, 2, 3])
def test_motions_of_few_rows(mech, motion, rows):
    html = pp.report_html(mech, with_first_rows(motion, rows), workspace=False)
    assert f"{rows} state" in html
    data = page_data(html)
    assert len(doubles(data["times"][0])) == rows
    assert f"{1e3 * pp.solve(mech, motion).dataset['length'].to_numpy()[0, 0]:.1f}" in html


def test_three_and_four_legs_along_a_motion():
    tripod = pp.Mechanism.from_toml(TRIPOD)
    path = pp.Motion.through([0.0, 1.0], {"x": [0, 0.02], "y": [0, 0], "z": [0.6, 0.62]}, set="pose")
    html = pp.report_html(tripod, path.sample(np.linspace(0, 1, 11)), workspace=False)
    assert "Leg middle" in html
    assert "made in Python" in html
    assert "time [s], x [m], y [m], z [m]\n0.0, 0.0, 0.0, 0.6\n" in html


def test_the_charts_hold_the_librarys_numbers(html, solution):
    data = page_data(html)
    lengths = next(chart for chart in data["charts"] if chart["label"].startswith("leg length"))
    assert np.array_equal(doubles(data["times"][lengths["time"]]), solution.dataset["time"].to_numpy())
    for i, curve in enumerate(lengths["curves"]):
        assert np.array_equal(doubles(curve["values"]), 1e3 * solution.dataset["length"].to_numpy()[:, i])
    assert lengths["levels"] == [650.0, 850.0]


def test_states_without_an_answer_are_counted_and_marked(mech, motion):
    """In the middle the platform is asked for a place beside which no γ exists."""
    y = np.array(motion.coordinates["y"])
    y[300:340] = 3.0
    bad = dataclasses.replace(motion, coordinates={**motion.coordinates, "y": y}, curve=None)
    solution = pp.solve(mech, bad)
    lost = int((solution.dataset["status"] == pp.Status.NO_BRANCH).sum())
    assert lost == 40
    html = pp.report_html(mech, bad, workspace=False)
    assert f"{lost} of 801 states have no answer" in html
    assert f"{lost} of 801 states are NO_BRANCH" in html
    data = page_data(html)
    marks = [mark for mark in data["marks"] if mark["kind"] == "none"]
    time = motion.time
    assert [(mark["from"], mark["to"]) for mark in marks] == [(time[299], time[340])]
    forces = next(chart for chart in data["charts"] if chart["label"].startswith("active force"))
    assert np.isnan(doubles(forces["curves"][0]["values"])).sum() == 40


def test_tables_of_the_paper_belong_to_its_mechanism(mech, html):
    assert "<h3>Table I</h3>" in html
    assert "<h3>Table II</h3>" in html
    changed = mech.to_dict()
    changed["platform"]["mass"] = 3.5
    other = pp.report_html(pp.Mechanism.from_dict(changed), workspace=False)
    assert "<h3>Table" not in other


def test_inputs_are_there_in_full(mech):
    html = pp.report_html(mech, NAME, samples=11, workspace=False, command="polypod report 'a b'")
    text = html.replace("&#34;", '"').replace("&#39;", "'").replace("&gt;", ">").replace("&lt;", "<")
    assert mech.to_toml() in text
    assert "largest\n# variation of all five coordinates" in text
    assert "polypod report 'a b'" in text
    assert f"polypod {pp.__version__}" in text


def test_a_simulation_has_a_report(mech):
    pose = mech.pose({"alpha": 0.1, "p": -0.3, "h": 0.7, "beta": 0.7, "gamma": 0.5})
    html = pp.report_html(mech, pp.simulate(mech, pose, until=0.05, step=0.01), workspace=False)
    assert "A solution was given" in html


def test_names_of_files_are_text():
    data = pp.load(DATA / "stewart-gough.toml").to_dict()
    data["name"] = "<script>window.stolen = 1</script>"
    data["description"] = "</title></style><img src=x onerror=alert(1)>"
    data["legs"][0]["name"] = "<img src=x onerror=alert(2)>"
    data["legs"][1]["name"] = "</script><script>window.stolen = 2</script>"
    html = pp.report_html(pp.Mechanism.from_dict(data), workspace=False)
    assert "<script>window.stolen" not in html
    assert "<img src=x" not in html
    assert "&lt;script&gt;window.stolen = 1&lt;/script&gt;" in html


def test_assets_are_in_the_package():
    found = {entry.name for entry in (files("polypod") / "report").iterdir()}
    assert {"page.html.jinja", "page.css", "page.js"} <= found


# --- on the command line ------------------------------------------------------------------------------------


def test_report_writes_a_page(run, tmp_path):
    page = tmp_path / "page.html"
    status, out, err = run("report", NAME, NAME, "-o", page, "--samples", 21, "--no-workspace")
    assert (status, err) == (0, "")
    assert out.split("Written: ")[1].replace("\n", "") == str(page)
    html = page.read_text(encoding="utf-8")
    assert f"polypod report {NAME} {NAME} -o {page} --samples 21 --no-workspace" in html
    assert "21 states from 0 s to 8 s" in html
    assert "It was left out." in html


def test_report_tells_of_lost_states_by_its_status(run, tmp_path):
    motion = tmp_path / "motion.csv"
    rows = ["0, -326, 210, 600, -16, 26", "1, -300, 3000, 600, -16, 26", "2, -326, 210, 600, -16, 26"]
    motion.write_text("time [s], x [mm], y [mm], z [mm], alpha [deg], beta [deg]\n" + "\n".join(rows))
    status, _, err = run("report", NAME, motion, "-o", tmp_path / "page.html", "--no-workspace")
    assert (status, err) == (1, "")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["-o", "page.pdf"], "page.pdf ends in '.pdf'; a result's file ends in .html"),
        (["-o", "nowhere/page.html"], "nowhere is no directory"),
        (["--step", "20mm", "--no-workspace"], "--step is for the workspace"),
        (["--step", "fast"], "--step is 'fast'; must be a number such as 20mm"),
        (["--samples", "10"], "--samples: there is no MOTION to sample"),
        (["no-such-motion"], "there is no built-in motion"),
    ],
)
def test_report_refuses(run, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    status, out, err = run("report", NAME, *arguments)
    assert (status, out) == (2, "")
    assert message in err
    assert not [*tmp_path.iterdir()]
