"""Answers of the installed polypod for random states of the built-in mechanisms; comparison to the last bit.

Before and after a change that must not alter any answer, or with two builds:

    python tools/answers.py record before.npz
    python tools/answers.py record after.npz --inputs before.npz
    python tools/answers.py compare before.npz after.npz

`record` draws states of every mechanism of `polypod.list_mechanisms()`, 10 000 in all, and asks everything of
them: poses about home, many of them at a limit, some out of stroke, off the constraints or not finite; with
twists, accelerations and loads. It takes about a minute. The states depend on the seed alone, but are made
with the product's own coordinates; they are kept in the file, and `--inputs` asks exactly those of another
file again.

`compare` prints a line for each array that differs, and how many agree to the last bit (NaN agrees with NaN).
A difference is relative: of a state by the largest number of its array, or by the median of these over all
states if that is larger. The exit status is 1 if anything differs. `--allow NAME=1e-12` lets real numbers
differ by so much where the mechanism, the operation or the field has that name, or where
`mechanism/operation/field` matches it as a pattern, such as `4-rpr/inverse_dynamics*`; statuses and counts
never may.

Only the public package and methods of `Mechanism` are used, so that builds with other modules can be
compared. Processes may be functions of the package or methods.
"""

from __future__ import annotations

import argparse
import sys
import time
import zipfile
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import polypod as pp

Array = NDArray[Any]
Inputs = dict[str, Array]
"""What a mechanism is asked, by name; states come first."""

STATES = 10_000
SEED = 18
FEW = 24
"""States of a mechanism for answers that are large or slow."""
ALONE = 4
"""States of a mechanism that are asked one by one, too, not as a batch."""
SLOW = ("2rpu-spr", "2upr-rpu", "linuxcnc-pentakins", "pentapod-5-spu", "pentapod-5-ups")
"""Mechanisms whose nearest singular poses take seconds, up to half a minute for one pose."""

SLICES = {"3-rps": ("z", "rx", "ry"), "4-rpr": ("x", "y", "rz")}
"""Coordinates of workspaces of machines with three degrees of freedom."""

LEVELS = (0.05, 0.25, 0.7)
"""How far poses are from home: shares of the mean leg length at home, and rad."""
SHARES = (0.55, 0.35, 0.1)
"""Parts of the states at these levels."""
BOUND = 0.3
"""Part of the states that are moved along their way from home to where the first limit binds."""
SPOILED = 0.06
"""Part of the states that are no sound input."""


# --- states -------------------------------------------------------------------------------------------------


def drawn(mech: pp.Mechanism, count: int, rng: np.random.Generator) -> Inputs:
    """Random inputs for everything that a mechanism is asked."""
    names = tuple(mech.equations_of_motion(mech.home, np.zeros(6), _set(mech)).coordinates)
    home = np.array([mech.coordinates(mech.home, _set(mech))[name] for name in names])
    lengths = mech.inverse_kinematics(mech.home).lengths
    reach = float(np.abs(lengths).mean())
    size = np.where([_is_angle(name) for name in names], 1.0, reach)

    level = rng.choice(LEVELS, size=(count, 1), p=SHARES)
    given = home + _bounded(mech, names, home, level * size * rng.normal(size=(count, len(names))), rng)
    rates, second_rates = size * rng.normal(size=(2, count, len(names)))
    state = mech.state(*(_named(names, a) for a in (given, rates, second_rates)))
    guess = mech.state(_named(names, given + 0.02 * size * rng.normal(size=given.shape))).pose
    pose, twist, acceleration = (np.array(a) for a in (state.pose, state.twist, state.acceleration))
    moving = mech.kinematics(pose, twist, acceleration)
    legs = [np.array(a) for a in (mech.inverse_kinematics(pose).lengths, moving.rates, moving.accelerations)]
    for array in (pose, twist, acceleration, *legs):
        _spoil(array, rng)
    return {
        "names": np.array(names),
        "coordinates": given,
        "coordinate_rates": rates,
        "coordinate_second_rates": second_rates,
        "pose": pose,
        "twist": twist,
        "acceleration": acceleration,
        "guess": guess,
        "lengths": legs[0],
        "rates": legs[1],
        "second_rates": legs[2],
        "wrench": rng.normal(size=(count, 6)) * ([1e3] * 3 + [1e2] * 3),
        "forces": 1e3 * rng.normal(size=(count, mech.n_legs)),
        "preferred": 1e3 * rng.normal(size=(count, mech.n_legs)),
        "constraint": 1e3 * rng.normal(size=(count, 6 - mech.dof)),
    }


def _set(mech: pp.Mechanism) -> str:
    return "natural" if "natural" in mech.coordinate_sets else "pose"


def _is_angle(name: str) -> bool:
    return name in ("rx", "ry", "rz", "alpha", "beta", "gamma")


def _named(names: Sequence[str], columns: Array) -> dict[str, Array]:
    return {str(name): columns[..., i] for i, name in enumerate(names)}


def _bounded(
    mech: pp.Mechanism, names: Sequence[str], home: Array, offset: Array, rng: np.random.Generator
) -> Array:
    """Offsets of which some end where a limit is passed, or just before or behind."""
    chosen = rng.random(len(offset)) < BOUND
    slack = 1.0 + rng.choice([-1e-2, -1e-9, 0.0, 1e-9, 1e-2], size=len(offset))
    inside, outside = np.zeros(len(offset)), np.full(len(offset), 4.0)

    def within(scale: Array) -> Array:
        return mech.limits(mech.pose(_named(names, home + scale[:, None] * offset))).within

    chosen &= within(inside) & ~within(outside)
    for _ in range(48):
        middle = 0.5 * (inside + outside)
        sound = within(middle)
        inside, outside = np.where(sound, middle, inside), np.where(sound, outside, middle)
    return np.where(chosen, slack * inside, 1.0)[:, None] * offset


def _spoil(array: Array, rng: np.random.Generator) -> None:
    """Makes some rows what they should not be: not finite, slightly off, or far off."""
    for row in np.flatnonzero(rng.random(len(array)) < SPOILED):
        flat = array[row].reshape(-1)
        match rng.integers(4):
            case 0:
                flat[rng.integers(flat.size)] = rng.choice([np.nan, np.inf, -np.inf])
            case 1:
                flat += 1e-8 * rng.normal(size=flat.size)
            case 2:
                flat += 0.1 * rng.normal(size=flat.size)
            case 3:
                flat *= 10.0


# --- questions ----------------------------------------------------------------------------------------------


class Question(NamedTuple):
    """Something to ask of a mechanism at states."""

    name: str
    ask: Callable[[pp.Mechanism, Inputs], Any]
    few: bool = False
    """Of the first states only."""
    alone: bool = False
    """One by one, too."""


def _motion(given: Inputs) -> tuple[Array, Array, Array]:
    return given["pose"], given["twist"], given["acceleration"]


def _state(mech: pp.Mechanism, given: Inputs, **how: Any) -> Any:
    series = ("coordinates", "coordinate_rates", "coordinate_second_rates")
    return mech.state(*(_named(given["names"], given[name]) for name in series), **how)


def _derivatives(mech: pp.Mechanism, given: Inputs) -> Any:
    return mech.inverse_dynamics_derivatives(*_motion(given), given["wrench"], set=_set(mech))


def _coupled(mech: pp.Mechanism, given: Inputs) -> Any:
    return mech.coupled_forces(given["pose"], given["constraint"])


QUESTIONS = (
    Question("state", _state, alone=True),
    Question("state other branch", partial(_state, branch=-1)),
    Question("state continued", partial(_state, continued=True), few=True),
    Question("inverse_kinematics", lambda m, x: m.inverse_kinematics(x["pose"]), alone=True),
    Question("jacobian", lambda m, x: m.jacobian(x["pose"]), alone=True),
    Question("hessian", lambda m, x: m.hessian(x["pose"]), alone=True),
    Question("kinematics", lambda m, x: m.kinematics(*_motion(x)), alone=True),
    Question("platform_twist", lambda m, x: m.platform_twist(x["pose"], x["rates"]), alone=True),
    Question(
        "platform_acceleration",
        lambda m, x: m.platform_acceleration(x["pose"], x["twist"], x["second_rates"]),
        alone=True,
    ),
    Question("conditioning", lambda m, x: m.conditioning(x["pose"]), alone=True),
    Question("determinant", lambda m, x: m.determinant(x["pose"], x["twist"]), alone=True),
    Question("singularity", lambda m, x: m.singularity(x["pose"]), alone=True),
    Question("singularity nearby", lambda m, x: m.singularity(x["pose"], tolerance=0.01)),
    Question("forward_kinematics", lambda m, x: m.forward_kinematics(x["lengths"], x["guess"]), alone=True),
    Question("forward_kinematics from home", lambda m, x: m.forward_kinematics(x["lengths"])),
    Question(
        "forward_kinematics continued",
        lambda m, x: m.forward_kinematics(x["lengths"], x["guess"], continued=True),
        few=True,
    ),
    Question("inverse_dynamics", lambda m, x: m.inverse_dynamics(*_motion(x)), alone=True),
    Question("inverse_dynamics loaded", lambda m, x: m.inverse_dynamics(*_motion(x), x["wrench"])),
    Question(
        "inverse_dynamics load on platform",
        lambda m, x: m.inverse_dynamics(*_motion(x), x["wrench"], "platform"),
    ),
    Question(
        "inverse_dynamics preferred",
        lambda m, x: m.inverse_dynamics(*_motion(x), preferred=x["preferred"]),
        alone=True,
    ),
    Question("power", lambda m, x: m.power(*_motion(x)), alone=True),
    Question("limits", lambda m, x: m.limits(x["pose"], x["wrench"]), alone=True),
    Question(
        "limits moving", lambda m, x: m.limits(x["pose"], twist=x["twist"], acceleration=x["acceleration"])
    ),
    Question("joint_reactions", lambda m, x: m.joint_reactions(*_motion(x), x["wrench"]), alone=True),
    Question(
        "forward_dynamics",
        lambda m, x: m.forward_dynamics(x["pose"], x["twist"], x["forces"], x["wrench"]),
        alone=True,
    ),
    Question("equations_of_motion", lambda m, x: m.equations_of_motion(x["pose"], x["twist"]), alone=True),
    Question(
        "equations_of_motion in coordinates",
        lambda m, x: m.equations_of_motion(x["pose"], x["twist"], _set(m)),
        alone=True,
    ),
    Question("coupled_forces", _coupled),
    Question("inverse_dynamics_derivatives", _derivatives, few=True, alone=True),
    Question("regressor", lambda m, x: m.regressor(*_motion(x)), few=True, alone=True),
)


def asked_once(mech: pp.Mechanism, given: Inputs) -> Iterator[tuple[str, Callable[[], Any]]]:
    """Questions that are not of a batch."""
    for name in mech.coordinate_sets:
        yield f"coordinates {name}", partial(mech.coordinates, given["pose"], name)
    for i in range(3):
        yield f"freedom_screws {i}", partial(mech.freedom_screws, given["pose"][i])
        yield f"constraint_screws {i}", partial(mech.constraint_screws, given["pose"][i])
    yield "home", lambda: {"pose": mech.home, "characteristic_length": mech.characteristic_length}
    if mech.name not in SLOW:
        yield "singularity_distance", partial(mech.singularity_distance, given["guess"][:4])
    yield "base_parameters", mech.base_parameters
    yield "assembly_modes", lambda: mech.assembly_modes(mech.inverse_kinematics(mech.home).lengths)
    sound = given["guess"][np.isfinite(given["guess"]).all(axis=(1, 2))][0]
    yield "simulate", partial(_process("simulate", mech), sound, until=0.02, step=0.01, stop=())
    if mech.name in ("lu-3spu-2rpu-r", "tsai-6-sps", "hexaglide"):
        yield "workspace", partial(_process("workspace", mech), step=0.25 * mech.characteristic_length)
    if mech.name in SLICES:
        yield "slice", partial(_process("workspace", mech), SLICES[mech.name], {}, step=0.05)
    if mech.name == "lu-3spu-2rpu-r":
        tilts = {"x": 0.0, "y": 0.1, "z": 0.7}
        yield "slice of tilts", partial(_process("workspace", mech), ["azimuth", "tilt"], tilts, step=0.1)
        yield "length_lattice", partial(_process("length_lattice", mech), step=0.1)
        motion = pp.load_motion("lu-3spu-2rpu-r", mech).sample(np.linspace(0.0, 8.0, 40))
        yield "solve", partial(pp.solve, mech, motion)


def _process(name: str, mech: pp.Mechanism) -> Callable[..., Any]:
    """A method of the mechanism, or a function of the package that takes it first."""
    return getattr(mech, name, None) or partial(getattr(pp, name), mech)


def arrays_of(answer: Any) -> dict[str, Array]:
    """All numbers of an answer by name."""
    if isinstance(answer, np.ndarray):
        return {"value": answer}
    if isinstance(answer, Mapping):
        parts: Mapping[str, Any] = answer
    elif isinstance(answer, pp.Solution):
        found = {str(name): column.values for name, column in answer.dataset.variables.items()}
        parts = found | {f"attribute {k}": answer.dataset.attrs.get(k, "") for k in ("singularities", "end")}
    else:
        parts = vars(answer)
    arrays = {}
    for name, value in parts.items():
        if isinstance(value, Mapping):
            inner = arrays_of(value)
            arrays |= {f"{name} {key}": array for key, array in inner.items()}
        elif isinstance(value, np.ndarray | np.generic | float | int) or name.startswith("attribute "):
            array = np.asarray(value)
            if array.dtype.kind in "biufU":
                arrays[name] = array
    return arrays


def answered(ask: Callable[[], Any]) -> dict[str, Array]:
    """The numbers of an answer, or the name of the error that it ends with."""
    try:
        return arrays_of(ask())
    except pp.PolypodError as error:
        return {"error": np.array(type(error).__name__)}


def answers(mech: pp.Mechanism, given: Inputs) -> Iterator[tuple[str, dict[str, Array]]]:
    """Operation and its arrays."""
    first = {name: array if name == "names" else array[:FEW] for name, array in given.items()}
    for question in QUESTIONS:
        yield question.name, answered(partial(question.ask, mech, first if question.few else given))
        for i in range(ALONE if question.alone else 0):
            single = {name: array if name == "names" else array[i] for name, array in given.items()}
            yield f"{question.name} alone {i}", answered(partial(question.ask, mech, single))
    for name, ask in asked_once(mech, given):
        yield name, answered(ask)


# --- files --------------------------------------------------------------------------------------------------


def record(out: Path, states: int, seed: int, inputs: Path | None) -> None:
    """Writes inputs and answers of the whole catalogue."""
    known = read(inputs, "in") if inputs else None
    names = pp.list_mechanisms()
    start = time.perf_counter()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:

        def write(key: str, array: Array) -> None:
            with archive.open(f"{key}.npy", "w", force_zip64=True) as file:
                np.lib.format.write_array(file, np.asarray(array), allow_pickle=False)

        for i, name in enumerate(names):
            mech = pp.load(name)
            if known is None:
                count = states // len(names) + (i < states % len(names))
                given = drawn(mech, max(count, ALONE), np.random.default_rng([seed, i]))
            elif name in known:
                given = {key[0]: array for key, array in known[name].items()}
            else:
                print(f"{name}: not in {inputs}")
                continue
            for key, array in given.items():
                write(f"in/{name}/{key}", array)
            statuses: dict[int, int] = defaultdict(int)
            for operation, arrays in answers(mech, given):
                for field, array in arrays.items():
                    write(f"out/{name}/{operation}/{field}", array)
                if operation == "inverse_dynamics":
                    for code in arrays.get("status", np.empty(0, dtype=np.uint8)):
                        statuses[int(code)] += 1
            said = ", ".join(f"{n} {pp.Status(code).name}" for code, n in sorted(statuses.items()))
            print(f"{name}: {len(given['pose'])} states: {said}", flush=True)
    print(f"{out}: {out.stat().st_size / 1e6:.0f} MB in {time.perf_counter() - start:.0f} s")


def read(path: Path, part: str) -> dict[str, dict[tuple[str, ...], Array]]:
    """The arrays of a file's inputs ("in") or answers ("out"): by mechanism, then by (operation,) name."""
    found: dict[str, dict[tuple[str, ...], Array]] = defaultdict(dict)
    with np.load(path, allow_pickle=False) as file:
        for key in file.files:
            kind, mechanism, *rest = key.split("/")
            if kind == part:
                found[mechanism][tuple(rest)] = file[key]
    return found


# --- comparison ---------------------------------------------------------------------------------------------


def differing(a: Array, b: Array) -> NDArray[np.bool_]:
    """Which numbers are not the same bits; NaN are all the same."""
    if a.dtype.kind != "f":
        return np.asarray(a != b)
    unlike = a.view(np.uint64) != b.view(np.uint64) if a.dtype == np.float64 else a != b
    return np.asarray(unlike & ~(np.isnan(a) & np.isnan(b)))


def difference(a: Array, b: Array) -> float:
    """The largest relative difference of arrays of one shape: see the head of this file."""
    rows = (1, -1) if a.ndim == 0 else (len(a), -1)
    a, b = a.reshape(rows), b.reshape(rows)
    unlike = differing(a, b)
    if not unlike.any():
        return 0.0
    if not (np.isfinite(a) & np.isfinite(b))[unlike].all():
        return float("inf")
    sizes = np.where(np.isfinite(a), np.abs(a), 0.0).max(axis=1)
    scale = np.maximum(sizes, np.median(sizes[sizes > 0.0]) if (sizes > 0.0).any() else 1.0)
    off = np.where(unlike, np.abs(np.where(unlike, a, 0.0) - np.where(unlike, b, 0.0)), 0.0).max(axis=1)
    return float((off / scale).max())


def allowed(allowances: Mapping[str, float], *place: str) -> float:
    """What real numbers of a mechanism, operation and field may differ by."""
    path = "/".join(place)
    fits = (most for name, most in allowances.items() if name in place or fnmatchcase(path, name))
    return max(fits, default=0.0)


def compare(first: Path, second: Path, allowances: Mapping[str, float]) -> bool:
    """Prints what differs; whether nothing does beyond what is allowed."""
    sound = True

    def tell(place: str, text: str, fine: bool = False) -> None:
        nonlocal sound
        sound &= fine
        print(f"{place}: {text}{' (allowed)' if fine else ''}")

    a_in, b_in = read(first, "in"), read(second, "in")
    a_out, b_out = read(first, "out"), read(second, "out")
    same = total = 0
    for mechanism in sorted(a_out.keys() | b_out.keys()):
        if (mechanism in a_out) != (mechanism in b_out):
            tell(mechanism, f"only in {first if mechanism in a_out else second}")
            continue
        for key in sorted(a_in[mechanism].keys() | b_in[mechanism].keys()):
            pair = a_in[mechanism].get(key), b_in[mechanism].get(key)
            if pair[0] is None or pair[1] is None or not _alike(*pair) or differing(*pair).any():
                tell(mechanism, f"inputs differ ({key[0]}): record one with --inputs of the other")
        a, b = a_out[mechanism], b_out[mechanism]
        for operation in dict.fromkeys([key[0] for key in (*a, *b)]):
            place = f"{mechanism}: {operation}"
            for field in dict.fromkeys(key[1] for key in (*a, *b) if key[0] == operation):
                total += 1
                x, y = a.get((operation, field)), b.get((operation, field))
                if x is None or y is None:
                    tell(place, f"{field} only in {first if y is None else second}")
                elif not _alike(x, y):
                    tell(place, f"{field} was {x.dtype} {x.shape}, is {y.dtype} {y.shape}")
                elif not differing(x, y).any():
                    same += 1
                elif x.dtype.kind == "f":
                    off, count = difference(x, y), int(differing(x, y).sum())
                    most = allowed(allowances, mechanism, operation, field)
                    tell(place, f"{field} differs by {off:.2g} ({count} of {x.size})", off <= most)
                else:
                    tell(
                        place,
                        f"{field} changed in {int(differing(x, y).sum())} of {x.size}: {_changes(x, y)}",
                    )
    print(f"{same} of {total} arrays of {len(a_out)} mechanisms agree to the last bit")
    return sound


def _alike(a: Array, b: Array) -> bool:
    return a.shape == b.shape and (a.dtype == b.dtype or {a.dtype.kind, b.dtype.kind} == {"U"})


def _changes(a: Array, b: Array) -> str:
    """Such as 3 times 0 → 4."""
    unlike = differing(a, b)
    pairs, counts = np.unique(np.stack([a[unlike], b[unlike]]), axis=1, return_counts=True)
    shown = [f"{n} times {x} → {y}" for (x, y), n in zip(pairs.T[:5], counts, strict=False)]
    return ", ".join(shown)[:400]


# --- command line -------------------------------------------------------------------------------------------


def _allowance(text: str) -> tuple[str, float]:
    name, _, most = text.rpartition("=")
    return name, float(most)


def main() -> int:
    """Records or compares."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", required=True)
    recording = commands.add_parser("record", help="ask everything and write it to a file")
    recording.add_argument("out", type=Path)
    recording.add_argument("--states", type=int, default=STATES, help="in all mechanisms together")
    recording.add_argument("--seed", type=int, default=SEED)
    recording.add_argument("--inputs", type=Path, help="a file whose inputs are asked again")
    comparing = commands.add_parser("compare", help="compare two files")
    comparing.add_argument("first", type=Path)
    comparing.add_argument("second", type=Path)
    comparing.add_argument("--allow", type=_allowance, action="append", default=[], metavar="NAME=MOST")
    given = parser.parse_args()
    if given.command == "record":
        record(given.out, given.states, given.seed, given.inputs)
        return 0
    return 0 if compare(given.first, given.second, dict(given.allow)) else 1


if __name__ == "__main__":
    sys.exit(main())
