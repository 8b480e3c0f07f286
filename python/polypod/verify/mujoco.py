"""The mechanism in MuJoCo, whose loops are soft: an approximate check, and how far off the defaults are.

MuJoCo lets every constraint give way by a part 1 - d of what it should hold, with an impedance d of at most
0.9999. That is applied in passes here: the loops' forces of one are given as forces to the next, so that only
what is left gives way, until accelerations stay the same. Its inverse dynamics takes loops' forces from how
far they gave way, and is not used.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import islice, pairwise
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from polypod.answers.status import Status
from polypod.multibody.mjcf import Settings, configuration, skeleton
from polypod.multibody.placement import PLATFORM
from polypod.multibody.tree import Multibody
from polypod.verify.constraints import Start
from polypod.verify.twin import Forced, inertial, light, pull

Array = NDArray[np.float64]

STIFF = {"solimp": "0.9999 0.9999 0.001 0.5 2", "solref": "0.0002 1"}
"""The highest impedance that MuJoCo takes, at any error, and a time constant of two steps, s."""
PATIENT = STIFF | {"solref": "1 1"}
"""Solver settings with which errors of position, which are rounding, are removed slowly, not by
accelerations."""
EVEN = 0.01
"""The yield of a constraint is proportional to the mobility of its links, which MuJoCo takes from the zero of
the model: a light link that carries heavy ones hardly holds them. In passes all get this part of the
platform's."""
CONVERGED = 1e-12
"""Largest change of an acceleration from one pass to the next, as a part of the greatest of all links or of
what `pull` says; angular ones times the characteristic length."""
PASSES = 50
"""At most; states away from singular ones take three to five."""
STEP = 1e-4
"""s."""


def unit_of_mass(tree: Multibody) -> float:
    """The mass that is 1 in the model, kg: the platform's moment of inertia is about 1 by it.

    MuJoCo takes moments of inertia below 1e-14 for zero.
    """
    return next(body.mass for body in tree.bodies if body.name == PLATFORM) * tree.scale**2


def mjcf(tree: Multibody, constraint: dict[str, str] | None = None) -> str:
    """The mechanism as a model file for MuJoCo: a tree of bodies, and equalities for each closure [T64].

    Masses, and so forces, are in `unit_of_mass`.

    Args:
        tree: the mechanism.
        constraint: attributes of all equalities, MuJoCo's own defaults without.
    """
    unit = unit_of_mass(tree)

    def scaled(given: tuple[float, Array]) -> tuple[float, Array]:
        return given[0] / unit, given[1] / unit

    settings = Settings(
        option={
            **{"timestep": repr(STEP), "integrator": "implicitfast"},
            **{"solver": "Newton", "jacobian": "dense", "tolerance": "0"},
        },
        constraint=constraint or {},
        inertial=lambda body: scaled(inertial(tree, body) if body.mass > 0.0 else light(tree)),
        light=scaled(light(tree)),
    )
    return skeleton(tree, settings).text()


class Model:
    """A compiled model, by default with MuJoCo's own constraints."""

    def __init__(self, tree: Multibody, constraint: dict[str, str] | None = None) -> None:
        self.tree, self.unit = tree, unit_of_mass(tree)
        self.model = mujoco.MjModel.from_xml_string(mjcf(tree, constraint))
        self.data = mujoco.MjData(self.model)
        self._bodies = {body.name: self.model.body(body.name).id for body in tree.bodies}
        self._set_light_inertias()

    def _set_light_inertias(self) -> None:
        """Those of `inertial`: a model file takes no moment beyond the sum of the two others."""
        for body in self.tree.bodies:
            if body.mass == 0.0:
                number = self._bodies[body.name]
                # A sphere to the compiler, which may have chosen any axes.
                self.model.body_iquat[number] = [1.0, 0.0, 0.0, 0.0]
                self.model.body_inertia[number] = np.diag(inertial(self.tree, body)[1]) / self.unit

    def hold_evenly(self) -> None:
        """All constraints give way alike, see `EVEN`."""
        self.model.body_invweight0[:] = EVEN / self.model.body_mass[self._bodies[PLATFORM]]

    def passes(self, start: Start, twist: Array, wrench: Array, forces: Array) -> Iterator[Array]:
        """(bodies, 6) as `Forced.accelerations`: with MuJoCo's loops, then less and less soft ones [T64]."""
        model, data = self.model, self.data
        mujoco.mj_resetData(model, data)
        self._put(start)
        geometry = self.tree.geometry
        for leg, force in zip(self.tree.legs, forces, strict=True):
            data.qfrc_applied[self._joint(leg.slide, 0).dofadr[0]] = force / self.unit
        damping = np.repeat([geometry["linear_damping"], geometry["angular_damping"]], 3)
        push = (wrench - damping * twist) / (geometry["efficiency"] * self.unit)
        point = start.placements[PLATFORM][:3, 3]
        mujoco.mj_applyFT(model, data, push[:3], push[3:], point, self._bodies[PLATFORM], data.qfrc_applied)
        while True:
            mujoco.mj_forward(model, data)
            yield self._accelerations(point)
            # What the loops held so far is applied, so that only the rest gives way.
            data.qfrc_applied += data.qfrc_constraint

    def _accelerations(self, point: Array) -> Array:
        model, data = self.model, self.data
        jacobian, drift = np.zeros((6, model.nv)), np.zeros((6, model.nv))
        found = np.zeros((len(self.tree.bodies), 6))
        for row, body in zip(found, self.tree.bodies, strict=True):
            number = self._bodies[body.name]
            at = point if body.name == PLATFORM else data.xipos[number]
            mujoco.mj_jac(model, data, jacobian[:3], jacobian[3:], at, number)
            mujoco.mj_jacDot(model, data, drift[:3], drift[3:], at, number)
            row[:] = jacobian @ data.qacc + drift @ data.qvel
        return found

    def _joint(self, body: str, i: int) -> Any:
        return self.model.joint(f"{body} {i}")

    def _put(self, start: Start) -> None:
        """All links where and as they move at the start."""
        model, data = self.model, self.data
        for name, value in configuration(self.tree, start.placements).items():
            first = model.joint(name).qposadr[0]
            data.qpos[first : first + len(value)] = value
        mujoco.mj_fwdPosition(model, data)
        rows = np.zeros((len(self.tree.bodies), 6, model.nv))
        for row, body in zip(rows, self.tree.bodies, strict=True):
            at = start.placements[body.name][:3, 3]
            mujoco.mj_jac(model, data, row[:3], row[3:], at, self._bodies[body.name])
        # The links' twists, and loops that stay closed, which also gives the crosses' rates.
        held = data.efc_J.reshape(-1, model.nv)
        both = np.concatenate([rows.reshape(-1, model.nv), held])
        rates = np.concatenate([start.twists.ravel(), np.zeros(len(held))])
        data.qvel[:] = np.linalg.lstsq(both, rates)[0]


class Twin(Forced):
    """The mechanism with loops made hard, and beside it with MuJoCo's own and with its stiffest."""

    version: str = mujoco.__version__

    def __init__(self, tree: Multibody) -> None:
        super().__init__(tree)
        self.soft = {"default": Model(tree), "stiff": Model(tree, STIFF)}
        self.hard = Model(tree, PATIENT)
        self.hard.hold_evenly()
        self.gaps: dict[str, float] = {}
        """Largest error of the platform's acceleration with each of `soft`, as a part of it and gravity."""

    def notes(self) -> list[str]:
        """How far MuJoCo's soft loops are off."""
        if not self.gaps:
            return []
        return [
            "Soft loops: the platform's acceleration is off by up to "
            f"{self.gaps['default']:.2g} of itself and gravity with MuJoCo's default solref and solimp, "
            f"by {self.gaps['stiff']:.2g} with the stiffest, solimp {STIFF['solimp'].split()[0]}; compared "
            f"after passes that apply the loops' forces of those before, to a change of {CONVERGED:.0e}."
        ]

    def accelerations(self, start: Start, twist: Array, wrench: Array, forces: Array) -> Array | Status:
        """`Forced.accelerations`; NOT_CONVERGED where `PASSES` passes are not enough."""
        state = (start, twist, wrench, forces)
        moved = self._converged(self.hard.passes(*state), float(pull(self.tree, wrench)))
        if moved is None:
            return Status.NOT_CONVERGED
        platform = self.numbers[PLATFORM]
        right = moved[platform, :3]
        size = float(np.linalg.norm(right) + np.linalg.norm(self.tree.geometry["gravity"]))
        for name, model in self.soft.items():
            off = float(np.linalg.norm(next(model.passes(*state))[platform, :3] - right))
            self.gaps[name] = max(self.gaps.get(name, 0.0), off / size if size > 0.0 else 0.0)
        return moved

    def _converged(self, passes: Iterable[Array], least: float) -> Array | None:
        """The accelerations that a pass no longer changes, measured by the greatest or `least` size."""
        arcs = np.repeat([1.0, self.tree.scale], 3)
        for before, after in pairwise(islice(passes, PASSES)):
            change, size = (float(np.max(np.abs(a * arcs))) for a in (after - before, after))
            if change <= CONVERGED * max(size, least):
                return after
        return None
