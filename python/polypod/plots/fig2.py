"""The paper's Fig. 2: the vectors and axes of each kind of leg, and the coupled forces at each rod.

Everything drawn is an answer of the mechanism at one state; nothing is computed here but where it stands.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polypod.answers.status import Status
from polypod.bodies.links import leg_radii, link_frames, links_of
from polypod.bodies.palette import BLUE, GREEN, INK, VERMILION
from polypod.errors import PolypodError
from polypod.legs.joints import JOINTS, JointLetter
from polypod.mechanism import Mechanism
from polypod.plots.canvas import Canvas, cells, pyplot_figure, size_of
from polypod.plots.mechanism import checked_pose
from polypod.plots.picture import Label, Picture, Vector
from polypod.plots.scene import joint_label, joint_points, math_name
from polypod.plots.style import house_style
from polypod.plots.view import draw, frame, right_and_up
from polypod.vectors import unit

Array = NDArray[np.float64]

_FADED, _PALE = 0.6, 0.7
"""Share of white in the colours of the legs in question, and of the links around them."""

_GAP, _UNIT, _OMEGA, _FORCE, _TORQUE = 0.2, 0.8, 1.4, 1.2, 1.0
"""In characteristic lengths: from what is named to the middle of its name; and the greatest drawn lengths of
unit vectors, angular velocities, forces and torques."""


class _State(NamedTuple):
    """What the mechanism answers at a state; base axes, SI."""

    mech: Mechanism
    pose: Array
    base: Array
    """(n, 3): joints of the legs on the base's side."""
    platform: Array
    """(n, 3): joints on the platform's."""
    delta: Array
    """(n, 3)."""
    omega: Array
    """(3,): of the platform."""
    leg_omega: Array
    """(n, 3)."""
    joint_axes: dict[str, Array]
    """(3, 3) by joint: its axes in columns, as of `Mechanism.joint_reactions`."""
    frames: dict[str, Array]
    """(4, 4) by link."""
    rods: list[_OnRod]
    """Those with coupled forces."""


class _OnRod(NamedTuple):
    """The coupled forces of legs on a rod."""

    rod: int
    legs: list[int]
    along: Array
    """(3,): c of the first leg, along which all forces are counted."""
    forces: Array
    """(m,), N."""
    torque: float
    """About the rod, N m."""


def plot_fig2(
    mech: Mechanism,
    pose: ArrayLike,
    twist: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
    figure: Canvas | None = None,
) -> Canvas:
    """Vectors and axes of the first leg of each kind, and the forces at each rod, as in Fig. 2 of the paper.

    Of a leg: r, e, δ, the unit vectors R of its joints' axes (n among them), the angular velocities of leg
    and platform, and the mass centres p of the piston and q of the cylinder. Of a rod whose legs share a
    constraint: L, l, c, the coupled forces on the platform and the torque T_c on the rod, under the
    mechanism's own load. Points and r, e, l are true to scale; below the panels it says how long the others
    are drawn. What is zero or unknown is not drawn.

    Args:
        mech: the mechanism.
        pose: (4, 4).
        twist: (6,), m/s and rad/s; rest by default.
        acceleration: (6,), m/s^2 and rad/s^2; none by default.
        figure: a figure or a subfigure to draw on.

    Raises:
        ShapeError: a pose, twist or acceleration of another shape.
        PolypodError: the legs cannot reach the pose.
    """
    state = _state(mech, checked_pose(pose), twist, acceleration)
    scales = _Scales.of(state)
    first: dict[str, int] = {}
    for i, letters in enumerate(mech.leg_letters):
        first.setdefault(letters, i)
    panels: dict[str, _Panel] = {
        f"{letters} leg {mech.leg_names[i]}": _LegPanel(state, i, scales) for letters, i in first.items()
    }
    panels |= {f"rod {mech.rod_names[on.rod]}": _RodPanel(state, on, scales) for on in state.rods}
    columns = min(len(panels), 3)
    rows = -(-len(panels) // columns)
    with house_style():
        figure = figure or pyplot_figure((3.4 * columns, 0.3 + 4.8 * rows))
        low = 0.5 / size_of(figure)[1]
        places = {"left": 0.0, "right": 1.0, "bottom": low, "top": 1.0, "wspace": 0.0, "hspace": 0.1}
        rects = [cell for row in cells(figure, rows, columns, **places) for cell in row]
        half = np.max([np.ptp(panel.corners(), axis=0) / 2 for panel in panels.values()], axis=0)
        spaces = [figure.add_axes(rect, projection="3d") for rect in rects[: len(panels)]]
        zoom = min(
            frame(ax, panel.corners(), half) for ax, panel in zip(spaces, panels.values(), strict=True)
        )
        for letter, ax, (caption, panel) in zip("abcdefghijkl", spaces, panels.items(), strict=False):
            draw(ax, panel, half, zoom, labels=True)
            cell = ax.get_position(original=True)
            figure.text(cell.x0 + cell.width / 2, cell.y0, f"({letter})  {caption}", ha="center", va="top")
        figure.text(0.5, 0.12 / size_of(figure)[1], scales.text(), ha="center", va="bottom", fontsize=7.5)
    return figure


# --- the state ----------------------------------------------------------------------------------------------


def _state(mech: Mechanism, pose: Array, twist: ArrayLike | None, acceleration: ArrayLike | None) -> _State:
    """All answers that are drawn."""
    v = np.zeros(6) if twist is None else np.asarray(twist, float)
    a = np.zeros(6) if acceleration is None else np.asarray(acceleration, float)
    motion = mech.kinematics(pose, v, a)
    status = Status(int(motion.status))
    if not status.has_answer and status != Status.SINGULAR:
        raise PolypodError(f"pose: no vectors to draw there; {status.message}")
    reactions = mech.joint_reactions(pose, v, a)
    base, platform = joint_points(mech, pose)
    return _State(
        mech,
        pose,
        base,
        platform,
        motion.directions,
        v[3:],
        motion.leg_omega,
        {joint.name: axes for joint, axes in zip(reactions.joints, reactions.axes, strict=True)},
        dict(zip((link.name for link in links_of(mech)), link_frames(mech, pose).frames, strict=True)),
        _coupled(mech, pose, mech.inverse_dynamics(pose, v, a).constraint, base, platform),
    )


def _coupled(mech: Mechanism, pose: Array, constraint: Array, base: Array, platform: Array) -> list[_OnRod]:
    """The coupled forces of all rods that have some."""
    if mech.coupled_legs is None:
        return []
    found = mech.coupled_forces(pose, constraint)
    legs = [mech.leg_names.index(name) for name in found.legs]
    rod = mech.geometry["legs"][legs[0]]["base"]["rod"]
    r = platform[legs[0]] - base[legs[0]]
    along = unit(np.cross(r, mech.geometry["rods"][rod]["axis"]))
    return [_OnRod(rod, legs, along, found.forces, float(found.torque))]


# --- scales -------------------------------------------------------------------------------------------------


class _Scales(NamedTuple):
    """Drawn lengths of what is no length, m; 0 for what does not occur."""

    unit: float
    """Of unit vectors."""
    omega: float
    """Per rad/s."""
    force: float
    """Per N."""
    torque: float
    """Per N m."""

    @classmethod
    def of(cls, state: _State) -> _Scales:
        """The greatest round scales at which nothing is longer than it may be."""
        size = state.mech.characteristic_length
        found = {
            _OMEGA: np.linalg.norm([state.omega, *state.leg_omega], axis=1),
            _FORCE: np.array([force for on in state.rods for force in on.forces]),
            _TORQUE: np.array([on.torque for on in state.rods]),
        }
        scales = [
            _round_down(most * size / greatest) if (greatest := _greatest(values)) > 0.0 else 0.0
            for most, values in found.items()
        ]
        return cls(_round_down(_UNIT * size), *scales)

    def text(self) -> str:
        """For below the figure."""
        of = {
            "unit vectors": (self.unit, ""),
            r"$\omega$": (self.omega, " per rad/s"),
            "$f_c$": (1e3 * self.force, " per kN"),
            "$T_c$": (1e3 * self.torque, " per kN m"),
        }
        texts = [f"{name} {1e3 * size:.4g} mm{per}" for name, (size, per) in of.items() if size]
        return f"Drawn lengths: {', '.join(texts)}"


def _greatest(values: Array) -> float:
    """The greatest size among finite values; 0 without any."""
    return float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0))


def _round_down(x: float) -> float:
    """The next smaller of 1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10, 12 and so on."""
    power = 10.0 ** math.floor(math.log10(x))
    steps = (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0)
    return power * max(step for step in steps if step * power <= x * (1.0 + 1e-12))


# --- panels -------------------------------------------------------------------------------------------------


class _Panel(Picture):
    """Some legs among base, platform and their rod, and vectors with their names."""

    def __init__(self, state: _State, legs: list[int]) -> None:
        super().__init__()
        self._state, mech = state, state.mech
        self._gap = _GAP * mech.characteristic_length
        rods = {mech.geometry["legs"][i]["base"]["rod"] for i in legs} - {None}
        around = {"base", "platform", *(f"rod {mech.rod_names[rod]}" for rod in rods)}
        own = {f"{link} {mech.leg_names[i]}" for i in legs for link in mech.drives[i].links}
        self.add_links(mech, state.pose, around, _PALE)
        self.add_links(mech, state.pose, own, _FADED)
        self.add_triad(self.faces, np.eye(4), 0.66 * mech.characteristic_length, "O", "XYZ")
        distance = 3.5 * max(leg_radii(mech))
        for i in legs:
            below = "Q" if mech.moves_feet[i] else "B"
            for letter, points, leg_side in ((below, state.base, 1), ("b", state.platform, -1)):
                text, away = f"${letter}_{{{self._name(i)}}}$", points[i] - points.mean(axis=0)
                self.labels.append(joint_label(text, points[i], away, leg_side, distance))

    def _name(self, i: int) -> str:
        """Of a leg, inside a formula."""
        return math_name(self._state.mech.leg_names[i])

    def _beside(self, text: str, point: Array, line: Array) -> None:
        """A name beside a point on a line, to the left of it as it runs in the picture."""
        right, up = right_and_up()
        across = (line @ right) * up - (line @ up) * right
        size = float(np.linalg.norm(across)) or 1.0
        self.labels.append(Label(text, point, point + self._gap * across / size))

    def _between(self, key: str, text: str, start: Array, end: Array, at: float = 0.5) -> None:
        """The vector between two points, named beside a part of it."""
        self.vectors.append(Vector(key, np.stack([start, end]), INK))
        self._beside(text, start + at * (end - start), end - start)

    def _arrow(
        self,
        key: str,
        text: str,
        start: Array,
        way: Array,
        color: str,
        *,
        double: bool = False,
        at_tail: bool = False,
    ) -> None:
        """A vector from a point, named beyond its head or its tail; none where it is unknown or zero."""
        size = float(np.linalg.norm(way))
        if not 0.0 < size < math.inf:
            return
        end = start + way
        self.vectors.append(Vector(key, np.stack([start, end]), color, double))
        named, beyond = (start, -way) if at_tail else (end, way)
        self.labels.append(Label(text, named, named + self._gap * beyond / size, color))


class _LegPanel(_Panel):
    """One leg, with what kinematics says of it."""

    def __init__(self, state: _State, i: int, scales: _Scales) -> None:
        super().__init__(state, [i])
        name, below, above = self._name(i), state.base[i], state.platform[i]
        o, delta = state.pose[:3, 3], state.delta[i]
        self.labels.append(Label("$o$", o, o - 0.6 * self._gap * state.pose[:3, :3].sum(axis=1)))
        self._between(f"r {name}", f"$r_{{{name}}}$", below, above, at=0.62)
        self._between(f"e {name}", f"$e_{{{name}}}$", o, above)
        start = below + 0.4 * (above - below)
        self._arrow(f"delta {name}", rf"$\delta_{{{name}}}$", start, scales.unit * delta, BLUE)
        for point, axes in ((below, _axes_below(state, i)), (above, _axes_above(state, i))):
            for k, axis in enumerate(axes, 1):
                reach = scales.unit * axis
                self.axes.append((point - 1.2 * reach, point + 1.2 * reach))
                key, text = self._axis_name(i, k, len(axes), on_platform=point is above)
                self._arrow(key, text, point, reach, BLUE)
        for key, text, point, omega in (
            (f"omega {name}", rf"$\omega_{{r{name}}}$", below, state.leg_omega[i]),
            ("omega", r"$\omega$", o, state.omega),
        ):
            self._arrow(key, text, point, scales.omega * omega, VERMILION, double=True)
        for letter, centre in zip("qp", _mass_centres(state, i), strict=True):
            if centre is not None:
                self.mass_centres.append(centre)
                self._beside(f"${letter}_{{{name}}}$", centre, delta)

    def _axis_name(self, i: int, k: int, count: int, *, on_platform: bool) -> tuple[str, str]:
        """Key and text of axis k, from 1, at one end of a leg.

        As in the paper R_i1 and R_i2 are those of the leg's frame, below where there are some; the last of
        them is the leg's normal n. Then those on the platform are R_m.
        """
        name = self._name(i)
        if on_platform and _axes_below(self._state, i):
            return f"R_m {name} {k}", f"$R_{{m{name}{k}}}$"
        normal = f" = n_{{{name}}}" if k == count else ""
        return f"R {name} {k}", f"$R_{{{name}{k}}}{normal}$"


class _RodPanel(_Panel):
    """The legs on one rod, with the forces that they put on the platform and the torques on the rod."""

    def __init__(self, state: _State, on: _OnRod, scales: _Scales) -> None:
        super().__init__(state, on.legs)
        rod, middle = state.mech.geometry["rods"][on.rod], state.base[on.legs].mean(axis=0)
        line = unit(rod["axis"])
        self._arrow("L", f"${math_name(rod['name'])}$", np.array(rod["point"]), scales.unit * line, BLUE)
        pair = len(on.legs) == 2
        if pair:
            self._between("l", "$l$", *state.platform[on.legs[::-1]])
        for k, (i, force) in enumerate(zip(on.legs, on.forces, strict=True)):
            name, below, above = self._name(i), state.base[i], state.platform[i]
            self._between(f"r {name}", f"$r_{{{name}}}$", below, above, at=0.62)
            way = scales.force * force * on.along
            self._arrow(f"f_c {name}", f"$f_{{c{name}}}$", above, way, GREEN)
            if k and not pair:
                continue
            # Of a pair the second leg has c and T_c opposed to the first's, as in the paper.
            sign = -1.0 if k else 1.0
            self._arrow(f"c {name}", f"$c_{{{name}}}$", above, sign * scales.unit * on.along, BLUE)
            way = sign * scales.torque * on.torque * line
            # On the side away from the other legs, whichever way it points.
            inwards = bool(way @ (middle - below) > 0.0)
            start, text = below - inwards * way, f"$T_{{c{name}}}$"
            self._arrow(f"T_c {name}", text, start, way, GREEN, double=True, at_tail=inwards)


def _axes_below(state: _State, i: int) -> list[Array]:
    """Unit vectors (3,) of the axes of rotation at a leg's joint on the base's side, that of a rod first."""
    leg = state.mech.geometry["legs"][i]
    axes = _free(state, f"base joint {state.mech.leg_names[i]}", leg["base"]["joint"])
    rod = leg["base"]["rod"]
    return axes if rod is None else [unit(state.mech.geometry["rods"][rod]["axis"]), *axes]


def _axes_above(state: _State, i: int) -> list[Array]:
    """Unit vectors (3,) of the axes of rotation at a leg's joint on the platform."""
    joint = state.mech.geometry["legs"][i]["platform"]["joint"]
    return _free(state, f"platform joint {state.mech.leg_names[i]}", joint)


def _free(state: _State, joint: str, kind: JointLetter) -> list[Array]:
    """The axes that a joint is free about; none of a ball, whose axes are arbitrary, and none unknown."""
    freedoms, axes = JOINTS[kind].freedoms, state.joint_axes[joint]
    known = freedoms < 3 and np.isfinite(axes).all()
    return [axes[:, k] for k in range(freedoms)] if known else []


def _mass_centres(state: _State, i: int) -> list[Array | None]:
    """Of a leg's two links, from the base on, (3,); None for one that the file gives no mass."""
    mech, leg = state.mech, state.mech.geometry["legs"][i]
    bodies = (leg["slider"]["carriage"] if leg["slider"] else leg["cylinder"], leg["piston"])
    # Counted from the joint at the link's outer end, in the link's axes.
    joints = (state.base[i], state.platform[i])
    axes = (state.frames[f"{link} {mech.leg_names[i]}"][:3, :3] for link in mech.drives[i].links)
    parts = zip(bodies, joints, axes, strict=True)
    return [joint + turn @ body["center"] if body else None for body, joint, turn in parts]
