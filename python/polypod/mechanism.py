"""The mechanism and all that can be asked of it. The equations are the core's; here are shapes and names."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polypod import _core
from polypod.answers.derivatives import BaseParameters, InverseDynamicsDerivatives, Regressor
from polypod.answers.dynamics import (
    CoupledForces,
    EquationsOfMotion,
    ForwardDynamics,
    InverseDynamics,
    JointReactions,
    Power,
)
from polypod.answers.kinematics import (
    AssemblyModes,
    ForwardKinematics,
    InverseKinematics,
    Kinematics,
    PlatformAcceleration,
    PlatformTwist,
    State,
)
from polypod.answers.leg_words import readable_coordinate, word
from polypod.answers.limits import Conditioning, Limits
from polypod.answers.mobility import GraphJoint, GraphLink, IdleFreedom, Mobility, Published
from polypod.answers.notebook import card, picture_of, rows_of
from polypod.answers.parts import Joint, Limit
from polypod.answers.screws import Row, Screws
from polypod.answers.singularity import (
    NEAR_SINGULAR,
    TOLERANCE,
    Determinant,
    Singularity,
    SingularityDistance,
    SingularityKind,
    codes,
)
from polypod.answers.status import Status
from polypod.arrays import MOTION, MOVING, POSE, Arguments, Array, Loaded, common, doubles, spread
from polypod.errors import (
    CoordinateError,
    Fault,
    MechanismError,
    PolypodError,
    UnknownNameError,
    UnsupportedError,
    alternatives,
)
from polypod.files.text import read_text
from polypod.files.units import readable
from polypod.legs.drive import Drive
from polypod.legs.drives import drive_of

_AT_REST = np.empty(0)
"""Twists or accelerations of states that are all at rest."""


class Mechanism:
    """A parallel manipulator; made by `polypod.load`, never changed.

    Arrays may have any leading axes, which broadcast; a `pose` is `(..., 4, 4)`, `twist` and `acceleration`
    are `(..., 6)` at o in base axes. No method raises for a numerical outcome: see `Status`.
    """

    def __init__(
        self, data: Mapping[str, Any], *, text: str | None = None, origin: str = "the mechanism"
    ) -> None:
        # What reads and writes files is imported where it is used: an import of Polypod need not wait for it.
        from polypod.files.mechanism_spec import read_spec
        from polypod.files.units import in_units

        self._data: dict[str, Any] = _plain(data)
        self._text = text
        spec, faults = read_spec(self._data)
        try:
            self._core = _core.Mechanism(json.dumps(spec))
        except _core.Faults as error:
            # What the core misses in lists that are none follows from that.
            told = {fault.place for fault in faults} & {"legs", "rods"}
            units = self._data.get("units")
            found = [Fault(place, in_units(message, units)) for place, message in error.args[0]]
            faults += [fault for fault in found if fault.place not in told]
        if faults:
            from polypod.files.toml_lines import with_lines

            raise MechanismError(with_lines(faults, text), origin)
        self._spec = spec
        legs = spec["legs"]
        self.name: str = spec["name"]
        self.leg_names: tuple[str, ...] = tuple(leg["name"] for leg in legs)
        self.rod_names: tuple[str, ...] = tuple(rod["name"] for rod in spec["rods"])
        self._limit_names = tuple(limit.name for limit in self.limit_list)
        self._lengths = Arguments(lengths=(len(legs),))
        self._guessed_lengths = Arguments(lengths=(len(legs),), guess=(4, 4))
        self._rates = Arguments(pose=(4, 4), rates=(len(legs),))
        self._second_rates = Arguments(pose=(4, 4), twist=(6,), accelerations=(len(legs),))
        self._chosen = Arguments(pose=(4, 4), twist=(6,), acceleration=(6,), preferred=(len(legs),))
        self._driven = Arguments(pose=(4, 4), twist=(6,), forces=(len(legs),))
        sets = self._core.coordinate_sets()
        self._sets = {set: tuple(names) for set, names, _ in sets}
        self._given = {
            set: tuple(names if given is None else (n for n, g in zip(names, given, strict=True) if g))
            for set, names, given in sets
        }

    # --- files -------------------------------------------------------------------------------------------

    @classmethod
    def from_toml(cls, text: str, *, origin: str = "the mechanism") -> Mechanism:
        """The mechanism that a TOML text describes.

        Raises MechanismError with every fault and its place.
        """
        from polypod.files.toml_lines import read_toml

        data = read_toml(text)
        if isinstance(data, Fault):
            raise MechanismError([data], origin)
        return cls(data, text=text, origin=origin)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Mechanism:
        """The mechanism that the content of a file describes, as nested dictionaries in the file's units."""
        return cls(data)

    def to_dict(self) -> dict[str, Any]:
        """The content of the file, as it was given."""
        return copy.deepcopy(self._data)

    def to_toml(self) -> str:
        """The file's text: the very text that it was read from, comments included, if it was."""
        import tomli_w

        return tomli_w.dumps(self._data) if self._text is None else self._text

    def save(self, path: str | Path) -> None:
        """Writes the mechanism file."""
        Path(path).write_text(self.to_toml(), encoding="utf-8")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Mechanism) and self._data == other._data

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self) -> tuple[Any, ...]:
        return _from_parts, (self._data, self._text)

    def __repr__(self) -> str:
        return f"<Mechanism {self.name}: {'+'.join(self.leg_letters)}, {self.dof} degrees of freedom>"

    def _repr_html_(self) -> str:
        """Drawing, degrees of freedom, legs and warnings."""
        file, home = self.to_dict(), self.inverse_kinematics(self.home).lengths
        legs = zip(
            self.leg_names, self.leg_letters, self.actuated, self.drives, home, self.stroke, strict=True
        )
        rows = [
            (
                name,
                letters,
                "yes" if actuated else "no",
                readable_coordinate(drive, length),
                _stroke(drive, *stroke),
            )
            for name, letters, actuated, drive, length, stroke in legs
        ]
        headers = ("leg", "joints", "actuated", f"{word(self.drives)} at home", "stroke")
        sets = [(name, ", ".join(names)) for name, names in self.coordinate_sets.items()]
        said = f"{'+'.join(self.leg_letters)}, {self.dof} degrees of freedom"
        notes = [
            file.get("description", ""),
            file.get("source", ""),
            *(f"⚠ {text}" for text in self.warnings),
        ]
        return card(
            self.name,
            said,
            [rows_of(headers, rows), rows_of(("coordinate set", "coordinates"), sets, texts=2)],
            notes=filter(None, notes),
            picture=picture_of(self),
        )

    # --- what it is --------------------------------------------------------------------------------------

    @property
    def dof(self) -> int:
        """Degrees of freedom of the platform at generic poses."""
        return self._core.dof

    @property
    def n_rows(self) -> int:
        """Rows of J: actuated legs, local degrees of freedom, constraints; above 6 if redundant."""
        return self._core.rows

    @property
    def redundantly_actuated(self) -> bool:
        """Whether more legs are actuated than it takes: forces are then a choice, and lengths must agree."""
        return self.n_rows > 6

    @property
    def n_legs(self) -> int:
        """Number of legs, passive ones too: the n of the arrays."""
        return len(self.leg_names)

    @property
    def leg_letters(self) -> tuple[str, ...]:
        """Joints of each leg from base to platform, such as RPU."""
        return tuple(self._core.leg_letters)

    @property
    def actuated(self) -> NDArray[np.bool_]:
        """(n,): which legs have an actuator."""
        return np.array([leg["actuated"] for leg in self._spec["legs"]], dtype=bool)

    @property
    def stroke(self) -> Array:
        """(n, 2): least and greatest length of each leg, m; 0 and inf where the file gives none.

        Of a slider the ends of its carriage's way on the rail; without a stroke -inf and inf.
        """
        legs = zip(self._spec["legs"], self.drives, strict=True)
        return np.array([leg["stroke"] or [drive.least, np.inf] for leg, drive in legs])

    @cached_property
    def drives(self) -> tuple[Drive, ...]:
        """What drives each leg: a telescope, or a slider, whose length is the place q of its carriage."""
        return tuple(drive_of(leg) for leg in self._spec["legs"])

    @property
    def moves_feet(self) -> NDArray[np.bool_]:
        """(n,): which legs have a drive that moves the base joint; their struts keep their lengths."""
        return np.array([drive.moves_foot for drive in self.drives], dtype=bool)

    @property
    def home(self) -> Array:
        """(4, 4): the centre pose."""
        return self._core.home

    @property
    def characteristic_length(self) -> float:
        """Root mean square distance of the platform joints from o, m: what lengths are scaled by."""
        return self._core.characteristic_length

    @property
    def geometry(self) -> dict[str, Any]:
        """Points, axes, bodies and limits in SI, each in the axes of its link."""
        return copy.deepcopy(self._spec)

    @property
    def coordinate_sets(self) -> dict[str, tuple[str, ...]]:
        """The names that each coordinate set takes; of the set `pose` any `dof` may be given."""
        return dict(self._given)

    @property
    def coupled_legs(self) -> tuple[str, str] | None:
        """The two legs on one rod that share a constraint, or None: those of `coupled_forces`."""
        result = self._core.coupled_forces(np.empty((0, 4, 4)), np.empty(0), False)
        return None if result is None else (self.leg_names[result[0][0]], self.leg_names[result[0][1]])

    @property
    def warnings(self) -> list[str]:
        """Warnings for the user of this mechanism, in plain words and the units of its description."""
        from polypod.files.body_plausibility import implausible_bodies
        from polypod.files.units import in_units

        mobility, notes = self.mobility(), []
        sigma = self.conditioning(self.home)
        if mobility.uncontrolled:
            notes.append(
                "singular by design: with all actuators locked the platform keeps "
                f"{mobility.uncontrolled} of its degrees of freedom at every pose, so that forces and "
                "velocities are not determined anywhere."
            )
        elif gained := self._gained_at_home:
            notes.append(
                "singular at its centre pose, or nearly so; "
                f"{SingularityKind.CONSTRAINT.with_freedoms(gained)}. "
                "Forces there are not determined or large; stay clear of it."
            )
        elif not sigma.sigma_min > NEAR_SINGULAR:
            notes.append(
                "nearly singular at its centre pose: the smallest singular value is "
                f"{float(sigma.sigma_min):.2g} against {float(sigma.sigma_max):.2g} for the largest. "
                "The platform can move there with hardly any change of the leg lengths, and forces are "
                "large; stay clear of it."
            )
        notes += [
            f"beyond a limit at its centre pose: {limit.name}, by {readable(-margin, limit.unit)}."
            for limit, margin in zip(self.limit_list, self.limits(self.home).margins, strict=True)
            if margin < 0.0
        ]
        if mobility.redundant:
            several = mobility.redundant > 1
            notes.append(
                f"{mobility.redundant} redundant constraint{'s couple' if several else ' couples'} legs "
                f"{_in_words(mobility.redundant_legs)}: the parts must be made accurately, and couples in "
                "these joints are statically indeterminate."
            )
        if self.redundantly_actuated:
            driven = int(self.actuated.sum())
            notes.append(
                f"redundant actuators: {driven} for {self.dof - len(mobility.idle)} degrees of freedom. "
                "Their forces are a choice, and only lengths that agree have a pose."
            )
            if held := self._core.about_universal_legs():
                notes[-1] += f" {held}."
        notes += implausible_bodies(self.geometry, float(np.max(spans(self))))
        notes += [f"local degree of freedom: {idle}; nothing drives or holds it." for idle in mobility.idle]
        if mobility.passive:
            notes.append(
                f"legs {', '.join(mobility.passive_legs)} spin freely about their own line "
                f"({mobility.passive} passive degrees of freedom)."
            )
        return [in_units(note, self._data["units"]) for note in notes]

    @property
    def _gained_at_home(self) -> int:
        """Degrees of freedom that the centre pose gains: not 0 at a constraint singularity, or near one."""
        home = self.singularity(self.home, tolerance=NEAR_SINGULAR)
        constraint = int(home.kind) in (SingularityKind.CONSTRAINT, SingularityKind.CONSTRAINT_VANISHES)
        return int(home.uncontrolled) if constraint else 0

    def mobility(self) -> Mobility:
        """Degrees of freedom, joints and redundant constraints, from generic ranks [Eq. 1, T18]."""
        m = json.loads(self._core.mobility())
        names = self.leg_names
        graph, published = m["graph"], self._data.get("published")
        return Mobility(
            **{k: m[k] for k in ("dof", "links", "joints", "joint_freedoms", "loops", "closure_rank")},
            redundant=m["redundant"],
            redundant_legs=tuple(names[i] for i in m["redundant_legs"]),
            passive=m["passive"],
            uncontrolled=m["uncontrolled"],
            idle=tuple(IdleFreedom(i["body"], (*i["point"],), (*i["axis"],)) for i in m["idle"]),
            passive_legs=tuple(names[i] for i in m["passive_legs"]),
            constraint_rows=tuple((names[c["leg"]], c["kind"]) for c in m["constraints"]),
            independent_rows=tuple(i for i, c in enumerate(m["constraints"]) if c["independent"]),
            graph_links=tuple(GraphLink(link["name"], tuple(link["joints"])) for link in graph["links"]),
            graph_joints=tuple(GraphJoint(j["kind"], j["name"], (*j["links"],)) for j in graph["joints"]),
            published=None if published is None else Published(**published),
        )

    # --- coordinates -------------------------------------------------------------------------------------

    def pose(
        self, coordinates: Mapping[str, ArrayLike], *, branch: int = +1, guess: ArrayLike | None = None
    ) -> Array:
        """(..., 4, 4): the pose with the given coordinates; NaN where there is none (`state` says why).

        Arguments as for `state`.
        """
        return self.state(coordinates, branch=branch, guess=guess).pose

    def state(
        self,
        coordinates: Mapping[str, ArrayLike],
        rates: Mapping[str, ArrayLike] | None = None,
        second_rates: Mapping[str, ArrayLike] | None = None,
        *,
        branch: int = +1,
        guess: ArrayLike | None = None,
        continued: bool = False,
    ) -> State:
        """Pose, and exact twist and acceleration from coordinate rates and second rates [Eq. 2, 5, T19-T23].

        Args:
            coordinates: by name, m and rad; the names determine the set: see `coordinate_sets`.
            rates: by the same names, per second; zero where left out.
            second_rates: likewise.
            branch: the sign of sin(γ + γ_0) in the paper's coordinates, where Eq. 5 leaves two γ;
                γ_0 is zero where the points b_i of the rod's legs lie at the height of o, as in the paper.
            guess: pose or poses (..., 4, 4) near which dependent coordinates are sought; home by default.
            continued: start each state's dependent coordinates from the state before, as along a motion.

        Raises:
            CoordinateError: names that make up no set of this mechanism.
            ShapeError: arrays that do not broadcast.

        >>> import polypod as pp
        >>> mech = pp.load("lu-3spu-2rpu-r")
        >>> natural = {"alpha": 0.1, "p": -0.3, "h": 0.6, "beta": 0.8, "gamma": 0.6}
        >>> mech.state(natural, {"h": 0.05}).twist.round(4).tolist()
        [0.0, -0.005, 0.0498, 0.0, 0.0, 0.0]
        >>> impossible = mech.state({"x": 0.0, "y": 0.4, "z": 0.7, "alpha": 0.0, "beta": 0.3})
        >>> pp.Status(impossible.status).name
        'NO_BRANCH'
        """
        if branch not in (-1, +1):
            raise CoordinateError(f"branch is {branch!r}; must be +1 or -1")
        set = self._set_of(coordinates)
        names = self._sets[set]
        series: list[Mapping[str, ArrayLike]] = [coordinates, rates or {}, second_rates or {}]
        for extra, kind in zip(series[1:], ("rates", "second_rates"), strict=True):
            for name in extra:
                if name not in coordinates:
                    raise CoordinateError(
                        f"{kind}: {name!r} is no coordinate given; {alternatives(name, coordinates)}"
                    )
        flat = [doubles(name, s.get(name, 0.0)) for name in coordinates for s in series]
        guess_array = None if guess is None else doubles("guess", guess, (4, 4))
        shape = common(*(a.shape for a in flat), () if guess_array is None else guess_array.shape[:-2])
        rows = iter(spread(a, shape) for a in flat)
        by_name = {name: [next(rows) for _ in series] for name in coordinates}
        out = self._core.states(
            set,
            [by_name.get(name) for name in names],
            shape,
            float(branch),
            None if guess_array is None else spread(guess_array, (*shape, 4, 4)),
            continued,
        )
        columns = ("coordinates", "coordinate_rates", "coordinate_second_rates")
        named: dict[str, Any] = {key: _by_name(names, out[key]) for key in columns}
        return State(self, **out | named)

    def coordinates(self, pose: ArrayLike, set: str | None = None) -> dict[str, Array]:
        """All numbers of a coordinate set at a pose, each (...), m and rad: the inverse of `pose`.

        NaN for a pose that breaks a constraint.

        Args:
            pose: (..., 4, 4).
            set: its name; the first of `coordinate_sets` by default.

        Raises:
            UnknownNameError: no such set.
        """
        set = next(iter(self._sets)) if set is None else set
        if set not in self._sets:
            raise UnknownNameError("coordinate set", set, self._sets)
        (poses,) = POSE(pose)
        out = self._core.coordinates(set, poses)
        return _by_name(self._sets[set], out["coordinates"])

    def _set_of(self, coordinates: Mapping[str, ArrayLike]) -> str:
        """The set whose given names these are."""
        given = {*coordinates}
        for set, names in self._given.items():
            if given == {*names} or (set == "pose" and given <= {*names} and len(given) == self.dof):
                return set
        known = sorted({name for names in self._given.values() for name in names})
        unknown = [
            f"{name!r} is none: {alternatives(str(name), known)}" for name in coordinates if name not in known
        ]
        some = "" if self.dof == 6 else f"{self.dof} independent ones of "
        choices = "; ".join(
            f"{set}: {some if set == 'pose' else ''}{', '.join(names)}" for set, names in self._given.items()
        )
        raise CoordinateError(
            f"{self.name} has no coordinate set with {', '.join(map(str, coordinates)) or 'no names'}; "
            f"valid: {choices}" + "".join(f"\n  {message}" for message in unknown)
        )

    # --- kinematics --------------------------------------------------------------------------------------

    def inverse_kinematics(self, pose: ArrayLike) -> InverseKinematics:
        """Lengths (..., n), m, vectors and directions (..., n, 3) of the legs at a pose (..., 4, 4) [Eq. 3].

        Vectors are in base axes.

        >>> import polypod as pp
        >>> mech = pp.load("lu-3spu-2rpu-r")
        >>> mech.inverse_kinematics(mech.home).lengths.round(4).tolist()
        [0.7487, 0.7441, 0.7487, 0.7544, 0.7544]
        """
        (poses,) = POSE(pose)
        return InverseKinematics(self, **self._core.inverse_kinematics(poses))

    def jacobian(self, pose: ArrayLike) -> Array:
        """(..., 6, 6): J of `J V = (ℓ', 0)`: actuated legs, then independent constraints [Eq. 13].

        V = (v, ω) at o in base axes, m/s and rad/s; the first three columns of a leg's row have no unit, the
        others are in m. For any pose (..., 4, 4), on the constraints or not.

        Local degrees of freedom have rows (0, u) between those of legs and constraints, with the spin ω·u for
        a rate [T70]. With redundant actuators J is (..., n_rows, 6) [T72].
        """
        (poses,) = POSE(pose)
        return self._core.jacobian(poses)["jacobian"]

    def hessian(self, pose: ArrayLike) -> Array:
        """(..., 6, 6, 6): H of `J A + Vᵀ H V = (ℓ'', 0)`, a layer for each row of J [Eq. 15, 16, 17, 18, 19].

        Layers are symmetric. Twist and acceleration at o in base axes; a leg's layer is in 1/m, 1 and m for
        (v, v), (v, ω) and (ω, ω). For any pose (..., 4, 4), on the constraints or not. Local degrees of
        freedom have layers of zeros; with redundant actuators H is (..., n_rows, 6, 6).
        """
        (poses,) = POSE(pose)
        return self._core.hessian(poses)["hessian"]

    def kinematics(self, pose: ArrayLike, twist: ArrayLike, acceleration: ArrayLike) -> Kinematics:
        """Motion of all legs, rods, links and joints, SI, vectors in base axes [Eq. 2-39].

        A twist or acceleration that breaks a constraint has the status OFF_CONSTRAINT and no numbers.

        Args:
            pose: (..., 4, 4).
            twist: (v, ω) at o in base axes, (..., 6), m/s and rad/s.
            acceleration: (a, ε) at o in base axes, (..., 6), m/s² and rad/s²; a is that of the point o.
        """
        states = MOTION(pose, twist, acceleration)
        return Kinematics(self, **self._core.kinematics(*states))

    def platform_twist(self, pose: ArrayLike, rates: ArrayLike) -> PlatformTwist:
        """The twist that gives the legs these rates [Eq. 13].

        Args:
            pose: (..., 4, 4).
            rates: of the legs, (..., n), m/s; those of passive legs are not read.

        Local degrees of freedom do not spin. Rates of redundant actuators must agree to 1e-6 of their size;
        else the status is INCONSISTENT and there is no twist [T73].
        """
        arrays = self._rates(pose, rates)
        return PlatformTwist(self, **self._core.platform_twist(*arrays))

    def platform_acceleration(
        self, pose: ArrayLike, twist: ArrayLike, accelerations: ArrayLike
    ) -> PlatformAcceleration:
        """The platform's acceleration that gives the legs theirs [Eq. 19].

        Args:
            pose: (..., 4, 4).
            twist: (..., 6).
            accelerations: second rates of the legs, (..., n), m/s²; those of passive legs are not read.

        Local degrees of freedom keep their spin; accelerations of redundant actuators must agree, as rates
        must.
        """
        arrays = self._second_rates(pose, twist, accelerations)
        return PlatformAcceleration(self, **self._core.platform_acceleration(*arrays))

    # --- singularities -----------------------------------------------------------------------------------

    def conditioning(self, pose: ArrayLike, *, length: float | None = None) -> Conditioning:
        """Singular values (...) of the leg Jacobian on the allowed twists at a pose (..., 4, 4) [T24].

        Pure numbers. `length`, m, is what rotations are counted with: an angle is an arc of that radius; by
        default the `characteristic_length`.
        """
        (poses,) = POSE(pose)
        return Conditioning(self, **self._core.conditioning(poses, self._length(length)))

    def determinant(
        self, pose: ArrayLike, twist: ArrayLike = (0.0,) * 6, *, length: float | None = None
    ) -> Determinant:
        """Determinant of J in pure numbers, and its exact rate along a twist [T30].

        With redundant actuators J has none: it is that of JᵀJ, which is never negative, and zero where J
        loses its rank [T72].

        Args:
            pose: (..., 4, 4).
            twist: (..., 6); at rest by default.
            length: what rotations are counted with, m; `characteristic_length` by default.
        """
        poses, twists = MOVING(pose, twist)
        return Determinant(self, **self._core.determinant(poses, twists, self._length(length)))

    def singularity(
        self, pose: ArrayLike, *, length: float | None = None, tolerance: float = TOLERANCE
    ) -> Singularity:
        """Determinant, singular values, kind of singularity and uncontrolled twist at a pose [T24, T30-T33].

        Also where a leg has no frame, and other answers have the status SINGULAR.

        Args:
            pose: (..., 4, 4).
            length: what rotations are counted with, m; `characteristic_length` by default.
            tolerance: up to it a measure (a pure number) counts as zero; with `NEAR_SINGULAR`, 0.01, the kind
                is that of a singularity nearby.

        >>> import polypod as pp
        >>> mech = pp.load("lu-3spu-2rpu-r")
        >>> near = mech.singularity(mech.home, tolerance=0.01)
        >>> pp.SingularityKind(near.kind).name, int(near.uncontrolled)
        ('ACTUATION', 2)
        >>> pp.SingularityKind(mech.singularity(mech.home).kind).name
        'NONE'
        """
        if not tolerance >= 0.0:
            raise PolypodError(f"tolerance is {tolerance!r}; must be zero or more")
        (poses,) = POSE(pose)
        out = self._core.singularity(poses, self._length(length), float(tolerance))
        return Singularity(self, **out | {name: codes(out[name]) for name in ("kind", "leg", "uncontrolled")})

    def freedom_screws(self, pose: ArrayLike) -> Screws:
        """Degrees of freedom of the platform at a pose, as principal screws [T66].

        Translations first, then rotations with their slides, the least pitch first; axes at right angles,
        those of the base where they can be. At a constraint singularity there are more than `dof`.

        Args:
            pose: (4, 4), one pose.

        >>> import polypod as pp
        >>> mech = pp.load("3-rps")
        >>> free = mech.freedom_screws(mech.home)
        >>> free.pitch.round(9) + 0.0, free.axis[0].round(9) + 0.0
        (array([inf,  0.,  0.]), array([0., 0., 1.]))
        """
        return self._screws(pose, self._core.freedom_screws)

    def constraint_screws(self, pose: ArrayLike) -> Screws:
        """The wrench of every constraint at a pose with its line [T66].

        In the order of `mobility().constraint_rows`.

        Args:
            pose: (4, 4), one pose.

        >>> import polypod as pp
        >>> mech = pp.load("3-upu")
        >>> mech.constraint_screws(mech.home).pitch  # couples: rotations are held
        array([inf, inf, inf])
        """
        return self._screws(pose, self._core.constraint_screws)

    def _screws(self, pose: ArrayLike, of: Callable[[Array], list[Row] | None]) -> Screws:
        """Of one pose where every leg has a direction."""
        matrix = doubles("pose", pose, (4, 4), batch=False)
        status = Status(int(self.singularity(matrix).status))
        return Screws.of(of(matrix) if status is Status.OK else [], status)

    def singularity_distance(
        self,
        pose: ArrayLike,
        set: str | None = None,
        *,
        coordinates: Sequence[str] | None = None,
        length: float | None = None,
        reach: float | None = None,
    ) -> SingularityDistance:
        """The nearest singular poses along each coordinate, the others kept, dependent ones following [T34].

        Args:
            pose: (..., 4, 4).
            set: the coordinate set; `natural` by default, or `pose` for a mechanism without it.
            coordinates: of the set `pose`, the `dof` coordinates to give; by default those that determine the
                others best at generic poses near the centre pose.
            length: what rotations are counted with, m; `characteristic_length` by default.
            reach: how far lengths are followed, m; by default the longest leg at the centre pose. Angles are
                followed for a full turn.

        Raises:
            CoordinateError: coordinates that make up no set of this mechanism.
            UnknownNameError: no such set.

        >>> import polypod as pp
        >>> mech = pp.load("lu-3spu-2rpu-r")
        >>> pose = mech.pose({"alpha": 0.1, "p": -0.3, "h": 0.62, "beta": 0.7, "gamma": 0.6})
        >>> found = mech.singularity_distance(pose)
        >>> below, above = found.singular[found.coordinates.index("beta")].tolist()
        >>> round(below, 3), round(above, 3)
        (-2.829, 2.823)
        """
        set, named = self._varied_coordinates(set, coordinates)
        reach = float(spans(self).max()) if reach is None else reach
        (poses,) = POSE(pose)
        names, out = self._core.nearest_singular(
            poses, set, named, self._length(length), _positive("reach", reach)
        )
        distance = np.abs(out["singular"] - out["value"][..., None])
        named_kind = {"kind": codes(out["kind"])}
        return SingularityDistance(self, coordinates=tuple(names), distance=distance, **out | named_kind)

    def _varied_coordinates(
        self, set: str | None, coordinates: Sequence[str] | None
    ) -> tuple[str, list[str] | None]:
        """The set, and those of its coordinates that are meant; None for all or for the best to give."""
        set = ("natural" if "natural" in self._sets else "pose") if set is None else set
        if set not in self._sets:
            raise UnknownNameError("coordinate set", set, self._sets)
        named = None if coordinates is None else list(coordinates)
        if named is not None and (
            len({*named}) != self.dof or self._set_of(dict.fromkeys(named, 0.0)) != set
        ):
            raise CoordinateError(
                f"coordinates {', '.join(named)} are not those of the set {set}: "
                f"{', '.join(self._given[set])}, {self.dof} of them"
            )
        return set, named

    def _length(self, length: float | None) -> float:
        """The length that rotations are counted with."""
        return self.characteristic_length if length is None else _positive("length", length)

    # --- forward kinematics ------------------------------------------------------------------------------

    def forward_kinematics(
        self, lengths: ArrayLike, guess: ArrayLike | None = None, *, continued: bool = False
    ) -> ForwardKinematics:
        """The pose with the given leg lengths, in the assembly mode of the guess [T25-T27].

        Args:
            lengths: (..., n), m; those of passive legs are not read.
            guess: pose or poses (..., 4, 4) in the mode that is meant; home by default. From a home that is
                nearly singular, as the published one is, few lengths are reached: take a pose of
                `assembly_modes` then.
            continued: start each state from the one before, in the order of the flattened batch, as along a
                motion; the guess then serves the first.

        The status is MODE_JUMP where the guess's mode ends on the way to these lengths, or a continued motion
        passes a singularity, so that the pose is one of another mode; NOT_CONVERGED where no pose was found;
        SINGULAR where two modes meet, so that the pose is known to about 1e-7 only; BACKWARDS where a leg
        with an F joint would have to point backwards [T9]. Lengths that are negative or not finite give
        INVALID_INPUT.

        Local degrees of freedom keep the spin of the guess [T71]. Lengths of redundant actuators must agree:
        the pose has all of them, to 1e-6 of the characteristic length, or the status is INCONSISTENT and
        there is none, only the `residual` of the nearest [T73]; MODE_JUMP is not reported then. A design that
        is singular at every pose has a curve of poses for the lengths that it can have at all: the status is
        SINGULAR with one of them, INCONSISTENT for lengths that it cannot have.

        >>> import polypod as pp
        >>> mech = pp.load("lu-3spu-2rpu-r")
        >>> pose = mech.pose({"alpha": 0.1, "p": -0.3, "h": 0.6, "beta": 0.8, "gamma": 0.6})
        >>> guess = mech.pose({"alpha": 0.1, "p": -0.28, "h": 0.6, "beta": 0.75, "gamma": 0.6})
        >>> found = mech.forward_kinematics(mech.inverse_kinematics(pose).lengths, guess)
        >>> bool(abs(found.pose - pose).max() < 1e-12)
        True
        """
        if guess is None:
            (lengths,), guesses = self._lengths(lengths), None
        else:
            lengths, guesses = self._guessed_lengths(lengths, guess)
        return ForwardKinematics(self, **self._core.forward_kinematics(lengths, guesses, continued))

    def assembly_modes(self, lengths: ArrayLike) -> AssemblyModes:
        """All real poses with the given leg lengths [T28, T29].

        Args:
            lengths: (..., n), m; those of passive legs are not read.

        The first call for a mechanism finds all complex solutions for generic lengths, which takes some
        tenths of a second. With a local degree of freedom a mode stands for all spins: its pose has the one
        that is the shortest rotation from home [T70]. Of redundant actuators all lengths are met;
        INCONSISTENT means that no pose has them all [T73].

        Raises:
            UnsupportedError: singular by design, or several local degrees of freedom.

        >>> import polypod as pp
        >>> mech = pp.load("lu-3spu-2rpu-r")
        >>> modes = mech.assembly_modes([0.769, 0.850, 0.769, 0.650, 0.650])
        >>> int(modes.number), pp.Status(int(modes.status)).name
        (8, 'OK')
        """
        (lengths,) = self._lengths(lengths)
        found = self._core.assembly_modes(lengths)
        if found is None:
            raise UnsupportedError(
                f"{self.name}: assembly modes need a design that is not singular everywhere and has at most "
                "one local degree of freedom; forward_kinematics finds a pose near a guess"
            )
        table, counts, status = found
        count = np.array(counts, dtype=np.int64)
        present = np.arange(count.max(initial=0)) < count[:, None]
        padded = {}
        for name, column in table.items():
            empty = Status.INVALID_INPUT if name == "status" else np.nan
            padded[name] = np.full(present.shape + column.shape[1:], empty, dtype=column.dtype)
            padded[name][present] = column
        padded["mode_status"] = padded.pop("status")
        batch = lengths.shape[:-1]
        modes = {name: a.reshape(batch + a.shape[1:]) for name, a in padded.items()}
        return AssemblyModes(self, **modes, number=count.reshape(batch), status=status.reshape(batch))

    # --- dynamics ----------------------------------------------------------------------------------------

    def inverse_dynamics(
        self,
        pose: ArrayLike,
        twist: ArrayLike,
        acceleration: ArrayLike,
        wrench: ArrayLike | None = None,
        wrench_axes: str = "base",
        *,
        preferred: ArrayLike | None = None,
    ) -> InverseDynamics:
        """Active forces and constraint multipliers that keep up a motion under load [Eq. 40, 41, 42, 43].

        Args:
            pose: (..., 4, 4).
            twist: (..., 6).
            acceleration: (..., 6).
            wrench: load on the platform at o, (..., 6), N and N m; the mechanism's own by default.
            wrench_axes: the axes of `wrench`, "base" or "platform".
            preferred: active forces (n,) or (..., n), N, that redundant actuators should have as nearly as
                the balance lets them, such as a preload; those of passive legs are not read. The answer is
                the nearest in the sense of least squares; without it the least one [T72]. Where forces are
                determined it has no effect.

        >>> import numpy as np, polypod as pp
        >>> mech = pp.load("lu-3spu-2rpu-r")
        >>> pose = mech.pose({"alpha": 0.1, "p": -0.3, "h": 0.6, "beta": 0.8, "gamma": 0.6})
        >>> mech.inverse_dynamics(pose, np.zeros(6), np.zeros(6)).forces.round().tolist()
        [-13151.0, 9809.0, -4907.0, -1993.0, 10231.0]
        """
        if preferred is None:
            args = MOTION.loaded(wrench, wrench_axes, pose, twist, acceleration)
            return InverseDynamics(self, **self._core.inverse_dynamics(*args))
        poses, twists, accelerations, near, *load = self._chosen.loaded(
            wrench, wrench_axes, pose, twist, acceleration, preferred
        )
        out = self._core.inverse_dynamics(poses, twists, accelerations, load[0], load[1], near)
        return InverseDynamics(self, **out)

    @cached_property
    def joint_list(self) -> tuple[Joint, ...]:
        """All joints: the rods' bearings, then each leg's base, prismatic and platform joint [T44]."""
        return tuple(
            Joint(name, kind, (inner, outer)) for name, kind, (inner, outer) in self._core.joint_list()
        )

    def joint_reactions(
        self,
        pose: ArrayLike,
        twist: ArrayLike,
        acceleration: ArrayLike,
        wrench: ArrayLike | None = None,
        wrench_axes: str = "base",
        *,
        length: float | None = None,
    ) -> JointReactions:
        """The reaction of every joint of a motion under load, (F, T) at the joint's point [T44-T48].

        Exact where balance determines it, and marked where redundant constraints leave it open. The status is
        SINGULAR where balance determines no forces, or a leg has no frame.

        Args:
            pose: (..., 4, 4).
            twist: (..., 6).
            acceleration: (..., 6).
            wrench: load on the platform at o, (..., 6), N and N m; the mechanism's own by default.
            wrench_axes: the axes of `wrench`, "base" or "platform".
            length: what torques are divided by in the least sum of squares, m; `characteristic_length` by
                default.

        >>> import numpy as np, polypod as pp
        >>> mech = pp.load("lu-3spu-2rpu-r")
        >>> pose = mech.pose({"alpha": 0.1, "p": -0.3, "h": 0.6, "beta": 0.8, "gamma": 0.6})
        >>> answer = mech.joint_reactions(pose, np.zeros(6), np.zeros(6))
        >>> answer.joints[3]
        Joint(name='platform joint 1', kind='U', links=('piston 1', 'platform'))
        >>> answer.reactions_in_joint[3, :3].round().tolist()
        [13167.0, 2427.0, 381.0]
        >>> answer.determinate_in_joint[3].tolist()
        [True, False, True, True, True, False]
        """
        args = MOTION.loaded(wrench, wrench_axes, pose, twist, acceleration)
        args = (*args, self._length(length))
        return JointReactions(self, joints=self.joint_list, **self._core.joint_reactions(*args))

    def forward_dynamics(
        self,
        pose: ArrayLike,
        twist: ArrayLike,
        forces: ArrayLike,
        wrench: ArrayLike | None = None,
        wrench_axes: str = "base",
    ) -> ForwardDynamics:
        """The platform's acceleration under forces of the legs, and constraint multipliers [T49].

        The inverse of `inverse_dynamics`. Where the actuators do not control the platform (direct
        singularities) its acceleration is determined all the same.

        Args:
            pose: (..., 4, 4).
            twist: (..., 6).
            forces: active forces (..., n), N, positive when they push the platform away; those of passive
                legs are not read.
            wrench: load on the platform at o, (..., 6), N and N m; the mechanism's own by default.
            wrench_axes: the axes of `wrench`, "base" or "platform".

        >>> import numpy as np, polypod as pp
        >>> mech = pp.load("lu-3spu-2rpu-r")
        >>> pose = mech.pose({"alpha": 0.1, "p": -0.3, "h": 0.6, "beta": 0.8, "gamma": 0.6})
        >>> holding = mech.inverse_dynamics(pose, np.zeros(6), np.zeros(6)).forces
        >>> bool(abs(mech.forward_dynamics(pose, np.zeros(6), holding).acceleration).max() < 1e-9)
        True
        """
        args = self._driven.loaded(wrench, wrench_axes, pose, twist, forces)
        return ForwardDynamics(self, **self._core.forward_dynamics(*args))

    def equations_of_motion(
        self, pose: ArrayLike, twist: ArrayLike, coordinates: str | Sequence[str] | None = None
    ) -> EquationsOfMotion:
        """Mass matrix, Coriolis matrix, damping and gravity, in platform space or in coordinates [T49-T52].

        Args:
            pose: (..., 4, 4).
            twist: (..., 6).
            coordinates: None for platform space; or a coordinate set of independent coordinates; or the
                names of `dof` coordinates of one. Of the set `pose` without names those are taken that
                determine the others best at generic poses near the centre pose.

        The status is FOLD where the coordinates do not determine rates.

        Raises:
            CoordinateError: coordinates that make up no set, or that depend on one another (the set `tool`).
            UnknownNameError: no such set.

        >>> import numpy as np, polypod as pp
        >>> mech = pp.load("lu-3spu-2rpu-r")
        >>> pose = mech.pose({"alpha": 0.1, "p": -0.3, "h": 0.6, "beta": 0.8, "gamma": 0.6})
        >>> terms = mech.equations_of_motion(pose, np.zeros(6), "natural")
        >>> terms.coordinates, bool((np.linalg.eigvalsh(terms.mass) > 0).all())
        (('alpha', 'p', 'h', 'beta', 'gamma'), True)
        """
        poses, twists = MOVING(pose, twist)
        names = None if coordinates is None or isinstance(coordinates, str) else list(coordinates)
        set = coordinates if names is None else self._set_of(dict.fromkeys(names, 0.0))
        if set is not None and set not in self._sets:
            raise UnknownNameError("coordinate set", str(set), self._sets)
        if set == "tool":
            raise CoordinateError(
                "the coordinates of the set tool are not independent: only the direction of the axis counts; "
                f"take one of {', '.join(name for name in self._sets if name != 'tool')}"
            )
        found, out = self._core.equations_of_motion(poses, twists, set, names)
        return EquationsOfMotion(self, coordinates=tuple(found), **out)

    def power(
        self,
        pose: ArrayLike,
        twist: ArrayLike,
        acceleration: ArrayLike,
        wrench: ArrayLike | None = None,
        wrench_axes: str = "base",
    ) -> Power:
        """Energies and every power of their balance [T17]. Arguments as for `inverse_dynamics`."""
        args = MOTION.loaded(wrench, wrench_axes, pose, twist, acceleration)
        return Power(self, **self._core.power(*args))

    # --- derivatives and inertial parameters -------------------------------------------------------------

    def inverse_dynamics_derivatives(
        self,
        pose: ArrayLike,
        twist: ArrayLike,
        acceleration: ArrayLike,
        wrench: ArrayLike | None = None,
        wrench_axes: str = "base",
        *,
        set: str | None = None,
        coordinates: Sequence[str] | None = None,
    ) -> InverseDynamicsDerivatives:
        """Exact derivatives of the active forces and multipliers of `inverse_dynamics` [T56, T57].

        By pose, twist and acceleration; by coordinates, their rates and second rates; by mass, mass centre
        and inertia of every link; by points and axes of joints and rods, lengths too. Of dual numbers: no
        differences are taken.

        Args:
            pose: (..., 4, 4).
            twist: (..., 6).
            acceleration: (..., 6).
            wrench: load on the platform at o, (..., 6), N and N m; the mechanism's own by default. In base
                axes it is kept, in platform axes it rotates with the pose.
            wrench_axes: the axes of `wrench`, "base" or "platform".
            set: the coordinate set; `natural` by default, or `pose` for a mechanism without it.
            coordinates: of the set `pose`, the `dof` coordinates to vary; by default those that determine the
                others best at generic poses near the centre pose.

        Raises:
            CoordinateError: coordinates that make up no set of this mechanism.
            UnknownNameError: no such set.

        >>> import numpy as np, polypod as pp
        >>> mech = pp.load("lu-3spu-2rpu-r")
        >>> pose = mech.pose({"alpha": 0.1, "p": -0.3, "h": 0.6, "beta": 0.8, "gamma": 0.6})
        >>> by = mech.inverse_dynamics_derivatives(pose, np.zeros(6), np.zeros(6))
        >>> by.coordinates, by.forces_by_coordinates.shape
        (('alpha', 'p', 'h', 'beta', 'gamma'), (5, 5))
        """
        set, named = self._varied_coordinates(set, coordinates)
        args = MOTION.loaded(wrench, wrench_axes, pose, twist, acceleration)
        args = (*args, set, named)
        names, out = _core.inverse_dynamics_derivatives(self._core, *args)
        _, bodies, _ = _core.inertial_parameters(self._core)
        geometry = _core.geometry_parameters(self._core)
        return InverseDynamicsDerivatives(
            self, coordinates=tuple(names), bodies=tuple(bodies), geometry=tuple(geometry), **out
        )

    def regressor(
        self,
        pose: ArrayLike,
        twist: ArrayLike,
        acceleration: ArrayLike,
        wrench: ArrayLike | None = None,
        wrench_axes: str = "base",
    ) -> Regressor:
        """Y of `forces = Y @ parameters + offset`: forces are linear in the inertial parameters [T57].

        Arguments as for `inverse_dynamics`; only the offset depends on the load.

        >>> import numpy as np, polypod as pp
        >>> mech = pp.load("lu-3spu-2rpu-r")
        >>> pose = mech.pose({"alpha": 0.1, "p": -0.3, "h": 0.6, "beta": 0.8, "gamma": 0.6})
        >>> y = mech.regressor(pose, np.zeros(6), np.zeros(6))
        >>> (y.forces @ y.values + y.forces_offset).round().tolist()
        [-13151.0, 9809.0, -4907.0, -1993.0, 10231.0]
        """
        args = MOTION.loaded(wrench, wrench_axes, pose, twist, acceleration)
        out = _core.regressor(self._core, *args)
        names, _, values = _core.inertial_parameters(self._core)
        return Regressor(self, names=tuple(names), values=values, **out)

    def base_parameters(self) -> BaseParameters:
        """The minimal set of inertial parameters, those combinations that active forces can tell apart [T58].

        From the regressors of random motions about the centre pose, the same every time.

        Raises:
            UnsupportedError: the mechanism is singular wherever it was looked at: there are no forces.

        >>> import polypod as pp
        >>> mech = pp.load("lu-3spu-2rpu-r")
        >>> base = mech.base_parameters()
        >>> len(base.names), len(base.parameters)
        (69, 120)
        >>> base.expression(base.names.index("cylinder 1 I_xx"))
        'cylinder 1 I_xx + piston 1 I_xx'
        """
        found = _core.base_parameters(self._core)
        if found is None:
            raise UnsupportedError(
                f"{self.name}: no regular poses were found about the centre pose, so that forces are not "
                "determined; base parameters need a design that is not singular everywhere"
            )
        columns, combination, remainders = found
        names, _, values = _core.inertial_parameters(self._core)
        return BaseParameters(
            self,
            names=tuple(names[i] for i in columns),
            columns=np.array(columns, dtype=np.int64),
            combination=combination,
            values=combination @ values,
            parameters=tuple(names),
            remainders=remainders,
        )

    # --- limits ------------------------------------------------------------------------------------------

    @cached_property
    def limit_list(self) -> tuple[Limit, ...]:
        """All limits that the file sets: joints, then clearances, conditioning, forces [T35]."""
        return tuple(
            Limit(name, kind, tuple(self.leg_names[i] for i in legs), unit, least, greatest, scale)
            for name, kind, legs, unit, least, greatest, scale in self._core.limit_list()
        )

    def limits(
        self,
        pose: ArrayLike,
        wrench: ArrayLike | None = None,
        wrench_axes: str = "base",
        *,
        twist: ArrayLike | None = None,
        acceleration: ArrayLike | None = None,
    ) -> Limits:
        """How far a pose is from every limit, and which binds [T35-T38].

        Forces are those that hold the load at rest, or those of the motion where one is given. At a singular
        pose (status SINGULAR) the margins of forces are NaN and the others stand.

        Args:
            pose: (..., 4, 4).
            wrench: load on the platform at o, (..., 6), N and N m; the mechanism's own by default. Only the
                limits of forces depend on it.
            wrench_axes: the axes of `wrench`, "base" or "platform".
            twist: (..., 6); rest by default.
            acceleration: (..., 6); zero by default.

        >>> import polypod as pp
        >>> mech = pp.load("lu-3spu-2rpu-r")
        >>> limits = mech.limits(mech.home)
        >>> limits.names[limits.binding], limits.margins.min().round(4), bool(limits.within)
        ('stroke min of leg 2', np.float64(0.0941), True)
        """
        if twist is None and acceleration is None:
            poses, *load = POSE.loaded(wrench, wrench_axes, pose)
            args: Loaded = (poses, _AT_REST, _AT_REST, *load)
        else:
            twist, acceleration = (np.zeros(6) if a is None else a for a in (twist, acceleration))
            args = MOTION.loaded(wrench, wrench_axes, pose, twist, acceleration)
        return Limits(self, names=self._limit_names, **self._core.limits(*args))

    def coupled_forces(
        self, pose: ArrayLike, constraint: ArrayLike, *, as_printed: bool = False
    ) -> CoupledForces:
        """The couple-constrained forces f_c1, f_c3 and the torque T_c of two legs on one rod [T16].

        Args:
            pose: (..., 4, 4).
            constraint: multipliers (..., k) from `inverse_dynamics`.
            as_printed: Eq. 44 as the paper prints it, which contradicts its own Eq. 7.

        Raises:
            CoordinateError: the mechanism has no two legs that share a constraint on one rod.
        """
        poses, multipliers = Arguments(pose=(4, 4), constraint=(6 - self.dof,))(pose, constraint)
        result = self._core.coupled_forces(poses, multipliers, as_printed)
        if result is None:
            raise CoordinateError(f"{self.name} has no two legs that share a constraint on one rod")
        first, second = result[0]
        return CoupledForces(self, legs=(self.leg_names[first], self.leg_names[second]), **result[1])


def _by_name(names: Sequence[str], rows: Array) -> dict[str, Array]:
    """The last axis by names; numbers for a single state."""
    return {name: rows[..., i][()] for i, name in enumerate(names)}


def _in_words(names: Sequence[str]) -> str:
    """1 and 3; 1, 2 and 3."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def _plain(value: Any) -> Any:
    """A file's content in the types that reading one gives, whatever arrays and sequences it is made of.

    A file cannot hold None: it stands for an entry that is not there.
    """
    match value:
        case Mapping():
            return {str(key): _plain(entry) for key, entry in value.items() if entry is not None}
        case np.ndarray() | np.generic():
            return value.tolist()
        case list() | tuple():
            return [_plain(entry) for entry in value]
    return value


def _positive(name: str, value: float) -> float:
    if not 0.0 < value < np.inf:
        raise PolypodError(f"{name} is {value!r}; must be a positive number of metres")
    return float(value)


def _from_parts(data: dict[str, Any], text: str | None) -> Mechanism:
    return Mechanism(data, text=text)


def _stroke(drive: Drive, least: float, greatest: float) -> str:
    low, high = (readable_coordinate(drive, end) for end in (least, greatest))
    if np.isfinite(least) and least != 0.0:
        return f"{low} to {high}" if np.isfinite(greatest) else f"from {low}"
    return f"to {high}" if np.isfinite(greatest) else "free"


def spans(mech: Mechanism) -> Array:
    """(n,): from base joint to platform joint at the centre pose, m: the lengths of legs and struts."""
    home = mech.inverse_kinematics(mech.home)
    return np.where(mech.moves_feet, np.linalg.norm(home.vectors, axis=-1), home.lengths)


def list_mechanisms() -> tuple[str, ...]:
    """Names of the built-in mechanisms."""
    return tuple(
        sorted(f.name.removesuffix(".toml") for f in _built_in().iterdir() if f.name.endswith(".toml"))
    )


def load(source: str | Path) -> Mechanism:
    """The mechanism of a file, or a built-in one by its name.

    >>> import polypod as pp
    >>> pp.load("lu-3spu-2rpu-r")
    <Mechanism lu-3spu-2rpu-r: RPU+SPU+RPU+SPU+SPU, 5 degrees of freedom>

    Raises:
        MechanismError: everything wrong with the file, each with its place.
        UnknownNameError: no such file and no such built-in mechanism.
    """
    name, path = str(source), Path(source)
    if name in list_mechanisms():
        return Mechanism.from_toml((_built_in() / f"{name}.toml").read_text(encoding="utf-8"), origin=name)
    if not path.is_file():
        raise UnknownNameError("mechanism file or built-in mechanism", name, list_mechanisms())
    text = read_text(path)
    if isinstance(text, Fault):
        raise MechanismError([text], name)
    return Mechanism.from_toml(text, origin=name)


def _built_in() -> Any:
    from importlib.resources import files

    return files("polypod") / "mechanisms"
