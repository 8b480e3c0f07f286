"""What is imported when: nobody waits for packages that are not needed yet."""

from __future__ import annotations

import subprocess
import sys

import pytest

LARGE = ("jinja2", "matplotlib", "pandas", "plotly", "scipy", "skimage", "trimesh", "xarray")


def imported(code: str, names: tuple[str, ...]) -> list[str]:
    """Those of the packages that a new interpreter has imported after some code."""
    told = f"import sys; print('\\n' + ' '.join(name for name in {names!r} if name in sys.modules))"
    run = subprocess.run(
        [sys.executable, "-c", f"{code}\n{told}"], capture_output=True, text=True, check=True
    )
    return run.stdout.split("\n")[-2].split()


def test_an_import_of_polypod_brings_numpy_alone() -> None:
    assert imported("import polypod", ("numpy", *LARGE, "pydantic", "tomllib", "tomli_w")) == ["numpy"]


ANSWERS = """
mech.state(at, {"h": 0.1}), mech.coordinates(pose), mech.inverse_kinematics(pose), mech.jacobian(pose)
mech.hessian(pose), mech.kinematics(pose, rest, rest), mech.platform_twist(pose, legs)
mech.platform_acceleration(pose, rest, legs), mech.conditioning(pose), mech.determinant(pose, rest)
mech.singularity(pose), mech.freedom_screws(pose), mech.constraint_screws(pose)
mech.singularity_distance(pose), mech.forward_kinematics(mech.inverse_kinematics(pose).lengths, pose)
mech.assembly_modes(mech.inverse_kinematics(pose).lengths), mech.inverse_dynamics(pose, rest, rest)
mech.joint_reactions(pose, rest, rest), mech.forward_dynamics(pose, rest, legs)
mech.equations_of_motion(pose, rest), mech.power(pose, rest, rest), mech.limits(pose)
mech.inverse_dynamics_derivatives(pose, rest, rest), mech.regressor(pose, rest, rest)
mech.base_parameters(), mech.mobility(), mech.limit_list, mech.joint_list, mech.warnings
mech.coupled_forces(pose, mech.inverse_dynamics(pose, rest, rest).constraint)
"""


@pytest.mark.parametrize("line", ANSWERS.strip().splitlines())
def test_answers_at_states_need_no_more(line: str) -> None:
    code = f"""
import numpy as np, polypod as pp
mech = pp.load("lu-3spu-2rpu-r")
at = {{"alpha": 0.1, "p": -0.3, "h": 0.62, "beta": 0.7, "gamma": 0.6}}
pose, rest, legs = mech.pose(at), np.zeros(6), np.zeros(5)
print([repr(answer) for answer in ({line},)])
"""
    assert imported(code, LARGE) == []


def test_every_answer_at_states_is_among_those() -> None:
    import polypod as pp

    others = {"from_dict", "from_toml", "to_dict", "to_toml", "save", "pose"}
    methods = {
        name
        for name in dir(pp.Mechanism)
        if callable(getattr(pp.Mechanism, name)) and not name.startswith("_")
    }
    assert {name for name in methods - others if f"mech.{name}(" not in ANSWERS} == set()


@pytest.mark.parametrize("command", [["list"], ["info", "lu-3spu-2rpu-r"], ["list", "--json"]])
def test_commands_about_mechanisms_need_no_more(command: list[str]) -> None:
    code = f"""
import sys
from polypod.cli import main
sys.argv = ["polypod", *{command!r}]
try:
    main()
except SystemExit as end:
    assert not end.code
"""
    assert imported(code, LARGE) == []
