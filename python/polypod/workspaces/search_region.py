"""Where a workspace is looked for: bounds, grids, and a pose to start from."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polypod import _core
from polypod.answers.singularity import NEAR_SINGULAR
from polypod.answers.status import Status
from polypod.errors import CoordinateError, WorkspaceError, alternatives
from polypod.files.units import coordinate_unit, readable
from polypod.mechanism import Mechanism
from polypod.workspaces.extremes import roomiest
from polypod.workspaces.pose_search import PoseSearch

Array = NDArray[np.float64]
Progress = Callable[[int, int], None]
"""Called with the number of nodes done and of all."""

MOST_NODES = 10**9
"""Nodes of the largest grid; its mask takes 1 GB."""

ROUNDING = 1e-9
"""Part of a cell that is none."""

ON_LIMIT = 1e-9
"""By how much, in its unit, a start pose may pass a limit: poses found on one miss it by rounding."""

_CANDIDATES = 7
"""Places along each axis at which a start pose is looked for."""

_TURN = 0.3
"""Rotation from home, rad, of the other rotations with which it is looked for."""

_FLAT = 0.05
"""Rails whose ends leave a plane by less than this part of their width lie in it."""
_POSITIONS = ("x", "y", "z", "tip_x", "tip_y", "tip_z")


class Grid(NamedTuple):
    """Cells that fill a box; their middles are the nodes."""

    names: tuple[str, ...]
    origin: Array
    """(d,): the first node, m and rad."""
    steps: Array
    """(d,): width of a cell along each axis."""
    counts: tuple[int, ...]

    @property
    def nodes(self) -> int:
        """Their number."""
        return int(np.prod([float(n) for n in self.counts]))

    def axes(self) -> tuple[Array, ...]:
        """The nodes' coordinates along each axis."""
        return tuple(
            o + s * np.arange(n) for o, s, n in zip(self.origin, self.steps, self.counts, strict=True)
        )

    def bounds(self) -> Array:
        """(d, 2): ends of the box."""
        low = self.origin - 0.5 * self.steps
        return np.stack([low, low + self.steps * np.array(self.counts)], axis=1)

    def within(self, region: Array) -> Grid:
        """The cells that a region (d, 2) takes up."""
        low = self.bounds()[:, 0]
        ends = (region - low[:, None]) / self.steps[:, None]
        first = np.clip(np.floor(ends[:, 0] + ROUNDING), 0.0, np.array(self.counts) - 1.0)
        last = np.clip(np.ceil(ends[:, 1] - ROUNDING), first + 1.0, self.counts)
        counts = tuple(int(n) for n in last - first)
        return Grid(self.names, self.origin + self.steps * first, self.steps, counts)


def position_bounds(mech: Mechanism) -> Array:
    """(3, 2): a box that holds every reachable position of o on the side of the base where home is, m.

    Leg i reaches no farther from B_i than its stroke and |m_i| together, a slider no farther from its rail
    than its strut and |m_i|. Along the axis that is closest to the normal of the base joints' plane, the
    box begins at their middle; not where rails stand out of a plane. Infinite without strokes.
    """
    legs = mech.geometry["legs"]
    reach = np.linalg.norm([leg["platform"]["point"] for leg in legs], axis=1)
    strokes = [*zip(legs, mech.drives, mech.stroke, strict=True)]
    reach += [drive.longest(leg, stroke) for leg, drive, stroke in strokes]
    # The base joint can be at any point between two.
    ends = np.array([drive.feet(leg, stroke) for leg, drive, stroke in strokes])
    low, high = ends.min(axis=1) - reach[:, None], ends.max(axis=1) + reach[:, None]
    box = np.stack([low.max(axis=0), high.min(axis=0)], axis=1)
    base = ends.reshape(-1, 3) if mech.moves_feet.any() else ends[:, 0]
    if not np.isfinite(base).all():
        return box
    middle = base.mean(axis=0)
    _, sizes, axes = np.linalg.svd(base - middle)
    if mech.moves_feet.any() and sizes[2] > _FLAT * sizes[1]:
        return box
    normal = axes[2]
    axis = int(np.argmax(np.abs(normal)))
    home = mech.home[axis, 3]
    box[axis, 0 if home >= middle[axis] else 1] = middle[axis]
    return box


def bounds_of(
    mech: Mechanism, names: Sequence[str], given: Mapping[str, Sequence[float]] | None
) -> dict[str, tuple[float, float]]:
    """Least and greatest value of each coordinate: the given ones, else what the mechanism can reach.

    Angles go all around; a tilt goes from 0 to π. Raises WorkspaceError for bounds that make no interval, and
    where there are no strokes to tell them.
    """
    given = given or {}
    for name in given:
        if name not in names:
            raise CoordinateError(f"bounds: {name!r} does not vary; {alternatives(str(name), names)}")
    box = position_bounds(mech)
    tip = float(np.linalg.norm(mech.geometry["tool"]["point"]))
    reach = float(np.abs(box).max())
    result = {}
    for name in names:
        if name in given:
            ends = given[name]
        elif name in _POSITIONS:
            low, high = box[_POSITIONS.index(name) % 3]
            more = tip if name.startswith("tip") else 0.0
            ends = (low - more, high + more)
        elif coordinate_unit(name) == "m":
            ends = (-reach, reach)
        elif coordinate_unit(name) == "1":
            ends = (-1.0, 1.0)
        else:
            ends = (0.0 if name == "tilt" else -np.pi, np.pi)
        low, high = _interval(name, ends)
        if not np.isfinite([low, high]).all() and name not in given:
            raise WorkspaceError(
                f"bounds.{name}: {mech.name} has no strokes that bound it; give bounds, such as "
                f"bounds={{{name!r}: (-0.5, 0.5)}}"
            )
        result[name] = (low, high)
    return result


def own_coordinates(mech: Mechanism) -> tuple[str, ...]:
    """As many pose coordinates as degrees of freedom: those that determine the others best at home."""
    return mech.equations_of_motion(mech.home, np.zeros(6), "pose").coordinates


def _interval(name: str, ends: Sequence[float]) -> tuple[float, float]:
    try:
        low, high = (float(end) for end in ends)
    except (TypeError, ValueError):
        raise WorkspaceError(f"bounds.{name} is {ends!r}; needs two numbers, least and greatest") from None
    if not low < high:
        raise WorkspaceError(f"bounds.{name} is {low:g} to {high:g}; must go from a number to a greater one")
    return low, high


def grid_of(
    bounds: Mapping[str, tuple[float, float]],
    step: float | Mapping[str, float] | None,
    cells: int,
    *,
    cubic: bool = False,
) -> Grid:
    """The grid of cells of about `step` that fills the bounds.

    Args:
        bounds: of each coordinate.
        step: of all coordinates, or of each.
        cells: how many the bounds of each coordinate have without a step; the widest bounds if cubic.
        cubic: keep `step` exactly and let the last cells reach beyond the upper bound, or beyond both where
            these are symmetric about zero; else cells fit the bounds.
    """
    names = tuple(bounds)
    if not isinstance(step, Mapping) and step is not None and len({coordinate_unit(n) for n in names}) > 1:
        raise WorkspaceError(
            f"step is {step!r} for coordinates in different units; needs one for each: "
            f"{', '.join(f'{n} in {coordinate_unit(n)}' for n in names)}"
        )
    chosen = dict(step) if isinstance(step, Mapping) else dict.fromkeys(names, step)
    for name in chosen:
        if name not in names:
            raise CoordinateError(f"step: {name!r} does not vary; {alternatives(str(name), names)}")
    steps, counts, origin = [], [], []
    for name, (low, high) in bounds.items():
        width = chosen.get(name)
        if width is None:
            width = (max(b - a for a, b in bounds.values()) if cubic else high - low) / cells
        if not (np.isfinite(width) and width > 0.0):
            raise WorkspaceError(f"step of {name} is {width!r}; must be above 0 {coordinate_unit(name)}")
        if cubic:
            count = max(int(np.ceil((high - low) / width - ROUNDING)), 1)
            low = -0.5 * count * width if abs(low + high) < 1e-9 else low
        else:
            count = max(round((high - low) / width), 1)
            width = (high - low) / count
        steps.append(width)
        counts.append(count)
        origin.append(low + 0.5 * width)
    return Grid(names, np.array(origin), np.array(steps), tuple(counts))


def check_size(grid: Grid) -> Grid:
    """The grid. Raises WorkspaceError for one of too many nodes."""
    if grid.nodes > MOST_NODES:
        least = grid.steps * (grid.nodes / MOST_NODES) ** (1.0 / len(grid.steps))
        steps = dict(zip(grid.names, least, strict=True))
        words = {readable(1.01 * step, coordinate_unit(name)) for name, step in steps.items()}
        raise WorkspaceError(
            f"step makes a grid of {grid.nodes:.3g} nodes; at most {MOST_NODES:.0e}, with a step of "
            f"{' and '.join(sorted(words))}"
        )
    return grid


def checked_start(mech: Mechanism, start: ArrayLike) -> Array:
    """A pose given to start from. Raises WorkspaceError unless it is one of the mechanism's."""
    pose = np.asarray(start, dtype=np.float64)
    if pose.shape != (4, 4):
        raise WorkspaceError(f"start has the shape {pose.shape}; needs one pose, (4, 4)")
    limits = mech.limits(pose)
    status = Status(int(limits.status))
    if not status.has_answer or limits.margins.min(initial=np.inf) < -ON_LIMIT:
        why = (
            f"passes a limit: {limits.names[int(limits.binding)]}"
            if status.has_answer and limits.binding >= 0
            else f"{status.name}: {status.message}"
        )
        raise WorkspaceError(f"start {why}; needs a pose inside all limits")
    return pose


def start_of(mech: Mechanism, start: ArrayLike | None, bounds: Array, *, regular: bool) -> Array:
    """(4, 4): the pose given to start from, checked, or one that is found in the bounds (3, 2)."""
    return find_start(mech, bounds, regular=regular) if start is None else checked_start(mech, start)


def check_threads(threads: int) -> None:
    """Raises WorkspaceError for a number of threads that is none."""
    if threads < 0:
        raise WorkspaceError(f"threads is {threads!r}; must be 0 (those of batches) or more")


def find_start(mech: Mechanism, bounds: Array, *, regular: bool) -> Array:
    """(4, 4): a pose inside all limits, o in the bounds (3, 2).

    The centre pose if it is such a one; else of those found at 7 x 7 x 7 places and home, with rotations next
    to that of home and to six rotated from it by 0.3 rad, the one farthest from its limits, relative to their
    scales. With `regular`, if the centre pose is nearly singular, the one that is conditioned best. Where
    none is found there, the one that an optimisation from home finds.

    Raises WorkspaceError where none is found.
    """
    home = mech.home
    near = [low + (high - low) * (np.arange(_CANDIDATES) + 0.5) / _CANDIDATES for low, high in bounds]
    grid = np.stack(np.meshgrid(*near, indexing="ij"), axis=-1).reshape(-1, 3)
    places = np.concatenate([home[None, :3, 3], grid])
    places = places[((places >= bounds[:, 0]) & (places <= bounds[:, 1])).all(axis=1)]
    places = places[np.argsort(np.linalg.norm(places - home[:3, 3], axis=1), kind="stable")]
    rotations = [
        home[:3, :3],
        *(_turned(axis, sign * _TURN) @ home[:3, :3] for axis in range(3) for sign in (1, -1)),
    ]
    poses = np.tile(np.eye(4), (len(places), len(rotations), 1, 1))
    poses[..., :3, :3] = rotations
    poses[..., :3, 3] = places[:, None]
    fitted = _core.fit_poses(mech._core, np.ascontiguousarray(poses).reshape(-1))
    fitted = fitted[np.isfinite(fitted[:, 0, 0])]
    if not len(fitted):
        fitted = _roomiest(mech, bounds)
    if not len(fitted):
        raise WorkspaceError(
            f"start: no pose of {mech.name} inside all limits was found in the bounds; give one, or other "
            "bounds"
        )
    home_serves = bool(mech.limits(home).within) and np.array_equal(places[0], home[:3, 3])
    if home_serves and not (regular and mech.conditioning(home).sigma_min < NEAR_SINGULAR):
        return home
    room = (
        mech.conditioning(fitted).sigma_min
        if regular
        else mech.limits(fitted).relative.min(axis=1, initial=1.0)
    )
    return np.asarray(fitted[int(np.argmax(np.nan_to_num(room, nan=-np.inf)))])


def _roomiest(mech: Mechanism, bounds: Array) -> Array:
    """(n, 4, 4): the pose with the most room that optimisation finds from home, if there is one."""
    search = PoseSearch(mech, mech.home[None], 0, 0, +1, box=bounds, aspect=False)
    x = roomiest(search, np.zeros(len(search.box)))
    if x is None:
        return np.zeros((0, 4, 4))
    found = _core.fit_poses(mech._core, np.ascontiguousarray(search.pose(x)).reshape(-1))
    return np.asarray(found[np.isfinite(found[:, 0, 0])])


def _turned(axis: int, angle: float) -> Array:
    """The rotation by an angle about a base axis."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_euler("xyz"[axis], angle).as_matrix())
