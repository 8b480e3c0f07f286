"""The demo: all files, and a summary with measured numbers."""

from __future__ import annotations

import time
from xml.etree import ElementTree

import matplotlib.image
import numpy as np
import pytest

import polypod as pp
from polypod.paper.table_i import fit_markdown, fit_table_i, table_i
from polypod.report.demo import EXAMPLE, run_demo


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    return run_demo(tmp_path_factory.mktemp("demo") / "made" / "here")


def test_all_files_are_there(demo):
    assert {path.name for path in demo.directory.iterdir()} == set(demo.files)
    assert set(demo.files) == {
        *(
            "fig1.png",
            "fig1.svg",
            "fig2.png",
            "fig2.svg",
            "fig3.png",
            "fig3.svg",
            "fig3-cut.png",
            "fig3-cut.svg",
            "fig4.png",
            "fig4.svg",
        ),
        *("solution.nc", "solution.csv", "summary.md", "report.html"),
    }


@pytest.mark.parametrize("name", ["fig1", "fig2", "fig3", "fig3-cut", "fig4"])
def test_figures_show_something(demo, name):
    picture = matplotlib.image.imread(demo.directory / f"{name}.png")[..., :3]
    assert min(picture.shape[:2]) > 600
    drawn = np.mean(np.any(picture < 0.9, axis=-1))
    assert 0.01 < drawn < 0.6
    root = ElementTree.parse(demo.directory / f"{name}.svg").getroot()
    assert root.tag.endswith("svg")
    assert len(list(root.iter())) > 200


def test_the_workspace_is_compared_with_the_print(demo):
    table = demo.text.split("## Workspace of Section 4")[1]
    assert "| printed | 1350.0 | 1371.0 | 511.0 |" in table
    assert "cut at the printed height" in table
    assert "lattice of lengths in steps of 20 mm" in table


def test_the_sentences_are_judged(demo):
    verdicts = demo.text.split("## The paper's sentences")[1]
    assert "couple-constrained forces are quite small”: false in general" in verdicts
    page = (demo.directory / "report.html").read_text(encoding="utf-8")
    section = page.split("<h3>Sentences</h3>")[1].split("<section")[0]
    assert section.count("<strong>") == verdicts.count("\n- “") > 10
    assert "<td>the same with T_o in N mm</td>" in section


def test_results_load_back(demo):
    mech = pp.load(EXAMPLE)
    expected = pp.solve(mech, pp.load_motion(EXAMPLE, mech))
    assert pp.load_solution(demo.directory / "solution.nc") == expected
    assert pp.load_solution(demo.directory / "solution.csv") == expected


def test_the_example_is_solved_within_the_stroke(demo):
    assert demo.motion["without_answer"] == 0
    assert demo.motion["outcomes"] == []
    for leg in demo.motion["legs"]:
        assert leg["stroke"][0] <= leg["length"][0] < leg["length"][1] <= leg["stroke"][1]
    assert demo.motion["power"]["relative_residual"] < 1e-10


def test_summary_tells_measured_numbers(demo):
    assert (demo.directory / "summary.md").read_text(encoding="utf-8") == demo.text
    data = pp.load_solution(demo.directory / "solution.nc").dataset
    torque = data["coupled_torque"].to_numpy()
    for text in (
        f"{data.sizes['time']} states",
        f"{1e3 * data['length'].to_numpy()[:, 1].max():.1f}",
        f"{torque[np.argmax(np.abs(torque))]:.0f} N m",
        f"smallest singular value {data['sigma_min'].min():.3f}",
        "the published sum is right",
        fit_markdown(table_i(pp.load(EXAMPLE)), fit_table_i(pp.load(EXAMPLE))),
        "Eq. 44",
        "statically indeterminate",
        "polypod info",
    ):
        assert text in demo.text
    for name in (
        "report.html",
        "fig1.png",
        "fig2.png",
        "fig3.png",
        "fig3-cut.png",
        "fig4.png",
        "solution.nc",
        "solution.csv",
    ):
        assert name in demo.text


def test_the_motion_is_compared_with_another_engine(demo):
    pytest.importorskip("pinocchio")
    table = demo.text.split("## Table III")[1]
    assert "| active forces / N |" in table
    assert "81 of 81 states compared; all errors within 1e-09." in table


def test_without_the_engine_the_summary_says_what_to_install(monkeypatch):
    from polypod.paper.tables import table_iii_markdown
    from polypod.verify import engines

    monkeypatch.setattr(engines, "find_spec", lambda module: None)
    mech = pp.load(EXAMPLE)
    assert "pip install polypod[verify]" in table_iii_markdown(mech, pp.load_motion(EXAMPLE, mech), EXAMPLE)


def test_a_second_run_gives_the_same_files(demo, tmp_path):
    again = run_demo(tmp_path)
    for name in again.files:
        if not name.endswith(".png"):
            assert (again.directory / name).read_bytes() == (demo.directory / name).read_bytes(), name


def test_directory_cannot_be_made(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match="file"):
        run_demo(tmp_path / "file")


@pytest.mark.slow
def test_demo_is_quick(tmp_path):
    start = time.process_time()
    run_demo(tmp_path)
    assert time.process_time() - start < 40.0
