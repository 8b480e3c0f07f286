"""The pictures of the gallery, each made by a few lines that the page shows: `make gallery` writes them all.

Each function below is one picture, named after it. The page takes its lines from between the markers.
"""

from __future__ import annotations

import argparse
import io
from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.colors import BoundaryNorm, LinearSegmentedColormap, to_rgb
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from numpy.typing import NDArray
from PIL import Image
from skimage.measure import marching_cubes

import polypod as pp
from polypod.bodies.palette import BLUE, GREY, INK, PALE, SKY, VERMILION, color_of
from polypod.paper.fig1 import fig1_poses
from polypod.plots import (
    plot_fig1,
    plot_fig2,
    plot_fig4,
    plot_mechanism,
    plot_poses,
    plot_topology,
    plot_workspace,
)
from polypod.plots.style import dash_of, house_style

Array = NDArray[np.float64]

DOCS = Path(__file__).parent
IMAGES = DOCS / "images" / "gallery"
MECHANISMS = DOCS / "mechanisms"
DOTS = 130
"""Per inch."""

SHADES = LinearSegmentedColormap.from_list("shades", ["#12303F", BLUE, SKY, "#D9EEF9", "white"])
"""From dark, where a number is small, to white."""

PICTURES: dict[str, Callable[[], Figure]] = {}


def picture(function: Callable[[], Figure]) -> Callable[[], Figure]:
    """Adds a function's picture to the gallery."""
    PICTURES[function.__name__.replace("_", "-")] = function
    return function


def mechanism(name: str) -> pp.Mechanism:
    """One of the gallery's own mechanisms."""
    return pp.load(MECHANISMS / f"{name}.toml")


# --- mechanisms ---------------------------------------------------------------------------------------------


@picture
# --8<-- [start:published]
def published() -> Figure:
    mech = pp.load("lu-3spu-2rpu-r")
    motion = pp.load_motion("lu-3spu-2rpu-r", mech).sample([0.0, 2.4, 5.9])
    state = mech.state(motion.coordinates, branch=motion.branch)
    poses = {"centre pose": mech.home}
    for time, pose, *angles in zip(
        motion.time,
        state.pose,
        *(state.coordinates[name] for name in ("alpha", "beta", "gamma")),
        strict=True,
    ):
        alpha, beta, gamma = np.degrees(angles)
        poses[rf"{time:g} s: $\alpha={alpha:.0f}$°, $\beta={beta:.0f}$°, $\gamma={gamma:.0f}$°"] = pose
    return plot_poses(mech, poses, Figure(figsize=(12.0, 3.9)))


# --8<-- [end:published]


@picture
# --8<-- [start:fig1]
def fig1() -> Figure:
    mech = pp.load("lu-3spu-2rpu-r")
    return plot_fig1(mech, fig1_poses(mech), Figure(figsize=(10.0, 8.2)))


# --8<-- [end:fig1]


@picture
# --8<-- [start:fig2]
def fig2() -> Figure:
    mech = pp.load("lu-3spu-2rpu-r")
    motion = pp.load_motion("lu-3spu-2rpu-r", mech).sample([4.8])
    state = mech.state(motion.coordinates, motion.rates, motion.second_rates, branch=motion.branch)
    figure = Figure(figsize=(10.2, 4.6))
    return plot_fig2(mech, state.pose[0], state.twist[0], state.acceleration[0], figure)


# --8<-- [end:fig2]


@picture
# --8<-- [start:mechanisms]
def mechanisms() -> Figure:
    figure = Figure(figsize=(10.0, 6.8))
    with house_style():
        for i, name in enumerate(("hexapod", "head", "tripod", "3-upu", "two-rods", "planar")):
            mech, left, low = mechanism(name), i % 3 / 3, 0.5 - i // 3 * 0.5
            ax = figure.add_axes((left, low + 0.05, 1 / 3, 0.44), projection="3d")
            plot_mechanism(mech, ax=ax, labels=False)
            legs = "+".join(dict.fromkeys(f"{mech.leg_letters.count(l)}{l}" for l in mech.leg_letters))
            text = f"{name}: {legs}, {mech.dof} degrees of freedom"
            figure.text(left + 1 / 6, low + 0.02, text, ha="center")
    return figure


# --8<-- [end:mechanisms]


@picture
# --8<-- [start:topology]
def topology() -> Figure:
    figure = Figure(figsize=(7.0, 4.4), layout="constrained")
    with house_style():
        plot_topology(pp.load("lu-3spu-2rpu-r").mobility(), figure.add_subplot())
    return figure


# --8<-- [end:topology]


@picture
# --8<-- [start:head]
def head() -> Figure:
    figure = Figure(figsize=(4.2, 4.6))
    with house_style():
        ax = figure.add_axes((0.0, 0.0, 1.0, 1.0), projection="3d")
        plot_mechanism(mechanism("head"), ax=ax)
    return figure


# --8<-- [end:head]

# --- motions ------------------------------------------------------------------------------------------------


@picture
# --8<-- [start:fig4]
def fig4() -> Figure:
    mech = pp.load("lu-3spu-2rpu-r")
    motion = pp.load_motion("lu-3spu-2rpu-r", mech)
    return plot_fig4(pp.solve(mech, motion), Figure(figsize=(10.0, 10.5)))


# --8<-- [end:fig4]


@picture
# --8<-- [start:actuators]
def actuators() -> Figure:
    mech = pp.load("lu-3spu-2rpu-r")
    data = pp.solve(mech, pp.load_motion("lu-3spu-2rpu-r", mech)).dataset
    figure = Figure(figsize=(6.4, 4.4), layout="constrained")
    with house_style():
        ax = figure.add_subplot()
        for i, leg in enumerate(mech.leg_names):
            ax.plot(1e3 * data.rate[:, i], data.force[:, i] / 1e3, color=color_of(i), label=f"leg {leg}")
        ax.set(xlabel="speed $v_r$ / mm s$^{-1}$", ylabel="active force $f_a$ / kN", xmargin=0.04)
        ax.legend()
    return figure


# --8<-- [end:actuators]


@picture
# --8<-- [start:reactions]
def reactions() -> Figure:
    mech = pp.load("lu-3spu-2rpu-r")
    data = pp.solve(mech, pp.load_motion("lu-3spu-2rpu-r", mech), reactions=True).dataset
    bearing, joint = ({"joint": name} for name in ("rod L", "platform joint 1"))
    force, couple = slice(0, 3), slice(3, 6)
    panels = (
        ("bearing of the rod: force / kN", data.reaction_in_joint.loc[bearing][:, force]),
        ("bearing of the rod: couple / kN m", data.reaction_in_joint.loc[bearing][:, couple]),
        ("platform joint 1: force / kN", data.reaction_in_joint.loc[joint][:, force]),
    )
    figure = Figure(figsize=(11.0, 3.4), layout="constrained")
    with house_style():
        for ax, (title, values) in zip(figure.subplots(1, 3), panels, strict=True):
            for i, axis in enumerate(("along L or u", "along n", "along L×n or u×n")):
                ax.plot(data.time, values[:, i] / 1e3, color=color_of(i), label=axis)
            ax.set(title=title, xlabel="time $t$ / s")
        least = data.least_reaction_in_joint.loc[joint][:, 1] / 1e3
        ax.plot(data.time, least, color=color_of(1), linestyle=dash_of(7), label="along n, least in size")
        figure.legend(*ax.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


# --8<-- [end:reactions]

# --- poses for lengths --------------------------------------------------------------------------------------


@picture
# --8<-- [start:modes]
def modes() -> Figure:
    mech = pp.load("lu-3spu-2rpu-r")
    found = mech.assembly_modes([0.769, 0.850, 0.769, 0.650, 0.650])  # m
    signs = ("" if sign == 0 else "> 0" if sign > 0 else "< 0" for sign in found.determinant_sign)
    captions = (f"mode {i}: det J {sign}" for i, sign in enumerate(signs, 1))
    return plot_poses(mech, dict(zip(captions, found.pose, strict=True)), Figure(figsize=(11.0, 6.6)))


# --8<-- [end:modes]

# --- workspace ----------------------------------------------------------------------------------------------


@picture
# --8<-- [start:head-tilts]
def head_tilts() -> Figure:
    found = pp.workspace(mechanism("head"), ["rx", "ry"], {"z": 0.56})
    return plot_workspace(found, Figure(figsize=(4.6, 4.6)))


# --8<-- [end:head-tilts]


@picture
# --8<-- [start:workspace]
def workspace() -> Figure:
    found = pp.workspace(pp.load("lu-3spu-2rpu-r"), step=0.02)
    return plot_workspace(found, Figure(figsize=(8.0, 7.4)))


# --8<-- [end:workspace]


@picture
# --8<-- [start:fig3-cut]
def fig3_cut() -> Figure:
    found = pp.workspace(pp.load("lu-3spu-2rpu-r"), step=0.02)
    highest = found.extents[2, 1]
    return plot_workspace(found, Figure(figsize=(8.0, 6.6)), above=highest - 0.511)  # m, as printed


# --8<-- [end:fig3-cut]


@picture
# --8<-- [start:slice-of-positions]
def slice_of_positions() -> Figure:
    mech = pp.load("lu-3spu-2rpu-r")
    found = pp.workspace(mech, ["x", "z"], {"y": 0.15, "alpha": -0.1, "beta": 0.6})
    return plot_workspace(found, Figure(figsize=(5.4, 4.0)))


# --8<-- [end:slice-of-positions]


@picture
# --8<-- [start:slice-of-tilts]
def slice_of_tilts() -> Figure:
    mech = pp.load("lu-3spu-2rpu-r")
    found = pp.workspace(mech, ["azimuth", "tilt"], {"x": 0.0, "y": 0.1, "z": 0.7})
    return plot_workspace(found, Figure(figsize=(5.4, 4.0)))


# --8<-- [end:slice-of-tilts]


@picture
# --8<-- [start:lattice]
def lattice() -> Figure:
    mech = pp.load("lu-3spu-2rpu-r")
    stepped, flooded = pp.length_lattice(mech, step=0.02), pp.workspace(mech, step=0.02)
    height = 1e3 * flooded.axes[2]
    figure = Figure(figsize=(9.0, 3.9), layout="constrained")
    with house_style():
        for k, ax in enumerate(figure.subplots(1, 2, sharey=True)):
            low, high = 1e3 * stepped.profile[:, 2 * k : 2 * k + 2].T
            bottom, top = 1e3 * stepped.layers.T
            ax.barh(bottom, high - low, top - bottom, low, align="edge", color="#B9CFE0", label="lattice")
            inside = flooded.mask.any(axis=1 - k)  # whether there is any position at this place and height
            across = np.where(inside, 1e3 * flooded.axes[k][:, None], np.nan)[:, inside.any(axis=0)]
            ends = np.nanmin(across, axis=0), np.nanmax(across, axis=0)
            up = height[inside.any(axis=0)]
            ax.plot(np.r_[ends[0], ends[1][::-1]], np.r_[up, up[::-1]], color=INK, label="reachable")
            ax.set(xlabel=f"${'XY'[k]}_o$ / mm", aspect="equal", xmargin=0.03)
            ax.autoscale_view()
        ax.legend(loc="upper right")
        figure.axes[0].set_ylabel("$Z_o$ / mm")
    return figure


# --8<-- [end:lattice]

# --- singularities ------------------------------------------------------------------------------------------


# --8<-- [start:lit]
def lit(triangles: Array, color: str) -> dict[str, Array]:
    """Colours of faces (f, 3, 3) that are lit from both sides, whatever the scales of the three axes."""
    corners = triangles / np.ptp(triangles, axis=(0, 1))
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    brightness = 0.45 + 0.55 * np.abs(normals @ np.array([-0.35, -0.55, 0.76]))
    shades = brightness[:, None] * np.array(to_rgb(color))
    return {"facecolors": shades, "edgecolors": shades, "linewidths": 0.3}


# --8<-- [end:lit]


@picture
# --8<-- [start:singular-curves]
def singular_curves() -> Figure:
    mech = pp.load("lu-3spu-2rpu-r")
    angles = np.linspace(-60, 60, 241)
    beta, gamma = np.meshgrid(angles, angles)
    figure = Figure(figsize=(10.0, 3.6), layout="constrained")
    with house_style():
        for ax, alpha in zip(figure.subplots(1, 3, sharey=True), (-20, 0, 20), strict=True):
            tilts = {"alpha": np.radians(alpha), "beta": np.radians(beta), "gamma": np.radians(gamma)}
            pose = mech.pose({**tilts, "p": -0.2, "h": 0.68})
            sigma, det = mech.conditioning(pose).sigma_min, mech.determinant(pose).determinant
            levels = [0.0, 0.01, 0.02, 0.04, 0.08, 0.16, 0.32]
            shades = ax.contourf(beta, gamma, sigma, levels, cmap=SHADES, norm=BoundaryNorm(levels, 256))
            ax.contour(beta, gamma, det, [0.0], colors=[VERMILION], linewidths=1.8)
            ax.set(title=rf"$\alpha={alpha}$°", xlabel=r"$\beta$ / deg", aspect="equal")
        figure.axes[0].set_ylabel(r"$\gamma$ / deg")
        figure.colorbar(shades, ax=figure.axes, label="smallest singular value")
    return figure


# --8<-- [end:singular-curves]


@picture
# --8<-- [start:singular-surface]
def singular_surface() -> Figure:
    mech = mechanism("planar")
    side, turn = np.linspace(-0.2, 0.2, 80), np.radians(np.linspace(-90, 270, 180))
    axes = (side, side, turn)
    x, y, rz = np.meshgrid(*axes, indexing="ij")
    value = mech.determinant(mech.pose({"x": x, "y": y, "rz": rz})).determinant
    corners, faces, _, _ = marching_cubes(value, 0.0, spacing=[axis[1] - axis[0] for axis in axes])
    place = (corners + np.array([axis[0] for axis in axes])) * [1e3, 1e3, 180 / np.pi]  # mm and degrees
    figure = Figure(figsize=(5.6, 5.6))
    with house_style():
        ax = figure.add_axes((0.0, 0.03, 0.92, 0.97), projection="3d")
        ax.add_collection3d(Poly3DCollection(place[faces], **lit(place[faces], SKY), rasterized=True))
        ax.set(xlim=(-200, 200), ylim=(-200, 200), zlim=(-90, 270), box_aspect=(1, 1, 1.2))
        ax.set(xlabel="x / mm", ylabel="y / mm", zlabel="rz / deg")
    return figure


# --8<-- [end:singular-surface]


@picture
# --8<-- [start:passages]
def passages() -> Figure:
    mech = pp.load("lu-3spu-2rpu-r")
    time = np.linspace(0.0, 2.0, 401)
    tilt = {"beta": np.radians(25 - 25 * time), "gamma": np.full_like(time, 0.03)}
    still = {name: np.full_like(time, value) for name, value in (("alpha", 0.0), ("p", -0.2), ("h", 0.68))}
    solution = pp.solve(mech, pp.Motion.through(time, {**still, **tilt}, set="natural"))
    data, found = solution.dataset, solution.singularities
    figure = Figure(figsize=(7.0, 4.6), layout="constrained")
    with house_style():
        upper, lower = figure.subplots(2, 1, sharex=True)
        upper.semilogy(data.time, data.sigma_min, color=BLUE)
        upper.axhline(found["threshold"], color=GREY, linewidth=0.8)
        for passage in found["near"]:
            upper.axvspan(passage["start"], passage["end"], color=PALE)
        lower.plot(data.time, 1e3 * data.determinant, color=BLUE)
        lower.set_yscale("symlog", linthresh=0.1)
        for crossing, (side, away) in zip(found["crossings"], (("right", -8), ("left", 8)), strict=True):
            at = (crossing["time"], 0.0)
            lower.plot(*at, "o", color=VERMILION)
            lower.annotate(f"{at[0]:.4f} s", at, (away, -12), textcoords="offset points", ha=side)
        upper.set_ylabel(r"$\sigma_\mathrm{min}$")
        lower.set(ylabel=r"$10^3$ det $J$", xlabel="time $t$ / s")
    return figure


# --8<-- [end:passages]

# --- design -------------------------------------------------------------------------------------------------


@picture
# --8<-- [start:sweep]
def sweep() -> Figure:
    file = mechanism("hexapod").to_dict()
    base, platform = np.linspace(300, 600, 16), np.linspace(150, 450, 16)  # mm
    tilt, way = np.meshgrid([0.0, 0.3], np.linspace(0, 2 * np.pi, 24))  # what it must do
    wanted = {"x": 0.0, "y": 0.0, "z": 0.58, "rx": tilt * np.cos(way), "ry": tilt * np.sin(way), "rz": 0.0}
    worst = np.empty((len(platform), len(base)))
    for i, j in np.ndindex(worst.shape):
        for leg in file["legs"]:
            leg["platform"]["point"]["radius"], leg["base"]["point"]["radius"] = platform[i], base[j]
        mech = pp.Mechanism.from_dict(file)
        pose = mech.pose(wanted)
        within = mech.limits(pose).within.all()
        worst[i, j] = mech.conditioning(pose).sigma_min.min() if within else np.nan
    figure = Figure(figsize=(5.8, 4.6), layout="constrained")
    with house_style():
        ax = figure.add_subplot()
        shades = ax.contourf(base, platform, worst, 12, cmap=SHADES)
        ax.grid(False)
        ax.set(xlabel="radius of the base / mm", ylabel="radius of the platform / mm", aspect="equal")
        ax.set(facecolor=PALE, title="grey: a leg would be too long or too short")
        figure.colorbar(shades, label="least singular value over the wanted poses")
    return figure


# --8<-- [end:sweep]


# --- making them --------------------------------------------------------------------------------------------


def save(figure: Figure, path: Path) -> None:
    """Writes a small PNG file: of 256 colours, without transparency."""
    with house_style():
        figure.savefig(buffer := io.BytesIO(), dpi=DOTS)
    # A palette that covers all colours: rare ones, such as those of legends, stay themselves.
    colors = Image.open(buffer).convert("RGB")
    colors = colors.quantize(method=Image.Quantize.MAXCOVERAGE, kmeans=3, dither=Image.Dither.NONE)
    colors.save(path, optimize=True)


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description="Makes the gallery's pictures.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"all by default, of {', '.join(PICTURES)}")
    parser.add_argument("-o", "--output", type=Path, default=IMAGES, help="the folder for them")
    chosen = parser.parse_args()
    chosen.output.mkdir(parents=True, exist_ok=True)
    for name in chosen.names or PICTURES:
        save(PICTURES[name](), chosen.output / f"{name}.png")
        print(chosen.output / f"{name}.png")


if __name__ == "__main__":
    main()
