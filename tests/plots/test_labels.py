"""Names in pictures: beside what they name, over neither one another nor lines."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure

import polypod as pp
from polypod.paper.fig1 import fig1_poses
from polypod.plots import plot_fig1, plot_mechanism
from polypod.plots.labels import Name, size_of_text, spread
from support.pictures import overlaps

NONE = np.zeros((0, 2, 2))


def name(text, at, towards=(10.0, 0.0)):
    return Name(text, np.array(at, float), np.add(at, towards))


def shared(places, names, size=8.0):
    """The largest share of a name's area under another one."""
    half = np.array([size_of_text(each.text, size) for each in names]) / 2
    worst = 0.0
    for i in range(len(names)):
        for k in range(len(names)):
            gap = half[i] + half[k] - np.abs(places[i] - places[k])
            if i != k and (gap > 0).all():
                worst = max(worst, float(np.prod(np.minimum(gap, 2 * half[i])) / np.prod(2 * half[i])))
    return worst


def test_names_without_company_stand_where_they_are_wanted():
    names = [name("$b_1$", (0, 0)), name("$b_2$", (100, 0), (0, -9))]
    np.testing.assert_array_equal(spread(names, NONE, 8.0), [(10.0, 0.0), (100.0, -9.0)])
    assert spread([], NONE, 8.0).shape == (0, 2)


def test_names_of_points_close_together_part():
    names = [name(f"$b_{i}$", (2.0 * i, 1.0 * i)) for i in range(4)]
    wanted = np.array([each.wanted for each in names])
    assert shared(wanted, names) > 0.5
    places = spread(names, NONE, 8.0)
    assert shared(places, names) < 0.02
    points = np.array([each.point for each in names])
    assert np.linalg.norm(places - points, axis=1).max() < 25.0  # still beside what they name


@pytest.mark.parametrize("ends", [((0, -20), (40, 20)), ((-50, 0), (50, 0)), ((10, -50), (10, 50))])
def test_a_name_leaves_a_line(ends):
    [place] = spread([name("$L$", (0, 0))], np.array([ends], float), 8.0)
    start, way = np.array(ends[0], float), np.subtract(ends[1], ends[0])
    inside = start + np.linspace(0.0, 1.0, 500)[:, None] * way - place
    assert not (np.abs(inside) < np.array(size_of_text("$L$", 8.0)) / 2).all(axis=1).any()


def test_no_names_overlap_in_fig1():
    mech = pp.load("lu-3spu-2rpu-r")
    assert overlaps(plot_fig1(mech, fig1_poses(mech), Figure(figsize=(10.0, 8.2)))) == []


@pytest.mark.parametrize("mechanism", pp.list_mechanisms())
def test_no_names_of_built_in_mechanisms_overlap(mechanism):
    figure = Figure(figsize=(5.2, 5.4))
    plot_mechanism(pp.load(mechanism), ax=figure.add_axes((0.0, 0.0, 1.0, 1.0), projection="3d"))
    assert overlaps(figure) == []
