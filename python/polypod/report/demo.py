"""The published example from end to end: `polypod demo`."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from polypod import plots
from polypod.mechanism import Mechanism, load
from polypod.motion.motion import Motion
from polypod.motion.motion_file import load_motion
from polypod.paper.fig1 import fig1_poses
from polypod.paper.section4 import section4
from polypod.paper.sentences.judgements import TURNED, Judged, judge
from polypod.paper.table_i import MECHANISM
from polypod.paper.tables import (
    TABLE_II,
    section4_markdown,
    sentences_markdown,
    table_i_markdown,
    table_iii_markdown,
    verdicts_markdown,
)
from polypod.report.content import gather
from polypod.report.page import render, save
from polypod.solution.solve import solve
from polypod.summary.mechanism_facts import describe
from polypod.summary.solution_facts import summarise

EXAMPLE = MECHANISM
"""Built-in mechanism, and the motion of the same name."""


FIG2_TIME = 4.8
"""Of the instant of the motion that Fig. 2 shows, s."""


@dataclass(frozen=True)
class Demo:
    """Results of the demo, and the files that it wrote."""

    directory: Path
    files: tuple[str, ...]
    mechanism: dict[str, Any]
    """As `polypod info --json`."""
    motion: dict[str, Any]
    """As `polypod solve --json`."""
    text: str
    """The content of summary.md."""


def run_demo(directory: str | PathLike[str]) -> Demo:
    """Solves the built-in manipulator along the built-in motion and writes all results and figures.

    Existing files of the same names are overwritten. Raises OSError where the directory cannot be made or
    written.
    """
    directory = Path(directory)
    directory.mkdir(parents=True, exist_ok=True)
    mech = load(EXAMPLE)
    motion = load_motion(EXAMPLE, mech)
    solution = solve(mech, motion)
    facts, path = describe(mech), summarise(mech, solution)

    files = []
    for name in ("solution.nc", "solution.csv"):
        solution.save(directory / name)
        files.append(name)
    found = section4(mech)
    figures = {
        "fig1": plots.plot_fig1(mech, fig1_poses(mech), Figure(figsize=(10.0, 8.2))),
        "fig2": _fig2(mech, motion),
        "fig3": plots.plot_workspace(found.flood, Figure(figsize=(8.0, 7.4))),
        "fig3-cut": plots.plot_workspace(found.flood, Figure(figsize=(8.0, 6.6)), above=found.cut_at),
        "fig4": plots.plot_fig4(solution, Figure(figsize=(10.0, 10.5))),
    }
    for name, figure in figures.items():
        for suffix in (".png", ".svg"):
            plots.save_figure(figure, directory / (name + suffix))
            files.append(name + suffix)
    first, third = table_i_markdown(mech), table_iii_markdown(mech, motion, EXAMPLE)
    text = _summary(facts, path, f"## Table I\n\n{first}")
    text += f"\n## Workspace of Section 4\n\n{section4_markdown(found, '`fig3.png`')}"
    text += "`fig3-cut.png` shows the part that is cut at the printed height.\n"
    judged = Judged(mech, load(TURNED), motion, found.flood)
    sentences = judge(judged)
    text += f"\n## Table III\n\n{third}\n## The paper's sentences\n\n{verdicts_markdown(sentences)}"
    text += "\nMeasures and numbers are in `report.html`.\n"
    (directory / "summary.md").write_text(text, encoding="utf-8")
    section = section4_markdown(found, "The figure under [Workspace](#workspace)")
    paper = [("Table I", first), ("Table II", TABLE_II), ("Table III", third), ("Section 4", section)]
    paper.append(("Sentences", sentences_markdown(judged, sentences)))
    content = gather(mech, EXAMPLE, workspace=found.flood, paper=paper)
    save(render(content, "polypod demo"), directory / "report.html")
    return Demo(directory, (*files, "report.html", "summary.md"), facts, path, text)


def _fig2(mech: Mechanism, motion: Motion) -> Figure:
    """Vectors and axes of the legs and the rod at one instant of the motion."""
    at = motion.sample([FIG2_TIME])
    state = mech.state(at.coordinates, at.rates, at.second_rates, branch=at.branch)
    figure = Figure(figsize=(10.2, 4.6))
    plots.plot_fig2(mech, state.pose[0], state.twist[0], state.acceleration[0], figure)
    return figure


def _summary(facts: dict[str, Any], path: dict[str, Any], orientations: str) -> str:
    """The content of summary.md; every number is measured."""
    mobility, centre = facts["mobility"], facts["centre_pose"]
    coupled, nearest = path["coupled"], path["nearest_to_singular"]
    low, high = coupled["consistent_over_printed"]
    rows = "\n".join(
        f"| {leg['name']} | {_range(leg['length'])} | {_range(leg['stroke'])} "
        f"| {1e3 * leg['peak_rate']:.1f} | {leg['peak_force']:.0f} |"
        for leg in path["legs"]
    )
    outcomes = [f"{row['count']} states {row['status']}: {row['message']}" for row in path["outcomes"]]
    return f"""# Polypod demo: {facts["name"]}

{facts["description"]}. {facts["source"]}.

## Solved

{path["states"]} states over {path["end"] - path["start"]:g} s of the built-in motion, given in the paper's
five coordinates: γ and the pose; velocities and accelerations of platform, legs, pistons, cylinders and rod;
active and couple-constrained forces under the load of Table II; power and conditioning. The paper's own input
curves are in a figure without numbers; this motion is Polypod's.

| leg | length / mm | stroke / mm | peak speed / mm/s | peak active force / N |
|---|---|---|---|---|
{rows}

- {mobility["dof"]} degrees of freedom; legs {"+".join(leg["joints"] for leg in facts["legs"])}.
- {"; ".join(outcomes) or "All states have an answer, inside the strokes"}.
- Couple-constrained forces f_c1 and f_c3 peak at {_pair(coupled["peak_forces"])} N, the torque T_c on the rod
  at {coupled["peak_torque"]:.0f} N m; {coupled["note"]}.
- Power balance: residual {path["power"]["relative_residual"]:.0e} of the power that flows.
- Nearest to singular at {nearest["time"]:g} s: smallest singular value {nearest["sigma_min"]:.3f}.

{orientations}
## What the paper prints that differs

- Eq. 1: {facts["accounting"]["note"]}.
- Eq. 44 adds f_c1 and f_c3 as if they pointed the same way, against the paper's own c_3 = -c_1 and Eq. 7.
  As printed they peak at {_pair(coupled["peak_forces_as_printed"])} N; the consistent balance gives f_c1
  {low:.1f} to {high:.1f} times as large. The remark that they are small beside the active forces leans on
  it: here they reach {100 * coupled["share_of_active"]:.0f} % of the largest active force.
- Eq. 40 prints the inertial torque -I ε without -ω × I ω. With Table II's isotropic inertias that makes no
  difference; with others it does, and Polypod has it.
- The published design is nearly singular at its centre pose: smallest singular value
  {centre["sigma_min"]:.4f}, largest {centre["sigma_max"]:.2f}. Forces there are large.

## What to look at next

- `report.html`: all of it as one page, with curves to zoom, actuators, reactions, singularities, workspace
- `fig1.png`: Fig. 1; `fig2.png`: Fig. 2 at {FIG2_TIME:g} s of the motion; `fig3.png`: Fig. 3 in full,
  `fig3-cut.png`: its part of the printed height; `fig4.png`: the panels of Fig. 4; all as SVG, too
- `solution.nc`, `solution.csv`: every quantity with its unit; `polypod.load_solution` reads both
- `polypod info {facts["name"]}`: degrees of freedom, constraints, conditioning, warnings
- `polypod solve {facts["name"]} your-motion.csv -o result.nc`: your own motion
"""


def _range(limits: list[float]) -> str:
    return " to ".join(f"{1e3 * value:.1f}" for value in limits)


def _pair(forces: list[float]) -> str:
    return " and ".join(f"{force:.0f}" for force in forces)
