"""The mechanism in MuJoCo, whose loops are soft: an approximate check, and how far off the defaults are.

MuJoCo lets every constraint give way by a part 1 - d of what it should hold, with an impedance d that it keeps
below 0.9999. So its accelerations are good to some thousandths at best. Its inverse dynamics takes the
loops' forces from how far they gave way, and is of no use here.
"""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
from numpy.typing import NDArray

from polypod.status import Status
from polypod.verify.placement import BASE, PLATFORM, inverse
from polypod.verify.rows import Links, Start
from polypod.verify.tree import Body, Freedom, Multibody, joint_values

Array = NDArray[np.float64]

STIFF = {"solimp": "0.9999 0.9999 0.001 0.5 2", "solref": "0.0002 1"}
"""The highest impedance that MuJoCo takes, at any error, and a time constant of two steps, s."""
STEP = 1e-4
"""s."""
LIGHT = 1e-8
"""Mass that a link without mass gets, as a part of the platform's; MuJoCo moves none without. Inertia likewise."""


def mjcf(tree: Multibody, constraint: dict[str, str] | None = None) -> str:
    """The mechanism as a model file for MuJoCo: a tree of bodies, and an equality for each closure [T64].

    Args:
        tree: the mechanism.
        constraint: attributes of all equalities, MuJoCo's own defaults without.
    """
    root = ElementTree.Element("mujoco", model=tree.name)
    ElementTree.SubElement(root, "compiler", angle="radian", autolimits="true")
    flags = {"gravity": _text(tree.geometry["gravity"]), "timestep": repr(STEP), "integrator": "implicitfast"}
    ElementTree.SubElement(root, "option", flags | {"solver": "Newton", "iterations": "200", "tolerance": "0"})
    nodes = {BASE: ElementTree.SubElement(root, "worldbody")}
    zero = {BASE: np.eye(4)} | {body.name: body.zero for body in tree.bodies}
    for body in tree.bodies:
        nodes[body.name] = _body(nodes[body.parent], tree, body, inverse(zero[body.parent]) @ body.zero)
    tendons = ElementTree.SubElement(root, "tendon")
    equalities = ElementTree.SubElement(root, "equality")
    for closure in tree.closures:
        ends = [nodes[body] for body in closure.bodies]
        if closure.points is None:
            raise NotImplementedError(f"{closure.name}: MuJoCo's closures are at points")
        names = [_site(end, f"{closure.name} {i}", p) for i, (end, p) in enumerate(zip(ends, closure.points, strict=True))]
        tie = {"site1": names[0], "site2": names[1]} | (constraint or {})
        ElementTree.SubElement(equalities, "connect", tie)
        for k, axes in enumerate(closure.squares):
            # Two axes of one length from one point are square if and only if their ends keep their distance.
            name = f"{closure.name} square {k}"
            tendon = ElementTree.SubElement(tendons, "spatial", name=name)
            for i in (0, 1):
                point = closure.points[i] + tree.scale * axes[i]
                ElementTree.SubElement(tendon, "site", site=_site(ends[i], f"{name} {i}", point))
            ElementTree.SubElement(equalities, "tendon", {"tendon1": name} | (constraint or {}))
    return ElementTree.tostring(root, encoding="unicode")


def _body(parent: Any, tree: Multibody, body: Body, place: Array) -> Any:
    node = ElementTree.SubElement(
        parent, "body", name=body.name, pos=_text(place[:3, 3]), quat=_text(_quaternion(place))
    )
    for i, freedom in enumerate(body.freedoms):
        _joint(node, f"{body.name} {i}", freedom)
    # The efficiency divides the platform's own term alone [T15].
    share = 1.0 / tree.geometry["efficiency"] if body.name == PLATFORM else 1.0
    light = LIGHT * next(b.mass for b in tree.bodies if b.name == PLATFORM)
    mass = share * body.mass + light * (body.mass == 0.0)
    # Weak axes get a little too: a link turns about each.
    inertia = share * body.inertia + light * tree.scale**2 * np.eye(3)
    six = [*np.diag(inertia), inertia[0, 1], inertia[0, 2], inertia[1, 2]]
    ElementTree.SubElement(
        node, "inertial", pos=_text(body.center), mass=repr(float(mass)), fullinertia=_text(six)
    )
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
    """A compiled model, with stiff or with MuJoCo's own constraints."""

    def __init__(self, tree: Multibody, constraint: dict[str, str] | None) -> None:
        self.tree = tree
        self.model = mujoco.MjModel.from_xml_string(mjcf(tree, constraint))
        self.data = mujoco.MjData(self.model)
        self._bodies = {body.name: self.model.body(body.name).id for body in tree.bodies}

    def accelerations(self, start: Start, twist: Array, wrench: Array, forces: Array) -> dict[str, Array]:
        """(6,) of each body under forces: of its mass centre, of o for the platform, and angular."""
        model, data = self.model, self.data
        mujoco.mj_resetData(model, data)
        self._put(start)
        geometry, share = self.tree.geometry, 1.0 / self.tree.geometry["efficiency"]
        for leg, force in zip(self.tree.legs, forces, strict=True):
            data.qfrc_applied[self._joint(leg.piston, 0).dofadr[0]] = force
        damping = np.repeat([geometry["linear_damping"], geometry["angular_damping"]], 3)
        pull = share * (wrench - damping * twist)
        platform = self._bodies[PLATFORM]
        point = start.placements[PLATFORM][:3, 3]
        mujoco.mj_applyFT(model, data, pull[:3], pull[3:], point, platform, data.qfrc_applied)
        mujoco.mj_forward(model, data)
        rates = data.qacc.copy()
        drift, linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv)), np.zeros((3, model.nv))
        found = {}
        for body in self.tree.bodies:
            number = self._bodies[body.name]
            at = point if body.name == PLATFORM else data.xipos[number].copy()
            mujoco.mj_jac(model, data, linear, angular, at, number)
            both = np.concatenate([linear, angular])
            mujoco.mj_jacDot(model, data, drift, angular, at, number)
            found[body.name] = both @ rates + np.concatenate([drift, angular]) @ data.qvel
        return found

    def _joint(self, body: str, i: int) -> Any:
        return self.model.joint(f"{body} {i}")

    def _put(self, start: Start) -> None:
        """All links where and as they move at the start."""
        model, data = self.model, self.data
        placements = start.placements | {BASE: np.eye(4)}
        zeros = {BASE: np.eye(4)} | {body.name: body.zero for body in self.tree.bodies}
        for body in self.tree.bodies:
            zero = inverse(zeros[body.parent]) @ body.zero
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
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        rows = np.zeros((len(self.tree.bodies), 6, model.nv))
        for row, body in zip(rows, self.tree.bodies, strict=True):
            at = start.placements[body.name][:3, 3]
            mujoco.mj_jac(model, data, row[:3], row[3:], at, self._bodies[body.name])
        data.qvel[:] = np.linalg.lstsq(rows.reshape(-1, model.nv), start.twists.ravel())[0]


class Twin:
    """The mechanism with stiff constraints, and beside it with MuJoCo's defaults."""

    version: str = mujoco.__version__

    def __init__(self, tree: Multibody) -> None:
        self.tree = tree
        self.links = Links(tree)
        self.stiff, self.default = Model(tree, STIFF), Model(tree, None)
        self._gap = 0.0

    def notes(self) -> list[str]:
        """How far MuJoCo's defaults are off."""
        return [
            "With MuJoCo's default solref and solimp the platform's acceleration is off by up to "
            f"{self._gap:.2g} of itself and gravity; compared here with solimp {STIFF['solimp'].split()[0]}."
        ]

    def answer(
        self, pose: Array, twist: Array, wrench: Array, forces: Array
    ) -> tuple[dict[str, Any], Status]:
        """Accelerations at one state under the forces given, SI, base axes; and what became of it.

        Args:
            pose: (4, 4).
            twist: (6,).
            wrench: (6,), load at o in base axes.
            forces: (legs,), of the prismatic joints.
        """
        if not all(np.isfinite(a).all() for a in (pose, twist, wrench, forces)):
            return {}, Status.INVALID_INPUT
        start = self.links.start(pose, twist)
        if start.status is not Status.OK:
            return {"closure": start.closure}, start.status
        moved, soft = (m.accelerations(start, twist, wrench, forces) for m in (self.stiff, self.default))
        right, off = moved[PLATFORM][:3], soft[PLATFORM][:3] - moved[PLATFORM][:3]
        size = np.linalg.norm(right) + np.linalg.norm(self.tree.geometry["gravity"])
        self._gap = max(self._gap, float(np.linalg.norm(off) / size) if size > 0.0 else 0.0)
        legs = self.tree.legs
        return {
            "closure": start.closure,
            "platform_acceleration": moved[PLATFORM][:3],
            "platform_eps": moved[PLATFORM][3:],
            "leg_eps": np.array([moved[leg.cylinder][3:] for leg in legs]),
            "piston_acceleration": np.array([moved[leg.piston][:3] for leg in legs]),
            "cylinder_acceleration": np.array([moved[leg.cylinder][:3] for leg in legs]),
            "rod_eps": np.array([moved[rod][3:] for rod in self.tree.rods]).reshape(-1, 3),
        }, Status.OK
