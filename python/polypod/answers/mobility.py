"""Mobility: degrees of freedom, redundant constraints, and the topology graph [Eq. 1, T18]."""

from __future__ import annotations

from dataclasses import dataclass

from polypod.answers.notebook import card, rows_of


@dataclass(frozen=True)
class GraphLink:
    """A link of the topology graph."""

    name: str
    """Such as "cylinder 1", "carriage 2", "rod L" or "platform"."""
    joints: tuple[int, ...]
    """Indices of its joints in `Mobility.graph_joints`."""


@dataclass(frozen=True)
class GraphJoint:
    """A joint of the topology graph between two links."""

    kind: str
    """R, S, U, P or F."""
    name: str
    """Such as "platform joint 3"."""
    links: tuple[int, int]
    """Indices of both links in `Mobility.graph_links`."""


@dataclass(frozen=True)
class Published:
    """The accounting that the mechanism's publication gives, in the terms of Eq. 1."""

    dof: int
    """Degrees of freedom M."""
    redundant: int
    """Redundant constraints ς."""
    passive: int
    """Passive degrees of freedom M_0."""


@dataclass(frozen=True)
class IdleFreedom:
    """A local degree of freedom of the platform: the spin of a rod on which all legs end [T70]."""

    body: str
    """Body in which the line is fixed: "platform" or "base"."""
    point: tuple[float, float, float]
    """A point of the line in the axes of the body, m."""
    axis: tuple[float, float, float]
    """Its unit direction there: the spin is the angular velocity along it."""

    def __str__(self) -> str:
        point, axis = (f"({', '.join(f'{x:.6g}' for x in v)})" for v in (self.point, self.axis))
        return f"spin about the line through {point} m along {axis}, {self.body} axes, which moves no leg"


@dataclass(frozen=True)
class Mobility:
    """Degrees of freedom of the mechanism from ranks at generic poses, in the terms of Eq. 1 [T18]."""

    dof: int
    """Degrees of freedom of the platform: M of Eq. 1."""
    links: int
    """Number of links, base and platform among them: n_0 of Eq. 1."""
    joints: int
    """Number of joints: n_k of Eq. 1."""
    joint_freedoms: int
    """Degrees of freedom of all joints together: ΣM_i of Eq. 1."""
    loops: int
    """Independent loops, n_k - n_0 + 1: each has six closure equations."""
    closure_rank: int
    """Number of closure equations that are independent."""
    redundant: int
    """Loop-closure equations that say nothing new: ς of Eq. 1."""
    redundant_legs: tuple[str, ...]
    """The legs whose constraints they couple."""
    passive: int
    """Degrees of freedom that leave the platform where it is: M_0 of Eq. 1."""
    passive_legs: tuple[str, ...]
    """The legs that spin freely about their own line."""
    uncontrolled: int
    """Degrees of freedom, local ones apart, that remain at generic poses with all actuators locked: zero
    unless the design is singular."""
    idle: tuple[IdleFreedom, ...]
    """Degrees of freedom that no leg feels, by design [T70]."""
    constraint_rows: tuple[tuple[str, str], ...]
    """Leg and kind (A-E) of every scalar constraint."""
    independent_rows: tuple[int, ...]
    """Indices of those that are independent."""
    graph_links: tuple[GraphLink, ...]
    """The links of the topology graph, base and platform first."""
    graph_joints: tuple[GraphJoint, ...]
    """Its joints."""
    published: Published | None
    """The accounting of the file's `[published]`, if there is one."""

    def _repr_html_(self) -> str:
        """The terms of Eq. 1 and what couples or spins."""
        terms = ("dof", "links", "joints", "joint_freedoms", "loops", "closure_rank", "redundant", "passive")
        rows = [(name, str(getattr(self, name))) for name in terms]
        notes = []
        if self.redundant_legs:
            notes.append(f"redundant constraints couple legs {', '.join(self.redundant_legs)}")
        if self.passive_legs:
            notes.append(f"legs {', '.join(self.passive_legs)} spin freely")
        notes += [f"idle: {idle}" for idle in self.idle]
        if self.uncontrolled:
            notes.append(
                f"{self.uncontrolled} degrees of freedom remain with all actuators locked, at every pose"
            )
        return card("Mobility", f"{self.dof} degrees of freedom", [rows_of(("", ""), rows)], notes=notes)
