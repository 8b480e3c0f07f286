"""How the platform can move at the centre pose and what holds it, as plain data: SI units and radians."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polypod.answers.status import Status
from polypod.mechanism import Mechanism

Array = NDArray[np.float64]

TURN = math.radians(10)
SHIFT = 0.1
"""How far an independent coordinate is moved to see what others do: rad, and of the characteristic length."""

STILL = 1e-9
"""Largest change, in rad and in characteristic lengths, that counts as none."""


def freedoms(mech: Mechanism) -> dict[str, Any]:
    """Independent coordinates at the centre pose, how the others follow each of them, and screws.

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
    return {"independent": list(chosen), "coupled": coupled, "screws": screws(mech)}


def screws(mech: Mechanism) -> list[dict[str, Any]]:
    """Degrees of freedom of the platform at the centre pose: principal screws, base axes.

    `kind` is translation, turn or screw; `pitch`, in m/rad, is None for a translation.
    """
    found = mech.freedom_screws(mech.home)
    return [
        {"kind": _kind(mech, pitch), **_line(axis, pitch, point)}
        for axis, pitch, point in zip(found.axis, found.pitch, found.point, strict=True)
    ]


def _kind(mech: Mechanism, pitch: float) -> str:
    if not math.isfinite(pitch):
        return "translation"
    return "turn" if abs(pitch) <= STILL * mech.characteristic_length else "screw"


def _line(axis: Array, pitch: float, point: Array) -> dict[str, Any]:
    finite = math.isfinite(pitch)
    return {
        "axis": axis.tolist() if np.isfinite(axis).all() else None,
        "pitch": float(pitch) if finite else None,
        "point": point.tolist() if finite else None,
    }


def constraint_wrenches(mech: Mechanism) -> list[dict[str, Any]]:
    """The constraints' wrenches at the centre pose, at o in base axes: those that depend on others, too.

    A unit force with its moment, in N m by N, and its line; or a unit couple. One that vanishes has no axis.
    """
    mobility, found = mech.mobility(), mech.constraint_screws(mech.home)
    return [
        {
            "leg": leg,
            "kind": kind,
            "independent": i in mobility.independent_rows,
            "couple": not math.isfinite(pitch),
            "force": vector[:3].tolist(),
            "moment": vector[3:].tolist(),
            **_line(axis, pitch, point),
        }
        for i, ((leg, kind), vector, axis, pitch, point) in enumerate(
            zip(mobility.constraint_rows, found.vector, found.axis, found.pitch, found.point, strict=True)
        )
    ]
