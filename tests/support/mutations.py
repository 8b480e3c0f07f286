"""Mechanism files with something wrong in them, as slips of hand, broken editors and hostile minds make them.

`mutated(number)` is the same file for a number every time. A third are changed as bytes, a third as text, a
third as parsed data; each gets one to three changes.
"""

from __future__ import annotations

import copy
import random
import re
import tomllib
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import tomli_w

import polypod as pp
from support import DATA as FILES
from support import ROOT

SEED = 70003


def words(text: str) -> tuple[str, ...]:
    return tuple(text.split())


FLOATS = words(
    "nan -nan inf -inf 0 -0 -0.0 1e400 -1e400 1e308 1e300 -1e300 1e155 1e100 1e-320 5e-324 1e-300 1e-200 "
    "1e-160 1e-100 1e-30 1e30 1e16 1e9 1e-9 -1"
)
HOSTILE_NUMBERS = (
    *FLOATS,
    *("9" * 400, "9" * 5000, "1" + "_0" * 30, "1 000", "12 mm"),
    *words("0x7fffffffffffffff 0b11 1__0 01 1. .5 1e +1 --1 9223372036854775807 9223372036854775808"),
    *words("0.1e-5_0 3,5 1/2 pi 1e5.0"),
)
LISTED_VALUES = """
"" | '' | true | false | [] | {} | [[]] | [{}] | [0] | [0, 0, 0] | [0, 0, 0, 0] | [1, 2] | {a = 1} | "nan"
| 1979-05-27 | 07:32:00 | 1979-05-27T07:32:00Z | "0" | '''x''' | ''' | 'S' | "s" | "mm" | [1, [2], 3] | None
| [true, false, true] | ["a", "b", "c"] | [nan, nan, nan] | [1e300, 1e300, 1e300] | [1e-300, 0, 0] | null
| yes | { radius = 1, angle = 2 } | { min = 2, max = 1 } | { min = 0, max = 0 } | "\\ud800" | "\\u0000"
| "a\\nb" | "ж\\U0001F600" | "\u202e"
"""
HOSTILE_VALUES = (
    *(value.strip() for value in LISTED_VALUES.split("|")),
    *("[" * 40 + "]" * 40, "[" * 5000 + "]" * 5000, "{a=" * 3000 + "1" + "}" * 3000),
    *('"' + "x" * 20_000 + '"', "[" + "1," * 3000 + "]", '"""'),
)
ODD_CHARACTERS = "\x00\x01\x7f\x85\u2028\u200b\ufeff\r\n\t \"'[]{}=.,#\\-+_éж\U0001f600\u0661"
TOKEN = re.compile(r"""[\w.+-]+|"[^"\n]*"|'[^'\n]*'|[\[\]{}=,#]""")
NUMBER = re.compile(r"(?<![\w.\"])[+-]?\d[\d.]*(?:e[+-]?\d+)?(?![\w\"])")

FACTORS = (*(1e-3, 1e3, 25.4, 1 / 25.4, 57.2957795, 0.0174532925), *(1e6, 1e-6, 1e12, 1e-12, 1e150, 1e-200))
LETTERS = ("S", "U", "R", "F", "P", "s", "UU", "")
KEYS = words(
    "name description source units length angle mass inertia force torque acceleration load home position "
    "rotation_vector platform center dynamics gravity efficiency axes linear_damping angular_damping tool "
    "point axis limits sigma_min clearance joint_reach published dof redundant passive rods range legs "
    "actuated stroke radius base cylinder piston joint normal rod cone min max z"
)
ODD_KEYS = ("", "Length", "lenght", "a.b", "a b", "é", "0", "<vector>", "legs.1", "__class__", 'x"y')
ODD_OBJECTS: tuple[Any, ...] = (
    *(
        None,
        True,
        False,
        "",
        "x",
        "nan",
        0,
        -1,
        1e300,
        1e-300,
        10**400,
        float("nan"),
        float("inf"),
        -0.0,
        1e155,
    ),
    *(
        [],
        {},
        [[]],
        [0, 0, 0],
        [1e-200, 0, 0],
        [1, 2],
        [1, 2, 3, 4],
        [[1, 0, 0]] * 3,
        [{}],
        {"min": 1, "max": 0},
    ),
    *(
        {"radius": -1, "angle": 0},
        {"angle": 0},
        {"angle": 1e300},
        ["a", "b", "c"],
        [None] * 3,
        [True] * 3,
        "\ud800",
    ),
)


class Case(NamedTuple):
    """One mutated file."""

    source: str
    """Inputs from which it was made."""
    changes: tuple[str, ...]
    content: bytes | str | dict[str, Any]
    """A file's bytes, a text, or what a text would hold."""


@cache
def sources() -> dict[str, str]:
    """Texts of all mechanism files there are, by name."""
    folders = (
        ROOT / "python" / "polypod" / "mechanisms",
        ROOT / "docs" / "mechanisms",
        FILES,
    )
    paths = [path for folder in folders for path in sorted(folder.glob("*.toml"))]
    paths.append(Path(pp.__file__).parent / "template.toml")
    return {f"{path.parent.name}/{path.name}": path.read_text(encoding="utf-8") for path in paths}


def mutated(number: int) -> Case:
    """The file of a number."""
    rng = random.Random(f"{SEED} {number}")
    source = rng.choice(list(sources()))
    text = sources()[source]
    level = ("bytes", "text", "data")[number % 3]
    table: tuple[Callable[..., Any], ...] = {"bytes": BYTES, "text": TEXT, "data": DATA}[level]
    chosen = [rng.choice(table) for _ in range(rng.choice((1, 1, 1, 2, 3)))]
    content: Any = {"bytes": text.encode(), "text": text, "data": None}[level]
    if level == "data":
        content = tomllib.loads(text)
    for change in chosen:
        content = change(rng, content) if content else content
    if level == "data" and rng.random() < 0.7:
        content = _written(content)
    return Case(source, tuple(change.__name__ for change in chosen), content)


def _written(data: dict[str, Any]) -> dict[str, Any] | str:
    """As a text, if it can be one."""
    try:
        return tomli_w.dumps(data)
    except (TypeError, ValueError):
        return data


# --- bytes --------------------------------------------------------------------------------------------------


def flip(rng: random.Random, b: bytes) -> bytes:
    at = rng.randrange(len(b))
    return b[:at] + bytes([b[at] ^ (1 << rng.randrange(8))]) + b[at + 1 :]


def delete_byte(rng: random.Random, b: bytes) -> bytes:
    at = rng.randrange(len(b))
    return b[:at] + b[at + 1 :]


def insert_byte(rng: random.Random, b: bytes) -> bytes:
    at = rng.randrange(len(b))
    return b[:at] + bytes([rng.randrange(256)]) + b[at:]


def insert_character(rng: random.Random, b: bytes) -> bytes:
    at = rng.randrange(len(b))
    return b[:at] + rng.choice(ODD_CHARACTERS).encode() + b[at:]


def truncate(rng: random.Random, b: bytes) -> bytes:
    return b[: rng.randrange(len(b))] or b"x"


def cut(rng: random.Random, b: bytes) -> bytes:
    at = rng.randrange(len(b))
    return b[:at] + b[at + rng.randrange(1, 60) :] or b"x"


def copy_piece(rng: random.Random, b: bytes) -> bytes:
    at, to = rng.randrange(len(b)), rng.randrange(len(b))
    return b[:to] + b[at : at + rng.randrange(1, 200)] + b[to:]


def other_encoding(rng: random.Random, b: bytes) -> bytes:
    text = b.decode(errors="replace")
    return text.encode(rng.choice(("utf-16", "utf-32", "latin-1", "utf-8-sig", "cp500")), errors="replace")


def line_ends(rng: random.Random, b: bytes) -> bytes:
    return b.replace(b"\n", rng.choice((b"\r\n", b"\r", b"\n\n", b"\x0c\n", b"\xc2\x85")))


def empty(rng: random.Random, b: bytes) -> bytes:
    return rng.choice(
        (b"", b"\n", b"\x00", b"\xef\xbb\xbf", b"# nothing", b"[[legs]]", b"legs = []", b"[home]")
    )


BYTES = (
    flip,
    flip,
    delete_byte,
    delete_byte,
    insert_byte,
    insert_character,
    truncate,
    cut,
    copy_piece,
) * 3 + (*(other_encoding, line_ends, empty),)


# --- text ---------------------------------------------------------------------------------------------------


def _at(pattern: re.Pattern[str], rng: random.Random, text: str, new: Callable[[str], str]) -> str:
    found = list(pattern.finditer(text))
    if not found:
        return text
    match = rng.choice(found)
    return text[: match.start()] + new(match[0]) + text[match.end() :]


def delete_line(rng: random.Random, text: str) -> str:
    lines = text.split("\n")
    del lines[rng.randrange(len(lines))]
    return "\n".join(lines)


def duplicate_line(rng: random.Random, text: str) -> str:
    lines = text.split("\n")
    lines.insert(rng.randrange(len(lines)), rng.choice(lines))
    return "\n".join(lines)


def swap_lines(rng: random.Random, text: str) -> str:
    lines = text.split("\n")
    i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    lines[i], lines[j] = lines[j], lines[i]
    return "\n".join(lines)


def delete_token(rng: random.Random, text: str) -> str:
    return _at(TOKEN, rng, text, lambda _: "")


def other_token(rng: random.Random, text: str) -> str:
    other = rng.choice(TOKEN.findall(text) or ["x"])
    return _at(TOKEN, rng, text, lambda _: other)


def double_token(rng: random.Random, text: str) -> str:
    return _at(TOKEN, rng, text, lambda token: f"{token} {token}")


def hostile_number(rng: random.Random, text: str) -> str:
    return _at(NUMBER, rng, text, lambda _: rng.choice(HOSTILE_NUMBERS))


def slip_of_digits(rng: random.Random, text: str) -> str:
    """A digit more, a digit less, a sign, a point elsewhere."""

    def slip(number: str) -> str:
        at = rng.randrange(len(number))
        digit = rng.choice("0123456789.-")
        return (
            rng.choice((number[:at] + number[at + 1 :], number[:at] + digit + number[at:], "-" + number))
            or "0"
        )

    return _at(NUMBER, rng, text, slip)


def other_number(rng: random.Random, text: str) -> str:
    other = rng.choice(NUMBER.findall(text) or ["1"])
    return _at(NUMBER, rng, text, lambda _: other)


def hostile_value(rng: random.Random, text: str) -> str:
    value = rng.choice(HOSTILE_VALUES)
    return _at(re.compile(r"(?<== )[^\n#]+"), rng, text, lambda _: value)


def second_table(rng: random.Random, text: str) -> str:
    return (
        text
        + "\n"
        + _at(re.compile(r".*"), rng, rng.choice(re.findall(r"^\[.*$", text, re.M) or ["[a]"]), str)
    )


def other_key(rng: random.Random, text: str) -> str:
    key = rng.choice((*KEYS, '""', '"a.b"', "a.b", "é", "units.length"))
    return _at(re.compile(r"[\w-]+(?= =)"), rng, text, lambda _: key)


def new_entry(rng: random.Random, text: str) -> str:
    lines = text.split("\n")
    lines.insert(
        rng.randrange(len(lines)), f"{rng.choice(KEYS)} = {rng.choice(HOSTILE_VALUES + HOSTILE_NUMBERS)}"
    )
    return "\n".join(lines)


def other_unit(rng: random.Random, text: str) -> str:
    units = (
        "m",
        "mm",
        "cm",
        "um",
        "in",
        "deg",
        "rad",
        "kg",
        "g",
        "lb",
        "kg m^2",
        "kg mm^2",
        "g mm^2",
        "N",
        "kN",
        "Nm",
        "µm",
    )
    return _at(re.compile(r'(?<== )"[^"\n]*"'), rng, text, lambda _: f'"{rng.choice(units)}"')


def repeated_legs(rng: random.Random, text: str) -> str:
    return text + "\n" + text[text.find("[[legs]]") :] * rng.choice((1, 1, 5))


TEXT = (
    *(delete_line, duplicate_line, swap_lines, delete_token, other_token, double_token, hostile_value),
    *(hostile_value, hostile_number, hostile_number, hostile_number, slip_of_digits, slip_of_digits),
    *(slip_of_digits, other_number, second_table, other_key, new_entry, other_unit, repeated_legs),
)


# --- parsed data --------------------------------------------------------------------------------------------


def _places(data: Any) -> Iterator[tuple[Any, Any]]:
    """Each container with each of its keys or positions."""
    entries = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in list(entries):
        yield data, key
        yield from _places(value)


def _some(
    rng: random.Random, data: Any, wanted: Callable[[Any], bool] = lambda _: True
) -> tuple[Any, Any] | None:
    found = [(holder, key) for holder, key in _places(data) if wanted(holder[key])]
    return rng.choice(found) if found else None


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _is_vector(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 3 and all(map(_is_number, value))


def _changed(
    name: str, wanted: Callable[[Any], bool], new: Callable[[random.Random, Any], Any]
) -> Callable[..., Any]:
    """A change of one value that is `wanted`."""

    def change(rng: random.Random, data: Any) -> Any:
        if place := _some(rng, data, wanted):
            holder, key = place
            holder[key] = new(rng, holder[key])
        return data

    change.__name__ = name
    return change


def drop(rng: random.Random, data: Any) -> Any:
    if place := _some(rng, data):
        del place[0][place[1]]
    return data


def duplicate(rng: random.Random, data: Any) -> Any:
    """A value once more, under another key or as another entry."""
    if place := _some(rng, data):
        holder, key = place
        if isinstance(holder, list):
            holder.insert(rng.randrange(len(holder) + 1), copy.deepcopy(holder[key]))
        else:
            holder[rng.choice(KEYS + ODD_KEYS)] = copy.deepcopy(holder[key])
    return data


def rename(rng: random.Random, data: Any) -> Any:
    if (place := _some(rng, data)) and isinstance(place[0], dict):
        place[0][rng.choice(KEYS + ODD_KEYS)] = place[0].pop(place[1])
    return data


def swap(rng: random.Random, data: Any) -> Any:
    """Two values of one kind."""
    if first := _some(rng, data):
        kind = type(first[0][first[1]])
        if second := _some(rng, data, lambda value: type(value) is kind):
            (a, i), (b, j) = first, second
            a[i], b[j] = copy.deepcopy(b[j]), copy.deepcopy(a[i])
    return data


def swap_legs(rng: random.Random, data: Any) -> Any:
    legs = data.get("legs")
    if isinstance(legs, list) and legs:
        i, j = rng.randrange(len(legs)), rng.randrange(len(legs))
        legs[i], legs[j] = legs[j], legs[i]
    return data


def ends_swapped(rng: random.Random, data: Any) -> Any:
    """Swaps the base and platform of a leg, or its cylinder and piston."""
    legs = data.get("legs")
    if isinstance(legs, list) and legs and isinstance(leg := rng.choice(legs), dict):
        a, b = rng.choice((("base", "platform"), ("cylinder", "piston")))
        if a in leg and b in leg:
            leg[a], leg[b] = leg[b], leg[a]
    return data


def scaled_all(rng: random.Random, data: Any) -> Any:
    """Every number of one key, as when a unit is wrong, or the whole mechanism far too large or small."""
    place = _some(rng, data, _is_number)
    if place is None:
        return data
    key, factor = place[1], rng.choice(FACTORS)
    lengths = ("point", "radius", "z", "position", "center", "stroke", "min", "max", "clearance")
    keys = rng.choice(((key,), lengths, (*KEYS,)))

    def walk(value: Any, inside: bool) -> Any:
        if isinstance(value, dict):
            return {k: walk(v, k in keys or (inside and k != "angle")) for k, v in value.items()}
        if isinstance(value, list):
            return [walk(v, inside) for v in value]
        # Integers from other changes may be too large for a factor.
        return value * factor if inside and _is_number(value) and abs(value) < 1e300 else value

    return walk(data, False)


def _turned(rng: random.Random, vector: list[float]) -> list[float]:
    size = rng.choice((1e-9, 1e-6, 1e-3, 0.1, 10.0))
    return [c + size * rng.uniform(-1, 1) for c in vector]


negate = _changed("negate", _is_number, lambda rng, x: -x)
zero = _changed("zero", _is_number, lambda rng, x: 0)
rescale = _changed("rescale", _is_number, lambda rng, x: x * rng.choice(FACTORS))
nudge = _changed(
    "nudge",
    _is_number,
    lambda rng, x: x * (1 + rng.choice((1e-12, 1e-9, 1e-6, 1e-3, 0.1)) * rng.uniform(-1, 1)),
)
huge = _changed("huge", _is_number, lambda rng, x: float(rng.choice(FLOATS)))
retype = _changed(
    "retype", lambda _: True, lambda rng, x: rng.choice((str(x), [x], {"a": x}, [x] * 3, True, None))
)
odd = _changed("odd", lambda _: True, lambda rng, x: copy.deepcopy(rng.choice(ODD_OBJECTS)))
move_axis = _changed("move_axis", _is_vector, _turned)
shuffle = _changed("shuffle", _is_vector, lambda rng, x: rng.sample(x, 3))
flatten = _changed("flatten", _is_vector, lambda rng, x: [0, 0, 0])
stretch = _changed("stretch", _is_vector, lambda rng, x: [c * rng.choice(FACTORS) for c in x])
letter = _changed("letter", lambda x: x in ("S", "U", "R", "F"), lambda rng, x: rng.choice(LETTERS))
truth = _changed("truth", lambda x: isinstance(x, bool), lambda rng, x: not x)
DATA = (
    *(drop, drop, duplicate, rename, swap, swap, swap_legs, ends_swapped, scaled_all, negate, negate),
    *(zero, zero, rescale, rescale, nudge, huge, huge, retype, odd, odd, move_axis, shuffle, flatten),
    *(stretch, letter, letter, truth),
)
