"""The look of all figures: one palette, one set of line widths, the same on screen and in print."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib as mpl
from cycler import cycler

from polypod.bodies.palette import GREY, INK, PALE, PALETTE

# In this order they stay distinct in black and white, too.
DASHES = ("-", (0, (5, 1.5)), (0, (1.2, 1.2)), (0, (6, 1.5, 1.2, 1.5)), (0, (3, 1.2)))

_RC: Any = {  # no type: matplotlib's own names every setting there is
    "font.family": "DejaVu Sans",  # comes with matplotlib: figures are the same on every machine
    "font.size": 8,
    "text.color": INK,
    "axes.labelsize": 8,
    "axes.labelcolor": INK,
    "axes.titlesize": 8.5,
    "axes.titlelocation": "left",
    "axes.edgecolor": GREY,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.xmargin": 0.0,
    "axes.prop_cycle": cycler(color=PALETTE),
    "grid.color": PALE,
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.2,
    "lines.solid_capstyle": "round",
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "xtick.color": GREY,
    "ytick.color": GREY,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "legend.frameon": False,
    "legend.fontsize": 7.5,
    "legend.handlelength": 1.6,
    "legend.handletextpad": 0.5,
    "legend.columnspacing": 1.0,
    "legend.borderaxespad": 0.2,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "savefig.dpi": 200,
    "svg.fonttype": "path",
    "svg.hashsalt": "polypod",  # else the identifiers in an SVG change from run to run
}


@contextmanager
def house_style() -> Iterator[None]:
    """The look applies to what is made, drawn or saved inside; matplotlib's own settings come back after."""
    # Not by rc_context, which takes back other settings, too: pyplot, where it is first used inside, turns
    # the interactive mode of notebooks on.
    before = {name: mpl.rcParams[name] for name in _RC}
    mpl.rcParams.update(_RC)
    try:
        yield
    finally:
        mpl.rcParams.update(before)


def dash_of(index: int) -> Any:
    """The line style of curve number `index`: solid through the whole palette, dashed in the next round."""
    return DASHES[index // len(PALETTE) % len(DASHES)]
