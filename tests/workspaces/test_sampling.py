"""How far the volume of a mesh is off, by places tried at random: bodies that are known."""

from __future__ import annotations

import numpy as np
import pytest

import polypod as pp
from polypod.workspaces.boundary import Cuts, content, open_edges, surface
from polypod.workspaces.sampling import enclosed, sampled_difference

MIDDLE = np.array([10.3, 9.8, 10.1])
RADIUS = 7.6


def ball(d: int):
    """A ball on a grid of unit cells: mask, and mesh with exact cuts."""
    places = np.stack(np.meshgrid(*[np.arange(21.0)] * d, indexing="ij"), axis=-1) - MIDDLE[:d]
    mask = np.linalg.norm(places, axis=-1) < RADIUS
    node, direction = open_edges(mask)
    inner = places.reshape(-1, d)[node]
    along = inner[np.arange(len(node)), direction // 2] * (2 * (direction % 2) - 1)
    share = -along + np.sqrt(along**2 + RADIUS**2 - np.sum(inner**2, axis=1))
    return mask, surface(mask, Cuts(node, direction, share))


@pytest.mark.parametrize("d", [2, 3])
def test_places_are_told_inside_from_outside(d):
    """The share of places inside is the mesh's volume; wrong is none but where faces bulge."""
    _, shape = ball(d)
    places = np.random.default_rng(0).uniform(0.0, 20.0, (100_000, d))
    inside = enclosed(shape, places)
    away = np.linalg.norm(places - MIDDLE[:d], axis=1) - RADIUS
    assert inside[away < -0.2].all()
    assert not inside[away > 0.0].any()
    share = content(shape) / 20.0**d
    assert inside.mean() == pytest.approx(share, abs=4 * np.sqrt(share / 100_000))


@pytest.mark.parametrize("d", [2, 3])
def test_any_mesh_encloses_its_volume(d):
    rng = np.random.default_rng(1)
    for _ in range(5):
        mask = rng.random((6, 7, 8)[:d]) < 0.5
        node, direction = open_edges(mask)
        shape = surface(mask, Cuts(node, direction, rng.uniform(0.05, 0.95, len(node))))
        low, high = shape.places.min(axis=0), shape.places.max(axis=0)
        places = rng.uniform(low, high, (40_000, d))
        box = np.prod(high - low)
        share = content(shape) / box
        assert enclosed(shape, places).mean() == pytest.approx(share, abs=4 * np.sqrt(share / 40_000))


def off(reaches, d=3):
    mask, shape = ball(d)
    box = np.tile([0.0, 20.0], (d, 1))
    return sampled_difference(mask, shape, box, reaches, 4096), content(shape)


def test_a_ball_has_its_volume_within_the_bound():
    difference, volume = off(lambda places: np.linalg.norm(places - MIDDLE, axis=1) < RADIUS)
    exact = 4 / 3 * np.pi * RADIUS**3
    assert abs(exact - volume) < difference.bound < 0.03 * exact
    assert abs(exact - volume - difference.mean) < 4 * difference.deviation


@pytest.mark.parametrize(
    ("part", "size"),
    [
        ("needle", 0.5 * 0.5 * 2.1),  # thinner than a cell, beyond the ball
        ("hole", -4 / 3 * np.pi * 1.5**3),
        ("slab", 20.0 * 20.0 * 0.4),  # apart from the ball
    ],
)
def test_what_the_grid_missed_is_within_the_bound(part, size):
    def reaches(places):
        away = np.linalg.norm(places - MIDDLE, axis=1)
        inside = away < RADIUS
        if part == "needle":
            across = np.abs(places[:, :2] - 10.45).max(axis=1) < 0.25
            return inside | (across & (places[:, 2] > 10.0) & (places[:, 2] < 17.7 + 2.1))
        if part == "hole":
            return inside & (away > 1.5)
        return inside | (np.abs(places[:, 0] - 1.5) < 0.2)

    difference, volume = off(reaches)
    missed = 4 / 3 * np.pi * RADIUS**3 + size - volume
    assert abs(missed - difference.mean) < 4 * difference.deviation
    assert abs(missed) < difference.bound + 2 * difference.deviation


def test_the_volume_of_a_thin_shell_is_within_its_error():
    """Strokes of 20 mm at a fixed orientation: the meet of six shells, a few cells of a coarse grid wide."""
    mech = pp.load("ups-hexapod")
    data = mech.to_dict()
    for leg, length in zip(data["legs"], mech.inverse_kinematics(mech.home).lengths, strict=True):
        leg["stroke"] = {"min": length - 0.02, "max": length + 0.02}
    thin = pp.Mechanism.from_dict(data)
    at = {"rx": 0.0, "ry": 0.0, "rz": 0.0}
    fine = pp.workspace(thin, ["x", "y", "z"], at)
    for step in (0.01, 0.005):
        coarse = pp.workspace(thin, ["x", "y", "z"], at, step=step)
        assert abs(coarse.volume - fine.volume) < coarse.volume_error
        assert np.allclose(coarse.extents, fine.extents, atol=1e-7, rtol=0)
