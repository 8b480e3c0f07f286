"""Kinds of joints and drives: Python's tables agree with the core and are complete."""

from __future__ import annotations

from typing import get_args

import pytest

import polypod as pp
from polypod.bodies.drives import DRAWINGS
from polypod.files.mechanism_schema import Leg
from polypod.files.mechanism_spec import DRIVE_TABLES
from polypod.files.units import si_unit
from polypod.legs.drives import DRIVES, KEYED, LINK_PLACE, drive_of_letters
from polypod.legs.joints import JOINTS, JointLetter
from support import sliders

BUILT_IN = ("hexaglide", "4pss-upu", "lu-3spu-2rpu-r", "3-rps", "4ups-up", "2rpu-spr")


@pytest.fixture(scope="module", params=[*sliders.LEGS, *BUILT_IN])
def mech(request):
    return pp.load(request.param) if request.param in BUILT_IN else sliders.mechanism(request.param)


def test_every_kind_has_its_entry_in_every_table():
    assert {*DRAWINGS} == {*DRIVES}
    assert {*DRIVE_TABLES} == {*KEYED}
    assert {*Leg.model_fields} >= {*KEYED, *LINK_PLACE}
    assert {*JOINTS} == {*get_args(JointLetter)}


def test_the_core_says_the_same_of_drives(mech):
    """Letters, links, the order of joints and units."""
    for name, letters, drive in zip(mech.leg_names, mech.leg_letters, mech.drives, strict=True):
        assert drive_of_letters(letters) == drive
        joints = {joint.name.removesuffix(f" {name}"): joint for joint in mech.joint_list}
        own = joints[drive.joint]
        first, second = (f"{link} {name}" for link in drive.links)
        assert own.kind == drive.letter
        between = own.links if drive.moves_foot else joints["base joint"].links
        assert between[1] == first
        between = joints["base joint"].links if drive.moves_foot else own.links
        assert between == (first, second)
    of_kinds = {"stroke": "coordinate_kind", "force": "force_kind"}
    for limit in mech.limit_list:
        if kind := of_kinds.get(limit.kind.split()[0]):
            drive = mech.drives[mech.leg_names.index(limit.legs[0])]
            assert limit.unit == si_unit(getattr(drive, kind))


def test_the_core_counts_the_same_freedoms_of_joints(mech):
    mobility = mech.mobility()
    letters = {drive.letter for drive in DRIVES}
    freedoms = [
        1 if joint.kind in letters else JOINTS[joint.kind].freedoms for joint in mobility.graph_joints
    ]
    assert sum(freedoms) == mobility.joint_freedoms
