"""Kinds of singularities."""

from __future__ import annotations

from enum import IntEnum

from polypod import _core


class SingularityKind(IntEnum):
    """Kind of a singularity: the first of these conditions that holds [T32]."""

    UNKNOWN = -1
    """There is no answer: `status` says why."""
    NONE = 0
    LEG_LENGTH = 1
    """A leg has no length: an inverse singularity, the paper's fourth."""
    CONSTRAINT_VANISHES = 2
    """The wrench of a constraint vanishes, as where L ∥ l and r ∥ L: the paper's first."""
    CONSTRAINT = 3
    """The constraint wrenches depend on one another: degrees of freedom more, that no actuator controls."""
    LEG_FRAME = 4
    """A leg lies along the axis of its universal joint or rod: its rotation about itself is undetermined."""
    ACTUATION = 5
    """With all actuators locked the platform can still move: a direct singularity."""
    DEPENDENT_ROWS = 6
    """Only the constraints that J holds depend on one another: J is singular, the mechanism is not."""
    STRUT_ACROSS_RAIL = 7
    """The strut of a slider is perpendicular to its rail, where two branches meet: an inverse singularity."""

    @property
    def message(self) -> str:
        """Meaning of the kind."""
        return _MESSAGES.get(self, "no answer; the status says why")

    def with_freedoms(self, gained: int) -> str:
        """Meaning of the kind, with the number of degrees of freedom that the locked actuators leave."""
        counted = self in (SingularityKind.CONSTRAINT, SingularityKind.CONSTRAINT_VANISHES) and gained > 0
        return f"{self.message}, {gained} here" if counted else self.message


_MESSAGES = {code: message for code, _, message in _core.singularity_kinds()}
