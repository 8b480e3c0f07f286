"""The reference page holds every public name, and every public name has its docstring."""

from __future__ import annotations

import ast
import dataclasses
import importlib
import inspect
import re
import textwrap
from collections.abc import Iterator
from types import ModuleType
from typing import Any

import pytest

import polypod as pp
from polypod.answers.answer import Answer
from polypod.answers.derivatives import InverseDynamicsDerivatives
from polypod.answers.variables import variable
from support.pages import DOCS, read


def found_at(name: str) -> Any:
    """The module, class or function of a dotted name."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError:
        module, _, last = name.rpartition(".")
        return getattr(importlib.import_module(module), last)


def _inner(member: Any) -> Any:
    """The function of a class method or property."""
    for name in ("__func__", "fget", "func"):
        member = getattr(member, name, member)
    return member


def members(thing: Any) -> Iterator[tuple[str, Any]]:
    """Public names of a module or class that are made there."""
    for name, member in vars(thing).items():
        if name.startswith("_"):
            continue
        inner = _inner(member)
        if isinstance(thing, ModuleType) and getattr(inner, "__module__", None) != thing.__name__:
            continue
        if inspect.isclass(inner) or inspect.isroutine(inner):
            yield name, inner


def documented() -> dict[str, Any]:
    """All that the directives of the page bring, by module and name."""
    names: dict[str, Any] = {}
    for path, options in re.findall(r"^::: ([\w.]+)\n((?: {4}.*\n)*)", read(DOCS / "api.md"), re.MULTILINE):
        thing = found_at(path)
        chosen = re.search(r"members: \[([^]]*)\]", options)
        if chosen:
            brought = [(name, getattr(thing, name)) for name in chosen[1].replace(",", " ").split()]
        else:
            brought = [*members(thing)]
        for name, member in [("", thing), *brought]:
            if isinstance(member, ModuleType):
                names[member.__name__] = member
                continue
            if not (inspect.isclass(member) or inspect.isroutine(member)):
                continue  # a name for a type
            names[f"{member.__module__}.{member.__qualname__}"] = member
            if inspect.isclass(member) and name:
                names |= {f"{member.__module__}.{member.__qualname__}.{n}": m for n, m in members(member)}
    return names


def test_every_public_name_is_in_the_reference() -> None:
    names = documented()
    for name in pp.__all__:
        thing = getattr(pp, name)
        if isinstance(thing, ModuleType):
            assert thing.__name__ in names, name
        elif not isinstance(thing, str):  # the version
            assert f"{thing.__module__}.{thing.__qualname__}" in names, name


def test_every_method_of_a_mechanism_is_in_the_reference() -> None:
    names = documented()
    for name, _ in members(pp.Mechanism):
        assert f"polypod.mechanism.Mechanism.{name}" in names, name


@pytest.mark.parametrize("name", sorted(documented()))
def test_it_has_a_docstring(name: str) -> None:
    """Names without one are left out of the page."""
    assert inspect.getdoc(documented()[name]), name


# --- fields -------------------------------------------------------------------------------------------------


def fields_of(kind: type) -> dict[str, str]:
    """Docstrings below the fields of a data class, from the source."""
    body = ast.parse(textwrap.dedent(inspect.getsource(kind))).body[0].body  # type: ignore[attr-defined]
    found = {}
    for field, text in zip(body, [*body[1:], None], strict=True):
        if isinstance(field, ast.AnnAssign) and "ClassVar" not in ast.unparse(field.annotation):
            said = isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant)
            found[field.target.id] = inspect.cleandoc(text.value.value) if said else ""
    return found


RECORDS = {
    name: thing
    for name, thing in documented().items()
    if dataclasses.is_dataclass(thing)
    and (issubclass(thing, Answer) or thing.__module__.startswith("polypod.answers."))
}
ANSWERS = {name: kind for name, kind in RECORDS.items() if issubclass(kind, Answer) and kind is not Answer}


@pytest.mark.parametrize("name", sorted(RECORDS))
def test_every_field_is_documented(name: str) -> None:
    for field, said in fields_of(RECORDS[name]).items():
        assert said, f"{name}.{field}"


@pytest.mark.parametrize("name", sorted(ANSWERS))
def test_arrays_of_answers_are_told_with_shape_and_unit(name: str) -> None:
    """Those of the table of quantities, which datasets have."""
    kind = ANSWERS[name]
    fields = fields_of(kind)
    for field, key in kind._variables.items():
        about, said = variable(key), fields[field]
        shape = re.match(r"\((.*?),?\)", said)
        assert shape, f"{name}.{field} has no shape: {said}"
        leading = 0 if field in kind._same_for_all or "status" not in fields else 1  # else no batch
        assert len(shape[1].split(", ")) == leading + len(about.dims), f"{name}.{field}: {said}"
        if kind is InverseDynamicsDerivatives:
            continue  # its own text tells the rule
        for unit in re.split(r" and | or |, ", about.unit.partition(";")[0]):
            alone = rf"(?<![\w/^]){re.escape(unit)}(?![\w/^])"
            assert unit in ("", "1") or re.search(alone, said), f"{name}.{field} is in {unit}: {said}"
