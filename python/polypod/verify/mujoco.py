"""The mechanism in MuJoCo, whose loops are soft: an approximate check, and how far off the defaults are.

MuJoCo lets every constraint give way by a part 1 - d of what it should hold, with an impedance d of at most
0.9999. That is applied in passes here: the loops' forces of one are given as forces to the next, so that only
what is left gives way, until accelerations stay the same. Its inverse dynamics takes loops' forces from how
far they gave way, and is not used.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice, pairwise
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
from numpy.typing import NDArray

from polypod.multibody.placement import BASE, PLATFORM, cross, inverse, turn_about
from polypod.multibody.tree import POINT, Body, Closure, Freedom, Multibody, joint_values
from polypod.status import Status
from polypod.verify.forced import Forced, inertial, light, pull
from polypod.verify.rows import Start

Array = NDArray[np.float64]

STIFF = {"solimp": "0.9999 0.9999 0.001 0.5 2", "solref": "0.0002 1"}
"""The highest impedance that MuJoCo takes, at any error, and a time constant of two steps, s."""
PATIENT = STIFF | {"solref": "1 1"}
"""The same, but errors of position, which are rounding, are taken back slowly, not by accelerations."""
EVEN = 0.01
"""What a constraint gives way is proportional to the mobility of its links, which MuJoCo takes from the zero
of the model: a light link that carries heavy ones hardly holds them. In passes all get this part of the
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
    """The mechanism as a model file for MuJoCo: a tree of bodies, and an equality for each closure [T64].

    Masses, and so forces, are in `unit_of_mass`.

    Args:
        tree: the mechanism.
        constraint: attributes of all equalities, MuJoCo's own defaults without.
    """
    root = ElementTree.Element("mujoco", model=tree.name)
    ElementTree.SubElement(root, "compiler", angle="radian", autolimits="true")
    flags = {"gravity": _text(tree.geometry["gravity"]), "timestep": repr(STEP), "integrator": "implicitfast"}
    ElementTree.SubElement(
        root, "option", flags | {"solver": "Newton", "jacobian": "dense", "tolerance": "0"}
    )
    nodes = {BASE: ElementTree.SubElement(root, "worldbody")}
    for body in tree.bodies:
        place = inverse(tree.zero[body.parent]) @ body.zero
        nodes[body.name] = _body(nodes[body.parent], tree, body, place)
    equalities = ElementTree.SubElement(root, "equality")
    for closure in tree.closures:
        tie = _ties(tree, closure)
        first, second = (nodes[body] for body in closure.bodies)
        if tie.cross is not None:
            first = _cross(first, tree, f"{closure.name} cross", tie.cross)
        for k, points in enumerate(tie.points):
            ends = zip((first, second), points, strict=True)
            names = [
                _site(node, f"{closure.name} {k} {side}", point) for side, (node, point) in enumerate(ends)
            ]
            sites = {"site1": names[0], "site2": names[1]}
            ElementTree.SubElement(equalities, "connect", sites | (constraint or {}))
    return ElementTree.tostring(root, encoding="unicode")


@dataclass(frozen=True, eq=False)
class Cross:
    """The cross of a universal joint."""

    origin: Array
    """(3,), in the first body."""
    hinge: Array
    """(3,): axis about which it turns in the first body."""
    own: Array
    """(3,): its other axis, in its own axes."""
    other: Array
    """(3,): the same, in the axes of the second body."""


@dataclass(frozen=True, eq=False)
class Ties:
    """A closure by points that coincide: MuJoCo's "connect" alone leaves out no term of the acceleration."""

    points: tuple[tuple[Array, Array], ...]
    """(3,) each, in the frames of the two bodies, or of the cross and the second body."""
    cross: Cross | None
    """Between the two bodies, for a universal joint."""


def _ties(tree: Multibody, closure: Closure) -> Ties:
    """Points on the axes that the two bodies have in common [T64]."""
    if closure.points is None:
        raise NotImplementedError(f"{closure.name}: MuJoCo's closures are at points")
    (a, b), s = closure.points, tree.scale
    first, second = (tree.zero[body][:3, :3] for body in closure.bodies)
    turn = first.T @ second

    def along(mine: Array, other: Array) -> tuple[Array, Array]:
        """Points on an axis, `other` up to its sign, which is as at zero."""
        return a + s * mine, b + s * np.sign((turn @ other) @ mine) * other

    match closure.squares:
        case ():
            return Ties(((a, b),), None)
        case ((x, y),):
            mine = turn @ y
            mine = mine - x * (x @ mine)
            mine /= np.linalg.norm(mine)
            return Ties(((POINT, b), (s * mine, b + s * y)), Cross(a, x, mine, y))
        case ((x, y), (_, z)):
            return Ties(((a, b), along(x, cross(y, z))), None)
        case ((x, y), (_, z), (w, _)):
            first = cross(y, z)
            return Ties(((a, b), along(x, first), along(w, cross(first, z))), None)
    raise NotImplementedError(f"{closure.name}: {len(closure.squares)} turns")


def _cross(parent: Any, tree: Multibody, name: str, cross: Cross) -> Any:
    """The cross of a universal joint, a body of hardly any mass."""
    node = ElementTree.SubElement(parent, "body", name=name, pos=_text(cross.origin))
    _joint(node, f"{name} 0", Freedom("revolute", cross.hinge))
    _inertial(node, tree, POINT, *light(tree))
    return node


def _inertial(node: Any, tree: Multibody, center: Array, mass: float, inertia: Array) -> None:
    numbers = np.array([mass, *np.diag(inertia), inertia[0, 1], inertia[0, 2], inertia[1, 2]])
    mass, *six = (numbers / unit_of_mass(tree)).tolist()
    ElementTree.SubElement(node, "inertial", pos=_text(center), mass=repr(mass), fullinertia=_text(six))


def _body(parent: Any, tree: Multibody, body: Body, place: Array) -> Any:
    node = ElementTree.SubElement(
        parent, "body", name=body.name, pos=_text(place[:3, 3]), quat=_text(_quaternion(place))
    )
    for i, freedom in enumerate(body.freedoms):
        _joint(node, f"{body.name} {i}", freedom)
    _inertial(node, tree, body.center, *(inertial(tree, body) if body.mass > 0.0 else light(tree)))
    return node


def _joint(node: Any, name: str, freedom: Freedom) -> None:
    match freedom.kind:
        case "free":
            ElementTree.SubElement(node, "freejoint", name=name)
        case "spherical":
            ElementTree.SubElement(node, "joint", name=name, type="ball")
        case kind:
            kinds = {"revolute": "hinge", "prismatic": "slide"}
            ElementTree.SubElement(node, "joint", name=name, type=kinds[kind], axis=_text(freedom.axis))


def _site(node: Any, name: str, point: Array) -> str:
    ElementTree.SubElement(node, "site", name=name, pos=_text(point))
    return name


def _text(numbers: Any) -> str:
    return " ".join(repr(float(x)) for x in numbers)


def _quaternion(frame: Array) -> Array:
    """(4,): w, x, y, z of a frame (4, 4)."""
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, frame[:3, :3].ravel())
    return quaternion


class Model:
    """A compiled model, by default with MuJoCo's own constraints."""

    def __init__(self, tree: Multibody, constraint: dict[str, str] | None = None) -> None:
        self.tree, self.unit = tree, unit_of_mass(tree)
        self._crosses = [(c, t) for c in tree.closures if (t := _ties(tree, c).cross) is not None]
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
            data.qfrc_applied[self._joint(leg.piston, 0).dofadr[0]] = force / self.unit
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
        placements = start.placements | {BASE: np.eye(4)}
        for body in self.tree.bodies:
            zero = inverse(self.tree.zero[body.parent]) @ body.zero
            now = inverse(placements[body.parent]) @ placements[body.name]
            values: list[Any] = list(joint_values(body, zero, now))
            if body.name == PLATFORM:
                values = [[*now[:3, 3], *_quaternion(now)]]
            for i, value in enumerate(values):
                if isinstance(value, np.ndarray):
                    frame = np.eye(4)
                    frame[:3, :3] = value
                    value = _quaternion(frame)
                first = self._joint(body.name, i).qposadr[0]
                data.qpos[first : first + np.size(value)] = value
        for closure, piece in self._crosses:
            first, second = (placements[body][:3, :3] for body in closure.bodies)
            angle = turn_about(piece.hinge, piece.own, first.T @ second @ piece.other)
            data.qpos[self._joint(f"{closure.name} cross", 0).qposadr[0]] = angle
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
