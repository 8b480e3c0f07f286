"""Degrees of freedom, redundant and passive ones of mechanisms that are known, in the terms of Eq. 1."""

from collections import Counter
from typing import Any

import polypod as pp
from support.mechanism_files import BUILT_IN, FILES, GOUGH, MIDDLE, RPS, UP, changed


def test_mobility_of_the_paper() -> None:
    m = pp.load(BUILT_IN).mobility()
    assert (m.dof, m.joint_freedoms, m.links, m.joints, m.loops) == (5, 27, 13, 16, 4)
    assert (m.closure_rank, m.redundant, m.redundant_legs) == (22, 2, ("1", "3"))
    assert (m.passive, m.passive_legs) == (0, ())
    assert m.constraint_rows == (("1", "A"), ("3", "A"), ("3", "E"))
    assert m.independent_rows == (0,)
    assert m.published is not None
    assert (m.published.dof, m.published.redundant, m.published.passive) == (5, 3, 1)


def eq1(m: Any, redundant: int, passive: int) -> int:
    """M of Eq. 1."""
    freedoms: int = 6 * (m.links - m.joints - 1) + m.joint_freedoms + redundant - passive
    return freedoms


def test_graph_of_the_paper() -> None:
    """Fig. 1b: a quaternary base, a pentagonal platform, a ternary rod and ten binary links."""
    m = pp.load(BUILT_IN).mobility()
    assert [(link.name, len(link.joints)) for link in m.graph_links[:3]] == [
        ("base", 4),
        ("platform", 5),
        ("rod L", 3),
    ]
    assert [len(link.joints) for link in m.graph_links[3:]] == [2] * 10
    assert Counter(joint.kind for joint in m.graph_joints) == {"R": 3, "P": 5, "U": 5, "S": 3}
    for i, joint in enumerate(m.graph_joints):
        assert [i in link.joints for link in m.graph_links] == [k in joint.links for k in range(13)]
    assert eq1(m, m.redundant, m.passive) == m.dof
    assert eq1(m, m.published.redundant, m.published.passive) == m.dof


def gough(joint: str, **more: Any) -> dict[str, Any]:
    """The Stewart-Gough platform with these joints at the base."""
    tables = changed(GOUGH)
    for leg in tables["legs"]:
        leg["base"] = {"joint": joint, "point": leg["base"]["point"]} | more
    return tables


def test_mobility_of_6_sps_has_the_spin_of_each_leg() -> None:
    mech = pp.Mechanism.from_dict(gough("S"))
    m = mech.mobility()
    assert (m.dof, m.links, m.joints, m.joint_freedoms, m.loops) == (6, 14, 18, 42, 5)
    assert (m.closure_rank, m.redundant, m.redundant_legs) == (30, 0, ())
    assert (m.passive, m.passive_legs) == (6, tuple("123456"))
    assert m.constraint_rows == m.independent_rows == ()
    assert eq1(m, 0, 6) == 6
    assert any("legs 1, 2, 3, 4, 5, 6 spin freely" in warning for warning in mech.warnings)


def test_mobility_of_6_ups() -> None:
    m = pp.load(FILES[GOUGH]).mobility()
    assert (m.dof, m.joint_freedoms, m.closure_rank, m.redundant, m.passive) == (6, 36, 30, 0, 0)


def test_mobility_of_3_rps() -> None:
    m = pp.load(FILES[RPS]).mobility()
    assert (m.dof, m.links, m.joints, m.joint_freedoms, m.loops) == (3, 8, 9, 15, 2)
    assert (m.closure_rank, m.redundant, m.passive) == (12, 0, 0)
    assert m.constraint_rows == (("1", "B"), ("2", "B"), ("3", "B"))
    assert m.independent_rows == (0, 1, 2)


def test_mobility_of_a_tricept() -> None:
    """3-UPS and a passive UPF leg in the middle, which leaves the platform two turns and a stroke."""
    tables = gough("U", axis=[1.0, 0.0, 0.0])
    centre = {
        "name": "centre",
        "actuated": False,
        "base": UP | {"axis": [1, 0, 0]},
        "platform": {"joint": "F", "point": MIDDLE, "axis": [0, 0, 1], "normal": [0, 1, 0]},
    }
    tables["legs"] = [*tables["legs"][::2], centre]
    mech = pp.Mechanism.from_dict(tables)
    m = mech.mobility()
    assert mech.leg_letters[-1] == "UPF"
    assert mech.leg_names == ("1", "2", "3", "centre")
    assert mech.actuated.tolist() == [True, True, True, False]
    assert (m.dof, m.redundant, m.passive) == (3, 0, 0)
    assert {leg for leg, _ in m.constraint_rows} == {"centre"}
    assert len(m.independent_rows) == 3
    assert eq1(m, 0, 0) == 3
