"""Workspaces: a mask over a grid, the exact boundary around it, and files of both."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from polypod import _core
from polypod.answers.notebook import card, number, rows_of
from polypod.bodies.palette import GREY, INK, PALE, YELLOW, color_of, rgb
from polypod.errors import WorkspaceError
from polypod.files.text import replacing
from polypod.files.units import coordinate_unit, readable
from polypod.mechanism import Mechanism
from polypod.workspaces.causes import EDGE_OF_GRID, NO_POSE, SINGULARITY
from polypod.workspaces.extremes import Extremes

if TYPE_CHECKING:
    import trimesh

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

SUFFIXES = (".stl", ".ply", ".nc", ".glb")
"""Of files that a workspace is saved to."""

_FORMAT = "polypod workspace 2"

WHITE = "#FFFFFF"


@dataclass(frozen=True, eq=False, repr=False)
class Workspace:
    """The set of all coordinates that a mechanism can take within its limits [T40, T42, T43].

    d coordinates vary, 2 or 3. Memory: one byte for each node of the grid (four more while it is made), and
    about 200 bytes for each vertex of the boundary.
    """

    kind: str
    """`reachable`: o over all orientations; `slice`: some coordinates over fixed others."""
    names: tuple[str, ...]
    """Of the coordinates that vary."""
    axes: tuple[Array, ...]
    """Coordinates of the nodes along each axis, m or rad."""
    mask: NDArray[np.bool_]
    """(n_1, ..., n_d): which nodes are inside."""
    vertices: Array
    """(v, d): of the boundary, each on a grid edge: the last place inside."""
    faces: Indices
    """(f, d): vertices of each triangle, counter-clockwise from outside; in 2-D of each segment."""
    labels: Indices
    """(v,): index of what ends the workspace at a vertex, in `label_names`."""
    label_names: tuple[str, ...]
    """Limits as in `mech.limit_list`, then singularity, edge of grid, no pose."""
    poses: Array
    """(v, 4, 4): a pose at each vertex, on the limit."""
    extremes: Extremes
    """The ends along each coordinate, with their errors, limits and poses [T76]."""
    volume: float
    """Of the mesh, or its area in two dimensions, in the product of the units."""
    volume_error: float
    """Its estimated error: by coarser grids and by places tried at random [T43]."""
    inputs: dict[str, Any]
    """Inputs: mechanism, bounds, step, start and the rest."""

    @property
    def units(self) -> tuple[str, ...]:
        """Of the coordinates."""
        return tuple(coordinate_unit(name) for name in self.names)

    @property
    def volume_unit(self) -> str:
        """Such as m^3, rad^2 or m^2 rad."""
        powers = {u: self.units.count(u) for u in self.units if u != "1"}
        return " ".join(u if n == 1 else f"{u}^{n}" for u, n in powers.items()) or "1"

    @property
    def extents(self) -> Array:
        """(d, 2): least and greatest value of each coordinate, m and rad."""
        return self.extremes.values

    @cached_property
    def shares(self) -> dict[str, float]:
        """Causes of the boundary, with their shares of its vertices, most first."""
        counts = np.bincount(self.labels, minlength=len(self.label_names))
        order = np.argsort(-counts, kind="stable")
        return {self.label_names[i]: float(counts[i] / len(self.labels)) for i in order if counts[i]}

    @cached_property
    def mechanism(self) -> Mechanism:
        """The mechanism, as it was given."""
        return Mechanism.from_toml(self.inputs["mechanism_file"])

    def mesh(self) -> trimesh.Trimesh:
        """The boundary with `labels` among its vertex attributes; three dimensions only."""
        import trimesh

        if len(self.names) != 3:
            raise WorkspaceError("a workspace of two coordinates has an outline and no mesh")
        mesh = trimesh.Trimesh(self.vertices, self.faces, process=False)
        mesh.vertex_attributes["label"] = self.labels
        return mesh

    def facts(self) -> dict[str, Any]:
        """Summary as plain data: SI, rad."""
        inputs = {name: value for name, value in self.inputs.items() if name != "mechanism_file"}
        return {
            "kind": self.kind,
            **inputs,
            "nodes": int(self.mask.size),
            "inside": int(self.mask.sum()),
            "extents": dict(zip(self.names, self.extents.tolist(), strict=True)),
            "extent_errors": dict(zip(self.names, self.extremes.errors.tolist(), strict=True)),
            "extent_limits": {
                name: [list(low), list(high)]
                for name, (low, high) in zip(self.names, self.extremes.limits, strict=True)
            },
            "volume": self.volume,
            "volume_error": self.volume_error,
            "volume_unit": self.volume_unit,
            "boundary": self.shares,
        }

    # --- files -------------------------------------------------------------------------------------------

    def to_xarray(self) -> xr.Dataset:
        """Everything as one dataset, inputs as JSON among its attributes."""
        axes = {
            name: (name, axis, {"units": u})
            for name, axis, u in zip(self.names, self.axes, self.units, strict=True)
        }
        about = {
            "mask": (self.names, self.mask.astype(np.int8), {"long_name": "1 for nodes inside"}),
            "vertices": (("vertex", "coordinate"), self.vertices, {"long_name": "boundary"}),
            "faces": (("face", "corner"), self.faces.astype(np.int32), {"long_name": "vertices of faces"}),
            "label": ("vertex", self.labels.astype(np.int32), {"long_name": "what ends the workspace"}),
            "pose": (("vertex", "row", "column"), self.poses, {"long_name": "pose at the vertex"}),
            "extents": (("coordinate", "end"), self.extents, {"long_name": "least and greatest"}),
            "extent_errors": (("coordinate", "end"), self.extremes.errors, {"long_name": "how much farther"}),
            "extent_pose": (
                ("coordinate", "end", "row", "column"),
                self.extremes.poses,
                {"long_name": "pose at the end"},
            ),
            "volume": ((), self.volume, {"units": self.volume_unit}),
            "volume_error": ((), self.volume_error, {"units": self.volume_unit}),
        }
        attributes = {
            "kind": self.kind,
            "label_names": json.dumps(self.label_names, ensure_ascii=False),
            "extent_limits": json.dumps(self.extremes.limits, ensure_ascii=False),
            "inputs": json.dumps(self.inputs, ensure_ascii=False),
            "polypod_version": _core.__version__,
        }
        return xr.Dataset(about, axes, attributes)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Workspace) and self.to_xarray().identical(other.to_xarray())

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return "<{}; {}>".format(*self._heading())

    def _repr_html_(self) -> str:
        """Extents, size, and what ends it at which share of the boundary."""
        extents = [
            (name, *(readable(value, unit) for value in (low, high, high - low)))
            for name, (low, high), unit in zip(self.names, self.extents.tolist(), self.units, strict=True)
        ]
        ends = [(name, f"{100 * share:.1f} %") for name, share in self.shares.items()]
        return card(
            *self._heading(),
            [rows_of(("", "least", "greatest", "width"), extents), rows_of(("what ends it", "of it"), ends)],
            notes=[f"{int(self.mask.sum())} of {self.mask.size} nodes inside"],
        )

    def _heading(self) -> tuple[str, str]:
        """Kind and size of the workspace."""
        fixed = self.inputs.get("fixed") or {}
        at = ", ".join(f"{name} = {readable(value, coordinate_unit(name))}" for name, value in fixed.items())
        size = f"{number(self.volume)} ± {self.volume_error:.1g} {self.volume_unit}"
        title = f"Workspace of {self.inputs['mechanism']}"
        word = "volume" if len(self.names) == 3 else "area"
        return title, f"{self.kind} {', '.join(self.names)}{f' at {at}' if at else ''}: {word} {size}"

    def save(self, path: str | PathLike[str]) -> None:
        """Writes the boundary (`.stl`, `.ply`, `.glb`) or everything (`.nc`); meshes are in m and rad.

        STL holds single precision and no labels. PLY holds double precision, the label of each vertex as a
        number and a colour, and the labels' names as comments. GLB holds single precision and the colours,
        and is for positions: y is up in it, see `polypod.files.glb`.

        Raises WorkspaceError for another suffix, for a mesh of two coordinates, and for GLB of angles.
        """
        path = Path(path)
        check_suffix(path, self.names)
        with replacing(path) as temporary:
            if path.suffix == ".nc":
                self.to_xarray().assign_attrs(polypod_format=_FORMAT).to_netcdf(temporary, engine="scipy")
            elif path.suffix == ".stl":
                self.mesh().export(temporary, file_type="stl")
            elif path.suffix == ".glb":
                temporary.write_bytes(self._glb())
            else:
                temporary.write_bytes(self._ply())

    def _glb(self) -> bytes:
        """A GLB scene of the boundary in the labels' colours."""
        from polypod.files.glb import mesh_glb

        return mesh_glb(self.mesh(), self._rgb[self.labels], f"workspace of {self.mechanism.name}")

    @property
    def _rgb(self) -> np.ndarray[Any, np.dtype[np.uint8]]:
        """(labels, 3): the colours from 0 to 255."""
        return np.array([rgb(color) for color in self.colors], np.uint8)

    def _ply(self) -> bytes:
        """A binary PLY file."""
        names = "".join(f"comment label {i}: {name}\n" for i, name in enumerate(self.label_names))
        colors = "".join(f"property uchar {c}\n" for c in ("red", "green", "blue"))
        header = (
            f"ply\nformat binary_little_endian 1.0\ncomment {_FORMAT}; {', '.join(self.names)} in "
            f"{', '.join(self.units)}\n{names}element vertex {len(self.vertices)}\n"
            f"property double x\nproperty double y\nproperty double z\n{colors}property int label\n"
            f"element face {len(self.faces)}\nproperty list uchar int vertex_indices\nend_header\n"
        )
        vertex = np.dtype([("at", "<f8", 3), ("color", "u1", 3), ("label", "<i4")])
        points = np.empty(len(self.vertices), vertex)
        points["at"], points["label"] = self.vertices, self.labels
        points["color"] = self._rgb[self.labels]
        triangles = np.empty(len(self.faces), np.dtype([("n", "u1"), ("of", "<i4", 3)]))
        triangles["n"], triangles["of"] = 3, self.faces
        return header.encode() + points.tobytes() + triangles.tobytes()

    @cached_property
    def colors(self) -> tuple[str, ...]:
        """The colour of each label: a limit has that of its first leg, paler for a least value."""
        legs = self.mechanism.leg_names
        result = []
        for limit in self.mechanism.limit_list:
            color = color_of(legs.index(limit.legs[0])) if limit.legs else YELLOW
            least = limit.kind.endswith("min")
            plain = limit.kind.endswith("max") or not limit.legs
            result.append(
                _mixed(color, WHITE, 0.5) if least else color if plain else _mixed(color, INK, 0.45)
            )
        others = {SINGULARITY: INK, EDGE_OF_GRID: PALE, NO_POSE: GREY}
        return (*result, *(others[name] for name in self.label_names[len(result) :]))


def _mixed(color: str, other: str, share: float) -> str:
    """A colour with a share of another one."""
    parts = rgb(color), rgb(other)
    return "#" + "".join(f"{round((1 - share) * a + share * b):02X}" for a, b in zip(*parts, strict=True))


def check_suffix(path: Path, names: Sequence[str]) -> None:
    """Raises WorkspaceError where a workspace over these coordinates cannot be saved to such a file."""
    if path.suffix not in SUFFIXES:
        raise WorkspaceError(
            f"{path} ends in {path.suffix!r}; a workspace's file ends in {', '.join(SUFFIXES)}"
        )
    if len(names) != 3 and path.suffix != ".nc":
        raise WorkspaceError(f"{path}: a workspace of {len(names)} coordinates has no mesh; save it as .nc")
    if path.suffix == ".glb" and tuple(names) != ("x", "y", "z"):
        raise WorkspaceError(
            f"{path}: a scene holds positions x, y, z, not {', '.join(names)}; save it as .stl or .ply"
        )


def load_workspace(path: str | PathLike[str]) -> Workspace:
    """The workspace that `Workspace.save` wrote as `.nc`.

    Raises WorkspaceError for a file that is not one.
    """
    path = Path(path)
    if path.suffix != ".nc":
        raise WorkspaceError(f"{path} ends in {path.suffix!r}; a whole workspace's file ends in .nc")
    if not path.is_file():
        raise WorkspaceError(f"{path} does not exist")
    try:
        data = xr.load_dataset(path, engine="scipy", decode_times=False)
        if data.attrs["polypod_format"] != _FORMAT:
            raise ValueError(f"it does not say {_FORMAT!r}")
        names = tuple(str(name) for name in data["mask"].dims)
        return Workspace(
            kind=data.attrs["kind"],
            names=names,
            axes=tuple(data[name].to_numpy() for name in names),
            mask=data["mask"].to_numpy().astype(bool),
            vertices=data["vertices"].to_numpy(),
            faces=data["faces"].to_numpy().astype(np.int64),
            labels=data["label"].to_numpy().astype(np.int64),
            label_names=tuple(json.loads(data.attrs["label_names"])),
            poses=data["pose"].to_numpy(),
            extremes=Extremes(
                data["extents"].to_numpy(),
                data["extent_errors"].to_numpy(),
                tuple((tuple(low), tuple(high)) for low, high in json.loads(data.attrs["extent_limits"])),
                data["extent_pose"].to_numpy(),
            ),
            volume=float(data["volume"]),
            volume_error=float(data["volume_error"]),
            inputs=json.loads(data.attrs["inputs"]),
        )
    except Exception as error:  # whatever a damaged file makes of the libraries that read it
        raise WorkspaceError(f"{path} is no whole Polypod workspace: {error}") from error


def with_floor(mech: Mechanism, sigma_min: float | None) -> Mechanism:
    """The mechanism with a floor for its smallest singular value, at least that of its own file."""
    if sigma_min is None:
        return mech
    if not 0.0 < sigma_min < np.inf:
        raise WorkspaceError(f"sigma_min is {sigma_min!r}; must be a number above 0")
    data = mech.to_dict()
    limits = data.setdefault("limits", {})
    limits["sigma_min"] = max(float(sigma_min), float(limits.get("sigma_min", 0.0)))
    return Mechanism.from_dict(data)
