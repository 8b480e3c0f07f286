"""The check of the import graph finds circles and imports that climb, in small trees made for it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from support import ROOT

RUST = {
    "lib.rs": "pub mod number;\npub mod model;\npub mod dynamics;\n",
    "number.rs": "pub type Real = f64;\n",
    "model/mod.rs": "pub mod spec;\n",
    "model/spec.rs": "use crate::number::Real;\n",
    "dynamics/mod.rs": "pub mod forces;\n",
    "dynamics/forces.rs": "use crate::{model::spec, number::Real};\n",
}
PYTHON = {
    "__init__.py": "from polypod.mechanism import Mechanism\n",
    "errors.py": "import math\n",
    "mechanism.py": "from polypod.files.schema import read\n\nMechanism = read\n",
    "files/__init__.py": "",
    "files/schema.py": "from polypod import errors\n\nread = errors\n",
}


def checked(folder: Path, rust: dict[str, str], python: dict[str, str]) -> tuple[int, str]:
    """Exit status and output of the tool for a tree with these files in place of the sound ones, or more."""
    for root, files in (("crates/core/src", RUST | rust), ("python/polypod", PYTHON | python)):
        for name, text in files.items():
            path = folder / root / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
    command = [sys.executable, ROOT / "tools" / "imports.py", "--tree", folder]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


def test_a_sound_tree_passes(tmp_path):
    status, told = checked(tmp_path, {}, {})
    assert status == 0, told
    assert "Rust: 5 files in 3 rooms, 3 imports" in told
    assert "Python: 5 files in 4 rooms, 3 imports" in told


@pytest.mark.parametrize(
    ("files", "told"),
    [
        ({"number.rs": "use crate::model::spec::Spec;\n"}, "number.rs imports model/spec.rs"),
        (
            {"model/spec.rs": "fn f() { crate::dynamics::forces::g() }\n"},
            "model/spec.rs imports dynamics/forces.rs",
        ),
        (
            {"model/spec.rs": "use crate::{\n    number::Real,\n    dynamics::{forces::Force as F},\n};\n"},
            "model/spec.rs imports dynamics/forces.rs",
        ),
    ],
)
def test_a_rust_room_may_not_import_a_higher_one(tmp_path, files, told):
    status, said = checked(tmp_path, files, {})
    assert status == 1
    assert f"Rust: {told}, which stands higher" in said


def test_what_tests_and_comments_name_is_no_import(tmp_path):
    text = "// crate::dynamics::forces\n\n#[cfg(test)]\nmod tests {\n    use crate::dynamics::forces;\n}\n"
    assert checked(tmp_path, {"model/spec.rs": text}, {})[0] == 0


def test_rust_files_of_one_room_may_not_import_one_another_in_a_circle(tmp_path):
    files = {
        "dynamics/mod.rs": "pub mod forces;\npub mod power;\n",
        "dynamics/forces.rs": "use super::power::Power;\n",
        "dynamics/power.rs": "use crate::dynamics::forces::Force;\n",
    }
    status, said = checked(tmp_path, files, {})
    assert status == 1
    assert "Rust: 2 files in a circle: dynamics/forces.rs, dynamics/power.rs" in said
    assert "rooms in a circle" not in said


@pytest.mark.parametrize(
    "text",
    [
        "from polypod.mechanism import Mechanism\n",
        "from .. import mechanism\n",
        "from ..mechanism import Mechanism\n",
        "import polypod.mechanism\n",
        "def later():\n    from polypod.mechanism import Mechanism\n",
        "from typing import TYPE_CHECKING\n\n"
        "if TYPE_CHECKING:\n    from polypod.mechanism import Mechanism\n",
    ],
)
def test_python_files_may_not_import_one_another_in_a_circle(tmp_path, text):
    status, said = checked(tmp_path, {}, {"files/schema.py": text})
    assert status == 1
    assert "Python: 2 files in a circle: files/schema.py, mechanism.py" in said
    assert "Python: 2 rooms in a circle: files, mechanism" in said


def test_rooms_may_be_in_a_circle_though_files_are_not(tmp_path):
    more = {"errors.py": "from polypod.files import units\n", "files/units.py": "LENGTH = 'm'\n"}
    status, said = checked(tmp_path, {}, more)
    assert status == 1
    assert "files in a circle" not in said
    assert "Python: 2 rooms in a circle: errors, files" in said


def test_the_largest_circle_is_told_whole(tmp_path):
    more = {"errors.py": "from polypod.mechanism import Mechanism\n"}
    assert "3 files in a circle: errors.py, files/schema.py, mechanism.py" in checked(tmp_path, {}, more)[1]
