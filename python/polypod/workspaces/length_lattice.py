"""The reachable workspace from a lattice of leg lengths, as in Section 4 of the paper [T41]."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polypod import _core
from polypod.answers.notebook import card, rows_of
from polypod.errors import UnsupportedError, WorkspaceError
from polypod.files.units import readable
from polypod.legs.drives import TELESCOPE, kinds_among
from polypod.mechanism import Mechanism
from polypod.workspaces.search_region import Progress, bounds_of, check_threads, start_of
from polypod.workspaces.workspace import with_floor

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]

DIVISIONS = 10
"""Steps of the shortest stroke by default."""

MOST_NODES = 10**9


@dataclass(frozen=True, eq=False, repr=False)
class LengthLattice:
    """Positions of o for all combinations of leg lengths in one aspect [T41].

    Memory: 5 bytes for each node, 16 for each pose, and 500 for each that a wave reaches.
    """

    step: float
    """Of the lengths, m."""
    nodes: int
    """Of the lattice."""
    inside: int
    """Nodes with a pose inside all limits that was reached."""
    poses: int
    """Such poses; a node may have several."""
    at_limits: int
    """Steps to a neighbour that end at a limit other than a stroke, or at the bounds."""
    singular: int
    """Steps to a neighbour that end in a singularity."""
    extents: Array
    """(3, 2): least and greatest x, y, z of o, m: of these poses and of those that steps pass in pieces."""
    layers: Array
    """(k, 2): lower and upper end of each layer of z, m; only layers that hold a position."""
    profile: Array
    """(k, 4): least and greatest x, then y, in each layer, m."""
    inputs: dict[str, Any]
    """Inputs from which it was made."""

    def __repr__(self) -> str:
        return "<{}; {}>".format(*self._heading())

    def _repr_html_(self) -> str:
        """Extents of o, and how steps ended."""
        rows = [
            (name, *(readable(value, "m") for value in (low, high, high - low)))
            for name, (low, high) in zip("xyz", self.extents.tolist(), strict=True)
        ]
        notes = [f"{self.at_limits} steps end at limits or bounds, {self.singular} in a singularity"]
        table = rows_of(("o", "least", "greatest", "width"), rows)
        return card(*self._heading(), [table], notes=notes)

    def _heading(self) -> tuple[str, str]:
        """Kind of the lattice, and its number of nodes."""
        said = f"steps of {readable(self.step, 'm')}, {self.inside} of {self.nodes} combinations inside"
        return f"Lattice of leg lengths of {self.inputs['mechanism']}", f"{said}, {self.poses} poses"

    def to_xarray(self) -> xr.Dataset:
        """Extents, and the profile over the layers of z, as one dataset; counts and inputs as attributes."""
        import xarray as xr

        about = {
            "extents": (("axis", "end"), self.extents, "least and greatest coordinate of o"),
            "layers": (("layer", "end"), self.layers, "lower and upper end of the layer of z"),
            "profile": (("layer", "across", "end"), self.profile.reshape(-1, 2, 2), "extents in the layer"),
        }
        data = {
            name: (dims, values, {"units": "m", "long_name": text})
            for name, (dims, values, text) in about.items()
        }
        coords = {"axis": ["x", "y", "z"], "across": ["x", "y"], "end": ["least", "greatest"]}
        counts = {name: getattr(self, name) for name in ("nodes", "inside", "poses", "at_limits", "singular")}
        attrs = {**counts, "inputs": json.dumps(self.inputs, ensure_ascii=False)}
        return xr.Dataset(data, coords, {"title": f"Length lattice of {self.inputs['mechanism']}", **attrs})

    def widths_above(self, z: float) -> Array:
        """(2,): extents along x and y of the layers whose middle is above z, m; NaN where there is none."""
        above = self.profile[self.layers.mean(axis=1) > z]
        if not len(above):
            return np.full(2, np.nan)
        return np.array([above[:, 1].max() - above[:, 0].min(), above[:, 3].max() - above[:, 2].min()])

    def facts(self) -> dict[str, Any]:
        """Summary as plain data: SI."""
        return {
            "kind": "lattice",
            **self.inputs,
            "nodes": self.nodes,
            "inside": self.inside,
            "poses": self.poses,
            "at_limits": self.at_limits,
            "singular": self.singular,
            "extents": dict(zip("xyz", self.extents.tolist(), strict=True)),
        }


def length_lattice(
    mech: Mechanism,
    *,
    step: float | None = None,
    layer: float | None = None,
    bounds: Mapping[str, Sequence[float]] | None = None,
    start: ArrayLike | None = None,
    sigma_min: float | None = None,
    threads: int = 0,
    progress: Progress | None = None,
) -> LengthLattice:
    """Positions of o for all combinations of leg lengths in one aspect [T41].

    The way of the paper's Section 4: every actuated leg takes lengths from the least to the greatest of
    its stroke, and forward kinematics continues from each combination to the next, as far as limits,
    bounds and singularities let it. An aspect may hold several poses with the same lengths: all count.

    Args:
        mech: the mechanism.
        step: of the lengths, m; a tenth of the shortest stroke by default.
        layer: height of the layers of z for which widths are kept, m; `step` by default.
        bounds: of o, least and greatest of x, y, z, m; what the legs reach by default, on the side of the
            base where home is.
        start: pose (4, 4) whose aspect is meant; by default a well conditioned one found from home.
        sigma_min: a floor for the smallest singular value.
        threads: 0 for those of `set_threads`. The result does not depend on it.
        progress: called with the number of nodes reached and of all.

    Raises:
        UnsupportedError: an actuated leg without a stroke, or not as many of them as degrees of freedom.
        WorkspaceError: a step or start that is wrong.
    """
    mech = with_floor(mech, sigma_min)
    check_threads(threads)
    others = kinds_among(
        drive for drive, actuated in zip(mech.drives, mech.actuated, strict=True) if actuated
    )
    for kind in others:
        if kind != TELESCOPE:
            legs = zip(mech.leg_names, mech.drives, mech.actuated, strict=True)
            names = ", ".join(name for name, drive, actuated in legs if drive == kind and actuated)
            raise UnsupportedError(
                f"legs {names} are {kind.name}s; a lattice of lengths is of {TELESCOPE.name}s"
            )
    strokes = mech.stroke[mech.actuated]
    widths = np.ptp(strokes, axis=1)
    for name, (least, greatest) in zip(np.array(mech.leg_names)[mech.actuated], strokes, strict=True):
        if not (least > 0.0 and np.isfinite(greatest)):
            raise UnsupportedError(
                f"legs.{name}.stroke: a lattice of lengths needs the stroke of every actuated leg"
            )
    if int(mech.actuated.sum()) != mech.dof:
        raise UnsupportedError(
            f"{mech.name}: a lattice of lengths needs as many actuated legs as degrees of freedom: lengths "
            "of redundant legs contradict one another at most nodes, and with a local degree of freedom "
            "poses differ by a spin that lengths do not determine; workspace works with poses"
        )
    step = float(widths.min() / DIVISIONS) if step is None else step
    layer = step if layer is None else layer
    for name, value in (("step", step), ("layer", layer)):
        if not 0.0 < value < np.inf:
            raise WorkspaceError(f"{name} is {value!r}; must be above 0 m")
    nodes = float(np.prod(np.rint(widths / step) + 1.0))
    if nodes > MOST_NODES:
        raise WorkspaceError(f"step makes a lattice of {nodes:.3g} nodes; at most {MOST_NODES:.0e}: widen it")
    box = np.array(list(bounds_of(mech, ("x", "y", "z"), bounds).values()))
    pose = start_of(mech, start, box, regular=True)
    lattice = _core.Lattice.begin(
        mech._core, np.ascontiguousarray(pose).reshape(-1), box.tolist(), step, layer, threads
    )
    if lattice is None:
        raise WorkspaceError(
            "start: its assembly mode has no pose inside limits and bounds with the lengths of the nearest "
            "node; give another, or a smaller step"
        )
    while lattice.wave():
        if progress is not None:
            progress(lattice.inside, lattice.nodes)
    found = lattice.reached()
    bottom, height = found["layers"]
    profile = found["profile"]
    some = np.isfinite(profile[:, 0])
    lower = bottom + height * np.arange(len(profile))[some]
    return LengthLattice(
        step=step,
        nodes=lattice.nodes,
        inside=lattice.inside,
        poses=found["poses"],
        at_limits=found["at_limits"],
        singular=found["singular"],
        extents=found["extents"],
        layers=np.stack([lower, lower + height], axis=1),
        profile=profile[some],
        inputs={
            "mechanism": mech.name,
            "step": step,
            "layer": layer,
            "bounds": dict(zip("xyz", box.tolist(), strict=True)),
            "start": pose.tolist(),
            "sigma_min": sigma_min,
        },
    )
