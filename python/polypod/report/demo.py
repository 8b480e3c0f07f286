"""The published example from end to end: `polypod demo`."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from polypod import plots
from polypod.mechanism import load
from polypod.motion.motion_file import load_motion
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
from polypod.solution.solution import Solution
from polypod.solution.solve import solve
from polypod.summary.mechanism_facts import describe
from polypod.summary.solution_facts import summarise

EXAMPLE = MECHANISM
"""Built-in mechanism, and the motion of the same name."""


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
    topology = Figure(figsize=(7.0, 4.4), layout="constrained")
    plots.plot_topology(mech.mobility(), topology.add_subplot())
    poses = {"centre pose": mech.home, **_notable_poses(solution)}
    figures = {
        "fig4": plots.plot_fig4(solution, Figure(figsize=(10.0, 10.5))),
        "poses": plots.plot_poses(mech, poses, Figure(figsize=(12.8, 3.5))),
        "topology": topology,
    }
    for name, figure in figures.items():
        for suffix in (".png", ".svg"):
            plots.save_figure(figure, directory / (name + suffix))
            files.append(name + suffix)
    found = section4(mech)
    views = plots.plot_workspace(found.flood, Figure(figsize=(8.0, 7.4)))
    for suffix in (".png", ".svg"):
        plots.save_figure(views, directory / f"fig3{suffix}")
        files.append(f"fig3{suffix}")
    first, third = table_i_markdown(mech), table_iii_markdown(mech, motion, EXAMPLE)
    text = _summary(facts, path, f"## Table I\n\n{first}")
    text += f"\n## Workspace of Section 4\n\n{section4_markdown(found, '`fig3.png`')}"
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


def _notable_poses(solution: Solution) -> dict[str, NDArray[np.float64]]:
    """Two positions far from Z and a large tilt, as in Fig. 1c-e, of those that the motion passes."""
    poses, time = solution.dataset["pose"].to_numpy(), solution.dataset["time"].to_numpy()
    position, upright = poses[:, :3, 3], poses[:, 2, 2]
    first = int(np.argmax(np.linalg.norm(position[:, :2], axis=-1)))
    second = int(np.argmax(np.linalg.norm(position - position[first], axis=-1)))
    other = np.min(np.abs(time[:, None] - time[[first, second]]), axis=1) > 0.2 * (time[-1] - time[0])
    tilted = int(np.argmin(np.where(other, upright, np.inf)))
    tilt = np.degrees(np.arccos(np.clip(upright[tilted], -1.0, 1.0)))

    def far(i: int) -> str:
        return f"{1e3 * np.linalg.norm(position[i, :2]):.0f} mm from $Z$, $t$ = {time[i]:g} s"

    return {
        far(first): poses[first],
        far(second): poses[second],
        f"tilt {tilt:.0f}°, $t$ = {time[tilted]:g} s": poses[tilted],
    }


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
- `fig3.png`: Fig. 3; `fig4.png`: the panels of Fig. 4; `poses.png`: Fig. 1a, c-e; `topology.png`: Fig. 1b;
  all as SVG, too
- `solution.nc`, `solution.csv`: every quantity with its unit; `polypod.load_solution` reads both
- `polypod info {facts["name"]}`: degrees of freedom, constraints, conditioning, warnings
- `polypod solve {facts["name"]} your-motion.csv -o result.nc`: your own motion
"""


def _range(limits: list[float]) -> str:
    return " to ".join(f"{1e3 * value:.1f}" for value in limits)


def _pair(forces: list[float]) -> str:
    return " and ".join(f"{force:.0f}" for force in forces)
