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
from polypod.errors import MissingEngineError
from polypod.mechanism import Mechanism, load
from polypod.motion import Motion, load_motion
from polypod.paper import fit_markdown, fit_table_i, table_i
from polypod.results import Solution
from polypod.section4 import Section4, as_markdown, section4
from polypod.solution import solve
from polypod.summary import describe, summarise
from polypod.verify import verify
from polypod.verify.report import as_markdown as verification_markdown

EXAMPLE = "lu-3spu-2rpu-r"
"""Built-in mechanism, and the motion of the same name."""

COMPARED = 81
"""States of the motion that are compared with another engine."""


@dataclass(frozen=True)
class Demo:
    """What the demo found, and the files that it wrote."""

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
    text = _summary(facts, path, _table_i(mech)) + _workspace_summary(found)
    text += _table_iii(mech, motion)
    (directory / "summary.md").write_text(text, encoding="utf-8")
    return Demo(directory, (*files, "summary.md"), facts, path, text)


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

- {mobility["dof"]} freedoms; legs {"+".join(leg["joints"] for leg in facts["legs"])}.
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

- `fig3.png`: Fig. 3; `fig4.png`: the panels of Fig. 4; `poses.png`: Fig. 1a, c-e; `topology.png`: Fig. 1b;
  all as SVG, too
- `solution.nc`, `solution.csv`: every quantity with its unit; `polypod.load_solution` reads both
- `polypod info {facts["name"]}`: freedoms, constraints, conditioning, warnings
- `polypod solve {facts["name"]} your-motion.csv -o result.nc`: your own motion
"""


def _table_i(mech: Mechanism) -> str:
    """The part of summary.md on Table I; every number is measured."""
    first, fit = table_i(mech), fit_table_i(mech)
    fitted = fit.orientations
    e, on_rod, other = 1e3 * fit.radii
    rms, largest = np.degrees([first.rms, fitted.rms]), np.degrees([first.largest, fitted.largest])
    skew = 1e3 * abs(first.lengths[0, 0] - first.lengths[0, 2])
    return f"""## Table I

Of up to {first.modes.number.max()} assembly modes in each row, the one above the base nearest to the print.

{fit_markdown(first, fit)}

- With Table II the 18 angles differ by {rms[0]:.2f}° rms, {largest[0]:.2f}° at most.
- Fitted: e = {e:.1f}, E_1 = {on_rod:.1f}, E_2 = {other:.1f} mm; then {rms[1]:.2f}° rms,
  {largest[1]:.2f}° at most.
- Row 1 is not symmetric, r_1 and r_3 differ by {skew:.2f} mm; yet φ_zX = 90° is printed.
"""


def _workspace_summary(found: Section4) -> str:
    facts = found.facts()
    flood = facts["flood"]
    share = 100 * flood["volume_error"] / flood["volume"]
    return f"""
## Workspace of Section 4

{as_markdown(facts)}

`fig3.png` shows the first, coloured by what ends it. Its volume is
{flood["volume"]:.3f} m³, give or take {share:.1g} %. The paper steps the lengths by 10 mm; that takes longer.
"""


def _table_iii(mech: Mechanism, motion: Motion) -> str:
    """The part of summary.md on Table III; every number is measured."""
    start, end = motion.time[0], motion.time[-1]
    try:
        facts = verify(mech, motion.sample(np.linspace(start, end, COMPARED))).facts()
    except MissingEngineError as error:
        return f"""
## Table III

Not compared with another engine: {error}
"""
    return f"""
## Table III

Errors at {COMPARED} instants of the motion; `polypod verify {mech.name} {EXAMPLE}` compares at all.

{verification_markdown(facts)}
"""


def _range(limits: list[float]) -> str:
    return " to ".join(f"{1e3 * value:.1f}" for value in limits)


def _pair(forces: list[float]) -> str:
    return " and ".join(f"{force:.0f}" for force in forces)
