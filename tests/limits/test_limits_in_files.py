"""Limits that a mechanism file cannot have, each named with its place."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import pytest

import polypod as pp
from support.limited import Tables, paper, tables

BAD: dict[str, tuple[Callable[[Tables], Any], str, str]] = {
    "range upside down": (
        lambda t: t["legs"][0]["base"].update(range={"min": 20.0, "max": -20.0}),
        "legs.1.base.range",
        "needs min < max, at most a full turn apart",
    ),
    "range of more than a rotation": (
        lambda t: t["legs"][0]["base"].update(range={"min": -200.0, "max": 200.0}),
        "legs.1.base.range",
        "at most a full turn apart",
    ),
    "range of a U joint": (
        lambda t: t["legs"][2]["platform"].update(range={"min": -20.0, "max": 20.0}),
        "legs.3.platform.range",
        "must not be given; only R joints have a range, this is U",
    ),
    "range of an S joint": (
        lambda t: t["legs"][1]["base"].update(range={"min": -20.0, "max": 20.0}),
        "legs.2.base.range",
        "this is S",
    ),
    "range without an end": (
        lambda t: t["legs"][0]["base"].update(range={"min": -20.0}),
        "legs.1.base.range.max",
        "is missing; needed here: min, max",
    ),
    "range of a rod upside down": (
        lambda t: t["rods"][0].update(range={"min": 20.0, "max": 20.0}),
        "rods.1.range",
        "needs min < max",
    ),
    "force upside down": (
        lambda t: t["legs"][0].update(force={"min": 20.0, "max": -20.0}),
        "legs.1.force",
        "min is 20 N, max is -20 N; needs min < max",
    ),
    "force of one number": (
        lambda t: t["legs"][0].update(force=500.0),
        "legs.1.force",
        "needs a table with min, max",
    ),
    "conditioning of nothing": (
        lambda t: t.update(limits={"sigma_min": 0.0}),
        "limits.sigma_min",
        "is 0; must be positive",
    ),
    "negative clearance": (
        lambda t: (t.update(limits={"clearance": -1.0}), [leg.update(radius=10.0) for leg in t["legs"]]),
        "limits.clearance",
        "is -1 mm; must be zero or positive",
    ),
    "clearance of a leg without radius": (
        lambda t: (t.update(limits={"clearance": 1.0}), [leg.update(radius=10.0) for leg in t["legs"][:4]]),
        "legs.5.radius",
        "is missing; limits.clearance needs it of every leg",
    ),
    "reach without clearance": (
        lambda t: t.update(limits={"joint_reach": 10.0}),
        "limits.joint_reach",
        "has no effect without limits.clearance",
    ),
    "reach of nothing": (
        lambda t: (t.update(limits={"clearance": 1.0, "joint_reach": -5.0}), t["legs"][0].update(radius=9.0)),
        "limits.joint_reach",
        "must be positive",
    ),
    "reach too short": (
        lambda t: (
            t.update(limits={"clearance": 1.0, "joint_reach": 16.0}),
            [leg.update(radius=10.0 + i) for i, leg in enumerate(t["legs"])],
            t["legs"][3].update(radius=15.0),
        ),
        "limits.joint_reach",
        'must exceed radius and clearance of leg "4", together 16 mm',
    ),
    "unknown key": (
        lambda t: t.update(limits={"sigma": 0.1}),
        "limits.sigma",
        'did you mean "sigma_min"',
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_a_wrong_limit_is_named(case: str):
    change, place, message = BAD[case]
    content = copy.deepcopy(paper())
    change(content)
    with pytest.raises(pp.MechanismError) as caught:
        pp.Mechanism.from_dict(content)
    assert place in [fault.place for fault in caught.value.faults]
    assert any(fault.place == place and message in fault.message for fault in caught.value.faults)


def test_a_passive_leg_has_no_force():
    content = tables("stewart-gough")
    content["legs"].append(
        {
            "name": "middle",
            "actuated": False,
            "force": {"min": -1.0, "max": 1.0},
            "base": {"joint": "S", "point": [0, 0, 0]},
            "platform": {"joint": "S", "point": [0, 0, 0]},
        }
    )
    with pytest.raises(pp.MechanismError) as caught:
        pp.Mechanism.from_dict(content)
    assert [f.place for f in caught.value.faults] == ["legs.7.force"]
    assert "passive" in caught.value.faults[0].message
