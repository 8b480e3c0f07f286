"""The cards of a mechanism, its mobility, motions, solutions and workspaces in a notebook."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np

from polypod.answers.notebook import Rows, card, counted, number, numbers, outcomes, rows_of
from polypod.answers.status import Status
from polypod.files.units import coordinate_unit, readable
from polypod.summary.leg_words import word

if TYPE_CHECKING:
    from polypod.answers.kinematics import Mobility
    from polypod.mechanism import Mechanism
    from polypod.motion.motion import Motion
    from polypod.solution.solution import Solution
    from polypod.workspaces.length_lattice import LengthLattice
    from polypod.workspaces.workspace import Workspace

OF_LEGS = ("length", "rate", "force")
OF_STATES = ("actuator_power", "power_residual", "sigma_min", "condition")
"""Variables of a solution that its card shows."""


def of_mechanism(mech: Mechanism) -> str:
    """Drawing, freedoms, legs and warnings."""
    file, home = mech.to_dict(), mech.inverse_kinematics(mech.home).lengths
    legs = zip(mech.leg_names, mech.leg_letters, mech.actuated, home, mech.stroke, strict=True)
    rows = [
        (name, letters, "yes" if actuated else "no", readable(length, "m"), _stroke(*stroke))
        for name, letters, actuated, length, stroke in legs
    ]
    headers = ("leg", "joints", "actuated", f"{word(mech.leg_letters)} at home", "stroke")
    sets = [(name, ", ".join(names)) for name, names in mech.coordinate_sets.items()]
    said = f"{'+'.join(mech.leg_letters)}, {mech.dof} freedoms"
    notes = [file.get("description", ""), file.get("source", ""), *(f"⚠ {text}" for text in mech.warnings)]
    return card(
        mech.name,
        said,
        [rows_of(headers, rows), rows_of(("coordinate set", "coordinates"), sets, texts=2)],
        notes=filter(None, notes),
        picture=_drawing(mech),
    )


def _stroke(least: float, greatest: float) -> str:
    low, high = (readable(end, "m") for end in (least, greatest))
    if np.isfinite(least) and least != 0.0:
        return f"{low} to {high}" if np.isfinite(greatest) else f"from {low}"
    return f"to {high}" if np.isfinite(greatest) else "free"


def _drawing(mech: Mechanism) -> bytes:
    """The mechanism at its centre pose as a small PNG."""
    from matplotlib.figure import Figure

    from polypod.plots import plot_mechanism
    from polypod.plots.style import house_style

    figure, file = Figure(figsize=(3.2, 3.4)), io.BytesIO()
    plot_mechanism(mech, ax=figure.add_axes((0.0, 0.0, 1.0, 1.0), projection="3d"), labels=False)
    with house_style():
        figure.savefig(file, format="png", dpi=120)
    return file.getvalue()


def of_mobility(mobility: Mobility) -> str:
    """The terms of Eq. 1 and what couples or spins."""
    terms = ("dof", "links", "joints", "joint_freedoms", "loops", "closure_rank", "redundant", "passive")
    rows = [(name, str(getattr(mobility, name))) for name in terms]
    notes = []
    if mobility.redundant_legs:
        notes.append(f"redundant constraints couple legs {', '.join(mobility.redundant_legs)}")
    if mobility.passive_legs:
        notes.append(f"legs {', '.join(mobility.passive_legs)} spin freely")
    notes += [f"idle: {idle}" for idle in mobility.idle]
    if mobility.uncontrolled:
        notes.append(f"{mobility.uncontrolled} freedoms remain with all actuators locked, at every pose")
    return card("Mobility", f"{mobility.dof} freedoms", [rows_of(("", ""), rows)], notes=notes)


def of_motion(motion: Motion) -> str:
    """Span, coordinates and load."""
    first, last = motion.time[[0, -1]].tolist()
    rows = [
        (name, numbers(motion.coordinates[name]), numbers(motion.rates[name]), coordinate_unit(name))
        for name in motion.coordinates
    ]
    load = "the mechanism's own" if motion.wrench is None else f"given, in {motion.wrench_axes} axes"
    said = f"{counted(len(motion.time))} from {first:g} s to {last:g} s"
    table = rows_of(("coordinate", "value", "rate", "unit (per s)"), rows)
    return card(f"Motion {motion.name}", said, [table], notes=[f"set {motion.set}; load: {load}"])


def solution_heading(solution: Solution) -> tuple[str, str]:
    """Its title, and how many states of which outcomes."""
    data = solution.dataset
    said = []
    if "time" in data and data.sizes["time"]:
        first, last = data["time"].to_numpy()[[0, -1]].tolist()
        said.append(f"{counted(data.sizes['time'])} from {first:g} s to {last:g} s")
    if "status" in data:
        said.append(outcomes(data["status"], Status))
    return f"Solution: {data.attrs.get('title', '')}".removesuffix(": "), ": ".join(said)


def of_solution(solution: Solution) -> str:
    """Outcomes, legs, power and conditioning; how a simulation ended; singularities that are passed."""
    from polypod.solution.singularity_crossings import warnings_of

    data, notes = solution.dataset, []
    if solution.end:
        notes.append(f"ended at {solution.end['time']:.6g} s: {solution.end['reason']}")
    if "singularities" in data.attrs:
        notes += [f"⚠ {text}" for text in warnings_of(solution.singularities)]
    tables: list[Rows] = []
    legs = [name for name in OF_LEGS if name in data and data[name].dims == ("time", "leg")]
    if legs:
        rows = [
            (str(leg), *(numbers(data[name].sel(leg=leg)) for name in legs)) for leg in data["leg"].values
        ]
        tables.append(rows_of(("leg", *(_header(data[name]) for name in legs)), rows))
    whole = [(_header(data[name]), numbers(data[name])) for name in OF_STATES if name in data]
    tables.append(rows_of(("along the motion", ""), whole))
    notes.append(f"{len(data.data_vars)} variables in .dataset")
    return card(*solution_heading(solution), tables, notes=notes)


def _header(variable: Any) -> str:
    """Such as "leg length r / m"."""
    attrs = variable.attrs
    unit = attrs.get("units", "")
    name = f"{attrs.get('long_name', variable.name)} {attrs.get('symbol', '')}".rstrip()
    return name + (f" / {unit}" if unit not in ("", "1") else "")


def workspace_heading(workspace: Workspace) -> tuple[str, str]:
    """What it is, and how large."""
    fixed = workspace.inputs.get("fixed") or {}
    at = ", ".join(f"{name} = {readable(value, coordinate_unit(name))}" for name, value in fixed.items())
    size = f"{number(workspace.volume)} ± {workspace.volume_error:.1g} {workspace.volume_unit}"
    title = f"Workspace of {workspace.inputs['mechanism']}"
    word = "volume" if len(workspace.names) == 3 else "area"
    return title, f"{workspace.kind} {', '.join(workspace.names)}{f' at {at}' if at else ''}: {word} {size}"


def of_workspace(workspace: Workspace) -> str:
    """Extents, size, and what ends it at which share of the boundary."""
    pairs = zip(workspace.names, workspace.extents.tolist(), workspace.units, strict=True)
    extents = [
        (name, *(readable(value, unit) for value in (low, high, high - low)))
        for name, (low, high), unit in pairs
    ]
    ends = [(name, f"{100 * share:.1f} %") for name, share in workspace.shares.items()]
    return card(
        *workspace_heading(workspace),
        [rows_of(("", "least", "greatest", "width"), extents), rows_of(("what ends it", "of it"), ends)],
        notes=[f"{int(workspace.mask.sum())} of {workspace.mask.size} nodes inside"],
    )


def lattice_heading(lattice: LengthLattice) -> tuple[str, str]:
    """What it is, and how many nodes."""
    said = f"steps of {readable(lattice.step, 'm')}, {lattice.inside} of {lattice.nodes} combinations inside"
    return f"Lattice of leg lengths of {lattice.inputs['mechanism']}", f"{said}, {lattice.poses} poses"


def of_lattice(lattice: LengthLattice) -> str:
    """Extents of o, and how steps ended."""
    rows = [
        (name, *(readable(value, "m") for value in (low, high, high - low)))
        for name, (low, high) in zip("xyz", lattice.extents.tolist(), strict=True)
    ]
    notes = [f"{lattice.at_limits} steps end at limits or bounds, {lattice.singular} in a singularity"]
    table = rows_of(("o", "least", "greatest", "width"), rows)
    return card(*lattice_heading(lattice), [table], notes=notes)
