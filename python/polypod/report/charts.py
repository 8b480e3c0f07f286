"""Charts over time: which there are, and their numbers as the page's script reads them."""

from __future__ import annotations

import base64
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from polypod.plots.series import Panel
from polypod.report.decimate import kept
from polypod.report.formulas import to_html

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Chart:
    """A panel and the instants of its values."""

    panel: Panel
    time: Array
    caption: str = ""
    log: bool = False
    """Whether its axis is logarithmic."""
    dots: bool = False
    """Whether its values are drawn without lines between them."""
    least: float = 0.0
    """Size below which values are rounding, in the panel's unit: its axis never shows less."""


@dataclass
class Series:
    """All charts of a page, and their numbers; arrays of times that several share are there once."""

    times: list[str] = field(default_factory=list)
    charts: list[dict[str, Any]] = field(default_factory=list)
    decimated: bool = False
    """Whether a chart has fewer points than states."""
    _known: dict[bytes, int] = field(default_factory=dict)

    def add(self, chart: Chart) -> dict[str, Any]:
        """Data of a chart for the page's template; its numbers are kept."""
        panel, at = chart.panel, kept(chart.panel.values)
        self.decimated |= len(at) < len(panel.values)
        curves = [
            {"name": to_html(name), "color": i % 7, "dash": i // 7 % 4} for i, name in enumerate(panel.curves)
        ]
        label = to_html(f"{panel.label} / {panel.unit}" if panel.unit else panel.label)
        self.charts.append(
            {
                "label": str(label),
                "time": self._time(chart.time[at]),
                "log": chart.log,
                "dots": chart.dots,
                "least": chart.least,
                "levels": [*panel.limits],
                "curves": [
                    {
                        "name": str(curve["name"]),
                        "color": curve["color"],
                        "dash": curve["dash"],
                        "values": encoded(panel.values[at, i]),
                    }
                    for i, curve in enumerate(curves)
                ],
            }
        )
        return {
            "index": len(self.charts) - 1,
            "caption": chart.caption,
            "label": label,
            "curves": curves,
            # Long names stand one below the other.
            "wide": len(curves) == 1 or any(len(Markup(curve["name"]).striptags()) > 9 for curve in curves),
        }

    def _time(self, time: Array) -> int:
        """The index of an array among `times`."""
        key = time.tobytes()
        if key not in self._known:
            self._known[key] = len(self.times)
            self.times.append(encoded(time))
        return self._known[key]


def encoded(values: Array) -> str:
    """Doubles, lowest byte first, in base 64: as exact as they are, NaN included."""
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f8").tobytes()).decode("ascii")
