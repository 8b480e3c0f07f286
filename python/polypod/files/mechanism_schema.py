"""The mechanism file as typed tables: which keys it may have, and what they hold."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from annotated_types import Len
from pydantic import Discriminator, Field, Strict, Tag

from polypod.files.tables import Count, Name, Number, Table, Vector
from polypod.legs.joints import JointLetter

_FORMS = {
    "point": "[x, y, z] or { radius, angle, z }",
    "axis": "[x, y, z] or { angle, z }",
    "normal": "[x, y, z] or { angle, z }",
    "center": "[x, y, z] (a distance will do in cylinder, piston and strut)",
    "inertia": "a number, [Ixx, Iyy, Izz] or three rows of three",
}


def _origin() -> list[float]:
    return [0.0, 0.0, 0.0]


def _upright() -> list[float]:
    return [0.0, 0.0, 1.0]


def _polar_or_vector(value: object) -> str:
    return "<polar>" if isinstance(value, dict) else "<vector>"


def _number_or_vector(value: object) -> str:
    return "<number>" if isinstance(value, (int, float)) else "<vector>"


def _number_vector_or_matrix(value: object) -> str:
    match value:
        case [[*_], *_]:
            return "<matrix>"
    return _number_or_vector(value)


class Part(Table):
    """A table of a mechanism file."""

    forms: ClassVar = _FORMS


class PolarPoint(Part):
    """(radius cos angle, radius sin angle, z)."""

    radius: Number
    angle: Number
    z: Number = 0.0


class PolarAxis(Part):
    """(cos angle, sin angle, z)."""

    angle: Number
    z: Number = 0.0


_N = Annotated[Number, Tag("<number>")]
_V = Annotated[Vector, Tag("<vector>")]
_M = Annotated[list[Vector], Len(3, 3), Tag("<matrix>")]
Point = Annotated[_V | Annotated[PolarPoint, Tag("<polar>")], Discriminator(_polar_or_vector)]
Axis = Annotated[_V | Annotated[PolarAxis, Tag("<polar>")], Discriminator(_polar_or_vector)]
Center = Annotated[_N | _V, Discriminator(_number_or_vector)]
Inertia = Annotated[_N | _V | _M, Discriminator(_number_vector_or_matrix)]


class Header(Part):
    """Entries above the first table."""

    name: Name
    description: str = ""
    source: str = ""


class Dynamics(Part):
    """Gravity in base axes, efficiency eta, damping mu in N s/m and N m s/rad whatever the units."""

    gravity: Vector | None = None
    efficiency: Number = 1.0
    linear_damping: Number = 0.0
    angular_damping: Number = 0.0


class Load(Part):
    """The wrench on the platform at o."""

    force: Vector = Field(default_factory=_origin)
    torque: Vector = Field(default_factory=_origin)
    axes: Literal["base", "platform"] = "base"


class Home(Part):
    """The centre pose."""

    position: Vector
    rotation_vector: Vector = Field(default_factory=_origin)


class Tool(Part):
    """Tip and tool axis in platform axes."""

    point: Point = Field(default_factory=_origin)
    axis: Axis = Field(default_factory=_upright)


class Published(Part):
    """The mobility terms that the source gives (Eq. 1 of the paper)."""

    dof: Count
    redundant: Count
    passive: Count


class Body(Part):
    """Mass, mass centre in the link's axes, inertia about it."""

    mass: Number
    center: Vector
    inertia: Inertia


class Link(Part):
    """Cylinder, piston or strut; `center` may be the distance along the leg from the link's own joint.

    Of a strut that is the platform joint.
    """

    mass: Number
    center: Center
    inertia: Inertia


class Range(Part):
    """Least and greatest value: rotation of an R joint or of a rod since home, active force of a leg."""

    min: Number
    max: Number


class Rod(Part):
    """Rod axes are (L, n, L x n); `center` counts from `point`."""

    name: Name
    point: Point
    axis: Axis
    mass: Number | None = None
    center: Vector | None = None
    inertia: Inertia | None = None
    range: Range | None = None


class Carriage(Part):
    """Carriage on a rail, which does not rotate; `center` counts from the base joint, in base axes."""

    mass: Number
    center: Vector = Field(default_factory=_origin)


class Slider(Part):
    """A rail along `axis` through the base point, and a strut of constant length on its carriage.

    `branch` is the sign of the strut's direction along the axis, seen from the carriage.
    """

    axis: Axis
    strut: Number
    branch: Number


class Stroke(Part):
    """Shortest and longest distance from B to b; of a slider, the ends of its carriage's way on the rail."""

    min: Number
    max: Number


class Cone(Part):
    """Largest angle between the leg and `axis`, its direction at home by default."""

    angle: Number
    axis: Axis | None = None


class Joint(Part):
    """A leg's joint, in the axes of its body."""

    joint: JointLetter
    point: Point
    axis: Axis | None = None
    normal: Axis | None = None
    rod: str | None = None
    cone: Cone | None = None
    range: Range | None = None


class Leg(Part):
    """Cylinder on the base joint, piston on the platform joint, between them the prismatic one.

    With `slider`: a carriage on a rail, the base joint on it, and a strut from there to the platform joint.
    """

    name: Name | None = None
    actuated: Annotated[bool, Strict()] = True
    slider: Slider | None = None
    stroke: Stroke | None = None
    radius: Number | None = None
    force: Range | None = None
    base: Joint
    platform: Joint
    cylinder: Link | None = None
    piston: Link | None = None
    carriage: Carriage | None = None
    strut: Link | None = None


class Limits(Part):
    """Limits of the mechanism as a whole."""

    sigma_min: Number | None = None
    clearance: Number | None = None
    joint_reach: Number | None = None
