"""The mechanism in Exudyn: free links, hard constraints, the forces applied, and the motion that comes out.

Exudyn integrates constraints exactly but cannot have redundant ones: some rows of them are released, as many
as ranks say and `Twin.notes` names [T63]. It gives accelerations and motions; it has no inverse dynamics.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import exudyn
import numpy as np
from exudyn import itemInterface as items
from exudyn.rigidBodyUtilities import AngularVelocity2EulerParameters_t, RotationMatrix2EulerParameters
from numpy.typing import NDArray

from polypod.answers.status import Status
from polypod.multibody.placement import BASE, PLATFORM, Placements
from polypod.multibody.tree import POINT, Body, Multibody
from polypod.vectors import cross, perpendiculars
from polypod.verify.constraints import Row, Slide, Start
from polypod.verify.twin import Forced, inertial

Array = NDArray[np.float64]
Drive = Callable[[float], tuple[Array, Array]]
"""Time, s → forces of the legs (L,), N, positive apart or along the rail; load at o (6,), base axes, SI."""

NEWTON = 1e-10
"""Relative and absolute tolerance of the integrator's Newton iteration."""
WIDTH = float(np.cbrt(np.finfo(np.float64).eps))
"""Of Exudyn's differences at the start, m and Euler parameters: the cube root of rounding, where the error
that two widths leave, of second order, is as large as rounding over the width."""
SPECTRAL_RADIUS = 0.9
"""Of the generalised-alpha integrator at infinite frequency: it damps what the constraints excite."""

# What it prints would stand among what a command prints; failures are reported by status.
exudyn.config.printToConsole = False
_OUTPUT = exudyn.OutputVariableType
_NOW = exudyn.ConfigurationType.Current


class Twin(Forced):
    """The mechanism's links and constraints; an Exudyn system is made from them for each start."""

    version: str = exudyn.__version__

    def __init__(self, tree: Multibody) -> None:
        super().__init__(tree)
        self.centers = {body.name: body.center for body in tree.bodies} | {BASE: POINT}
        self._released: dict[str, None] = {}

    def notes(self) -> list[str]:
        """The constraints that Exudyn did without."""
        if not self._released:
            return []
        return [f"Released, because other constraints say the same: {'; '.join(self._released)}."]

    def accelerations(self, start: Start, twist: Array, wrench: Array, forces: Array) -> Array | Status:
        """`Forced.accelerations`; SINGULAR where Exudyn cannot solve for them."""
        self._released |= dict.fromkeys(self.links.words(start.redundant))
        found = System(self, start, lambda t: (forces, wrench)).accelerations()
        return Status.SINGULAR if found is None else found

    def follow(
        self, pose: Array, twist: Array, drive: Drive, duration: float, steps: int, every: int
    ) -> Track | None:
        """The motion under forces from a start, in `steps` equal steps; None where Exudyn gives up.

        Args:
            pose: (4, 4), of the platform at the start.
            twist: (6,).
            drive: forces and load over time, from 0 to `duration`.
            duration: s.
            steps: of the integrator.
            every: steps from one record to the next.
        """
        start = self.links.start(pose, twist)
        return System(self, start, drive).run(duration, steps, every) if start.status is Status.OK else None


@dataclass(eq=False)
class Track:
    """The recorded motion, the start left out."""

    pose: Array
    """(N, 4, 4), of the platform."""
    lengths: Array
    """(N, legs), m."""
    closure: float
    """Largest error of all constraints, also the released ones."""


class System:
    """An Exudyn system at a start."""

    def __init__(self, twin: Twin, start: Start, drive: Drive) -> None:
        self.twin, self.tree = twin, twin.tree
        self._container = exudyn.SystemContainer()
        self.mbs = self._container.AddSystem()
        self._number = {BASE: self.mbs.AddObject(items.ObjectGround())}
        for body, twist in zip(self.tree.bodies, start.twists, strict=True):
            self._link(body, start.placements[body.name], twist)
        for i in np.setdiff1d(np.arange(len(twin.links.rows)), start.redundant):
            self._constrain(twin.links.rows[i])
        self._load(drive)
        self.mbs.Assemble()
        acting = (start.twists, self.tree.geometry["gravity"], *drive(0.0))
        self._idle = not any(np.any(a) for a in acting)

    # --- making it ---------------------------------------------------------------------------------------

    def _link(self, link: Body, frame: Array, twist: Array) -> None:
        """A rigid body with its node at the mass centre, and its weight."""
        turn, arm = frame[:3, :3], frame[:3, :3] @ link.center
        parameters = RotationMatrix2EulerParameters(turn)
        rates = AngularVelocity2EulerParameters_t(twist[3:], parameters)
        node = items.NodeRigidBodyEP(
            referenceCoordinates=[*(frame[:3, 3] + arm), *parameters],
            initialVelocities=[*(twist[:3] + cross(twist[3:], arm)), *rates],
        )
        mass, inertia = inertial(self.tree, link)
        # Diagonal, then yz, xz, xy.
        six = [*np.diag(inertia), inertia[1, 2], inertia[0, 2], inertia[0, 1]]
        body = items.ObjectRigidBody(nodeNumber=self.mbs.AddNode(node), mass=mass, inertia=six)
        self._number[link.name] = self.mbs.AddObject(body)
        marker = self.mbs.AddMarker(items.MarkerBodyMass(bodyNumber=self._number[link.name]))
        gravity = list(self.tree.geometry["gravity"])
        self.mbs.AddLoad(items.LoadMassProportional(markerNumber=marker, loadVector=gravity))

    def _marker(self, body: str, axes: Array, point: Array) -> Any:
        frame = np.eye(4)
        frame[:3, :3], frame[:3, 3] = axes, point - self.twin.centers[body]
        return self.mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=self._number[body], localHT=frame))

    def _constrain(self, row: Row) -> None:
        """A generic joint that has one constraint alone."""
        if isinstance(row, Slide):
            # The displacement along the first marker's x.
            axes, which = (_axis_in_column(row.axis, 0), np.eye(3)), 0
            points = row.points
        else:
            # Its first rotation keeps y of the first marker perpendicular to z of the second.
            axes, which = (_axis_in_column(row.axes[0], 1), _axis_in_column(row.axes[1], 2)), 3
            points = (POINT, POINT)
        markers = [self._marker(body, *at) for body, *at in zip(row.bodies, axes, points, strict=True)]
        constrained = [int(i == which) for i in range(6)]
        self.mbs.AddObject(items.ObjectJointGeneric(markerNumbers=markers, constrainedAxes=constrained))

    def _load(self, drive: Drive) -> None:
        geometry, mbs, share = self.tree.geometry, self.mbs, 1.0 / self.tree.geometry["efficiency"]
        held: dict[float, tuple[Array, Array]] = {}

        def at(t: float) -> tuple[Array, Array]:
            """Many loads ask for the same time."""
            if t not in held:
                held.clear()
                held[t] = drive(t)
            return held[t]

        for i, leg in enumerate(self.tree.legs):
            # In the links' axes: on both, apart, or on the first alone where the base carries the rest.
            pushed = [(leg.slide, leg.axis)]
            if not leg.drive.moves_foot:
                pushed.append((leg.first, -leg.axis))
            for body, way in pushed:

                def push(mbs: Any, t: float, load: Any, i: int = i, way: Array = way) -> list[float]:
                    return (float(at(t)[0][i]) * way).tolist()  # type: ignore[no-any-return]

                marker = self._marker(body, np.eye(3), POINT)
                mbs.AddLoad(
                    items.LoadForceVector(markerNumber=marker, bodyFixed=True, loadVectorUserFunction=push)
                )
        platform = self._marker(PLATFORM, np.eye(3), POINT)
        for part, kind in ((slice(0, 3), items.LoadForceVector), (slice(3, 6), items.LoadTorqueVector)):

            def pull(mbs: Any, t: float, load: Any, part: slice = part) -> list[float]:
                return (share * at(t)[1][part]).tolist()  # type: ignore[no-any-return]

            mbs.AddLoad(kind(markerNumber=platform, loadVectorUserFunction=pull))
        damping = share * np.repeat([geometry["linear_damping"], geometry["angular_damping"]], 3)
        if damping.any():
            damper = items.ObjectConnectorRigidBodySpringDamper(
                markerNumbers=[self._marker(BASE, np.eye(3), POINT), platform], damping=np.diag(damping)
            )
            mbs.AddObject(damper)

    # --- using it ----------------------------------------------------------------------------------------

    def accelerations(self) -> Array | None:
        """(bodies, 6) at the start, as `Forced.accelerations`.

        Exudyn takes the constraints' second rates as one-sided differences, with an error proportional to
        their width: two widths give it away.
        """
        wide, narrow = (self._initial(width) for width in (WIDTH, 0.5 * WIDTH))
        return None if wide is None or narrow is None else 2.0 * narrow - wide

    def _initial(self, width: float) -> Array | None:
        """The accelerations that go with forces and constraints, which Exudyn finds before its first step."""
        solver: Any = exudyn.MainSolverImplicitSecondOrder()
        settings = _settings(1e-6, 1)
        differences = settings.timeIntegration.newton.numericalDifferentiation
        # Relative to a coordinate's change, none at the start, or to this size where that is greater.
        differences.relativeEpsilon = width / differences.minimumCoordinateSize
        if not solver.InitializeSolver(self.mbs, settings):
            return None
        found = np.array([self._acceleration(name) for name in self.twin.links.bodies])
        moves = np.any(self.mbs.systemData.GetODE2Coordinates_tt())
        solver.FinalizeSolver(self.mbs, settings)
        # Where it finds the system singular, Exudyn warns and takes zeros.
        return found if np.isfinite(found).all() and (moves or self._idle) else None

    def _acceleration(self, name: str) -> Array:
        point = -self.twin.centers[name] if name == PLATFORM else POINT
        return np.concatenate(
            [
                self.mbs.GetObjectOutputBody(self._number[name], kind, point, _NOW)
                for kind in (_OUTPUT.Acceleration, _OUTPUT.AngularAcceleration)
            ]
        )

    def run(self, duration: float, steps: int, every: int) -> Track | None:
        """`Twin.follow` of this system."""
        records: dict[int, Placements] = {}

        def record(mbs: Any, t: float) -> bool:
            step = round(steps * t / duration)
            if step > 0 and step % every == 0:
                records[step] = {name: self._placement(name) for name in self.twin.links.bodies}
            return True

        self.mbs.SetPostStepUserFunction(record)
        kind = exudyn.DynamicSolverType.GeneralizedAlpha
        try:
            good = self.mbs.SolveDynamic(_settings(duration, steps), solverType=kind)
        except (RuntimeError, ValueError):  # how Exudyn says that a step did not converge
            return None
        if not good or len(records) != steps // every:
            return None
        poses = np.array([placed[PLATFORM] for placed in records.values()])
        lengths = np.array(
            [[leg.coordinate_at(placed) for leg in self.tree.legs] for placed in records.values()]
        )
        closure = max(self.twin.links.worst(placed) for placed in records.values())
        return Track(poses, lengths, closure)

    def _placement(self, name: str) -> Array:
        """(4, 4): a body's frame now."""
        point = -self.twin.centers[name]
        frame = np.eye(4)
        number = self._number[name]
        frame[:3, :3] = np.reshape(
            self.mbs.GetObjectOutputBody(number, _OUTPUT.RotationMatrix, point, _NOW), (3, 3)
        )
        frame[:3, 3] = self.mbs.GetObjectOutputBody(number, _OUTPUT.Position, point, _NOW)
        return frame


def _axis_in_column(axis: Array, column: int) -> Array:
    """(3, 3): a rotation with a unit axis in a column."""
    return np.roll(np.column_stack([axis, *perpendiculars(axis)]), column, axis=1)


def _settings(duration: float, steps: int) -> Any:
    """Of the generalised-alpha integrator of second order, with nothing written to files."""
    settings = exudyn.SimulationSettings()
    settings.solution.file.write = False
    integration = settings.timeIntegration
    integration.endTime, integration.numberOfSteps = duration, steps
    integration.adaptiveStep = False
    integration.newton.relativeTolerance = integration.newton.absoluteTolerance = NEWTON
    integration.generalizedAlpha.spectralRadius = SPECTRAL_RADIUS
    return settings
