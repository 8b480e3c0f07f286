"""How the platform can move at the centre pose and what holds it, as plain data: SI units and radians."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from polypod.mechanism import Mechanism
from polypod.status import Status

TURN = math.radians(10)
SHIFT = 0.1
"""How far an independent coordinate is moved to see what others do: rad, and of the characteristic length."""

STILL = 1e-9
"""What changes less, in rad and in characteristic lengths, does not move."""

COUPLE = 1e-9
"""A wrench with less force, in 1/m by the characteristic length, is a couple."""


def freedoms(mech: Mechanism) -> dict[str, Any]:
    """Independent coordinates at the centre pose, and how the others follow each of them.

    `coupled` has for each independent coordinate its `change`, and in `follow` the changes of the others
    that move with it: parasitic motions, also those of second order. `follow` is None where there is no pose.
    """
    chosen = mech.equations_of_motion(mech.home, np.zeros(6), "pose").coordinates
    names = mech.coordinate_sets["pose"]
    home = mech.coordinates(mech.home, "pose")
    size = {n: mech.characteristic_length if n in "xyz" else 1.0 for n in names}
    coupled = []
    for moved in chosen if mech.dof < 6 else ():
        change = SHIFT * size[moved] if moved in "xyz" else TURN
        given = {n: home[n] + (change if n == moved else 0.0) for n in chosen}
        state = mech.state(given, guess=mech.home)
        follow = None
        if Status(int(state.status)).has_answer:
            changes = {n: float(state.coordinates[n] - home[n]) for n in names if n not in chosen}
            follow = {n: c for n, c in changes.items() if abs(c) > STILL * size[n]}
        coupled.append({"coordinate": moved, "change": float(change), "follow": follow})
    return {"independent": list(chosen), "coupled": coupled}


def constraint_wrenches(mech: Mechanism) -> list[dict[str, Any]]:
    """The independent constraints' wrenches at the centre pose, at o in base axes.

    A unit force with its moment, in N m by N; or a unit couple.
    """
    mobility = mech.mobility()
    rows = mech.jacobian(mech.home)[int(mech.actuated.sum()) :]
    wrenches = []
    for row, index in zip(rows, mobility.independent_rows, strict=True):
        leg, kind = mobility.constraint_rows[index]
        force, moment = row[:3], row[3:]
        couple = bool(np.linalg.norm(force) * mech.characteristic_length <= COUPLE * np.linalg.norm(moment))
        scale = float(np.linalg.norm(moment if couple else force))
        known = scale > 0.0
        wrenches.append(
            {
                "leg": leg,
                "kind": kind,
                "couple": couple,
                "force": (force / scale).tolist() if known and not couple else [0.0] * 3,
                "moment": (moment / scale).tolist() if known else [0.0] * 3,
            }
        )
    return wrenches
