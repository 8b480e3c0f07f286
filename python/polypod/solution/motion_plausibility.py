"""What a motion and a mechanism tell about each other that their user may not have meant."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from polypod.files.body_plausibility import bodies_of
from polypod.mechanism import Mechanism, spans
from polypod.motion.motion import Motion

Array = NDArray[np.float64]

FAR, NEAR = 0.25, 0.25
"""Far from home: by more than this share of the legs' mean length. Near: within this share of that way."""


def warnings_about(mech: Mechanism, motion: Motion, pose: Array) -> list[str]:
    """Sentences for the user about a motion with poses (N, 4, 4): its samples, its place, and its forces."""
    return [*motion.warnings, *_relative(mech, pose), *_without_forces(mech, motion)]


def _relative(mech: Mechanism, pose: Array) -> list[str]:
    """Whether the coordinates look like differences from home."""
    o, home = pose[:, :3, 3], mech.home[:3, 3]
    known = o[np.isfinite(o).all(axis=-1)]
    if not len(known):
        return []
    away = float(np.min(np.linalg.norm(known - home, axis=-1)))
    if_relative = float(np.min(np.linalg.norm(known, axis=-1)))
    size = float(np.mean(spans(mech)))
    if not (away > FAR * size and if_relative < NEAR * away):
        return []
    place = ", ".join(f"{1e3 * x:.5g}" for x in home)
    return [
        f"the motion comes no nearer to home, o = ({place}) mm, than {1e3 * away:.4g} mm, but within "
        f"{1e3 * if_relative:.4g} mm of the base's origin: coordinates are those of the platform in the "
        "base, not differences from home. If they are differences, add home's."
    ]


def _without_forces(mech: Mechanism, motion: Motion) -> list[str]:
    """Whether nothing has a weight or a load, so that all forces are zero whatever the motion."""
    data = mech.geometry
    load = data["load"] if motion.wrench is None else {"wrench": motion.wrench}
    loaded = any(np.any(np.asarray(value, dtype=float)) for key, value in load.items() if key != "axes")
    heavy = any(np.any(body[key]) for body in bodies_of(data).values() for key in ("mass", "inertia"))
    damped = data["linear_damping"] or data["angular_damping"]
    if loaded or heavy or damped:
        return []
    return ["no body has a mass and there is no load: all forces are zero, whatever the motion."]
