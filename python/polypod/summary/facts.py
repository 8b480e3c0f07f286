"""What is worth telling about a mechanism and about a solution, as plain data: JSON holds it as it is.

SI units and radians. Numbers that do not exist (no stroke limit, no answer) are None.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polypod.answers.mobility import Mobility
from polypod.answers.status import Status, count
from polypod.mechanism import Mechanism, list_mechanisms, load
from polypod.solution.actuator_sizing import stroke_limits
from polypod.solution.extremes import greatest, least, number, peak
from polypod.solution.singularity_crossings import warnings_of
from polypod.solution.solution import Solution
from polypod.summary.freedoms import constraint_wrenches, freedoms

Array = NDArray[np.float64]

CONDITIONS = {
    "A": "r, the base axis L and the platform axis l stay in one plane",
    "B": "r stays at right angles to an axis of the base",
    "C": "r stays at right angles to an axis of the platform",
    "D": "an axis of the platform stays at right angles to one of the base",
    "E": "keeps its angle about the rod to the first leg on it",
}
"""What the constraints of theory [T9] demand, by kind."""

_MOBILITY = (
    *("dof", "links", "joints", "joint_freedoms", "loops", "closure_rank"),
    *("redundant", "redundant_legs", "passive", "passive_legs"),
)
_BY_JOINTS = {2: "binary", 3: "ternary", 4: "quaternary", 5: "pentagonal", 6: "hexagonal"}


# --- a mechanism --------------------------------------------------------------------------------------------


def link_kind(joints: int) -> str:
    """The name of a link by its number of joints: binary, ternary, ..."""
    return _BY_JOINTS.get(joints, f"{joints}-joint")


def links_by_joints(mobility: Mobility) -> dict[str, tuple[str, ...]]:
    """Names of the links by `link_kind`, those with most joints first."""
    groups: defaultdict[int, list[str]] = defaultdict(list)
    for link in mobility.graph_links:
        groups[len(link.joints)].append(link.name)
    return {link_kind(n): tuple(groups[n]) for n in sorted(groups, reverse=True)}


def legs_in_short(letters: Sequence[str]) -> str:
    """The legs by their joints, alike ones together: 3UPS+UPF."""
    counts = Counter(letters)
    return "+".join(f"{n if n > 1 else ''}{leg}" for leg, n in counts.items())


def catalogue() -> list[dict[str, Any]]:
    """All that `polypod list` tells: name, legs, freedoms and description of each built-in mechanism."""
    return [
        {
            "name": name,
            "legs": legs_in_short(mech.leg_letters),
            "dof": mech.dof,
            "description": mech.to_dict().get("description", ""),
        }
        for name in list_mechanisms()
        for mech in (load(name),)
    ]


def describe(mech: Mechanism) -> dict[str, Any]:
    """All that `polypod info` tells about a mechanism."""
    mobility, file = mech.mobility(), mech.to_dict()
    centre = mech.conditioning(mech.home)
    home = mech.inverse_kinematics(mech.home).lengths
    legs = zip(mech.leg_names, mech.leg_letters, mech.actuated, home, strict=True)
    return {
        "name": mech.name,
        "description": file.get("description", ""),
        "source": file.get("source", ""),
        "units": "SI, rad",
        "legs": [
            {
                "name": name,
                "joints": letters,
                "actuated": bool(actuated),
                "home_length": float(length),
                "stroke": stroke_limits(mech, i),
            }
            for i, (name, letters, actuated, length) in enumerate(legs)
        ],
        "mobility": {term: getattr(mobility, term) for term in _MOBILITY}
        | {"idle": [asdict(idle) for idle in mobility.idle], "rows": mech.n_rows},
        "accounting": accounting(mobility),
        "links_by_joints": links_by_joints(mobility),
        "constraints": [
            {
                "leg": leg,
                "kind": kind,
                "condition": CONDITIONS.get(kind, ""),
                "independent": i in mobility.independent_rows,
            }
            for i, (leg, kind) in enumerate(mobility.constraint_rows)
        ],
        "constraint_wrenches": constraint_wrenches(mech),
        "freedoms": freedoms(mech),
        "coordinate_sets": mech.coordinate_sets,
        "characteristic_length": mech.characteristic_length,
        "centre_pose": {
            "pose": mech.home.tolist(),
            "sigma_min": number(centre.sigma_min),
            "sigma_max": number(centre.sigma_max),
            "condition": number(centre.condition),
        },
        "limits": _limits_at_home(mech),
        "warnings": mech.warnings,
    }


def _limits_at_home(mech: Mechanism) -> list[dict[str, Any]]:
    """Every limit with its margin at the centre pose, and which binds there."""
    home = mech.limits(mech.home)
    return [
        {
            "name": limit.name,
            "kind": limit.kind,
            "legs": limit.legs,
            "unit": limit.unit,
            "allowed": [number(limit.least), number(limit.greatest)],
            "margin": number(home.margins[i]),
            "relative": number(home.relative[i]),
            "binds": bool(i == home.binding),
        }
        for i, limit in enumerate(mech.limit_list)
    ]


def accounting(mobility: Mobility) -> dict[str, Any]:
    """The terms of Eq. 1 from ranks, beside those that the mechanism's publication gives, with a remark."""
    m, p = mobility, mobility.published
    common = 6 * (m.links - m.joints - 1) + m.joint_freedoms

    def row(redundant: int, passive: int) -> dict[str, int]:
        return {"redundant": redundant, "passive": passive, "sum": common + redundant - passive}

    computed = row(m.redundant, m.passive)
    if p is None:
        return {"computed": computed, "published": None, "note": ""}
    published = row(p.redundant, p.passive)
    why = (
        f"the loop closures have rank {m.closure_rank} of {6 * m.loops}, so {m.redundant} are redundant; "
        f"{m.joint_freedoms} joint freedoms less {m.closure_rank} leave {m.joint_freedoms - m.closure_rank}, "
        f"of which the platform has {m.dof}, so {m.passive} are passive"
    )
    if published["sum"] != m.dof:
        note = f"the published terms add up to {published['sum']}, not to {m.dof}: {why}"
    elif published == computed:
        note = "the published terms agree"
    else:
        note = (
            f"the published sum is right, as only ς - M_0 enters it and {p.redundant} - {p.passive} = "
            f"{m.redundant} - {m.passive}; the split is not: {why}"
        )
    return {"computed": computed, "published": published, "note": note}


# --- a solution ---------------------------------------------------------------------------------------------


def summarise(mech: Mechanism, solution: Solution) -> dict[str, Any]:
    """Ranges, peaks and outcomes along a motion: all that `polypod solve` tells about it."""
    data = solution.dataset
    time = data["time"].to_numpy()

    def of(name: str) -> Array:
        return data[name].to_numpy()

    legs = [
        {
            "name": name,
            "joints": mech.leg_letters[i],
            "length": [least(of("length")[:, i]), greatest(of("length")[:, i])],
            "stroke": stroke_limits(mech, i),
            "outside_stroke": _outside(of("length")[:, i], mech.stroke[i]),
            "peak_rate": peak(of("rate")[:, i]),
            "peak_force": peak(of("force")[:, i]),
        }
        for i, name in enumerate(mech.leg_names)
    ]
    outcomes = [
        {"status": status.name, "count": n, "first_time": float(time[first]), "message": status.message}
        for status, n, first in count(of("status"))
    ]
    sigma = of("sigma_min")
    nearest = int(np.nanargmin(sigma)) if np.isfinite(sigma).any() else None
    return {
        "mechanism": mech.name,
        "motion": data.attrs["motion"],
        "coordinate_set": data.attrs["coordinate_set"],
        "units": "SI, rad",
        "states": len(time),
        "without_answer": int(np.sum(~np.isin(of("status"), [s for s in Status if s.has_answer]))),
        "start": float(time[0]),
        "end": float(time[-1]),
        "platform": {
            "peak_speed": greatest(np.linalg.norm(of("twist")[:, :3], axis=-1)),
            "peak_angular_speed": greatest(np.linalg.norm(of("twist")[:, 3:], axis=-1)),
        },
        "legs": legs,
        "outcomes": outcomes,
        "nearest_to_singular": None
        if nearest is None
        else {
            "time": float(time[nearest]),
            "sigma_min": number(sigma[nearest]),
            "condition": number(of("condition")[nearest]),
        },
        "singularities": {**solution.singularities, "warnings": warnings_of(solution.singularities)},
        "power": _power(solution),
        "coupled": _coupled(solution),
        "limits": _limits(solution),
    }


def _limits(solution: Solution) -> dict[str, Any] | None:
    """The least slack along the motion, with its limit and time, and every limit that is passed."""
    data = solution.dataset
    if "limit_margin" not in data:
        return None
    time, names = data["time"].to_numpy(), data["limit"].to_numpy().tolist()
    units = data["limit_unit"].to_numpy().tolist()
    margins, relative = data["limit_margin"].to_numpy(), data["limit_relative"].to_numpy()

    def slack(state: int, limit: int) -> dict[str, Any]:
        return {
            "limit": names[limit],
            "time": float(time[state]),
            "margin": float(margins[state, limit]),
            "relative": float(relative[state, limit]),
            "unit": units[limit],
        }

    passed = []
    for i in np.flatnonzero((margins < 0.0).any(axis=0)):
        beyond = np.flatnonzero(margins[:, i] < 0.0)
        worst = slack(int(np.nanargmin(margins[:, i])), int(i))
        passed.append({**worst, "states": len(beyond), "first_time": float(time[beyond[0]])})
    known = np.isfinite(relative).any()
    nearest = np.unravel_index(np.nanargmin(relative), relative.shape) if known else None
    return {
        "least": None if nearest is None else slack(int(nearest[0]), int(nearest[1])),
        "passed": passed,
        "not_determined": int(np.isnan(margins).any(axis=1).sum()),
    }


def _power(solution: Solution) -> dict[str, float | None]:
    """The greatest actuator power and residual, and the residual as a part of the power that flows."""
    data = solution.dataset
    names = ("actuator_power", "load_power", "damping_power", "friction_power")
    flows = np.sum([np.abs(data[name].to_numpy()) for name in names], axis=0)
    residual = data["power_residual"].to_numpy()
    most, flow = greatest(np.abs(residual)), greatest(flows)
    return {
        "peak_actuators": peak(data["actuator_power"].to_numpy()),
        "greatest_residual": most,
        "relative_residual": most / flow if most is not None and flow else None,
    }


def _coupled(solution: Solution) -> dict[str, Any] | None:
    """Peaks of the couple-constrained forces and torque, consistent and by Eq. 44 as printed."""
    data = solution.dataset
    if "coupled_force" not in data:
        return None
    forces, printed = data["coupled_force"].to_numpy(), data["coupled_force_as_printed"].to_numpy()
    ratio = np.abs(printed[:, 0] / np.where(forces[:, 0] == 0.0, np.nan, forces[:, 0]))
    active = greatest(np.abs(data["force"].to_numpy()))
    largest = greatest(np.abs(forces))
    return {
        "legs": data["coupled_leg"].to_numpy().tolist(),
        "peak_forces": [peak(f) for f in forces.T],
        "peak_forces_as_printed": [peak(f) for f in printed.T],
        "peak_torque": peak(data["coupled_torque"].to_numpy()),
        "peak_torque_as_printed": peak(data["coupled_torque_as_printed"].to_numpy()),
        "consistent_over_printed": [_reciprocal(greatest(ratio)), _reciprocal(least(ratio))],
        "note": "the couples in the joints of these legs are statically indeterminate and taken as zero",
        "share_of_active": largest / active if largest is not None and active else None,
    }


def _outside(lengths: Array, stroke: Array) -> bool:
    return bool(np.any((lengths < stroke[0]) | (lengths > stroke[1])))


def _reciprocal(value: float | None) -> float | None:
    return 1.0 / value if value else None
