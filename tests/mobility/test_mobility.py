"""Degrees of freedom against joint screws, and what Eq. 1 counts."""

from __future__ import annotations

from support import oracle as o
from support.cases import any_case, each


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
