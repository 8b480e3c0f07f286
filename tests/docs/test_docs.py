"""Checks of all that the texts say and can be tried: code, files, commands, links, names and labels.

How pages run is told in `pages.py`. Further rules: blocks whose first line is `# motion for NAME` must load
for that mechanism, and all states must be well, or some not if the line ends in `, beyond its limits`; the
rows of
those with `# leg lengths for NAME` must have poses; TOML blocks with a name and legs must load as mechanisms;
other TOML blocks must have no fault but missing parts.
"""

from __future__ import annotations

import doctest
import importlib
import importlib.util
import os
import pkgutil
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

import polypod as pp
from polypod.files.mechanism_spec import read_spec
from polypod.solution.poses_of_lengths import load_lengths
from polypod.solution.solve import VARIABLES
from support.pages import (
    DOCS,
    PAGES,
    ROOT,
    SHELLS,
    blocks,
    command_lines,
    pages_with,
    prose,
    read,
    run_doctest,
    run_page,
    short,
)

EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
PYTHON_SOURCES = sorted((ROOT / "python").rglob("*.py"))
RUST_SOURCES = sorted((ROOT / "crates").rglob("*.rs"))
CORE_FILES = {
    path.stem: path for path in (ROOT / "crates/core/src").rglob("*.rs") if path.parent.name != "batch"
}
TESTS = {path.stem: path for path in (ROOT / "tests").rglob("test_*.py")}
OPTIONAL = {"exudyn", "mujoco", "pinocchio", "trimesh", "viser"}  # of the extras; some modules need them
LAST_EQUATION = 44


@pytest.fixture(autouse=True)
def empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the texts' code may write; figures are not shown."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    return tmp_path


# --- code ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("page", pages_with("python", *SHELLS), ids=short)
def test_pages_run(page: Path, empty_folder: Path) -> None:
    if page.stem in ("engines", "verification") and find_spec("pinocchio") is None:
        pytest.skip("needs pinocchio")
    run_page(page, empty_folder)


MODULES = ["polypod", *(info.name for info in pkgutil.walk_packages(pp.__path__, "polypod."))]


@pytest.mark.parametrize("name", [name for name in MODULES if not name.endswith("__main__")])
def test_docstring_examples_run(name: str) -> None:
    try:
        module = importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name in OPTIONAL:
            pytest.skip(f"needs {error.name}")
        raise
    if name.startswith("polypod.verify") and find_spec("pinocchio") is None:
        pytest.skip("needs pinocchio")
    for test in doctest.DocTestFinder(exclude_empty=True).find(module):
        run_doctest(test)


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_run(path: Path, empty_folder: Path) -> None:
    command = [sys.executable, "-W", "error", str(path)]
    result = subprocess.run(command, cwd=empty_folder, env=os.environ, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert result.stdout
    assert "nan" not in result.stdout.lower()


def test_examples_are_numbered() -> None:
    assert [int(path.stem[:2]) for path in EXAMPLES] == list(range(1, len(EXAMPLES) + 1))


# --- files --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("page", pages_with("toml", "csv"), ids=short)
def test_file_blocks_are_sound(page: Path, empty_folder: Path) -> None:
    for block in blocks(page):
        if block.language not in ("toml", "csv"):
            continue
        where = f"{short(page)}, line {block.line}"
        if block.title:
            (empty_folder / block.title).write_text(block.text, encoding="utf-8")
        if motion_of := re.match(r"# motion for ([^\s,]+)(, beyond its limits)?\n", block.text):
            mech = pp.load(motion_of[1])
            path = empty_folder / f"block.{block.language}"
            path.write_text(block.text, encoding="utf-8")
            status = pp.solve(mech, pp.load_motion(path, mech)).dataset.status
            if motion_of[2]:
                assert (status == pp.Status.OK).any(), where
                assert (status != pp.Status.OK).any(), where
            else:
                assert (status == pp.Status.OK).all(), where
            continue
        if lengths_of := re.match(r"# leg lengths for (\S+)\n", block.text):
            mech = pp.load(lengths_of[1])
            path = empty_folder / f"block.{block.language}"
            path.write_text(block.text, encoding="utf-8")
            assert (mech.assembly_modes(load_lengths(path, mech)).number > 0).all(), where
            continue
        assert block.language == "toml", f"{where}: says of no mechanism that it is a motion for it"
        content = tomllib.loads(block.text)
        if "name" in content and "legs" in content:
            assert pp.Mechanism.from_toml(block.text, origin=where).warnings is not None
        else:
            _, faults = read_spec(content)
            wrong = [fault for fault in faults if not fault.message.startswith("is missing")]
            assert not wrong, f"{where}: {wrong}"


# --- commands -----------------------------------------------------------------------------------------------


def commands() -> Iterator[list[str]]:
    for page in PAGES:
        for block in blocks(page):
            if block.language in SHELLS:
                yield from (words for words, _ in command_lines(block) if words[0] in ("polypod", "make"))


def test_make_targets_exist() -> None:
    targets = set(re.findall(r"^([a-z-]+):", read(ROOT / "Makefile"), flags=re.MULTILINE))
    for name, *rest in commands():
        if name == "make":
            asked = {word for word in rest if not word.startswith("-") and "=" not in word}
            assert asked <= targets, f"make {' '.join(rest)}"


@pytest.mark.parametrize("words", [w for w in commands() if w[0] == "polypod"], ids=" ".join)
def test_commands_exist(
    words: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each subcommand has help, which names every option that is used."""
    subcommand = [word for word in words[1:2] if not word.startswith("-")]
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.setattr(sys, "argv", ["polypod", *subcommand, "--help"])
    with pytest.raises(SystemExit) as end:
        importlib.import_module("polypod.cli").main()
    assert end.value.code in (0, None)
    known = set(re.findall(r"(?<![\w-])--?[a-zA-Z][\w-]*", capsys.readouterr().out)) | {"--help"}
    used = {word.split("=")[0] for word in words[1:] if re.match(r"--?[a-zA-Z]", word)}
    assert used <= known, f"{' '.join(words)}: no option {used - known}"


# --- links and names ----------------------------------------------------------------------------------------


def anchors(page: Path) -> set[str]:
    """Those of the page and of what it includes."""
    included = re.findall(r'{% include-markdown "([^"]+)"', prose(page))
    texts = [prose(page), *(prose(page.parent / name) for name in included)]
    headings = [h for text in texts for h in re.findall(r"^#+ +(.+)$", text, flags=re.MULTILINE)]
    plain = (re.sub(r"[^\w\- ]", "", heading).strip().lower() for heading in headings)
    return {re.sub(r"[\s-]+", "-", heading) for heading in plain}


@pytest.mark.parametrize("page", [*PAGES, ROOT / "CHANGELOG.md"], ids=short)
def test_links_resolve(page: Path) -> None:
    text = prose(page)
    targets = re.findall(r"\]\(\s*<?([^)\s>]+)", text) + re.findall(r'(?:src|href)="([^"]+)"', text)
    for target in targets:
        if re.match(r"[a-z]+:", target):
            continue
        name, _, anchor = target.partition("#")
        path = (page.parent / name).resolve() if name else page
        assert path.exists(), f"{short(page)}: {target}"
        if anchor and path.suffix == ".md":
            assert anchor in anchors(path), f"{short(page)}: {target}"


def code_spans(page: Path) -> list[str]:
    return re.findall(r"`([^`\n]+)`", prose(page))


@pytest.mark.parametrize("page", PAGES, ids=short)
def test_names_of_the_interface_exist(page: Path) -> None:
    mech = pp.load("lu-3spu-2rpu-r")
    for span in code_spans(page):
        for owner, name in re.findall(r"\b(pp|mech)\.(\w+)", span):
            assert hasattr(pp if owner == "pp" else mech, name), f"{short(page)}: {span}"
        for module, name in re.findall(r"\b(polypod\.[a-z]+)\.(\w+)", span):
            found = importlib.import_module(module)
            known = hasattr(found, name) or importlib.util.find_spec(f"{module}.{name}")
            assert known, f"{short(page)}: {span}"


def test_the_map_names_what_exists() -> None:
    """Tests as `file.py::test` or `file.rs::test`, functions of the core as `module::function`."""
    counted = 0
    for span in code_spans(DOCS / "paper.md"):
        parts = re.fullmatch(r"(\w+)(\.py|\.rs)?((?:::\w+)+)", span)
        if not parts:
            continue
        counted += 1
        file, ending, name = parts[1], parts[2], parts[3].split("::")[-1]
        if ending == ".py":
            path, item = TESTS[file], rf"^def {name}\("
        elif ending == ".rs":
            path, item = ROOT / "crates/core/tests" / f"{file}.rs", rf"^fn {name}\("
        else:
            path, item = CORE_FILES[file], rf"\b(fn|struct|enum) {name}\b"
        assert path.is_file(), span
        assert re.search(item, read(path), flags=re.MULTILINE), span
    assert counted > LAST_EQUATION


def test_the_map_is_complete() -> None:
    """Every equation, table and figure of the paper has its row."""
    rows = re.findall(r"^\| ([^|]+?) \|", read(DOCS / "paper.md"), flags=re.MULTILINE)
    first = set().union(*(equations(row) for row in rows))
    assert first == set(range(1, LAST_EQUATION + 1))
    for name in ("Table I", "Table II", "Table III", "Fig. 1", "Fig. 2", "Fig. 3", "Fig. 4"):
        assert name in rows


def test_every_status_is_listed() -> None:
    rows = re.findall(r"^\| (\d+) \| `(\w+)` \|", read(DOCS / "notation.md"), flags=re.MULTILINE)
    assert {(int(code), name) for code, name in rows} == {(s.value, s.name) for s in pp.Status}


def test_variables_of_results_exist() -> None:
    text = read(DOCS / "motion-file.md").split("## Results")[1]
    rows = [line.split("|")[1] for line in text.split("\n") if line.startswith("| `")]
    named = {name for row in rows for name in re.findall(r"`(\w+)`", row)}
    assert {name for name in named if not name.startswith("coordinate_")} == {*VARIABLES, "status"}


# --- labels -------------------------------------------------------------------------------------------------


def labels(text: str) -> list[str]:
    """Contents of brackets that begin with `Eq.` or with a label such as `T5`; ranges as one."""
    text = re.sub(r"\]\s*-\s*\[", "-", text.replace("\\[", "[").replace("\\]", "]"))
    return re.findall(r"\[((?:Eqs?\. ?|T)\d[^\[\]]*)\]", text)


def spans(pairs: list[tuple[str, str]]) -> set[int]:
    return {n for a, b in pairs for n in range(int(a), int(b or a) + 1)}


def theorems(label: str) -> set[int]:
    return spans(re.findall(r"\bT(\d+)(?:\s*[-–]\s*T?(\d+))?", label))


def equations(label: str) -> set[int]:
    """Numbers after `Eq.`, in lists and ranges, also such as 34a."""
    numbers: set[int] = set()
    for run in re.findall(r"Eqs?\. ?((?:\d+[a-d]?(?:\s*[-–]\s*\d+[a-d]?)?(?:, |,| and )?)+)", label):
        numbers |= spans(re.findall(r"(\d+)[a-d]?(?:\s*[-–]\s*(\d+))?", run))
    return numbers


def test_labels_are_read() -> None:
    text = r"a \[T2\]-\[T4\], [T; 6], [Eq. 40, completed] [T13]"
    assert labels(text) == ["T2-T4", "Eq. 40, completed", "T13"]
    assert theorems("Eq. 2, 5, T19-T23") == {19, 20, 21, 22, 23}
    assert equations("Eq. 2, 5, T19-T23") == {2, 5}
    assert equations("Eq. 34a, 34b and 35-37") == {34, 35, 36, 37}


def defined() -> list[int]:
    return [int(n) for n in re.findall(r"\*\*\[T(\d+)\]\*\*", read(DOCS / "theory.md"))]


def test_theory_counts_its_labels() -> None:
    assert defined() == list(range(1, len(defined()) + 1))


@pytest.mark.parametrize("path", [*RUST_SOURCES, *PYTHON_SOURCES, *PAGES], ids=short)
def test_labels_exist(path: Path) -> None:
    text = read(path)
    for label in labels(text):
        assert theorems(label) <= {*defined()}, f"{short(path)}: [{label}]"
    assert equations(text) <= {*range(1, LAST_EQUATION + 1)}


def test_theory_is_used() -> None:
    """Every labelled step of the theory stands beside the code that does it."""
    used = set().union(
        *(theorems(label) for path in [*RUST_SOURCES, *PYTHON_SOURCES] for label in labels(read(path)))
    )
    assert {*defined()} - used == set()
