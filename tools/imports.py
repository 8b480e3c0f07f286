"""The import graph of both languages: rooms, circles of imports, and imports that climb.

A room is a folder (or a file of its own) right under the root of the sources. `python tools/imports.py` fails
where files or rooms import one another in a circle, or where a room imports one that is listed after it:
`lib.rs` declares the Rust rooms from the ground up, and the docstring of the package lists the Python ones.
Imports inside functions and for type checkers count as well. `--graph` prints who imports whom.
"""

from __future__ import annotations

import argparse
import ast
import re
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

Graph = dict[str, set[str]]
"""File, or room, to those that it imports."""


def python_files(root: Path) -> Graph:
    """Imports between the files of a Python package; a package is its `__init__.py`."""
    package = root.name
    files = {_dotted(path, root): path for path in sorted(root.rglob("*.py[i]")) + sorted(root.rglob("*.py"))}

    def resolved(name: str) -> str | None:
        """The file of a module, or of the module that a name stands in."""
        while name and name not in files:
            name = name.rpartition(".")[0]
        return name or None

    def imported(path: Path) -> Iterator[str]:
        here = _dotted(path, root).split(".")
        parent = here if path.name == "__init__.py" else here[:-1]
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                yield from (alias.name for alias in node.names)
            elif isinstance(node, ast.ImportFrom):
                up = parent[: len(parent) - node.level + 1] if node.level else []
                base = ".".join([*up, *filter(None, [node.module])])
                yield from (f"{base}.{alias.name}" for alias in node.names)

    graph: Graph = {}
    for path in files.values():
        names = (resolved(name) for name in imported(path) if name.split(".")[0] == package)
        graph[_key(path, root)] = {_key(files[name], root) for name in names if name} - {_key(path, root)}
    return graph


def _dotted(path: Path, root: Path) -> str:
    parts = path.relative_to(root.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _key(path: Path, root: Path) -> str:
    return path.relative_to(root).as_posix()


def rust_files(root: Path) -> Graph:
    """Imports between the files of a Rust crate, from every path that begins with `crate` or `super`."""
    files = {_module(path, root): path for path in root.rglob("*.rs") if path.name != "lib.rs"}
    graph: Graph = {}
    for module, path in files.items():
        found = set()
        for name in _rust_paths(path.read_text(), module):
            while name and name not in files:
                name = name[:-1]
            if name:
                found.add(_key(files[name], root))
        graph[_key(path, root)] = found - {_key(path, root)}
    return graph


def _module(path: Path, root: Path) -> tuple[str, ...]:
    parts = path.relative_to(root).with_suffix("").parts
    return parts[:-1] if parts[-1] == "mod" else parts


def _rust_paths(text: str, module: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    """Full paths that a file names, outside its tests and comments."""
    text = re.split(r"^#\[cfg\(test\)\]\nmod tests", text, maxsplit=1, flags=re.MULTILINE)[0]
    text = re.sub(r"//.*", "", text)
    for start, rest in re.findall(r"\b(crate|super)\s*::\s*(\{[^;]*\}\s*;|[\w:]+(?:::\{[^;]*\}\s*;)?)", text):
        base = () if start == "crate" else module[:-1]
        for path in _tree(rest.strip().rstrip(";").strip()):
            yield base + path


def _tree(text: str) -> Iterator[tuple[str, ...]]:
    """The paths of a `use` tree: `a::{b, c::d}` is (a, b) and (a, c, d)."""
    head, brace, tail = text.partition("{")
    prefix = tuple(part for part in re.split(r"::|\s+as\s+\w+", head) if part)
    if not brace:
        yield prefix
        return
    depth, piece = 0, ""
    for sign in tail[: tail.rindex("}")] + ",":
        if sign == "," and depth == 0:
            if piece.strip():
                yield from (prefix + path for path in _tree(piece.strip()))
            piece = ""
            continue
        depth += (sign == "{") - (sign == "}")
        piece += sign


def rooms_of(graph: Graph) -> Graph:
    """Imports between rooms: folders, or files that stand alone. The root's `__init__.py` is above all."""
    rooms: Graph = {}
    for file, imported in graph.items():
        rooms.setdefault(_room(file), set()).update(_room(other) for other in imported)
    return {room: imported - {room} for room, imported in rooms.items()}


def _room(file: str) -> str:
    return file.split("/")[0].removesuffix(".rs").removesuffix(".py")


def circles(graph: Graph) -> list[list[str]]:
    """Groups that import one another in circles, the largest first, by Tarjan's algorithm."""
    order: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(node: str) -> None:
        order[node] = low[node] = len(order)
        stack.append(node)
        for other in sorted(graph.get(node, ())):
            if other not in order:
                visit(other)
                low[node] = min(low[node], low[other])
            elif other in stack:
                low[node] = min(low[node], order[other])
        if low[node] == order[node]:
            group = stack[stack.index(node) :]
            del stack[stack.index(node) :]
            if len(group) > 1:
                found.append(sorted(group))

    for node in sorted(graph):
        if node not in order:
            visit(node)
    return sorted(found, key=len, reverse=True)


def climbing(graph: Graph, floors: list[str]) -> list[str]:
    """Imports of files from rooms that are declared later."""
    told = []
    for file, imported in sorted(graph.items()):
        for other in sorted(imported):
            here, there = _room(file), _room(other)
            if here in floors and there in floors and floors.index(there) > floors.index(here):
                told.append(f"{file} imports {other}, which stands higher")
    return told


def _report(name: str, graph: Graph, floors: list[str], shown: bool) -> Iterable[str]:
    """Prints the figures; yields the faults."""
    rooms = rooms_of(graph)
    arrows = sum(map(len, graph.values()))
    print(f"{name}: {len(graph)} files in {len(rooms)} rooms, {arrows} imports")
    if shown:
        for room in [room for room in floors if room in rooms] or sorted(rooms):
            print(f"  {room}: {', '.join(sorted(rooms[room])) or '-'}")
    for kind, of in (("files", graph), ("rooms", rooms)):
        for circle in circles(of):
            yield f"{name}: {len(circle)} {kind} in a circle: {', '.join(circle)}"
    yield from (f"{name}: {text}" for text in climbing(graph, floors))


def main() -> int:
    """Checks the tree that this script stands in, or another."""
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=raw)
    parser.add_argument("--tree", type=Path, default=Path(__file__).parents[1], help="root of the repository")
    parser.add_argument("--graph", action="store_true", help="print which room imports which")
    given = parser.parse_args()
    crate, package = given.tree / "crates/core/src", given.tree / "python/polypod"
    floors = re.findall(r"^(?:pub(?:\(crate\))? )?mod (\w+);", (crate / "lib.rs").read_text(), re.MULTILINE)
    contents = ast.get_docstring(ast.parse((package / "__init__.py").read_text())) or ""
    listed = re.findall(r"^- ((?:`\w+`(?:, )?)+):", contents, re.MULTILINE)
    rooms = [room for line in listed for room in re.findall(r"\w+", line)]
    faults = [
        *_report("Rust", rust_files(crate), floors, given.graph),
        *_report("Python", python_files(package), rooms, given.graph),
    ]
    print("\n".join(faults) or "no circles, nothing climbs")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
