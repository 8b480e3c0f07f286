"""The report in a real browser: what it shows, how it answers, and that it asks the network for nothing."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import polypod as pp
from polypod.report.decimate import POINTS
from polypod.solution.actuator_sizing import requirements
from support import DATA

NAME = "lu-3spu-2rpu-r"

FORCES = 9
"""Panel (j) of Fig. 4: active forces, in kN."""


@pytest.fixture(scope="module")
def solution():
    mech = pp.load(NAME)
    return pp.solve(mech, pp.load_motion(NAME, mech))


@pytest.fixture(scope="module")
def paper(tmp_path_factory):
    """The page on the paper's manipulator along its motion."""
    path = tmp_path_factory.mktemp("report") / "paper.html"
    pp.write_report(pp.load(NAME), path, NAME, step=0.08, command=f"polypod report {NAME} {NAME}")
    return path


@pytest.fixture(scope="module")
def hexapod(tmp_path_factory):
    """The page on a 6-UPS, whose legs leave their strokes in between."""
    mech = pp.load("ups-hexapod")
    waypoints = {
        **{"x": [0.0, 0.2, -0.2, 0.0], "y": [0.0, 0.1, 0.2, 0.0], "z": [2.0, 2.3, 2.9, 2.0]},
        **{"rx": [0.0, 0.2, -0.2, 0.0], "ry": [0.0, 0.1, 0.2, 0.0], "rz": [0.0, 0.0, 0.3, 0.0]},
    }
    motion = pp.Motion.through([0.0, 1.0, 2.0, 3.0], waypoints, set="pose", name="up and round")
    path = tmp_path_factory.mktemp("report") / "hexapod.html"
    pp.write_report(mech, path, motion, samples=301, step=0.2)
    return path


@pytest.fixture
def show(browser, watch):
    """Opens a page in a browser that has no network; in the end it must not have asked for any."""
    contexts, watched = [], []

    def show(path: Path, *, width: int = 1320, height: int = 900, scheme: str = "light"):
        viewport = {"width": width, "height": height}
        contexts.append(browser.new_context(viewport=viewport, color_scheme=scheme, offline=True))
        page = contexts[-1].new_page()
        watched.append(watch(page))
        page.goto(path.as_uri())
        return page

    yield show
    for context in contexts:
        context.close()
    for seen in watched:
        assert (seen.errors, seen.requests, seen.failed) == ([], [], [])


def chart(page, index: int):
    """The plot of a chart, drawn and in view."""
    plot = page.locator(f'[data-chart="{index}"] .plot')
    plot.scroll_into_view_if_needed()
    plot.locator(".main-svg").first.wait_for()
    return plot


def time_range(page, index: int) -> list[float]:
    return chart(page, index).evaluate("node => [...node.layout.xaxis.range]")


def numbers_of(page, index: int) -> list[float]:
    """Values beside the names of a chart's curves."""
    texts = page.locator(f'[data-chart="{index}"] output').all_inner_texts()
    return [float(text.replace("−", "-")) for text in texts]


def photograph(page, path: Path) -> None:
    """The whole page, after all of it has been in view."""
    height = page.evaluate("document.documentElement.scrollHeight")
    for y in range(0, height, 700):
        page.evaluate(f"window.scrollTo(0, {y})")
        page.wait_for_timeout(150)
    page.evaluate("window.scrollTo(0, 0)")
    page.wait_for_timeout(1000)
    page.screenshot(path=path, full_page=True)


# --- what it shows ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["paper", "hexapod"])
def test_the_page_opens_without_errors_and_without_a_network(name, show, screenshots, request):
    page = show(request.getfixturevalue(name))
    photograph(page, screenshots / f"report-{name}.png")
    wide, seen = page.evaluate("[document.documentElement.scrollWidth, window.innerWidth]")
    assert wide <= seen
    assert page.locator("#space canvas").count() > 0
    drawn = page.locator(".chart .plot:has(.main-svg)").count()
    assert drawn == page.locator(".chart:visible").count() > 25


def test_numbers_in_tables_are_the_librarys(show, paper, solution):
    page = show(paper)
    rows = requirements(pp.load(NAME), solution)
    cells = page.locator("#actuators tbody tr").nth(3).locator("td").all_inner_texts()
    force, speed, power = (rows[3][key] for key in ("force", "speed", "power"))
    expected = [force["peak"], force["rms"], 1e3 * speed["peak"], 1e3 * speed["rms"]]
    expected += [power["peak"], power["rms"]]
    assert cells[1:7] == [f"{value:.1f}" for value in expected]
    assert force["peak"] == solution.dataset["force"].to_numpy()[:, 3].min()


def test_hovering_shows_the_librarys_numbers_in_all_charts(show, paper, solution, screenshots):
    page = show(paper)
    chart(page, 0)
    plot = chart(page, FORCES)
    box = plot.bounding_box()
    page.mouse.move(box["x"] + 0.55 * box["width"], box["y"] + 0.5 * box["height"])
    page.locator("#time:visible").wait_for()
    time = float(page.locator("#time").inner_text().split()[2])
    at = int(np.argmin(np.abs(solution.dataset["time"].to_numpy() - time)))
    assert solution.dataset["time"].to_numpy()[at] == pytest.approx(time, rel=1e-4)
    assert 0.3 < at / 801 < 0.7
    near = {"rel": 1e-4}  # five digits are shown
    force, position = solution.dataset["force"].to_numpy()[at], solution.dataset["pose"].to_numpy()[at, :3, 3]
    assert numbers_of(page, FORCES) == pytest.approx(force / 1e3, **near)
    assert numbers_of(page, 0) == pytest.approx(1e3 * position, **near)
    assert page.locator(".cursor:visible").count() >= 2
    buttons = plot.locator(".modebar-btn").evaluate_all("nodes => nodes.map((n) => n.dataset.title)")
    assert len(buttons) == 6, buttons  # none that leads to a service elsewhere
    page.screenshot(path=screenshots / "report-curves.png")


def test_zooming_one_chart_moves_the_time_axes_of_all(show, paper):
    page = show(paper)
    assert time_range(page, 0) == [0.0, 8.0]
    box = chart(page, FORCES).bounding_box()
    middle = box["y"] + 0.45 * box["height"]
    page.mouse.move(box["x"] + 0.4 * box["width"], middle)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.7 * box["width"], middle, steps=8)
    page.mouse.up()
    page.wait_for_function("document.querySelector('[data-chart=\"9\"] .plot').layout.xaxis.range[0] > 1")
    moved = time_range(page, FORCES)
    assert 1.5 < moved[0] < 3.5 < 4.5 < moved[1] < 6.5
    assert time_range(page, 0) == moved
    assert time_range(page, 30) == moved  # was not drawn before
    page.mouse.move(0, 0)
    box = chart(page, 4).bounding_box()
    page.mouse.dblclick(box["x"] + 0.5 * box["width"], box["y"] + 0.45 * box["height"])
    page.wait_for_function("document.querySelector('[data-chart=\"9\"] .plot').layout.xaxis.range[0] == 0")
    assert time_range(page, FORCES) == time_range(page, 30) == [0.0, 8.0]


def test_states_out_of_stroke_are_marked_in_every_chart(show, hexapod):
    page = show(hexapod)
    assert page.locator(".warnings").inner_text().count("Limit passed: stroke max") >= 1
    shapes = chart(page, 0).evaluate("node => node.layout.shapes.map((shape) => shape.fillcolor)")
    assert "#fbe7bd" in shapes
    assert page.locator(".mark.beyond").count() == 1


def test_the_workspace_can_be_seen_through(show, paper):
    page = show(paper)
    page.locator("#space").scroll_into_view_if_needed()
    page.locator("#space canvas").first.wait_for()
    opacity = "document.getElementById('space').data.map((trace) => trace.opacity)"
    assert page.evaluate(opacity)[0] == 1
    page.locator("#through").check()
    page.wait_for_function(f"{opacity}[0] < 0.5")


LABELS = """() => [...document.querySelectorAll(".chart .plot")].filter((node) => node.layout).map((node) => {
  const box = (it) => it.getBoundingClientRect();
  const picture = box(node.querySelector(".main-svg")), title = box(node.querySelector(".ytitle"));
  const ticks = [...node.querySelectorAll(".ytick text")].map(box);
  return {
    label: node.layout.yaxis.title.text,
    outside: Math.max(picture.top - title.top, title.bottom - picture.bottom, picture.left - title.left),
    over: Math.max(...ticks.map((tick) => title.right - tick.left)),
  };
})"""


@pytest.mark.parametrize("printing", [False, True])
def test_labels_of_axes_are_whole_and_clear_of_the_numbers(show, hexapod, printing):
    page = show(hexapod)
    page.evaluate("window.dispatchEvent(new Event('beforeprint'))")  # draws all charts
    if not printing:
        page.evaluate("window.dispatchEvent(new Event('afterprint'))")
    page.wait_for_timeout(1000)
    found = page.evaluate(LABELS)
    assert len(found) > 25
    assert any("<br>" in each["label"] for each in found)
    assert [each for each in found if each["outside"] > 0.5 or each["over"] > 0.5] == []


def test_no_axis_is_stretched_for_rounding(show, hexapod):
    """Balls take no torque; what is computed is not exactly none."""
    page = show(hexapod)
    page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    script = """node => [node.layout.yaxis.title.text, node.layout.yaxis.range,
                         Math.max(...node.data.flatMap((curve) => [...curve.y].map(Math.abs)))]"""
    labels = page.locator(".chart .plot:has(.main-svg)").evaluate_all(f"nodes => nodes.map({script})")
    (torque,) = (each for each in labels if re.sub("<[^>]*>", "", each[0]).startswith("torque |T|, platform"))
    (_, (low, high), largest) = torque
    assert 0.0 < largest < 1e-3 * high
    assert low == -high
    assert high < 1e-3  # N m, where forces are kN


# --- hostile names, long motions ----------------------------------------------------------------------------


def test_names_cannot_become_elements(show, tmp_path):
    data = pp.load(DATA / "stewart-gough.toml").to_dict()
    data["name"] = "<script>window.stolen = 1</script>"
    data["legs"][0]["name"] = "<img src=x onerror='window.stolen = 2'>"
    data["legs"][1]["name"] = "</script><script>window.stolen = 3</script>"
    data["legs"][2]["name"] = "$x$ %{y} <b>3</b>"
    mech = pp.Mechanism.from_dict(data)
    rows = {name: [0.0, 0.01] for name in ("x", "y", "rx", "ry", "rz")} | {"z": [0.6, 0.62]}
    motion = pp.Motion.through([0.0, 1.0], rows, set="pose", name="<script>window.stolen = 4</script>")
    pp.write_report(mech, tmp_path / "page.html", motion, samples=11, step=0.1)
    page = show(tmp_path / "page.html")
    photograph(page, tmp_path / "page.png")
    assert page.evaluate("window.stolen") is None
    assert page.locator("h1").inner_text() == data["name"]
    assert page.locator("#legs summary").nth(1).inner_text() == f"Leg {data['legs'][1]['name']}"
    assert page.locator('img:not([src^="data:"])').count() == 0
    assert page.locator("script").count() == 4


def test_only_the_pages_own_scripts_run(browser, paper):
    """The policy in the page's head stops any other one, should text ever become an element."""
    page = browser.new_page()
    html = paper.read_text(encoding="utf-8").replace("</main>", "<script>window.stolen = 1</script></main>")
    other = paper.with_name("other.html")
    other.write_text(html, encoding="utf-8")
    page.goto(other.as_uri())
    assert page.evaluate("window.stolen") is None
    assert page.evaluate("typeof Plotly") == "object"
    page.close()


def test_a_long_motion_is_drawn_with_fewer_points_and_says_so(show, tmp_path):
    mech = pp.load(NAME)
    motion = pp.load_motion(NAME, mech).sample(np.linspace(0.0, 8.0, 20_001))
    solution = pp.solve(mech, motion)
    pp.write_report(mech, tmp_path / "page.html", solution, workspace=False)
    page = show(tmp_path / "page.html")
    assert "The motion has 20001 states." in page.locator("#decimated").inner_text()
    drawn = chart(page, FORCES).evaluate("node => node.data.map((curve) => [...curve.y])")
    force = solution.dataset["force"].to_numpy() / 1e3
    assert {len(curve) for curve in drawn} < {*range(100, POINTS + 3)}
    assert [max(curve) for curve in drawn] == force.max(axis=0).tolist()
    assert [min(curve) for curve in drawn] == force.min(axis=0).tolist()


# --- dark, narrow, printed ----------------------------------------------------------------------------------


def luminance(page, selector: str, what: str) -> float:
    script = f"getComputedStyle(document.querySelector('{selector}')).{what}"
    red, green, blue = (int(x) / 255 for x in re.findall(r"\d+", page.evaluate(script))[:3])
    return 0.2126 * red**2.2 + 0.7152 * green**2.2 + 0.0722 * blue**2.2


@pytest.mark.parametrize(("scheme", "width"), [("dark", 1320), ("light", 390), ("dark", 390)])
def test_dark_and_narrow_windows_are_readable(scheme, width, show, paper, screenshots):
    page = show(paper, width=width, scheme=scheme)
    chart(page, FORCES)
    photograph(page, screenshots / f"report-{scheme}-{width}.png")
    wide, seen = page.evaluate("[document.documentElement.scrollWidth, window.innerWidth]")
    assert wide <= seen
    paper_color = luminance(page, "body", "backgroundColor")
    for selector, what in (("body", "color"), ("th", "color"), (".xtick text", "fill"), (".c0", "color")):
        ink = luminance(page, selector, what)
        contrast = (max(ink, paper_color) + 0.05) / (min(ink, paper_color) + 0.05)
        assert contrast > 4.5, (selector, contrast)


def test_no_tool_bar_lies_over_printed_charts(show, paper):
    page = show(paper)
    chart(page, FORCES)
    page.emulate_media(media="print")
    bars = "[...document.querySelectorAll('.modebar')].map(bar => getComputedStyle(bar).display)"
    shown = page.evaluate(bars)
    assert shown
    assert set(shown) == {"none"}


def test_the_page_prints(show, paper, screenshots):
    page = show(paper, scheme="dark")
    pdf = page.pdf(path=screenshots / "report-paper.pdf", prefer_css_page_size=True)
    assert pdf.startswith(b"%PDF")
    assert 8 <= len(re.findall(rb"/Type\s*/Page\b", pdf)) <= 20
    page.wait_for_timeout(300)
    # All charts were drawn for it, and are as wide as the window again.
    drawn = page.locator(".chart .plot:has(.main-svg)")
    assert drawn.count() == page.locator(".chart:visible").count()
    width = page.locator('[data-chart="0"] .main-svg').first.bounding_box()["width"]
    assert width > 345


def test_charts_are_light_and_fit_the_paper_while_printing(show, paper):
    page = show(paper, scheme="dark")
    page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    about = page.locator('[data-chart="9"] .plot').evaluate("n => [n.layout.width, n.layout.font.color]")
    assert about == [342, "#262626"]
