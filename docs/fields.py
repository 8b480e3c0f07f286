"""Build extension: the fields of data classes and named tuples stand in one table below the class."""

from typing import Any

import griffe


class Fields(griffe.Extension):
    """Takes what is said of each field into the docstring of its class, as a section of attributes."""

    def on_class(self, *, cls: griffe.Class, **_: Any) -> None:
        """Before the docstring is read."""
        if "dataclass" not in cls.labels and not any(str(base) == "NamedTuple" for base in cls.bases):
            return
        fields = [m for m in cls.attributes.values() if m.docstring and "property" not in m.labels]
        if not fields or cls.docstring is None:
            return
        lines = ["", "", "Attributes:"]
        for field in fields:
            text = field.docstring.value.replace("\n", "\n        ")
            lines.append(f"    {field.name}: {text}")
            field.docstring = None  # else it would have a heading of its own, too
        cls.docstring.value += "\n".join(lines)
