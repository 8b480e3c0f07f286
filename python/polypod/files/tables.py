"""Tables of files: their keys and types, and every fault of one, in words."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, TypeVar, get_args

from annotated_types import Ge, Len
from pydantic import BaseModel, ConfigDict, Field, Strict, ValidationError

from polypod.errors import Fault, alternatives, place_of, shown


class Table(BaseModel):
    """A table of a file: its fields are the keys that it may have."""

    # Built when first read: most tables of a schema are parts of others, and never read by themselves.
    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)

    forms: ClassVar[dict[str, str]] = {}
    """Forms that an array may have under a key; [x, y, z] by default."""


TAGS = ("<polar>", "<vector>", "<number>", "<matrix>")
"""Of alternatives: they end up in the place of an error, and are left out of it again."""
Number = Annotated[float, Strict(), Field(allow_inf_nan=False)]
Count = Annotated[int, Strict(), Ge(0)]
Vector = Annotated[list[Number], Len(3, 3)]
Name = Annotated[str, Field(pattern=r"^\P{C}*[^\p{C}\p{Z}]\P{C}*$")]


AnyTable = TypeVar("AnyTable", bound=Table)

_NEEDED = {
    "float_type": "a finite number",
    "finite_number": "a finite number",
    "int_type": "a whole number",
    "bool_type": "true or false",
    "string_type": "text in quotes",
    "string_pattern_mismatch": "some text in one line",
}


def read_table(model: type[AnyTable], data: object, place: str, faults: list[Fault]) -> AnyTable | None:
    """`data` as a `model`; what is wrong with it is added to `faults`.

    Unknown keys and optional parts that cannot be read are then left out; None if what remains is not enough.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        problems = error.errors(include_url=False)
    wrong = set()
    for problem in problems:
        *holders, last = problem["loc"] or ("",)
        path = [part for part in (*holders, last) if part not in TAGS and part != ""]
        if problem["type"] == "extra_forbidden":  # whatever the file calls it
            path = [*(part for part in holders if part not in TAGS), last]
        faults.append(Fault(_place(place, path), _message(model, path, dict(problem))))
        if path and problem["type"] != "extra_forbidden":
            wrong.add(path[0])
    if not isinstance(data, dict):
        return None
    try:
        rest = {key: value for key, value in data.items() if key not in wrong}
        return model.model_validate(rest, extra="ignore")
    except ValidationError:
        return None


def _place(section: str, path: list[int | str]) -> str:
    """Dotted, list entries counted from 1."""
    inside = place_of(*(part + 1 if isinstance(part, int) else part for part in path))
    return ".".join(part for part in (section, inside) if part)


def _message(model: type[Table], path: list[int | str], problem: dict[str, Any]) -> str:
    """The value found, and the valid ones."""
    keys = [part for part in path if isinstance(part, str)]
    match problem["type"]:
        case "missing":
            return f"is missing; needed here: {', '.join(_required(_table_at(model, keys[:-1])))}"
        case "extra_forbidden":
            return f"is no key here; {alternatives(keys[-1], _table_at(model, keys[:-1]).model_fields)}"
        case "model_type":
            needed = f"a table with {', '.join(_required(_table_at(model, keys)))}"
        case "literal_error":
            needed = str(problem["ctx"]["expected"]).replace("'", '"')
        case "greater_than_equal":
            needed = f"at least {problem['ctx']['ge']}"
        case "too_short" | "too_long" | "list_type":
            needed = model.forms.get(keys[-1] if keys else "", "[x, y, z]")
        case kind:
            needed = _NEEDED.get(kind, problem["msg"])
    return f"is {shown(problem['input'])}; needs {needed}"


def _table_at(model: type[Table], keys: list[str]) -> type[Table]:
    """The table under keys, each in that of the one before."""
    for key in keys:
        model = next(_tables_in(model.model_fields[key].annotation))
    return model


def _tables_in(annotation: Any) -> Iterator[type[Table]]:
    """Those that a type may be: such as that of `Range | None`."""
    if isinstance(annotation, type) and issubclass(annotation, Table):
        yield annotation
    for part in get_args(annotation):
        yield from _tables_in(part)


def _required(model: type[Table]) -> list[str]:
    fields = model.model_fields
    return [key for key in fields if fields[key].is_required()] or list(fields)
