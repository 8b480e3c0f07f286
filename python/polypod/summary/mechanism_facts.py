"""Facts about a mechanism, as plain data: JSON holds them as they are.

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
from polypod.mechanism import Mechanism, list_mechanisms, load
from polypod.solution.extremes import number, stroke_limits
from polypod.summary.freedoms import constraint_wrenches, freedoms

Array = NDArray[np.float64]

CONDITIONS = {
    "A": "r, the base axis L and the platform axis l stay in one plane",
    "B": "r stays at right angles to an axis of the base",
    "C": "r stays at right angles to an axis of the platform",
    "D": "an axis of the platform stays at right angles to one of the base",
    "E": "keeps its angle about the rod to the first leg on it",
}
"""Conditions of the constraints of theory [T9], by kind."""

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
    """Facts of `polypod list`: name, legs, degrees of freedom and description of each built-in mechanism."""
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
    """Facts of `polypod info` about a mechanism."""
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
        f"{m.joint_freedoms} joint degrees of freedom less {m.closure_rank} leave "
        f"{m.joint_freedoms - m.closure_rank}, of which the platform has {m.dof}, so {m.passive} are passive"
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
