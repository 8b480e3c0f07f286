"""Contents of a mechanism file that a format cannot hold: nothing is left out without a word."""

from __future__ import annotations

from collections.abc import Collection

from polypod.export.model import Model
from polypod.legs.drives import kinds_among

STROKES = frozenset({"stroke min", "stroke max"})
TURNS = frozenset({"base angle", "rod angle"})
PLATFORM_TURNS = frozenset({"platform angle"})
FORCES = frozenset({"force min", "force max"})
"""Kinds of limits, as in `polypod.answers.parts.Limit`, that a format may carry."""


def lost(model: Model, limits: Collection[str], *, gravity: bool) -> list[str]:
    """Sentences about all that is left out, or that engines choose by themselves.

    Args:
        model: the mechanism.
        limits: kinds of limits that the format carries.
        gravity: whether it carries gravity.
    """
    spec, notes = model.mech.geometry, []
    if not gravity:
        notes.append(f"gravity is not in this file; it is {_vector(spec['gravity'])} m/s^2 in base axes.")
    if spec["efficiency"] != 1.0:
        notes.append(
            f"the efficiency {spec['efficiency']:g} has no counterpart; forces are those at efficiency 1."
        )
    linear, angular = spec["linear_damping"], spec["angular_damping"]
    if linear or angular:
        notes.append(f"the platform's damping, {linear:g} N s/m and {angular:g} N m s/rad, is left out.")
    load = spec["load"]
    if any((*load["force"], *load["torque"])):
        notes.append(
            f"the load on the platform, {_vector(load['force'])} N and {_vector(load['torque'])} N m at o in "
            f"{load['axes']} axes, is left out; apply it as an external force."
        )
    notes += _limits(model, limits)
    if model.massless:
        notes.append(
            f"links that have no mass in the mechanism file have {model.thin[0]:g} kg here, because engines "
            f"divide by masses: {', '.join(model.massless)}."
        )
    for drive in kinds_among(model.mech.drives):
        links = [leg.first for leg in model.tree.legs if leg.drive == drive]
        massive = [body.name for body in model.tree.bodies if body.mass > 0.0 and body.name in links]
        if drive.assumed_inertia and massive:
            notes.append(f"{drive.assumed_inertia}: {', '.join(massive)}.")
    mobility = model.mech.mobility()
    if mobility.redundant:
        notes.append(
            f"the closures hold {mobility.redundant} redundant constraint"
            f"{'s' if mobility.redundant > 1 else ''} (legs {', '.join(mobility.redundant_legs)}); how their "
            "forces are shared is the engine's own choice."
        )
    return notes


def _limits(model: Model, carried: Collection[str]) -> list[str]:
    """The limits that are left out, a sentence for each kind."""
    legs: dict[str, list[str]] = {}
    for limit in model.mech.limit_list:
        if limit.kind not in carried:
            legs.setdefault(limit.kind, []).extend(limit.legs)
    of = {kind: f" (legs {', '.join(dict.fromkeys(names))})" if names else "" for kind, names in legs.items()}
    return [f"the limit {kind}{names} is left out." for kind, names in of.items()]


def _vector(values: Collection[float]) -> str:
    return f"[{', '.join(f'{value:g}' for value in values)}]"
