"""The drawings of the catalogue, one of each built-in mechanism: `make gallery` makes them all."""

from __future__ import annotations

import argparse
from pathlib import Path

from gallery import save
from matplotlib.figure import Figure

import polypod as pp
from polypod.plots import plot_mechanism
from polypod.plots.style import house_style

DOCS = Path(__file__).parent
IMAGES = DOCS / "images" / "catalogue"


def drawing(name: str) -> Figure:
    """The mechanism at its centre pose."""
    figure = Figure(figsize=(3.0, 3.0))
    with house_style():
        ax = figure.add_axes((0.0, 0.0, 1.0, 1.0), projection="3d")
        plot_mechanism(pp.load(name), ax=ax, labels=False)
    return figure


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description="Draws the mechanisms of the catalogue.")
    parser.add_argument("names", nargs="*", metavar="NAME", help="all by default")
    parser.add_argument("-o", "--output", type=Path, default=IMAGES, help="the folder for them")
    chosen = parser.parse_args()
    chosen.output.mkdir(parents=True, exist_ok=True)
    for name in chosen.names or pp.list_mechanisms():
        save(drawing(name), chosen.output / f"{name}.png")


if __name__ == "__main__":
    main()
