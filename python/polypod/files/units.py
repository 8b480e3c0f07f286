"""The units that files may use, and their way to SI. Inside Polypod everything is SI and radians."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from polypod.errors import Fault, UnknownNameError, alternatives, place_of, shown

Value = TypeVar("Value", float, NDArray[np.float64])

# kind → unit → (n, d), one unit being n/d of the SI unit, which comes first. The pair keeps both numbers
# exact, so that 270 mm becomes the very 0.27 that one would write in metres.
UNITS: dict[str, dict[str, tuple[float, float]]] = {
    "length": {"m": (1, 1), "mm": (1, 1000), "cm": (1, 100), "um": (1, 10**6), "in": (127, 5000)},
    "angle": {"rad": (1, 1), "deg": (math.pi, 180), "mrad": (1, 1000)},
    "time": {"s": (1, 1), "ms": (1, 1000), "us": (1, 10**6), "ns": (1, 10**9)},
    "mass": {"kg": (1, 1), "g": (1, 1000), "lb": (45359237, 10**8)},
    "inertia": {"kg m^2": (1, 1), "kg mm^2": (1, 10**6), "g mm^2": (1, 10**9)},
    "force": {"N": (1, 1), "kN": (1000, 1), "mN": (1, 1000)},
    "torque": {"N m": (1, 1), "N mm": (1, 1000), "kN m": (1000, 1)},
    "acceleration": {"m/s^2": (1, 1), "mm/s^2": (1, 1000)},
}
MECHANISM_KINDS = ("length", "angle", "mass", "inertia", "force", "torque", "acceleration")
MOTION_KINDS = ("time", "length", "angle", "force", "torque")

SHOWN: dict[str, tuple[float, str]] = {
    "length": (1e3, "mm"),
    "angle": (180 / math.pi, "deg"),
    "force": (1.0, "N"),
    "torque": (1.0, "N m"),
}
"""Units that people read quantities in, and the factors to them from SI, by kind."""


_NUMBER = r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?"
"""As messages of the core write numbers."""

_SPELLINGS = {
    "s": ("sec", "secs", "second", "seconds"),
    "ms": ("msec", "millisecond", "milliseconds"),
    "us": ("µs", "μs", "usec", "microsecond", "microseconds"),
    "ns": ("nsec", "nanosecond", "nanoseconds"),
    "m": ("meter", "meters", "metre", "metres"),
    "mm": ("millimeter", "millimeters", "millimetre", "millimetres"),
    "um": ("µm", "μm", "micron", "microns"),
    "in": ("inch", "inches", '"'),
    "rad": ("radian", "radians"),
    "deg": ("°", "degree", "degrees"),
    "N": ("newton", "newtons"),
    "kg": ("kilogram", "kilograms"),
}
"""Other ways to write a unit."""


def valid_units(unit: str, kind: str) -> str:
    """The end of a message about an unknown unit: the same unit, if written otherwise, then all valid ones.

    Units that only look alike are not proposed: a radian for a milliradian is wrong by a factor of 1000.
    """

    def plain(text: str) -> str:
        return "".join(char for char in text.casefold() if char not in " .*·^²")

    valid = UNITS[kind]
    meant = [name for name in valid if plain(unit) in {plain(name), *map(plain, _SPELLINGS.get(name, ()))}]
    hint = f"did you mean {shown(meant[0])}? " if len(meant) == 1 else ""
    return f"{hint}valid: {', '.join(valid)}"


KIND_OF_COORDINATE: dict[str, str | None] = {
    **dict.fromkeys(("x", "y", "z", "p", "h", "tip_x", "tip_y", "tip_z"), "length"),
    **dict.fromkeys(("alpha", "beta", "gamma", "rx", "ry", "rz", "turn"), "angle"),
    **dict.fromkeys(("axis_x", "axis_y", "axis_z")),  # a direction of any length, without unit
}


def coordinate_unit(name: str) -> str:
    """The SI unit of a coordinate, 1 for one without; those of no coordinate set are angles."""
    kind = KIND_OF_COORDINATE.get(name, "angle")
    return "1" if kind is None else si_unit(kind)


def si_unit(kind: str) -> str:
    """The SI unit of a kind of quantity."""
    return next(iter(UNITS[kind]))


def to_si(value: Value, kind: str, unit: str) -> Value:
    """`value`, a number or an array in `unit`, in SI.

    Raises UnknownNameError for a unit that is not of this kind.
    """
    n, d = _ratio(kind, unit)
    return value * n / d


def in_units(text: str, units: object) -> str:
    """A message whose lengths, angles and masses are in SI, with these in the units of a file.

    `units` is the file's table by kind, whatever it holds: what is no unit of its kind stays in SI. Numbers
    keep their precision; what stands in quotes is a name and is left alone.
    """
    table = units if isinstance(units, Mapping) else {}
    parts = re.split(r'("[^"]*")', text)
    for kind in ("length", "angle", "mass"):
        unit = table.get(kind)
        if not isinstance(unit, str) or unit not in UNITS[kind]:
            continue
        quantity = re.compile(rf"(\[[^\]]*\]|\([^()]*\)|{_NUMBER}) {si_unit(kind)}(?![\w/^]| m\^)")

        def converted(found: re.Match[str], kind: str = kind, unit: str = unit) -> str:
            return re.sub(_NUMBER, lambda one: _rewritten(one[0], kind, unit), found[1]) + f" {unit}"

        parts[::2] = [quantity.sub(converted, part) for part in parts[::2]]
    return "".join(parts)


def _rewritten(number: str, kind: str, unit: str) -> str:
    """A written number of SI in another unit, as precise."""
    value = from_si(float(number), kind, unit)
    if "e" in number:
        return f"{value:.{sum(char.isdigit() for char in number.split('e')[0])}g}"
    n, d = _ratio(kind, unit)
    decimals = len(number.partition(".")[2]) - round(math.log10(d / n))
    return f"{value:.{max(decimals, 0)}f}"


def from_si(value: Value, kind: str, unit: str) -> Value:
    """The inverse of `to_si`, up to rounding."""
    n, d = _ratio(kind, unit)
    return value * d / n


def readable(value: float, unit: str) -> str:
    """A number in SI as people read it: in mm, deg, N, N m or as it is."""
    factor, name = next((shown for kind, shown in SHOWN.items() if si_unit(kind) == unit), (1.0, ""))
    return f"{factor * value:.1f} {name}" if name else f"{value:.3g}"


UNIX_TIMES = (1e8, 1e11)
"""Times in s that count as Unix times: from 1973 on."""


def instant(time: float, digits: int = 6) -> str:
    """A time as people read it, with its unit; one since 1970 as a date."""
    if not UNIX_TIMES[0] <= time < UNIX_TIMES[1]:
        return f"{time:.{digits}g} s"
    return datetime.fromtimestamp(time, UTC).isoformat(" ", "milliseconds").replace("+00:00", " UTC")


def cos_sin(angle: float, unit: str) -> tuple[float, float]:
    """Cosine and sine; from degrees exact at multiples of 90 and exactly symmetric about them."""
    if unit != "deg":
        angle = to_si(angle, "angle", unit)
        return math.cos(angle), math.sin(angle)
    quarters = round(angle / 90)
    rest = math.radians(angle - 90 * quarters)
    c, s = math.cos(rest), math.sin(rest)
    return [(c, s), (0.0 - s, c), (-c, 0.0 - s), (s, -c)][quarters % 4]  # 0.0 - s: never -0.0


def _ratio(kind: str, unit: str) -> tuple[float, float]:
    if unit not in UNITS[kind]:
        raise UnknownNameError(f"unit of {kind}", unit, UNITS[kind])
    return UNITS[kind][unit]


@dataclass(frozen=True)
class Units:
    """A file's choice of units, kind → unit; SI where it makes none."""

    chosen: dict[str, str]

    def of(self, kind: str) -> str:
        """The unit of a kind."""
        return self.chosen.get(kind, si_unit(kind))

    def si(self, value: Value, kind: str) -> Value:
        """A number or an array of the file in SI."""
        return to_si(value, kind, self.of(kind))

    def vector(self, values: Iterable[float], kind: str) -> list[float]:
        """Numbers of the file in SI."""
        return [self.si(value, kind) for value in values]


def read_units(table: object, used: Collection[str], kinds: Collection[str]) -> tuple[Units, list[Fault]]:
    """A file's `[units]` and what is wrong with it; kinds that are wrong or missing fall back to SI.

    `used` are the kinds of quantity in the file, which need a unit; `kinds` those that may have one.
    """
    if not isinstance(table, dict):
        return Units({}), [Fault("units", f'is {shown(table)}; must be a table such as length = "mm"')]
    chosen, faults = {}, []
    for kind, unit in table.items():
        if kind not in kinds:
            faults.append(
                Fault(place_of("units", kind), f"is no kind of quantity here; {alternatives(kind, kinds)}")
            )
        elif not isinstance(unit, str) or unit not in UNITS[kind]:
            faults.append(Fault(f"units.{kind}", f"is {shown(unit)}; {valid_units(str(unit), kind)}"))
        else:
            chosen[kind] = unit
    for kind in kinds:
        if kind in used and kind not in table:
            faults.append(Fault(f"units.{kind}", f"is missing; {valid_units('', kind)}"))
    return Units(chosen), faults
