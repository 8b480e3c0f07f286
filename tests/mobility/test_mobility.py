"""Degrees of freedom against joint screws, and what Eq. 1 counts."""

from __future__ import annotations

import numpy as np
import pytest

import polypod as pp
from polypod.errors import MechanismError
from support import oracle as o
from support.cases import any_case, each
from support.mechanism_files import SI_UNITS


@each
def test_mobility(name):
    c = any_case(name)
    counted = o.mobility(c.spec, (c.pose[0][3], c.pose[1][3]))
    freedoms = o.dof(c.spec, (c.pose[0][3], c.pose[1][3]))
    m = c.mech.mobility()
    assert c.mech.dof == m.dof == freedoms
    for key in ("links", "joints", "joint_freedoms", "loops", "closure_rank"):
        assert getattr(m, key) == getattr(counted, key), key
    assert m.redundant == 6 * counted.loops - counted.closure_rank
    assert m.passive == counted.joint_freedoms - counted.closure_rank - freedoms


def _six_upu(*, parallel: bool) -> dict[str, object]:
    """Six legs with U joints at both ends, whose axes are parallel, or with the leg in a plane."""
    legs = []
    for i, (a, b) in enumerate(zip([10, 110, 130, 230, 250, 350], [50, 70, 170, 190, 290, 310], strict=True)):
        foot, end = (np.array([np.cos(np.radians(x)), np.sin(np.radians(x)), 0.0]) for x in (a, b))
        leg = 0.5 * end + np.array([0.0, 0.0, 1.0]) - foot
        other = foot if parallel else foot + 0.1 * (i + 1) * leg
        legs.append(
            {
                "base": {"joint": "U", "point": foot.tolist(), "axis": foot.tolist()},
                "platform": {"joint": "U", "point": (0.5 * end).tolist(), "axis": other.tolist()},
            }
        )
    return {"name": "6-UPU", "units": SI_UNITS, "home": {"position": [0, 0, 1.0]}, "legs": legs}


def test_legs_with_universal_joints_at_both_ends_are_explained():
    """Whoever writes six of them mostly means UPS legs."""
    (warning,) = (w for w in pp.Mechanism.from_dict(_six_upu(parallel=True)).warnings if "UPS" in w)
    assert "U joints at both ends (1, 2, 3, 4, 5, 6)" in warning
    with pytest.raises(MechanismError) as caught:
        pp.Mechanism.from_dict(_six_upu(parallel=False))
    assert any("has a spherical joint at one end, UPS or SPU" in str(f) for f in caught.value.faults)


def test_slider_legs_with_universal_joints_at_both_ends_are_explained_by_their_own_letters():
    data = pp.load("3-puu").to_dict()
    data["legs"][0]["platform"]["axis"] = [0.3, 0.4, 0.5]
    with pytest.raises(MechanismError) as caught:
        pp.Mechanism.from_dict(data)
    (told,) = {str(f) for f in caught.value.faults if "(PUU)" in str(f)}
    assert "has a spherical joint at one end, PUS or PSU" in told
