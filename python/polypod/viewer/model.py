"""Model of the page: the present pose and its results. Independent of browsers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polypod.answers.leg_words import readable_coordinate
from polypod.answers.singularity import NEAR_SINGULAR, TOLERANCE, SingularityKind
from polypod.answers.status import Status
from polypod.bodies.links import LinkPlaces, links_of
from polypod.errors import PolypodError, UnknownNameError
from polypod.files.units import KIND_OF_COORDINATE, coordinate_unit, readable, si_unit
from polypod.mechanism import Mechanism, spans
from polypod.viewer.player import Track

Array = NDArray[np.float64]

NEAR_LIMIT = 0.05
"""Slack of a limit, by its scale, up to which the page warns."""

LATERAL = 0.6
"""How far a coordinate's slider reaches to each side of home, by the mean leg length there."""

_REST = np.zeros(6)
_TURN = {"turn": np.pi}  # other angles reach a quarter turn to each side
_MOST_NOTES = 4


class Level(IntEnum):
    """How serious something is."""

    FINE = 0
    NEAR = 1
    BEYOND = 2


@dataclass(frozen=True)
class Note:
    """A line about the present pose."""

    level: Level
    text: str


@dataclass(frozen=True)
class Screw:
    """A motion that the locked legs hardly resist, base axes: a rotation about an axis, or a translation."""

    point: Array
    """(3,), m."""
    axis: Array
    """(3,), unit."""
    pitch: float
    """m/rad; inf for a translation."""
    velocity: Array
    """(3,): of o, m/s, for a motion of the size that `Singularity.twist` has."""


@dataclass(frozen=True, eq=False)
class View:
    """All that the page shows of a pose; SI, base axes; n legs, l links."""

    pose: Array
    """(4, 4)."""
    frames: Array
    """(l, 4, 4): of `links_of`."""
    lengths: Array
    """(n,), m."""
    joints: Array
    """(n, 3): where active forces are drawn, m: at platform joints b, or at base joints that are moved."""
    directions: Array
    """(n, 3)."""
    slack: Array
    """(n,): least slack of the limits of each leg, by their scale; inf for a leg without limits."""
    forces: Array
    """(n,): active forces, N; NaN where they are not determined."""
    wrench: Array
    """(6,): of the constraining legs on the platform at o, less their active forces, N and N m; or NaN."""
    sigma_min: float
    condition: float
    determinant: float
    screw: Screw | None
    """Where the pose is near a singularity that lets the platform move."""
    coordinates: Mapping[str, float]
    """All numbers of the chosen set."""
    place: Mapping[str, float]
    """Those of the set `pose`."""
    notes: tuple[Note, ...]
    time: float | None = None
    """Along a motion, s."""

    @property
    def leg_levels(self) -> tuple[Level, ...]:
        """How near each leg is to one of its limits."""
        return tuple(
            Level.BEYOND if slack < 0.0 else Level.NEAR if slack < NEAR_LIMIT else Level.FINE
            for slack in self.slack
        )

    @property
    def level(self) -> Level:
        """The most serious of the notes."""
        return max((note.level for note in self.notes), default=Level.FINE)


@dataclass
class Model:
    """The present pose, and how it is moved. What is refused changes nothing but `refusal`."""

    mech: Mechanism
    track: Track | None = None
    """A motion to follow."""
    pose: Array = field(init=False)
    set: str = field(init=False)
    """The coordinate set of the sliders."""
    refusal: str = ""
    """Why the last change was refused, in words; empty if it was not."""

    def __post_init__(self) -> None:
        self.links, self._places = links_of(self.mech), LinkPlaces(self.mech)
        self._legs = self.mech.geometry["legs"]
        self._limits = self.mech.limit_list
        self._base = np.array([leg["base"]["point"] for leg in self._legs])
        self._names = {**self.mech.coordinate_sets, "pose": self._independent()}
        self._home_lengths = self.mech.inverse_kinematics(self.mech.home).lengths
        self._row: int | None = None
        self.set = "natural" if "natural" in self._names else "pose"
        self.pose = self.mech.home
        if self.track is not None:
            self.set = self.track.set
            self.set_time(float(self.track.time[0]))

    # --- what can be moved ---------------------------------------------------------------------------------

    @property
    def sets(self) -> tuple[str, ...]:
        """The coordinate sets to choose from."""
        return tuple(self._names)

    @property
    def names(self) -> tuple[str, ...]:
        """The coordinates of the chosen set that can be given; the others follow."""
        return self._names[self.set]

    def range(self, name: str) -> tuple[float, float]:
        """Least and greatest value that the page offers for a coordinate of the chosen set, m, rad or 1.

        Values beyond may be possible; those of a motion are inside.
        """
        kind = KIND_OF_COORDINATE[name]
        if kind is None:
            return -1.0, 1.0
        half = _TURN.get(name, np.pi / 2)
        middle = 0.0
        if kind == "length":
            middle = float(self.mech.coordinates(self.mech.home, self.set)[name])
            half = LATERAL * float(spans(self.mech).mean())
        low, high = middle - half, middle + half
        if self.track is not None and name in self.track.coordinates and self.set == self.track.set:
            values = self.track.coordinates[name]
            low, high = min(low, float(np.nanmin(values))), max(high, float(np.nanmax(values)))
        return low, high

    def length_range(self, leg: int) -> tuple[float, float]:
        """Least and greatest length or place that is offered for a leg, m: a little beyond its stroke."""
        low, high = self.mech.stroke[leg]
        if not np.isfinite(high):
            home, half = float(self._home_lengths[leg]), 0.5 * float(spans(self.mech)[leg])
            return home - half, home + half
        beyond = 0.1 * (high - low)
        return max(low - beyond, self.mech.drives[leg].least), high + beyond

    # --- moving --------------------------------------------------------------------------------------------

    def choose_set(self, name: str) -> None:
        """Takes another coordinate set for the sliders."""
        if name not in self._names:
            raise UnknownNameError("coordinate set", name, self._names)
        self.set = name

    def set_coordinate(self, name: str, value: float) -> bool:
        """Moves one coordinate of the chosen set, the other given ones kept; whether there is such a pose."""
        if name not in self.names:
            raise UnknownNameError("coordinate", name, self.names)
        if not np.isfinite(value):
            return self._refuse(f"{name} is {value}: no number to move to.")
        now = self.mech.coordinates(self.pose, self.set)
        given = {each: float(now[each]) for each in self.names} | {name: float(value)}
        # Of two branches, the one that stays nearest to where the platform is.
        found = [self.mech.state(given, branch=branch, guess=self.pose) for branch in (+1, -1)]
        answers = [state.pose for state in found if Status(int(state.status)).has_answer]
        if not answers:
            status = Status(int(found[0].status))
            shown = readable(value, coordinate_unit(name))
            return self._refuse(f"No pose with {name} = {shown}: {status.message}.")
        return self._move(min(answers, key=lambda pose: float(np.linalg.norm(pose - self.pose))))

    def moves_alone(self, leg: int) -> bool:
        """Whether a leg can move while the other actuated ones are kept: not with redundant actuators."""
        return bool(self.mech.actuated[leg]) and not self.mech.redundantly_actuated

    def set_length(self, leg: int, value: float) -> bool:
        """Moves one leg, the others kept, in the present assembly mode; whether there is such a pose."""
        name = self.mech.leg_names[leg]
        drive = self.mech.drives[leg]
        what = drive.coordinate
        if not self.mech.actuated[leg]:
            return self._refuse(f"Leg {name} is passive: its {what} follows from the others.")
        if not self.moves_alone(leg):
            return self._refuse(
                f"Leg {name} cannot move alone: there are more actuators than degrees of freedom, so that "
                "others must move with it. Move a coordinate; the legs follow."
            )
        if not np.isfinite(value) or value <= drive.least:
            return self._refuse(
                f"The {what} of leg {name} cannot be {value} {si_unit(drive.coordinate_kind)}."
            )
        lengths = self.mech.inverse_kinematics(self.pose).lengths.copy()
        lengths[leg] = value
        found = self.mech.forward_kinematics(lengths, self.pose)
        status = Status(int(found.status))
        if not status.has_answer or status is Status.MODE_JUMP:
            return self._refuse(
                f"The {what} of leg {name} cannot be {readable_coordinate(drive, value)} while the others "
                f"keep theirs: {status.message}."
            )
        return self._move(found.pose)

    def set_time(self, time: float) -> bool:
        """Goes to the motion's row nearest to a time, s; whether there is a pose."""
        if self.track is None:
            return self._refuse("There is no motion.")
        if not np.isfinite(time):
            return self._refuse(f"The time is {time}: no number to go to.")
        row = self.track.row_at(time)
        status = Status(int(self.track.status[row]))
        if not np.isfinite(self.track.pose[row]).all():
            return self._refuse(f"No pose at {self.track.time[row]:.3f} s: {status.message}.")
        self._move(self.track.pose[row])
        self._row = row
        return True

    def go(self, pose: Array) -> bool:
        """Goes to a pose (4, 4) that the mechanism is known to have."""
        if not Status(int(self.mech.inverse_kinematics(pose).status)).has_answer:
            return self._refuse("The mechanism cannot stand there.")
        return self._move(pose)

    def _move(self, pose: Array) -> bool:
        self.pose, self.refusal, self._row = np.array(pose), "", None
        return True

    def _refuse(self, why: str) -> bool:
        self.refusal = f"{why} The last good pose stays."
        return False

    # --- what is told of the pose --------------------------------------------------------------------------

    def view(self) -> View:
        """All that the page shows of the present pose."""
        mech, pose = self.mech, self.pose
        state, load, time = self._state()
        legs = mech.inverse_kinematics(pose)
        dynamics = mech.inverse_dynamics(*state, *load)
        reactions = mech.joint_reactions(*state, *load)
        twist, acceleration = state[1:]
        limits = mech.limits(pose, *load, twist=twist, acceleration=acceleration)
        near = mech.singularity(pose, tolerance=NEAR_SINGULAR)
        kind = SingularityKind(int(near.kind))
        loose = kind in (SingularityKind.ACTUATION, SingularityKind.CONSTRAINT)
        loose |= kind is SingularityKind.CONSTRAINT_VANISHES
        frames, moved = self._places.at(pose).frames, mech.moves_feet
        # The first link of each leg is at its base joint.
        first = 1 + len(mech.rod_names)
        feet = frames[first : first + 2 * mech.n_legs : 2, :3, 3]
        directions = legs.directions.copy()
        for i in np.flatnonzero(moved):
            directions[i] = mech.drives[i].push(self._legs[i], feet[i])
        known = bool(np.isfinite(near.axis).all() and np.isfinite(near.point).all())
        screw = Screw(near.point, near.axis, float(near.pitch), near.twist[:3]) if loose and known else None
        return View(
            pose=pose,
            frames=frames,
            lengths=legs.lengths,
            joints=np.where(moved[:, None], feet, self._base + legs.vectors),
            directions=directions,
            slack=self._slack(limits.relative),
            forces=dynamics.forces,
            wrench=reactions.constraint_wrench,
            sigma_min=float(near.sigma_min),
            condition=float(near.condition),
            determinant=float(near.determinant),
            screw=screw,
            coordinates=_floats(mech.coordinates(pose, self.set)),
            place=_floats(mech.coordinates(pose, "pose")),
            notes=(
                *self._about_limits(limits.relative, limits.margins),
                *self._about_singularity(kind, int(near.leg), float(near.sigma_min)),
                *([Note(Level.BEYOND, self.refusal)] if self.refusal else []),
            ),
            time=time,
        )

    def _state(self) -> tuple[tuple[Array, Array, Array], tuple[Any, ...], float | None]:
        """Pose, twist, acceleration, load and time: of the motion's row, or at rest under the own load."""
        if self.track is None or self._row is None:
            return (self.pose, _REST, _REST), (), None
        return self.track.state(self._row), self.track.load(self._row), float(self.track.time[self._row])

    def singular_values(self) -> dict[str, tuple[float, float]]:
        """Nearest singular value of each coordinate below and above, the others kept; takes some ms."""
        names = self.names if self.set == "pose" else None
        set = None if self.set == "tool" else self.set  # a direction's components cannot go one by one
        found = self.mech.singularity_distance(self.pose, set, coordinates=names)
        pairs = zip(found.coordinates, found.singular.tolist(), strict=True)
        return {name: (float(low), float(high)) for name, (low, high) in pairs}

    def _independent(self) -> tuple[str, ...]:
        """Coordinates of the set `pose` that determine the others well at home."""
        try:
            return self.mech.equations_of_motion(self.mech.home, _REST, "pose").coordinates
        except PolypodError:
            return self.mech.coordinate_sets["pose"][: self.mech.dof]

    def _slack(self, relative: Array) -> Array:
        slack = np.full(self.mech.n_legs, np.inf)
        for limit, value in zip(self._limits, relative, strict=True):
            for name in limit.legs if np.isfinite(value) else ():
                leg = self.mech.leg_names.index(name)
                slack[leg] = min(slack[leg], float(value))
        return slack

    def _about_limits(self, relative: Array, margins: Array) -> list[Note]:
        """The limits that are passed or near, the worst first."""
        order = [int(i) for i in np.argsort(relative) if relative[i] < NEAR_LIMIT]
        notes = []
        for i in order[:_MOST_NOTES]:
            limit, margin = self._limits[i], float(margins[i])
            if margin < 0.0:
                notes.append(Note(Level.BEYOND, f"Beyond {limit.name} by {readable(-margin, limit.unit)}."))
            else:
                left = readable(margin, limit.unit)
                notes.append(Note(Level.NEAR, f"Near {limit.name}: {left} left."))
        if len(order) > _MOST_NOTES:
            notes.append(Note(notes[-1].level, f"And {len(order) - _MOST_NOTES} more limits."))
        return notes

    def _about_singularity(self, kind: SingularityKind, leg: int, sigma_min: float) -> list[Note]:
        if kind in (SingularityKind.NONE, SingularityKind.DEPENDENT_ROWS):
            return []
        if kind is SingularityKind.UNKNOWN:
            return [Note(Level.BEYOND, "Nothing is known of singularities here.")]
        whose = f" (leg {self.mech.leg_names[leg]})" if leg >= 0 else ""
        at = "At" if sigma_min <= TOLERANCE else "Near"
        level = Level.BEYOND if at == "At" else Level.NEAR
        return [Note(level, f"{at} a {kind.message}{whose}.")]


def _floats(values: Mapping[str, Array]) -> dict[str, float]:
    return {name: float(value) for name, value in values.items()}
