"""The workspace of a mechanism: all positions that it reaches, or a slice of its pose space."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from numpy.typing import ArrayLike

from polypod.errors import WorkspaceError
from polypod.mechanism import Mechanism
from polypod.workspaces.reachable import reachable
from polypod.workspaces.search_region import Progress
from polypod.workspaces.slices import sliced
from polypod.workspaces.workspace import Workspace


def workspace(
    mech: Mechanism,
    vary: Sequence[str] | None = None,
    fix: Mapping[str, float] | None = None,
    *,
    step: float | Mapping[str, float] | None = None,
    bounds: Mapping[str, Sequence[float]] | None = None,
    start: ArrayLike | None = None,
    branch: int = +1,
    keep_aspect: bool = False,
    sigma_min: float | None = None,
    threads: int = 0,
    progress: Progress | None = None,
) -> Workspace:
    """The reachable workspace [T39, T40], or with `vary` a slice of the pose space [T42].

    The reachable workspace is the set of positions of o that can be reached from a start pose inside all
    limits, whatever the orientation. It is found in steps from neighbour to neighbour: what is found can
    be reached; what would need a rotation far from all those nearby may be missing.

    A slice varies two or three coordinates over fixed others: x, y, z over given angles are the
    constant-orientation workspace, angles over a given position the orientation workspace. The names
    are those of one coordinate set; or x, y, z of the tool tip with azimuth, tilt and (six degrees of
    freedom) torsion of the tool axis. It holds the connected part with the start, else the largest.

    Args:
        mech: the mechanism.
        vary: two or three coordinates; without them the reachable workspace.
        fix: values of the others that the coordinate set takes, m and rad.
        step: width of the grid's cells, m or rad; for a slice also one for each coordinate. By default
            the widest bounds have 64 cells; those of a slice have 60 each, or 200 in two dimensions.
        bounds: least and greatest value by name. By default positions that the strokes allow, on the side
            of the base joints where home is, and full turns.
        start: pose (4, 4) inside all limits; by default one found from home. A slice takes from it the
            component, the aspect and the branch of dependent coordinates.
        branch: as for `Mechanism.state`; slices only.
        keep_aspect: only what is reached without a change of the sign of det J.
        sigma_min: a floor for the smallest singular value: the dexterous workspace.
        threads: 0 for those of `set_threads`; reachable workspace only. No result depends on it.
        progress: called with the number of nodes done and of all.

    Raises:
        WorkspaceError: bounds, step or start that are wrong, and where nothing is found.
        CoordinateError: names that make up no coordinate set.

    >>> import polypod as pp
    >>> mech = pp.load("lu-3spu-2rpu-r")
    >>> found = pp.workspace(mech, step=0.1)
    >>> found.volume_unit, abs(found.volume - 0.34) < found.volume_error
    ('m^3', True)
    >>> at = {"x": 0.0, "y": 0.1, "z": 0.7}
    >>> tilts = pp.workspace(mech, ["azimuth", "tilt"], at, step=0.1)
    >>> tilts.mask.shape
    (63, 31)
    """
    given: dict[str, Any] = {
        "step": step,
        "bounds": bounds,
        "start": start,
        "keep_aspect": keep_aspect,
        "sigma_min": sigma_min,
        "progress": progress,
    }
    if vary is not None:
        return sliced(mech, vary, fix, branch=branch, **given)
    if fix:
        raise WorkspaceError(f"fix.{next(iter(fix))}: needs coordinates that vary; give vary, too")
    return reachable(mech, threads=threads, **given)
