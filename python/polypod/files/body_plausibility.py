"""Masses and inertias that a machine of its size hardly has: mostly numbers in another unit than meant."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

DENSITY = 8000.0
"""kg/m^3, of steel: a body is hardly heavier than a cube of it as long as the longest leg."""
LARGEST, LEAST = 5.0, 3e-3
"""Bounds of the largest radius of gyration, in lengths of the longest leg."""


def implausible_bodies(geometry: dict[str, Any], longest: float) -> list[str]:
    """A sentence for each kind of doubt about the bodies of a mechanism, in SI; `longest` leg in m."""
    heavy, wide, narrow = [], [], []
    for name, body in bodies_of(geometry).items():
        mass, inertia = body["mass"], np.array(body["inertia"])
        if mass > DENSITY * longest**3:
            heavy.append(f"{name} ({mass:.4g} kg)")
        if mass > 0.0 and inertia.any():
            # Roots first: a mass next to zero leaves no finite square.
            radius = math.sqrt(max(float(np.linalg.eigvalsh(inertia)[-1]), 0.0)) / math.sqrt(mass)
            shown = f"{name} ({radius:.3g} m)"
            wide += [shown] if radius > LARGEST * longest else []
            narrow += [shown] if radius < LEAST * longest else []
    leg = f"the longest leg has {longest:.4g} m at the centre pose"
    found = []
    if heavy:
        found.append(f"heavier than a cube of steel with edges like the longest leg: {_few(heavy)}; {leg}.")
    if wide:
        found.append(f"radii of gyration are far larger than the machine: {_few(wide)}; {leg}.")
    if narrow:
        found.append(f"radii of gyration are far smaller than the machine: {_few(narrow)}; {leg}.")
    return [f"{sentence} Check the units of mass and inertia." for sentence in found]


def bodies_of(geometry: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """The bodies of a mechanism that have numbers, by name."""
    bodies = {"platform": geometry["platform"]}
    bodies |= {f"rod {rod['name']}": rod["body"] for rod in geometry["rods"]}
    for leg in geometry["legs"]:
        bodies |= {f"{link} of leg {leg['name']}": leg[link] for link in ("cylinder", "piston")}
    return {name: body for name, body in bodies.items() if body}


def _few(names: list[str]) -> str:
    return ", ".join(names) if len(names) <= 3 else f"{', '.join(names[:2])} and {len(names) - 2} more"
