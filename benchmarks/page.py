"""The page docs/performance.md: tables and the figure from results, where its text leaves room for them."""

import re

import matplotlib.pyplot as plt

from polypod.bodies.palette import GREY, INK, PALETTE
from polypod.plots.style import DASHES, house_style

COMPARED = 100_000
CACHED = 1000
"""States whose arrays stay in the core's own cache."""
NAMES = {
    "inverse_dynamics": "inverse dynamics",
    "inverse_dynamics_from_coordinates": "inverse dynamics from coordinates",
    "inverse_kinematics": "inverse kinematics",
    "jacobian": "Jacobian",
    "kinematics": "kinematics of all links",
    "forward_kinematics": "forward kinematics, near guess",
    "forward_dynamics": "forward dynamics",
    "limits": "all limits",
}


def write(results, docs):
    """Fills the page between `<!-- measured: name -->` and `<!-- end -->`, and draws the figure."""
    path = docs / "performance.md"
    path.write_text(filled(path.read_text(encoding="utf-8"), results), encoding="utf-8")
    draw(results, docs / "images" / "performance.svg")


def filled(text, results):
    """The text of the page with the tables of these results."""

    def place(found):
        table = TABLES[found[1]](results)
        return f"<!-- measured: {found[1]} -->\n{table}<!-- end -->"

    return re.sub(r"<!-- measured: ([a-z ]+) -->\n.*?<!-- end -->", place, text, flags=re.DOTALL)


def table(head, rows):
    lines = [head, ["---"] * len(head), *rows]
    return "\n" + "".join(f"| {' | '.join(map(str, line))} |\n" for line in lines) + "\n"


def time(nanoseconds):
    """With three digits and a unit."""
    for unit, size in (("s", 1e9), ("ms", 1e6), ("µs", 1e3)):
        if nanoseconds >= 0.9995 * size:
            return f"{digits(nanoseconds / size)} {unit}"
    return f"{digits(nanoseconds)} ns"


def digits(number, count=3):
    """Rounded to so many digits, without an exponent."""
    whole = f"{number:.{count}g}"
    return f"{float(whole):,.0f}" if "e" in whole or float(whole) >= 10 ** (count - 1) else whole


def spread(row):
    return f"{time(row['low'])} to {time(row['high'])}"


def megabytes(size):
    return f"{digits(size / 2**20)} MiB"


def machine_table(results):
    m = results["machine"]
    packages = ", ".join(f"{name} {v}" for name, v in m["packages"].items() if v)
    rows = [
        ("processor", f"{m['processor']}, {m['cores']} cores, cache {m['cache']}, {m['architecture']}"),
        ("instructions", ", ".join(m["instructions"])),
        ("memory", f"{m['memory'] / 2**30:.0f} GiB"),
        ("system", f"{m['system']}; Python {m['python']}; {m['rust']}"),
        ("packages", packages),
        ("measured", f"{m['date']}, load at the start {m['load']:.1f}"),
    ]
    return table(("", ""), rows)


def comparison_table(results):
    rows, last = [], None
    for row in results["comparison"]:
        task = NAMES.get(row["task"], "") if row["task"] != last else ""
        last = row["task"]
        if "refused" in row:
            rows.append((task, row["name"], f"not timed: {row['refused']}", "", "", "", ""))
            continue
        same = f"{row['difference']:.0e} of {row['tolerance']:.0e}" if "difference" in row else ""
        name = row["name"] + (f", {row['note']}" if "note" in row else "")
        ratio = digits(row["ratio"], 2) if row["name"] != "Polypod" else "1"
        rows.append((task, name, time(row["median"]), spread(row), ratio, f"{row['states']:,}", same))
    return table(("", "", "per state", "quartiles", "ratio", "states", "difference, tolerance"), rows)


def operations_table(results):
    found = {(row["operation"], row["threads"], row["states"]): row for row in results["curves"]}
    rows = []
    for name, title in NAMES.items():
        single, one, two = (found.get((name, *key)) for key in ((1, 1), (1, COMPARED), (2, COMPARED)))
        if one is None:
            continue
        rows.append(
            (
                title,
                time(single["median"]),
                time(one["median"]),
                spread(one),
                time(two["median"]) if two else "",
                digits(one["median"] / two["median"], 2) if two else "",
            )
        )
    return table(("", "one state", f"of {COMPARED:,}", "quartiles", "two threads", "faster"), rows)


def floors_table(results):
    """Beside the times what arithmetic, divisions and memory would take alone."""
    flops = results["flops"]
    fused, separate, divisions, roots = (
        flops[f"{kind}_per_second"] for kind in ("fused_flops", "separate_flops", "divisions", "roots")
    )
    peak, moved = max(fused, separate), results["bandwidth"]["bytes_per_second"]
    found = {(row["operation"], row["threads"], row["states"]): row for row in results["curves"]}
    rows = []
    for name, title in NAMES.items():
        many, cached = (found.get((name, 1, states)) for states in (COMPARED, CACHED))
        if many is None:
            continue
        counted, arithmetic = flops["per_state"].get(name), ("",) * 5
        # A Newton step is no state: its flops say nothing about the time of an iteration of several.
        if counted is not None and name != "forward_kinematics":
            slow = counted["div"] / divisions + counted["sqrt"] / roots
            arithmetic = (
                f"{counted['flops']:,}",
                time(1e9 * counted["flops"] / peak),
                f"{1e9 * counted['flops'] / many['median'] / peak:.0%}",
                f"{counted['div']} and {counted['sqrt']}",
                time(1e9 * slow),
            )
        copied = f"{many['bytes']:,.0f}", time(1e9 * many["bytes"] / moved)
        rows.append((title, time(many["median"]), time(cached["median"]), *arithmetic, *copied))
    head = (
        *("", f"of {COMPARED:,}", f"of {CACHED:,}", "flops", "at the peak", "share"),
        *("divisions, roots", "alone", "bytes", "to copy them"),
    )
    peaks = (
        f"Peak of the core: {digits(fused / 1e9)} Gflop/s with fused multiplications and additions, "
        f"{digits(separate / 1e9)} with separate ones, {digits(divisions / 1e9)} with divisions, "
        f"{digits(roots / 1e9)} with square roots. It copies {digits(moved / 1e9)} GB/s, read and "
        "written.\n\n"
    )
    return table(head, rows) + peaks


def instruction_sets_table(results):
    found = {(row["operation"], row["instructions"]): row for row in results["instruction_sets"]}
    sets = list(dict.fromkeys(name for _, name in found))
    if not sets:
        return ""
    rows = [
        (title, *(time(found[task, name]["median"]) for name in sets))
        for task, title in NAMES.items()
        if (task, sets[0]) in found
    ]
    return table((f"per state of {COMPARED:,}", *sets), rows)


def rust_table(results):
    rows = [(row["operation"], time(row["median"]), spread(row)) for row in results["rust"]]
    return table(("", "one state", "quartiles"), rows)


def memory_table(results):
    rows = [
        (
            NAMES[row["operation"]],
            f"{row['states']:,}",
            megabytes(row["peak"]),
            megabytes(row["output"]),
            megabytes(max(row["peak"] - row["output"], 0)),
        )
        for row in results["memory"]
    ]
    return table(("", "states", "peak", "of it output", "the rest"), rows)


def workspaces_table(results):
    rows = [
        (
            row["what"],
            time(1e9 * row["seconds"]) if row["seconds"] else "not waited for",
            megabytes(row["peak"]) if row["peak"] else "",
        )
        for row in results["workspaces"]
    ]
    return table(("", "time", "peak of the process"), rows)


def actuation_table(results):
    rows, last = [], None
    for row in results["actuation"]:
        machine = f"{row['mechanism']}: {row['legs']} legs" if row["mechanism"] != last else ""
        last = row["mechanism"]
        name = NAMES.get(row["operation"], row["operation"].replace("_", " "))
        redundant, square = (time(row[kind]["median"]) for kind in ("redundant", "square"))
        rows.append((machine, name, redundant, square, digits(row["ratio"], 2)))
    return table(("", "", "redundant", "just enough", "ratio"), rows)


def start_table(results):
    found = results["start"]
    rows = [(f"`{row['what']}`", f"{time(1e9 * row['median'])}", spread_of(row)) for row in found["commands"]]
    if "build" in found:
        build = found["build"]
        rows.append((f"{build['what']}, {build['cores']} cores", time(1e9 * build["seconds"]), ""))
    return table(("", "time", "quartiles"), rows)


def long_files_table(results):
    rows = [
        (
            f"`polypod {row['what']}`, {row['rows']} rows",
            time(1e9 * row["seconds"]),
            time(1e9 * row["least"]),
            digits(row["ratio"], 2),
            f"{row['peak'] / 1e9:.1f} GB",
        )
        for row in results["long_files"]
    ]
    return table(("", "the command", "the least", "ratio", "peak of the process"), rows)


def spread_of(row):
    return f"{time(1e9 * row['low'])} to {time(1e9 * row['high'])}"


TABLES = {
    "machine": machine_table,
    "comparison": comparison_table,
    "operations": operations_table,
    "floors": floors_table,
    "instruction sets": instruction_sets_table,
    "rust": rust_table,
    "memory": memory_table,
    "workspaces": workspaces_table,
    "actuation": actuation_table,
    "start": start_table,
    "long files": long_files_table,
}


def draw(results, path):
    """Time per state over the number of states, with other ways to inverse dynamics as points."""
    with house_style():
        figure, axes = plt.subplots(figsize=(7.0, 3.9), layout="constrained")
        for (name, title), color in zip(NAMES.items(), (*PALETTE, GREY), strict=True):
            for threads, dash in ((1, "-"), (2, DASHES[2])):
                curve = [r for r in results["curves"] if (r["operation"], r["threads"]) == (name, threads)]
                if not curve:
                    continue
                x, y = [r["states"] for r in curve], [r["median"] for r in curve]
                axes.plot(x, y, color=color, ls=dash, label=title if threads == 1 else None)
                axes.fill_between(
                    x,
                    [r["low"] for r in curve],
                    [r["high"] for r in curve],
                    color=color,
                    alpha=0.15,
                    lw=0,
                )
        for row in results["comparison"]:
            if row["task"] == "inverse_dynamics" and row["name"] != "Polypod" and "median" in row:
                axes.plot(row["states"], row["median"], "o", color=INK, ms=3.5)
                axes.annotate(
                    row["name"],
                    (row["states"], row["median"]),
                    (5, 3),
                    textcoords="offset points",
                    fontsize=7,
                    bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.4},
                )
        axes.set(xscale="log", yscale="log", xlabel="states in a call", ylabel="time per state / ns")
        axes.set_title("Dotted: two threads. Points: other ways to inverse dynamics.")
        figure.legend(loc="outside right center")
        figure.savefig(path, metadata={"Date": None})
        plt.close(figure)
