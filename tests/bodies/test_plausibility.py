"""Masses and inertias in another unit than meant are told, those of the built-in machines are not."""

from __future__ import annotations

import pytest

import polypod as pp
from polypod.files.body_plausibility import implausible_bodies
from polypod.mechanism import spans
from polypod.summary.mechanism_facts import catalogue

NAME = "lu-3spu-2rpu-r"


def doubts(mech: pp.Mechanism) -> list[str]:
    return [warning for warning in mech.warnings if "Check the units" in warning]


@pytest.mark.parametrize("name", [entry["name"] for entry in catalogue()])
def test_built_in_machines_are_plausible(name: str):
    mech = pp.load(name)
    assert implausible_bodies(mech.geometry, float(spans(mech).max())) == []


@pytest.mark.parametrize(
    ("place", "value", "expected"),
    [
        (
            ("platform", "mass"),
            4000,
            "heavier than a cube of steel with edges like the longest leg: platform (4000 kg)",
        ),
        (
            ("platform", "inertia"),
            [5e4] * 3,
            "radii of gyration are far larger than the machine: platform (129000 mm)",
        ),
        (
            ("units", "inertia"),
            "g mm^2",
            "far smaller than the machine: platform (0.0408 mm), rod L (0.0316 mm) and 10 more",
        ),
    ],
)
def test_other_units_than_meant_are_told(place: tuple[str, str], value: object, expected: str):
    data = pp.load(NAME).to_dict()
    data[place[0]][place[1]] = value
    (warning,) = doubts(pp.Mechanism.from_dict(data))
    assert expected in warning
    assert "the longest leg has 754.4 mm at the centre pose" in warning


def test_they_are_told_in_units_of_the_file():
    data = pp.load(NAME).to_dict()
    data["units"]["mass"], data["platform"]["mass"] = "lb", 1e4
    (warning,) = doubts(pp.Mechanism.from_dict(data))
    assert "like the longest leg: platform (10000 lb); the longest leg has 754.4 mm" in warning


def test_a_mass_next_to_zero_is_told_without_overflow(recwarn: pytest.WarningsRecorder):
    data = pp.load(NAME).to_dict()
    data["platform"]["mass"] = 5e-324
    (warning,) = doubts(pp.Mechanism.from_dict(data))
    assert "far larger than the machine: platform" in warning
    assert not recwarn.list
