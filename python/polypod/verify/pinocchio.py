"""The mechanism in Pinocchio: every link, all joints solved, the tree's inverse dynamics on allowed motions.

Pinocchio gives positions, velocities, accelerations and Jacobians of frames, and the generalised forces of
the tree; what the loops add is here, in terms of those alone [T60] [T61] [T62].
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from polypod.answers.status import Status
from polypod.multibody.placement import BASE, PLATFORM, Placements
from polypod.multibody.tree import Body, Freedom, Multibody, joint_values, release
from polypod.vectors import cross, inverse

Array = NDArray[np.float64]

CLOSED = 1e-12
"""Largest error of a closure, as a cosine or a part of the characteristic length."""
MAX_STEPS = 25
"""Gauss-Newton steps; it takes one or two from a good start."""
RANK = 1e-9
"""Singular values of the closures below this part of the largest are zero. Redundant ones are below 1e-12."""
FEASIBLE = 1e-8
"""How much of the platform's motion, as a part of it, may break the closures."""

_AXES = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


@dataclass(eq=False)
class Moved:
    """The tree in motion at one state."""

    q: Array
    v: Array
    a: Array
    jacobian: Array
    """Of the closures, in pure numbers, as `Twin.scaled` says."""
    residual: float
    """Largest error of a closure, a pure number."""
    steps: int
    status: Status


class Tree:
    """A Pinocchio model of a `Multibody`, and its closures."""

    def __init__(self, tree: Multibody) -> None:
        self.tree = tree
        self.model = pin.Model()
        self.model.gravity.linear = np.array(tree.geometry["gravity"], dtype=np.float64)
        self._joints: dict[str, list[int]] = {}
        """Pinocchio's joints of each body, one for each degree of freedom."""
        self._carrier = {BASE: (0, np.eye(4))}
        """The joint that moves a body, and the body's frame in that joint's."""
        self._zero = tree.zero
        for body in tree.bodies:
            self._add(body)
        self.frames = {name: self._frame(name, name, np.zeros(3)) for name in self._zero}
        self.centers = {
            body.name: self._frame(f"{body.name} center", body.name, body.center) for body in tree.bodies
        }
        self.ends = [
            tuple(
                self._frame(f"{closure.name} {side}", closure.bodies[side], closure.points[side])
                for side in (0, 1)
            )
            if closure.points
            else None
            for closure in tree.closures
        ]
        self.data = self.model.createData()
        if not self.model.check(self.data):
            raise RuntimeError("Pinocchio finds the model unsound; its joints must be in depth-first order")

        floating = self.model.joints[self._joints[PLATFORM][0]]
        self.platform = np.arange(floating.idx_v, floating.idx_v + 6)
        self.passive = np.setdiff1d(np.arange(self.model.nv), self.platform)
        """Velocities of all joints but the floating platform, the prismatic ones too."""
        joints = [self._joints[leg.slide][0] for leg in tree.legs]
        self.slides = np.array([self.model.joints[joint].idx_v for joint in joints])
        """Entry of each leg's prismatic joint in velocities."""
        self.slide_values = np.array([self.model.joints[joint].idx_q for joint in joints])
        """Its entry in configurations."""
        # Lengths become pure numbers: v = units * (pure v).
        self.units = np.ones(self.model.nv)
        self.units[[*self.slides, *self.platform[:3]]] = tree.scale

    def _add(self, body: Body) -> None:
        parent, at = self._carrier[body.parent]
        place = at @ inverse(self._zero[body.parent]) @ body.zero
        joints = []
        for i, freedom in enumerate(body.freedoms):
            parent = self.model.addJoint(parent, _joint(freedom), pin.SE3(place), f"{body.name} {i}")
            place = np.eye(4)
            joints.append(parent)
        self._joints[body.name], self._carrier[body.name] = joints, (parent, place)
        inertia = pin.Inertia(body.mass, body.center, body.inertia)
        self.model.appendBodyToJoint(parent, inertia, pin.SE3(place))

    def _frame(self, name: str, body: str, point: Array) -> int:
        joint, place = self._carrier[body]
        offset = pin.SE3(place) * pin.SE3(np.eye(3), point)
        return int(self.model.addFrame(pin.Frame(name, joint, 0, offset, pin.FrameType.OP_FRAME)))

    # --- positions ---------------------------------------------------------------------------------------

    def start(self, placements: Placements) -> Array:
        """Configuration q with the bodies at `placements`, or nearby."""
        q = pin.neutral(self.model)
        placements = placements | {BASE: np.eye(4)}
        for body in self.tree.bodies:
            zero = inverse(self._zero[body.parent]) @ body.zero
            now = inverse(placements[body.parent]) @ placements[body.name]
            values = joint_values(body, zero, now)
            if body.name == PLATFORM:
                values = [pin.SE3ToXYZQUAT(pin.SE3(inverse(zero) @ now))]
            for joint, value in zip(self._joints[body.name], values, strict=True):
                entry = self.model.joints[joint]
                if isinstance(value, np.ndarray) and value.shape == (3, 3):
                    value = pin.Quaternion(value).coeffs()
                q[entry.idx_q : entry.idx_q + entry.nq] = value
        return np.asarray(pin.normalize(self.model, q))

    def placements(self) -> Placements:
        """Frame of each body where the tree is."""
        return {name: np.array(self.data.oMf[frame].homogeneous) for name, frame in self.frames.items()}

    def _rotation(self, body: str) -> Array:
        return np.asarray(self.data.oMf[self.frames[body]].rotation)

    def residual(self) -> Array:
        """Errors of the closures, pure numbers: distances of points over the scale, cosines [T59]."""
        rows = []
        for closure, ends in zip(self.tree.closures, self.ends, strict=True):
            if ends:
                a, b = (self.data.oMf[frame].translation for frame in ends)
                rows.append((a - b) / self.tree.scale)
            first, second = (self._rotation(body) for body in closure.bodies)
            rows += [np.array([(first @ p) @ (second @ r)]) for p, r in closure.squares]
        return np.concatenate(rows)

    def jacobian(self) -> Array:
        """Of `residual` by the velocities, in pure numbers, from the Jacobians of frames [T60]."""
        rows = []
        for closure, ends in zip(self.tree.closures, self.ends, strict=True):
            if ends:
                a, b = (self._frame_jacobian(frame)[:3] for frame in ends)
                rows.append((a - b) / self.tree.scale)
            if closure.squares:
                first, second = (self._rotation(body) for body in closure.bodies)
                a, b = (self._frame_jacobian(self.frames[body])[3:] for body in closure.bodies)
                rows += [cross(first @ p, second @ r)[None] @ (a - b) for p, r in closure.squares]
        return np.concatenate(rows) * self.units

    def _frame_jacobian(self, frame: int) -> Array:
        return np.asarray(pin.getFrameJacobian(self.model, self.data, frame, _AXES))

    def close(self, q: Array) -> tuple[Array, Array, float, int]:
        """Configuration with the platform kept and all closures satisfied, by Gauss-Newton steps [T60].

        Also the closures' Jacobian there, the largest error left, and the number of steps.
        """
        for step in range(MAX_STEPS + 1):
            pin.computeJointJacobians(self.model, self.data, q)
            pin.updateFramePlacements(self.model, self.data)
            error, jacobian = self.residual(), self.jacobian()
            worst = float(np.max(np.abs(error), initial=0.0))
            # One step beyond the tolerance goes down to rounding.
            if (worst <= CLOSED and step > 0) or step == MAX_STEPS or not np.isfinite(worst):
                break
            move = np.zeros(self.model.nv)
            move[self.passive] = _least(jacobian[:, self.passive], -error)
            q = pin.integrate(self.model, q, self.units * move)
        return q, jacobian, worst, step

    # --- velocities and accelerations --------------------------------------------------------------------

    def move(self, q: Array, pose: Array, twist: Array, acceleration: Array) -> Moved:
        """The motion of all joints that goes with that of the platform [T60]."""
        q, jacobian, worst, steps = self.close(q)
        status = Status.OK if worst <= CLOSED else Status.NOT_CONVERGED
        # The floating joint has the platform's own axes, and the acceleration of its frame, not of its point.
        turn = pose[:3, :3].T
        linear = acceleration[:3] - cross(twist[3:], twist[:3])
        v, a = np.zeros(self.model.nv), np.zeros(self.model.nv)
        if status is not Status.OK:
            return Moved(q, v, a, jacobian, worst, steps, status)
        v[self.platform] = [*(turn @ twist[:3]), *(turn @ twist[3:])]
        off = self._follow(jacobian, v, np.zeros(len(jacobian)))
        a[self.platform] = [*(turn @ linear), *(turn @ acceleration[3:])]
        off |= self._follow(jacobian, a, self._drift(q, v))
        return Moved(q, v, a, jacobian, worst, steps, Status.OFF_CONSTRAINT if off else Status.OK)

    def _follow(self, jacobian: Array, v: Array, drift: Array) -> bool:
        """Completes v by the joints' part; whether the closures cannot follow."""
        given = jacobian[:, self.platform] @ (v[self.platform] / self.units[self.platform]) + drift
        joints = jacobian[:, self.passive]
        found = _least(joints, -given)
        v[self.passive] = found * self.units[self.passive]
        size = np.max(np.abs(given), initial=0.0)
        return bool(np.max(np.abs(joints @ found + given), initial=0.0) > FEASIBLE * size)

    def _drift(self, q: Array, v: Array) -> Array:
        """Second rates of the closures without joint accelerations."""
        pin.forwardKinematics(self.model, self.data, q, v, np.zeros(self.model.nv))
        pin.updateFramePlacements(self.model, self.data)
        rows = []
        for closure, ends in zip(self.tree.closures, self.ends, strict=True):
            if ends:
                a, b = (self.acceleration(frame)[:3] for frame in ends)
                rows.append((a - b) / self.tree.scale)
            if not closure.squares:
                continue
            frames = [self.frames[body] for body in closure.bodies]
            (w_a, w_b), (e_a, e_b) = (
                [get(frame)[3:] for frame in frames] for get in (self.velocity, self.acceleration)
            )
            first, second = (self._rotation(body) for body in closure.bodies)
            for p, r in closure.squares:
                x, y = first @ p, second @ r
                normal_rate = cross(cross(w_a, x), y) + cross(x, cross(w_b, y))
                rows.append(np.array([(e_a - e_b) @ cross(x, y) + (w_a - w_b) @ normal_rate]))
        return np.concatenate(rows)

    def velocity(self, frame: int) -> Array:
        """(6,): velocity of a frame's point and its angular velocity, base axes."""
        return np.asarray(pin.getFrameVelocity(self.model, self.data, frame, _AXES).vector)

    def acceleration(self, frame: int) -> Array:
        """(6,): acceleration of a frame's point and its angular acceleration, base axes."""
        moved = pin.getFrameClassicalAcceleration(self.model, self.data, frame, _AXES)
        return np.asarray(moved.vector)

    def set(self, moved: Moved) -> None:
        """Puts the tree into a state of motion, for `velocity` and `acceleration`."""
        pin.forwardKinematics(self.model, self.data, moved.q, moved.v, moved.a)
        pin.updateFramePlacements(self.model, self.data)

    def required(self, moved: Moved, twist: Array, wrench: Array) -> Array:
        """(nv,): generalised forces that keep up the motion under a load (6,) at o in base axes [T61]."""
        geometry = self.tree.geometry
        force = np.array(pin.rnea(self.model, self.data, moved.q, moved.v, moved.a))
        damping = np.repeat([geometry["linear_damping"], geometry["angular_damping"]], 3)
        turn = self._rotation(PLATFORM).T
        pull = wrench - damping * twist
        force[self.platform] -= [*(turn @ pull[:3]), *(turn @ pull[3:])]
        # The efficiency divides the platform's own term alone [T15].
        force[self.platform] /= geometry["efficiency"]
        return force


def _joint(freedom: Freedom) -> Any:
    """Pinocchio's joint, in the axes of the body that it moves."""
    match freedom.kind:
        case "revolute":
            return pin.JointModelRevoluteUnaligned(freedom.axis)
        case "prismatic":
            return pin.JointModelPrismaticUnaligned(freedom.axis)
        case "spherical":
            return pin.JointModelSpherical()
    return pin.JointModelFreeFlyer()


def _least(matrix: Array, right: Array) -> Array:
    """The least solution of `matrix` x = `right`, with redundant rows and idle columns."""
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=RANK)[0])


class Twin:
    """The mechanism, and the same with its platform set free, for the constraint forces [T62]."""

    version: str = pin.__version__

    def __init__(self, tree: Multibody) -> None:
        self.tree = Tree(tree)
        self.free = Tree(release(tree))
        self.actuated = np.array([leg.actuated for leg in tree.legs])

    def answer(
        self, pose: Array, twist: Array, acceleration: Array, wrench: Array
    ) -> tuple[dict[str, Any], Status]:
        """All quantities at one state, SI, base axes; and what became of it.

        Args:
            pose: (4, 4).
            twist: (6,).
            acceleration: (6,).
            wrench: (6,), load at o in base axes.
        """
        tree = self.tree
        if not all(np.isfinite(a).all() for a in (pose, twist, acceleration, wrench)):
            return {}, Status.INVALID_INPUT
        start = tree.tree.start(pose)
        if not all(np.isfinite(frame).all() for frame in start.values()):
            return {}, Status.SINGULAR  # a leg without length, or along its own axis, has no frame
        moved = tree.move(tree.start(start), pose, twist, acceleration)
        if moved.status is not Status.OK:
            return {"closure": moved.residual, "steps": moved.steps}, moved.status
        tree.set(moved)
        found = self._kinematics(moved)
        forces, torques, freedoms, status = self._forces(moved, pose, twist, wrench)
        found |= {
            "forces": forces,
            "idle_torques": torques,
            "freedoms": freedoms,
            "closure": moved.residual,
            "steps": moved.steps,
        }
        if status is not Status.OK:
            return found, status
        free = self.free.move(self.free.start(tree.placements()), pose, twist, acceleration)
        if free.status is not Status.OK:
            return found, free.status
        held = self._constraint_wrench(free, forces, torques, pose, twist, wrench)
        return found | {"constraint_force": held[:3], "constraint_torque": held[3:]}, status

    def _kinematics(self, moved: Moved) -> dict[str, Any]:
        tree = self.tree
        legs, parts = tree.slides, tree.tree.legs

        def of(get: Any, frames: list[int], part: slice) -> Array:
            return np.array([get(frame)[part] for frame in frames]).reshape(-1, 3)

        pistons = [tree.centers[leg.second] for leg in parts]
        cylinders = [tree.centers[leg.first] for leg in parts]
        rods = [tree.frames[rod] for rod in tree.tree.rods]
        point, turn = slice(0, 3), slice(3, 6)
        return {
            "lengths": np.array([leg.coordinate for leg in parts]) + moved.q[tree.slide_values],
            "rates": moved.v[legs],
            "accelerations": moved.a[legs],
            "leg_omega": of(tree.velocity, pistons, turn),
            "leg_eps": of(tree.acceleration, pistons, turn),
            "piston_velocity": of(tree.velocity, pistons, point),
            "piston_acceleration": of(tree.acceleration, pistons, point),
            "cylinder_velocity": of(tree.velocity, cylinders, point),
            "cylinder_acceleration": of(tree.acceleration, cylinders, point),
            "rod_omega": of(tree.velocity, rods, turn),
            "rod_eps": of(tree.acceleration, rods, turn),
        }

    def _forces(
        self, moved: Moved, pose: Array, twist: Array, wrench: Array
    ) -> tuple[Array, Array, int, Status]:
        """Forces of the prismatic joints that do the work of all others on all allowed motions [T61].

        With them the torques about the lines of local degrees of freedom, the number of allowed motions, and
        whether they determine the forces; redundant ones are the least.
        """
        tree = self.tree
        required = tree.required(moved, twist, wrench)
        _, sizes, right = np.linalg.svd(moved.jacobian)
        rank = int(np.sum(sizes > RANK * sizes[0]))
        allowed = tree.units[:, None] * right[rank:].T
        driven = tree.slides[self.actuated]
        forces = np.zeros(len(tree.slides))
        spins = self._spins(tree, pose)
        work = np.hstack([allowed[driven].T, allowed.T @ spins])
        found, _, determined, _ = np.linalg.lstsq(work, allowed.T @ required, rcond=RANK)
        forces[self.actuated] = found[: len(driven)]
        freedoms = np.linalg.matrix_rank(allowed[tree.platform], rtol=RANK)
        status = Status.OK if determined == min(work.shape[1], freedoms) else Status.SINGULAR
        return forces, found[len(driven) :], allowed.shape[1], status

    def _spins(self, tree: Tree, pose: Array) -> Array:
        """(nv, idle): generalised forces of a unit torque about the line of each local degree of freedom."""
        spins = np.zeros((tree.model.nv, len(tree.tree.idle)))
        for k, (body, axis) in enumerate(tree.tree.idle):
            spins[tree.platform[3:], k] = axis if body == PLATFORM else pose[:3, :3].T @ axis
        return spins

    def _constraint_wrench(
        self, moved: Moved, forces: Array, torques: Array, pose: Array, twist: Array, wrench: Array
    ) -> Array:
        """(6,): what the constraints do on the platform, at o in base axes, legs continued off them [T62]."""
        tree = self.free
        tree.set(moved)
        required = tree.required(moved, twist, wrench)
        required[tree.slides] -= forces
        required -= self._spins(tree, pose) @ torques
        # How the joints follow each of the six motions of the free platform.
        jacobian = moved.jacobian
        follow = np.linalg.lstsq(jacobian[:, tree.passive], -jacobian[:, tree.platform], rcond=RANK)[0]
        follow = tree.units[tree.passive, None] * follow / tree.units[tree.platform]
        local = required[tree.platform] + follow.T @ required[tree.passive]
        turn = pose[:3, :3]
        return np.concatenate([turn @ local[:3], turn @ local[3:]])
