"""The texts of the page as HTML. Whatever comes from a file is escaped."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

from jinja2 import Environment, PackageLoader

from polypod.answers.leg_words import factor, force_unit, unit, word
from polypod.bodies.palette import GREY, color_of
from polypod.files.units import coordinate_unit
from polypod.mechanism import Mechanism
from polypod.viewer.model import Level, Note, Screw, View
from polypod.viewer.scene import LEVEL_COLORS, RED

_SYMBOLS = {"alpha": "α", "beta": "β", "gamma": "γ"}
_SHADES = {
    Level.FINE: ("#E7F3EC", "#1B7F3B"),
    Level.NEAR: ("#FFF8CC", "#8A6A00"),
    Level.BEYOND: ("#FDE7E9", RED),
}
_HEADS = {Level.FINE: "Fine", Level.NEAR: "Take care", Level.BEYOND: "Not possible"}
_TEMPLATES = Environment(
    loader=PackageLoader("polypod.viewer"), autoescape=True, trim_blocks=True, auto_reload=False
)


def scaled(name: str) -> tuple[float, str, int]:
    """Factor from SI, unit and decimals that the page shows a coordinate with."""
    return {"m": (1e3, "mm", 1), "rad": (180.0 / math.pi, "deg", 1), "1": (1.0, "", 3)}[coordinate_unit(name)]


def label(name: str) -> str:
    """A coordinate's symbol and unit, such as α / deg."""
    unit = scaled(name)[1]
    return f"{_SYMBOLS.get(name, name)} / {unit}" if unit else _SYMBOLS.get(name, name)


def status(notes: Iterable[Note], level: Level) -> str:
    """The box at the top: whether the pose is fine, and what is not."""
    back, front = _SHADES[level]
    template = _TEMPLATES.get_template("status.html")
    return template.render(notes=[*notes], level=level, head=_HEADS[level], back=back, front=front)


def numbers(
    view: View,
    mech: Mechanism,
    ranges: Mapping[str, tuple[float, float]],
    largest: float = 0.0,
    answered: float | None = None,
) -> str:
    """The panel of numbers.

    Args:
        view: what is shown.
        mech: the mechanism.
        ranges: nearest singular value of coordinates below and above, m and rad; empty if not known yet.
        largest: the force that the longest arrow stands for, N; 0 without arrows.
        answered: the time that an answer takes, s.
    """
    place = {**view.place, **view.coordinates}
    return _TEMPLATES.get_template("numbers.html").render(
        view=view,
        place=[_cell(name, value) for name, value in place.items()],
        legs=[_leg(view, mech, i) for i in range(mech.n_legs)],
        what=f"{word(mech.drives)} / {unit(mech.drives)}",
        force=force_unit(mech.drives),
        screw=_screw(view.screw),
        ranges=[_range(name, *pair) for name, pair in ranges.items()],
        largest=f"{largest:.0f} N" if largest >= 10.0 else f"{largest:.3g} N" if largest > 0.0 else "",
        answered=answered,
    )


def _cell(name: str, value: float) -> dict[str, str]:
    factor, unit, decimals = scaled(name)
    text = _fixed(factor * value, decimals)
    return {"name": name, "symbol": _SYMBOLS.get(name, name), "text": text, "unit": unit}


def _fixed(value: float, decimals: int = 1) -> str:
    """A number without a minus before zero; a dash where there is none."""
    return f"{round(value, decimals) + 0.0:.{decimals}f}" if math.isfinite(value) else "–"


def _leg(view: View, mech: Mechanism, leg: int) -> dict[str, Any]:
    low, high = (float(end) for end in mech.stroke[leg])
    length, force, level = float(view.lengths[leg]), float(view.forces[leg]), view.leg_levels[leg]
    bounded = math.isfinite(low) and math.isfinite(high)
    part = (length - low) / (high - low) if bounded else 0.0
    return {
        "name": mech.leg_names[leg],
        "color": color_of(leg),
        "at": 100.0 * min(max(part, 0.0), 1.0) if bounded else None,
        "shade": GREY if level is Level.FINE else LEVEL_COLORS[level],
        "length": factor(mech.drives[leg]) * length,
        "force": _fixed(force) if mech.actuated[leg] else "passive",
    }


def _screw(screw: Screw | None) -> str:
    if screw is None:
        return ""
    if math.isinf(screw.pitch):
        return "a translation"
    return f"a rotation about an axis, with {_fixed(1e3 * screw.pitch)} mm/rad along it"


def _range(name: str, low: float, high: float) -> dict[str, str]:
    factor, unit, _ = scaled(name)
    below, above = (_fixed(factor * end) if math.isfinite(end) else "none" for end in (low, high))
    return {"symbol": _SYMBOLS.get(name, name), "below": below, "above": above, "unit": unit}
